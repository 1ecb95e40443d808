"""Carrying out a unit: in its run folder here, or anywhere else with the folder's files as bytes."""

from __future__ import annotations

import json
import signal
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from armdesign.errors import ArmDesignError, RunFolderError
from armdesign.experiments.sweep.jobs import RECORD, WORK, State, carry_out_work, recorded, work_text
from armdesign.experiments.sweep.sweep_plan import Unit
from armdesign.experiments.sweep.sweep_store import task_folder
from armdesign.files import write_whole
from armdesign.runs.checkpoint import CURRENT, PREVIOUS
from armdesign.runs.folder import TASK, settings_file
from armdesign.runs.lock import locked
from armdesign.runs.reading import read_problem
from armdesign.runs.resumable import carry_out, finished, start_run, tidy
from armdesign.search.backends import InProcess
from armdesign.search.search import Progress

RESULT = "result.json"
Found = Literal["new", "begun", "finished"]


@dataclass(frozen=True)
class Outcome:
    """How the work on a unit has ended.

    Attributes:
        state: finished; interrupted, to be gone on with; or failed.
        reason: Why it failed, in a sentence.
        files: Content of the run folder by file name, if it was asked for.
    """

    state: State
    reason: str = ""
    files: Mapping[str, bytes] | None = None


def look_at(folder: Path, unit: Unit) -> Found:
    """How far the unit has come in a sweep's folder.

    Raises:
        RunFolderError: Its run folder holds a run with other settings or of another task.
    """
    place = folder / unit.name
    settings = settings_file(place)
    if not settings.is_file():
        return "new"
    task = task_folder(folder, unit.recording, unit.problem.settings.design.dof) / TASK
    try:
        same = settings.read_text(encoding="utf-8") == unit.problem.settings.to_toml()
        same = same and (place / TASK).read_bytes() == task.read_bytes()
        same = same and same_work(place / WORK, unit)
    except (OSError, UnicodeDecodeError) as error:
        raise RunFolderError(f"cannot read the run in {place}: {error}", value=str(place)) from error
    if not same:
        raise RunFolderError(
            f"{place} holds another run: its {settings.name}, {TASK} or {WORK} is not that of the sweep",
            value=str(place),
            fix="Move it away, or name another folder with --out",
        )
    if unit.work is not None:
        return "new" if recorded(place) is None else "finished"
    if finished(place):
        return "finished"
    return "begun" if any((place / name).is_file() for name in (CURRENT, PREVIOUS)) else "new"


def same_work(path: Path, unit: Unit) -> bool:
    """Whether a file tells of the unit's work; of a search there is none.

    Raises:
        OSError: It cannot be read.
    """
    if unit.work is None:
        return not path.exists()
    try:
        return path.exists() and bool(json.loads(path.read_text(encoding="utf-8")) == json.loads(work_text(unit.work)))
    except ValueError:
        return False


def begin_unit(folder: Path, unit: Unit) -> Path:
    """Make the unit's run folder ready to be carried out; a search that has begun is left where it stands.

    Returns:
        The run folder.

    Raises:
        RunFolderError: It cannot be written, or a process is at it.
    """
    place = folder / unit.name
    if look_at(folder, unit) == "new":
        try:
            place.mkdir(exist_ok=True)
        except OSError as error:
            raise RunFolderError(f"cannot make the run folder {place}: {error.strerror}", value=str(place)) from error
        with locked(place):
            if unit.work is not None:
                write_whole(place / WORK, work_text(unit.work))
            start_run(place, unit.problem)
    return place


def carry_out_unit(
    place: Path,
    *,
    on_progress: Callable[[Progress], None] | None = None,
    stop: Callable[[], bool] | None = None,
    bring_back: bool = False,
) -> Outcome:
    """Carry out what a run folder that was begun asks for, in this process, to its end or to an interruption.

    Args:
        place: The run folder.
        on_progress: Called after every iteration.
        stop: Asked after every iteration whether to interrupt the search; for the main thread only.
        bring_back: Whether the outcome holds the folder's files.
    """
    state, reason = (carry_out_work if (place / WORK).is_file() else carry_out_search)(place, on_progress, stop)
    return Outcome(state, reason, contents(place) if bring_back else None)


def carry_out_search(
    place: Path, on_progress: Callable[[Progress], None] | None, stop: Callable[[], bool] | None
) -> tuple[State, str]:
    """Carry out a search; returns how it has ended, and why it has failed."""
    asked_to_stop: list[bool] = []

    def after_iteration(progress: Progress) -> None:
        if on_progress is not None:
            on_progress(progress)
        if stop is not None and stop() and not asked_to_stop:
            signal.raise_signal(signal.SIGINT)  # the one way a search is interrupted

    state: State = "finished"
    reason = ""
    try:
        problem = read_problem(place)
        result, _ = carry_out(
            place, problem, InProcess(problem),
            on_progress=after_iteration, on_interrupt=lambda: asked_to_stop.append(True),
        )  # fmt: skip
        if result.facts is not None and result.facts.interrupted:
            state = "interrupted"
    except ArmDesignError as error:  # found nothing, so far or at all; or cannot read or write
        state, reason = ("interrupted", "") if asked_to_stop else ("failed", str(error))
    except KeyboardInterrupt:
        state = "interrupted"
    return state, reason


def carry_out_elsewhere(
    name: str, files: Mapping[str, bytes], *, on_progress: Callable[[Progress], None] | None = None
) -> Outcome:
    """Carry out a unit where its run folder is not at hand, such as on a cluster; the files come back as bytes.

    Args:
        name: Name of the run folder.
        files: Its content, from `contents`; with a saved state the search goes on from there.
        on_progress: See carry_out_unit.
    """
    with tempfile.TemporaryDirectory(prefix="armdesign-") as above:
        place = Path(above) / name
        place.mkdir()
        for file, content in files.items():
            write_whole(place / file, content)
        return carry_out_unit(place, on_progress=on_progress, bring_back=True)


def contents(place: Path) -> dict[str, bytes]:
    """Files of a run folder by name, without hidden ones."""
    return {path.name: path.read_bytes() for path in sorted(place.iterdir()) if path.is_file() and path.name[0] != "."}


def bring_in(place: Path, outcome: Outcome) -> None:
    """Write the files of a unit that was carried out elsewhere into its run folder, the result last.

    Raises:
        RunFolderError: A file cannot be written.
    """
    files = dict(outcome.files or {})
    last = {name: files.pop(name) for name in (RESULT, RECORD) if name in files}
    for name, content in (files | last).items():
        write_whole(place / name, content)
    if outcome.state == "finished":
        tidy(place)
