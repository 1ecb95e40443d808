"""An extra joint of zero length: arms of n + 1 joints that, at rest, are an arm of n."""

from __future__ import annotations

from itertools import product

import numpy as np

from armdesign._types import Array
from armdesign.fitness.constraints import DesignSpace
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.dh import DHTable

TWISTS = np.deg2rad([90.0, -90.0, 45.0, -45.0, 70.0, -70.0, 20.0, -20.0])
"""Twists in front of the extra joint that are tried [rad], the most promising first."""


def with_extra_joint(table: DHTable, space: DesignSpace, most: int, base: BasePose | None = None) -> Array:
    """Designs of one joint more that contain an arm.

    The row (beta, 0, 0) goes in front of row k, whose twist becomes alpha_k - beta:

        Rx(beta) Rz(q_new) Rx(alpha_k - beta) Tx(a_k) Tz(d_k) Rz(q_k),

    at q_new = 0 the row as it was. Arm, skeleton and length are the same, so the best path of the smaller arm is one of
    the larger one's paths.

    Args:
        table: The arm of n joints.
        space: The design space of n + 1 joints.
        most: How many designs at most; every row k comes in turn before the next beta.
        base: Where the arm stands in the task frame, where the base is to be placed.

    Returns:
        Those that lie in Omega_l, shape (N, D); none where the bounds leave no room for a joint of zero length.
    """
    rows = np.column_stack([table.alpha, table.a, table.d])
    lower, upper = space.bounds
    place = space.place_entries(table, base)
    designs = np.empty((len(TWISTS) * len(rows), len(space.lower)))
    for design, (beta, k) in zip(designs, product(TWISTS, range(len(rows))), strict=True):
        longer = np.insert(rows, k, (beta, 0.0, 0.0), axis=0)
        longer[k + 1, 0] -= beta
        design[:] = np.r_[longer.ravel(), place]
    kept = designs[(designs[:, ~space.free] == space.lower[~space.free]).all(axis=1)][:, space.free]
    rounded = np.clip(kept, lower, upper)
    kept = rounded[np.abs(rounded - kept).max(axis=1, initial=0.0) < 1e-12]
    chosen: Array = kept[space.admissible(kept)][:most]
    return chosen
