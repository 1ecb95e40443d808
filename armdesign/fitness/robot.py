"""Robot fitness r = lambda_f f + lambda_E E, eq. 6, of designs given by Phi; cheap tests come first."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import DesignError
from armdesign.fitness.batch import Batch
from armdesign.fitness.block import BlockEvaluator, Scores
from armdesign.fitness.constraints import DesignSpace
from armdesign.fitness.problem import Problem
from armdesign.fitness.sensitivity import Sensitivity


class Generation(NamedTuple):
    """Candidates to be scored.

    Attributes:
        Phi: Designs, shape (N, D) [rad, m].
        cutoff: Fitness beyond which a candidate may be dropped, shape (N,); None for never.
        poses: Start poses known from elsewhere, shape (N, n) [rad]: the first frame is solved from that pose alone. NaN
            or None where there is none.
        mounts: Hand frames in the end-effector's frame, shape (N, 3, 3), that hold instead of the one the settings ask
            for; NaN or None where there is none.
        slopes: Whether the gradients of r are wanted, too.
    """

    Phi: ArrayLike
    cutoff: Array | None = None
    poses: Array | None = None
    mounts: Array | None = None
    slopes: bool = False

    def part(self, chosen: slice) -> Generation:
        """Some of the candidates."""
        known = (self.cutoff, self.poses, self.mounts)
        cutoff, poses, mounts = (None if values is None else values[chosen] for values in known)
        return Generation(np.asarray(self.Phi)[chosen], cutoff, poses, mounts, self.slopes)


@dataclass(frozen=True)
class Rejections:
    """How many candidates each test has removed, in the order of the tests.

    Attributes:
        constraints: Outside Omega_l: bounds, total length, two joints on one axis.
        reach: The first hand point lies beyond the arm's reach.
        start: No start pose brings the end-effector to it.
        pruned: Dropped on the way, past their cutoff.
        path: The end-effector misses the hand in a later frame, where every frame has to reach.
    """

    constraints: int = 0
    reach: int = 0
    start: int = 0
    pruned: int = 0
    path: int = 0

    def __add__(self, other: Rejections) -> Rejections:
        """Sum of two counts."""
        return Rejections(
            self.constraints + other.constraints,
            self.reach + other.reach,
            self.start + other.start,
            self.pruned + other.pruned,
            self.path + other.path,
        )


class Tested(NamedTuple):
    """A generation after the cheap tests.

    Attributes:
        admissible: Which candidates lie in Omega_l, shape (N,).
        chosen: Which of them may reach the start, shape (N,).
        batch: Those, to be evaluated.
    """

    admissible: NDArray[np.bool_]
    chosen: NDArray[np.bool_]
    batch: Batch

    def scored(self, evaluated: Scores) -> tuple[Scores, Rejections]:
        """Scores of all candidates from those of the chosen ones, and what removed the others."""
        scores = spread(evaluated, self.chosen)
        return scores, Rejections(
            constraints=int((~self.admissible).sum()),
            reach=int((self.admissible & ~self.chosen).sum()),
            start=int((self.chosen & (scores.miss_frame == 0)).sum()),
            pruned=int(scores.pruned.sum()),
            path=int((scores.miss_frame > 0).sum()),
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
        self.sensitivity = Sensitivity(problem)

    def evaluate(
        self,
        Phi: ArrayLike,
        cutoff: Array | None = None,
        poses: Array | None = None,
        mounts: Array | None = None,
        *,
        slopes: bool = False,
    ) -> tuple[Scores, Rejections]:
        """Score candidates, given as in Generation.

        Returns:
            The scores, in the order of Phi, and what removed the others.

        Raises:
            DesignError: A start pose or a mount has another shape, or is missing.
        """
        generation = Generation(Phi, cutoff, poses, mounts, slopes)
        tested = self._test(generation)
        if not slopes:
            return tested.scored(self.evaluator.evaluate(*tested.batch))
        outcome, paths = self.evaluator.with_paths(tested.batch)
        scored = np.isfinite(outcome.fitness)
        batch, record = tested.batch.whole(), self.problem.record[0]
        f, E = self.sensitivity.slopes(batch.rows[scored], batch.yaw[scored], paths[scored], batch.mounts[scored])
        gradients = np.full((len(scored), int(self.space.free.sum())), np.nan)
        gradients[scored] = (record["lambda_f"] * f + record["lambda_E"] * E)[:, self.space.free]
        return tested.scored(replace(outcome, slopes=gradients))

    def _test(self, generation: Generation) -> Tested:
        """Find the candidates that have to be evaluated."""
        designs = np.atleast_2d(np.asarray(generation.Phi, dtype=float))
        count, n = len(designs), self.problem.dof
        cutoff = given("cutoffs", generation.cutoff, (count,), np.inf)
        poses = given("start poses", generation.poses, (count, n), np.nan)
        mounts = given("mounts", generation.mounts, (count, 3, 3), np.nan)
        admissible = self.space.admissible(designs)
        rows, yaw = self.space.rows(designs)
        chosen = admissible & self._may_reach(rows)
        batch = Batch(*(values[chosen] for values in (rows, yaw, cutoff, poses, mounts)))
        return Tested(admissible, chosen, batch)

    def _may_reach(self, rows: Array) -> NDArray[np.bool_]:
        """Whether the first hand point lies in the shell the arm's links can span.

        A row's piece has the length sqrt(a^2 + d^2), since a and d stand at right angles; the pieces stretched out
        give the outer radius, the longest against all others the inner one.
        """
        pieces = np.hypot(rows[:, :, 1], rows[:, :, 2])
        outer = pieces.sum(axis=1)
        inner = 2.0 * pieces.max(axis=1) - outer  # the longest piece minus the sum of all others
        distance = np.linalg.norm(self.problem.P[0, -1])
        slack = float(self.problem.record["reach"][0]) + 1e-9
        verdict: NDArray[np.bool_] = (outer >= distance - slack) & (inner <= distance + slack)
        return verdict


def given(what: str, values: Array | None, shape: tuple[int, ...], default: float) -> Array:
    """One value per candidate, or the default for all.

    Raises:
        DesignError: There is another number of them, or they have another shape.
    """
    if values is None:
        return np.full(shape, default)
    array = np.asarray(values, dtype=float)
    if array.shape != shape:
        raise DesignError(f"the {what} have shape {array.shape}", value=array.shape, allowed=shape)
    return array


def spread(scores: Scores, chosen: NDArray[np.bool_]) -> Scores:
    """Scores of the chosen candidates put in their places among all; the others are invalid."""
    empty = dict.fromkeys(("fitness", "path_fitness", "area", "start_error", "miss"), np.inf)
    empty |= {"q0": np.nan, "mount": np.nan, "slopes": np.nan}
    columns = {}
    for name, values in vars(scores).items():
        column = np.full((len(chosen), *values.shape[1:]), empty.get(name, 0), dtype=values.dtype)
        column[chosen] = values
        columns[name] = column
    return replace(scores, **columns)
