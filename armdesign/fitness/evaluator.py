"""Evaluate candidate arms on a task: the robot fitness r = lambda_f f + lambda_E E, eq. 6, for many designs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armdesign.errors import DesignError
from armdesign.fitness.association import MATCH
from armdesign.fitness.orientation import ATTITUDE
from armdesign.fitness.path import IDLE, REPLAY, TRACE, WALK, advance, exchange
from armdesign.fitness.problem import Problem
from armdesign.fitness.temporal import FRAME, MOTION
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.dls import STEP
from armdesign.kinematics.models import ArmBlock
from armdesign.kinematics.skeleton import CHAIN

Array = NDArray[np.float64]
JOINTS_PER_BLOCK = 96


@dataclass(frozen=True)
class Scores:
    """Fitness of N candidates; entries of candidates that are invalid or pruned are infinite.

    Attributes:
        fitness: r, shape (N,) [m].
        path_fitness: f, shape (N,) [m].
        area: E, shape (N,) [m].
        valid: Whether the start is reached, shape (N,).
        pruned: Whether the candidate was dropped at its cutoff, shape (N,).
        start_error: Distance of the hand to its first point at the start; of the best try where invalid, (N,) [m].
        steps: Kernel evaluations spent, shape (N,).
        start_steps: Those of them spent on the start, shape (N,).
        accepted: Accepted steps, shape (N,).
        frames: Frames solved, shape (N,).
    """

    fitness: Array
    path_fitness: Array
    area: Array
    valid: NDArray[np.bool_]
    pruned: NDArray[np.bool_]
    start_error: Array
    steps: NDArray[np.int64]
    start_steps: NDArray[np.int64]
    accepted: NDArray[np.int64]
    frames: NDArray[np.int64]


@dataclass(frozen=True)
class PathResult:
    """One arm on one task, frame by frame.

    Attributes:
        q: Joint angles, shape (T, n) [rad].
        g: Temporal fitness G_t, shape (T,) [m].
        area: E_t, shape (T,) [m].
        orientation_error: e_R, shape (T,) [rad].
        sigma: Places of the points on the arm, arc length / L, shape (T, m).
        distance: Distances of the points to their places, shape (T, m) [m].
        mount: Hand frame in the end-effector's frame, shape (3, 3).
        start_error: Distance of the end-effector to the hand at the first frame [m].
    """

    q: Array
    g: Array
    area: Array
    orientation_error: Array
    sigma: Array
    distance: Array
    mount: Array
    start_error: float


class BlockEvaluator:
    """Evaluates candidate arms of n joints on one problem, a block of them at a time.

    The fitness is a pure function of the candidate: it does not depend on the block size, on the other candidates or
    on what was evaluated before.
    """

    def __init__(self, problem: Problem, block: int | None = None) -> None:
        """Allocate a block.

        Args:
            problem: What to evaluate on.
            block: Number of arms B side by side; by default as many as keep the Pinocchio model small.
        """
        self.problem = problem
        n = problem.dof
        size = min(32, max(1, JOINTS_PER_BLOCK // n)) if block is None else block
        self.arms = ArmBlock(size, n)
        self.walks = np.zeros(size, dtype=WALK)
        self.chains = np.zeros(size, dtype=CHAIN)
        self.frames = np.zeros(size, dtype=FRAME)
        self.attitudes = np.zeros(size, dtype=ATTITUDE)
        self.motion = np.zeros(1, dtype=MOTION)
        self.match = np.zeros(1, dtype=MATCH)
        self.step = np.zeros(1, dtype=STEP)
        self.untraced = np.zeros((size, 0), dtype=TRACE)

    def evaluate(self, rows: Array, yaw: Array, cutoff: Array | None = None) -> Scores:
        """Fitness of many candidates.

        Args:
            rows: DH rows (alpha, a, d, theta), tool last, shape (N, n + 1, 4) [rad, m, m, rad].
            yaw: Base yaw, shape (N,) [rad].
            cutoff: Fitness beyond which a candidate may be dropped, shape (N,); none by default.

        Returns:
            The scores.
        """
        count = len(rows)
        limits = np.full(count, np.inf) if cutoff is None else np.ascontiguousarray(cutoff, dtype=float)
        outcome = np.zeros(count, dtype=WALK)
        self._run(np.ascontiguousarray(rows, dtype=float), np.ascontiguousarray(yaw, dtype=float), limits, outcome)
        return self._scores(outcome)

    def follow(self, table: DHTable) -> tuple[Scores, PathResult]:
        """Fitness of one arm, with its path frame by frame. An arm that misses the start has an empty path."""
        rows, yaw = as_rows([table])
        outcome = np.zeros(1, dtype=WALK)
        trace = np.zeros((len(self.walks), self.problem.frames), dtype=TRACE)
        self._run(rows, yaw, np.full(1, np.inf), outcome, trace)
        return self._scores(outcome), self._path(trace[0], outcome[0])

    def replay(self, table: DHTable, q: Array, mount: Array | None = None) -> PathResult:
        """Book given joint angles on the problem's frames as they are, without solving anything.

        Args:
            table: The arm.
            q: Joint angles, shape (T, n) [rad].
            mount: Hand frame in the end-effector's frame, shape (3, 3); identity by default.
        """
        rows, yaw = as_rows([table])
        size = len(self.walks)
        trace = np.zeros((size, self.problem.frames), dtype=TRACE)
        trace[0]["q"][:, : table.dof] = q
        outcome = np.zeros(1, dtype=WALK)
        self.walks["phase"] = IDLE
        self._exchange(rows, yaw, np.full(1, np.inf), outcome, 0)
        self.walks[0]["phase"] = REPLAY
        self.attitudes[0]["mount"] = np.eye(3) if mount is None else mount
        self.arms.q[: table.dof] = q[0]
        self.walks[0]["trial"][: table.dof] = q[0]
        while self._advance(trace) == 0:
            pass
        return self._path(trace[0], self.walks[0])

    def _run(
        self, rows: Array, yaw: Array, cutoff: Array, outcome: NDArray[np.void], trace: NDArray[np.void] | None = None
    ) -> None:
        """Walk every candidate to its end and collect the walks."""
        if rows.shape[1:] != (self.problem.dof + 1, 4):
            raise DesignError(f"designs have shape {rows.shape[1:]}", allowed=(self.problem.dof + 1, 4))
        self.walks["phase"] = IDLE
        cursor = self._exchange(rows, yaw, cutoff, outcome, 0)
        waiting = len(rows)
        while waiting:
            done = self._advance(self.untraced if trace is None else trace)
            if done:
                waiting -= done
                cursor = self._exchange(rows, yaw, cutoff, outcome, cursor)

    def _exchange(self, rows: Array, yaw: Array, cutoff: Array, outcome: NDArray[np.void], cursor: int) -> int:
        """Collect what is done, load what is next; returns the index of the next candidate."""
        problem, arms = self.problem, self.arms
        state = (self.walks, self.chains, arms.placements, arms.q)
        return int(exchange(*state, problem.record, problem.starts, rows, yaw, cutoff, outcome, cursor))

    def _advance(self, trace: NDArray[np.void]) -> int:
        """One step of the whole block."""
        problem, arms = self.problem, self.arms
        arms.update()
        state = (self.walks, self.chains, self.frames, self.attitudes, self.motion, self.match, self.step)
        task = (problem.record, problem.P, problem.R, problem.starts)
        return int(advance(*state, *task, arms.poses, arms.jacobian, arms.q, trace))

    def _scores(self, outcome: NDArray[np.void]) -> Scores:
        """Turn finished walks into scores."""
        record, frames = self.problem.record[0], self.problem.frames
        valid, pruned = outcome["valid"] == 1, outcome["pruned"] == 1
        scored = valid & ~pruned
        f, E = outcome["f_sum"] / frames, outcome["E_sum"] / frames
        r = record["lambda_f"] * f + record["lambda_E"] * E
        for values in (r, f, E):
            values[~scored] = np.inf
        return Scores(
            fitness=r,
            path_fitness=f,
            area=E,
            valid=valid,
            pruned=pruned,
            start_error=outcome["start_error"].copy(),
            steps=outcome["steps"].copy(),
            start_steps=outcome["start_steps"].copy(),
            accepted=outcome["accepted"].copy(),
            frames=outcome["t"].copy(),
        )

    def _path(self, trace: NDArray[np.void], walk: np.void) -> PathResult:
        """Copy a trace out of the records."""
        n, m = self.problem.dof, self.problem.points
        rows = trace[: int(walk["t"])]
        return PathResult(
            q=rows["q"][:, :n].copy(),
            g=rows["g"].copy(),
            area=rows["area"].copy(),
            orientation_error=rows["orientation_error"].copy(),
            sigma=rows["sigma"][:, :m].copy(),
            distance=rows["distance"][:, :m].copy(),
            mount=self.attitudes[0]["mount"].copy() if self.problem.record[0]["w_0"] > 0.0 else np.eye(3),
            start_error=float(walk["start_error"]),
        )


def as_rows(tables: Sequence[DHTable]) -> tuple[Array, Array]:
    """DH tables as the arrays the evaluator takes: rows (N, n + 1, 4) and base yaw (N,)."""
    rows = np.stack([np.stack([t.alpha, t.a, t.d, t.theta], axis=1) for t in tables])
    return rows, np.array([t.base_yaw for t in tables])


def compile_kernels(problem: Problem) -> None:
    """Compile the kernels, or load them from the disk cache, by evaluating nothing but one arm on one frame."""
    first = replace(problem, P=problem.P[:1].copy(), R=problem.R[:1].copy())
    straight = DHTable(np.zeros(problem.dof + 1), np.full(problem.dof + 1, 0.1), np.full(problem.dof + 1, 0.1))
    BlockEvaluator(first, block=1).follow(straight)
