"""The whole way in one call: from a demonstration to the arm that follows it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

from armdesign.demonstration import Hints, Recording, read_recording, read_recordings
from armdesign.demonstration.points.selection import ORIGIN
from armdesign.errors import SettingsError
from armdesign.search.backends.parallel import WorkerPool
from armdesign.search.design_problem import DesignProblem
from armdesign.search.prepare import file_of, known, prepare
from armdesign.search.result import Result
from armdesign.search.search import Progress, search
from armdesign.settings import Settings
from armdesign.settings.place import sites

Source: TypeAlias = "str | Path | Recording"
"""A recording, or where it is."""


def design(
    recordings: Source | Sequence[Source] | None = None,
    settings: Settings | None = None,
    *,
    holdouts: Sequence[Source] = (),
    workers: int = 1,
    on_progress: Callable[[Progress], None] | None = None,
    **entries: Any,  # noqa: ANN401 (any setting)
) -> Result:
    """Design the arm that follows a demonstration: read it, prepare it, search.

    ``design("take.c3d", dof=4, budget=10_000)`` does what ``armdesign search take.c3d --dof 4 --budget 10000`` does,
    without writing a run folder; see ``write_result`` for that.

    Args:
        recordings: The demonstration, as a path or read already, or several of one task; by default those that the
            settings name.
        settings: What to start from; by default the published settings.
        holdouts: Demonstrations that the search does not see; the arm is scored on them.
        workers: Processes that evaluate candidates; any number gives the same arm. With more than one, call this below
            ``if __name__ == "__main__":``.
        on_progress: Called after every iteration.
        entries: Entries of any section by their names, such as ``dof=4``, or whole sections, such as
            ``search=Search(budget=10_000)``; they go over ``settings``.

    Raises:
        ArmDesignError: A setting is not allowed, a recording cannot be read or used, or no arm was found.
    """
    chosen = (settings or Settings()).with_entries(**entries)
    if recordings is None:
        task = chosen.task
        recordings = [path for path in (task.recording, *(task.more_recordings or ())) if path]
        holdouts = holdouts or task.holdouts or ()
    seen = [recordings] if isinstance(recordings, (str, Path, Recording)) else recordings
    problem = problem_of(seen, holdouts, chosen)
    if workers == 1:
        return search(problem, on_progress=on_progress)
    if workers < 1:
        raise SettingsError(f"workers is {workers}", value=workers, allowed="a whole number of at least 1")
    with WorkerPool(problem, workers) as backend:
        return search(problem, on_progress=on_progress, backend=backend)


def problem_of(recordings: Sequence[Source], holdouts: Sequence[Source], settings: Settings) -> DesignProblem:
    """Read the recordings that are paths, and prepare all with the paths they came from in the settings.

    Args:
        recordings: What the search sees.
        holdouts: What it does not see.
        settings: The settings; they say how recordings are read.

    Raises:
        ArmDesignError: There is none, or one cannot be read or used.
    """
    if not recordings:
        raise SettingsError("no recording is given", allowed="a path, a Recording, or a list of them")
    seen, unseen = ([opened(source, settings) for source in part] for part in (recordings, holdouts))
    first, *more = (file_of(recording) for recording in seen)
    paths = {"more_recordings": known(more), "holdouts": known([file_of(recording) for recording in unseen])}
    return prepare(seen, settings.replace({"task": {"recording": first, "files": {}, **paths}}), holdouts=unseen)


def opened(source: Source, settings: Settings) -> Recording:
    """A recording, read as the settings say where it is a path."""
    if isinstance(source, Recording):
        return source
    return recording_of(settings.replace({"task": {"recording": str(source), "files": {}}}))


def recording_of(settings: Settings) -> Recording:
    """The recording that the settings name; units and axes do not count where points count from the base already.

    Args:
        settings: With ``task.recording`` or ``task.files`` set.

    Raises:
        RecordingError: It cannot be read.
    """
    task = settings.task
    relative = task.base == ORIGIN and not sites(settings.cell)
    units, up, mirror = (None, None, False) if relative else (task.units, task.up, task.mirror)
    hints = Hints(task.file_rate or task.rate, quaternions=task.quaternions, confidence=task.confidence)
    if not relative:
        hints = replace(hints, time_unit=task.time_unit, start=task.start, stop=task.stop)
    if task.files:
        return read_recordings(task.files, units=units, up=up, mirror=mirror, hints=hints)
    return read_recording(str(task.recording), units=units, up=up, mirror=mirror, hints=hints)
