"""Robot fitness r = lambda_f f + lambda_E E, eq. 6, of designs given by Phi; cheap tests come first."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign.fitness.constraints import DesignSpace
from armdesign.fitness.evaluator import BlockEvaluator, Scores
from armdesign.fitness.flow import Batch
from armdesign.fitness.problem import Problem

Array = NDArray[np.float64]
Generation: TypeAlias = "tuple[ArrayLike, Array | None]"
"""Designs Phi, shape (N, D), and the fitness beyond which each may be dropped, shape (N,) or None."""


@dataclass(frozen=True)
class Rejections:
    """How many candidates each test has removed, in the order of the tests.

    Attributes:
        constraints: Outside Omega_l: bounds, total length, two joints on one axis.
        reach: The first hand point lies beyond the arm's reach.
        start: No start pose brings the end-effector to it.
        pruned: Dropped on the way, past their cutoff.
    """

    constraints: int = 0
    reach: int = 0
    start: int = 0
    pruned: int = 0

    def __add__(self, other: Rejections) -> Rejections:
        """Sum of two counts."""
        return Rejections(
            self.constraints + other.constraints,
            self.reach + other.reach,
            self.start + other.start,
            self.pruned + other.pruned,
        )


class Tested(NamedTuple):
    """A generation after the cheap tests.

    Attributes:
        admissible: Which candidates lie in Omega_l, shape (N,).
        chosen: Which of them may reach the start, shape (N,).
        batch: Those, to be walked.
    """

    admissible: NDArray[np.bool_]
    chosen: NDArray[np.bool_]
    batch: Batch

    def scored(self, walked: Scores) -> tuple[Scores, Rejections]:
        """Scores of all candidates from those of the chosen ones, and what removed the others."""
        scores = spread(walked, self.chosen)
        return scores, Rejections(
            constraints=int((~self.admissible).sum()),
            reach=int((self.admissible & ~self.chosen).sum()),
            start=int((self.chosen & ~scores.valid).sum()),
            pruned=int(scores.pruned.sum()),
        )


class RobotFitness:
    """The objective of the search: Phi in, scores out; a pure function of each candidate."""

    def __init__(self, problem: Problem, space: DesignSpace, block: int | None = None) -> None:
        """Allocate the evaluator.

        Args:
            problem: The task with its settings.
            space: The design space; Phi are its free entries.
            block: Number of arms side by side; any value gives the same scores.
        """
        self.problem = problem
        self.space = space
        self.evaluator = BlockEvaluator(problem, block)

    def evaluate(self, Phi: ArrayLike, cutoff: Array | None = None) -> tuple[Scores, Rejections]:
        """Score candidates.

        Args:
            Phi: Designs, shape (N, D) [rad, m].
            cutoff: Fitness beyond which a candidate may be dropped, shape (N,).

        Returns:
            The scores, in the order of Phi, and what removed the others.
        """
        return next(self.stream((Phi, cutoff), lambda: None))

    def stream(self, first: Generation, more: Callable[[], Generation | None]) -> Iterator[tuple[Scores, Rejections]]:
        """Score generations one behind the other, each beginning beside the last arms of the one before.

        Args:
            first: Phi and cutoff of the first, as for ``evaluate``.
            more: Gives the next, or None if there is none yet; the stream ends when all are done and there is none.
        """
        tested: deque[Tested] = deque()

        def batch(generation: Generation) -> Batch:
            tested.append(self._test(*generation))
            return tested[-1].batch

        def next_batch() -> Batch | None:
            generation = more()
            return None if generation is None else batch(generation)

        for scores in self.evaluator.stream(batch(first), next_batch):
            yield tested.popleft().scored(scores)

    def _test(self, Phi: ArrayLike, cutoff: Array | None) -> Tested:
        """Make out the candidates that have to be walked."""
        designs = np.atleast_2d(np.asarray(Phi, dtype=float))
        admissible = self.space.admissible(designs)
        rows, yaw = self.space.rows(designs)
        chosen = admissible & self._may_reach(rows)
        limits = np.full(len(designs), np.inf) if cutoff is None else np.asarray(cutoff, dtype=float)
        return Tested(admissible, chosen, Batch(rows[chosen], yaw[chosen], limits[chosen]))

    def _may_reach(self, rows: Array) -> NDArray[np.bool_]:
        """Whether the first hand point lies in the shell the arm's links can span.

        A row's piece has the length sqrt(a^2 + d^2), since a and d stand at right angles; the pieces stretched out
        give the outer radius, the longest against all others the inner one.
        """
        pieces = np.hypot(rows[:, :, 1], rows[:, :, 2])
        outer = pieces.sum(axis=1)
        inner = 2.0 * pieces.max(axis=1) - outer
        distance = np.linalg.norm(self.problem.P[0, -1])
        slack = float(self.problem.record["reach"][0]) + 1e-9
        verdict: NDArray[np.bool_] = (outer >= distance - slack) & (inner <= distance + slack)
        return verdict


def spread(scores: Scores, chosen: NDArray[np.bool_]) -> Scores:
    """Scores of the chosen candidates put in their places among all; the others are invalid."""
    empty = {"fitness": np.inf, "path_fitness": np.inf, "area": np.inf, "start_error": np.inf}
    columns = {}
    for name, values in vars(scores).items():
        column = np.full(len(chosen), empty.get(name, 0), dtype=values.dtype)
        column[chosen] = values
        columns[name] = column
    return replace(scores, **columns)
