"""The two phases of an evaluation apart from each other, with clocks inside."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armdesign.fitness.batch import Batch, CandidateQueue
from armdesign.fitness.block import BlockEvaluator, Scores
from armdesign.fitness.kernels.solver_state import GAUSS, NEWTON, OPEN, SAMPLE, SMALLEST_DAMPING
from armdesign.fitness.problem import Problem
from armdesign.fitness.slots import Slots

Array = NDArray[np.float64]


@dataclass
class Clock:
    """Seconds spent in Pinocchio, in rounds of the block (Pinocchio and kernel), and altogether."""

    pinocchio: float = 0.0
    rounds: float = 0.0
    total: float = 0.0

    @property
    def kernel(self) -> float:
        """Seconds in the compiled kernel."""
        return self.rounds - self.pinocchio

    @property
    def rest(self) -> float:
        """Seconds outside of both."""
        return self.total - self.rounds


@contextmanager
def clocked(evaluator: BlockEvaluator) -> Iterator[Clock]:
    """Run a clock in every round of the evaluator's block; it costs some 0.1 us a round."""
    clock, before = Clock(), [(slots.advance, slots.arms.update) for slots in evaluator.slots]

    def timed(call: Callable[..., object], entry: str) -> Callable[..., object]:
        def run(*arguments: object) -> object:
            began = time.perf_counter()
            value = call(*arguments)
            setattr(clock, entry, getattr(clock, entry) + time.perf_counter() - began)
            return value

        return run

    for slots, (advance, update) in zip(evaluator.slots, before, strict=True):
        slots.advance, slots.arms.update = timed(advance, "rounds"), timed(update, "pinocchio")
    began = time.perf_counter()
    yield clock
    clock.total = time.perf_counter() - began
    for slots, (advance, update) in zip(evaluator.slots, before, strict=True):
        slots.advance, slots.arms.update = advance, update


@dataclass(frozen=True)
class Walked:
    """Scores of an evaluation and the clock of it."""

    scores: Scores
    clock: Clock


def walked(evaluator: BlockEvaluator, rows: Array, yaw: Array) -> Walked:
    """Evaluate once, by the clock."""
    with clocked(evaluator) as clock:
        scores = evaluator.evaluate(rows, yaw)
    return Walked(scores, clock)


@dataclass(frozen=True)
class Starts:
    """Start poses found.

    Attributes:
        poses: Shape (N, n) [rad].
        valid: Whether the hand is reached, shape (N,).
        steps: Kernel evaluations spent on each, shape (N,).
        seconds: Time for all of them.
    """

    poses: Array
    valid: NDArray[np.bool_]
    steps: NDArray[np.int64]
    seconds: float

    @property
    def us_per_step(self) -> float:
        """Microseconds per kernel evaluation."""
        return 1e6 * self.seconds / float(self.steps.sum())

    @property
    def us_per_start(self) -> float:
        """Microseconds per design."""
        return 1e6 * self.seconds / len(self.steps)


def seek_starts(problem: Problem, rows: Array, yaw: Array) -> Starts:
    """Evaluate on the first frame alone: nothing but the start phase."""
    evaluator = BlockEvaluator(first_frame(problem))
    batch = Batch(rows, yaw, np.full(len(rows), np.inf))
    began = time.perf_counter()
    outcome = evaluator._run(batch)
    seconds = time.perf_counter() - began
    poses = outcome["best_q"][:, : problem.dof].copy()
    return Starts(poses, outcome["valid"] == 1, outcome["start_steps"].copy(), seconds)


def quickest(starts: Sequence[Starts]) -> Starts:
    """The fastest of equal searches for starts."""
    return min(starts, key=lambda found: found.seconds)


def first_frame(problem: Problem) -> Problem:
    """The problem with its first frame only."""
    return replace(problem, P=problem.P[:1].copy(), R=problem.R[:1].copy())


class PathWalker(BlockEvaluator):
    """Follows the path from start poses that are given: nothing but the path phase."""

    def walk(self, rows: Array, yaw: Array, poses: Array) -> Walked:
        """Evaluate once, by the clock; poses have shape (N, n) [rad]."""
        self.poses = poses
        return walked(self, rows, yaw)

    def _exchange(self, slots: Slots, queue: CandidateQueue) -> None:
        """Load what is next and put candidate k at its start pose."""
        super()._exchange(slots, queue)
        n = self.problem.dof
        for b in np.flatnonzero(slots.states["phase"] == SAMPLE):
            walk = slots.states[b]
            pose = self.poses[walk["candidate"]]
            walk["phase"], walk["start_steps"], walk["nearest"] = OPEN, 0, 0.0
            walk["fresh"], walk["tries"], walk["damping"] = 1, 0, SMALLEST_DAMPING
            walk["model"] = NEWTON if self.problem.record[0]["second_order"] else GAUSS
            walk["trial"][:n] = walk["previous"][:n] = slots.arms.q[b * n : (b + 1) * n] = pose


def walk_path(problem: Problem, rows: Array, yaw: Array, starts: Starts, most: int) -> Walked:
    """The path phase of the first valid designs, so many at most."""
    arms = np.flatnonzero(starts.valid)[:most]
    return PathWalker(problem).walk(rows[arms], yaw[arms], starts.poses[arms])


@dataclass(frozen=True)
class Pace:
    """Speed of the path phase.

    Attributes:
        frames: Frames walked.
        steps: Kernel evaluations.
        accepted: Share of the trials that were accepted; the evaluation that opens a frame is none.
        seconds: Time in the rounds of the block.
    """

    frames: int
    steps: int
    accepted: float
    seconds: float

    @property
    def steps_per_frame(self) -> float:
        """Kernel evaluations per frame; the first frame is the start's."""
        return self.steps / self.frames

    @property
    def us_per_step(self) -> float:
        """Microseconds per kernel evaluation."""
        return 1e6 * self.seconds / self.steps

    @property
    def us_per_frame(self) -> float:
        """Microseconds per frame."""
        return 1e6 * self.seconds / self.frames


def pace(walks: Sequence[Walked]) -> Pace:
    """Speed of the fastest of equal walks along the path from given starts."""
    result = min(walks, key=lambda walk: walk.clock.rounds)
    scores = result.scores
    steps, frames = int(scores.steps.sum()), int(scores.frames.sum())
    opened = frames - len(scores.frames)
    return Pace(frames, steps, float(scores.accepted.sum()) / max(steps - opened, 1), result.clock.rounds)
