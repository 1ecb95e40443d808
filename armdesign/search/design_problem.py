"""What a search is to solve: the demonstrations that the arm shall follow, and the designs it may have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import PurePath
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.cell.obstacles import Obstacles
from armdesign.demonstration import Step, Task
from armdesign.demonstration.files.quaternions import from_matrices, product
from armdesign.demonstration.provenance import Provenance, Source
from armdesign.demonstration.recording import MIN_FRAMES
from armdesign.demonstration.task import task_lines
from armdesign.errors import counted
from armdesign.feasibility.penalty import ArmPenalty, Requirements, Shown, make_penalty
from armdesign.fitness.constraints import DesignSpace, design_space, joint_limits
from armdesign.fitness.objective import Demonstrations, Objective
from armdesign.fitness.problem import Problem, StartEffort, make_problem, start_effort
from armdesign.fitness.robot import RobotFitness
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.line_drawing import drawing, shown
from armdesign.settings import Settings
from armdesign.settings.place import sites

COARSE_START = StartEffort(starts=128, descents=32, finalists=3)
"""How hard a coarse evaluation tries to find a start pose, at most."""
LARGEST_STEP = 3600.0
"""Largest eps that a setting takes [deg]."""


@dataclass(frozen=True, eq=False, repr=False)
class Demonstration:
    """One demonstration of a task, with everything settled that depends on its recording.

    Attributes:
        settings: The settings with base, points, orientation, cleaning and weights as they are used.
        task: What is tracked.
        steps: What was decided and done to the data.
        provenance: Where the task comes from.
        base: Where the arm's base is that the task is seen from; None where the task is as it was demonstrated.
        room: This demonstration as it was before a base was chosen; None where none was.
        obstacles: What stands in the room, or goes through it, during the demonstration.
    """

    settings: Settings
    task: Task
    steps: tuple[Step, ...] = ()
    provenance: Provenance = field(default_factory=Provenance)
    base: BasePose | None = None
    room: Demonstration | None = None
    obstacles: Obstacles = field(default_factory=Obstacles)

    def __repr__(self) -> str:
        return f"Demonstration {PurePath(self.name).name!r}: {repr(self.task).removeprefix('Task: ')}"

    def _repr_html_(self) -> str:
        return shown(repr(self), drawing(task_lines(self.task)))

    @cached_property
    def path_problem(self) -> Problem:
        """Task and settings as the arrays that the solver of paths takes; made once.

        Raises:
            TaskError: There are too many points.
            SettingsError: The weights do not fit the points.
        """
        if self.room is not None and self.base is not None:  # by the very products of the search, to the last bit
            problem = self.room.path_problem
            columns = self.base.turned_back(problem.R.swapaxes(1, 2))
            P, R = self.base.inside(problem.P), columns.swapaxes(1, 2)
            return replace(problem, P=np.ascontiguousarray(P), R=np.ascontiguousarray(R))
        settings, task = self.settings, self.task
        limits = joint_limits(settings.design)
        problem = make_problem(task.P, task.R, task.dt, limits, settings.fitness, settings.solver)
        return problem.with_joints(settings.design.prismatic)

    def placed(self, base: BasePose) -> Demonstration:
        """This demonstration as seen from a base in its task frame."""
        room = self.room or self
        task = room.task
        back = from_matrices(base.rotation.T[None])
        turns = None if task.quaternions is None else product(back, task.quaternions)
        shoulder = None if task.shoulder is None else base.inside(task.shoulder)
        seen = replace(
            task, P=base.inside(task.P), R=None, quaternions=turns, origin=None, shoulder=shoulder,
        )  # fmt: skip
        return replace(room, task=seen, base=base, room=room)

    def with_settings(self, changes: Mapping[str, Mapping[str, Any]]) -> Demonstration:
        """This demonstration under other settings, see DesignProblem.with_settings."""
        room = None if self.room is None else self.room.with_settings(changes)
        return replace(self, settings=self.settings.replace(changes), room=room)

    def coarse(self, frames: int) -> Demonstration:
        """This demonstration on some of its frames, evenly spread from the first to the last, with a lighter start.

        Args:
            frames: How many, three at least; a shorter demonstration keeps all.
        """
        room = None if self.room is None else self.room.coarse(frames)
        settings, task, whole = self.settings, self.task, len(self.task.time)
        chosen = np.linspace(0, whole - 1, min(max(frames, MIN_FRAMES), whole)).round().astype(np.intp)
        # the same largest speed: eps of eq. 4 by how far apart the frames are now
        wider = min(settings.fitness.continuity * float(np.diff(chosen).max()), LARGEST_STEP)
        usual = start_effort(settings.solver, settings.design.dof)
        effort = {name: min(getattr(usual, name), most) for name, most in COARSE_START._asdict().items()}
        changes = {"fitness": {"continuity": wider}, "solver": {**effort, "start_paths": 1}}
        return replace(
            self, settings=settings.replace(changes), task=task.thinned(chosen), room=room,
            obstacles=self.obstacles.thinned(chosen),
        )  # fmt: skip

    @property
    def notes(self) -> tuple[str, ...]:
        """The sentences of the steps."""
        return tuple(step.sentence for step in self.steps)

    @property
    def source(self) -> Source:
        """The file it was read from."""
        return next(iter(self.provenance.sources), Source(self.settings.task.recording))

    @property
    def name(self) -> str:
        """What it is called: the path of its recording."""
        return self.source.path or self.settings.task.recording or "the demonstration"


@dataclass(frozen=True, eq=False, repr=False)
class DesignProblem:
    """Demonstrations of one task and the designs among which the arm that follows them is sought.

    Attributes:
        settings: The settings, those left to the recording filled in by the first demonstration.
        demonstrations: What the arm is searched for, one or more.
        holdouts: Demonstrations that the search does not see; the finished arm is scored on them.
    """

    settings: Settings
    demonstrations: tuple[Demonstration, ...]
    holdouts: tuple[Demonstration, ...] = ()

    def __repr__(self) -> str:
        design, search = self.settings.design, self.settings.search
        lengths = f"{design.length[0]:g} to {design.length[1]:g} m"
        lines = [f"arm of {counted(design.dof, 'joint')}, {lengths}; {search.algorithm}, {search.size}"]
        lines += [f"  {each!r}" for each in self.demonstrations] + [f"  held out: {each!r}" for each in self.holdouts]
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return shown(repr(self), drawing([line for each in self.every for line in task_lines(each.task)]))

    @cached_property
    def space(self) -> DesignSpace:
        """The designs Phi; made once."""
        return design_space(self.settings.design, sites(self.settings.cell))

    @property
    def origin(self) -> Array | None:
        """Where the task frame's origin is in the room, whose axes it has, shape (3,) [m]; None without a room."""
        return (self.first.room or self.first).task.origin

    @property
    def shift(self) -> Array:
        """From the room's origin to the task frame's, shape (3,) [m]; zero without a room."""
        return np.zeros(3) if self.origin is None else self.origin

    @property
    def base_pose(self) -> BasePose:
        """Where the arm's base stands: in the room, or in the task frame where that moves in the room."""
        base, origin = self.first.base, self.origin
        if base is None:
            return BasePose(frame="base") if origin is None else BasePose(origin.copy())
        return base if origin is None else replace(base, translation=base.translation + origin)

    def placed(self, base: BasePose) -> DesignProblem:
        """The same demonstrations as seen from a base in the task frame; what an arm does there is its part to solve.

        Args:
            base: Where the base stands in the task frame.
        """
        seen, unseen = (tuple(each.placed(base) for each in part) for part in (self.demonstrations, self.holdouts))
        return DesignProblem(self.settings, seen, unseen)

    @property
    def in_room(self) -> DesignProblem:
        """The problem before a base was chosen; itself where none was."""
        if self.first.room is None:
            return self
        seen, unseen = (tuple(each.room or each for each in part) for part in (self.demonstrations, self.holdouts))
        return DesignProblem(self.settings, seen, unseen)

    @property
    def first(self) -> Demonstration:
        """The first demonstration, whose path a run folder shows."""
        return self.demonstrations[0]

    @property
    def task(self) -> Task:
        """What is tracked in the first demonstration."""
        return self.first.task

    @property
    def path_problem(self) -> Problem:
        """The first demonstration as arrays."""
        return self.first.path_problem

    @property
    def notes(self) -> tuple[str, ...]:
        """What was decided about the first demonstration and about all together, in sentences."""
        return self.first.notes

    @property
    def every(self) -> tuple[Demonstration, ...]:
        """All demonstrations, those held out last."""
        return (*self.demonstrations, *self.holdouts)

    def check(self) -> None:
        """Check that a search can begin, before anything of it is written.

        Raises:
            SettingsError: The bounds leave no arm, or the weights do not fit the points.
            TaskError: There are too many points.
        """
        self.space.check_not_empty()
        for each in self.demonstrations:
            each.path_problem  # noqa: B018 (made once, on first use)

    def coarse(self, frames: int) -> DesignProblem:
        """The same demonstrations on some of their frames, to look at designs in a fraction of the time.

        Args:
            frames: How many of each.
        """
        seen, unseen = (tuple(each.coarse(frames) for each in part) for part in (self.demonstrations, self.holdouts))
        return DesignProblem(seen[0].settings, seen, unseen)

    def objective(self, block: int | None = None) -> Objective:
        """The objective of the search; of several demonstrations their mean or worst.

        Args:
            block: Arms side by side; any value gives the same scores.
        """
        if self.first.room is not None:  # designs bring their own bases
            return self.in_room.objective(block)
        problems, penalty = [each.path_problem for each in self.demonstrations], self.penalty()
        if len(problems) == 1:
            return RobotFitness(problems[0], self.space, block, penalty)
        worst = self.settings.fitness.demonstrations == "worst"
        return Demonstrations(problems, self.space, block, penalty, worst=worst)

    def penalty(self) -> ArmPenalty | None:
        """What is added to r of an arm that could not be built or would touch something; None for the paper's arm."""
        return make_penalty(self.requirements)

    @cached_property
    def requirements(self) -> Requirements:
        """What an arm must be able to do, and what it must stay clear of."""
        settings = self.settings
        limits, every = joint_limits(settings.design), self.in_room.demonstrations
        shown = tuple(Shown(each.task.time, each.task.arm, each.obstacles) for each in every)
        return Requirements(settings, limits, settings.design.prismatic, shown, self.origin)

    def with_settings(self, changes: Mapping[str, Mapping[str, Any]]) -> DesignProblem:
        """These demonstrations under other settings of design, fitness, solver or search.

        Args:
            changes: {section: {entry: value}}; what a recording settles, such as weights, is not settled anew.

        Raises:
            SettingsError: A setting is unknown or not allowed.
        """
        demonstrations, holdouts = (
            tuple(each.with_settings(changes) for each in part) for part in (self.demonstrations, self.holdouts)
        )
        return DesignProblem(self.settings.replace(changes), demonstrations, holdouts)
