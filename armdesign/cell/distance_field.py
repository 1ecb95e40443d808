"""Distances on a grid: of a closed mesh, signed, and of the volume that the demonstrator's arm has swept."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.cell.kernels.distance import FieldArrays
from armdesign.cell.kernels.triangles import (
    TriangleTree,
    grid_distances,
    grid_windings,
    point_distances,
    point_windings,
)

MOST_NODES = 200_000
FINEST = 0.002
"""Smallest distance of a grid's nodes [m]."""
MARGIN = 0.1
"""How far a mesh's grid reaches beyond it [m]: farther away a body is clear of it."""
SWEPT_MARGIN = 0.3
LEAF = 4
"""Most triangles in a leaf of the tree."""


def triangle_tree(triangles: Array) -> TriangleTree:
    """A tree of boxes about triangles: halves by the middle of their centres, along the box's longest edge.

    Args:
        triangles: Corners, shape (F, 3, 3) [m].
    """
    centres, order = triangles.mean(axis=1), np.arange(len(triangles))
    boxes: list[Array] = []
    children: list[list[int]] = []  # right child, first triangle, number of triangles
    waiting = [(0, len(triangles), -1)]
    while waiting:
        first, end, parent = waiting.pop()
        if parent >= 0:
            children[parent][0] = len(boxes)
        members = order[first:end]
        corners = triangles[members]
        boxes.append(np.array([corners.min(axis=(0, 1)), corners.max(axis=(0, 1))]))
        children.append([0, first, end - first])
        if end - first > LEAF:
            half = (end - first) // 2
            axis = int(np.argmax(boxes[-1][1] - boxes[-1][0]))
            order[first:end] = members[np.argpartition(centres[members, axis], half)]
            waiting += [(first + half, end, len(boxes) - 1), (first, first + half, -1)]
    low, high = np.ascontiguousarray(np.swapaxes(boxes, 0, 1))
    right, begin, count = np.ascontiguousarray(np.array(children, dtype=np.int64).T)
    return TriangleTree(np.ascontiguousarray(triangles[order]), low, high, right, begin, count)


@dataclass(frozen=True, eq=False)
class DistanceField:
    """Distance to triangles at the nodes of a grid, exact there, interpolated linearly between them.

    Attributes:
        origin: First node, shape (3,) [m].
        spacing: Distance of the nodes [m].
        values: Distance at the nodes, shape (X, Y, Z) [m]; of a closed mesh negative inside.
    """

    origin: Array
    spacing: float
    values: Array

    @property
    def bound(self) -> float:
        """How far a value between the nodes can be from the distance at most: that to a cell's centre [m].

        No distance changes by more than one moves, and a value is a mean of those at most that far away.
        """
        return float(0.5 * 3.0**0.5 * self.spacing)

    @cached_property
    def arrays(self) -> FieldArrays:
        """The grid as the kernels read it."""
        shape = np.array(self.values.shape, dtype=np.int64)
        return FieldArrays(self.origin, self.spacing, shape, np.ascontiguousarray(self.values).ravel())


@dataclass(frozen=True)
class Grid:
    """Where the nodes of a grid are: first node [m], their distance [m], their number along x, y, z."""

    origin: Array
    spacing: float
    shape: NDArray[np.int64]


def grid_about(corners: Array, margin: float) -> Grid:
    """The finest grid of at most MOST_NODES nodes about points.

    Args:
        corners: Points, shape (N, 3) [m].
        margin: How far it reaches beyond them [m].
    """
    low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    edges = high - low
    spacing = max(FINEST, float(np.cbrt(edges.prod() / MOST_NODES)))
    while np.prod(np.ceil(edges / spacing) + 1.0) > MOST_NODES:
        spacing *= 1.02
    shape = np.ceil(edges / spacing).astype(np.int64) + 1
    return Grid(low - 0.5 * ((shape - 1) * spacing - edges), spacing, shape)


def mesh_field(tree: TriangleTree) -> DistanceField:
    """Signed distance to a closed mesh.

    The sign is that of the number of times that the mesh winds about a node; bodies of one mesh may overlap.

    Args:
        tree: Its triangles.
    """
    grid = grid_about(tree.triangles.reshape(-1, 3), MARGIN)
    values = grid_distances(tree, grid.origin, grid.spacing, grid.shape).reshape(grid.shape)
    inside = grid_windings(tree.triangles, grid.origin, grid.spacing, grid.shape) != 0
    return DistanceField(grid.origin, grid.spacing, np.where(inside, -values, values))


def mesh_distances(tree: TriangleTree, points: Array) -> Array:
    """Exact signed distances of points to a closed mesh, negative inside, shape (N,) [m].

    Args:
        tree: Its triangles.
        points: Shape (N, 3) [m].
    """
    points = np.ascontiguousarray(points, dtype=float)
    distances: Array = point_distances(tree, points)
    signed: Array = np.where(point_windings(tree.triangles, points) != 0, -distances, distances)
    return signed


def swept_triangles(points: Array) -> Array:
    """What the segments of an arm sweep from frame to frame, two triangles a segment, shape (F, 3, 3) [m].

    Args:
        points: The arm from its base to its hand, shape (T, m + 1, 3) [m].
    """
    if len(points) == 1:
        points = np.repeat(points, 2, axis=0)
    a, b = points[:-1, :-1], points[:-1, 1:]
    c, d = points[1:, :-1], points[1:, 1:]
    return np.stack([np.stack([a, b, d], axis=2), np.stack([a, d, c], axis=2)]).reshape(-1, 3, 3)


def swept_field(points: Array) -> DistanceField:
    """Distance to the surface that the segments of the demonstrator's arm have swept; never negative.

    Args:
        points: The arm from its base to its hand, shape (T, m + 1, 3) [m].
    """
    tree = triangle_tree(swept_triangles(points))
    grid = grid_about(points.reshape(-1, 3), SWEPT_MARGIN)
    values = grid_distances(tree, grid.origin, grid.spacing, grid.shape).reshape(grid.shape)
    return DistanceField(grid.origin, grid.spacing, values)
