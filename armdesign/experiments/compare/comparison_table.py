"""A comparison as cells to print, as notes, as JSON and as CSV."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from armdesign._version import __version__
from armdesign.building import RECORD
from armdesign.demonstration.provenance import as_json
from armdesign.experiments.compare.arms import DesignArm
from armdesign.experiments.compare.comparison import DESIGN, READY_MADE, ArmScore, Comparison
from armdesign.feasibility.words import MEANINGS
from armdesign.files import csv_table
from armdesign.views.report.others import OtherArm, winners

SCHEMA_VERSION = 1
EFFORT = ("arm", "error [mm]", "mean", "joints", "L [m]", "kg", "N m", "deg/s", "clear [mm]")
"""Headings of the first table: the hand's largest and mean error, and what that takes: moving mass,
torque, speed, and how near its bodies come to one another and to obstacles."""
FITNESS = ("arm", "r [m]", "f [mm]", "E [mm]", "start [mm]")
"""Headings of the second: the figures of the paper."""
COLUMNS = (
    "name", "kind", "joints", "length", "fitness", "path_fitness", "area", "worst_error", "worst_point",
    "start_reached", "start_error", "moving_mass", "peak_torque", "base_x", "base_y", "base_z", "base_yaw", "tool",
    "source", "peak_speed", "clearance",
)  # fmt: skip
"""Columns of the CSV."""


def effort_cells(row: ArmScore) -> tuple[str, ...]:
    """The cells of an arm under EFFORT."""
    arm, speed = as_other(row), row.peak_speed
    return (
        arm.name,
        shown(arm.error and 1e3 * arm.error, 1),
        shown(1e3 * float(row.path.distance[:, -1].mean()) if row.reached else None, 1),
        str(arm.joints),
        shown(arm.length, 3),
        shown(arm.mass, 2),
        shown(arm.torque, 1),
        shown(speed and float(np.rad2deg(speed)), 0) + ("!" if row.too_fast else ""),
        shown(row.clearance and 1e3 * row.clearance, 0),
    )


def fitness_cells(row: ArmScore) -> tuple[str, ...]:
    """The cells of an arm under FITNESS."""
    scores, missed = row.scores, "" if row.reached else " missed"
    return (
        row.arm.name,
        shown(row.fitness, 4),
        shown(float(scores.path_fitness[0]) * 1e3, 2),
        shown(float(scores.area[0]) * 1e3, 2),
        shown(float(scores.start_error[0]) * 1e3, 3) + missed,
    )


def as_other(row: ArmScore) -> OtherArm:
    """An arm of the comparison as the report shows it; joints that slide take forces, which are no torques."""
    turns = not (isinstance(row.arm, DesignArm) and any(row.arm.table.prismatic))
    error = float(row.path.distance[:, -1].max()) if row.reached else None
    torque = row.peak_torque if turns else None
    return OtherArm(row.arm.name, row.kind, row.arm.dof, error, row.arm.length, row.moving_mass, torque)


def base_words(row: ArmScore) -> str:
    """Where a ready-made arm stands, in a sentence; empty for a design."""
    if row.base is None:
        return ""
    x, y, z, yaw = (f"{value:.0f}" for value in (*row.base[:3] * 1e3, np.rad2deg(row.base[3])))
    on = "" if row.mounted == "floor" else f", mounted as on a {row.mounted}"
    return f"{row.arm.name} stands at x {x}, y {y}, z {z} mm, yaw {yaw} deg{on}."


def shown(value: float | None, digits: int) -> str:
    """A number, or a dash for none."""
    return "-" if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


def comparison_notes(comparison: Comparison) -> list[str]:
    """What a reader of the tables has to know, a sentence each."""
    rows, sites = comparison.rows, comparison.problem.space.sites
    won = winners([as_other(row) for row in rows])
    notes = [minimised(comparison), *(f"{what}: {', '.join(names)}, {value}." for what, value, names in won)]
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
        notes += [base_words(row)] if row.base is not None else []
        if not row.reached:
            notes.append(f"{name} does not reach the start of the task; the nearest that was found is shown.")
        if row.base is not None and row.reached and (np.abs(row.base[:3]) > edge).any():
            notes.append(f"The base of {name} is at the edge of its box; a larger --box may suit it better.")
        if row.held:
            notes.append(f"{name}: the tool is '{row.tool}'; held at 0: {', '.join(row.held)}.")
        if row.kind == READY_MADE and row.moving_mass is None:
            notes.append(f"{name}: its file has no masses.")
    loaded = f"a payload of {comparison.payload:g} kg" if comparison.payload else "no payload"
    notes.append(f"Torques: inverse dynamics with gravity along the path, {loaded}.")
    notes.append(f"Masses: {mass_words(rows)}.")
    fast = [
        f"{row.arm.name}, joint {one.joint}, {np.rad2deg(one.speed):.0f} of {np.rad2deg(one.limit):.0f} deg/s "
        f"({'assumed' if not one.stated else 'stated' if row.kind == DESIGN else 'its file'})"
        for row in rows
        if (one := row.too_fast) is not None
    ]
    notes += [f"!: faster than its own joints turn: {'; '.join(fast)}."] if fast else []
    notes.append(
        "Clear: how near a design's bodies come to one another and to obstacles, as 'armdesign check' has it; "
        "those of ready-made arms are not looked at. Start: from the tool to the hand's first point. -: not known."
    )
    return notes


def minimised(comparison: Comparison) -> str:
    """What was made as small as it can be, and by what, in sentences."""
    fitness, points = comparison.problem.settings.fitness, comparison.problem.task.points
    weights = ", ".join(f"{name} {weight:.3g}" for name, weight in zip(points, fitness.weights, strict=True))
    words = (
        f"Minimised is r = {fitness.lambda_f:g} f + {fitness.lambda_E:g} E, not the error. f: {MEANINGS['f']}, by the "
        f"weights {weights}. E: {MEANINGS['E']}."
    )
    if not any(row.kind == READY_MADE for row in comparison.rows):
        return words
    return f"{words} Of a ready-made arm only its base is sought, with {comparison.base_search.evaluations} poses."


def mass_words(rows: Sequence[ArmScore]) -> str:
    """Whose the masses of the arms are, in a clause."""
    whose: dict[str, list[str]] = {}
    for row in rows:
        built = (Path(row.arm.source) / RECORD).is_file()
        kind = "as their makers' URDFs have them" if row.kind == READY_MADE else "of a build's parts"
        kind = kind if built or row.kind == READY_MADE else "of assumed joint modules and tubes"
        whose.setdefault(kind, []).append(row.arm.name)
    return "; ".join(f"{', '.join(names)} {kind}" for kind, names in whose.items())


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
    """The entries of an arm, infinite or None where there is no value."""
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
        "peak_speed": row.peak_speed,
        "clearance": row.clearance,
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
