"""Signed distance of a segment to an obstacle, with its gradient: exact for solids, by a grid for meshes.

The signed distance of a convex body is convex along a segment: its smallest value there is found between two
tangents. A mesh is given by its distance at the nodes of a grid; along a segment that is a cubic polynomial in
each cell, whose smallest value is known in closed form.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.kinematics.compilation import branch, entry, leaf

BOX, SPHERE, CYLINDER, PLANE, MESH = range(5)
ENOUGH = 1e-13
"""How much smaller than found the smallest distance along a segment may be [m]."""
MOST_STEPS = 90
STEEPEST = 3.0**0.5
"""Largest gradient between nodes whose values change by at most their distance."""
TINY = 1e-300

WITNESS = np.dtype(
    [
        ("along", np.float64),  # where on the segment: 0 at a, 1 at b
        ("normal", np.float64, 3),  # gradient of the distance by that point; a unit vector but between a grid's nodes
    ]
)
"""Where a segment comes nearest to an obstacle, or lies deepest in it."""


class ObstacleArrays(NamedTuple):
    """K obstacles as the kernels read them; V values of all grids, S poses of all obstacles.

    Attributes:
        kind: BOX, SPHERE, CYLINDER, PLANE or MESH, shape (K,).
        size: Half the edges; radius, 0, 0; radius, half the length, 0; 0, 0, 0; half the edges of the box about the
            mesh, shape (K, 3) [m].
        centre: Centre of a sphere about it in its own frame, shape (K, 3) [m].
        radius: Radius of that sphere, infinite for planes, shape (K,) [m].
        error: How much larger than it is a distance may come out, shape (K,) [m]; 0 but for meshes.
        first: Its first pose, shape (K,).
        frames: Number of its poses: 1, or that of the recording's frames where something recorded carries it, (K,).
        poses: Axes x, y, z, then the origin, shape (S, 12).
        turns: Rotation from each pose to its next one, in its own axes, shape (S, 3) [rad].
        origin: First node of the grid in the obstacle's frame, shape (K, 3) [m].
        spacing: Distance of the nodes, shape (K,) [m].
        shape: Number of nodes along x, y, z, shape (K, 3).
        offset: Its first value, shape (K,).
        values: Signed distance at the nodes, z fastest, shape (V,) [m].
    """

    kind: np.ndarray
    size: Array
    centre: Array
    radius: Array
    error: Array
    first: np.ndarray
    frames: np.ndarray
    poses: Array
    turns: Array
    origin: Array
    spacing: Array
    shape: np.ndarray
    offset: np.ndarray
    values: Array


class FieldArrays(NamedTuple):
    """Values at the nodes of a grid, as the kernels read them.

    Attributes:
        origin: First node, shape (3,) [m].
        spacing: Distance of the nodes [m].
        shape: Number of nodes along x, y, z, shape (3,).
        values: Distances at the nodes, z fastest, shape (V,) [m].
    """

    origin: Array
    spacing: float
    shape: np.ndarray
    values: Array


@branch
def segment_obstacle(obstacles, k, pose, a, b, witness):
    """Signed distance of a segment to an obstacle: to its surface, negative where a part of the segment lies inside.

    Of a mesh it is that between the nodes of its grid, and beyond the grid that to the box about the mesh, which is
    never larger.

    Args:
        obstacles: ObstacleArrays.
        k: Which of them.
        pose: Its axes x, y, z and origin, shape (12,), see obstacle_pose; in the frame of the segment.
        a: One end of the segment, shape (3,) [m].
        b: Its other end; it may be a itself.
        witness: WITNESS record, written.

    Returns:
        The distance [m].
    """
    ax, ay, az = a[0] - pose[9], a[1] - pose[10], a[2] - pose[11]
    bx, by, bz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    px, dx = pose[0] * ax + pose[1] * ay + pose[2] * az, pose[0] * bx + pose[1] * by + pose[2] * bz
    py, dy = pose[3] * ax + pose[4] * ay + pose[5] * az, pose[3] * bx + pose[4] * by + pose[5] * bz
    pz, dz = pose[6] * ax + pose[7] * ay + pose[8] * az, pose[6] * bx + pose[7] * by + pose[8] * bz
    p, d = (px, py, pz), (dx, dy, dz)
    kind, size = obstacles.kind[k], obstacles.size[k]
    if kind == BOX:
        distance, t, normal = segment_box(size, p, d)
    elif kind == SPHERE:
        distance, t, normal = segment_sphere(size[0], p, d)
    elif kind == CYLINDER:
        distance, t, normal = lowest_of_convex(CYLINDER, size, p, d)
    elif kind == PLANE:
        t = 1.0 if dz < 0.0 else 0.0
        distance, normal = pz + t * dz, (0.0, 0.0, 1.0)
    else:
        distance, t, normal = segment_mesh(obstacles, k, p, d)
    witness.along = t
    for i in range(3):
        witness.normal[i] = pose[i] * normal[0] + pose[3 + i] * normal[1] + pose[6 + i] * normal[2]
    return distance


@leaf
def segment_sphere(radius, p, d):
    """Signed distance of the segment p + t d to a sphere about the origin: the distance, t and its gradient."""
    square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
    t = min(max(-(p[0] * d[0] + p[1] * d[1] + p[2] * d[2]) / square, 0.0), 1.0) if square > TINY else 0.0
    x, y, z = p[0] + t * d[0], p[1] + t * d[1], p[2] + t * d[2]
    far = np.sqrt(x * x + y * y + z * z)
    normal = (x / far, y / far, z / far) if far > TINY else (0.0, 0.0, 1.0)
    return far - radius, t, normal


@leaf
def beyond(x, h):
    """How far x lies beyond the interval from -h to h, with its sign."""
    return x - h if x > h else (x + h if x < -h else 0.0)


@branch
def segment_box(size, p, d):
    """Signed distance of the segment p + t d to a box about the origin, exact.

    Half the derivative of the squared distance by t is piecewise linear and does not fall; it bends where the segment
    crosses a plane of a face, and is 0 where the distance is smallest.

    Args:
        size: Half the edges, shape (3,) [m].
        p: First end, three numbers [m].
        d: From the first end to the other, three numbers [m].

    Returns:
        The distance, t, and the gradient.
    """
    low, high = 0.0, 1.0
    s0, s1 = box_slope(size, p, d, 0.0), box_slope(size, p, d, 1.0)
    if s0 >= 0.0:
        t = 0.0
    elif s1 <= 0.0:
        t = 1.0
    else:
        for axis in range(3):
            if d[axis] != 0.0:
                for side in (-1.0, 1.0):
                    t = (side * size[axis] - p[axis]) / d[axis]
                    if low < t < high:
                        s = box_slope(size, p, d, t)
                        if s < 0.0:
                            low, s0 = t, s
                        else:
                            high, s1 = t, s
        t = low - s0 * (high - low) / (s1 - s0)
    x, y, z = beyond(p[0] + t * d[0], size[0]), beyond(p[1] + t * d[1], size[1]), beyond(p[2] + t * d[2], size[2])
    far = np.sqrt(x * x + y * y + z * z)
    if far > ENOUGH:
        return far, t, (x / far, y / far, z / far)
    return lowest_of_convex(BOX, size, p, d)


@leaf
def box_slope(size, p, d, t):
    """Half the derivative by t of the squared distance of p + t d to a box."""
    return (
        beyond(p[0] + t * d[0], size[0]) * d[0]
        + beyond(p[1] + t * d[1], size[1]) * d[1]
        + beyond(p[2] + t * d[2], size[2]) * d[2]
    )


@branch
def solid_distance(kind, size, x, y, z):
    """Signed distance of a point to a box or a cylinder about z, in its own frame [m], with its gradient."""
    sz = 1.0 if z > 0.0 else -1.0
    if kind == BOX:
        ex, ey, ez = abs(x) - size[0], abs(y) - size[1], abs(z) - size[2]
        sx, sy = 1.0 if x > 0.0 else -1.0, 1.0 if y > 0.0 else -1.0
        if ex <= 0.0 and ey <= 0.0 and ez <= 0.0:
            if ex >= ey and ex >= ez:
                return ex, (sx, 0.0, 0.0)
            if ey >= ez:
                return ey, (0.0, sy, 0.0)
            return ez, (0.0, 0.0, sz)
        ex, ey, ez = max(ex, 0.0), max(ey, 0.0), max(ez, 0.0)
        far = np.sqrt(ex * ex + ey * ey + ez * ez)
        return far, (sx * ex / far, sy * ey / far, sz * ez / far)
    rho = np.sqrt(x * x + y * y)
    ux, uy = (x / rho, y / rho) if rho > TINY else (1.0, 0.0)
    er, ez = rho - size[0], abs(z) - size[1]
    if er <= 0.0 and ez <= 0.0:
        if er >= ez:
            return er, (ux, uy, 0.0)
        return ez, (0.0, 0.0, sz)
    er, ez = max(er, 0.0), max(ez, 0.0)
    far = np.sqrt(er * er + ez * ez)
    return far, (ux * er / far, uy * er / far, sz * ez / far)


@branch
def lowest_of_convex(kind, size, p, d):
    """The smallest signed distance of the segment p + t d to a box or a cylinder.

    It is convex in t: the tangents to the left and to the right of the smallest value bound it from below. Steps go to
    where the slope is 0 if it is linear, to where the tangents cross (exact at a kink), to the middle, in turn.

    Args:
        kind: BOX or CYLINDER.
        size: Its size, see ObstacleArrays.
        p: First end in the solid's frame, three numbers [m].
        d: From the first end to the other, three numbers [m].

    Returns:
        The distance, t, and the gradient.
    """
    g0, normal = solid_distance(kind, size, p[0], p[1], p[2])
    s0 = normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2]
    if s0 >= 0.0:
        return g0, 0.0, normal
    g1, other = solid_distance(kind, size, p[0] + d[0], p[1] + d[1], p[2] + d[2])
    s1 = other[0] * d[0] + other[1] * d[1] + other[2] * d[2]
    if s1 <= 0.0:
        return g1, 1.0, other
    low, high, best, place = 0.0, 1.0, g0, 0.0
    n0, n1, stationary = normal, other, False
    if g1 < g0:
        best, place, normal = g1, 1.0, other
    for step in range(MOST_STEPS):
        cross = (g1 - g0 + s0 * low - s1 * high) / (s0 - s1)
        if best - (g0 + s0 * (cross - low)) <= ENOUGH:
            break
        t = 0.5 * (low + high)
        if step % 3 < 2:
            guess = low - s0 * (high - low) / (s1 - s0) if step % 3 == 0 else cross
            t = guess if low < guess < high else t
        if not low < t < high:
            break
        g, other = solid_distance(kind, size, p[0] + t * d[0], p[1] + t * d[1], p[2] + t * d[2])
        s = other[0] * d[0] + other[1] * d[1] + other[2] * d[2]
        if g < best or abs(s) * (high - low) <= ENOUGH:
            best, place, normal = g, t, other
        if abs(s) * (high - low) <= ENOUGH:
            stationary = True
            break
        if s < 0.0:
            low, g0, s0, n0 = t, g, s, other
        else:
            high, g1, s1, n1 = t, g, s, other
    if not stationary:  # at a kink: of the gradients to both sides the mean that does not rise along the segment
        u = s1 / (s1 - s0)
        normal = (
            u * n0[0] + (1.0 - u) * n1[0],
            u * n0[1] + (1.0 - u) * n1[1],
            u * n0[2] + (1.0 - u) * n1[2],
        )
    return best, place, normal


@branch
def segment_mesh(obstacles, k, p, d):
    """Distance of the segment p + t d to a mesh by its grid; beyond the grid that to the box about the mesh.

    Args:
        obstacles: ObstacleArrays.
        k: Which of them.
        p: First end in the obstacle's frame, three numbers [m].
        d: From the first end to the other, three numbers [m].

    Returns:
        The distance, t, and the gradient.
    """
    spacing, shape, centre, size = obstacles.spacing[k], obstacles.shape[k], obstacles.centre[k], obstacles.size[k]
    c = (p[0] - centre[0], p[1] - centre[1], p[2] - centre[2])
    u = in_spacings(obstacles.origin[k], spacing, p)
    v = (d[0] / spacing, d[1] / spacing, d[2] / spacing)
    enter, leave = inside_grid(shape, u, v)
    if enter > leave:
        return segment_box(size, c, d)
    values = obstacles.values[obstacles.offset[k] : obstacles.offset[k] + shape[0] * shape[1] * shape[2]]
    distance, t = lowest_in_grid(values, shape, 1.0, u, v, spacing, enter, leave)
    x, y, z = grid_gradient(values, shape, u[0] + t * v[0], u[1] + t * v[1], u[2] + t * v[2])
    normal = (x / spacing, y / spacing, z / spacing)
    for side in range(2):
        begin, part = (0.0, enter) if side == 0 else (leave, 1.0 - leave)
        if part > 0.0:
            first = (c[0] + begin * d[0], c[1] + begin * d[1], c[2] + begin * d[2])
            outer, s, other = segment_box(size, first, (part * d[0], part * d[1], part * d[2]))
            if outer < distance:
                distance, t, normal = outer, begin + s * part, other
    return distance, t, normal


@leaf
def in_spacings(origin, spacing, p):
    """A point counted from a grid's first node, in units of its spacing."""
    return ((p[0] - origin[0]) / spacing, (p[1] - origin[1]) / spacing, (p[2] - origin[2]) / spacing)


@branch
def inside_grid(shape, u, v):
    """The part of u + t v, t from 0 to 1, inside a grid: from, to; from > to where there is none."""
    enter, leave = 0.0, 1.0
    for axis in range(3):
        end = shape[axis] - 1.0
        if v[axis] == 0.0:
            if u[axis] < 0.0 or u[axis] > end:
                return 1.0, 0.0
        else:
            s, t = -u[axis] / v[axis], (end - u[axis]) / v[axis]
            enter, leave = max(enter, min(s, t)), min(leave, max(s, t))
    return enter, leave


@leaf
def node_index(u, nodes):
    """The cell that a coordinate in units of the spacing lies in, the last one on its far end."""
    return min(max(int(np.floor(u)), 0), nodes - 2)


@leaf
def in_cell(values, at, sy, sx, x, y, z):
    """Trilinear value at x, y, z from 0 to 1 within the cell of the node at index ``at``; sx, sy its strides."""
    c00 = values[at] + z * (values[at + 1] - values[at])
    c01 = values[at + sy] + z * (values[at + sy + 1] - values[at + sy])
    c10 = values[at + sx] + z * (values[at + sx + 1] - values[at + sx])
    c11 = values[at + sx + sy] + z * (values[at + sx + sy + 1] - values[at + sx + sy])
    c0, c1 = c00 + y * (c01 - c00), c10 + y * (c11 - c10)
    return c0 + x * (c1 - c0)


@branch
def lowest_in_grid(values, shape, sign, u, v, spacing, enter, leave):
    """The smallest value of ``sign`` times a grid along u + t v, cell by cell; cells that cannot hold it are skipped.

    Args:
        values: Values at the nodes, z fastest, shape (V,) [m].
        shape: Number of nodes along x, y, z, shape (3,).
        sign: 1 for the smallest value, -1 for the largest.
        u: First end from the first node, in units of the spacing, three numbers.
        v: From the first end to the other, three numbers.
        spacing: Distance of the nodes [m].
        enter: First t inside the grid.
        leave: Last t inside it.

    Returns:
        The value, times ``sign``, and its t.
    """
    sy, sx = shape[2], shape[1] * shape[2]
    length = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    best, place, t = np.inf, enter, enter
    while True:
        # a little ahead, so that the cell is the one that the segment goes into
        ahead = min(t + 1e-9 / max(length, 1e-9), leave)
        i = node_index(u[0] + ahead * v[0], shape[0])
        j = node_index(u[1] + ahead * v[1], shape[1])
        m = node_index(u[2] + ahead * v[2], shape[2])
        cell, end = (i, j, m), leave
        for axis in range(3):
            if v[axis] != 0.0:
                end = min(end, (cell[axis] + (1.0 if v[axis] > 0.0 else 0.0) - u[axis]) / v[axis])
        end = min(max(end, ahead), leave)
        at = i * sx + j * sy + m
        x, y, z = u[0] + t * v[0] - i, u[1] + t * v[1] - j, u[2] + t * v[2] - m
        part = end - t
        dx, dy, dz = part / 3.0 * v[0], part / 3.0 * v[1], part / 3.0 * v[2]
        f0 = sign * in_cell(values, at, sy, sx, x, y, z)
        f1 = sign * in_cell(values, at, sy, sx, x + dx, y + dy, z + dz)
        f2 = sign * in_cell(values, at, sy, sx, x + 2.0 * dx, y + 2.0 * dy, z + 2.0 * dz)
        f3 = sign * in_cell(values, at, sy, sx, x + 3.0 * dx, y + 3.0 * dy, z + 3.0 * dz)
        if f0 < best:
            best, place = f0, t
        if f3 < best:
            best, place = f3, end
        # the cubic f0 + c1 s + c2 s^2 + c3 s^3 through the four values
        c1 = -5.5 * f0 + 9.0 * f1 - 4.5 * f2 + f3
        c2 = 9.0 * f0 - 22.5 * f1 + 18.0 * f2 - 4.5 * f3
        c3 = 4.5 * (f3 - f0) - 13.5 * (f2 - f1)
        root = c2 * c2 - 3.0 * c1 * c3
        if root >= 0.0:
            q = -(c2 + (np.sqrt(root) if c2 >= 0.0 else -np.sqrt(root)))
            for which in range(2):
                above, below = (q, 3.0 * c3) if which == 0 else (c1, q)
                if below != 0.0:
                    s = above / below
                    if 0.0 < s < 1.0:
                        f = f0 + s * (c1 + s * (c2 + s * c3))
                        if f < best:
                            best, place = f, t + s * part
        if not end < leave:  # also of a segment that is no number
            return best, place
        t = end
        gap = (f3 - best) / (STEEPEST * spacing) - 1e-9
        if gap > 0.0:
            t = end + gap / length
            if t >= leave:
                return best, place


@branch
def grid_gradient(values, shape, ux, uy, uz):
    """Gradient of the trilinear value by the coordinates in units of the spacing."""
    i, j, m = node_index(ux, shape[0]), node_index(uy, shape[1]), node_index(uz, shape[2])
    at, sy, sx = (i * shape[1] + j) * shape[2] + m, shape[2], shape[1] * shape[2]
    x, y, z = ux - i, uy - j, uz - m
    gx = in_cell(values, at, sy, sx, 1.0, y, z) - in_cell(values, at, sy, sx, 0.0, y, z)
    gy = in_cell(values, at, sy, sx, x, 1.0, z) - in_cell(values, at, sy, sx, x, 0.0, z)
    gz = in_cell(values, at, sy, sx, x, y, 1.0) - in_cell(values, at, sy, sx, x, y, 0.0)
    return gx, gy, gz


@branch
def segment_excess(grid, a, b, witness):
    """The largest distance of a segment's points to what a grid of unsigned distances is about.

    Beyond the grid a point counts as far as its nearest point of the grid, and as far as it is from that.

    Args:
        grid: FieldArrays; segment and grid have one frame.
        a: One end of the segment, shape (3,) [m].
        b: Its other end.
        witness: WITNESS record, written.

    Returns:
        The distance [m].
    """
    spacing = grid.spacing
    u = in_spacings(grid.origin, spacing, a)
    v = ((b[0] - a[0]) / spacing, (b[1] - a[1]) / spacing, (b[2] - a[2]) / spacing)
    enter, leave = inside_grid(grid.shape, u, v)
    best, t = -1.0, 0.0
    if enter <= leave:
        negative, t = lowest_in_grid(grid.values, grid.shape, -1.0, u, v, spacing, enter, leave)
        best = -negative
    for end in (0.0, 1.0):
        value = beyond_grid(grid, u[0] + end * v[0], u[1] + end * v[1], u[2] + end * v[2], witness.normal)
        if value > best:
            best, t = value, end
    witness.along = t
    beyond_grid(grid, u[0] + t * v[0], u[1] + t * v[1], u[2] + t * v[2], witness.normal)
    return best


@branch
def beyond_grid(grid, x, y, z, gradient):
    """Distance of a point inside a grid or beyond it; its gradient is written.

    Args:
        grid: FieldArrays.
        x: The point from the first node, in units of the spacing.
        y: See x.
        z: See x.
        gradient: Written, shape (3,).
    """
    shape, spacing = grid.shape, grid.spacing
    cx, cy, cz = min(max(x, 0.0), shape[0] - 1.0), min(max(y, 0.0), shape[1] - 1.0), min(max(z, 0.0), shape[2] - 1.0)
    i, j, m = node_index(cx, shape[0]), node_index(cy, shape[1]), node_index(cz, shape[2])
    value = in_cell(
        grid.values, (i * shape[1] + j) * shape[2] + m, shape[2], shape[1] * shape[2], cx - i, cy - j, cz - m
    )
    nx, ny, nz = grid_gradient(grid.values, shape, cx, cy, cz)
    ex, ey, ez = x - cx, y - cy, z - cz
    far = np.sqrt(ex * ex + ey * ey + ez * ez)
    # along an axis in which the point is beyond the grid, its nearest point of the grid does not move with it
    gradient[0] = ex / far if ex != 0.0 else nx / spacing
    gradient[1] = ey / far if ey != 0.0 else ny / spacing
    gradient[2] = ez / far if ez != 0.0 else nz / spacing
    return value + far * spacing


@branch
def obstacle_pose(obstacles, k, frame, share, pose):
    """The pose of an obstacle between two frames: its origin on a line, its axes turned about one axis.

    Args:
        obstacles: ObstacleArrays.
        k: Which of them.
        frame: The frame before.
        share: Part of the time to the next frame that has gone by, 0 to 1.
        pose: Written, shape (12,): axes x, y, z, then the origin.
    """
    row = obstacles.first[k] + (frame if obstacles.frames[k] > 1 else 0)
    for i in range(12):
        pose[i] = obstacles.poses[row, i]
    if obstacles.frames[k] == 1 or share == 0.0:
        return
    for i in range(9, 12):
        pose[i] += share * (obstacles.poses[row + 1, i] - obstacles.poses[row, i])
    x, y, z = obstacles.turns[row, 0], obstacles.turns[row, 1], obstacles.turns[row, 2]
    angle = np.sqrt(x * x + y * y + z * z)
    if angle > TINY:
        x, y, z = x / angle, y / angle, z / angle
        sin, cos = np.sin(share * angle), np.cos(share * angle)
        rest = 1.0 - cos
        for i in range(3):
            u, v, w = obstacles.poses[row, i], obstacles.poses[row, 3 + i], obstacles.poses[row, 6 + i]
            # R exp(share turn): columns of the turn in the body's own axes, by Rodrigues
            pose[i] = u * (cos + rest * x * x) + v * (rest * x * y + sin * z) + w * (rest * x * z - sin * y)
            pose[3 + i] = u * (rest * x * y - sin * z) + v * (cos + rest * y * y) + w * (rest * y * z + sin * x)
            pose[6 + i] = u * (rest * x * z + sin * y) + v * (rest * y * z - sin * x) + w * (cos + rest * z * z)


@branch
def obstacle_step(obstacles, k, frame):
    """How far any point of an obstacle moves from a frame to the next one, at most [m]."""
    if obstacles.frames[k] == 1:
        return 0.0
    row = obstacles.first[k] + frame
    shift, turn, reach = 0.0, 0.0, 0.0
    for i in range(3):
        shift += (obstacles.poses[row + 1, 9 + i] - obstacles.poses[row, 9 + i]) ** 2
        turn += obstacles.turns[row, i] ** 2
        reach += obstacles.centre[k, i] ** 2
    return np.sqrt(shift) + np.sqrt(turn) * (np.sqrt(reach) + obstacles.radius[k])


@leaf
def seen_from(base, pose, seen):
    """A pose as seen from a base, all of them (12,): axes x, y, z, then the origin.

    Args:
        base: Pose of the base in the frame of ``pose``.
        pose: The pose.
        seen: Written.
    """
    for axis in range(0, 12, 3):
        x, y, z = pose[axis], pose[axis + 1], pose[axis + 2]
        if axis == 9:
            x, y, z = x - base[9], y - base[10], z - base[11]
        for i in range(3):
            seen[axis + i] = base[3 * i] * x + base[3 * i + 1] * y + base[3 * i + 2] * z


@entry
def segment_distances(obstacles, k, pose, ends, records):
    """Signed distances of many segments to one obstacle.

    Args:
        obstacles: ObstacleArrays.
        k: Which of them.
        pose: Its pose, shape (12,).
        ends: Ends of N segments, shape (N, 2, 3) [m].
        records: WITNESS records, shape (N,), written.

    Returns:
        The distances, shape (N,) [m].
    """
    distances = np.empty(len(ends))
    for i in range(len(ends)):
        distances[i] = segment_obstacle(obstacles, k, pose, ends[i, 0], ends[i, 1], records[i])
    return distances


@entry
def segment_excesses(grid, ends, records):
    """The largest distances of many segments to what a grid of unsigned distances is about.

    Args:
        grid: FieldArrays.
        ends: Ends of N segments, shape (N, 2, 3) [m].
        records: WITNESS records, shape (N,), written.

    Returns:
        The distances, shape (N,) [m].
    """
    distances = np.empty(len(ends))
    for i in range(len(ends)):
        distances[i] = segment_excess(grid, ends[i, 0], ends[i, 1], records[i])
    return distances
