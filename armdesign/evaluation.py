"""Score one given arm on a task, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armdesign.errors import DesignError, SearchError
from armdesign.fitness.evaluator import BlockEvaluator, PathResult
from armdesign.fitness.problem import Problem
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.skeleton import MAX_DOF
from armdesign.study import Prepared
from armdesign.wording import counted


@dataclass(frozen=True)
class Evaluation:
    """An arm's fitness on a task, eq. 5 and 6.

    Attributes:
        table: The arm.
        fitness: r = lambda_f f + lambda_E E [m].
        path_fitness: f [m].
        area: E [m].
        path: Joint angles, G_t, E_t, sigma and distances per frame.
    """

    table: DHTable
    fitness: float
    path_fitness: float
    area: float
    path: PathResult


def evaluate_design(table: DHTable, prepared: Prepared) -> Evaluation:
    """Follow the demonstration with one arm; its number of joints must be the one of the settings.

    Raises:
        DesignError: The arm has another number of joints, or no length.
        SearchError: The arm does not reach the first frame.
    """
    check_design(table)
    dof = prepared.study.design.dof
    if table.dof != dof:
        raise DesignError(f"the arm has {counted(table.dof, 'joint')}, the settings are for {dof}", allowed=dof)
    return evaluate_on(table, prepared.problem())


def evaluate_on(table: DHTable, problem: Problem) -> Evaluation:
    """Follow the demonstration of a problem with one arm."""
    scores, path = BlockEvaluator(problem, block=1).follow(table)
    if not scores.valid[0]:
        raise SearchError(
            f"the arm does not reach the first frame: its end-effector stays {scores.start_error[0] * 1e3:.2f} mm from "
            f"the hand, the tolerance is {float(problem.record['reach'][0]) * 1e3:g} mm",
            value=float(scores.start_error[0]),
            fix="Raise fitness.reach_tolerance, or take an arm that reaches it",
        )
    r, f, E = (float(values[0]) for values in (scores.fitness, scores.path_fitness, scores.area))
    return Evaluation(table, r, f, E, path)


def check_design(table: DHTable) -> None:
    """Refuse arms the evaluator cannot handle.

    Raises:
        DesignError: Too many joints, or no length at all.
    """
    if table.dof > MAX_DOF:
        raise DesignError(f"the arm has {table.dof} joints", value=table.dof, allowed=f"1 to {MAX_DOF}")
    if not np.isfinite(table.length) or table.length <= 0.0:
        raise DesignError("the arm has no length: all a and d are 0", value=table.length)
