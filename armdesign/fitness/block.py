"""Evaluate candidate arms on a task: the robot fitness r = lambda_f f + lambda_E E, eq. 6, for many designs."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.errors import DesignError
from armdesign.fitness.batch import NONE_GIVEN, Batch, CandidateQueue
from armdesign.fitness.kernels.path import advance, exchange
from armdesign.fitness.kernels.path_slopes import slopes_along_paths
from armdesign.fitness.kernels.solver_state import REPLAY, TRACE
from armdesign.fitness.problem import Problem
from armdesign.fitness.sensitivity import Sensitivity
from armdesign.fitness.slots import Slots, widths
from armdesign.kinematics.compilation import OnProgress, progress_of
from armdesign.kinematics.dh import DHTable, joint_letters

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
        q0: The start pose whose path counts, shape (N, n) [rad]; NaN where invalid.
        mount: Hand frame in the end-effector's frame there, shape (N, 3, 3); NaN where invalid.
        miss_frame: Frame in which the end-effector misses the hand and the candidate is invalid for it, shape (N,);
            0 where the start is missed, -1 where valid.
        miss: Distance of the two in that frame, shape (N,) [m]; 0 where valid.
        steps: Kernel evaluations spent, shape (N,).
        start_steps: Those of them spent on the start, shape (N,).
        accepted: Accepted steps, shape (N,).
        frames: Frames solved, those of all paths, shape (N,).
        slopes: Gradient of r by Phi, shape (N, D), NaN where there is none; shape (N, 0) where nobody has asked.
        excess: What a penalty has added to r, shape (N,) [m]; 0 for arms that can exist, and where there is none.
    """

    fitness: Array
    path_fitness: Array
    area: Array
    valid: NDArray[np.bool_]
    pruned: NDArray[np.bool_]
    start_error: Array
    q0: Array
    mount: Array
    miss_frame: NDArray[np.int64]
    miss: Array
    steps: NDArray[np.int64]
    start_steps: NDArray[np.int64]
    accepted: NDArray[np.int64]
    frames: NDArray[np.int64]
    slopes: Array
    excess: Array


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
        self.slots = [Slots(width, n, problem.prismatic) for width in widths(size)]

    def evaluate(
        self,
        rows: Array,
        yaw: Array,
        cutoff: Array | None = None,
        poses: Array | None = None,
        mounts: Array | None = None,
        bases: Array | None = None,
    ) -> Scores:
        """Fitness of many candidates.

        Args:
            rows: DH rows (alpha, a, d, theta), tool last, shape (N, n + 1, 4) [rad, m, m, rad].
            yaw: Base yaw, shape (N,) [rad].
            cutoff: Fitness beyond which a candidate may be dropped, shape (N,); none by default.
            poses: Start poses known from elsewhere, shape (N, n) [rad]. The first frame is solved from that pose
                alone, which spares the search for it; NaN where there is none.
            mounts: Hand frames in the end-effector's frame, shape (N, 3, 3), that hold instead of the one the
                settings ask for; NaN where there is none.
            bases: Base poses in the task frame, shape (N, 12), see Batch; by default that of the task frame.

        Returns:
            The scores.
        """
        return self._scores(self._run(batch_of(rows, yaw, cutoff, poses, mounts, bases)))

    def with_paths(self, batch: Batch) -> tuple[Scores, Array]:
        """Fitness of many candidates with their joint paths.

        Returns:
            The scores, and the paths, shape (N, T, n) [rad]; NaN where a candidate is invalid or dropped.
        """
        paths = np.full((len(batch.rows), self.problem.frames, self.problem.dof), np.nan)
        return self._scores(self._run(batch, paths=paths)), paths

    def follow(
        self, table: DHTable, pose: Array | None = None, mount: Array | None = None
    ) -> tuple[Scores, PathResult]:
        """Fitness of one arm, with its path frame by frame, up to where it misses the hand.

        Args:
            table: The arm.
            pose: Start pose known from elsewhere, shape (n,) [rad]; see ``evaluate``.
            mount: Hand frame in the end-effector's frame, shape (3, 3), instead of the one the settings ask for.
        """
        rows, yaw = as_rows([table])
        poses, mounts = (None if given is None else np.asarray(given, dtype=float)[None] for given in (pose, mount))
        return self._traced(batch_of(rows, yaw, None, poses, mounts))

    def replay(self, table: DHTable, q: Array, mount: Array | None = None) -> PathResult:
        """Evaluate given joint angles on the problem's frames as they are, without solving anything.

        Args:
            table: The arm.
            q: Joint angles, shape (T, n) [rad].
            mount: Hand frame in the end-effector's frame, shape (3, 3); identity by default.
        """
        rows, yaw = as_rows([table])
        slots = self.slots[-1]
        trace = np.zeros((1, self.problem.frames), dtype=TRACE)
        trace[0]["q"][:, : table.dof] = q
        slots.clear()
        queue = CandidateQueue(batch_of(rows, yaw).whole())
        self._exchange(slots, queue)
        slots.states[0]["phase"] = REPLAY
        slots.attitudes[0]["mount"] = np.eye(3) if mount is None else mount
        slots.arms.q[:] = q[0]
        slots.states[0]["trial"][: table.dof] = q[0]
        slots.advance(self.problem, trace)
        self._exchange(slots, queue)
        return self._path(trace[0], queue.outcome[0])

    @property
    def _trace_length(self) -> int:
        """TRACE records of a candidate, K T for K paths."""
        return int(self.problem.record["start_paths"][0]) * self.problem.frames

    def _traced(self, batch: Batch) -> tuple[Scores, PathResult]:
        """Scores of a single candidate with its path."""
        trace = np.zeros((1, self._trace_length), dtype=TRACE)
        outcome = self._run(batch, trace)
        return self._scores(outcome), self._path(trace[0], outcome[0])

    def _run(self, batch: Batch, trace: NDArray[np.void] | None = None, paths: Array | None = None) -> NDArray[np.void]:
        """Follow the demonstration with every candidate.

        Args:
            batch: The candidates.
            trace: TRACE records to fill, shape (1, K T) for K paths, where there is but one candidate.
            paths: Joint paths to fill, shape (N, T, n).

        Returns:
            Their OUTCOME records, shape (N,).
        """
        queue = CandidateQueue(self._checked(batch))
        kept = 0 if paths is None else self._trace_length
        for slots in self.slots:
            if slots.traces.shape[1] != kept:
                slots.traces = np.zeros((len(slots.states), kept), dtype=TRACE)
        slots = self._narrowest(queue.unfinished)
        slots.clear()
        self._exchange(slots, queue)
        while queue.unfinished:
            done = slots.advance(self.problem, slots.traces if trace is None else trace)
            if done:
                if paths is not None:
                    slots.hand_in(paths)
                queue.unfinished -= done
                self._exchange(slots, queue)
                slots = self._moved(slots, queue.unfinished)
        return queue.outcome

    def _checked(self, batch: Batch) -> Batch:
        """The batch as the kernels read it.

        Raises:
            DesignError: The arms or their start poses have another number of joints than the problem, or a start pose
                or a mount is missing.
        """
        count, n = len(batch.rows), self.problem.dof
        if batch.rows.shape[1:] != (n + 1, 4):
            raise DesignError(f"designs have shape {batch.rows.shape[1:]}", allowed=(n + 1, 4))
        whole = batch.whole()
        for what, values, shape in (("start poses", whole.poses, (count, n)), ("mounts", whole.mounts, (count, 3, 3))):
            if values.shape != shape:
                raise DesignError(f"the {what} have shape {values.shape}", value=values.shape, allowed=shape)
        return whole

    def _narrowest(self, count: int) -> Slots:
        """The fewest slots that hold so many arms; the widest where none do."""
        return next((slots for slots in reversed(self.slots) if len(slots) >= count), self.slots[0])

    def _moved(self, slots: Slots, count: int) -> Slots:
        """As many slots as that many arms take, with the candidates of these."""
        fitting = self._narrowest(count)
        if fitting is not slots:
            fitting.take_over(slots)
        return fitting

    def _exchange(self, slots: Slots, queue: CandidateQueue) -> None:
        """Collect what is done, load what is next."""
        queue.cursor = slots.exchange(self.problem, queue.batch, queue.outcome, queue.cursor)

    def _scores(self, outcome: NDArray[np.void]) -> Scores:
        """Turn outcomes into scores."""
        record, frames, n = self.problem.record[0], self.problem.frames, self.problem.dof
        valid, pruned = outcome["valid"] == 1, outcome["pruned"] == 1
        scored = valid & ~pruned
        f, E = outcome["f_sum"] / frames, outcome["E_sum"] / frames  # eq. 5 over T frames; E likewise (section 5)
        r = record["lambda_f"] * f + record["lambda_E"] * E  # eq. 6
        for values in (r, f, E):
            values[~scored] = np.inf
        oriented = record["w_0"] > 0.0
        mount = outcome["mount"].copy() if oriented else np.tile(np.eye(3), (len(outcome), 1, 1))
        q0 = outcome["best_q"][:, :n].copy()
        q0[~valid], mount[~valid] = np.nan, np.nan
        return Scores(
            fitness=r,
            path_fitness=f,
            area=E,
            valid=valid,
            pruned=pruned,
            start_error=outcome["start_error"].copy(),
            q0=q0,
            mount=mount,
            miss_frame=np.where(valid, -1, outcome["miss_frame"]),
            miss=np.where(valid, 0.0, outcome["miss"]),
            steps=outcome["steps"].copy(),
            start_steps=outcome["start_steps"].copy(),
            accepted=outcome["accepted"].copy(),
            frames=outcome["frames"].copy(),
            slopes=np.zeros((len(outcome), 0)),
            excess=np.zeros(len(outcome)),
        )

    def _path(self, trace: NDArray[np.void], outcome: np.void) -> PathResult:
        """Copy the path that counts out of a trace."""
        n, m = self.problem.dof, self.problem.points
        first = int(outcome["path"]) * self.problem.frames
        rows = trace[first : first + int(outcome["t"])]
        return PathResult(
            q=rows["q"][:, :n].copy(),
            g=rows["g"].copy(),
            area=rows["area"].copy(),
            orientation_error=rows["orientation_error"].copy(),
            sigma=rows["sigma"][:, :m].copy(),
            distance=rows["distance"][:, :m].copy(),
            mount=outcome["mount"].copy() if self.problem.record[0]["w_0"] > 0.0 else np.eye(3),
            start_error=float(outcome["start_error"]),
        )


def batch_of(
    rows: Array,
    yaw: Array,
    cutoff: Array | None = None,
    poses: Array | None = None,
    mounts: Array | None = None,
    bases: Array | None = None,
) -> Batch:
    """Candidates as a batch, see BlockEvaluator.evaluate; what is None is not given."""
    limits = np.full(len(rows), np.inf) if cutoff is None else cutoff
    given = (NONE_GIVEN if values is None else np.asarray(values, dtype=float) for values in (poses, mounts, bases))
    return Batch(rows, yaw, limits, *given)


def as_rows(tables: Sequence[DHTable]) -> tuple[Array, Array]:
    """DH tables as the arrays the evaluator takes: rows (N, n + 1, 4) and base yaw (N,)."""
    rows = np.stack([np.stack([t.alpha, t.a, t.d, t.theta], axis=1) for t in tables])
    return rows, np.array([t.base_yaw for t in tables])


def compile_kernels(problem: Problem, *, slopes: bool = False) -> None:
    """Compile the kernels, or load them from the disk cache, by evaluating nothing but one arm on one frame.

    Args:
        problem: The task with its settings.
        slopes: Whether those of the gradients are needed, too (see Algorithm.takes_slopes).
    """
    first = replace(problem, P=problem.P[:1].copy(), R=problem.R[:1].copy())
    n, joints = problem.dof, joint_letters(problem.prismatic)
    straight = DHTable(np.zeros(n + 1), np.full(n + 1, 0.1), np.full(n + 1, 0.1), joints=joints)
    BlockEvaluator(first, block=1).follow(straight)
    if slopes:
        Sensitivity(first).slopes(batch_of(*as_rows([straight])), np.zeros((1, 1, n)))


def compilation_progress(
    on_progress: OnProgress, *, slopes: bool = False, also: Sequence[Any] = ()
) -> AbstractContextManager[None]:
    """Report how far the kernels are compiled while the context lasts, in which they are called for the first time.

    Args:
        on_progress: Called with how much is compiled and how much there is, in arbitrary units.
        slopes: Whether the kernels of the gradients are called, too.
        also: Other kernels that are.
    """
    entries = [advance, exchange, *([slopes_along_paths] if slopes else []), *also]
    return progress_of(entries, on_progress)
