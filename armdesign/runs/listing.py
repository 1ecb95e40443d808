"""The runs below a folder and their status, which is read from their files; nothing else is kept about them."""

from __future__ import annotations

import contextlib
import os
import re
import time
import tomllib
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from armdesign.errors import RunFolderError
from armdesign.files import read_json
from armdesign.runs.checkpoint import CURRENT, PREVIOUS
from armdesign.runs.folder import NOTHING_FOUND, RESULT, TASK_JSON, settings_file
from armdesign.runs.lock import holder_of
from armdesign.swarm import ALGORITHMS

MARKS = (RESULT, CURRENT, PREVIOUS, TASK_JSON)
"""A folder that holds one of these is a run folder ..."""
WORK = "work.json"
"""... unless this file says that it is a piece of a study that is no search."""


@dataclass(frozen=True)
class RunStatus:
    """How far a run is.

    Attributes:
        folder: The run folder.
        state: finished, interrupted, running, stopped (not finished, and no process works on it), failed (ended
            without a valid arm), evaluated (a given arm, not a search), or broken.
        detail: The process that works on it, or what is broken.
        best: Best robot fitness r so far [m], if there is one.
        iterations: Iterations done, or candidates, whichever the algorithm counts, if known.
        planned: How many of them are planned, if known.
        age: Time since the folder's files last changed [s].
        algorithm: Search algorithm, if known.
        dof: Number of joints n, if known.
        seed: Seed, if known.
    """

    folder: Path
    state: str
    detail: str = ""
    best: float | None = None
    iterations: int | None = None
    planned: int | None = None
    age: float = 0.0
    algorithm: str | None = None
    dof: int | None = None
    seed: int | None = None


def read_runs(root: Path) -> list[RunStatus]:
    """All runs below a folder, itself included, by name; numbers in names count as numbers.

    Hidden folders and links to folders are left out.

    Raises:
        RunFolderError: There is no such folder.
    """
    if not root.is_dir():
        what = "is a file" if root.exists() else "does not exist"
        raise RunFolderError(f"the folder {root} {what}", value=str(root), fix="Name the folder that your runs are in")
    return sorted((read_run(folder) for folder in run_folders(root)), key=lambda run: natural(run.folder))


def run_folders(root: Path) -> Iterator[Path]:
    """Folders at or below root that hold a run."""
    for folder, inner, files in os.walk(root):
        if WORK in files:
            inner.clear()
        elif any(name in files for name in MARKS):
            inner.clear()
            yield Path(folder)
        else:
            inner[:] = [name for name in inner if not name.startswith(".")]


def natural(path: Path) -> list[tuple[int, str]]:
    """Sort key in which seed10 comes after seed9."""
    parts = re.findall(r"[0-9]+|[^0-9]+", str(path))
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


def read_run(folder: Path) -> RunStatus:
    """The status of the run in a folder; a run whose files cannot be read is broken, not an error."""
    blank = RunStatus(folder, "broken", age=age_of(folder))
    try:
        return judge(folder, with_settings(blank))
    except (OSError, ValueError, RunFolderError) as error:
        return replace(blank, detail=str(error))


def judge(folder: Path, run: RunStatus) -> RunStatus:
    """State, best and progress of a run.

    Raises:
        ValueError: Its result cannot be read or is damaged.
    """
    bests = saved_column(folder, "history_best")
    if bests is not None:
        run = replace(run, best=bests[-1] if bests and np.isfinite(bests[-1]) else None)
    holder = holder_of(folder)
    if holder is not None:
        return replace(run, state="running", detail=holder)
    if (folder / RESULT).exists():
        return from_result(read_json(folder / RESULT), run)
    if (folder / NOTHING_FOUND).exists():
        return replace(run, state="failed", detail="nothing found")
    return replace(run, state="stopped")


def from_result(result: dict[str, Any], run: RunStatus) -> RunStatus:
    """State, best and progress of a run with a result.

    Raises:
        ValueError: The result lacks an entry, or one is not what it should be.
    """
    try:
        best = float(result["fitness"])
        if "stopped_by" not in result:
            return replace(run, state="evaluated", best=best, algorithm=None, seed=None, planned=None)
        interrupted = result["stopped_by"] == "interrupted"
        if interrupted and run.iterations is not None:  # the saved state is the newer one
            return replace(run, state="interrupted")
        settings = result["settings"]["search"]
        iterations = ALGORITHMS[settings["algorithm"]].units_done(int(result["evaluations"]), settings)
    except (KeyError, TypeError, ValueError, ZeroDivisionError) as error:
        raise ValueError(f"{RESULT} is damaged: {error!r}") from error
    return replace(run, state="interrupted" if interrupted else "finished", best=best, iterations=iterations)


def with_settings(run: RunStatus) -> RunStatus:
    """The run with what its settings say, and how far its saved state is.

    Raises:
        ValueError: They are missing or damaged; the message says so.
    """
    path = settings_file(run.folder)
    try:
        tables = tomllib.loads(path.read_text(encoding="utf-8"))
        search, dof = tables["search"], int(tables["design"]["dof"])
        algorithm, seed = str(search["algorithm"]), int(search["seed"])
        planned = int(search[ALGORITHMS[algorithm].length])
        evaluations = saved_column(run.folder, "history_evaluations")
        done = None
        if evaluations is not None:
            done = ALGORITHMS[algorithm].units_done(int(evaluations[-1]) if evaluations else 0, search)
    except OSError as error:
        raise ValueError(f"{path.name} cannot be read: {error.strerror}") from error
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{path.name} is damaged: {error}") from error
    return replace(run, algorithm=algorithm, dof=dof, seed=seed, planned=planned, iterations=done)


def saved_column(folder: Path, column: str) -> list[float] | None:
    """A column of the saved state; None where there is no state that can be read."""
    for name in (CURRENT, PREVIOUS):
        try:
            with np.load(folder / name, allow_pickle=False) as archive:
                return [float(value) for value in archive[column]]
        except (OSError, ValueError, KeyError, zipfile.BadZipFile):
            continue
    return None


def age_of(folder: Path) -> float:
    """Time since a file in the folder last changed [s]."""
    times = [folder.stat().st_mtime]
    for entry in os.scandir(folder):
        if entry.name != ".lock":
            with contextlib.suppress(OSError):
                times.append(entry.stat().st_mtime)
    return max(0.0, time.time() - max(times))


def numbered_results(folder: Path, prefix: str = "") -> list[Path]:
    """The result files of the run folders in a folder that are called by a number, in their order.

    Args:
        folder: The folder, such as that of a run's alternatives.
        prefix: What comes before the numbers, such as ``n``.
    """
    found = [(path.parent.name.removeprefix(prefix), path) for path in folder.glob(f"{prefix}[0-9]*/{RESULT}")]
    return [path for _, path in sorted((int(number), path) for number, path in found if number.isdecimal())]
