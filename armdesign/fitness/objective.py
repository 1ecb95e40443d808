"""Robot fitness over several demonstrations of one task: their mean, or that of the worst.

A design is valid if it is valid on every demonstration. A tool is mounted once for all of them: where the first
demonstration settles the mount, the others are followed with it, and from the first one's start pose, where that brings
them to their start.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import DesignError
from armdesign.fitness.block import Scores
from armdesign.fitness.constraints import DesignSpace
from armdesign.fitness.kernels.solver_state import MOUNT_START
from armdesign.fitness.problem import Problem
from armdesign.fitness.robot import (
    Generation,
    PathScores,
    Penalty,
    Rejections,
    RobotFitness,
    penalised,
    spread,
    spread_scores,
)

Flags = NDArray[np.bool_]
Entry = TypeVar("Entry", bound=np.generic)
COUNTS = ("steps", "start_steps", "accepted", "frames")
SLACK = 1e-12
"""Share of a cutoff that is added to it, beyond what rounding can do to a sum."""


class Objective(Protocol):
    """What scores designs: one demonstration or several."""

    def evaluate(
        self, Phi: ArrayLike, cutoff: Array | None = None, poses: Array | None = None, *, slopes: bool = False
    ) -> tuple[Scores, Rejections]:
        """See RobotFitness.evaluate."""
        ...


@dataclass
class Round:
    """A generation on its way through the demonstrations.

    Attributes:
        Phi: Designs, shape (N, D).
        cutoff: Fitness beyond which a candidate may be dropped, shape (N,).
        poses: Start poses by demonstration, shape (N, K n), NaN where they are to be sought; None for nowhere.
        slopes: Whether the gradients are wanted.
        parts: Scores on the demonstrations so far, each of all N candidates.
        removed: What each of them has removed.
        paths: Joint paths on them, shape (N, T, n) each, where they are kept.
        turns: Their derivatives, shape (N, T, n, E) each, where they are kept.
    """

    Phi: Array
    cutoff: Array
    poses: Array | None
    slopes: bool = False
    parts: list[Scores] = field(default_factory=list)
    removed: list[Rejections] = field(default_factory=list)
    paths: list[Array] = field(default_factory=list)
    turns: list[Array] = field(default_factory=list)

    def valid(self, k: int) -> Flags:
        """Which candidates are valid on the first k demonstrations, shape (N,)."""
        return reduce(np.logical_and, (part.valid for part in self.parts[:k]), np.ones(len(self.Phi), dtype=bool))

    def pruned(self, k: int) -> Flags:
        """Which candidates were dropped at a cutoff on one of the first k, shape (N,)."""
        return reduce(np.logical_or, (part.pruned for part in self.parts[:k]), np.zeros(len(self.Phi), dtype=bool))

    def given_poses(self, k: int, dof: int) -> Array:
        """The start poses given for demonstration k, shape (N, n); NaN where there is none."""
        poses = np.full((len(self.Phi), dof), np.nan)
        return poses if self.poses is None else self.poses[:, k * dof : (k + 1) * dof]

    def enter(self, k: int, chosen: Flags, found: PathScores) -> None:
        """Take in the paths of the chosen candidates on demonstration k, the first ones or others in their place."""
        whole = spread_scores(found.scores, chosen)
        kept = ((self.paths, found.paths), (self.turns, found.turns))
        if k == len(self.parts):
            self.parts.append(whole)
            self.removed.append(found.removed)
            for column, values in kept:
                if values is not None:
                    column.append(spread(values, chosen, np.nan))
        else:
            self.parts[k] = replaced(self.parts[k], whole, chosen)
            self.removed[k] = found.removed
            for column, values in kept:
                if values is not None:
                    column[k][chosen] = values


class Stage(NamedTuple):
    """The evaluation of all candidates on one demonstration.

    Attributes:
        k: The demonstration, from 0.
        fitness: Its objective.
        again: Whether it is for those that have not come to their start from that of the first.
    """

    k: int
    fitness: RobotFitness
    again: bool = False


class Demonstrations:
    """The objective of a search for several demonstrations; a pure function of each candidate, as on one.

    The mean counts every demonstration the same, however many frames it has; its sums are taken in the order of the
    values, so that it does not depend on the order of the demonstrations. Where the first one settles the mount, it
    does depend on which is the first.
    """

    def __init__(
        self,
        problems: Sequence[Problem],
        space: DesignSpace,
        block: int | None = None,
        penalty: Penalty | None = None,
        *,
        worst: bool = False,
    ) -> None:
        """Allocate the evaluators.

        Args:
            problems: The demonstrations with their settings.
            space: The design space; Phi are its free entries.
            block: Number of arms side by side; any value gives the same scores.
            penalty: What is added to r, where something is asked of an arm beyond its paths.
            worst: Whether the worst counts instead of the mean.
        """
        self.space, self.penalty = space, penalty
        self.count, self.dof, self.worst = len(problems), problems[0].dof, worst
        self.one_mount = settles_mount(problems[0])
        self.mount_takes_whole_path = self.one_mount and int(problems[0].record["start_paths"][0]) > 1
        self.stages: list[Stage] = []
        for k, problem in enumerate(problems):
            self.stages.append(Stage(k, RobotFitness(problem, space, block)))
            if k > 0 and self.one_mount:
                self.stages.append(self.stages[-1]._replace(again=True))

    def evaluate(
        self, Phi: ArrayLike, cutoff: Array | None = None, poses: Array | None = None, *, slopes: bool = False
    ) -> tuple[Scores, Rejections]:
        """Score candidates.

        Args:
            Phi: Designs, shape (N, D) [rad, m].
            cutoff: Fitness beyond which a candidate may be dropped, shape (N,).
            poses: Start poses of all demonstrations side by side, shape (N, K n) [rad]; see Generation.
            slopes: Whether the gradients of r are wanted. There are none where the first demonstration settles the
                mount of all.

        Returns:
            The scores, in the order of Phi, and what removed the others. f and E are means as r is, or those of the
            worst demonstration; the start error is the largest, the counts of steps and frames are sums; the start
            poses stand side by side.

        Raises:
            DesignError: The start poses have another shape.
        """
        designs = np.atleast_2d(np.asarray(Phi, dtype=float))
        shape = (len(designs), self.count * self.dof)
        if poses is not None and poses.shape != shape:
            raise DesignError(f"the start poses have shape {poses.shape}", allowed=shape)
        limit = np.full(len(designs), np.inf) if cutoff is None else np.asarray(cutoff, dtype=float)
        entering = Round(designs, limit, poses, slopes and not self.one_mount)
        for stage in self.stages:
            chosen = self._chosen(stage, entering)
            part = self._generation(stage.k, entering, chosen)
            entering.enter(stage.k, chosen, stage.fitness.path_scores(part, keep=self.penalty is not None))
        scores, removed = self._outcome(entering)
        if self.penalty is not None:
            turns = entering.turns or None
            scores = penalised(scores, self.penalty, self.space, designs, entering.paths, turns)
        return scores, removed

    def _chosen(self, stage: Stage, entering: Round) -> Flags:
        """The candidates a stage is to evaluate: those that are valid on the demonstrations before, shape (N,)."""
        chosen = entering.valid(stage.k)
        if stage.again:
            sought = ~np.isfinite(entering.given_poses(stage.k, self.dof)).all(axis=1)
            chosen &= ~entering.parts[stage.k].valid & sought
        return chosen

    def _generation(self, k: int, entering: Round, chosen: Flags) -> Generation:
        """What is to be evaluated on demonstration k; a second attempt finds the scores of the first one there."""
        again = k < len(entering.parts)
        poses, mounts = entering.given_poses(k, self.dof), None
        if k > 0 and self.one_mount:
            first, mounts = entering.parts[0], entering.parts[0].mount[chosen]
            given = np.isfinite(poses).all(axis=1, keepdims=True)
            # the start pose of the first demonstration is tried first: with one mount it is often near the right one
            poses = poses if again else np.where(given, poses, first.q0)
        cutoff = self._cutoff(k, entering)[chosen]
        return Generation(entering.Phi[chosen], cutoff, poses[chosen], mounts, entering.slopes)

    def _cutoff(self, k: int, entering: Round) -> Array:
        """What a candidate may have on demonstration k, given those before, shape (N,).

        Of one that was dropped before it only has to be found whether it is valid here, too.
        """
        if k == 0 and self.mount_takes_whole_path:
            return np.full(len(entering.Phi), np.inf)
        if self.worst:
            return np.where(entering.pruned(k), -np.inf, entering.cutoff)  # the maximum exceeds it as soon as one does
        scored = entering.valid(k) & ~entering.pruned(k)
        spent = total([np.zeros(len(scored)), *(part.fitness for part in entering.parts[:k])])
        allowed = self.count * entering.cutoff * (1.0 + SLACK)  # a mean <= cutoff is a sum <= K cutoff
        return np.where(scored, allowed - np.where(scored, spent, 0.0), -np.inf)

    def _outcome(self, done: Round) -> tuple[Scores, Rejections]:
        """The scores on all demonstrations as one, and what removed the others."""
        parts, valid = done.parts, done.valid(self.count)
        pruned = done.pruned(self.count) & valid
        stacked = (np.stack([getattr(part, name) for part in parts]) for name in ("fitness", "path_fitness", "area"))
        r, f, E = combined(*stacked, worst=self.worst)
        for values in (r, f, E):
            values[~valid | pruned] = np.inf
        q0 = np.concatenate([part.q0 for part in parts], axis=1)
        q0[~valid] = np.nan
        # the first demonstration on which each candidate is not valid, the first of all where there is none
        decisive = np.argmax(np.stack([~part.valid for part in parts]), axis=0)
        scores = Scores(
            fitness=r,
            path_fitness=f,
            area=E,
            valid=valid,
            pruned=pruned,
            start_error=largest_start_error(parts),
            q0=q0,
            mount=np.where(valid[:, None, None], parts[0].mount, np.nan),
            miss_frame=picked([part.miss_frame for part in parts], decisive),
            miss=picked([part.miss for part in parts], decisive),
            slopes=self._slopes(parts, valid & ~pruned),
            excess=np.zeros(len(r)),
            **{name: np.sum([getattr(part, name) for part in parts], axis=0) for name in COUNTS},
        )
        return scores, replace(sum(done.removed, Rejections()), pruned=int(pruned.sum()))

    def _slopes(self, parts: Sequence[Scores], scored: Flags) -> Array:
        """Gradients of r, as r is combined, shape (N, D), or (N, 0) where there are none."""
        rows = np.stack([part.slopes for part in parts])
        if self.worst:
            slopes = picked(rows, np.argmax(np.stack([part.fitness for part in parts]), axis=0))
        else:
            slopes = total(np.sort(rows, axis=0)) / len(rows)
        slopes[~scored] = np.nan
        return slopes


def settles_mount(problem: Problem) -> bool:
    """Whether a demonstration settles how the tool is mounted, by its first frame."""
    record = problem.record[0]
    return bool(record["w_0"] > 0.0 and record["mount"] == MOUNT_START)


def replaced(before: Scores, after: Scores, chosen: Flags) -> Scores:
    """Scores with those of the chosen candidates replaced; the counts of steps and frames are added up."""
    columns = {}
    for name, old in vars(before).items():
        new = getattr(after, name)
        mask = chosen.reshape(-1, *[1] * (old.ndim - 1))
        columns[name] = old + new if name in COUNTS else np.where(mask, new, old)
    return replace(before, **columns)


def combined(r: Array, f: Array, E: Array, *, worst: bool) -> tuple[Array, Array, Array]:
    """r, f and E on K demonstrations, shape (K, N) each, as one of each, shape (N,): the means, or those of the worst.

    A mean is summed up in the order of its values, whatever that of the demonstrations and of the other candidates.
    """
    if worst:
        k = np.argmax(r, axis=0)
        return picked(r, k), picked(f, k), picked(E, k)
    mean_r, mean_f, mean_E = (total(np.sort(values, axis=0)) / len(values) for values in (r, f, E))
    return mean_r, mean_f, mean_E


def total(rows: Sequence[Array] | Array) -> Array:
    """Sum of rows of shape (N,), one after the other, so that an entry does not depend on how many there are."""
    return reduce(np.add, rows)


def picked(rows: Sequence[NDArray[Entry]] | NDArray[Entry], k: NDArray[np.intp]) -> NDArray[Entry]:
    """The entries [k[i], i] of K rows, shape (N,)."""
    return np.asarray(np.stack(list(rows))[k, np.arange(len(k))])


def largest_start_error(parts: Sequence[Scores]) -> Array:
    """The largest start error over the demonstrations that each candidate was put to, shape (N,) [m]."""
    error, valid = parts[0].start_error, parts[0].valid
    for part in parts[1:]:
        error = np.where(valid, np.maximum(error, part.start_error), error)
        valid = valid & part.valid
    return error
