"""What a search is to solve: the demonstrations that the arm shall follow, and the designs it may have."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import PurePath
from typing import Any

from armdesign.demonstration import Step, Task
from armdesign.demonstration.provenance import Provenance, Source
from armdesign.demonstration.task import task_lines
from armdesign.errors import counted
from armdesign.fitness.constraints import DesignSpace, design_space, joint_limits
from armdesign.fitness.objective import Demonstrations, Objective
from armdesign.fitness.problem import Problem, make_problem
from armdesign.fitness.robot import RobotFitness
from armdesign.kinematics.line_drawing import drawing, shown
from armdesign.settings import Settings


@dataclass(frozen=True, eq=False, repr=False)
class Demonstration:
    """One demonstration of a task, with everything settled that depends on its recording.

    Attributes:
        settings: The settings with base, points, orientation, cleaning and weights as they are used.
        task: What is tracked.
        steps: What was decided and done to the data.
        provenance: Where the task comes from.
    """

    settings: Settings
    task: Task
    steps: tuple[Step, ...] = ()
    provenance: Provenance = field(default_factory=Provenance)

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
        settings, task = self.settings, self.task
        limits = joint_limits(settings.design)
        return make_problem(task.P, task.R, task.dt, limits, settings.fitness, settings.solver)

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
        return design_space(self.settings.design)

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

    def objective(self, block: int | None = None) -> Objective:
        """The objective of the search; of several demonstrations their mean or worst.

        Args:
            block: Arms side by side; any value gives the same scores.
        """
        problems = [each.path_problem for each in self.demonstrations]
        if len(problems) == 1:
            return RobotFitness(problems[0], self.space, block)
        return Demonstrations(problems, self.space, block, worst=self.settings.fitness.demonstrations == "worst")

    def with_settings(self, changes: Mapping[str, Mapping[str, Any]]) -> DesignProblem:
        """These demonstrations under other settings of design, fitness, solver or search.

        Args:
            changes: {section: {entry: value}}; what a recording settles, such as weights, is not settled anew.

        Raises:
            SettingsError: A setting is unknown or not allowed.
        """
        demonstrations, holdouts = (
            tuple(dataclasses.replace(each, settings=each.settings.replace(changes)) for each in part)
            for part in (self.demonstrations, self.holdouts)
        )
        return DesignProblem(self.settings.replace(changes), demonstrations, holdouts)
