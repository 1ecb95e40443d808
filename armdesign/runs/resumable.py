"""A search in a run folder: locked, saved after every iteration, interruptible, and taken up again where it stopped."""

from __future__ import annotations

import hashlib
import json
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from armdesign.runs import checkpoint, folder as runfolder
from armdesign.search.backends import Backend
from armdesign.search.backends.processes import CandidateKillsWorkersError
from armdesign.demonstration import read_plain_csv, task_from_recording
from armdesign.errors import RunFolderError, SearchError
from armdesign.files import write_whole
from armdesign.runs.lock import locked
from armdesign.demonstration.provenance import Origin, Source, fingerprint, read_task_json
from armdesign.runs.folder import STUDY, TASK, TASK_JSON
from armdesign.search.search import Progress, Search, SearchResult
from armdesign.settings.sections import read_settings
from armdesign.search.prepare import Prepared
from armdesign.errors import resume_command

RESULTS = ("result.json", "history.csv", "alternatives.json", "trajectory.csv", "arm.urdf", *runfolder.VIEWS)
FAILED = "failed_candidate.json"
NOTES = "notes.json"
"""What earlier versions kept in place of the task.json."""


class NothingYetError(SearchError):
    """A search was interrupted before it found anything; it can be taken up again."""

    exit_code = 130


class Interrupts:
    """Counts requests to stop: the first ends the search after the iteration, the second at once."""

    def __init__(self, on_first: Callable[[], None] | None = None) -> None:
        """Nothing requested yet."""
        self.requested = False
        self.on_first = on_first

    def __call__(self, number: int, frame: FrameType | None) -> None:
        """Signal handler."""
        if self.requested:
            raise KeyboardInterrupt
        self.requested = True
        if self.on_first is not None:
            self.on_first()


@contextmanager
def interruptible(on_first: Callable[[], None] | None = None) -> Iterator[Interrupts]:
    """Catch Ctrl-C and SIGTERM while the block runs; outside the main thread there is nothing to catch."""
    interrupts = Interrupts(on_first)
    if threading.current_thread() is not threading.main_thread():
        yield interrupts
        return
    before = {number: signal.signal(number, interrupts) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield interrupts
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def start_run(folder: Path, prepared: Prepared) -> None:
    """Write what a later process needs to take the run up: the settings, the task, where it comes from.

    Args:
        folder: The run folder, see runfolder.claim_folder.
        prepared: Task and settings.
    """
    checkpoint.remove(folder / name for name in (*RESULTS, STUDY, FAILED, NOTES))  # without settings there is no run
    checkpoint.remove_states(folder)
    runfolder.start_others(folder, prepared)
    runfolder.write_task(folder, prepared)


def open_run(folder: Path) -> Prepared:
    """Task and settings of a run folder, to the last bit as they were when it was started.

    Raises:
        RunFolderError: The folder holds no run.
    """
    if not (folder / STUDY).is_file():
        raise RunFolderError(f"{folder} holds no run to resume: {STUDY} is missing", value=str(folder))
    earlier = (folder / NOTES).is_file() and not (folder / TASK_JSON).is_file()
    try:
        base, origin, steps = read_task_json(folder / (NOTES if earlier else TASK_JSON))
    except RunFolderError as error:
        raise RunFolderError(f"{folder} holds no run to resume: {error}", value=str(folder)) from error
    settings = read_settings(folder / STUDY)
    if earlier:
        path = settings.task.recording
        origin = Origin(sources=(Source(path, fingerprint(path)),))
    task = task_from_recording(read_plain_csv(folder / TASK), base=base)
    others = open_others(folder, runfolder.OTHERS, settings.task.more_recordings)
    holdouts = open_others(folder, runfolder.HOLDOUTS, settings.task.holdouts)
    return Prepared(settings, task, steps, origin, others, holdouts)


def open_others(folder: Path, pattern: str, recordings: Sequence[str] | None) -> tuple[Prepared, ...]:
    """Further demonstrations of a run folder.

    Args:
        folder: The run folder.
        pattern: runfolder.OTHERS or HOLDOUTS.
        recordings: Their files, according to the settings.

    Raises:
        RunFolderError: One is missing or damaged.
    """
    found = runfolder.other_folders(folder, pattern)
    names = runfolder.other_names(pattern, len(recordings or ()))
    if len(found) < len(names):
        missing = folder / names[len(found)]
        raise RunFolderError(f"{missing} is missing or damaged", value=str(missing), fix="Search again")
    return tuple(open_run(place) for place in found)


def finished(folder: Path) -> bool:
    """Whether a run folder holds the result of a search that was not interrupted."""
    try:
        content = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(content, dict) and content.get("stopped_by") != "interrupted"


def tidy_up(folder: Path) -> None:
    """Clear away what a kill right behind the end of a search has left beside its result.

    Raises:
        RunFolderError: Another process is at it, or a file cannot be removed.
    """
    with locked(folder):
        tidy(folder)


def identity(folder: Path) -> str:
    """Digest of the tasks and the settings a state belongs to.

    Raises:
        RunFolderError: The folder holds none, or they cannot be read.
    """
    digest = hashlib.sha256()
    places = [folder, *runfolder.other_folders(folder, runfolder.OTHERS)]
    try:
        for path in (place / name for place in places for name in (STUDY, TASK)):
            digest.update(path.read_bytes())
    except OSError as error:
        raise RunFolderError(f"cannot read {path}: {error.strerror}", value=str(folder)) from error
    return digest.hexdigest()


def carry_out(
    folder: Path,
    prepared: Prepared,
    backend: Backend,
    *,
    fresh: bool = False,
    on_progress: Callable[[Progress], None] | None = None,
    on_interrupt: Callable[[], None] | None = None,
    on_note: Callable[[str], None] | None = None,
) -> tuple[SearchResult, runfolder.Written]:
    """Search, or go on searching, in a run folder, and write the result.

    Args:
        folder: The run folder.
        prepared: Its task and settings, see start_run and open_run.
        backend: Who evaluates.
        fresh: Start the run first, under the same lock; whatever run the folder holds is given up.
        on_progress: Called after every iteration.
        on_interrupt: Called when Ctrl-C or SIGTERM asks for the end of the search.
        on_note: Called with a sentence where something had to be decided.

    Raises:
        RunFolderError: Another process is at it, the saved state cannot be used, or the disk cannot be written.
        SearchError: Nothing was found, or a candidate kills the workers.
    """
    with locked(folder), interruptible(on_interrupt) as interrupts:
        if fresh:
            start_run(folder, prepared)
        run, key = Search(prepared, backend), identity(folder)
        state = checkpoint.load_state(folder, key, on_note)
        if state is not None:
            run.restore(state)
        writer = checkpoint.StateWriter(folder, key)
        try:
            reason = iterate(run, lambda: writer.submit(run.state()), interrupts, on_progress)
        except CandidateKillsWorkersError as error:
            save_candidate(folder, run, error)
            raise
        finally:
            writer.close()
        result = outcome(run, reason, folder)
        written = runfolder.write_search(folder, result)
        if reason != "interrupted":
            tidy(folder)
        return result, written


def tidy(folder: Path) -> None:
    """Remove what only an unfinished run needs.

    Raises:
        RunFolderError: A file cannot be removed.
    """
    checkpoint.remove_states(folder)
    checkpoint.remove(folder / name for name in (NOTES, FAILED))


def iterate(
    run: Search, save: Callable[[], None], interrupts: Interrupts, on_progress: Callable[[Progress], None] | None
) -> str:
    """Iterate until a stop rule holds or somebody asks for the end; returns why."""
    while (reason := run.ended_by()) is None:
        if interrupts.requested:
            return "interrupted"
        progress = run.advance()
        save()
        if on_progress is not None:
            on_progress(progress)
    return reason


def outcome(run: Search, reason: str, folder: Path) -> SearchResult:
    """The result; an interrupted search that has found nothing yet says how to go on.

    Raises:
        NothingYetError: Interrupted before a candidate has reached the first frame.
        SearchError: No candidate has reached it.
    """
    if reason == "interrupted" and run.leader[0] == float("inf"):
        fix = f"Go on with: {resume_command('search', folder)}"
        raise NothingYetError("interrupted before any arm reached the first frame", fix=fix)
    return run.result(reason)


def save_candidate(folder: Path, run: Search, error: SearchError) -> None:
    """Keep the design that brought the workers down."""
    content = runfolder.dh_content(run.space.table(error.value))  # type: ignore[arg-type]
    write_whole(folder / FAILED, json.dumps({"error": str(error), "dh": content}, indent=2) + "\n")
