"""A finished run, read back from its folder: the arm, its path and the task, as whatever leaves the tool needs them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from armdesign._types import Array

from armdesign.errors import RunFolderError
from armdesign.search.evaluation import Evaluation
from armdesign.fitness.constraints import joint_limits
from armdesign.fitness.block import BlockEvaluator
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.dh_files import read_design
from armdesign.runs.folder import HOLDOUTS, OTHERS, other_folders
from armdesign.runs.resumable import open_run
from armdesign.search.prepare import Prepared



@dataclass(frozen=True, eq=False)
class FinishedRun:
    """An arm that does a task.

    Attributes:
        name: What to call it, the folder's name; for people, not safe for XML.
        prepared: Task and settings.
        evaluation: The arm (``evaluation.table``) with its path (``evaluation.path``: q, g, area, distance ...).
        history: Columns of history.csv, each of shape (iterations,); empty for an arm that was not searched.
        content: result.json, for what is only told, not computed.
        folder: Where it was read; None for a result that is still in memory.
    """

    name: str
    prepared: Prepared
    evaluation: Evaluation
    history: dict[str, Array]
    content: dict[str, Any]
    folder: Path | None = None

    @property
    def table(self) -> DHTable:
        """The arm."""
        return self.evaluation.table

    @property
    def limits(self) -> Array:
        """Joint limits of the search, shape (n, 2) [rad]."""
        return joint_limits(self.prepared.settings.design)


def read_finished(folder: str | Path) -> FinishedRun:
    """Read a run folder that has a result, also that of an interrupted search.

    The errors along the path come from the joint angles in trajectory.csv; the angles are not solved again.

    Args:
        folder: The run folder.

    Raises:
        RunFolderError: There is no result, or a file is missing, damaged or does not fit the others.
    """
    place = Path(folder)
    content, prepared = read_result(place), open_run(place)
    evaluation = read_evaluation(place, prepared, content)
    if prepared.others:
        told = listed(content, "demonstrations", 1 + len(prepared.others), place)
        first = Evaluation(evaluation.table, *figures(told[0], place), evaluation.path)
        others = [read_evaluation(*each) for each in other_runs(place, OTHERS, prepared.others)]
        evaluation = replace(evaluation, demonstrations=(first, *others))
    if prepared.holdouts:
        told = listed(content, "holdout", len(prepared.holdouts), place)
        runs = zip(other_runs(place, HOLDOUTS, prepared.holdouts), told, strict=True)
        holdouts = tuple(read_holdout(run, entry, evaluation.first) for run, entry in runs)
        evaluation = replace(evaluation, holdouts=holdouts)
    return FinishedRun(place.resolve().name, prepared, evaluation, read_history(place / "history.csv"), content, place)


def read_evaluation(place: Path, prepared: Prepared, content: dict[str, Any]) -> Evaluation:
    """What an arm does on the task of a run folder, out of its trajectory and its result.json.

    Raises:
        RunFolderError: A file is missing, damaged or does not fit the others.
    """
    table = read_design(place / "result.json")
    q = read_trajectory(place / "trajectory.csv", table.dof)
    if len(q) != len(prepared.task.time):
        raise RunFolderError(
            f"{place / 'trajectory.csv'} has {len(q)} frames, the task has {len(prepared.task.time)}",
            value=len(q),
            fix="Search again, or resume the run",
        )
    mount = rotation(content.get("mount", np.eye(3).tolist()), place)
    path = BlockEvaluator(prepared.problem(), block=1).replay(table, q, mount)
    tied = prepared.settings.fitness.tie_hand
    miss = path.distance[0, -1] if tied else np.linalg.norm(table.frames(q[0])[-1, :3, 3] - prepared.task.P[0, -1])
    path = replace(path, start_error=float(miss))
    return Evaluation(table, *figures(content, place), path)


def other_runs(place: Path, pattern: str, others: Sequence[Prepared]) -> list[tuple[Path, Prepared, dict[str, Any]]]:
    """Folder, task and result.json of further demonstrations; a holdout that is missed has no result.

    Raises:
        RunFolderError: One is missing or damaged.
    """
    runs = []
    for folder, prepared in zip(other_folders(place, pattern), others, strict=True):
        missed = pattern == HOLDOUTS and not (folder / "result.json").is_file()
        runs.append((folder, prepared, {} if missed else read_result(folder)))
    return runs


def read_holdout(run: tuple[Path, Prepared, dict[str, Any]], told: dict[str, Any], first: Evaluation) -> Evaluation:
    """What an arm does on a demonstration that was held out.

    Args:
        run: See ``other_runs``.
        told: What the result.json above says of it.
        first: What the arm does on the first demonstration.

    Raises:
        RunFolderError: It is damaged.
    """
    if run[-1]:
        return read_evaluation(*run)
    place, missed = run[0], told.get("missed")
    if not isinstance(missed, dict):
        raise RunFolderError(f"{place / 'result.json'} is missing", value=str(place), fix="Search again")
    frame, distance = int(number(missed, "frame", place)), number(missed, "distance", place)
    rows = {name: values[:0] for name, values in vars(first.path).items() if name not in ("mount", "start_error")}
    path = replace(first.path, **rows, start_error=distance)
    return Evaluation(first.table, np.inf, np.inf, np.inf, path, missed=(frame, distance))


def listed(content: dict[str, Any], name: str, count: int, place: Path) -> list[dict[str, Any]]:
    """A list of tables in result.json.

    Raises:
        RunFolderError: It is missing, or has not as many entries as there are demonstrations.
    """
    value = content.get(name)
    if not isinstance(value, list) or len(value) != count or not all(isinstance(entry, dict) for entry in value):
        what = f"'{name}' does not tell of {count} of them"
        raise RunFolderError(f"{place / 'result.json'} is damaged: {what}", value=value, fix="Search again")
    return value


def figures(content: dict[str, Any], place: Path) -> tuple[float, float, float]:
    """r, f and E out of a table of result.json.

    Raises:
        RunFolderError: One is missing or no number.
    """
    r, f, E = (number(content, name, place) for name in ("fitness", "path_fitness", "area"))
    return r, f, E


def read_result(folder: Path) -> dict[str, Any]:
    """result.json of a run folder.

    Raises:
        RunFolderError: It is missing or damaged.
    """
    path = folder / "result.json"
    if not folder.is_dir():
        raise RunFolderError(f"there is no run folder {folder}", value=str(folder), fix="Check the path")
    if not path.is_file():
        fix = f"Finish the search first: armdesign search --resume {folder}"
        raise RunFolderError(f"{folder} holds no result: result.json is missing", value=str(folder), fix=fix)
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise RunFolderError(f"{path} is damaged: {error}", value=str(path), fix="Search again") from error
    if not isinstance(content, dict):
        raise RunFolderError(f"{path} is damaged: it holds no table", value=str(path), fix="Search again")
    return content


def rotation(value: object, folder: Path) -> Array:
    """The mount of result.json, shape (3, 3).

    Raises:
        RunFolderError: It is no rotation matrix.
    """
    try:
        matrix = np.array(value, dtype=float).reshape(3, 3)
    except (TypeError, ValueError) as error:
        raise RunFolderError(f"{folder / 'result.json'} is damaged: 'mount' is {value!r}", value=value) from error
    if not np.abs(matrix @ matrix.T - np.eye(3)).max() < 1e-6:
        raise RunFolderError(f"{folder / 'result.json'} is damaged: 'mount' is no rotation", value=value)
    return matrix


def number(content: dict[str, Any], name: str, folder: Path) -> float:
    """A figure of result.json.

    Raises:
        RunFolderError: It is missing or no number.
    """
    value = content.get(name)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise RunFolderError(f"{folder / 'result.json'} is damaged: '{name}' is {value!r}", value=value)
    return float(value)


def read_table(path: Path) -> tuple[list[str], Array]:
    """Column names and numbers, shape (rows, columns), of one of our own CSV files.

    Raises:
        RunFolderError: The file is missing or damaged.
    """
    try:
        header, *lines = path.read_text(encoding="utf-8").splitlines() or [""]
        if not lines:
            raise ValueError("there are no rows")
        return header.split(","), np.loadtxt(lines, delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        raise RunFolderError(f"{path} is missing or damaged: {error}", value=str(path), fix="Search again") from error


def read_trajectory(path: Path, dof: int) -> Array:
    """Joint angles of trajectory.csv, shape (T, n) [rad].

    Raises:
        RunFolderError: The file is missing or damaged.
    """
    _, values = read_table(path)
    if values.shape[1] != 1 + dof:
        raise RunFolderError(f"{path} is damaged: it has {values.shape[1]} columns", allowed=1 + dof)
    return values[:, 1:]


def read_history(path: Path) -> dict[str, Array]:
    """Columns of history.csv by name; nothing where there is none.

    Raises:
        RunFolderError: The file is damaged.
    """
    if not path.is_file():
        return {}
    names, values = read_table(path)
    if len(names) != values.shape[1]:
        raise RunFolderError(f"{path} is damaged: {len(names)} names for {values.shape[1]} columns", value=names)
    return dict(zip(names, values.T, strict=True))
