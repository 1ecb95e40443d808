"""What is measured on: the example recordings, real ones where they are there, and how much of everything."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from armdesign.demonstration import Task, read_recording
from armdesign.search.design_problem import DesignProblem
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Body, Settings

T = TypeVar("T")
C = TypeVar("C")
Array = NDArray[np.float64]
EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
REAL = ("box_lift", "handover_giver")


@dataclass(frozen=True)
class Job:
    """A recording and the scenario it is followed in."""

    path: Path
    scenario: str = "packaging"

    @property
    def name(self) -> str:
        """Name in the tables."""
        return self.path.stem

    @property
    def smooth(self) -> bool:
        """Whether it is one of the examples, generated without noise."""
        return self.path.parent == EXAMPLES

    def problem(self, dof: int, **sections: Mapping[str, Any]) -> DesignProblem:
        """The task and settings for n joints, with other settings given by section."""
        changes = {"design": {"dof": dof}, "fitness": {"scenario": self.scenario}}
        for section, entries in sections.items():
            changes[section] = {**changes.get(section, {}), **entries}
        return prepare(read_recording(self.path), Settings(body=Body(kind="thin")).replace(changes))


PACKAGING, WELDING = Job(EXAMPLES / "packaging.csv"), Job(EXAMPLES / "welding.csv", "welding")


@dataclass(frozen=True)
class Plan:
    """How much is measured.

    Attributes:
        quick: Less of everything.
        jobs: The recordings: both examples, then the real ones found.
        notes: Which ones are missing.
        before: The ``armdesign`` of an earlier installation to compare with.
    """

    quick: bool
    jobs: tuple[Job, ...]
    notes: tuple[str, ...]
    before: Path | None = None

    def pick(self, full: T, quick: T) -> T:
        """One of two amounts."""
        return quick if self.quick else full

    @property
    def repeats(self) -> int:
        """How often a timing is repeated; the best counts."""
        return self.pick(3, 2)

    def in_rounds(self, cases: Sequence[C], measure: Callable[[C], T]) -> list[list[T]]:
        """Measurements of every case, taken in turns, so that a noisy spell meets each case but once."""
        rounds = [[measure(case) for case in cases] for _ in range(self.repeats)]
        return [list(measurements) for measurements in zip(*rounds, strict=True)]

    def best(self, measure: Callable[[], T], seconds: Callable[[T], float]) -> T:
        """The fastest of a few repetitions."""
        return min((measure() for _ in range(self.repeats)), key=seconds)


def make_plan(quick: bool, recordings: Path | None, before: Path | None = None) -> Plan:
    """Look which recordings are there."""
    jobs, notes = [PACKAGING, WELDING], []
    for name in REAL:
        path = None if recordings is None else recordings / f"{name}.csv"
        if path is not None and path.is_file():
            jobs.append(Job(path))
        else:
            notes.append(f"The real recording {name}.csv is left out: --recordings DIR names the folder it is in.")
    return Plan(quick, tuple(jobs), tuple(notes), before)


def tiled(problem: DesignProblem, frames: int) -> DesignProblem:
    """The task played forth and back until it has so many frames, so that the pace stays that of the recording."""
    task = problem.task
    once = len(task.P)
    there_and_back = np.r_[np.arange(once), np.arange(once - 2, 0, -1)]
    order = np.resize(there_and_back, frames)
    turns = None if task.quaternions is None else task.quaternions[order]
    time = np.arange(frames) * task.dt
    return with_task(problem, replace(task, time=time, P=task.P[order], R=None, quaternions=turns))


def with_points(problem: DesignProblem, count: int) -> DesignProblem:
    """The task with m points at equal shares of the demonstrator's arm, base to hand, weighted as in packaging."""
    P = problem.task.P
    polyline = np.concatenate([np.zeros_like(P[:, :1]), P], axis=1)
    lengths = np.linalg.norm(np.diff(polyline, axis=1), axis=2)
    arc = np.concatenate([np.zeros((len(P), 1)), np.cumsum(lengths, axis=1)], axis=1)
    shares = np.arange(1, count + 1) / count
    points = np.array(
        [[[np.interp(share * s[-1], s, frame[:, c]) for c in range(3)] for share in shares]
         for s, frame in zip(arc, polyline, strict=True)]
    )  # fmt: skip
    names = tuple(f"point_{i}" for i in range(1, count + 1))
    weights = tuple(np.arange(1.0, count + 1) / (count * (count + 1) / 2))
    task = replace(problem.task, P=points, points=names, R=None, quaternions=None, orientation=None)
    return with_task(problem.with_settings({"fitness": {"weights": weights, "orientation_weight": 0.0}}), task)


def with_task(problem: DesignProblem, task: Task) -> DesignProblem:
    """The problem with another task in place of its own."""
    return replace(problem, demonstrations=(replace(problem.first, task=task),))


def designs(problem: DesignProblem, count: int, seed: int = 0) -> Array:
    """Random designs Phi of Omega_l, shape (N, D)."""
    return problem.space.sample(np.random.default_rng(seed), count)
