"""Gradients of the robot fitness by the design on one problem, for the searches that use them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.fitness.batch import NONE_GIVEN, Batch
from armdesign.fitness.kernels.area_slope import PULL
from armdesign.fitness.kernels.path_slopes import slopes_along_paths
from armdesign.fitness.kernels.solver_state import ARM, SCRATCH
from armdesign.fitness.kernels.variations import VARIATION
from armdesign.fitness.problem import Problem


class Slopes(NamedTuple):
    """Gradients of N candidates by all entries of the DH table: (alpha, a, d) of rows 0..n, then the base yaw.

    Attributes:
        path_fitness: Of f, shape (N, 3 (n + 1) + 1).
        area: Of E, shape (N, 3 (n + 1) + 1).
    """

    path_fitness: Array
    area: Array


class Sensitivity:
    """Gradients on one problem."""

    def __init__(self, problem: Problem) -> None:
        """Allocate the scratch of one arm."""
        self.problem = problem
        self.scratch = tuple(np.zeros(1, dtype=kind) for kind in (VARIATION, PULL, ARM, SCRATCH))

    def slopes(self, rows: Array, yaw: Array, paths: Array, mounts: Array | None = None) -> Slopes:
        """Gradients of candidates.

        Args:
            rows: DH rows, shape (N, n + 1, 4) [rad, m, m, rad].
            yaw: Base yaw, shape (N,) [rad].
            paths: Solved joint paths, shape (N, T, n) [rad].
            mounts: Hand frames that were given, see BlockEvaluator.evaluate.
        """
        batch = Batch(rows, yaw, np.full(len(rows), np.inf), mounts=NONE_GIVEN if mounts is None else mounts).whole()
        slopes = np.empty((2, len(rows), 3 * self.problem.dof + 4))
        solved = np.array(paths, dtype=float, order="C")
        slopes_along_paths(*self.scratch, self.problem.arrays, batch, solved, slopes)
        return Slopes(*slopes)
