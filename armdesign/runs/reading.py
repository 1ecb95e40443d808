"""A run folder read back: the demonstrations and the settings, the arm with its path, and how the search went."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.cell.obstacle_record import read_obstacle_record
from armdesign.cell.obstacles import Obstacles
from armdesign.demonstration import read_plain_csv, task_from_recording
from armdesign.demonstration.provenance import read_task_json
from armdesign.errors import RunFolderError
from armdesign.feasibility.verdict import Spread, Verdict
from armdesign.feasibility.violations import Gap
from armdesign.files import read_json
from armdesign.fitness.block import BlockEvaluator, PathResult
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.dh_files import base_pose_of, read_design
from armdesign.runs.folder import (
    DEMONSTRATIONS,
    HISTORY,
    HOLDOUTS,
    OBSTACLES,
    RESULT,
    SETTINGS,
    TASK,
    TASK_JSON,
    TRAJECTORY,
    inner_folders,
    inner_names,
    settings_file,
)
from armdesign.search.design_problem import Demonstration, DesignProblem
from armdesign.search.evaluation import Evaluation, PathEvaluation
from armdesign.search.result import Result, SearchFacts
from armdesign.settings import read_settings
from armdesign.swarm import History
from armdesign.swarm.agreement import Agreement


def read_result(folder: str | Path) -> Result:
    """Read a run folder that has a result, also that of an interrupted search.

    The errors along the path come from the joint angles in trajectory.csv; the angles are not solved again.

    Args:
        folder: The run folder.

    Raises:
        RunFolderError: There is no result, or a file is missing, damaged or does not fit the others.
    """
    place = Path(folder)
    content, problem = result_content(place), read_problem(place)
    table = read_design(place / RESULT)
    if problem.space.sites:
        problem = problem.placed(base_pose_of(content.get("base_pose"), place / RESULT))
    first = read_path(place, problem.first, content, table)
    demonstrations, holdouts = [first], []
    if len(problem.demonstrations) > 1:
        entries = listed(content, "demonstrations", len(problem.demonstrations), place)
        demonstrations[0] = PathEvaluation(*figures(entries[0], place), first.path)
        folders = inner_folders(place, DEMONSTRATIONS)
        for inner, demonstration in zip(folders, problem.demonstrations[1:], strict=True):
            demonstrations.append(read_path(inner, demonstration, result_content(inner), table))
    if problem.holdouts:
        entries = listed(content, "holdout", len(problem.holdouts), place)
        folders = inner_folders(place, HOLDOUTS)
        for inner, demonstration, entry in zip(folders, problem.holdouts, entries, strict=True):
            if (inner / RESULT).is_file():
                holdouts.append(read_path(inner, demonstration, result_content(inner), table))
            else:
                holdouts.append(missed_holdout(inner, entry, first.path))
    evaluation = Evaluation(table, *figures(content, place), tuple(demonstrations), tuple(holdouts))
    facts = read_facts(content, place) if "stopped_by" in content else None
    history = read_history(place / HISTORY) if (place / HISTORY).is_file() else None
    version = str(content.get("armdesign_version", ""))
    verdict = read_verdict(content, place)
    slides = read_slides(content, place, table.dof)
    return Result(problem, evaluation, history, facts, None, place.resolve().name, version, place, verdict, slides)


def read_problem(folder: Path) -> DesignProblem:
    """Demonstrations and settings of a run folder, to the last bit as they were when it was started.

    Raises:
        RunFolderError: The folder holds no run, or a file is missing or damaged.
    """
    first = read_demonstration(folder)
    seen = read_inner(folder, DEMONSTRATIONS, first.settings.task.more_recordings)
    unseen = read_inner(folder, HOLDOUTS, first.settings.task.holdouts)
    return DesignProblem(first.settings, (first, *seen), unseen)


def read_demonstration(folder: Path) -> Demonstration:
    """The first demonstration of a run folder.

    Raises:
        RunFolderError: The folder holds no run.
    """
    path = settings_file(folder)
    if not path.is_file():
        raise RunFolderError(f"{folder} holds no run to resume: {SETTINGS} is missing", value=str(folder))
    try:
        record = read_task_json(folder / TASK_JSON)
    except RunFolderError as error:
        raise RunFolderError(f"{folder} holds no run to resume: {error}", value=str(folder)) from error
    recording = read_plain_csv(folder / TASK)
    task = task_from_recording(recording, record.base, origin=record.origin, shoulder=record.shoulder)
    settings = read_settings(path)
    if "body" not in tomllib.loads(path.read_text(encoding="utf-8-sig")):  # written when arms were but lines
        settings = settings.replace({"body": {"kind": "thin"}})
    around = folder / OBSTACLES
    obstacles = read_obstacle_record(around) if around.is_file() else Obstacles()
    return Demonstration(settings, task, record.steps, record.provenance, obstacles=obstacles)


def read_inner(folder: Path, pattern: str, recordings: Sequence[str] | None) -> tuple[Demonstration, ...]:
    """Further demonstrations of a run folder.

    Args:
        folder: The run folder.
        pattern: DEMONSTRATIONS or HOLDOUTS.
        recordings: Their files, according to the settings.

    Raises:
        RunFolderError: One is missing or damaged.
    """
    found, names = inner_folders(folder, pattern), inner_names(pattern, len(recordings or ()))
    if len(found) < len(names):
        missing = folder / names[len(found)]
        raise RunFolderError(f"{missing} is missing or damaged", value=str(missing), fix="Search again")
    return tuple(read_demonstration(place) for place in found)


def read_path(place: Path, demonstration: Demonstration, content: dict[str, Any], table: DHTable) -> PathEvaluation:
    """What an arm does on the task of a run folder, out of its trajectory and its result.json.

    Args:
        place: The run folder.
        demonstration: Its task.
        content: Its result.json.
        table: The arm.

    Raises:
        RunFolderError: A file is missing, damaged or does not fit the others.
    """
    q = read_trajectory(place / TRAJECTORY, table.dof)
    task = demonstration.task
    if len(q) != len(task.time):
        raise RunFolderError(
            f"{place / TRAJECTORY} has {len(q)} frames, the task has {len(task.time)}",
            value=len(q),
            fix="Search again, or resume the run",
        )
    mount = rotation(content.get("mount", np.eye(3).tolist()), place)
    path = BlockEvaluator(demonstration.path_problem, block=1).replay(table, q, mount)
    tied = demonstration.settings.fitness.tie_hand
    miss = path.distance[0, -1] if tied else np.linalg.norm(table.frames(q[0])[-1, :3, 3] - task.P[0, -1])
    return PathEvaluation(*figures(content, place), replace(path, start_error=float(miss)))


def missed_holdout(place: Path, entry: dict[str, Any], first: PathResult) -> PathEvaluation:
    """What an arm does on a held-out demonstration whose hand it does not reach: a path without frames.

    Args:
        place: The demonstration's run folder.
        entry: What the result.json of the whole run says of it.
        first: The arm's path on the first demonstration.

    Raises:
        RunFolderError: The entry is damaged.
    """
    missed = entry.get("missed")
    if not isinstance(missed, dict):
        raise RunFolderError(f"{place / RESULT} is missing", value=str(place), fix="Search again")
    frame, distance = int(number(missed, "frame", place)), number(missed, "distance", place)
    rows = {name: values[:0] for name, values in vars(first).items() if name not in ("mount", "start_error")}
    path = replace(first, **rows, start_error=distance)
    return PathEvaluation(np.inf, np.inf, np.inf, path, (frame, distance))


def read_facts(content: dict[str, Any], place: Path) -> SearchFacts:
    """How the search of a run folder went.

    Raises:
        RunFolderError: An entry of result.json is missing or of the wrong type; the message names it.
    """
    kinds = {"algorithm": str, "rejected": dict, "stopped_by": str}
    values: dict[str, Any] = {}
    for entry in fields(SearchFacts):
        if entry.name in kinds:
            value = content.get(entry.name)
            if not isinstance(value, kinds[entry.name]):
                raise damaged(place, entry.name, content)
            values[entry.name] = value
        elif entry.name != "agreement":
            values[entry.name] = number(content, entry.name, place)
    for name in ("seed", "evaluations", "converged_at"):
        values[name] = int(values[name])
    values["rejected"] = {str(name): count for name, count in values["rejected"].items() if isinstance(count, int)}
    found = content.get("agreement")  # None in one that was written before there was any
    if found is not None:
        if not isinstance(found, dict):
            raise damaged(place, "agreement", content)
        counts = (int(number(found, name, place)) for name in ("agreeing", "beginnings", "descents", "once"))
        agreeing, beginnings, *others = counts
        values["agreement"] = Agreement(agreeing, beginnings, number(found, "chance", place), *others)
    return SearchFacts(**values)


def read_verdict(content: dict[str, Any], place: Path) -> Verdict | None:
    """The verdict of result.json; None in one that was written before there were any.

    Raises:
        RunFolderError: It is damaged.
    """
    entries = content.get("verdict")
    if entries is None:
        return None
    try:
        made = dict(entries)
        for name in ("hand_error", "hand_angle"):
            made[name] = None if made[name] is None else Spread(**made[name])
        for name in ("self_clearance", "obstacle_clearance"):
            gap = made[name]
            made[name] = None if gap is None else Gap(**(gap | {"bodies": tuple(gap["bodies"])}))
        for name in ("peak_speed", "peak_torque", "reasons"):
            made[name] = tuple(made[name])
        return Verdict(**made)
    except (TypeError, ValueError, KeyError) as error:
        raise damaged(place, "verdict", content) from error


def read_slides(content: dict[str, Any], place: Path, dof: int) -> tuple[float, ...] | None:
    """Where the joint modules sit, out of result.json; None in one that was written before they could slide.

    Raises:
        RunFolderError: It is damaged.
    """
    values = content.get("slides")
    if values is None:
        return None
    numbers = isinstance(values, list) and all(isinstance(x, int | float) and np.isfinite(x) for x in values)
    if not numbers or len(values) != dof:
        raise damaged(place, "slides", content)
    return tuple(map(float, values))


def listed(content: dict[str, Any], name: str, count: int, place: Path) -> list[dict[str, Any]]:
    """A list of tables in result.json.

    Raises:
        RunFolderError: It is missing, or has not as many entries as there are demonstrations.
    """
    value = content.get(name)
    if not isinstance(value, list) or len(value) != count or not all(isinstance(entry, dict) for entry in value):
        what = f"'{name}' has not {count} entries"
        raise RunFolderError(f"{place / RESULT} is damaged: {what}", value=value, fix="Search again")
    return value


def figures(content: dict[str, Any], place: Path) -> tuple[float, float, float]:
    """r, f and E out of a table of result.json.

    Raises:
        RunFolderError: One is missing or no number.
    """
    r, f, E = (number(content, name, place) for name in ("fitness", "path_fitness", "area"))
    return r, f, E


def result_content(folder: Path) -> dict[str, Any]:
    """result.json of a run folder.

    Raises:
        RunFolderError: It is missing or damaged.
    """
    if not folder.is_dir():
        raise RunFolderError(f"there is no run folder {folder}", value=str(folder), fix="Check the path")
    if not (folder / RESULT).is_file():
        fix = f"Finish the search first: armdesign search --resume {folder}"
        raise RunFolderError(f"{folder} holds no result: {RESULT} is missing", value=str(folder), fix=fix)
    return read_json(folder / RESULT, "Search again")


def rotation(value: object, folder: Path) -> Array:
    """The mount of result.json, shape (3, 3).

    Raises:
        RunFolderError: It is no rotation matrix.
    """
    try:
        matrix = np.array(value, dtype=float).reshape(3, 3)
    except (TypeError, ValueError) as error:
        raise RunFolderError(f"{folder / RESULT} is damaged: 'mount' is {value!r}", value=value) from error
    if not np.abs(matrix @ matrix.T - np.eye(3)).max() < 1e-6:
        raise RunFolderError(f"{folder / RESULT} is damaged: 'mount' is no rotation", value=value)
    return matrix


def number(content: dict[str, Any], name: str, folder: Path) -> float:
    """A figure of result.json.

    Raises:
        RunFolderError: It is missing or no number.
    """
    value = content.get(name)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not np.isfinite(value):
        raise damaged(folder, name, content)
    return float(value)


def damaged(folder: Path, name: str, content: dict[str, Any]) -> RunFolderError:
    """The error for an entry of result.json that is missing or of the wrong type."""
    what = f"is {content[name]!r}" if name in content else "is missing"
    message = f"{folder / RESULT} is damaged: '{name}' {what}"
    return RunFolderError(message, value=content.get(name), fix="Search again")


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


def read_history(path: Path) -> History:
    """What happened in every iteration, out of history.csv.

    Raises:
        RunFolderError: The file is missing or damaged.
    """
    names, values = read_table(path)
    if len(names) != values.shape[1]:
        raise RunFolderError(f"{path} is damaged: {len(names)} names for {values.shape[1]} columns", value=names)
    columns = dict(zip(names, values.T, strict=True))
    for entry in fields(History):
        if entry.name not in columns:
            what = f"the column '{entry.name}' is missing"
            raise RunFolderError(f"{path} is damaged: {what}", value=names, fix="Search again")
    counts = (columns[name].astype(np.int64) for name in ("valid", "evaluations"))
    return History(columns["best"], columns["mean"], *counts)
