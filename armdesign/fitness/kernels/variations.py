"""Every number of a DH table as a joint of its own: how the arm moves when the design changes.

A twist or the base yaw turns everything behind it, a length shifts it, as a revolute or a prismatic joint would. A
joint that slides is the same coordinate as the offset d of its row.
Joint angles and design entries together are the coordinates of an arm, in the order in which they act:

    base x, y, z, yaw, then per row alpha, a, d and, for rows that carry a joint, q

Coordinate c of row i is BASE + 4 i + (0 for alpha, 1 for a, 2 for d, 3 for q). The base's own come first; all are seen
from the base frame, against which the demonstration rests: a base that moves by x moves the arm as a whole.
"""

from __future__ import annotations

import numpy as np

from armdesign.fitness.kernels.association import MAX_POINTS, SMALLEST_WEIGHT, at_end
from armdesign.kinematics.compilation import branch, leaf
from armdesign.kinematics.kernels.skeleton import ALONG_X, ALONG_Z, MAX_DOF, ORIGIN, X, Z

YAW, BASE = 3, 4
"""Coordinate that turns the base, and the number of the base's coordinates."""
MAX_COORDINATES = BASE + 4 * MAX_DOF + 3
A, D, Q = 1, 2, 3

VARIATION = np.dtype(
    [
        ("first", np.int64),  # first coordinate that counts: 0, or YAW where the base stands still
        ("axis", np.float64, (MAX_COORDINATES, 6)),  # world Jacobian: linear, then angular
        ("column", np.float64, (MAX_POINTS, MAX_COORDINATES, 3)),  # d place_i / d coordinate at constant sigma
        ("movers", np.int64, MAX_POINTS),  # number of coordinates that move place_i
        ("bend", np.float64, (MAX_POINTS, MAX_COORDINATES)),  # how sliding couples to a coordinate
        ("glide", np.float64, (MAX_POINTS, MAX_COORDINATES)),  # d along_i / d coordinate, sigma exact
        ("torque", np.float64, (MAX_COORDINATES, 3)),  # sum of column x force
        ("slope", np.float64, MAX_COORDINATES),  # gradient of the objective; where e_R is at its kink, without e_R
        ("pull", np.float64, MAX_DOF),  # gradient by the joints, e_R's least pull at its kink included
        ("at_limit", np.int64, MAX_DOF),
        ("scale", np.float64),  # mean curvature of the position part
        ("mixed", np.float64, (MAX_DOF, MAX_COORDINATES)),  # its second derivative by a joint and a coordinate
        ("stretch", np.float64, MAX_COORDINATES),  # d L / d coordinate
        # of the area
        ("area", np.float64, MAX_COORDINATES),  # gradient of E_t
        ("force", np.float64, 3),
        ("moment", np.float64, 3),
        # of the orientation
        ("normal", np.float64, 3),  # rho / e_R
        ("normal_matrix", np.float64, (3, 3)),  # scratch of the least squares for the normal
        ("normal_right", np.float64, 3),
        ("curvature", np.float64),
        ("met", np.int64),  # 1: e_R is at its kink
        ("follows", np.int64),  # 1: the mount goes with the tool at the start
        ("tool_turn", np.float64, (MAX_COORDINATES, 3)),  # how the start turns the tool, in the tool's frame
        ("mount_turn", np.float64, (MAX_COORDINATES, 3)),  # how that turns the mount, in the base frame
        # of the path
        ("dq", np.float64, (MAX_DOF, MAX_COORDINATES)),  # d q_t / d entry
        ("f", np.float64, MAX_COORDINATES),  # sums over the frames
        ("E", np.float64, MAX_COORDINATES),
    ]
)
"""Derivatives of one arm; one record serves all arms."""


@leaf
def coordinates(n):
    """Number of coordinates of an arm of n joints."""
    return BASE + 4 * n + 3


@branch
def place_joints(poses, placements, q, chain):
    """Joint poses, shape (n, 12), from the placements, shape (n, 12), and the joint angles."""
    for i in range(chain.dof):
        slides = chain.slides[i] == 1
        c, s = 1.0 if slides else np.cos(q[i]), 0.0 if slides else np.sin(q[i])
        way = q[i] if slides else 0.0
        local, pose = placements[i], poses[i]
        for r in range(3):
            if i == 0:
                x, y, z, o = local[r], local[3 + r], local[6 + r], local[ORIGIN + r]
            else:
                up = poses[i - 1]
                x = up[r] * local[0] + up[3 + r] * local[1] + up[6 + r] * local[2]
                y = up[r] * local[3] + up[3 + r] * local[4] + up[6 + r] * local[5]
                z = up[r] * local[6] + up[3 + r] * local[7] + up[6 + r] * local[8]
                o = up[r] * local[9] + up[3 + r] * local[10] + up[6 + r] * local[11] + up[ORIGIN + r]
            if slides:
                o += way * z
            pose[r], pose[3 + r], pose[6 + r], pose[ORIGIN + r] = c * x + s * y, c * y - s * x, z, o


@leaf
def set_turn(axis, x, y, z, ox, oy, oz):
    """Jacobian of a turn about an axis through a point."""
    axis[3], axis[4], axis[5] = x, y, z
    axis[0], axis[1], axis[2] = oy * z - oz * y, oz * x - ox * z, ox * y - oy * x


@leaf
def set_shift(axis, x, y, z):
    """Jacobian of a shift."""
    axis[0], axis[1], axis[2] = x, y, z
    axis[3], axis[4], axis[5] = 0.0, 0.0, 0.0


@branch
def set_axes(variation, poses, base, chain, rows):
    """World Jacobian of all coordinates at the present joint poses, and what they add to L.

    Args:
        variation: Record of type VARIATION with ``first`` set; axis and stretch are written.
        poses: Joint poses, shape (n, 12).
        base: Base pose in the task frame, shape (12,).
        chain: Record of type CHAIN, up to date.
        rows: DH rows, shape (n + 1, 4).
    """
    axis, n = variation.axis, chain.dof
    for c in range(3):  # the task frame's axes in the base frame
        set_shift(axis[c], base[c], base[3 + c], base[6 + c])
    set_turn(axis[YAW], base[2], base[5], base[8], 0.0, 0.0, 0.0)
    for c in range(coordinates(n)):
        variation.stretch[c] = 0.0
    for i in range(n + 1):
        k = BASE + 4 * i
        if i > 0:
            x, o = poses[i - 1, X : X + 3], poses[i - 1, ORIGIN : ORIGIN + 3]
            set_turn(axis[k], x[0], x[1], x[2], o[0], o[1], o[2])
            set_shift(axis[k + A], x[0], x[1], x[2])
        else:
            set_turn(axis[k], chain.base_x[0], chain.base_x[1], chain.base_x[2], 0.0, 0.0, 0.0)
            set_shift(axis[k + A], chain.base_x[0], chain.base_x[1], chain.base_x[2])
        if i < n:
            z, o = poses[i, Z : Z + 3], poses[i, ORIGIN : ORIGIN + 3]
            set_shift(axis[k + D], z[0], z[1], z[2])
            if chain.slides[i] == 1:
                set_shift(axis[k + Q], z[0], z[1], z[2])
            else:
                set_turn(axis[k + Q], z[0], z[1], z[2], o[0], o[1], o[2])
        else:
            t = chain.tip_rotation
            set_shift(axis[k + D], t[0, 2], t[1, 2], t[2, 2])
        variation.stretch[k + A] = -1.0 if rows[i, A] < 0.0 else 1.0
        variation.stretch[k + D] = -1.0 if rows[i, D] < 0.0 else 1.0
    for k in range(chain.segments):  # the joint stretches the piece along it as its offset does
        if chain.kind[k] == ALONG_Z and chain.slides[chain.row[k]] == 1:
            own = own_shift(chain, k)
            variation.stretch[own] = variation.stretch[own + Q - D] = chain.sign[k]


@leaf
def own_shift(chain, k):
    """Coordinate that is the length of segment k."""
    return BASE + 4 * chain.row[k] + (A if chain.kind[k] == ALONG_X else D)


@leaf
def ends_of(chain, k):
    """Number of coordinates that stretch segment k: its length, and the joint behind it where that slides along it."""
    return 2 if chain.kind[k] == ALONG_Z and chain.slides[chain.row[k]] == 1 else 1


@leaf
def stretched(chain, match, p):
    """Whether the place of point p, at an end of its segment, is at that which the segment's length moves."""
    k = match.segment[p]
    return match.along[p] > 0.0 or (ends_of(chain, k) == 2 and at_end(chain, match, p))


@branch
def tie_points(variation, match, chain, weights, m):
    """Columns of the places, with what couples them to the sliding, and how each glides along the arm.

    A place strictly inside its segment moves with what is before the segment's length; one at a corner with the
    length in front of it, too.
    """
    for p in range(m):
        k = match.segment[p]
        movers = own_shift(chain, k)
        variation.movers[p] = movers
        if match.sliding[p] == 0:
            if stretched(chain, match, p):
                variation.movers[p] = movers + ends_of(chain, k)
            else:
                variation.movers[p] = own_shift(chain, k - 1) + ends_of(chain, k - 1) if k > 0 else BASE
        for c in range(MAX_COORDINATES):
            variation.glide[p, c] = 0.0
        add_columns(variation, match, chain.direction[k], p)
        if match.sliding[p] == 0 and stretched(chain, match, p):
            for c in range(movers, movers + ends_of(chain, k)):
                variation.glide[p, c] = variation.stretch[c]
    glide_pools(variation, match, weights, m)


@leaf
def add_columns(variation, match, u, p):
    """Columns of one place, and b_c = u . column + r . (omega x u)."""
    x, y, z = match.place[p, 0], match.place[p, 1], match.place[p, 2]
    r = match.residual[p]
    tx, ty, tz = u[1] * r[2] - u[2] * r[1], u[2] * r[0] - u[0] * r[2], u[0] * r[1] - u[1] * r[0]
    for c in range(variation.first, variation.movers[p]):
        axis, column = variation.axis[c], variation.column[p, c]
        column[0] = axis[0] + axis[4] * z - axis[5] * y
        column[1] = axis[1] + axis[5] * x - axis[3] * z
        column[2] = axis[2] + axis[3] * y - axis[4] * x
        variation.bend[p, c] = (
            u[0] * column[0] + u[1] * column[1] + u[2] * column[2] + axis[3] * tx + axis[4] * ty + axis[5] * tz
        )


@branch
def glide_pools(variation, match, weights, m):
    """Points that slide in one pool share their glide: minus the weighted mean of their b."""
    for p in range(m):
        if match.pool[p] != p or match.sliding[p] == 0:
            continue
        end, total = p, 0.0
        while end < m and match.pool[end] == p:
            total += max(weights[end], SMALLEST_WEIGHT)
            end += 1
        for c in range(variation.first, variation.movers[p]):
            mean = 0.0
            for i in range(p, end):
                mean += max(weights[i], SMALLEST_WEIGHT) * variation.bend[i, c]
            for i in range(p, end):
                variation.glide[i, c] = -mean / total


@branch
def differentiate_position(variation, match, weights, m, n):
    """Slope of S / 2 by every coordinate, and its second derivatives by a joint and a coordinate, sigma exact.

    The second derivative of a place by coordinates i <= j is omega_i x column_j; what slides adds b_i d along / d j.
    """
    first, count = variation.first, coordinates(n)
    for c in range(first, count):
        variation.slope[c] = 0.0
        variation.torque[c, 0] = variation.torque[c, 1] = variation.torque[c, 2] = 0.0
        for j in range(n):
            variation.mixed[j, c] = 0.0
    for p in range(m):
        if weights[p] > 0.0:
            add_place(variation, match, weights[p], p, n)
    for j in range(n):
        q = BASE + 4 * j + Q
        for c in range(first, count):
            axis, torque = variation.axis[min(q, c)], variation.torque[max(q, c)]
            variation.mixed[j, c] += axis[3] * torque[0] + axis[4] * torque[1] + axis[5] * torque[2]


@leaf
def add_place(variation, match, weight, p, n):
    """Add w |r|^2 / 2 of one point: slope, torque, and the products of its columns."""
    movers, column = variation.movers[p], variation.column[p]
    fx, fy, fz = weight * match.residual[p, 0], weight * match.residual[p, 1], weight * match.residual[p, 2]
    for c in range(variation.first, movers):
        x, y, z = column[c, 0], column[c, 1], column[c, 2]
        variation.slope[c] += x * fx + y * fy + z * fz
        variation.torque[c, 0] += y * fz - z * fy
        variation.torque[c, 1] += z * fx - x * fz
        variation.torque[c, 2] += x * fy - y * fx
    for j in range(n):
        q = BASE + 4 * j + Q
        if q < movers:
            x, y, z = weight * column[q, 0], weight * column[q, 1], weight * column[q, 2]
            bend = weight * variation.bend[p, q] if match.sliding[p] == 1 else 0.0
            for c in range(variation.first, movers):
                variation.mixed[j, c] += column[c, 0] * x + column[c, 1] * y + column[c, 2] * z
                variation.mixed[j, c] += bend * variation.glide[p, c]


@branch
def root_of_position(variation, root, m, n):
    """Turn the derivatives of S / 2 into those of sqrt(S) / m."""
    scale = 1.0 / (m * max(root, 1e-12))
    radial = scale / max(root * root, 1e-24)
    for j in range(n):
        slope = radial * variation.slope[BASE + 4 * j + Q]
        for c in range(variation.first, coordinates(n)):
            variation.mixed[j, c] = scale * variation.mixed[j, c] - slope * variation.slope[c]
    for c in range(variation.first, coordinates(n)):
        variation.slope[c] *= scale
