"""What a study shall do, the units it consists of, and their results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from armdesign.experiments.sweep.sweep_plan import Unit
from armdesign.search.design_problem import DesignProblem

MARKS, FILLS = ("o", "s", "^", "D"), ("black", "white", "#999999", "white")
"""Of the tasks in figures: they differ in grey, too."""


@dataclass(frozen=True)
class StudyRequest:
    """What a study shall do."""

    study: str  # its name
    # keys of the tasks: the path of a recording or of a settings file, or the name of a built-in example
    tasks: tuple[str, ...]
    dof: tuple[int, ...]  # numbers of joints n
    reps: int  # number of repetitions; may grow later
    seed: int  # seed of the first repetition; the others have those that follow
    # its further options by name, as JSON values; lists may grow later, the rest stays as it is
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def seeds(self) -> tuple[int, ...]:
        """One seed per repetition."""
        return tuple(range(self.seed, self.seed + self.reps))


@dataclass(frozen=True)
class Defaults:
    """What a study runs with where nothing else is given."""

    reps: int  # number of repetitions
    dof: tuple[int, ...]  # numbers of joints n
    options: Mapping[str, Any] = field(default_factory=dict)  # as in ``StudyRequest``
    search: Mapping[str, Any] = field(default_factory=dict)  # changes to the [search] settings


@dataclass(frozen=True)
class Record:
    """The result of a unit."""

    unit: Unit  # the unit
    state: str  # finished, failed, interrupted or waiting
    reason: str  # why it failed, in a sentence
    content: Mapping[str, Any]  # of a finished one: the result.json of a search, or what the work has found
    folder: Path  # its run folder
    wall_time: float | None = None  # time it took [s]; None where it is not finished

    @property
    def finished(self) -> bool:
        """Whether there is content."""
        return self.state == "finished"

    @property
    def task(self) -> str:
        """Name of the task."""
        return task_name(self.unit.recording)

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return self.unit.problem.settings.design.dof

    @property
    def algorithm(self) -> str:
        """What searched or solved: of a work what its entry ``algorithm`` says."""
        work = self.unit.work
        return self.unit.problem.settings.search.algorithm if work is None else str(work.get("algorithm", ""))

    @property
    def seed(self) -> int:
        """Seed: of a work its entry ``seed``."""
        work = self.unit.work
        return self.unit.problem.settings.search.seed if work is None else int(work.get("seed", 0))


def task_name(key: str) -> str:
    """Name of a task by its key: the file's name without its ending."""
    return Path(key).stem


def search_unit(key: str, problem: DesignProblem, label: str, **search: Any) -> Unit:  # noqa: ANN401 (settings)
    """A whole search as a unit; its run folder is TASK-nN-LABEL-seedS.

    Args:
        key: Key of the task.
        problem: The task, prepared.
        label: What distinguishes the search from others with the same joints and seed.
        **search: Changes to the [search] settings, such as algorithm and seed.

    Raises:
        SettingsError: A setting is not allowed.
    """
    settings = problem.settings.replace({"search": search})
    name = f"{task_name(key)}-n{settings.design.dof}-{label}-seed{settings.search.seed}"
    return Unit(name, Path(key).name, replace(problem, settings=settings))


def work_unit(key: str, problem: DesignProblem, name: str, work: Mapping[str, Any]) -> Unit:
    """Other work as a unit.

    Args:
        key: Key of the task.
        problem: The task, prepared.
        name: Name of its folder, behind TASK-nN-.
        work: What to do, as JSON values; ``study`` is the name of the study whose ``perform`` does it, ``algorithm``
            and ``seed`` show in the table of runs.
    """
    return Unit(f"{task_name(key)}-n{problem.settings.design.dof}-{name}", Path(key).name, problem, work)
