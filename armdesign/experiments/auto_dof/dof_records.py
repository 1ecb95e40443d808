"""What a search for the number of joints keeps of its own: auto.json, auto.csv, and what came of each number."""

from __future__ import annotations

import csv
import io
import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from armdesign.errors import RunFolderError, SettingsError
from armdesign.experiments.auto_dof.dof_rule import Rule, Verdict
from armdesign.files import write_whole
from armdesign.runs.contents import SCHEMA_VERSION
from armdesign.runs.reading import result_content
from armdesign.runs.resumable import finished

AUTO, TABLE, PICTURE, TASKS = "auto.json", "auto.csv", "pareto.png", ".tasks"


@dataclass(frozen=True)
class Found:
    """What came of a number of joints.

    Attributes:
        dof: Number of joints n.
        path_fitness: f of the best arm [m]; infinite where none is valid.
        fitness: Its r [m].
        area: Its E [m].
        length: Its L [m].
        hand_error: Mean distance of the last point, the hand, from its place on the arm [m].
        evaluations: Candidates of the search.
        wall_time: Duration of the search [s].
        begun_from: Designs of its first generation that came from the smaller arm.
        reason: Why there is no arm.
    """

    dof: int
    path_fitness: float = math.inf
    fitness: float = math.inf
    area: float = math.inf
    length: float = math.inf
    hand_error: float = math.inf
    evaluations: int = 0
    wall_time: float = 0.0
    begun_from: int = 0
    reason: str = ""

    @property
    def valid(self) -> bool:
        """Whether there is an arm."""
        return math.isfinite(self.path_fitness)


def holds_auto(folder: Path) -> bool:
    """Whether a choice of the number of joints was begun in a folder."""
    return os.path.isfile(folder / AUTO)  # False for names too long, too


def chosen(folder: Path) -> bool:
    """Whether the choice in a folder is made and its arm lies at the top."""
    return holds_auto(folder) and read_auto(folder)[2] is not None and finished(folder)


def run_name(n: int) -> str:
    """Name of the run folder of n joints."""
    return f"n{n}"


def fitness_of(found: Mapping[int, Found]) -> dict[int, float]:
    """Path fitness by number of joints [m]."""
    return {n: result.path_fitness for n, result in found.items()}


def read_found(place: Path) -> Found:
    """What came of a finished search.

    Raises:
        RunFolderError: Its result is missing or damaged.
    """
    content = result_content(place)
    try:
        first = content["settings"]["search"].get("first") or ()
        hand = content["point_error"][content["points"][-1]]["mean"]
        names = ("path_fitness", "fitness", "area", "length", "evaluations", "wall_time")
        entries = {name: content[name] for name in names}
        return Found(content["dof"], **entries, hand_error=hand, begun_from=len(first))
    except (KeyError, TypeError, AttributeError) as error:
        path = place / "result.json"
        raise RunFolderError(f"{path} is damaged: {error!r}", value=str(path), fix=f"Remove {place}") from error


def write_auto(
    folder: Path,
    joints: tuple[int, ...],
    rule: Rule,
    found: Mapping[int, Found],
    verdict: Verdict | None,
    explanation: str = "",
) -> None:
    """Write auto.json: what is asked, what was found, and the choice [m, s]."""
    content = {
        "schema_version": SCHEMA_VERSION,
        "joints": list(joints),
        "within": rule.within,
        "enough": rule.enough,
        "chosen": None if verdict is None else verdict.dof,
        "stopped_by": None if verdict is None else verdict.reason,
        "explanation": explanation,
        "searched": [{name: finite(x) for name, x in asdict(result).items()} for result in found.values()],
    }
    write_whole(folder / AUTO, json.dumps(content, indent=2, allow_nan=False) + "\n")


def read_auto(folder: Path) -> tuple[tuple[int, ...], Rule, int | None, dict[int, str]]:
    """What was asked of the choice in a folder: the n to choose from, the rule, the choice, and the n without an arm.

    Raises:
        RunFolderError: The folder holds none, or its auto.json is damaged.
    """
    path = folder / AUTO
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        joints = tuple(int(n) for n in content["joints"])
        rule = Rule(float(content["within"]), float(content["enough"]))
        failed = {int(item["dof"]): str(item["reason"]) for item in content["searched"] if item["reason"]}
        return joints, rule, content["chosen"], failed
    except (OSError, ValueError, KeyError, TypeError, SettingsError) as error:
        raise RunFolderError(f"{path} is missing or damaged: {error}", value=str(path), fix="Search again") from error


def finite(value: object) -> object:
    """A value for JSON; None for infinity."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def auto_csv(found: Mapping[int, Found], verdict: Verdict) -> str:
    """One row a number of joints; entries without a value are empty."""
    buffer = io.StringIO()
    names = [*asdict(Found(0)), "chosen", "folder"]
    table = csv.DictWriter(buffer, names, lineterminator="\n")
    table.writeheader()
    for n, result in found.items():
        entries = {name: "" if (x := finite(value)) is None else x for name, value in asdict(result).items()}
        table.writerow(entries | {"chosen": n == verdict.dof, "folder": run_name(n)})
    return buffer.getvalue()
