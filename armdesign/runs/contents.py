"""What a run folder holds, as text: pure functions of a result; ``runs.writing`` puts it on the disk."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign._version import __version__
from armdesign.cell.obstacle_record import obstacles_json
from armdesign.demonstration import task_recording
from armdesign.demonstration.files.plain_csv import plain_csv
from armdesign.demonstration.provenance import TaskRecord, task_json
from armdesign.export.urdf import result_urdf
from armdesign.fitness.constraints import DesignSpace
from armdesign.kinematics.dh import DHTable
from armdesign.runs.folder import (
    ALTERNATIVES,
    DEMONSTRATIONS,
    HISTORY,
    HOLDOUTS,
    OBSTACLES,
    RESULT,
    SETTINGS,
    TASK,
    TASK_JSON,
    TRAJECTORY,
    URDF,
    inner_names,
)
from armdesign.search.arm_symmetry import DIFFERENT, KEPT, different_arms
from armdesign.search.design_problem import Demonstration, DesignProblem
from armdesign.search.evaluation import PathEvaluation
from armdesign.search.result import Result
from armdesign.settings import Settings
from armdesign.swarm import History

SCHEMA_VERSION = 1
"""Of result.json; `result.schema.json` beside this file describes it. Entries are added within a version."""


def contents(result: Result) -> dict[str, str]:
    """Every file of a run folder by its path there, in the order in which they are written.

    The settings come after the task and result.json comes last, so that a folder whose writing was cut short looks
    like what it is. The preview and the report are views, see ``armdesign.views``.
    """
    return problem_contents(result.problem) | result_contents(result)


def problem_contents(problem: DesignProblem) -> dict[str, str]:
    """What a later process needs to take a search up: every demonstration's task and settings."""
    files: dict[str, str] = {}
    problem = problem.in_room
    for name, demonstration in inner_demonstrations(problem).items():
        files |= {f"{name}/{file}": text for file, text in task_contents(demonstration, demonstration.settings).items()}
    return files | task_contents(problem.first, problem.settings)


def task_contents(demonstration: Demonstration, settings: Settings) -> dict[str, str]:
    """task.csv, task.json, settings.toml and what stands in the room of one demonstration."""
    task = demonstration.task
    origin = None if task.origin is None else tuple(task.origin.tolist())
    record = TaskRecord(task.base, demonstration.provenance, demonstration.steps, origin, task.shoulder is not None)
    about = task_json(record, len(task.time), 1.0 / task.dt)
    around = {OBSTACLES: obstacles_json(demonstration.obstacles)} if demonstration.obstacles.each else {}
    return {TASK: plain_csv(task_recording(task)), TASK_JSON: about, **around, SETTINGS: settings.to_toml()}


def result_contents(result: Result) -> dict[str, str]:
    """What was found: history.csv, alternatives.json, trajectories, arm.urdf, and result.json last."""
    problem, evaluation = result.problem, result.evaluation
    files: dict[str, str] = {}
    if result.history is not None:
        files[HISTORY] = history_csv(result.history)
    if result.basins is not None:
        files[ALTERNATIVES] = alternatives_json(problem.space, *result.basins)
    scores = (*evaluation.demonstrations[1:], *evaluation.holdouts)
    for (name, demonstration), score in zip(inner_demonstrations(problem).items(), scores, strict=True):
        if score.missed is None:
            files[f"{name}/{TRAJECTORY}"] = trajectory_csv(demonstration.task.time, score.path.q)
            content = path_content(evaluation.table, demonstration, demonstration.settings, score)
            files[f"{name}/{RESULT}"] = json_text(content)
    files[TRAJECTORY] = trajectory_csv(problem.task.time, evaluation.path.q)
    files[URDF] = result_urdf(result)
    files[RESULT] = json_text(result_content(result))
    return files


def inner_demonstrations(problem: DesignProblem) -> dict[str, Demonstration]:
    """The demonstrations that have a folder of their own inside the run folder, by its name."""
    further = problem.demonstrations[1:]
    names = [*inner_names(DEMONSTRATIONS, len(further)), *inner_names(HOLDOUTS, len(problem.holdouts))]
    return dict(zip(names, (*further, *problem.holdouts), strict=True))


def result_content(result: Result) -> dict[str, Any]:
    """Content of result.json: lengths in metres, angles in radians; the settings as in settings.toml."""
    problem, evaluation = result.problem, result.evaluation
    content = path_content(evaluation.table, problem.first, problem.settings, evaluation.demonstrations[0])
    content |= {name: getattr(evaluation, name) for name in ("fitness", "path_fitness", "area")}
    pose = result.base_pose
    where = {"translation": pose.translation.tolist(), "rotation": pose.rotation.tolist()}
    content["base_pose"] = where | {"mounted": pose.mounted, "frame": pose.frame}
    content["slides"] = list(result.slides)
    inner = list(inner_demonstrations(problem))
    further = len(problem.demonstrations) - 1
    if further:
        content["demonstrations"] = scores_content(
            problem.demonstrations, evaluation.demonstrations, [".", *inner[:further]]
        )
    if problem.holdouts:
        content["holdout"] = scores_content(problem.holdouts, evaluation.holdouts, inner[further:])
    content["verdict"] = asdict(result.verdict)
    facts = result.facts
    if facts is not None:
        content |= {
            "algorithm": facts.algorithm,
            "seed": facts.seed,
            "evaluations": facts.evaluations,
            "computational_effort": facts.computational_effort,
            "converged_at": facts.converged_at,
            "mean_valid": facts.mean_valid,
            "rejected": dict(facts.rejected),
            "stopped_by": facts.stopped_by,
            "wall_time": facts.wall_time,
            "agreement": None if facts.agreement is None else facts.agreement._asdict(),
        }
    return content


def path_content(
    table: DHTable, demonstration: Demonstration, settings: Settings, score: PathEvaluation
) -> dict[str, Any]:
    """What result.json says of an arm on one demonstration.

    Args:
        table: The arm.
        demonstration: The demonstration.
        settings: The settings of the run folder.
        score: What the arm does on it.
    """
    task, path = demonstration.task, score.path
    return {
        "schema_version": SCHEMA_VERSION,
        "armdesign_version": __version__,
        "dof": table.dof,
        "joints": table.joints,
        "dh": dh_content(table),
        "length": table.length,
        "fitness": score.fitness,
        "path_fitness": score.path_fitness,
        "area": score.area,
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
        "recording": asdict(demonstration.source),
        "settings": settings.to_dict(),
        "notes": list(demonstration.notes),
    }


def scores_content(
    demonstrations: Sequence[Demonstration], scores: Sequence[PathEvaluation], folders: Sequence[str]
) -> list[dict[str, Any]]:
    """What an arm does on each demonstration; null where it does not reach the hand, in frame ``missed`` (from 0)."""
    entries = []
    for demonstration, score, folder in zip(demonstrations, scores, folders, strict=True):
        reached = score.missed is None
        figures = {name: getattr(score, name) if reached else None for name in ("fitness", "path_fitness", "area")}
        frames = len(demonstration.task.time)
        entry = {"recording": asdict(demonstration.source), **figures, "frames": frames, "folder": folder}
        if score.missed is not None:
            entry["missed"] = {"frame": score.missed[0], "distance": score.missed[1]}
        entries.append(entry)
    return entries


def alternatives_json(space: DesignSpace, Phi: Array, fitness: Array) -> str:
    """The good designs of a search that differ, best first, as the content of alternatives.json.

    Args:
        space: The design space.
        Phi: Designs, best first, shape (A, D).
        fitness: Their fitness r, shape (A,) [m].
    """
    chosen = different_arms(Phi, space, 0.5 * DIFFERENT, KEPT)
    designs = [{"fitness": float(fitness[k]), "phi": [float(x) for x in Phi[k]]} for k in chosen]
    return json.dumps({"entries": space.free_names, "designs": designs}, indent=1) + "\n"


def json_text(content: dict[str, Any]) -> str:
    """A table as indented JSON."""
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


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


def trajectory_csv(times: Array, q: Array) -> str:
    """One row per frame: time [s], joint angles [rad]."""
    lines = ["time," + ",".join(f"joint_{i + 1}" for i in range(q.shape[1]))]
    lines += [",".join(repr(float(x)) for x in (t, *row)) for t, row in zip(times, q, strict=True)]
    return "\n".join(lines) + "\n"
