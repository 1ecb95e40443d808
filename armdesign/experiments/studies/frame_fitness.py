"""The temporal fitness of one arm at one frame as a function of the pose, for solvers from elsewhere."""

from __future__ import annotations

import numpy as np

from armdesign._types import Array
from armdesign.experiments.studies.kernels.frame_kernels import hang, loose_fitness, pose_fitness, pose_gradient
from armdesign.fitness.block import as_rows
from armdesign.fitness.kernels.association import MATCH
from armdesign.fitness.kernels.orientation import ATTITUDE
from armdesign.fitness.kernels.temporal import FRAME, MOTION
from armdesign.fitness.problem import Problem
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.kernels.skeleton import CHAIN
from armdesign.kinematics.models import ArmBlock


class FrameFitness:
    """g(t, q) of eq. 3 for a given arm and frame: no ball around a previous pose, and the mount is the identity."""

    def __init__(self, table: DHTable, problem: Problem, frame: int) -> None:
        """Hang the arm.

        Args:
            table: The arm.
            problem: The task.
            frame: Index t of the frame.
        """
        record = problem.record[0]
        self.dof, points = table.dof, problem.points
        self.limits = np.stack([record["lower"][: self.dof], record["upper"][: self.dof]], axis=1)
        self.free = int(record["free"])
        self.arm = ArmBlock(1, self.dof)
        self.chain, self.frame, self.motion, self.match, self.attitude = (
            np.zeros(1, dtype=kind) for kind in (CHAIN, FRAME, MOTION, MATCH, ATTITUDE)
        )
        self.attitude["mount"] = np.eye(3)
        rotation = problem.R[frame if len(problem.R) > 1 else 0]
        self.target = (problem.P[frame].copy(), rotation.copy(), record["weights"][:points].copy())
        self.orientation = (float(record["w_0"]), int(record["metric"]))
        rows, yaw = as_rows([table])
        hang(self.chain, self.arm.placements, rows[0], float(yaw[0]))

    def __call__(self, q: Array) -> float:
        """G with the best sigma [m].

        Args:
            q: Joint angles, n of them in any shape [rad].
        """
        self._pose(q)
        state = (self.chain, self.frame, self.match, self.attitude, self.arm.poses)
        return float(pose_fitness(*state, *self.target, self.free, *self.orientation))

    def with_gradient(self, q: Array) -> tuple[float, Array]:
        """G with the best sigma, and its gradient, shape (n,) [m/rad]."""
        self._pose(q)
        gradient = np.zeros(self.dof)
        state = (self.chain, self.frame, self.motion, self.match, self.attitude, self.arm.poses, self.arm.jacobian)
        g = pose_gradient(*state, *self.target, self.free, *self.orientation, gradient)
        return float(g), gradient

    def with_sigma(self, x: Array) -> float:
        """G with given sigma.

        Args:
            x: Joint angles, then the free sigma, shape (n + free,).
        """
        self._pose(x[: self.dof])
        state = (self.chain, self.frame, self.match, self.attitude, self.arm.poses)
        sigma = np.ascontiguousarray(x[self.dof :], dtype=float)
        return float(loose_fitness(*state, *self.target, sigma, *self.orientation))

    def _pose(self, q: Array) -> None:
        """Bring the arm into a pose."""
        self.arm.q[:] = np.ravel(q)
        self.arm.update()
