"""What the studio does, as one would type it, and searches as processes of their own."""

from __future__ import annotations

import dataclasses
import math
import os
import shlex
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from armdesign.errors import RunFolderError, counted
from armdesign.experiments.auto_dof.dof_records import holds_auto, run_name
from armdesign.files import read_json, write_whole
from armdesign.runs import checkpoint
from armdesign.runs.folder import RESULT
from armdesign.runs.listing import RunStatus, read_run, read_runs
from armdesign.runs.lock import holder_of
from armdesign.runs.reading import read_problem, read_result
from armdesign.runs.resumable import identity
from armdesign.search.backends.backend import InProcess
from armdesign.search.result import Result
from armdesign.search.search import NothingFoundError, Search
from armdesign.settings.sections import Settings
from armdesign.studio.arms import millimetres

COMPILES = "Compiling the kernels"
"""What a command says that compiles them."""
LOG = "studio.log"
"""What a search that the studio has started says, in its run folder."""


class Command(NamedTuple):
    """A command of armdesign.

    Attributes:
        words: Its words behind ``armdesign``.
        folder: The run folder that it writes.
    """

    words: tuple[str, ...]
    folder: Path

    def __str__(self) -> str:
        return shown(self.words)


def shown(words: Sequence[str | Path]) -> str:
    """A command as one would type it."""
    return shlex.join(["armdesign", *map(str, words)])


def search_command(settings: Settings, take: Path, runs: Path, *, auto: bool = False) -> Command:
    """The search of a take under settings, into a folder that is free; the settings are written beside it.

    One that has been there already gives way to that with the next seed: it would find the same again.

    Args:
        settings: The settings.
        take: The recording.
        runs: The folder that runs are in.
        auto: Whether the number of joints is searched, too.
    """
    stem = f"{take.stem}-{'auto' if auto else f'n{settings.design.dof}'}-seed{settings.search.seed}"
    text = settings.replace({"task": {"recording": None}}).to_toml()
    folder, k = runs / stem, 2
    while folder.exists():
        file = runs / f"{folder.name}.toml"
        if file.is_file() and file.read_text(encoding="utf-8") == text:
            return search_command(
                settings.replace({"search": {"seed": settings.search.seed + 1}}), take, runs, auto=auto
            )
        folder, k = runs / f"{stem}-{k}", k + 1
    file = runs / f"{folder.name}.toml"
    runs.mkdir(parents=True, exist_ok=True)
    write_whole(file, text)
    dof = "auto" if auto else str(settings.design.dof)
    return Command(("search", str(take), f"--dof={dof}", "--config", str(file), "--out", str(folder)), folder)


def begin(command: Command | Path) -> subprocess.Popen[bytes]:
    """Start a search, or go on with one, in a process that outlives this one.

    Args:
        command: The search, or the run folder of one to go on with.
    """
    folder = command if isinstance(command, Path) else command.folder
    words = ("search", "--resume", str(folder)) if isinstance(command, Path) else command.words
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / LOG).open("wb") as log:
            return subprocess.Popen(
                [sys.executable, "-m", "armdesign", *words],
                stdin=subprocess.DEVNULL, stdout=log, stderr=subprocess.STDOUT, start_new_session=True,
            )  # fmt: skip
    except OSError as error:
        raise RunFolderError(f"cannot write to {folder}: {error.strerror}", value=str(folder)) from error


def stop(folder: Path) -> bool:
    """Ask the search in a run folder to end with the best arm so far; whether there was one on this machine."""
    for place in (folder, *folder.glob("n*")):
        words = (holder_of(place) or "").split()
        if len(words) == 4 and words[1].isdecimal() and words[3] == os.uname().nodename:
            os.kill(int(words[1]), signal.SIGINT)
            return True
    return False


def said(folder: Path) -> str:
    """What a search that the studio has started has said; empty where nothing."""
    try:
        return (folder / LOG).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def compiles(folder: Path) -> bool:
    """Whether a search has had to compile kernels."""
    return COMPILES in said(folder)


def last_words(folder: Path) -> str:
    """The sentence that a search ended with where it failed; empty where it did not."""
    lines = said(folder).splitlines()
    return next((line.removeprefix("armdesign: ") for line in lines if line.startswith("armdesign: ")), "")


def known_runs(runs: Path) -> list[RunStatus]:
    """The runs in a folder, newest first; those of a search for the number of joints as one."""
    if not runs.is_dir():
        return []
    found = {}
    for each in read_runs(runs):
        whole = next((place for place in (each.folder, each.folder.parent) if holds_auto(place)), each.folder)
        if "alternatives" not in (whole.name, each.folder.parent.name):
            found[whole] = status(whole)
    return sorted(found.values(), key=lambda run: run.age)


def facts(run: RunStatus) -> str:
    """Joints, load and largest error of a run's arm, as far as they are known."""
    said = [counted(run.dof, "joint")] if run.dof else []
    with suppress(RunFolderError, ValueError, KeyError, TypeError):  # it has not ended, or is damaged
        result = read_json(run.folder / RESULT)
        load, error = result["settings"]["needs"]["payload"], result["verdict"]["hand_error"]["max"]
        said += [f"{load:g} kg", millimetres(error)]
    return ", ".join(said)


def status(folder: Path) -> RunStatus:
    """How far a run is; of a search for the number of joints, the one that is at it, else the best."""
    if not holds_auto(folder) or (folder / RESULT).is_file():
        return read_run(folder)
    inner = [folder / run_name(n) for n in range(1, 11)]
    at_work = [read_run(place) for place in inner if (place / checkpoint.CURRENT).is_file()]
    if not at_work:
        return dataclasses.replace(read_run(folder), state="running" if holder_of(folder) else "stopped")
    if any(map(holder_of, (folder, at_work[-1].folder))):
        return dataclasses.replace(at_work[-1], state="running")
    best = min(reversed(at_work), key=lambda run: math.inf if run.best is None else run.best)
    return dataclasses.replace(best, state="stopped")


def best_so_far(run: RunStatus) -> Result | None:
    """The best arm of a run, whether it has ended or not; None where none was found yet.

    Args:
        run: How far it is.

    Raises:
        RunFolderError: Its files are damaged.
    """
    if run.state in ("finished", "evaluated"):
        return read_result(run.folder)
    state = checkpoint.load_state(run.folder, identity(run.folder))
    if state is None:
        return None
    problem = read_problem(run.folder)
    search = Search(problem, InProcess(problem))
    search.restore(state)
    try:
        result = search.result("interrupted")
    except NothingFoundError:
        return None
    return dataclasses.replace(result, name=run.folder.name, folder=run.folder)
