"""Other arms for the task of a run, as they lie in its folder: alternatives, other numbers of joints, a comparison."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.bodies.arm_body import arm_body
from armdesign.building import RECORD
from armdesign.errors import ArmDesignError, counted
from armdesign.files import read_json
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.dh_files import read_design
from armdesign.runs.listing import numbered_results
from armdesign.search.result import Result

OTHERS = "comparison.json"
"""File of a run folder in which a comparison with other arms is looked for."""
SAME = 1e-6
"""Arms whose tables differ by less are one arm."""
CONTESTS = (
    ("Smallest error", "error", 1e3, "mm", 1),
    ("Fewest joints", "joints", 1.0, "", 0),
    ("Shortest", "length", 1e3, "mm", 0),
    ("Lightest", "mass", 1.0, "kg", 2),
    ("Least torque", "torque", 1.0, "N m", 1),
)
"""What arms are compared by: words, attribute, factor, unit and digits; of each the least wins."""


class OtherArm(NamedTuple):
    """An arm that does the task of a run.

    Attributes:
        name: What to call it.
        kind: What it is: this arm, an alternative, ready-made and so on.
        joints: Its number of joints.
        error: Largest distance of the tool from the hand [m]; None where it does not reach the task.
        length: Length L, tool included [m].
        mass: Moving mass without payload [kg]; None where it is not known.
        torque: Largest torque of any joint [N m]; None where it is not known, or joints slide, which take forces.
        payload: What it carries for that [kg].
        speed: Largest speed of any joint [rad/s]; None where it is not known, or joints slide.
        assumed: Whether its mass, and with it the torque, rests on assumed parts.
        place: Its run folder, as seen from that of the run; empty where it has none, or is not feasible.
    """

    name: str
    kind: str
    joints: int
    error: float | None
    length: float
    mass: float | None = None
    torque: float | None = None
    place: str = ""
    payload: float = 0.0
    speed: float | None = None
    assumed: bool = False


def other_arms(run: Result) -> list[OtherArm]:
    """This arm and those that lie in its folder, this one first; nothing where there are no others."""
    if run.folder is None:
        return []
    built = (run.folder / RECORD).is_file()
    own = OtherArm(
        "this arm", "searched for" if run.facts else "as built" if built else "given", run.table.dof,
        run.verdict.hand_error.max, run.table.length, moving_mass(run, run.table),
        most(run.table, run.verdict.peak_torque), "", run.problem.settings.needs.payload,
        most(run.table, run.verdict.peak_speed), run.problem.settings.body.modules is None,
    )  # fmt: skip
    places = [(f"alternative {each.parent.name}", each) for each in numbered_results(run.folder / "alternatives")]
    places += [(f"best of {each.parent.name[1:]} joints", each) for each in numbered_results(run.folder, "n")]
    found = [arm for name, path in places if (arm := of_result(run, name, path)) is not None]
    found += of_comparison(run, run.folder / OTHERS)
    return [own, *found] if found else []


def of_result(run: Result, name: str, path: Path) -> OtherArm | None:
    """The arm of another run folder for the same task; None where it is this one, or cannot be read.

    Args:
        run: The run.
        name: What to call the other.
        path: Its result.json.
    """
    try:
        table, verdict = read_design(path), read_json(path)["verdict"]
        error, torque = float(verdict["hand_error"]["max"]), most(table, verdict["peak_torque"])
        speed = most(table, verdict["peak_speed"])
    except (ArmDesignError, KeyError, TypeError, ValueError):
        return None
    if table.dof == run.table.dof and np.allclose(entries(table), entries(run.table), atol=SAME):
        return None
    good, place = bool(verdict.get("feasible")), str(path.parent.relative_to(run.folder or path.parent))
    kind = "searched for" if good else "not feasible"
    return OtherArm(
        name, kind, table.dof, error, table.length, moving_mass(run, table), torque, place if good else "",
        run.problem.settings.needs.payload, speed, run.problem.settings.body.modules is None,
    )  # fmt: skip


def most(table: DHTable, peaks: Sequence[float]) -> float | None:
    """The largest torque or speed of joints that all turn; None where one slides.

    Args:
        table: The arm.
        peaks: Of every joint.
    """
    return None if any(table.prismatic) else float(max(peaks))


def entries(table: DHTable) -> Array:
    """The entries of a table, shape (4, n + 1)."""
    return np.stack([table.alpha, table.a, table.d, table.theta])


def moving_mass(run: Result, table: DHTable) -> float:
    """Mass of what moves of an arm that is built like that of a run [kg].

    Args:
        run: The run.
        table: The arm.
    """
    body = run.body if table is run.table else arm_body(table, run.problem.settings.body)
    return body.moving_mass


def of_comparison(run: Result, path: Path) -> list[OtherArm]:
    """The ready-made arms of ``armdesign compare RUN ... --json``; none where that was made for another task.

    Args:
        run: The run.
        path: The file.
    """
    task = run.problem.task
    try:
        content = read_json(path)
        if (content["task"]["points"], content["task"]["frames"]) != (list(task.points), len(task.time)):
            return []
        payload = float(content.get("payload", 0.0))
        return [of_row(row, task.points[-1], payload) for row in content["arms"] if row["kind"] == "ready-made"]
    except (ArmDesignError, KeyError, TypeError, ValueError):
        return []


def of_row(row: dict[str, Any], hand: str, payload: float) -> OtherArm:
    """An arm of a comparison.

    Args:
        row: Its entries.
        hand: The point that the tool follows.
        payload: What it carries [kg].
    """
    error = row["point_error"][hand]
    keys = ("moving_mass", "peak_torque", "peak_speed")
    known = {key: None if row.get(key) is None else float(row[key]) for key in keys}
    return OtherArm(
        str(row["name"]), "ready-made", int(row["joints"]), None if error is None else float(error["max"]),
        float(row["length"]), known["moving_mass"], known["peak_torque"], payload=payload,
        speed=known["peak_speed"],
    )  # fmt: skip


def winners(arms: Sequence[OtherArm]) -> list[tuple[str, str, tuple[str, ...]]]:
    """Who is best at what among arms that reach the task: the contest, the value in words, the names.

    Nobody wins where fewer than two arms have a value, or all have the same; least torque, where payloads differ.
    """
    found = []
    alike = len({arm.payload for arm in arms if arm.error is not None}) < 2
    for what, key, factor, unit, digits in CONTESTS:
        values = {arm.name: getattr(arm, key) for arm in arms if arm.error is not None}
        shown = {name: f"{factor * value:.{digits}f}" for name, value in values.items() if value is not None}
        if len(set(shown.values())) < 2 or (key == "torque" and not alike):
            continue
        least = min(shown.values(), key=float)
        text = counted(int(least), "joint") if key == "joints" else f"{least} {unit}"
        found.append((what, text, tuple(name for name, value in shown.items() if value == least)))
    return found
