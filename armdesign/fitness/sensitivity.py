"""Gradients of the robot fitness by the design on one problem, for the searches that use them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.fitness.kernels.area_slope import PULL
from armdesign.fitness.kernels.association import MATCH
from armdesign.fitness.kernels.orientation import ATTITUDE
from armdesign.fitness.kernels.path_slopes import slopes_along_paths
from armdesign.fitness.kernels.temporal import FRAME
from armdesign.fitness.kernels.variations import VARIATION
from armdesign.fitness.problem import Problem
from armdesign.kinematics.kernels.dls import STEP
from armdesign.kinematics.kernels.skeleton import CHAIN


class Slopes(NamedTuple):
    """Gradients of N candidates by all entries of the DH table: (alpha, a, d) of rows 0..n, then the base yaw.

    Attributes:
        path_fitness: Of f, shape (N, 3 (n + 1) + 1).
        area: Of E, likewise.
    """

    path_fitness: Array
    area: Array


class Sensitivity:
    """Gradients on one problem."""

    def __init__(self, problem: Problem) -> None:
        """Allocate the scratch of one arm."""
        self.problem = problem
        kinds = (VARIATION, PULL, CHAIN, FRAME, ATTITUDE, MATCH, STEP)
        self.scratch = tuple(np.zeros(1, dtype=kind) for kind in kinds)

    def slopes(self, rows: Array, yaw: Array, paths: Array, mounts: Array | None = None) -> Slopes:
        """Gradients of candidates.

        Args:
            rows: DH rows, shape (N, n + 1, 4) [rad, m, m, rad].
            yaw: Base yaw, shape (N,) [rad].
            paths: Solved joint paths, shape (N, T, n) [rad].
            mounts: Hand frames that were given, see BlockEvaluator.evaluate.
        """
        problem, count = self.problem, len(rows)
        f, E = np.empty((2, count, 3 * problem.dof + 4))
        given = np.full((count, 3, 3), np.nan) if mounts is None else mounts
        task = (problem.record, problem.P, problem.R)
        arrays = (np.array(values, dtype=float, order="C") for values in (rows, yaw, paths, given))
        slopes_along_paths(*self.scratch, *task, *arrays, f, E)
        return Slopes(f, E)
