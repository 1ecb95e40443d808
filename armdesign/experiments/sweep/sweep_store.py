"""What a sweep keeps of its own: `sweep.toml` with what was asked, and each recording's task, ready for new runs."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from armdesign.demonstration import Task, task_recording
from armdesign.errors import ArmDesignError, RunFolderError, SettingsError
from armdesign.experiments.sweep.sweep_plan import Sweep, Tasks
from armdesign.files import write_whole
from armdesign.runs.folder import settings_file
from armdesign.runs.reading import read_problem
from armdesign.runs.resumable import start_run
from armdesign.settings.kinds import toml_value
from armdesign.settings.sections import Settings

SWEEP, TASKS = "sweep.toml", ".tasks"
LISTS = tuple(entry.name for entry in fields(Sweep) if entry.name != "settings")
NEW_FOLDER = "Name another folder with --out"
KINDS = {"auto.json": "a search for the number of joints", "sweep.toml": "a sweep", "study.json": "a study"}
"""What holds runs in folders of their own, by the file it is known by."""


def settle(folder: Path, sweep: Sweep, tasks: Tasks) -> None:
    """Write down what was asked, or extend the sweep that is there.

    Args:
        folder: The sweep's folder; it exists.
        sweep: What is asked.
        tasks: Its tasks.

    Raises:
        RunFolderError: The folder cannot be written, holds something else, or the sweep in it is damaged.
        SettingsError: It holds a sweep with other settings, or one with runs that are not asked for now.
    """
    refuse_other_kinds(folder, "a sweep")
    if holds_sweep(folder):
        check_extension(folder, sweep, tasks)
    keep_tasks(folder, tasks)
    lines = ["# What was asked of this sweep; to go on: armdesign sweep --resume FOLDER", "[sweep]"]
    lines += [f"{name} = {toml_value(getattr(sweep, name))}" for name in LISTS]
    write_whole(folder / SWEEP, "\n".join(lines) + "\n\n" + sweep.settings.to_toml())


def refuse_other_kinds(folder: Path, own: str | None = None) -> None:
    """Turn away a folder of runs of another kind, whose files would be mixed.

    Args:
        folder: The folder.
        own: The kind that it may be; None for a single run, which goes into none of them.

    Raises:
        RunFolderError: It holds another sweep, study or search for the number of joints.
    """
    for name, kind in KINDS.items():
        if kind != own and os.path.isfile(folder / name):  # False for names too long, too
            wanted = "" if own is None else f", not {own}"
            raise RunFolderError(f"{folder} holds {kind}{wanted}", value=str(folder), fix=NEW_FOLDER)


def keep_tasks(folder: Path, tasks: Tasks) -> None:
    """Write down the tasks that are not there yet.

    Raises:
        RunFolderError: The folder cannot be written.
    """
    for (path, n), task in tasks.items():
        place = task_folder(folder, path, n)
        if not settings_file(place).exists():
            place.mkdir(parents=True, exist_ok=True)
            start_run(place, task)


def read_sweep(folder: Path) -> tuple[Sweep, Tasks]:
    """What was asked of the sweep in a folder, with the tasks, to the last bit as they were.

    Raises:
        RunFolderError: The folder holds no sweep, or it is damaged.
    """
    try:
        tables = tomllib.loads((folder / SWEEP).read_text(encoding="utf-8"))
        lists = {name: tuple(tables["sweep"][name]) for name in LISTS}
        settings = Settings().replace({name: table for name, table in tables.items() if name != "sweep"})
    except FileNotFoundError as error:
        raise RunFolderError(f"{folder} holds no sweep: {SWEEP} is missing", value=str(folder)) from error
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, KeyError, TypeError, ArmDesignError) as error:
        raise RunFolderError(f"{folder / SWEEP} cannot be read: {error}", value=str(folder)) from error
    sweep = Sweep(settings, **lists)
    return sweep, {
        (path, n): read_problem(task_folder(folder, path, n)) for path in sweep.recordings for n in sweep.dof
    }


def holds_sweep(folder: Path) -> bool:
    """Whether there is a sweep in a folder."""
    return (folder / SWEEP).exists()


def task_folder(folder: Path, recording: str, n: int) -> Path:
    """Where a sweep keeps the task of a recording for n joints."""
    return folder / TASKS / f"{Path(recording).stem}-n{n}"


def check_extension(folder: Path, sweep: Sweep, tasks: Tasks) -> None:
    """Refuse what would leave the sweep in the folder with runs of different kinds or without rows.

    Raises:
        SettingsError: Other settings, another task, or a run that is there is not asked for.
    """
    earlier, known = read_sweep(folder)
    differing = differences(earlier.settings.to_dict(), sweep.settings.to_dict())
    if differing:
        raise SettingsError(
            f"the sweep in {folder} has other settings: {'; '.join(differing)}", value=differing, fix=NEW_FOLDER
        )
    refuse_fewer(f"the sweep in {folder}", folder, {n: (getattr(earlier, n), getattr(sweep, n)) for n in LISTS})
    for (path, n), task in known.items():
        if not same_task(task.task, tasks[path, n].task):
            raise SettingsError(
                f"the recording {path} is not what it was when the sweep in {folder} began", value=path, fix=NEW_FOLDER
            )


def refuse_fewer(what: str, folder: Path, lists: Mapping[str, tuple[Sequence[Any], Sequence[Any]]]) -> None:
    """Refuse lists that leave out what is there.

    Args:
        what: The sweep or study, for the message.
        folder: Where it is.
        lists: By name what is there, and what is asked for now.

    Raises:
        SettingsError: Something there is not asked for.
    """
    for name, (there, here) in lists.items():
        absent = [entry for entry in there if entry not in here]
        if absent:
            raise SettingsError(
                f"{what} also has {name.replace('_', ' ')} {', '.join(map(str, absent))}",
                value=absent,
                fix=f"Ask for these as well, or name another folder with --out; --resume {folder} goes on as it is",
            )


def differences(before: dict[str, dict[str, Any]], now: dict[str, dict[str, Any]]) -> list[str]:
    """Entries with different values, each in words."""
    return [
        f"{title}.{name} is {there.get(name, 'not set')} there and {here.get(name, 'not set')} here"
        for title, here in now.items()
        for there in [before[title]]
        for name in dict.fromkeys([*there, *here])
        if there.get(name) != here.get(name)
    ]


def same_task(a: Task, b: Task) -> bool:
    """Whether two tasks are equal to the last bit."""
    one, other = task_recording(a), task_recording(b)
    if not np.array_equal(one.time, other.time):
        return False
    pairs = ((one.points, other.points), (one.orientations, other.orientations))
    return all(list(x) == list(y) and all(np.array_equal(x[name], y[name]) for name in x) for x, y in pairs)
