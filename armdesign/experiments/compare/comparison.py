"""Designs and ready-made arms on one task by one fitness, a row each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from armdesign._types import Array
from armdesign.experiments.compare.base_pose import BaseProgress, BaseSearch, mount_arm
from armdesign.experiments.compare.dynamics import design_model, moving_mass, peak_torques, ready_made_model
from armdesign.experiments.compare.serial_arm import SerialArm
from armdesign.fitness.block import BlockEvaluator, PathResult, Scores
from armdesign.fitness.problem import Problem, make_problem, start_effort
from armdesign.kinematics.dh import DHTable
from armdesign.search.design_problem import DesignProblem
from armdesign.settings.sections import Settings, Solver

DESIGN, READY_MADE = "design", "ready-made"


@dataclass(frozen=True, eq=False)
class Design:
    """A design that takes part.

    Attributes:
        name: What to call it.
        source: Where it was read.
        table: The arm.
        limits: Joint limits, shape (n, 2) [rad].
    """

    name: str
    source: str
    table: DHTable
    limits: Array

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return self.table.dof

    @property
    def length(self) -> float:
        """Length L [m]."""
        return self.table.length


@dataclass(frozen=True, eq=False)
class Compared:
    """How an arm does on the task.

    Attributes:
        name: What it is called.
        kind: DESIGN or READY_MADE.
        source: Where it was read.
        joints: Number of joints n.
        length: Length of its skeleton [m].
        tool: The tool's link, of a ready-made arm.
        base: Base pose (x, y, z, yaw) that was found, of a ready-made arm, shape (4,) [m, rad].
        held: Joints of a ready-made arm that are held at 0.
        evaluations: Base poses that were tried.
        scores: Its fitness, one entry each; infinite where the start is not reached.
        path: Its path; empty where the start is not reached.
        worst_point: Index of the followed point with the largest error.
        moving_mass: Mass of all that moves [kg]; None where it is not known.
        torque: Peak torque of each joint, shape (n,) [N m]; None where it is not known.
    """

    name: str
    kind: str
    source: str
    joints: int
    length: float
    scores: Scores
    path: PathResult
    worst_point: int = 0
    moving_mass: float | None = None
    torque: Array | None = None
    tool: str | None = None
    base: Array | None = None
    held: tuple[str, ...] = ()
    evaluations: int = 0

    @property
    def reached(self) -> bool:
        """Whether it reaches the start of the task."""
        return bool(self.scores.valid[0])

    @property
    def fitness(self) -> float:
        """Fitness r [m]; infinite where the start is not reached."""
        return float(self.scores.fitness[0])

    @property
    def worst_error(self) -> float:
        """Largest distance of a followed point in any frame [m]; infinite where the start is not reached."""
        return float(self.path.distance[:, self.worst_point].max()) if self.reached else np.inf


def compare_design(design: Design, problem: DesignProblem, payload: float = 0.0) -> Compared:
    """Score a design, its base at the shoulder.

    Args:
        design: The design.
        problem: The task and the settings.
        payload: Point mass at the tool, for the torques [kg].
    """
    task, solver = problem.task, with_joints(problem.settings, design.dof).solver
    path_problem = make_problem(task.P, task.R, task.dt, design.limits, problem.settings.fitness, solver)
    scores, path = BlockEvaluator(path_problem, block=1).follow(design.table)
    mass = moving_mass(design_model(design.table))
    row = Compared(design.name, DESIGN, design.source, design.dof, design.length, scores, path, moving_mass=mass)
    return finished(row, problem, design_model(design.table, payload))


def compare_ready_made(
    arm: SerialArm,
    problem: DesignProblem,
    how: BaseSearch | None = None,
    payload: float = 0.0,
    on_progress: Callable[[BaseProgress], None] | None = None,
) -> Compared:
    """Score a ready-made arm where it does best.

    Args:
        arm: The arm.
        problem: The task and the settings.
        how: How its base pose is searched.
        payload: Point mass at the tool, for the torques [kg].
        on_progress: Told how far the search is.
    """
    task = problem.task
    solver = with_joints(problem.settings, arm.dof).solver
    found = mount_arm(arm, task, problem.settings.fitness, solver, how, on_progress)
    mass = arm.moving_mass or None
    row = Compared(
        arm.name, READY_MADE, arm.source, arm.dof, arm.length, found.scores, found.path, moving_mass=mass,
        tool=arm.tool, base=found.base, held=arm.held, evaluations=found.evaluations,
    )  # fmt: skip
    return finished(row, problem, ready_made_model(arm, payload))


def some_problem(problem: DesignProblem) -> Problem:
    """The task for some arm, to see that there is nothing wrong with it and to compile the kernels on.

    Raises:
        TaskError: There are too many points, or an orientation is to be followed that is not there.
    """
    task = problem.task
    limits = np.tile([-np.pi, np.pi], (problem.settings.design.dof, 1))
    return make_problem(task.P, task.R, task.dt, limits, problem.settings.fitness, problem.settings.solver)


def finished(row: Compared, problem: DesignProblem, model: pin.Model) -> Compared:
    """The row with what follows from the path; torques only where masses are known."""
    if not row.reached:
        return row
    followed = np.array(problem.settings.fitness.weights) > 0.0
    worst = np.where(followed, row.path.distance.max(axis=0), -1.0)
    torque = None if row.moving_mass is None else peak_torques(model, problem.task.time, row.path.q)
    return replace(row, worst_point=int(np.argmax(worst)), torque=torque)


def with_joints(settings: Settings, dof: int) -> Settings:
    """The settings for another number of joints: the effort for the start grows with it unless it was set."""
    solver = settings.solver
    settled = (solver.starts, solver.descents, solver.finalists)
    if settled == tuple(start_effort(Solver(), settings.design.dof)):
        solver = replace(solver, starts=None, descents=None, finalists=None)
    return replace(settings, design=replace(settings.design, dof=dof), solver=solver)
