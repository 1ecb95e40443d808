"""From recordings and settings to what a search is to solve; what is left to the recordings is settled by the first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from armdesign.cell.obstacle_file import read_obstacles
from armdesign.demonstration import Recording, Step
from armdesign.demonstration.files.stretch import part_of
from armdesign.demonstration.findings import warning
from armdesign.errors import ArmDesignError, TaskError, counted, short_names
from armdesign.feasibility.needs import check_needs
from armdesign.search.design_problem import Demonstration, DesignProblem
from armdesign.search.prepare_demonstration import SAME_RATE, cell_of, prepare_demonstration, select
from armdesign.settings.sections import Settings


def prepare(
    recordings: Recording | Sequence[Recording],
    settings: Settings,
    *,
    holdouts: Sequence[Recording] = (),
    longest: float | None = None,
) -> DesignProblem:
    """Build the tasks of one or more demonstrations and settle every setting that was left to the recording.

    All demonstrations have the same points, cleaning and weights. What the settings leave to the recording is settled
    by the first: cleaning, weights and the solver's effort. Frames, rates and the places of the base may differ.

    Args:
        recordings: The demonstration that the search sees, or several of them.
        settings: The settings; ``task.more_recordings`` and ``task.holdouts``, where set, are the files of the others.
        holdouts: Demonstrations that the search does not see.
        longest: Length of the longest arm in question [m]; by default L_max of the search.

    Raises:
        TaskError: A point is unknown, the orientation is missing, the start is out of reach, or the demonstrations do
            not have the same points.
        SettingsError: The weights do not fit the points, or what is asked of the arm cannot be judged.
        RecordingError: The data cannot be used.
    """
    # the first is prepared as if it were alone: what it settles holds for all
    seen = [recordings] if isinstance(recordings, Recording) else list(recordings)
    first = prepare_demonstration(seen[0], for_one(settings), longest=longest)
    check_needs(first.settings, oriented=bool(first.settings.fitness.orientation_weight))
    if len(seen) == 1 and not holdouts:
        return DesignProblem(first.settings, (first,))
    # names are compared at once, before the long work on the data of the others
    check_points([*seen, *holdouts], for_one(settings))
    paths = settings.task.more_recordings or [file_of(recording) for recording in seen[1:]]
    unseen = settings.task.holdouts or [file_of(recording) for recording in holdouts]
    shared = shared_settings(settings, first)
    others = [prepare_other(*each, shared, longest) for each in zip(seen[1:], paths, strict=True)]
    kept = [prepare_other(*each, shared, longest) for each in zip(holdouts, unseen, strict=True)]
    changes: dict[str, dict[str, Any]] = {"task": {"more_recordings": known(paths), "holdouts": known(unseen)}}
    if others:
        changes["fitness"] = {"demonstrations": settings.fitness.demonstrations or "mean"}
    steps = (*first.steps, *shared_steps(first, seen[0].source, others, kept))
    first = replace(first, settings=first.settings.replace(changes), steps=steps)
    return DesignProblem(first.settings, (first, *others), tuple(kept))


def with_obstacles(problem: DesignProblem) -> DesignProblem:
    """A problem with the obstacles that its settings name now, in the place of those it had.

    Args:
        problem: The demonstrations and the settings, placed or not.

    Raises:
        ObstacleError: A file cannot be read, an obstacle cannot be used, or something that is not known any more
            carries it.
        SettingsError: There is no room, since the base moves with the recording.
    """
    cell = problem.settings.cell
    found = read_obstacles(cell.obstacles, cell.obstacle_units)
    places = problem.space.sites

    def renewed(each: Demonstration) -> Demonstration:
        room = None if each.room is None else renewed(each.room)
        return replace(each, room=room, obstacles=cell_of(each.settings, (each.room or each).task, found, places))

    seen, unseen = (tuple(map(renewed, part)) for part in (problem.demonstrations, problem.holdouts))
    return DesignProblem(problem.settings, seen, unseen)


def file_of(recording: Recording) -> str | None:
    """The file that a recording was read from; None for one that was not."""
    path = Path(recording.source)
    return (
        str(path.resolve()) if Path(part_of(path).file).is_file() else None
    )  # settings have to hold from any working directory


def known(paths: Sequence[str | None]) -> list[str] | None:
    """Paths for the settings; None where there are none, or not of all."""
    return [path for path in paths if path] if paths and all(paths) else None


def for_one(settings: Settings) -> Settings:
    """The settings for one demonstration."""
    return settings.replace({"task": {"more_recordings": None, "holdouts": None}, "fitness": {"demonstrations": None}})


def shared_settings(settings: Settings, first: Demonstration) -> Settings:
    """The settings for the other demonstrations: those asked for, with what the first has settled for all.

    Args:
        settings: The settings as asked for.
        first: The first demonstration.
    """
    fitness, task = first.settings.fitness, first.settings.task
    return for_one(settings).replace(
        {
            "task": {name: getattr(task, name) for name in ("outliers", "repeats", "low_pass")} | {"files": {}},
            "fitness": {"weights": fitness.weights, "orientation_weight": fitness.orientation_weight},
            "cell": {"place": first.settings.cell.place},
        }
    )


def prepare_other(recording: Recording, path: str | None, shared: Settings, longest: float | None) -> Demonstration:
    """Prepare one of the demonstrations behind the first.

    Args:
        recording: Its recording.
        path: The file it was read from, where there is one.
        shared: The settings for all of them.
        longest: Length of the longest arm in question [m]; None for L_max of the search.

    Raises:
        ArmDesignError: The recording cannot be used, or a setting does not fit; the message names the file.
    """
    try:
        return prepare_demonstration(recording, shared.replace({"task": {"recording": path}}), longest=longest)
    except ArmDesignError as error:
        if recording.source in str(error):
            raise
        raise type(error)(f"{recording.source}: {error}", value=error.value) from error


def check_points(recordings: Sequence[Recording], settings: Settings) -> None:
    """Refuse demonstrations whose points have not the same names, from the base to the hand.

    Args:
        recordings: All of them, those held out included.
        settings: Base and points.

    Raises:
        TaskError: They have not; the message says which file has which.
    """
    found: dict[str, str] = {}
    for recording in recordings:
        try:
            chosen = select(recording, settings)
        except TaskError as error:
            if recording.source in str(error):
                raise
            raise TaskError(f"{recording.source}: {error}", value=error.value) from error
        found[recording.source] = ", ".join(chosen.points)
    if len(set(found.values())) > 1:
        which = "; ".join(f"{source} has {names}" for source, names in found.items())
        raise TaskError(
            f"the demonstrations do not have the same points: {which}",
            value=found,
            fix="Choose the same in all of them with --points, the hand last, or leave a file out",
        )


def shared_steps(
    first: Demonstration, source: str, others: Sequence[Demonstration], holdouts: Sequence[Demonstration]
) -> tuple[Step, ...]:
    """Notes on the demonstrations together.

    Args:
        first: The first demonstration.
        source: Where its recording was read from.
        others: The others that the arm is searched for.
        holdouts: Those that the search does not see.
    """
    every = [first, *others, *holdouts]
    named = list(zip(short_names([source, *(each.name for each in every[1:])]), every, strict=True))
    seen, unseen = named[: 1 + len(others)], named[1 + len(others) :]
    steps = []
    if others:
        steps.append(listed("demonstrations", f"One arm for {len(seen)} demonstrations", seen))
        if first.settings.fitness.orientation_weight:
            how = "The tool is bolted on once: as the first demonstration's first frame asks for."
            if first.settings.fitness.mount != "start":
                how = "The tool is bolted on as the hand's frame stands, in all demonstrations."
            steps.append(Step("mount", how))
    if holdouts:
        steps.append(listed("holdouts", "Held out, not seen by the search", unseen))
    return (*steps, *speeds_differ(named))


def listed(kind: str, what: str, every: Sequence[tuple[str, Demonstration]]) -> Step:
    """A note that lists demonstrations with their numbers of frames.

    Args:
        kind: Kind of the note.
        what: What they are, in words.
        every: The demonstrations, each with its name.
    """
    shown = ", ".join(f"{path} ({counted(len(each.task.time), 'frame')})" for path, each in every)
    return Step(kind, f"{what}: {shown}.", {"files": [path for path, _ in every]})


def speeds_differ(every: Sequence[tuple[str, Demonstration]]) -> tuple[Step, ...]:
    """A warning where one bound eps per frame means other joint speeds in other demonstrations.

    Args:
        every: The demonstrations, each with its name.
    """
    speeds = {}  # [deg/s]
    for name, each in every:
        fitness, dt = each.settings.fitness, each.task.dt
        speeds[name] = fitness.continuity / dt if fitness.continuity_speed is None else fitness.continuity_speed
    if max(speeds.values()) <= (1.0 + SAME_RATE) * min(speeds.values()):
        return ()
    alike: dict[str, list[str]] = {}
    for path, speed in speeds.items():
        alike.setdefault(f"{speed:.4g} deg/s", []).append(path)
    shown = "; ".join(f"{speed} in {', '.join(paths)}" for speed, paths in alike.items())
    what = "eps, the bound on the joints' steps from frame to frame, is not the same speed in all demonstrations"
    return (warning(f"{what}: {shown}. Set fitness.continuity_speed for one speed in all", {"speeds": speeds}),)
