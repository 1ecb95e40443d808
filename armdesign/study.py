"""From settings and a recording to what a search needs: the task, the problem and the design space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armdesign.demonstration import Recording, Task, build_task, task_from_recording
from armdesign.errors import TaskError
from armdesign.fitness.constraints import DesignSpace, design_space, joint_limits
from armdesign.fitness.problem import Problem, make_problem, resolve_weights, start_counts
from armdesign.settings import Study, TaskSettings

ORIGIN = "origin"
"""Name of the base where the points of a recording already count from it, as in a run's task.csv."""


@dataclass(frozen=True)
class Prepared:
    """A study with everything that depends on the recording filled in.

    Attributes:
        study: The settings with base, points, orientation and weights as they are used.
        task: What is tracked.
        notes: Sentences on what was decided and done to the data.
    """

    study: Study
    task: Task
    notes: tuple[str, ...]

    def problem(self) -> Problem:
        """The task and the settings as arrays."""
        study = self.study
        return make_problem(
            self.task.P, self.task.R, self.task.dt, joint_limits(study.design), study.fitness, study.solver
        )

    def space(self) -> DesignSpace:
        """The design space."""
        return design_space(self.study.design)


def prepare(recording: Recording, study: Study, *, longest: float | None = None) -> Prepared:
    """Build the task of a recording and settle every setting that was left to it.

    Args:
        recording: The demonstration.
        study: The settings.
        longest: Length of the longest arm in question [m]; by default L_max of the search.

    Raises:
        TaskError: A point is unknown, the orientation is missing, or the start is out of reach.
        SettingsError: The weights do not fit the points.
        RecordingError: The data cannot be used.
    """
    points = study.task.points or tuple(name for name in recording.points if name != first_base(recording, study))
    if not points:
        raise TaskError("the recording has no point besides the base", value=list(recording.points))
    w_0, weights = resolve_weights(study.fitness, len(points))
    wanted = study.task.orientation
    oriented = (wanted or points[-1]) if w_0 > 0.0 else None
    task = task_of(recording, study, points, oriented)
    notes = list(task.notes)
    if counts_from_base(recording, study) and unused_settings(study):
        notes.append(f"The points count from the base already; not used: {', '.join(unused_settings(study))}.")
    if wanted is not None and oriented is None:
        notes.append(f"The orientation of '{wanted}' is not followed: the orientation weight w_0 is 0.")
    notes += check_reach(task, study.design.length[1] if longest is None else longest, searched=longest is None)
    starts, descents = start_counts(study.solver, study.design.dof)
    settled = study.replace(
        {
            "solver": {"starts": starts, "descents": descents},
            "task": {"base": task.base, "points": task.points, "orientation": oriented},
            "fitness": {"weights": weights, "orientation_weight": w_0},
        }
    )
    return Prepared(settled, task, tuple(notes))


def first_base(recording: Recording, study: Study) -> str:
    """The base's name: the one set, or the recording's first point."""
    return study.task.base or next(iter(recording.points), "")


def task_of(recording: Recording, study: Study, points: tuple[str, ...], oriented: str | None) -> Task:
    """The task of chosen points, relative to the base."""
    settings = study.task
    if oriented is not None and oriented not in recording.orientations:
        available = list(recording.orientations)
        raise TaskError(
            f"the orientation of '{oriented}' is to be followed (w_0 > 0), but the recording has none for it",
            value=oriented,
            allowed=available or "none: this recording holds positions only",
            fix="Name another point, or take weights with w_0 = 0 such as the packaging scenario's",
        )
    if counts_from_base(recording, study):
        kept = Recording(
            recording.time,
            {name: pick(recording, name) for name in points},
            {} if oriented is None else {oriented: recording.orientations[oriented]},
            recording.source,
        )
        return task_from_recording(kept, base=ORIGIN)
    return build_task(
        recording,
        base=settings.base,
        points=points,
        orientation=oriented,
        base_mode=settings.base_mode,
        max_gap=settings.max_gap,
        low_pass=settings.low_pass,
        rate=settings.rate,
        scale=settings.scale,
        start=settings.start,
        stop=settings.stop,
    )


def counts_from_base(recording: Recording, study: Study) -> bool:
    """Whether the recording's points count from the base already."""
    return study.task.base == ORIGIN and ORIGIN not in recording.points


def unused_settings(study: Study) -> list[str]:
    """Task settings that are set but do nothing where points count from the base already."""
    default = TaskSettings()
    names = ("base_mode", "max_gap", "low_pass", "rate", "scale", "start", "stop")
    return [name for name in names if getattr(study.task, name) != getattr(default, name)]


def pick(recording: Recording, name: str) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Positions of one point, or an error that lists the names there are."""
    if name not in recording.points:
        raise TaskError(f"unknown point '{name}'", value=name, allowed=list(recording.points))
    return recording.points[name]


def check_reach(task: Task, longest: float, *, searched: bool) -> list[str]:
    """Compare the hand's distance from the base with the longest arm allowed.

    Raises:
        TaskError: The first hand point lies out of reach of any arm.
    """
    distance = np.linalg.norm(task.P[:, -1], axis=1)
    if searched and distance[0] >= longest:
        raise TaskError(
            f"the task is out of reach: at the start the hand is {distance[0]:.3f} m from the base, "
            f"and no arm may be longer than L_max = {longest:g} m",
            value=float(distance[0]),
            fix="Raise design.length, or check base and units",
        )
    beyond = int((distance > longest).sum())
    if beyond == 0:
        return []
    return [
        f"In {beyond} of {len(distance)} frames the hand is farther from the base (up to {distance.max():.3f} m) than "
        f"{'the longest arm reaches, L_max =' if searched else 'the arm is long,'} {longest:g} m."
    ]
