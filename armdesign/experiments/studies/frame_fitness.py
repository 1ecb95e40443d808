"""The temporal fitness of one arm at one frame as a function of the pose, for solvers from elsewhere."""

from __future__ import annotations

import numpy as np

from armdesign._types import Array
from armdesign.experiments.studies.kernels.frame_kernels import load, loose_fitness, pose_fitness, pose_gradient
from armdesign.fitness.block import as_rows
from armdesign.fitness.kernels.solver_state import ARM, SCRATCH
from armdesign.fitness.kernels.temporal import Target
from armdesign.fitness.problem import Problem
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.models import ArmBlock


class FrameFitness:
    """g(t, q) of eq. 3 for a given arm and frame: no ball around a previous pose, and the mount is the identity."""

    def __init__(self, table: DHTable, problem: Problem, frame: int) -> None:
        """Load the arm."""
        record = problem.record[0]
        self.dof, points = table.dof, problem.points
        self.limits = np.stack([record["lower"][: self.dof], record["upper"][: self.dof]], axis=1)
        self.free = int(record["free"])
        self.arm = ArmBlock(1, self.dof)
        self.records, self.scratch = np.zeros(1, dtype=ARM), np.zeros(1, dtype=SCRATCH)
        self.records["attitude"]["mount"] = np.eye(3)
        rotation = problem.R[frame if len(problem.R) > 1 else 0].copy()
        weights = record["weights"][:points].copy()
        self.target = Target(
            problem.P[frame].copy(), rotation, weights, float(record["w_0"]), self.free, int(record["metric"])
        )
        rows, yaw = as_rows([table])
        load(self.records, self.arm.placements, rows[0], float(yaw[0]))

    def __call__(self, q: Array) -> float:
        """G with the best sigma [m].

        Args:
            q: Joint angles, n of them in any shape [rad].
        """
        self._pose(q)
        return float(pose_fitness(self.records, self.scratch, self.arm.poses, self.target))

    def with_gradient(self, q: Array) -> tuple[float, Array]:
        """G with the best sigma, and its gradient, shape (n,) [m/rad]."""
        self._pose(q)
        gradient = np.zeros(self.dof)
        g = pose_gradient(self.records, self.scratch, self.arm.views, self.target, gradient)
        return float(g), gradient

    def with_sigma(self, x: Array) -> float:
        """G with given sigma.

        Args:
            x: Joint angles, then the free sigma, shape (n + free,).
        """
        self._pose(x[: self.dof])
        sigma = np.ascontiguousarray(x[self.dof :], dtype=float)
        # sigma decides the number of free points here, the target's own number does not fit where hands are tied
        target = self.target._replace(free=len(sigma))
        return float(loose_fitness(self.records, self.scratch, self.arm.poses, target, sigma))

    def _pose(self, q: Array) -> None:
        """Bring the arm into a pose."""
        self.arm.q[:] = np.ravel(q)
        self.arm.update()
