"""The arm skeleton s(sigma, q): the polyline of a DH arm, by arc length (method section 2).

Row i contributes up to two straight segments: along x_{i-1} by a_i, then along z_i by d_i. Both are moved by the
joints before row i only. Pieces of zero length are left out, so that every segment has a direction; but where joint
i + 1 slides, the piece along z_i is d_i + q_i long and always there: it grows at its end, and L with it.
"""

from __future__ import annotations

import numpy as np

from armdesign.kinematics.compilation import branch

MAX_DOF = 10
MAX_ROWS = MAX_DOF + 1
MAX_SEGMENTS = 2 * MAX_ROWS
ALONG_X, ALONG_Z = 0, 1
# Columns of a Pinocchio SE3 in memory: the axes x, y, z of the frame, then its origin.
X, Z, ORIGIN = 0, 6, 9

CHAIN = np.dtype(
    [
        ("dof", np.int64),
        ("slides", np.int64, MAX_ROWS),  # 1 where the joint of a row slides
        ("sliding", np.int64),  # whether any does
        ("length", np.float64),  # L = sum(|a| + |d|) [m], at present where a joint slides
        ("base_x", np.float64, 3),  # x axis of the base frame
        ("tool", np.float64, (3, 3)),  # rotation of the tool frame in the last joint's frame
        ("segments", np.int64),
        ("row", np.int64, MAX_SEGMENTS),  # DH row of each segment = number of joints that move it
        ("kind", np.int64, MAX_SEGMENTS),  # ALONG_X or ALONG_Z
        ("sign", np.float64, MAX_SEGMENTS),  # -1 where a_i or d_i is negative
        ("extent", np.float64, MAX_SEGMENTS),  # length of each segment [m], likewise
        ("arc", np.float64, MAX_SEGMENTS + 1),  # arc length at its start; the last entry is L [m]
        # what follows depends on q
        ("start", np.float64, (MAX_SEGMENTS, 3)),  # first point of each segment [m]
        ("direction", np.float64, (MAX_SEGMENTS, 3)),  # unit vector along it
        ("tip", np.float64, 3),  # end-effector [m]
        ("tip_rotation", np.float64, (3, 3)),  # end-effector frame in the base frame
    ]
)
"""Geometry of one arm: what its design settles, then what depends on q."""


@branch
def set_kinds(chain, slides, n):
    """Say which of n joints slide, shape (n,) with 1 for those; none does where nobody says so."""
    chain.sliding = 0
    for i in range(n):
        chain.slides[i] = slides[i]
        chain.sliding = max(chain.sliding, slides[i])


@branch
def load_arm(chain, placements, rows, yaw):
    """Write a design into a chain record and into Pinocchio's joint placements.

    The placement of joint i is Rx(alpha_i) Tx(a_i) Tz(d_i) Rz(theta_i), eq. 2, with the base yaw before the first.

    Args:
        chain: Record of type CHAIN; its constant part is written, but for which joints slide, see ``set_kinds``.
        placements: The arm's joint placements, shape (n, 12), see ArmBlock.
        rows: DH rows (alpha, a, d, theta), tool last, shape (n + 1, 4) [rad, m, m, rad].
        yaw: Base yaw [rad].
    """
    n = len(rows) - 1
    chain.dof = n
    chain.base_x[0], chain.base_x[1], chain.base_x[2] = np.cos(yaw), np.sin(yaw), 0.0
    for i in range(n + 1):
        ca, sa = np.cos(rows[i, 0]), np.sin(rows[i, 0])
        ct, st = np.cos(rows[i, 3]), np.sin(rows[i, 3])
        # rotation Rx(alpha) Rz(theta) of eq. 2; the joint's own Rz(q_i) is Pinocchio's
        pose = chain.tool if i == n else placements[i, :9].reshape(3, 3).T
        pose[0, 0], pose[0, 1], pose[0, 2] = ct, -st, 0.0
        pose[1, 0], pose[1, 1], pose[1, 2] = ca * st, ca * ct, -sa
        pose[2, 0], pose[2, 1], pose[2, 2] = sa * st, sa * ct, ca
        if i == n:
            break
        origin = placements[i, ORIGIN:]
        origin[0], origin[1], origin[2] = rows[i, 1], -rows[i, 2] * sa, rows[i, 2] * ca
        if i == 0:
            turn_about_z(placements[0], chain.base_x[0], chain.base_x[1])
    cut_into_segments(chain, rows)


@branch
def turn_about_z(pose, cos, sin):
    """Turn the axes and the origin of one pose (12,) about the base's z, in place."""
    for i in range(0, 12, 3):
        x, y = pose[i], pose[i + 1]
        pose[i], pose[i + 1] = cos * x - sin * y, sin * x + cos * y


@branch
def cut_into_segments(chain, rows):
    """Write the pieces of the skeleton that have a length, base to tool."""
    arc, k = 0.0, 0
    for row in range(len(rows)):
        for kind in (ALONG_X, ALONG_Z):
            signed = rows[row, 1 + kind]
            if signed != 0.0 or (kind == ALONG_Z and chain.slides[row] == 1):
                chain.row[k], chain.kind[k] = row, kind
                chain.sign[k], chain.extent[k], chain.arc[k] = -1.0 if signed < 0.0 else 1.0, abs(signed), arc
                arc += abs(signed)
                k += 1
    chain.segments, chain.length, chain.arc[k] = k, arc, arc  # L = sum(|a_i| + |d_i|), section 2


@branch
def update_skeleton(chain, poses):
    """Bring start, direction and tip of a chain up to date with the joint poses.

    Args:
        chain: Record of type CHAIN.
        poses: Joint poses, shape (n, 12): the axes x, y, z, then the origin.
    """
    n = chain.dof
    last = poses[n - 1]
    for i in range(3):
        for j in range(3):
            chain.tip_rotation[i, j] = (
                last[i] * chain.tool[0, j] + last[3 + i] * chain.tool[1, j] + last[6 + i] * chain.tool[2, j]
            )
    for i in range(3):
        chain.tip[i] = last[ORIGIN + i]
    for k in range(chain.segments):
        row = chain.row[k]
        if chain.kind[k] == ALONG_X:
            for i in range(3):
                axis = poses[row - 1, X + i] if row > 0 else chain.base_x[i]
                chain.direction[k, i] = chain.sign[k] * axis
                chain.start[k, i] = poses[row - 1, ORIGIN + i] if row > 0 else 0.0
        else:
            for i in range(3):
                if k > 0 and chain.row[k - 1] == row:  # behind the same row's piece along x
                    chain.start[k, i] = chain.start[k - 1, i] + chain.extent[k - 1] * chain.direction[k - 1, i]
                else:
                    chain.start[k, i] = poses[row - 1, ORIGIN + i] if row > 0 else 0.0
            if chain.slides[row] == 1:
                extend(chain, k, poses[row])
            for i in range(3):
                axis = poses[row, Z + i] if row < n else chain.tip_rotation[i, 2]
                chain.direction[k, i] = chain.sign[k] * axis
        if row == n:
            for i in range(3):
                chain.tip[i] = chain.start[k, i] + chain.extent[k] * chain.direction[k, i]
    if chain.sliding == 1:
        for k in range(chain.segments):
            chain.arc[k + 1] = chain.arc[k] + chain.extent[k]
        chain.length = chain.arc[chain.segments]


@branch
def extend(chain, k, pose):
    """Set the length of segment k, along the joint that slides, whose frame is at its end."""
    way = 0.0  # d + q
    for i in range(3):
        way += (pose[ORIGIN + i] - chain.start[k, i]) * pose[Z + i]
    chain.sign[k], chain.extent[k] = -1.0 if way < 0.0 else 1.0, abs(way)
