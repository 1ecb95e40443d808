"""The arm skeleton along a path (method section 2): its corners, and the places of the task's points on it."""

from __future__ import annotations

import numpy as np

from armdesign._types import Array
from armdesign.kinematics.dh import DHTable, rot_x, translation


def skeleton(table: DHTable, q: Array) -> Array:
    """The corners of the skeleton, base to tool: per row a piece along x_{i-1} by a_i, then one along z_i by d_i.

    Args:
        table: The arm, n joints.
        q: Joint angles, shape (T, n) [rad].

    Returns:
        Shape (T, 2 n + 3, 3) [m]; pieces of no length are kept. Every second corner from the third on is a joint's
        origin, the last is the tool.
    """
    pose = np.broadcast_to(table.base(), (len(q), 4, 4))
    corners = [pose[:, :3, 3]]
    for i in range(table.dof + 1):
        pose = pose @ translation(table.a[i], 0.0, 0.0)
        corners.append(pose[:, :3, 3])
        pose = pose @ rot_x(table.alpha[i]) @ translation(0.0, 0.0, table.d[i])
        corners.append(pose[:, :3, 3])
        pose = pose @ _turns(table.theta[i] + (q[:, i] if i < table.dof else np.zeros(len(q))))
    return np.stack(corners, axis=1)


def places(table: DHTable, q: Array, sigma: Array) -> Array:
    """Where the points of the task lie on the arm, s(sigma, q).

    Args:
        table: The arm.
        q: Joint angles, shape (T, n) [rad].
        sigma: Arc length / L, shape (T, m).

    Returns:
        Shape (T, m, 3) [m].
    """
    corners = skeleton(table, q)
    extents = np.abs(np.stack([table.a, table.d], axis=1).ravel())
    arcs = np.r_[0.0, np.cumsum(extents)]
    arc = np.clip(sigma, 0.0, 1.0) * arcs[-1]
    piece = np.clip(np.searchsorted(arcs, arc, side="left") - 1, 0, len(extents) - 1)
    share = (arc - arcs[piece]) / np.where(extents > 0.0, extents, 1.0)[piece]
    frame = np.arange(len(q))[:, None]
    start, end = corners[frame, piece], corners[frame, piece + 1]
    return np.asarray(start + share[..., None] * (end - start))


def _turns(angles: Array) -> Array:
    """Homogeneous rotations about z, shape (T, 4, 4)."""
    turns = np.tile(np.eye(4), (len(angles), 1, 1))
    turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angles)
    turns[:, 1, 0] = np.sin(angles)
    turns[:, 0, 1] = -turns[:, 1, 0]
    return turns
