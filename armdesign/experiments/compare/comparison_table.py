"""A comparison as a printed table, as JSON and as CSV."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from armdesign._version import __version__
from armdesign.experiments.compare.base_pose import BaseSearch
from armdesign.experiments.compare.comparison import READY_MADE, Compared
from armdesign.search.design_problem import DesignProblem

SCHEMA_VERSION = 1
HEADER = ("arm", "joints", "length", "r", "f", "E", "worst", "start", "moving", "peak torque", "base x, y, z, yaw")
UNITS = ("", "", "[m]", "[m]", "[mm]", "[mm]", "error [mm]", "error [mm]", "mass [kg]", "[N m]", "[mm, mm, mm, deg]")


def comparison_table(rows: Sequence[Compared]) -> str:
    """The rows as plain text; a dash where there is no value."""
    cells = [HEADER, UNITS, *(cells_of(row) for row in rows)]
    widths = [max(len(line[column]) for line in cells) for column in range(len(HEADER))]
    lines = []
    for line in cells:
        padded = [
            line[0].ljust(widths[0]),
            *(cell.rjust(width) for cell, width in zip(line[1:], widths[1:], strict=True)),
        ]
        lines.append(("  " + "  ".join(padded)).rstrip())
    return "\n".join(lines)


def cells_of(row: Compared) -> tuple[str, ...]:
    """The cells of one row."""
    torque = None if row.torque is None else float(row.torque.max())
    base = "-"
    if row.base is not None:
        base = ", ".join(f"{value:.0f}" for value in (*row.base[:3] * 1e3, np.rad2deg(row.base[3])))
    return (
        row.name,
        str(row.joints),
        f"{row.length:.3f}",
        shown(row.fitness, 4),
        shown(float(row.scores.path_fitness[0]) * 1e3, 2),
        shown(float(row.scores.area[0]) * 1e3, 2),
        shown(row.worst_error * 1e3, 1),
        shown(float(row.scores.start_error[0]) * 1e3, 3) + ("" if row.reached else " missed"),
        shown(row.moving_mass, 2),
        shown(torque, 1),
        base,
    )


def shown(value: float | None, digits: int) -> str:
    """A number, or a dash for none."""
    return "-" if value is None or not np.isfinite(value) else f"{value:.{digits}f}"


def comparison_notes(rows: Sequence[Compared], payload: float, how: BaseSearch) -> list[str]:
    """What a reader of the table has to know."""
    notes = []
    reached = [row for row in rows if row.reached]
    if len(reached) > 1:
        best = min(reached, key=lambda row: row.fitness)
        notes.append(f"Smallest r: {best.name}.")
    if any(row.kind == READY_MADE for row in rows):
        notes.append("Bases are relative to the demonstrator's shoulder, z up; those of designs stand at it.")
    for row in rows:
        if not row.reached:
            notes.append(f"{row.name} does not reach the start of the task; the nearest that was found is told.")
        if row.base is not None and row.reached and (np.abs(row.base[:3]) > 0.98 * how.half_width).any():
            notes.append(f"The base of {row.name} stands at the edge of its box; a larger --box may suit it better.")
        if row.held:
            notes.append(f"{row.name}: the tool is '{row.tool}'; held at 0: {', '.join(row.held)}.")
        if row.kind == READY_MADE and row.moving_mass is None:
            notes.append(f"{row.name}: its file has no masses.")
    loaded = f"a payload of {payload:g} kg" if payload else "no payload"
    notes.append(
        f"Torques: inverse dynamics with gravity along the path, {loaded}; designs with the body of their URDF, "
        "ready-made arms with the masses of their files."
    )
    return notes


def comparison_json(
    rows: Sequence[Compared], problem: DesignProblem, payload: float, how: BaseSearch, source: str
) -> str:
    """Everything as JSON: metres, radians, kilograms; null where there is no value."""
    task, fitness = problem.task, problem.settings.fitness
    content = {
        "schema_version": SCHEMA_VERSION,
        "armdesign_version": __version__,
        "task": {
            "source": source,
            "base": task.base,
            "points": list(task.points),
            "orientation": task.orientation if fitness.orientation_weight else None,
            "frames": len(task.time),
        },
        "settings": {name: problem.settings.to_dict()[name] for name in ("task", "fitness")},
        "payload": payload,
        "base_search": {"evaluations": how.evaluations, "half_width": how.half_width, "seed": how.seed},
        "arms": [row_content(row, task.points) for row in rows],
        "notes": comparison_notes(rows, payload, how),
    }
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


def row_content(row: Compared, points: Sequence[str]) -> dict[str, Any]:
    """One row for JSON."""
    distance = row.path.distance
    errors = {
        name: {"mean": float(distance[:, i].mean()), "max": float(distance[:, i].max())} if row.reached else None
        for i, name in enumerate(points)
    }
    turn = row.path.orientation_error
    return {
        "name": row.name,
        "kind": row.kind,
        "source": row.source,
        "joints": row.joints,
        "length": row.length,
        "fitness": finite(row.fitness),
        "path_fitness": finite(row.scores.path_fitness[0]),
        "area": finite(row.scores.area[0]),
        "worst_error": finite(row.worst_error),
        "worst_point": points[row.worst_point] if row.reached else None,
        "point_error": errors,
        "orientation_error": {"mean": float(turn.mean()), "max": float(turn.max())} if row.reached else None,
        "start_reached": row.reached,
        "start_error": finite(row.scores.start_error[0]),
        "moving_mass": row.moving_mass,
        "peak_torque": None if row.torque is None else float(row.torque.max()),
        "joint_torques": None if row.torque is None else row.torque.tolist(),
        "tool": row.tool,
        "base": None if row.base is None else dict(zip(("x", "y", "z", "yaw"), row.base.tolist(), strict=True)),
        "held_joints": list(row.held),
        "evaluations": row.evaluations,
    }


def finite(value: float) -> float | None:
    """A number for JSON; None for one that is not finite."""
    return float(value) if np.isfinite(value) else None


def comparison_csv(rows: Sequence[Compared], points: Sequence[str]) -> str:
    """One line per arm: metres, radians, kilograms; empty where there is no value."""
    names = (
        "name", "kind", "joints", "length", "fitness", "path_fitness", "area", "worst_error", "worst_point",
        "start_reached", "start_error", "moving_mass", "peak_torque", "base_x", "base_y", "base_z", "base_yaw", "tool",
        "source",
    )  # fmt: skip
    stream = io.StringIO()
    writer = csv.DictWriter(stream, names, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    for row in rows:
        content = row_content(row, points)
        base = {f"base_{name}": value for name, value in (content["base"] or {}).items()}
        writer.writerow(content | base)
    return stream.getvalue()
