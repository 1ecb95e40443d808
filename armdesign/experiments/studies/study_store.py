"""What a study keeps of its own: `study.json` with the request, and its tasks, ready for new runs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from armdesign._version import __version__
from armdesign.demonstration.provenance import as_json
from armdesign.errors import ArmDesignError, RunFolderError, SettingsError, resume_command
from armdesign.experiments.studies.study_plan import StudyRequest, task_name
from armdesign.experiments.sweep.sweep_plan import Tasks
from armdesign.experiments.sweep.sweep_store import (
    NEW_FOLDER,
    differences,
    keep_tasks,
    refuse_fewer,
    refuse_other_kinds,
    same_task,
    task_folder,
)
from armdesign.files import write_whole
from armdesign.runs.reading import read_problem

STUDY = "study.json"


def settle_study(folder: Path, request: StudyRequest, tasks: Tasks) -> None:
    """Write down the request, or extend the study that is there.

    Raises:
        RunFolderError: The folder cannot be written, holds something else, or the study in it is damaged.
        SettingsError: It holds another study, one with other settings, or one with runs that are not asked for now.
    """
    refuse_other_kinds(folder, "a study")
    if (folder / STUDY).exists():
        check_study(folder, request, tasks)
    keep_tasks(folder, tasks)
    content = {"armdesign_version": __version__, **asdict(request)}
    write_whole(folder / STUDY, json.dumps(as_json(content), indent=2, allow_nan=False) + "\n")


def read_request(folder: Path) -> StudyRequest:
    """The request of the study in a folder.

    Raises:
        RunFolderError: The folder holds no study, or it is damaged.
    """
    try:
        content = json.loads((folder / STUDY).read_text(encoding="utf-8"))
        names = StudyRequest.__dataclass_fields__
        entries = {name: content[name] for name in names}
        entries["tasks"], entries["dof"] = tuple(entries["tasks"]), tuple(entries["dof"])
        entries["options"] = {name: frozen(value) for name, value in entries["options"].items()}
    except FileNotFoundError as error:
        fix = "Name the folder that the study named at its end, such as runs/study-temporal"
        raise RunFolderError(f"{folder} holds no study: {STUDY} is missing", value=str(folder), fix=fix) from error
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise RunFolderError(f"{folder / STUDY} cannot be read: {error!r}", value=str(folder)) from error
    return StudyRequest(**entries)


def read_study_folder(folder: Path, name: str | None = None) -> tuple[StudyRequest, Tasks]:
    """The request of the study in a folder, with the tasks, to the last bit as they were.

    Args:
        folder: The study's folder.
        name: Name that the study has to have, if it matters.

    Raises:
        RunFolderError: The folder holds no study, or it is damaged.
        SettingsError: It holds another one.
    """
    request = read_request(folder)
    if name is not None and request.study != name:
        fix = f"Go on with: {resume_command(f'study {request.study}', folder)}"
        raise SettingsError(f"{folder} holds the study '{request.study}', not '{name}'", value=name, fix=fix)
    try:
        tasks = {(key, n): read_problem(task_folder(folder, key, n)) for key in request.tasks for n in request.dof}
    except ArmDesignError as error:
        raise RunFolderError(f"the study in {folder} is damaged: {error}", value=str(folder)) from error
    return request, tasks


def check_study(folder: Path, request: StudyRequest, tasks: Tasks) -> None:
    """Refuse what would leave the folder with runs of different kinds, or with runs that are not asked for.

    Raises:
        SettingsError: Another study, other settings, another task, or a run that is there is not asked for.
    """
    earlier, known = read_study_folder(folder)
    if earlier.study != request.study:
        raise SettingsError(f"{folder} holds the study '{earlier.study}'", value=request.study, fix=NEW_FOLDER)
    differing = changed(earlier, request)
    for key, n in known.keys() & tasks.keys():
        there, here = known[key, n], tasks[key, n]
        words = differences(there.settings.to_dict(), here.settings.to_dict())
        differing += [f"{task_name(key)}: {entry}" for entry in words if f"{task_name(key)}: {entry}" not in differing]
        if not same_task(there.task, here.task):
            raise SettingsError(f"{key} is not what it was when the study in {folder} began", value=key, fix=NEW_FOLDER)
    if differing:
        raise SettingsError(
            f"the study in {folder} has other settings: {'; '.join(differing)}", value=differing, fix=NEW_FOLDER
        )
    lists: dict[str, tuple[Sequence[Any], Sequence[Any]]] = {
        "tasks": (earlier.tasks, request.tasks),
        "dof": (earlier.dof, request.dof),
        "repetitions": (range(1, earlier.reps + 1), range(1, request.reps + 1)),
    }
    lists |= {name: (old, request.options[name]) for name, old in earlier.options.items() if isinstance(old, tuple)}
    refuse_fewer(f"the study in {folder}", folder, lists)


def changed(earlier: StudyRequest, request: StudyRequest) -> list[str]:
    """Settings of a study, its lists aside, with different values, each in words."""
    there = {"seed": earlier.seed, **earlier.options}
    here = {"seed": request.seed, **request.options}
    return [
        f"{name} is {there.get(name, 'not set')} there and {here.get(name, 'not set')} here"
        for name in dict.fromkeys([*there, *here])
        if there.get(name) != here.get(name)
        and not (isinstance(there.get(name), tuple) and isinstance(here.get(name), tuple))
    ]


def frozen(value: Any) -> Any:  # noqa: ANN401 (a JSON value)
    """A JSON value with lists as tuples."""
    return tuple(frozen(entry) for entry in value) if isinstance(value, (list, tuple)) else value
