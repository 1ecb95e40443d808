"""The best pose of an arm for one frame alone: min over q of g (eq. 3) without continuity, from many start poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import DesignError, SettingsError, TaskError
from armdesign.fitness.block import BlockEvaluator, as_rows, batch_of
from armdesign.fitness.kernels.solver_state import MOUNT_IDENTITY
from armdesign.fitness.problem import Problem, make_problem
from armdesign.kinematics.dh import DHTable
from armdesign.settings.sections import Fitness, Solver


@dataclass(frozen=True)
class Pose:
    """The best pose found for one frame.

    Attributes:
        q: Joint angles, shape (n,) [rad].
        g: Temporal fitness there, eq. 3 [m].
        orientation_error: e_R; 0 where orientation has no weight [rad].
        sigma: Places of the points on the arm, arc length / L, shape (m,).
        distance: Distances of the points to their places, shape (m,) [m].
        found: g at the end of every descent, shape (K,) [m].
        steps: Kernel evaluations spent on all of them.
    """

    q: Array
    g: float
    orientation_error: float
    sigma: Array
    distance: Array
    found: Array
    steps: int


class PoseSolver(BlockEvaluator):
    """Minimises g of one frame over the joint limits, one descent from each of K low-discrepancy start poses.

    There is no ball around a previous pose, the hand has no raised weight, and the mount is the identity whatever
    the settings say: within a single frame it could turn any orientation error to 0. The first K start poses are the
    same for every larger K, so that more starts never find less.
    """

    def __init__(
        self,
        limits: ArrayLike,
        fitness: Fitness,
        solver: Solver | None = None,
        *,
        starts: int = 64,
        block: int | None = None,
        prismatic: Sequence[bool] = (),
    ) -> None:
        """Allocate a block in which the descents run side by side.

        Args:
            limits: Joint limits, shape (n, 2) [rad; m of joints that slide].
            fitness: Settings of the fitness with one weight per point (see resolve_weights).
            solver: Settings of the solver; its ``starts`` and ``descents`` are not used.
            starts: Number of descents K.
            block: Descents side by side; any value gives the same pose.
            prismatic: Which joints slide, n of them; none by default.

        Raises:
            SettingsError: There is no start, or the settings hold no weights.
        """
        if starts < 1:
            raise SettingsError(f"a pose cannot be sought from {starts} starts", value=starts, allowed="1 or more")
        if not fitness.weights:
            raise SettingsError("the fitness settings hold no weights", allowed="one weight per point")
        points = np.zeros((1, len(fitness.weights), 3))
        alone = replace(fitness, mount="identity")
        solver = replace(solver or Solver(), starts=starts)
        problem = make_problem(points, np.eye(3)[None], 1.0, limits, alone, solver)
        problem.record["polish_weights"] = problem.record["weights"]
        problem.record["start_free"] = problem.record["free"]
        problem.record["mount"] = MOUNT_IDENTITY
        problem.record["reach"] = np.inf
        super().__init__(problem.with_joints(prismatic or (False,) * problem.dof), block)

    def solve(self, table: DHTable, points: ArrayLike, rotation: ArrayLike | None = None) -> Pose:
        """Find the best pose of one arm for one frame.

        Args:
            table: The arm.
            points: Demonstrated points p_1..p_m, shape (m, 3) [m].
            rotation: R_hand, shape (3, 3); needed where the orientation has a weight.

        Raises:
            DesignError: The arm has another number of joints than the limits, or others of them slide.
            TaskError: The points or the rotation are not what the settings ask for.
        """
        if table.dof != self.problem.dof:
            raise DesignError(f"the arm has {table.dof} joints, there are limits for {self.problem.dof}")
        if table.prismatic != self.problem.prismatic:
            raise DesignError(f"the arm's joints are {table.joints}, others slide here", value=table.joints)
        self.problem = with_frame(self.problem, points, rotation)
        rows, yaw = as_rows([table])
        count = len(self.problem.starts)
        same_arm = batch_of(np.repeat(rows, count, axis=0), np.repeat(yaw, count), poses=self.problem.starts)
        outcome = self._run(same_arm)
        best = outcome[int(np.argmin(outcome["f_sum"]))]
        q = best["best_q"][: table.dof].copy()
        path = self.replay(table, q[None])
        return Pose(
            q=q,
            g=float(path.g[0]),
            orientation_error=float(path.orientation_error[0]),
            sigma=path.sigma[0],
            distance=path.distance[0],
            found=outcome["f_sum"].copy(),
            steps=int(outcome["steps"].sum()),
        )


def with_frame(problem: Problem, points: ArrayLike, rotation: ArrayLike | None) -> Problem:
    """The problem with another single frame.

    Raises:
        TaskError: A shape does not fit, or the orientation is missing.
    """
    # copies, since kernels are compiled anew for arrays that cannot be written to
    P = np.array(points, dtype=float)[None]
    if P.shape != problem.P.shape:
        raise TaskError(f"the points have shape {P.shape[1:]}", allowed=problem.P.shape[1:])
    if rotation is None:
        if problem.record[0]["w_0"] > 0.0:
            raise TaskError("the orientation has a weight, but there is no rotation to compare with")
        return replace(problem, P=P)
    R = np.array(rotation, dtype=float)[None]
    if R.shape != (1, 3, 3):
        raise TaskError(f"the rotation has shape {R.shape[1:]}", allowed=(3, 3))
    return replace(problem, P=P, R=R)
