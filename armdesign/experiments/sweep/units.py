"""Carrying out a unit: in its run folder here, or anywhere else with the folder's files as bytes."""

from __future__ import annotations

import json
import signal
import tempfile
import threading
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

from armdesign.errors import ArmDesignError, RunFolderError
from armdesign.experiments.sweep.jobs import RECORD, WORK, Perform, State, carry_out_work, recorded, work_text
from armdesign.experiments.sweep.sweep_plan import Unit
from armdesign.experiments.sweep.sweep_store import task_folder
from armdesign.files import write_whole
from armdesign.runs.checkpoint import CURRENT, PREVIOUS
from armdesign.runs.folder import TASK, settings_file
from armdesign.runs.lock import locked
from armdesign.runs.reading import read_problem
from armdesign.runs.resumable import carry_out, finished, start_run, tidy
from armdesign.search.backends.backend import InProcess
from armdesign.search.backends.workers import Handler, JobContext
from armdesign.search.search import Progress

RESULT = "result.json"
Stage = Literal["new", "begun", "finished"]


@dataclass(frozen=True)
class Outcome:
    """How a unit has ended."""

    state: State  # finished; interrupted, to be gone on with; or failed
    reason: str = ""  # why it failed, in a sentence
    # content of the run folder by file name, where it was carried out elsewhere
    files: Mapping[str, bytes] | None = None


def look_at(folder: Path, unit: Unit) -> Stage:
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
        RunFolderError: It cannot be written, or another process uses it.
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


@dataclass(frozen=True)
class UnitJob:
    """What a worker needs to carry out a unit."""

    place: Path  # the run folder, which was begun
    perform: Perform | None = None  # does the work of a unit that is no search
    # content of the run folder by file name, for a worker that does not see it: with a saved state the search
    # goes on from there, and the outcome brings the files back
    files: Mapping[str, bytes] | None = None


def unit_worker() -> Handler:
    """The setup of a worker that carries out units."""
    return carry_out_unit


def carry_out_unit(job: UnitJob, context: JobContext | None = None) -> Outcome:
    """Carry out what a run folder asks for, in this process, to its end or to an interruption.

    Args:
        job: The unit.
        context: Takes the progress after every iteration, and may ask for the end.
    """
    context = context or JobContext()
    if context.stop_requested():
        return Outcome("interrupted")
    if job.files is None:
        if not (job.place / WORK).is_file():
            return Outcome(*carry_out_search(job.place, context))
        if job.perform is None:
            return Outcome("failed", f"{job.place} holds the work of a study, not a search")
        return Outcome(*carry_out_work(job.place, job.perform, context))
    with tempfile.TemporaryDirectory(prefix="armdesign-") as above:
        place = Path(above) / job.place.name
        place.mkdir()
        for file, content in job.files.items():
            write_whole(place / file, content)
        outcome = carry_out_unit(UnitJob(place, job.perform), context)
        return replace(outcome, files=contents(place))


def carry_out_search(place: Path, context: JobContext) -> tuple[State, str]:
    """Carry out a search; returns how it has ended, and why it has failed."""
    stopping: list[bool] = []

    def after_iteration(progress: Progress) -> None:
        context.report(asdict(progress))
        if not stopping and context.stop_requested():
            if threading.current_thread() is not threading.main_thread():
                raise KeyboardInterrupt  # the iteration is done and saved; no signal reaches this thread
            signal.raise_signal(signal.SIGINT)  # has the search end with a result

    state: State = "finished"
    reason = ""
    try:
        problem = read_problem(place)
        result, _ = carry_out(
            place, problem, InProcess(problem),
            on_progress=after_iteration, on_interrupt=lambda: stopping.append(True),
        )  # fmt: skip
        if result.facts is not None and result.facts.interrupted:
            state = "interrupted"
    except ArmDesignError as error:  # found nothing, so far or at all; or cannot read or write
        state, reason = ("interrupted", "") if stopping else ("failed", str(error))
    except KeyboardInterrupt:
        state = "interrupted"
    return state, reason


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
