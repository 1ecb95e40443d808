"""A search in a run folder: locked, saved every second, interruptible, and taken up again where it stopped."""

from __future__ import annotations

import hashlib
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from types import FrameType
from typing import Any

from armdesign.errors import RunFolderError, SearchError, SettingsError, resume_command
from armdesign.files import read_json, remove_files, write_whole
from armdesign.runs import checkpoint
from armdesign.runs.contents import dh_content, inner_demonstrations, json_text, problem_contents, result_contents
from armdesign.runs.folder import DEMONSTRATIONS, NOTHING_FOUND, RESULT, TASK, TASK_FILES, inner_folders, settings_file
from armdesign.runs.lock import locked
from armdesign.runs.reading import read_problem
from armdesign.runs.writing import clear_result, write_files
from armdesign.search.backends.backend import Backend, InProcess
from armdesign.search.backends.parallel import CandidateKillsWorkersError
from armdesign.search.design_problem import DesignProblem
from armdesign.search.result import Result
from armdesign.search.search import NothingFoundError, Progress, Search
from armdesign.settings.sections import Search as SearchSettings
from armdesign.settings.sections import read_settings
from armdesign.swarm import ALGORITHMS

FAILED = "failed_candidate.json"
"""The design that has brought worker processes down."""
SAVE_EVERY = 1.0
"""Time between two states that are saved [s]: a search that is killed goes on from the last one."""
EXTENSIBLE = ("budget", "effort", "iterations", "patience", "target", "time_limit")
"""Settings of the search that may change from one part of it to the next."""


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


def start_run(folder: Path, problem: DesignProblem) -> None:
    """Write what a later process needs to take the run up, in place of whatever run the folder holds.

    Args:
        folder: The run folder, see ``claim_folder``.
        problem: The demonstrations and the settings.
    """
    clear_result(folder, keep=inner_demonstrations(problem))
    # before the states: without settings there is no run
    remove_files(folder / name for name in (*TASK_FILES, FAILED, NOTHING_FOUND))
    checkpoint.remove_states(folder)
    write_files(folder, problem_contents(problem))


def finished(folder: Path) -> bool:
    """Whether a run folder holds the result of a search that was not interrupted."""
    try:
        return read_json(folder / RESULT).get("stopped_by") != "interrupted"
    except RunFolderError:
        return False


def tidy_up(folder: Path) -> None:
    """Clear away what a kill right behind the end of a search has left beside its result.

    Raises:
        RunFolderError: Another process uses the folder, or a file cannot be removed.
    """
    with locked(folder):
        tidy(folder)


def identity(folder: Path) -> str:
    """Digest of the tasks and the settings a state belongs to; length and stop rules may change.

    Raises:
        RunFolderError: The folder holds none, or they cannot be read.
    """
    digest = hashlib.sha256()
    for place in (folder, *inner_folders(folder, DEMONSTRATIONS)):
        settings, task = read_settings(settings_file(place)), place / TASK
        anyhow = {name: getattr(SearchSettings(), name) for name in EXTENSIBLE}
        digest.update(replace(settings, search=replace(settings.search, **anyhow)).to_toml().encode())
        try:
            digest.update(task.read_bytes())
        except OSError as error:
            raise RunFolderError(f"cannot read {task}: {error.strerror}", value=str(folder)) from error
    return digest.hexdigest()


def extend_run(folder: Path, changes: Mapping[str, Any]) -> None:
    """Give a search that has ended or stopped another length or other stop rules, to go on with ``carry_out``.

    It can be killed at any point: a result is marked as interrupted before the settings change, and the saved state
    belongs to the settings before and after.

    Args:
        folder: The run folder.
        changes: New values of entries named in EXTENSIBLE.

    Raises:
        RunFolderError: Another process uses the folder, or there is no state to go on from.
        SettingsError: A value is not allowed, or the search would stop at once all the same.
    """
    with locked(folder):
        problem = read_problem(folder)
        settings = replace(problem.settings, search=replace(problem.settings.search, **changes))
        state = checkpoint.load_state(folder, identity(folder))
        if state is None:
            fix = "Search again with the new settings"
            raise RunFolderError(f"{folder} holds no saved state to go on from", value=str(folder), fix=fix)
        algorithm = ALGORITHMS[settings.search.algorithm]
        done = algorithm.units_done(int(state["history_evaluations"][-1]), asdict(settings.search))
        if changes.get(algorithm.length, done + 1) <= done:
            raise SettingsError(
                f"the {algorithm.length} is {changes[algorithm.length]}, but {done} {algorithm.unit}s are done",
                value=changes[algorithm.length], allowed=f"more than {done}",
            )  # fmt: skip
        extended = replace(problem, settings=settings)
        run = Search(extended, InProcess(extended))
        run.restore(state)
        if (reason := run.ended_by()) is not None:
            rule = reason.replace("_", " ")
            raise SettingsError(
                f"the search in {folder} would stop at once, by its {rule}", value=getattr(settings.search, reason),
                fix=f"Give another --{reason.replace('_', '-')} as well",
            )  # fmt: skip
        if finished(folder):
            content = read_json(folder / RESULT) | {"stopped_by": "interrupted"}
            write_whole(folder / RESULT, json_text(content))
        remove_files([folder / NOTHING_FOUND])
        write_whole(settings_file(folder), settings.to_toml())


def carry_out(
    folder: Path,
    problem: DesignProblem,
    backend: Backend,
    *,
    fresh: bool = False,
    on_progress: Callable[[Progress], None] | None = None,
    on_interrupt: Callable[[], None] | None = None,
    on_note: Callable[[str], None] | None = None,
) -> tuple[Result, dict[str, str]]:
    """Search, or go on searching, in a run folder, and write the result.

    Args:
        folder: The run folder.
        problem: Its task and settings, see ``start_run`` and ``reading.read_problem``.
        backend: Who evaluates.
        fresh: Start the run first, under the same lock; whatever run the folder holds is given up.
        on_progress: Called after every iteration.
        on_interrupt: Called when Ctrl-C or SIGTERM asks for the end of the search.
        on_note: Called with a sentence where something had to be decided.

    Returns:
        The result, and the files that it has added to the folder: their text by name.

    Raises:
        RunFolderError: Another process uses the folder, the saved state cannot be used, or the disk cannot be written.
        SearchError: Nothing was found, or a candidate kills the workers.
    """
    with locked(folder), interruptible(on_interrupt) as interrupts:
        if fresh:
            start_run(folder, problem)
        run, key = Search(problem, backend), identity(folder)
        state = checkpoint.load_state(folder, key, on_note)
        if state is not None:
            run.restore(state)
        writer = checkpoint.StateWriter(folder, key)
        try:
            reason = iterate(run, lambda: writer.submit(run.state()), interrupts, on_progress)
            run.gather(reason)
        except CandidateKillsWorkersError as error:
            save_candidate(folder, run, error)
            raise
        finally:
            writer.close()
        try:
            result = replace(outcome(run, reason, folder), name=folder.resolve().name, folder=folder)
        except NothingFoundError as error:
            write_whole(folder / NOTHING_FOUND, json_text({"stopped_by": reason, "error": str(error)}))
            raise
        files = result_contents(result)
        clear_result(folder, keep=inner_demonstrations(problem))
        write_files(folder, files)
        if reason != "interrupted":
            tidy(folder)
        return result, files


def tidy(folder: Path) -> None:
    """Remove what only an unfinished run needs.

    Raises:
        RunFolderError: A file cannot be removed.
    """
    checkpoint.remove_states(folder, keep_newest=True)
    remove_files([folder / FAILED, folder / NOTHING_FOUND])


def iterate(
    run: Search, save: Callable[[], None], interrupts: Interrupts, on_progress: Callable[[Progress], None] | None
) -> str:
    """Iterate until a stop rule holds or somebody asks for the end; returns why."""
    saved, newer = -SAVE_EVERY, False  # when a state was saved last, and whether there is a newer one
    while (reason := run.ended_by()) is None:
        if interrupts.requested:
            reason = "interrupted"
            break
        progress, newer = run.advance(), True
        if time.monotonic() >= saved + SAVE_EVERY:
            save()
            saved, newer = time.monotonic(), False
        if on_progress is not None and progress is not None:
            on_progress(progress)
    if newer:
        save()
    return reason


def outcome(run: Search, reason: str, folder: Path) -> Result:
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
    content = {"error": str(error), "dh": dh_content(run.space.table(error.value))}  # type: ignore[arg-type]
    write_whole(folder / FAILED, json_text(content))
