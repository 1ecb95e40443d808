"""Designs and ready-made arms on one task by one fitness, a row each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from armdesign._types import Array
from armdesign.bodies.arm_body import arm_body
from armdesign.bodies.exact import ExactScene
from armdesign.bodies.loads import base_gravity, dynamic_model, model_torques
from armdesign.experiments.compare.arms import Arm, DesignArm, open_arms
from armdesign.experiments.compare.base_pose import BaseProgress, BaseSearch, mount_arm
from armdesign.experiments.compare.serial_arm import SerialArm
from armdesign.feasibility.needs import TURNING
from armdesign.feasibility.verdict import clearances, exact_obstacles
from armdesign.fitness.block import BlockEvaluator, PathResult, Scores
from armdesign.fitness.problem import Problem, make_problem, start_effort
from armdesign.kinematics.base_pose import placed_base
from armdesign.kinematics.motion import smooth_motion
from armdesign.search.design_problem import DesignProblem
from armdesign.search.evaluation import PathEvaluation, combined_evaluation
from armdesign.search.result import Result, done
from armdesign.settings.sections import Settings, Solver

DESIGN, READY_MADE = "design", "ready-made"


class TooFast(NamedTuple):
    """A joint that turns faster than it can.

    Attributes:
        joint: Its number, from 1.
        speed: How fast it turns on the smoothed path [rad/s].
        limit: How fast it can [rad/s].
        stated: Whether that is stated, not assumed.
    """

    joint: int
    speed: float
    limit: float
    stated: bool


@dataclass(frozen=True, eq=False)
class ArmScore:
    """How an arm does on the task.

    Attributes:
        arm: The arm.
        scores: Its fitness, one entry each; infinite where the start is not reached.
        path: Its path; empty where the start is not reached.
        worst_point: Index of the followed point with the largest error.
        moving_mass: Mass of all that moves [kg]; None where it is not known.
        torque: Peak torque of each joint, shape (n,) [N m]; None where it is not known.
        speed: Largest speed of each joint that turns, on the smoothed path [rad/s]; None where nothing is reached.
        too_fast: The joint that is furthest beyond its own speed; None where none is.
        clearance: How near its bodies come to one another and to obstacles over the whole motion [m], negative where
            they are inside one another; None where its bodies are not known.
        base: Base pose (x, y, z, yaw) that was found for a ready-made arm, shape (4,) [m, rad].
        mounted: What its base is mounted on: floor, wall or ceiling.
        evaluations: Base poses that were tried.
    """

    arm: Arm
    scores: Scores
    path: PathResult
    worst_point: int = 0
    moving_mass: float | None = None
    torque: Array | None = None
    speed: Array | None = None
    too_fast: TooFast | None = None
    clearance: float | None = None
    base: Array | None = None
    mounted: str = "floor"
    evaluations: int = 0

    @property
    def kind(self) -> str:
        """DESIGN or READY_MADE."""
        return DESIGN if isinstance(self.arm, DesignArm) else READY_MADE

    @property
    def held(self) -> tuple[str, ...]:
        """Joints of a ready-made arm that are held at 0."""
        return () if isinstance(self.arm, DesignArm) else self.arm.held

    @property
    def tool(self) -> str | None:
        """The tool's link, of a ready-made arm."""
        return None if isinstance(self.arm, DesignArm) else self.arm.tool

    @property
    def reached(self) -> bool:
        """Whether it reaches the start of the task."""
        return bool(self.scores.valid[0])

    @property
    def fitness(self) -> float:
        """Fitness r [m]; infinite where the start is not reached."""
        return float(self.scores.fitness[0])

    @property
    def peak_torque(self) -> float | None:
        """Largest torque of any joint [N m]; None where it is not known."""
        return None if self.torque is None else float(self.torque.max())

    @property
    def peak_speed(self) -> float | None:
        """Largest speed of any joint that turns [rad/s]; None where it is not known."""
        return None if self.speed is None or not len(self.speed) else float(self.speed.max())

    @property
    def worst_error(self) -> float:
        """Largest distance of a followed point in any frame [m]; infinite where the start is not reached."""
        return float(self.path.distance[:, self.worst_point].max()) if self.reached else np.inf


@dataclass(frozen=True, eq=False)
class Comparison:
    """Arms side by side on one task.

    Attributes:
        rows: The arms with their scores, in the order they were given.
        problem: The task and the settings.
        base_search: How the base poses of ready-made arms were searched.
        payload: Point mass at the tool, for the torques [kg].
    """

    rows: tuple[ArmScore, ...]
    problem: DesignProblem
    base_search: BaseSearch
    payload: float = 0.0

    @property
    def best(self) -> ArmScore | None:
        """The arm with the smallest r of those that reach the start; None where none does."""
        return min((row for row in self.rows if row.reached), key=lambda row: row.fitness, default=None)


def compare(
    arms: Sequence[str | Path | Result | Arm],
    problem: DesignProblem,
    base_search: BaseSearch | None = None,
    *,
    payload: float | None = None,
    on_progress: Callable[[str, BaseProgress], None] | None = None,
) -> Comparison:
    """Score designs and ready-made arms on the same task by the same fitness.

    A design's base is where its run has it, by default at the demonstrator's shoulder; that of a ready-made arm is
    sought in the places that the settings give, by default in a box around the shoulder.

    Args:
        arms: Run folders, DH tables, URDFs, names of ready-made arms such as ``ur5``, results, or arms already open.
        problem: The task and the settings.
        base_search: How the base poses of ready-made arms are searched.
        payload: Point mass at the tool, for the torques; by default that of the settings [kg].
        on_progress: Called with an arm's name and how far the search for its base pose is.

    Raises:
        DesignError: An arm cannot be read; the message says why.
        SettingsError: No arm is given, or one is given twice.
        TaskError: There are too many points, or an orientation is to be followed that is not there.
    """
    search, payload = base_search or BaseSearch(), problem.settings.needs.payload if payload is None else payload
    rows = []
    for arm in open_arms(arms, problem.settings):
        if isinstance(arm, DesignArm):
            rows.append(score_design(arm, problem, payload))
        else:
            tell = None if on_progress is None else (lambda progress, name=arm.name: on_progress(name, progress))
            rows.append(score_ready_made(arm, problem, search, payload, tell))
    return Comparison(tuple(rows), problem, search, payload)


def score_design(design: DesignArm, problem: DesignProblem, payload: float = 0.0) -> ArmScore:
    """Score a design, its base where its run has it, by default at the shoulder.

    Args:
        design: The design.
        problem: The task and the settings.
        payload: Point mass at the tool, for the torques [kg].
    """
    whole, solver = problem.in_room, with_joints(problem.settings, design.dof).solver
    if problem.space.sites and design.base is not None:
        whole = whole.placed(design.base)
    task = whole.task
    path_problem = make_problem(task.P, task.R, task.dt, design.limits, problem.settings.fitness, solver)
    path_problem = path_problem.with_joints(design.table.prismatic)
    scores, path = BlockEvaluator(path_problem, block=1).follow(design.table)
    body = design.body or problem.settings.body  # what the design does not say the task does
    if not scores.valid[0]:
        return ArmScore(design, scores, path, moving_mass=arm_body(design.table, body, design.slides).moving_mass)
    seen = whole.with_settings({"design": {"dof": design.dof, "joints": design.table.joints}, "body": vars(body)})
    r, f, E = (float(each[0]) for each in (scores.fitness, scores.path_fitness, scores.area))
    scored = PathEvaluation(r, f, E, path)
    arm = Result(seen, combined_evaluation(design.table, [scored]), known_slides=design.slides)
    model = dynamic_model(arm.body, payload)
    model.gravity.linear = base_gravity(arm.base_pose)
    row = ArmScore(design, scores, path, moving_mass=arm.body.moving_mass, clearance=least_clearance(arm))
    return with_effort(row, problem, model)


def least_clearance(arm: Result) -> float | None:
    """How near an arm's bodies come to one another and to obstacles, by the exact check of its verdict [m].

    Args:
        arm: The arm, on one demonstration.

    Returns:
        The least over the motion, between frames too; None of a thin arm.
    """
    if arm.problem.settings.body.kind == "thin":
        return None
    scene = ExactScene(arm.body, exact_obstacles(arm.problem.first.obstacles), arm.base_pose.matrix)
    gaps = clearances([scene], [done(arm.table, arm.problem.first, arm.evaluation.demonstrations[0])])
    return min((gap.value for gap in gaps if gap is not None), default=None)


def score_ready_made(
    arm: SerialArm,
    problem: DesignProblem,
    base_search: BaseSearch | None = None,
    payload: float = 0.0,
    on_progress: Callable[[BaseProgress], None] | None = None,
) -> ArmScore:
    """Score a ready-made arm at the base pose where it does best.

    Args:
        arm: The arm.
        problem: The task and the settings.
        base_search: How its base pose is searched.
        payload: Point mass at the tool, for the torques [kg].
        on_progress: Called with how far the search is.
    """
    settings = with_joints(problem.settings, arm.dof)
    task, sites = problem.in_room.task, problem.space.sites
    mounting = mount_arm(arm, task, settings.fitness, settings.solver, base_search, on_progress, sites)
    row = ArmScore(
        arm, mounting.scores, mounting.path, moving_mass=arm.moving_mass or None, base=mounting.base,
        mounted=mounting.mounted, evaluations=mounting.evaluations,
    )  # fmt: skip
    model = arm.model(payload)
    model.gravity.linear = base_gravity(placed_base(mounting.base[:3], float(mounting.base[3]), mounting.mounted))
    return with_effort(row, problem, model)


def with_effort(row: ArmScore, problem: DesignProblem, model: pin.Model) -> ArmScore:
    """The row with its worst point, speeds and, where masses are known, the torques along its path."""
    if not row.reached:
        return row
    followed = np.array(problem.settings.fitness.weights) > 0.0
    worst = np.where(followed, row.path.distance.max(axis=0), -1.0)
    motion = smooth_motion(problem.task.time, row.path.q, row.arm.limits)
    torque = None if row.moving_mass is None else np.abs(model_torques(model, motion)).max(axis=0)
    turns = ~np.array(row.arm.table.prismatic) if isinstance(row.arm, DesignArm) else np.ones(row.arm.dof, dtype=bool)
    speed = np.abs(motion.v).max(axis=0)
    stated = np.full(len(speed), np.nan) if row.arm.speeds is None else row.arm.speeds
    limit = np.where(np.isnan(stated), TURNING, stated)
    share = np.where(turns, speed / limit, 0.0)
    j = int(np.argmax(share))
    beyond = TooFast(j + 1, float(speed[j]), float(limit[j]), not np.isnan(stated[j])) if share[j] > 1.0 else None
    return replace(row, worst_point=int(np.argmax(worst)), torque=torque, speed=speed[turns], too_fast=beyond)


def some_problem(problem: DesignProblem) -> Problem:
    """The task for some arm, to see that there is nothing wrong with it and to compile the kernels on.

    Raises:
        TaskError: There are too many points, or an orientation is to be followed that is not there.
    """
    task = problem.task
    limits = np.tile([-np.pi, np.pi], (problem.settings.design.dof, 1))
    return make_problem(task.P, task.R, task.dt, limits, problem.settings.fitness, problem.settings.solver)


def with_joints(settings: Settings, dof: int) -> Settings:
    """Settings for so many joints that all turn; the effort for the start grows with them unless it was set."""
    solver = settings.solver
    settled = (solver.starts, solver.descents, solver.finalists)
    if settled == tuple(start_effort(Solver(), settings.design.dof)):
        solver = replace(solver, starts=None, descents=None, finalists=None)
    return replace(settings, design=replace(settings.design, dof=dof, joints=None), solver=solver)
