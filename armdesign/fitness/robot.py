"""Robot fitness r = lambda_f f + lambda_E E, eq. 6, of designs given by Phi; cheap tests come first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import DesignError
from armdesign.fitness.batch import Batch
from armdesign.fitness.block import BlockEvaluator, Scores
from armdesign.fitness.constraints import DesignSpace
from armdesign.fitness.problem import Problem
from armdesign.fitness.sensitivity import Sensitivity

Entry = TypeVar("Entry", bound=np.generic)


class Penalty(Protocol):
    """What designs cost beyond the paper's fitness, because they could not be built or would touch something."""

    def __call__(
        self, rows: Array, bases: Array, paths: Sequence[Array], turns: Sequence[Array] | None
    ) -> tuple[Array, Array | None]:
        """Penalty of N designs that are valid on every demonstration; a pure function of each.

        Args:
            rows: DH rows (alpha, a, d, theta), tool last, shape (N, n + 1, 4) [rad, m, m, rad].
            bases: Poses of the frame before row 0 in the task frame, shape (N, 12): axes x, y, z, then the origin [m];
                a base yaw is part of them.
            paths: Joint paths on every demonstration, shape (N, T, n) each [rad; m of prismatic joints].
            turns: Their derivatives by all entries of the design, in the order of DesignSpace.names, shape
                (N, T, n, E) each, where the gradient is wanted.

        Returns:
            What is added to r, shape (N,) [m], 0 for a feasible arm; and its gradient by all entries, shape (N, E),
            where it is wanted.
        """
        ...


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
        coarse: Frames that each demonstration is followed on; 0 for all.
    """

    Phi: ArrayLike
    cutoff: Array | None = None
    poses: Array | None = None
    mounts: Array | None = None
    slopes: bool = False
    coarse: int = 0

    def part(self, chosen: slice) -> Generation:
        """Some of the candidates."""
        known = (self.cutoff, self.poses, self.mounts)
        cutoff, poses, mounts = (None if values is None else values[chosen] for values in known)
        return Generation(np.asarray(self.Phi)[chosen], cutoff, poses, mounts, self.slopes, self.coarse)


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
        scores = spread_scores(evaluated, self.chosen)
        return scores, Rejections(
            constraints=int((~self.admissible).sum()),
            reach=int((self.admissible & ~self.chosen).sum()),
            start=int((self.chosen & (scores.miss_frame == 0)).sum()),
            pruned=int(scores.pruned.sum()),
            path=int((scores.miss_frame > 0).sum()),
        )


class PathScores(NamedTuple):
    """A generation's way along a demonstration.

    Attributes:
        scores: Their scores.
        removed: What removed the others.
        paths: Joint paths, shape (N, T, n) [rad]; NaN where a candidate is invalid or dropped. None where not kept.
        turns: Their derivatives by all entries of the design, shape (N, T, n, E), NaN likewise; None where not kept.
    """

    scores: Scores
    removed: Rejections
    paths: Array | None = None
    turns: Array | None = None


class RobotFitness:
    """The objective of the search: Phi in, scores out; a pure function of each candidate."""

    def __init__(
        self, problem: Problem, space: DesignSpace, block: int | None = None, penalty: Penalty | None = None
    ) -> None:
        """Allocate the evaluator.

        Args:
            problem: The task with its settings.
            space: The design space; Phi are its free entries.
            block: Number of arms side by side; any value gives the same scores.
            penalty: What is added to r, where something is asked of an arm beyond its path.
        """
        self.problem, self.space, self.penalty = problem, space, penalty
        self.evaluator = BlockEvaluator(problem, block)
        self.sensitivity = Sensitivity(problem, len(space.names))

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
        found = self.path_scores(Generation(Phi, cutoff, poses, mounts, slopes), keep=self.penalty is not None)
        if self.penalty is None or found.paths is None:
            return found.scores, found.removed
        turns = None if found.turns is None else [found.turns]
        return penalised(found.scores, self.penalty, self.space, Phi, [found.paths], turns), found.removed

    def path_scores(self, generation: Generation, *, keep: bool = False) -> PathScores:
        """Score candidates without a penalty.

        Args:
            generation: The candidates.
            keep: Whether their paths are wanted, and the derivatives of these where the gradients of r are.
        """
        tested = self._test(generation)
        if not (keep or generation.slopes):
            return PathScores(*tested.scored(self.evaluator.evaluate(*tested.batch)))
        outcome, paths = self.evaluator.with_paths(tested.batch)
        kept = spread(paths, tested.chosen, np.nan) if keep else None
        if not generation.slopes:
            return PathScores(*tested.scored(outcome), kept)
        scored = np.isfinite(outcome.fitness)
        batch, record, space = tested.batch.whole().part(scored), self.problem.record[0], self.space
        f, E, turns = self.sensitivity.slopes(batch, paths[scored], turns=keep)
        slopes = record["lambda_f"] * f + record["lambda_E"] * E
        if space.sites:
            slopes *= space.moving(np.atleast_2d(np.asarray(generation.Phi, dtype=float))[tested.chosen][scored])
        gradients = spread(slopes[:, space.free], scored, np.nan)
        turned = spread(spread(turns, scored, np.nan), tested.chosen, np.nan) if keep else None
        return PathScores(*tested.scored(replace(outcome, slopes=gradients)), kept, turned)

    def _test(self, generation: Generation) -> Tested:
        """Find the candidates that have to be evaluated."""
        designs = np.atleast_2d(np.asarray(generation.Phi, dtype=float))
        count, n = len(designs), self.problem.dof
        cutoff = given("cutoffs", generation.cutoff, (count,), np.inf)
        poses = given("start poses", generation.poses, (count, n), np.nan)
        mounts = given("mounts", generation.mounts, (count, 3, 3), np.nan)
        admissible = self.space.admissible(designs)
        (rows, yaw), bases = self.space.rows(designs), self.space.bases(designs)
        chosen = admissible & self._may_reach(rows, bases)
        return Tested(admissible, chosen, Batch(rows, yaw, cutoff, poses, mounts, bases).part(chosen))

    def _may_reach(self, rows: Array, bases: Array) -> NDArray[np.bool_]:
        """Whether the first hand point lies in the shell the arm's links can span."""
        inner, outer = self.space.shell(rows)
        hand = self.problem.P[0, -1]
        distance = np.linalg.norm(hand - bases[:, 9:], axis=1) if self.space.sites else np.linalg.norm(hand)
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


def penalised(
    scores: Scores,
    penalty: Penalty,
    space: DesignSpace,
    Phi: ArrayLike,
    paths: Sequence[Array],
    turns: Sequence[Array] | None,
) -> Scores:
    """Scores with a penalty on r, and its gradient on that of r.

    Args:
        scores: Scores of N candidates.
        penalty: The penalty.
        space: The design space.
        Phi: The candidates, shape (N, D).
        paths: Their joint paths on every demonstration, shape (N, T, n) each.
        turns: The derivatives of the paths, shape (N, T, n, E) each; None where the gradient is not wanted.
    """
    scored = np.isfinite(scores.fitness)
    designs = np.atleast_2d(np.asarray(Phi, dtype=float))[scored]
    rows, _ = space.rows(designs)
    turned = None if turns is None else [each[scored] for each in turns]
    excess, gradient = penalty(rows, space.first_frames(designs), [path[scored] for path in paths], turned)
    fitness, slopes = scores.fitness.copy(), scores.slopes.copy()
    fitness[scored] += excess
    if gradient is not None:
        slopes[scored] += (gradient * space.moving(designs) if space.sites else gradient)[:, space.free]
    return replace(scores, fitness=fitness, slopes=slopes, excess=spread(excess, scored, 0.0))


def spread(values: NDArray[Entry], chosen: NDArray[np.bool_], default: float) -> NDArray[Entry]:
    """Values of the chosen candidates put in their places among all; the others get the default."""
    column = np.full((len(chosen), *values.shape[1:]), default, dtype=values.dtype)
    column[chosen] = values
    return column


def spread_scores(scores: Scores, chosen: NDArray[np.bool_]) -> Scores:
    """Scores of the chosen candidates put in their places among all; the others are invalid."""
    empty = dict.fromkeys(("fitness", "path_fitness", "area", "start_error", "miss"), np.inf)
    empty |= {"q0": np.nan, "mount": np.nan, "slopes": np.nan}
    return replace(
        scores, **{name: spread(values, chosen, empty.get(name, 0)) for name, values in vars(scores).items()}
    )
