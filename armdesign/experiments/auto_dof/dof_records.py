"""Files of a search for the number of joints: auto.json, auto.csv, and the result of each number."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

from armdesign.demonstration.provenance import as_json
from armdesign.errors import RunFolderError, SettingsError
from armdesign.experiments.auto_dof.dof_rule import DofResult, Rule, Verdict
from armdesign.files import csv_table, read_json, write_whole
from armdesign.runs.contents import SCHEMA_VERSION
from armdesign.runs.reading import result_content
from armdesign.runs.resumable import finished

AUTO, TABLE, PICTURE, TASKS = "auto.json", "auto.csv", "pareto.png", ".tasks"


class AutoState(NamedTuple):
    """Content of auto.json."""

    joints: tuple[int, ...]  # all n to choose from, ascending
    rule: Rule  # when more joints do not pay
    chosen: int | None  # the choice; None while there is none
    failed: dict[int, str]  # why there is no arm, by the n that have none


def holds_auto(folder: Path) -> bool:
    """Whether a choice of the number of joints was begun in a folder."""
    return os.path.isfile(folder / AUTO)  # False for names too long, too


def has_choice(folder: Path) -> bool:
    """Whether the choice in a folder is made and its arm lies at the top."""
    return holds_auto(folder) and read_auto(folder).chosen is not None and finished(folder)


def run_name(n: int) -> str:
    """Name of the run folder of n joints."""
    return f"n{n}"


def fitness_of(results: Mapping[int, DofResult]) -> dict[int, float]:
    """Path fitness by number of joints [m]."""
    return {n: result.path_fitness for n, result in results.items()}


def read_dof_result(place: Path) -> DofResult:
    """The result of a finished search.

    Raises:
        RunFolderError: It is missing or damaged.
    """
    content = result_content(place)
    try:
        first = content["settings"]["search"].get("first") or ()
        hand = content["point_error"][content["points"][-1]]
        names = ("path_fitness", "fitness", "area", "length", "evaluations", "wall_time")
        entries = {name: content[name] for name in names}
        verdict = content.get("verdict") or {"hand_error": hand | {"p95": math.inf}}  # an older run has none
        error, feasible = verdict["hand_error"], bool(verdict.get("feasible"))
        unseen = [float(entry["path_fitness"] or math.inf) for entry in content.get("holdout", [])]
        return DofResult(
            content["dof"], **entries, hand_error=error["mean"], begun_from=len(first), hand_p95=error["p95"],
            hand_max=error["max"], feasible=feasible, passed=feasible and verdict.get("tolerance_met") is not False,
            held_out=sum(unseen) / len(unseen) if unseen else math.inf,
        )  # fmt: skip
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        path = place / "result.json"
        raise RunFolderError(f"{path} is damaged: {error!r}", value=str(path), fix=f"Remove {place}") from error


def write_auto(
    folder: Path,
    joints: tuple[int, ...],
    rule: Rule,
    results: Mapping[int, DofResult],
    verdict: Verdict | None,
    explanation: str = "",
) -> None:
    """Write auto.json: the rule, the results, and the choice [m, s].

    Args:
        folder: Where to.
        joints: All n to choose from.
        rule: When more joints do not pay.
        results: Those so far, by n.
        verdict: The choice; None while there is none.
        explanation: Why.
    """
    content = {
        "schema_version": SCHEMA_VERSION,
        "joints": joints,
        "within": rule.within,
        "enough": rule.enough,
        "tolerance": rule.tolerance,
        "chosen": None if verdict is None else verdict.dof,
        "stopped_by": None if verdict is None else verdict.reason,
        "explanation": explanation,
        "searched": [asdict(result) for result in results.values()],
    }
    write_whole(folder / AUTO, json.dumps(as_json(content), indent=2, allow_nan=False) + "\n")


def read_auto(folder: Path) -> AutoState:
    """The rule and the choice in a folder.

    Raises:
        RunFolderError: The folder holds none, or its auto.json is damaged.
    """
    path, fix = folder / AUTO, "Search again"
    content = read_json(path, fix)
    try:
        joints = tuple(int(n) for n in content["joints"])
        rule = Rule(float(content["within"]), float(content["enough"]), str(content.get("tolerance", "")))
        failed = {int(item["dof"]): str(item["reason"]) for item in content["searched"] if item["reason"]}
        return AutoState(joints, rule, content["chosen"], failed)
    except (ValueError, KeyError, TypeError, SettingsError) as error:
        raise RunFolderError(f"{path} is damaged: {error}", value=str(path), fix=fix) from error


def auto_csv(results: Mapping[int, DofResult], verdict: Verdict) -> str:
    """A row for every number of joints; entries without a value are empty."""
    names = [*asdict(DofResult(0)), "chosen", "folder"]
    rows = [[*asdict(result).values(), n == verdict.dof, run_name(n)] for n, result in results.items()]
    return csv_table(names, rows)
