"""Gradients of the robot fitness by the design on one problem, for the searches that use them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.fitness.batch import Batch
from armdesign.fitness.kernels.area_slope import PULL
from armdesign.fitness.kernels.path_slopes import slopes_along_paths
from armdesign.fitness.kernels.solver_state import ARM, SCRATCH
from armdesign.fitness.kernels.variations import VARIATION
from armdesign.fitness.problem import Problem


class Slopes(NamedTuple):
    """Gradients of N candidates by E entries of their designs, in the order of DesignSpace.names.

    Attributes:
        path_fitness: Of f, shape (N, E).
        area: Of E, shape (N, E).
        turns: Derivatives of the joint angles along the paths, shape (N, T, n, E); (0, T, n, E) where not wanted.
    """

    path_fitness: Array
    area: Array
    turns: Array


class Sensitivity:
    """Gradients on one problem."""

    def __init__(self, problem: Problem, entries: int | None = None) -> None:
        """Allocate the scratch of one arm.

        Args:
            problem: The task with its settings.
            entries: Number of entries E of a design; by default those of an arm at the base, 3 (n + 1) + 1.
        """
        self.problem = problem
        self.entries = 3 * problem.dof + 4 if entries is None else entries
        self.scratch = tuple(np.zeros(1, dtype=kind) for kind in (VARIATION, PULL, ARM, SCRATCH))

    def slopes(self, batch: Batch, paths: Array, *, turns: bool = False) -> Slopes:
        """Gradients of candidates.

        Args:
            batch: The candidates; of start pose and mount only what was given counts.
            paths: Their solved joint paths, shape (N, T, n) [rad].
            turns: Whether the derivatives of the joint angles are wanted, too.
        """
        slopes = np.empty((2, len(paths), self.entries))
        solved = np.array(paths, dtype=float, order="C")
        turned = np.empty((len(paths) if turns else 0, *solved.shape[1:], self.entries))
        slopes_along_paths(*self.scratch, self.problem.arrays, batch.whole(), solved, slopes, turned)
        return Slopes(slopes[0], slopes[1], turned)
