"""Candidates on their way through the slots."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.fitness.kernels.solver_state import OUTCOME
from armdesign.kinematics.base_pose import BasePose

Outcome = NDArray[np.void]
NONE_GIVEN: Array = np.empty(0)


class Batch(NamedTuple):
    """Candidates.

    Attributes:
        rows: DH rows (alpha, a, d, theta), tool last, shape (N, n + 1, 4) [rad, m, m, rad].
        yaw: Base yaw, shape (N,) [rad].
        cutoff: Fitness beyond which a candidate may be dropped, shape (N,).
        poses: Start poses already known, shape (N, n) [rad]; NaN where there is none.
        mounts: Hand frames in the end-effector's frame, shape (N, 3, 3); NaN where the start decides.
        bases: Base poses in the task frame, shape (N, 12): axes x, y, z, then the origin; that of the task frame itself
            where none are given.
    """

    rows: Array
    yaw: Array
    cutoff: Array
    poses: Array = NONE_GIVEN
    mounts: Array = NONE_GIVEN
    bases: Array = NONE_GIVEN

    def part(self, chosen: NDArray[np.bool_]) -> Batch:
        """Some of the candidates of a whole batch."""
        return Batch(*(values[chosen] for values in self))

    def whole(self) -> Batch:
        """This batch with contiguous arrays, as the kernels read them, and what is not given filled in."""
        count, n = len(self.rows), self.rows.shape[1] - 1
        poses = np.full((count, n), np.nan) if self.poses.shape == NONE_GIVEN.shape else self.poses
        mounts = np.full((count, 3, 3), np.nan) if self.mounts.shape == NONE_GIVEN.shape else self.mounts
        bases = np.tile(BasePose().columns, (count, 1)) if self.bases.shape == NONE_GIVEN.shape else self.bases
        arrays = (self.rows, self.yaw, self.cutoff, poses, mounts, bases)
        return Batch(*(np.array(values, dtype=float, order="C") for values in arrays))


class CandidateQueue:
    """Candidates in the order in which they begin, and what has come of them.

    Attributes:
        batch: All of them.
        outcome: OUTCOME records of those that are done, shape (N,).
        cursor: How many have begun.
        unfinished: How many are not done.
    """

    def __init__(self, batch: Batch) -> None:
        """Begin with a batch."""
        self.batch = batch
        self.outcome: Outcome = np.zeros(len(batch.rows), dtype=OUTCOME)
        self.cursor, self.unfinished = 0, len(batch.rows)
