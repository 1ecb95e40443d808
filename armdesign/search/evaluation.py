"""The fitness of one given arm on the demonstrations, frame by frame (eq. 3 to 6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.errors import DesignError, SearchError, SettingsError, counted
from armdesign.fitness.block import BlockEvaluator, PathResult
from armdesign.fitness.objective import combined, settles_mount
from armdesign.fitness.problem import Problem
from armdesign.kinematics.base_pose import BasePose, placed_base
from armdesign.kinematics.dh import DHTable, joint_letters
from armdesign.kinematics.kernels.skeleton import MAX_DOF
from armdesign.search.design_problem import DesignProblem


@dataclass(frozen=True, eq=False)
class PathEvaluation:
    """What an arm does on one demonstration.

    Attributes:
        fitness: r = lambda_f f + lambda_E E (eq. 6) [m]; infinite where the arm is not valid.
        path_fitness: f, the mean of G_t (eq. 5) [m].
        area: E, the mean of E_t (eq. 5) [m].
        path: Joint angles, G_t, E_t, sigma and distances per frame.
        missed: Where the arm is not valid, the frame in which its end-effector misses the hand, and by how much [m];
            the path ends there.
    """

    fitness: float
    path_fitness: float
    area: float
    path: PathResult
    missed: tuple[int, float] | None = None


@dataclass(frozen=True, eq=False)
class Evaluation:
    """An arm's fitness on all demonstrations.

    Attributes:
        table: The arm.
        fitness: r [m]; of several demonstrations their mean or that of the worst, as the settings ask.
        path_fitness: f [m], combined likewise.
        area: E [m], combined likewise.
        demonstrations: What the arm does on each demonstration, one or more.
        holdouts: What it does on those the search did not see.
    """

    table: DHTable
    fitness: float
    path_fitness: float
    area: float
    demonstrations: tuple[PathEvaluation, ...]
    holdouts: tuple[PathEvaluation, ...] = ()

    @property
    def path(self) -> PathResult:
        """The arm's path on the first demonstration."""
        return self.demonstrations[0].path


def combined_evaluation(
    table: DHTable,
    demonstrations: Sequence[PathEvaluation],
    how: str | None = None,
    holdouts: Sequence[PathEvaluation] = (),
) -> Evaluation:
    """The fitness on all demonstrations: of one its own, of several the mean of r, f and E, or those of the worst.

    Args:
        table: The arm.
        demonstrations: What it does on each, one or more.
        how: ``mean`` or ``worst``.
        holdouts: What it does on those that do not count.
    """
    one = demonstrations[0]
    r, f, E = one.fitness, one.path_fitness, one.area
    if len(demonstrations) > 1:  # by the very function that combines them in a search, to the last bit
        names = ("fitness", "path_fitness", "area")
        values = (np.array([[getattr(each, name)] for each in demonstrations]) for name in names)
        r, f, E = (float(value[0]) for value in combined(*values, worst=how == "worst"))
    return Evaluation(table, r, f, E, tuple(demonstrations), tuple(holdouts))


def evaluate_design(table: DHTable, problem: DesignProblem) -> Evaluation:
    """Follow the demonstrations with one arm.

    All demonstrations but the first, and those held out, are followed with the tool as it is mounted for the first.

    Args:
        table: The arm; its joints must be those of the settings.
        problem: The demonstrations.

    Raises:
        DesignError: The arm has other joints, or no length.
        SearchError: The arm does not reach the first frame.
    """
    check_design(table)
    dof = problem.settings.design.dof
    if table.dof != dof:
        raise DesignError(f"the arm has {counted(table.dof, 'joint')}, the settings are for {dof}", allowed=dof)
    if table.prismatic != problem.settings.design.prismatic:
        allowed = joint_letters(problem.settings.design.prismatic)
        raise DesignError(f"the joints of the arm are {table.joints}", value=table.joints, allowed=allowed)
    first = evaluate_on(table, problem.path_problem)
    # with one tool in all: an arm that does not reach a demonstration is an error, on a holdout it is a finding
    others = [evaluate_on(table, each.path_problem, first.path, each.name) for each in problem.demonstrations[1:]]
    holdouts = [path_evaluation(table, each.path_problem, first.path) for each in problem.holdouts]
    return combined_evaluation(table, (first, *others), problem.settings.fitness.demonstrations, holdouts)


def evaluate_candidate(Phi: Array, problem: DesignProblem) -> tuple[DesignProblem, Evaluation]:
    """Follow the demonstrations with one design of the search.

    Args:
        Phi: The design, shape (D,).
        problem: The demonstrations.

    Returns:
        The demonstrations as seen from the design's own base, and what its arm does there.

    Raises:
        SearchError: The arm does not reach the first frame.
    """
    space = problem.space
    seen = problem.placed(space.base_pose(Phi)) if space.sites else problem
    return seen, evaluate_design(space.table(Phi), seen)


def at_given_place(problem: DesignProblem, base: BasePose | None = None) -> DesignProblem:
    """The demonstrations as seen from where a given arm stands; the problem itself where that is the task's origin.

    Args:
        problem: The demonstrations.
        base: Where the arm stands in the room; by default at the one place that the settings name, without a turn.

    Raises:
        SettingsError: The settings leave more than one place.
    """
    places = problem.space.sites
    if not places or problem.first.room is not None:
        return problem
    if base is None:
        low, high = places[0].box
        if len(places) > 1 or (low != high).any():
            raise SettingsError(
                "a given arm needs one place for its base, and the settings name a region", value=str(places[0]),
                allowed="one point", fix="Give it with --base-at X,Y,Z (cell.base_at)",
            )  # fmt: skip
        base = placed_base(low, float(np.clip(0.0, *places[0].yaw)), places[0].mounted)
    return problem.placed(base)


def evaluate_on(table: DHTable, problem: Problem, first: PathResult | None = None, where: str = "") -> PathEvaluation:
    """Follow one demonstration with one arm.

    Args:
        table: The arm.
        problem: The demonstration.
        first: The arm's path on the first of several demonstrations, of which this is another.
        where: What the demonstration is called, where there are several.

    Raises:
        SearchError: The arm is not valid: it does not reach the hand.
    """
    evaluation = path_evaluation(table, problem, first)
    if evaluation.missed is None:
        return evaluation
    frame, miss = evaluation.missed
    what = "the arm does not reach the first frame" if frame == 0 else f"the arm does not reach frame {frame + 1}"
    raise SearchError(
        f"{what}{where and f' of {where}'}: its end-effector stays {miss * 1e3:.2f} mm from the hand, the tolerance is "
        f"{float(problem.record['reach'][0]) * 1e3:g} mm",
        value=miss,
        fix="Raise fitness.reach_tolerance, or take an arm that reaches it",
    )


def path_evaluation(table: DHTable, problem: Problem, first: PathResult | None = None) -> PathEvaluation:
    """Follow one demonstration with one arm, which may not reach it.

    Args:
        table: The arm.
        problem: The demonstration.
        first: The arm's path on the first of several demonstrations, of which this is another.
    """
    evaluator = BlockEvaluator(problem, block=1)
    if first is None or not settles_mount(problem):
        scores, path = evaluator.follow(table)
    else:  # the pose of the first demonstration is tried before start poses are searched, as in a search
        scores, path = evaluator.follow(table, first.q[0], first.mount)
        if not scores.valid[0]:  # the pose does not lead there: search one
            scores, path = evaluator.follow(table, mount=first.mount)
    r, f, E = (float(values[0]) for values in (scores.fitness, scores.path_fitness, scores.area))
    missed = None if scores.valid[0] else (int(scores.miss_frame[0]), float(scores.miss[0]))
    return PathEvaluation(r, f, E, path, missed)


def motions(evaluation: Evaluation, problem: DesignProblem) -> list[tuple[Array, Array]]:
    """Frame times and joint angles of an arm on every demonstration that the search sees.

    Args:
        evaluation: The arm.
        problem: The demonstrations.

    Returns:
        Pairs of times, shape (T,) [s], and angles, shape (T, n) [rad].
    """
    pairs = zip(problem.demonstrations, evaluation.demonstrations, strict=True)
    return [(each.task.time, scored.path.q) for each, scored in pairs]


def check_design(table: DHTable) -> None:
    """Refuse an arm that the compiled solver cannot handle.

    Raises:
        DesignError: Too many joints, or no length at all.
    """
    if table.dof > MAX_DOF:  # the kernels keep an arm in arrays of fixed size
        raise DesignError(f"the arm has {table.dof} joints", value=table.dof, allowed=f"1 to {MAX_DOF}")
    # places along the arm, sigma, are shares of its length
    if not np.isfinite(table.length) or table.length <= 0.0:
        raise DesignError("the arm has no length: all a and d are 0", value=table.length)
