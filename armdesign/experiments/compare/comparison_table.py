"""A comparison as cells to print, as notes, as JSON and as CSV."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from armdesign._version import __version__
from armdesign.demonstration.provenance import as_json
from armdesign.experiments.compare.comparison import READY_MADE, ArmScore, Comparison
from armdesign.feasibility.verdict import spread
from armdesign.files import csv_table

SCHEMA_VERSION = 1
FITNESS = ("arm", "hand [mm]", "95 %", "largest", "r [m]", "f [mm]", "E [mm]", "start [mm]")
"""Headings of the first table: how well the arms do; the error of the hand, then the figures of the paper."""
EFFORT = ("arm", "joints", "L [m]", "moving [kg]", "torque [N m]", "base x, y, z, yaw [mm, deg]")
"""Headings of the second: what that takes."""
COLUMNS = (
    "name", "kind", "joints", "length", "fitness", "path_fitness", "area", "worst_error", "worst_point",
    "start_reached", "start_error", "moving_mass", "peak_torque", "base_x", "base_y", "base_z", "base_yaw", "tool",
    "source",
)  # fmt: skip
"""Columns of the CSV."""


def fitness_cells(row: ArmScore) -> tuple[str, ...]:
    """The cells of an arm under FITNESS."""
    scores = row.scores
    missed = "" if row.reached else " missed"
    errors: tuple[float | None, ...] = (None, None, None)
    if row.reached:
        hand = spread([row.path.distance[:, -1]])
        errors = (hand.mean * 1e3, hand.p95 * 1e3, hand.max * 1e3)
    return (
        row.arm.name,
        *(shown(error, 1) for error in errors),
        shown(row.fitness, 4),
        shown(float(scores.path_fitness[0]) * 1e3, 2),
        shown(float(scores.area[0]) * 1e3, 2),
        shown(float(scores.start_error[0]) * 1e3, 3) + missed,
    )


def effort_cells(row: ArmScore) -> tuple[str, ...]:
    """The cells of an arm under EFFORT."""
    base = "-"
    if row.base is not None:
        base = ", ".join(f"{value:.0f}" for value in (*row.base[:3] * 1e3, np.rad2deg(row.base[3])))
        base += "" if row.mounted == "floor" else f" {row.mounted}"
    size = (str(row.arm.dof), f"{row.arm.length:.3f}")
    return row.arm.name, *size, shown(row.moving_mass, 2), shown(row.peak_torque, 1), base


def shown(value: float | None, digits: int) -> str:
    """A number, or a dash for none."""
    return "-" if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


def comparison_notes(comparison: Comparison) -> list[str]:
    """What a reader of the tables has to know, a sentence each."""
    notes, rows, best, sites = [], comparison.rows, comparison.best, comparison.problem.space.sites
    if best is not None and sum(row.reached for row in rows) > 1:
        notes.append(f"Smallest r: {best.arm.name}.")
    if any(row.kind == READY_MADE for row in rows):
        if sites:
            places = "; ".join(map(str, sites))
            notes.append(
                f"Bases are in the recording's room, sought in {places}; designs are where their runs have them."
            )
        else:
            notes.append("Bases are relative to the demonstrator's shoulder, z up; designs are at the shoulder.")
    edge = np.inf if sites else 0.98 * comparison.base_search.half_width
    for row in rows:
        name = row.arm.name
        if not row.reached:
            notes.append(f"{name} does not reach the start of the task; the nearest that was found is shown.")
        if row.base is not None and row.reached and (np.abs(row.base[:3]) > edge).any():
            notes.append(f"The base of {name} is at the edge of its box; a larger --box may suit it better.")
        if row.held:
            notes.append(f"{name}: the tool is '{row.tool}'; held at 0: {', '.join(row.held)}.")
        if row.kind == READY_MADE and row.moving_mass is None:
            notes.append(f"{name}: its file has no masses.")
    loaded = f"a payload of {comparison.payload:g} kg" if comparison.payload else "no payload"
    notes.append(
        f"Torques: inverse dynamics with gravity along the path, {loaded}; designs with the body of their URDF, "
        "ready-made arms with the masses of their files."
    )
    return notes


def comparison_json(comparison: Comparison, source: str) -> str:
    """Everything as JSON: metres, radians, kilograms; null where there is no value.

    Args:
        comparison: The comparison.
        source: Where the task was read.
    """
    problem, search = comparison.problem, comparison.base_search
    task, fitness = problem.task, problem.settings.fitness
    content = {
        "schema_version": SCHEMA_VERSION,
        "armdesign_version": __version__,
        "task": {
            "source": source,
            "base": task.base,
            "points": task.points,
            "orientation": task.orientation if fitness.orientation_weight else None,
            "frames": len(task.time),
        },
        "settings": {name: problem.settings.to_dict()[name] for name in ("task", "fitness")},
        "payload": comparison.payload,
        "base_search": {"evaluations": search.evaluations, "half_width": search.half_width, "seed": search.seed},
        "arms": [row_content(row, task.points) for row in comparison.rows],
        "notes": comparison_notes(comparison),
    }
    return json.dumps(as_json(content), indent=2, allow_nan=False) + "\n"


def row_content(row: ArmScore, points: tuple[str, ...]) -> dict[str, Any]:
    """The entries of an arm, infinite or None where there is no value.

    Args:
        row: The arm with its scores.
        points: Names of the followed points.
    """
    errors = {name: mean_and_max(row.path.distance[:, i]) if row.reached else None for i, name in enumerate(points)}
    return {
        "name": row.arm.name,
        "kind": row.kind,
        "source": row.arm.source,
        "joints": row.arm.dof,
        "length": row.arm.length,
        "fitness": row.fitness,
        "path_fitness": float(row.scores.path_fitness[0]),
        "area": float(row.scores.area[0]),
        "worst_error": row.worst_error,
        "worst_point": points[row.worst_point] if row.reached else None,
        "point_error": errors,
        "orientation_error": mean_and_max(row.path.orientation_error) if row.reached else None,
        "start_reached": row.reached,
        "start_error": float(row.scores.start_error[0]),
        "moving_mass": row.moving_mass,
        "peak_torque": row.peak_torque,
        "joint_torques": row.torque,
        "tool": row.tool,
        "base": None if row.base is None else dict(zip(("x", "y", "z", "yaw"), row.base.tolist(), strict=True)),
        "mounted": None if row.base is None else row.mounted,
        "held_joints": row.held,
        "evaluations": row.evaluations,
    }


def mean_and_max(values: np.ndarray[Any, Any]) -> dict[str, float]:
    """Mean and largest of errors over the frames, shape (T,)."""
    return {"mean": float(values.mean()), "max": float(values.max())}


def comparison_csv(comparison: Comparison) -> str:
    """A line for each arm: metres, radians, kilograms; empty where there is no value."""
    rows = []
    for row in comparison.rows:
        content = row_content(row, comparison.problem.task.points)
        content |= {f"base_{name}": value for name, value in (content["base"] or {}).items()}
        rows.append([content.get(name) for name in COLUMNS])
    return csv_table(COLUMNS, rows)
