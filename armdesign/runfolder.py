"""The run folder: what a search or an evaluation leaves on disk, every file whole or not at all."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from armdesign import __version__
from armdesign.demonstration import task_recording, write_plain_csv
from armdesign.errors import RunFolderError
from armdesign.evaluation import Evaluation
from armdesign.files import write_whole
from armdesign.kinematics.dh import DHTable
from armdesign.origin import Source, write_task_json
from armdesign.search import SearchResult
from armdesign.study import Prepared
from armdesign.swarm import History

SCHEMA_VERSION = 1
TASK_JSON = "task.json"


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
        "algorithm": result.prepared.study.search.algorithm,
        "seed": result.prepared.study.search.seed,
        "evaluations": int(result.history.evaluations[-1]),
        "computational_effort": effort.computational_effort,
        "converged_at": effort.iterations,
        "mean_valid": effort.mean_valid,
        "rejected": asdict(result.rejections),
        "stopped_by": result.stopped_by,
        "wall_time": result.wall_time,
    }
    place = opened(folder)
    write_whole(place / "history.csv", history_csv(result.history))
    written = write_parts(place, result.best, result.prepared, extra)
    return Written(place, ("history.csv", *written))


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
    for name in ("result.json", "history.csv", *VIEWS):
        try:
            (folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise RunFolderError(f"cannot remove {folder / name}: {error.strerror}", value=str(folder)) from error


def write_parts(folder: Path, evaluation: Evaluation, prepared: Prepared, extra: dict[str, Any]) -> tuple[str, ...]:
    """Write study.toml, task.csv, task.json, trajectory.csv, arm.urdf, and result.json last; returns their names."""
    write_whole(folder / "study.toml", prepared.study.to_toml())
    write_plain_csv(folder / "task.csv", task_recording(prepared.task))
    write_origin(folder / TASK_JSON, prepared)
    write_whole(folder / "trajectory.csv", trajectory_csv(prepared.task.time, evaluation.path.q))
    write_whole(folder / "arm.urdf", arm_urdf(evaluation, prepared))
    content = result_content(evaluation, prepared) | extra
    write_whole(folder / "result.json", json.dumps(content, indent=2, allow_nan=False) + "\n")
    return ("study.toml", "task.csv", TASK_JSON, "trajectory.csv", "arm.urdf", "result.json")


def write_origin(path: Path, prepared: Prepared) -> None:
    """Write where the task of a run comes from and what was done to the data."""
    task = prepared.task
    write_task_json(path, prepared.origin, prepared.steps, base=task.base, frames=len(task.time), rate=1.0 / task.dt)


def result_content(evaluation: Evaluation, prepared: Prepared) -> dict[str, Any]:
    """Content of result.json: lengths in metres, angles in radians; the settings as in study.toml."""
    study, task, path = prepared.study, prepared.task, evaluation.path
    source = next(iter(prepared.origin.sources), Source(study.task.recording))
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
        "weights": list(study.fitness.weights),
        "orientation_weight": study.fitness.orientation_weight,
        "orientation_metric": study.fitness.orientation_metric,
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
        "recording": asdict(source),
        "settings": study.to_dict(),
        "notes": list(prepared.notes),
    }


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
    from armdesign.export.robot import finished_robot  # noqa: PLC0415 (SciPy)
    from armdesign.export.urdf import robot_urdf  # noqa: PLC0415

    return robot_urdf(finished_robot(evaluation, prepared))
