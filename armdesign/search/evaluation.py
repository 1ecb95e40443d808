"""Score one given arm on a task, frame by frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from armdesign._types import Array
from armdesign.errors import DesignError, SearchError, counted
from armdesign.fitness.block import BlockEvaluator, PathResult
from armdesign.fitness.objective import combined, settles_mount
from armdesign.fitness.problem import Problem
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.kernels.skeleton import MAX_DOF
from armdesign.search.prepare import Prepared


@dataclass(frozen=True)
class Evaluation:
    """An arm's fitness on a task, eq. 5 and 6.

    Attributes:
        table: The arm.
        fitness: r = lambda_f f + lambda_E E [m]; of several demonstrations their mean or that of the worst, as asked.
        path_fitness: f [m], likewise.
        area: E [m], likewise.
        path: Joint angles, G_t, E_t, sigma and distances per frame; of several demonstrations on the first.
        demonstrations: Of several demonstrations what the arm does on each, the first one first; else empty.
        holdouts: What it does on those the search did not see; where it is not valid, r is infinite.
        missed: Where the arm is not valid, the frame in which its end-effector misses the hand, and by how much [m];
            the path ends there.
    """

    table: DHTable
    fitness: float
    path_fitness: float
    area: float
    path: PathResult
    demonstrations: tuple[Evaluation, ...] = ()
    holdouts: tuple[Evaluation, ...] = ()
    missed: tuple[int, float] | None = None

    @property
    def first(self) -> Evaluation:
        """What the arm does on the first demonstration alone."""
        return self.demonstrations[0] if self.demonstrations else self


def evaluate_design(table: DHTable, prepared: Prepared) -> Evaluation:
    """Follow the demonstrations with one arm; its number of joints must be the one of the settings.

    The others and those held out are followed as in a search, with the tool as it is mounted for the first.

    Raises:
        DesignError: The arm has another number of joints, or no length.
        SearchError: The arm does not reach the first frame.
    """
    check_design(table)
    dof = prepared.settings.design.dof
    if table.dof != dof:
        raise DesignError(f"the arm has {counted(table.dof, 'joint')}, the settings are for {dof}", allowed=dof)
    first = evaluate_on(table, prepared.problem())
    if not prepared.others and not prepared.holdouts:
        return first
    others = [evaluate_on(table, each.problem(), first.path, each.name) for each in prepared.others]
    holdouts = [scored(table, each.problem(), first.path) for each in prepared.holdouts]
    whole = together([first, *others], prepared.settings.fitness.demonstrations) if others else first
    return replace(whole, holdouts=tuple(holdouts))


def evaluate_on(table: DHTable, problem: Problem, first: PathResult | None = None, where: str = "") -> Evaluation:
    """Follow the demonstration of a problem with one arm.

    Args:
        table: The arm.
        problem: The demonstration.
        first: Its path on the first of several demonstrations, of which this is another.
        where: What the demonstration is called, where there are several.

    Raises:
        SearchError: The arm is not valid: it does not reach the hand.
    """
    evaluation = scored(table, problem, first)
    if evaluation.missed is not None:
        raise miss_error(*evaluation.missed, problem, where)
    return evaluation


def miss_error(frame: int, miss: float, problem: Problem, where: str) -> SearchError:
    """The error of an arm whose end-effector does not reach the hand."""
    what = "the arm does not reach the first frame" if frame == 0 else f"the arm does not reach frame {frame + 1}"
    return SearchError(
        f"{what}{where and f' of {where}'}: its end-effector stays {miss * 1e3:.2f} mm from the hand, the tolerance is "
        f"{float(problem.record['reach'][0]) * 1e3:g} mm",
        value=miss,
        fix="Raise fitness.reach_tolerance, or take an arm that reaches it",
    )


def scored(table: DHTable, problem: Problem, first: PathResult | None = None) -> Evaluation:
    """One arm on one demonstration, valid there or not; see ``evaluate_on``."""
    evaluator = BlockEvaluator(problem, block=1)
    if first is None or not settles_mount(problem):
        scores, path = evaluator.follow(table)
    else:
        scores, path = evaluator.follow(table, first.q[0], first.mount)
        if not scores.valid[0]:
            scores, path = evaluator.follow(table, mount=first.mount)
    r, f, E = (float(values[0]) for values in (scores.fitness, scores.path_fitness, scores.area))
    missed = None if scores.valid[0] else (int(scores.miss_frame[0]), float(scores.miss[0]))
    return Evaluation(table, r, f, E, path, missed=missed)


def together(parts: Sequence[Evaluation], how: str | None) -> Evaluation:
    """What an arm does on several demonstrations as one: the mean of r, f and E, or those of the worst.

    Args:
        parts: What it does on each, the first one first.
        how: ``mean`` or ``worst``.
    """
    values = (np.array([[getattr(part, name)] for part in parts]) for name in ("fitness", "path_fitness", "area"))
    r, f, E = (float(value[0]) for value in combined(*values, worst=how == "worst"))
    return replace(parts[0], fitness=r, path_fitness=f, area=E, demonstrations=tuple(parts))


def motions(evaluation: Evaluation, prepared: Prepared) -> list[tuple[Array, Array]]:
    """Frame times (T,) [s] and joint angles (T, n) [rad] on every demonstration that the search saw."""
    every = zip(prepared.demonstrations, evaluation.demonstrations or (evaluation,), strict=True)
    return [(each.task.time, scored.path.q) for each, scored in every]


def check_design(table: DHTable) -> None:
    """Refuse arms the evaluator cannot handle.

    Raises:
        DesignError: Too many joints, or no length at all.
    """
    if table.dof > MAX_DOF:
        raise DesignError(f"the arm has {table.dof} joints", value=table.dof, allowed=f"1 to {MAX_DOF}")
    if not np.isfinite(table.length) or table.length <= 0.0:
        raise DesignError("the arm has no length: all a and d are 0", value=table.length)
