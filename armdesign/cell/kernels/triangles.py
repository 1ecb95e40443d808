"""Distance of points to triangles, by a tree of boxes about them, and whether points lie inside a closed mesh."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.kinematics.compilation import branch, entry, leaf

DEEPEST = 64
"""Most levels of a tree; one of halves over 2^32 triangles has fewer."""


class TriangleTree(NamedTuple):
    """Triangles in the order of a binary tree of boxes; a node's left child is the node behind it.

    Attributes:
        triangles: Corners, shape (F, 3, 3) [m].
        low: Lower corner of every node's box, shape (N, 3) [m].
        high: Its upper corner, shape (N, 3) [m].
        right: A node's right child; 0 of a leaf, shape (N,).
        first: First triangle of a leaf, shape (N,).
        count: Number of its triangles, shape (N,).
    """

    triangles: Array
    low: Array
    high: Array
    right: np.ndarray
    first: np.ndarray
    count: np.ndarray  # type: ignore[assignment]


@leaf
def box_square(tree, node, x, y, z):
    """Square of the distance of a point to a node's box [m^2]."""
    dx = max(tree.low[node, 0] - x, 0.0, x - tree.high[node, 0])
    dy = max(tree.low[node, 1] - y, 0.0, y - tree.high[node, 1])
    dz = max(tree.low[node, 2] - z, 0.0, z - tree.high[node, 2])
    return dx * dx + dy * dy + dz * dz


@branch
def triangle_square(corners, x, y, z):
    """Square of the distance of a point to a triangle, which may have no area [m^2].

    The nearest point is the foot on the plane where that lies inside; on one of the edges elsewhere.
    """
    e = (corners[1, 0] - corners[0, 0], corners[1, 1] - corners[0, 1], corners[1, 2] - corners[0, 2])
    f = (corners[2, 0] - corners[0, 0], corners[2, 1] - corners[0, 1], corners[2, 2] - corners[0, 2])
    p = (x - corners[0, 0], y - corners[0, 1], z - corners[0, 2])
    ee, ef, ff = dot(e, e), dot(e, f), dot(f, f)
    pe, pf = dot(p, e), dot(p, f)
    area = ee * ff - ef * ef
    s, t = ff * pe - ef * pf, ee * pf - ef * pe
    if area > 1e-14 * ee * ff and s >= 0.0 and t >= 0.0 and s + t <= area:
        s, t = s / area, t / area
        q = (p[0] - s * e[0] - t * f[0], p[1] - s * e[1] - t * f[1], p[2] - s * e[2] - t * f[2])
        return dot(q, q)
    g = (f[0] - e[0], f[1] - e[1], f[2] - e[2])
    r = (p[0] - e[0], p[1] - e[1], p[2] - e[2])
    return min(edge_square(p, e), edge_square(p, f), edge_square(r, g))


@leaf
def dot(a, b):
    """Inner product of two vectors of three numbers."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@leaf
def edge_square(p, e):
    """Square of the distance of p to the segment from 0 to e."""
    square = dot(e, e)
    s = min(max(dot(p, e) / square, 0.0), 1.0) if square > 0.0 else 0.0
    q = (p[0] - s * e[0], p[1] - s * e[1], p[2] - s * e[2])
    return dot(q, q)


@branch
def nearest_square(tree, x, y, z, bound, waiting):
    """Square of the distance of a point to the nearest triangle [m^2].

    Args:
        tree: TriangleTree.
        x: The point [m].
        y: See x.
        z: See x.
        bound: A square that it does not exceed [m^2].
        waiting: Room for the nodes to look at, shape (DEEPEST,).
    """
    best, top = bound, 1
    waiting[0] = 0
    while top > 0:
        top -= 1
        node = waiting[top]
        if box_square(tree, node, x, y, z) >= best:
            continue
        if tree.right[node] == 0:
            for i in range(tree.first[node], tree.first[node] + tree.count[node]):
                best = min(best, triangle_square(tree.triangles[i], x, y, z))
        else:
            near, far = node + 1, tree.right[node]
            if box_square(tree, far, x, y, z) < box_square(tree, near, x, y, z):
                near, far = far, near
            waiting[top], waiting[top + 1] = far, near
            top += 2
    return best


@entry
def grid_distances(tree, origin, spacing, shape):
    """Distance of every node of a grid to the nearest triangle.

    Args:
        tree: TriangleTree.
        origin: First node, shape (3,) [m].
        spacing: Distance of the nodes [m].
        shape: Number of nodes along x, y, z, shape (3,).

    Returns:
        Shape (V,), z fastest [m].
    """
    values = np.empty(shape[0] * shape[1] * shape[2])
    waiting = np.empty(DEEPEST, dtype=np.int64)
    at, before = 0, np.inf
    for i in range(shape[0]):
        for j in range(shape[1]):
            for m in range(shape[2]):
                x, y, z = origin[0] + i * spacing, origin[1] + j * spacing, origin[2] + m * spacing
                # the node before, one spacing away, bounds it
                bound = (before + 1.0001 * spacing) ** 2 if m > 0 else np.inf
                before = np.sqrt(nearest_square(tree, x, y, z, bound, waiting))
                values[at] = before
                at += 1
    return values


@entry
def point_distances(tree, points):
    """Distance of points, shape (N, 3), to the nearest triangle, shape (N,) [m]."""
    waiting = np.empty(DEEPEST, dtype=np.int64)
    values = np.empty(len(points))
    for i in range(len(points)):
        values[i] = np.sqrt(nearest_square(tree, points[i, 0], points[i, 1], points[i, 2], np.inf, waiting))
    return values


@leaf
def turn_of(ax, ay, bx, by):
    """Sign and twice the area of the triangle 0, a, b; where that is 0 a sign that every edge gets alike."""
    area = ay * bx - ax * by
    if area != 0.0:
        return (1 if area > 0.0 else -1), area
    if by != ay:
        return (1 if by > ay else -1), 0.0
    if ax != bx:
        return (1 if ax > bx else -1), 0.0
    return 0, 0.0


@branch
def crossing(corners, y, z):
    """Where the line along x through (y, z) crosses a triangle: sign of the crossing, 0 where it does not, and x.

    Lines through edges and corners count for exactly one of the triangles there (Bridson's simulation of simplicity),
    so a closed mesh is entered as often as it is left.
    """
    ay, az = corners[0, 1] - y, corners[0, 2] - z
    by, bz = corners[1, 1] - y, corners[1, 2] - z
    cy, cz = corners[2, 1] - y, corners[2, 2] - z
    sign, a = turn_of(by, bz, cy, cz)
    if sign == 0:
        return 0, 0.0
    other, b = turn_of(cy, cz, ay, az)
    third, c = turn_of(ay, az, by, bz)
    if other != sign or third != sign:
        return 0, 0.0
    total = a + b + c
    if total == 0.0:
        return sign, (corners[0, 0] + corners[1, 0] + corners[2, 0]) / 3.0
    return sign, (a * corners[0, 0] + b * corners[1, 0] + c * corners[2, 0]) / total


@leaf
def node_span(a, b, c, origin, spacing, nodes):
    """The nodes along an axis, from and up to, that a triangle with these coordinates can lie at."""
    low, high = (min(a, b, c) - origin) / spacing, (max(a, b, c) - origin) / spacing
    return max(int(np.floor(low)), 0), min(int(high) + 2, nodes)


@entry
def grid_windings(triangles, origin, spacing, shape):
    """How often a closed mesh winds about every node of a grid: 0 outside.

    Args:
        triangles: Corners, shape (F, 3, 3) [m].
        origin: First node, shape (3,) [m].
        spacing: Distance of the nodes [m].
        shape: Number of nodes along x, y, z, shape (3,).

    Returns:
        Shape of the grid.
    """
    winding = np.zeros((shape[0], shape[1], shape[2]), dtype=np.int64)
    for f in range(len(triangles)):
        corners = triangles[f]
        y0, y1 = node_span(corners[0, 1], corners[1, 1], corners[2, 1], origin[1], spacing, shape[1])
        z0, z1 = node_span(corners[0, 2], corners[1, 2], corners[2, 2], origin[2], spacing, shape[2])
        for j in range(y0, y1):
            for m in range(z0, z1):
                sign, x = crossing(corners, origin[1] + j * spacing, origin[2] + m * spacing)
                if sign != 0:
                    # nodes behind the crossing, up to the next one, are on its other side
                    first = max(int(np.ceil((x - origin[0]) / spacing)), 0)
                    if first < shape[0]:
                        winding[first, j, m] += sign
    for i in range(1, shape[0]):
        winding[i] += winding[i - 1]
    return winding


@entry
def point_windings(triangles, points):
    """How often a closed mesh winds about points, shape (N, 3): shape (N,), 0 outside."""
    winding = np.zeros(len(points), dtype=np.int64)
    for i in range(len(points)):
        for f in range(len(triangles)):
            sign, x = crossing(triangles[f], points[i, 1], points[i, 2])
            if sign != 0 and x < points[i, 0]:
                winding[i] += sign
    return winding
