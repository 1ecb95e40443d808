"""The run folder: what a search or an evaluation leaves on disk, every file whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import asdict, dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np

from armdesign._version import __version__
from armdesign.runs import alternatives
from armdesign.demonstration import task_recording, write_plain_csv
from armdesign.errors import RunFolderError
from armdesign.search.evaluation import Evaluation
from armdesign.files import write_whole
from armdesign.kinematics.dh import DHTable
from armdesign.demonstration.provenance import Source, write_task_json
from armdesign.search.search import SearchResult
from armdesign.search.prepare import Prepared
from armdesign.swarm import History

SCHEMA_VERSION = 1
STUDY, TASK, TASK_JSON = "study.toml", "task.csv", "task.json"
OTHERS, HOLDOUTS = "demonstration_*", "holdout_*"
"""Folders inside a run folder: of further demonstrations, from demonstration_2 on, and of those held out, from
holdout_1 on. Each is a run folder itself, of the same arm."""

VIEWS = ("preview.html", "report.html")
"""What views.write_views adds to a run."""


@dataclass(frozen=True)
class Written:
    """What was written where.

    Attributes:
        folder: The run folder.
        files: Names of the files in it, in the order they were written.
    """

    folder: Path
    files: tuple[str, ...]


def claim_folder(folder: Path, *, overwrite: bool = False) -> Path:
    """Make the run folder before the work begins, so that a bad path fails early.

    Raises:
        RunFolderError: It holds a run already, is a file, or cannot be written.
    """
    try:
        if folder.exists() and not folder.is_dir():
            raise RunFolderError(f"the output {folder} is a file", value=str(folder), fix="Name a folder with --out")
        if holds_run(folder) and not overwrite:
            unfinished = "" if (folder / "result.json").exists() else f", go on with it by --resume {folder}"
            raise RunFolderError(
                f"{folder} already holds a run", value=str(folder),
                fix=f"Name another with --out{unfinished}, or add --overwrite",
            )  # fmt: skip
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise RunFolderError(
            f"cannot write to the output folder {folder}: {error.strerror}", value=str(folder),
            fix="Name a folder you may write to with --out",
        ) from error  # fmt: skip
    return folder


def holds_run(folder: Path) -> bool:
    """Whether a folder holds a run, finished or not."""
    return any((folder / name).exists() for name in ("result.json", "state.npz", "state-previous.npz"))


def free_folder(parent: Path, name: str) -> Path:
    """The first of NAME, NAME-2, NAME-3, ... below parent that holds no run."""
    folder, k = parent / name, 2
    while holds_run(folder):
        folder, k = parent / f"{name}-{k}", k + 1
    return folder


def write_search(folder: str | Path, result: SearchResult) -> Written:
    """Write a finished search.

    Args:
        folder: The run folder, made where it is missing; see claim_folder where an earlier run must not be lost.
        result: What the search has found.

    Raises:
        RunFolderError: A file cannot be written; files written before it are whole.
    """
    effort = result.effort
    extra = {
        "algorithm": result.prepared.settings.search.algorithm,
        "seed": result.prepared.settings.search.seed,
        "evaluations": int(result.history.evaluations[-1]),
        "computational_effort": effort.computational_effort,
        "converged_at": effort.iterations,
        "mean_valid": effort.mean_valid,
        "rejected": asdict(result.rejections),
        "stopped_by": result.stopped_by,
        "wall_time": result.wall_time,
    }
    place = opened(folder)
    alternatives.remove_alternatives(place)
    write_whole(place / "history.csv", history_csv(result.history))
    kept = alternatives.write_designs(place, result.prepared, result.basins)
    written = write_parts(place, result.best, result.prepared, extra)
    return Written(place, ("history.csv", *kept, *written))


def write_evaluation(folder: str | Path, evaluation: Evaluation, prepared: Prepared) -> Written:
    """Write one arm on one task; a search that lay in the folder before is removed.

    Args:
        folder: The run folder, made where it is missing.
        evaluation: The arm with its path.
        prepared: Task and settings.
    """
    place = opened(folder)
    return Written(place, write_parts(place, evaluation, prepared, {}))


def opened(folder: str | Path) -> Path:
    """A run folder that is there and holds no result.

    Raises:
        RunFolderError: It cannot be made, or an earlier result cannot be removed.
    """
    place = Path(folder)
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunFolderError(f"cannot make the folder {place}: {error.strerror}", value=str(place)) from error
    clear(place)
    return place


def clear(folder: Path) -> None:
    """Remove the result of an earlier run, so that a failure on the way leaves none that looks whole.

    Raises:
        RunFolderError: A file cannot be removed.
    """
    for name in ("result.json", "history.csv", alternatives.FILE, *VIEWS):
        try:
            (folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise RunFolderError(f"cannot remove {folder / name}: {error.strerror}", value=str(folder)) from error


def write_parts(folder: Path, evaluation: Evaluation, prepared: Prepared, extra: dict[str, Any]) -> tuple[str, ...]:
    """Write study.toml, task.csv, task.json, trajectory.csv, arm.urdf, and result.json last; returns their names.

    What the arm does on further demonstrations goes to folders of their own before that.
    """
    more = write_others(folder, evaluation, prepared)
    write_task(folder, prepared)
    write_whole(folder / "trajectory.csv", trajectory_csv(prepared.task.time, evaluation.path.q))
    write_whole(folder / "arm.urdf", arm_urdf(evaluation, prepared))
    write_json(folder / "result.json", result_content(evaluation, prepared) | extra)
    return (STUDY, TASK, TASK_JSON, "trajectory.csv", "arm.urdf", "result.json", *more)


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a result."""
    write_whole(path, json.dumps(content, indent=2, allow_nan=False) + "\n")


def write_task(folder: Path, prepared: Prepared) -> None:
    """Write task.csv, task.json, and study.toml last."""
    write_plain_csv(folder / TASK, task_recording(prepared.task))
    write_origin(folder / TASK_JSON, prepared)
    write_whole(folder / STUDY, prepared.settings.to_toml())


def others_of(prepared: Prepared) -> dict[str, Prepared]:
    """Further demonstrations and those held out, by the names of their folders."""
    seen, unseen = prepared.others, prepared.holdouts
    others = dict(zip(other_names(OTHERS, len(seen)), seen, strict=True))
    return others | dict(zip(other_names(HOLDOUTS, len(unseen)), unseen, strict=True))


def other_names(pattern: str, number: int) -> list[str]:
    """Names of the folders of so many further demonstrations, or of so many held out.

    Args:
        pattern: OTHERS or HOLDOUTS.
        number: How many.
    """
    first = 2 if pattern == OTHERS else 1
    return [pattern.replace("*", str(k)) for k in range(first, first + number)]


def start_others(folder: Path, prepared: Prepared) -> tuple[str, ...]:
    """Write the tasks of further demonstrations; those of an earlier run are removed. Returns their folders.

    Raises:
        RunFolderError: A folder cannot be made or cleared.
    """
    others = others_of(prepared)
    remove_others(folder, keep=others)
    for name, other in others.items():
        write_task(opened(folder / name), other)
    return tuple(others)


def write_others(folder: Path, evaluation: Evaluation, prepared: Prepared) -> tuple[str, ...]:
    """Write what an arm does on further demonstrations, each as a run folder; returns their names."""
    names = start_others(folder, prepared)
    scored = (*evaluation.demonstrations[1:], *evaluation.holdouts)
    for (name, other), each in zip(others_of(prepared).items(), scored, strict=True):
        if each.missed is None:
            write_whole(folder / name / "trajectory.csv", trajectory_csv(other.task.time, each.path.q))
            write_json(folder / name / "result.json", result_content(each, other))
    return names


def remove_others(folder: Path, keep: Collection[str] = ()) -> None:
    """Remove the folders of further demonstrations, but for files that people have put there.

    Raises:
        RunFolderError: A file cannot be removed.
    """
    for place in (*folder.glob(OTHERS), *folder.glob(HOLDOUTS)):
        if place.name in keep or not place.is_dir():
            continue
        clear(place)
        try:
            for name in (STUDY, TASK, TASK_JSON, "trajectory.csv"):
                (place / name).unlink(missing_ok=True)
            if not any(place.iterdir()):
                place.rmdir()
        except OSError as error:
            raise RunFolderError(f"cannot clear {place}: {error.strerror}", value=str(place)) from error


def remove_run(place: Path) -> None:
    """Remove a run folder that this package has written, but for files that people have put there.

    Raises:
        RunFolderError: A file cannot be removed.
    """
    remove_others(place)
    clear(place)
    try:
        for name in (STUDY, TASK, TASK_JSON, "trajectory.csv", "arm.urdf"):
            (place / name).unlink(missing_ok=True)
        if not any(place.iterdir()):
            place.rmdir()
    except OSError as error:
        raise RunFolderError(f"cannot clear {place}: {error.strerror}", value=str(place)) from error


def other_folders(folder: Path, pattern: str) -> list[Path]:
    """Folders of further demonstrations in a run folder, in their order.

    Args:
        folder: The run folder.
        pattern: OTHERS or HOLDOUTS.
    """
    places = (folder / name for name in other_names(pattern, len(list(folder.glob(pattern)))))
    return list(takewhile(lambda place: (place / STUDY).is_file(), places))


def write_origin(path: Path, prepared: Prepared) -> None:
    """Write where the task of a run comes from and what was done to the data."""
    task = prepared.task
    write_task_json(path, prepared.origin, prepared.steps, base=task.base, frames=len(task.time), rate=1.0 / task.dt)


def result_content(evaluation: Evaluation, prepared: Prepared) -> dict[str, Any]:
    """Content of result.json: lengths in metres, angles in radians; the settings as in study.toml."""
    settings, task, path = prepared.settings, prepared.task, evaluation.path
    return {
        "schema_version": SCHEMA_VERSION,
        "armdesign_version": __version__,
        "dof": evaluation.table.dof,
        "dh": dh_content(evaluation.table),
        "length": evaluation.table.length,
        "fitness": evaluation.fitness,
        "path_fitness": evaluation.path_fitness,
        "area": evaluation.area,
        "mount": path.mount.tolist(),
        "base": task.base,
        "points": list(task.points),
        "weights": list(settings.fitness.weights),
        "orientation_weight": settings.fitness.orientation_weight,
        "orientation_metric": settings.fitness.orientation_metric,
        "point_error": {
            name: {"mean": float(path.distance[:, i].mean()), "max": float(path.distance[:, i].max())}
            for i, name in enumerate(task.points)
        },
        "orientation_error": {
            "mean": float(path.orientation_error.mean()),
            "max": float(path.orientation_error.max()),
        },
        "start_error": path.start_error,
        "frames": len(task.time),
        "recording": asdict(source_of(prepared)),
        "settings": settings.to_dict(),
        "notes": list(prepared.notes),
    } | several_content(evaluation, prepared)


def several_content(evaluation: Evaluation, prepared: Prepared) -> dict[str, Any]:
    """What result.json tells of further demonstrations; nothing where there are none."""
    folders = [*others_of(prepared)]
    seen, unseen = [".", *folders[: len(prepared.others)]], folders[len(prepared.others) :]
    content: dict[str, Any] = {}
    if prepared.others:
        every = zip(prepared.demonstrations, evaluation.demonstrations, seen, strict=True)
        content["demonstrations"] = [demonstration_content(*each) for each in every]
    if prepared.holdouts:
        every = zip(prepared.holdouts, evaluation.holdouts, unseen, strict=True)
        content["holdout"] = [demonstration_content(*each) for each in every]
    return content


def demonstration_content(prepared: Prepared, evaluation: Evaluation, folder: str) -> dict[str, Any]:
    """What an arm does on one demonstration; null where it does not reach the hand, in frame ``missed`` (from 0)."""
    reached = evaluation.missed is None
    figures = {name: getattr(evaluation, name) if reached else None for name in ("fitness", "path_fitness", "area")}
    content = {"recording": asdict(source_of(prepared)), **figures, "frames": len(prepared.task.time), "folder": folder}
    if evaluation.missed is not None:
        content["missed"] = {"frame": evaluation.missed[0], "distance": evaluation.missed[1]}
    return content


def source_of(prepared: Prepared) -> Source:
    """The file a demonstration was read from."""
    return next(iter(prepared.origin.sources), Source(prepared.settings.task.recording))


def dh_content(table: DHTable) -> dict[str, Any]:
    """A DH table for JSON; theta only where the arm has offsets."""
    names = ("alpha", "a", "d", "theta") if np.any(table.theta) else ("alpha", "a", "d")
    rows = [{name: float(getattr(table, name)[i]) for name in names} for i in range(table.dof + 1)]
    return {"convention": "modified", "base_yaw": float(table.base_yaw), "rows": rows}


def history_csv(history: History) -> str:
    """One row per iteration; the mean is that of the personal bests."""
    lines = ["iteration,best,mean,valid,evaluations"]
    columns = zip(history.best, history.mean, history.valid, history.evaluations, strict=True)
    for i, (best, mean, valid, evaluations) in enumerate(columns, start=1):
        lines.append(f"{i},{float(best)!r},{float(mean)!r},{int(valid)},{int(evaluations)}")
    return "\n".join(lines) + "\n"


def trajectory_csv(times: np.ndarray[Any, Any], q: np.ndarray[Any, Any]) -> str:
    """One row per frame: time [s], joint angles [rad]."""
    lines = ["time," + ",".join(f"joint_{i + 1}" for i in range(q.shape[1]))]
    lines += [",".join(repr(float(x)) for x in (t, *row)) for t, row in zip(times, q, strict=True)]
    return "\n".join(lines) + "\n"


def arm_urdf(evaluation: Evaluation, prepared: Prepared) -> str:
    """The arm's URDF with the limits and the body its own trajectory asks for; what ``armdesign export`` writes."""
    from armdesign.export.robot_file import finished_robot  # noqa: PLC0415 (SciPy)
    from armdesign.export.urdf import robot_urdf  # noqa: PLC0415

    return robot_urdf(finished_robot(evaluation, prepared))
