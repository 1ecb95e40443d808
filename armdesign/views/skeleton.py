"""Where the points of a task lie on an arm's skeleton along a path (method section 2)."""

from __future__ import annotations

import numpy as np

from armdesign._types import Array
from armdesign.kinematics.dh import DHTable


def places(table: DHTable, q: Array, sigma: Array) -> Array:
    """Where the points of the task lie on the arm, s(sigma, q).

    Args:
        table: The arm.
        q: Joint angles, shape (T, n) [rad].
        sigma: Arc length / L, shape (T, m).

    Returns:
        Shape (T, m, 3) [m].
    """
    corners = table.skeleton(q)
    extents = np.abs(np.stack([table.a, table.d], axis=1).ravel())
    arcs = np.r_[0.0, np.cumsum(extents)]
    arc = np.clip(sigma, 0.0, 1.0) * arcs[-1]
    piece = np.clip(np.searchsorted(arcs, arc, side="left") - 1, 0, len(extents) - 1)
    share = (arc - arcs[piece]) / np.where(extents > 0.0, extents, 1.0)[piece]
    frame = np.arange(len(q))[:, None]
    start, end = corners[frame, piece], corners[frame, piece + 1]
    return np.asarray(start + share[..., None] * (end - start))
