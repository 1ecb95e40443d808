"""The sweep's table: one row a run in the order of the plan, written whole as `sweep.csv`."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from armdesign.errors import RunFolderError
from armdesign.experiments.sweep.jobs import recorded
from armdesign.experiments.sweep.sweep_plan import Unit
from armdesign.experiments.sweep.units import RESULT, look_at
from armdesign.files import write_whole

TABLE = "sweep.csv"
FOUND = (
    "fitness",
    "path_fitness",
    "area",
    "length",
    "evaluations",
    "converged_at",
    "computational_effort",
    "mean_valid",
)
HAND = {"hand_mean": "mean", "hand_p95": "p95", "hand_max": "max"}
"""Columns of the hand's error, by the verdict's entries."""
VERDICT = (*HAND, "feasible")
COLUMNS = ("recording", "algorithm", "dof", "D", "seed", "state", *VERDICT, *FOUND, "stopped_by", "wall_time", "folder")

Row = dict[str, Any]


class RunTable:
    """The state of every unit of a sweep or study, and what it has found.

    A row's state is waiting (not begun, or under way), interrupted, finished or failed. The entries that tell what was
    found are those of the run's result.json [m]; `stopped_by` is the stop rule that ended the search, or the sentence
    that says why it failed.
    """

    def __init__(self, folder: Path, units: Sequence[Unit], table: str = TABLE) -> None:
        """Look at what is there.

        Raises:
            RunFolderError: A run folder holds something else, or a finished result is damaged.
        """
        self.folder, self.table = folder, table
        self.units = {unit.name: unit for unit in units}
        self.rows: dict[str, Row] = {}
        for unit in units:
            found = look_at(folder, unit)
            partial = found == "begun" and (folder / unit.name / RESULT).exists()
            self.enter(unit.name, "finished" if found == "finished" else "interrupted" if partial else "waiting")

    def enter(self, name: str, state: str, reason: str = "") -> None:
        """Note the state of a unit, with its result where there is one.

        Raises:
            RunFolderError: The result of a finished unit is damaged.
        """
        unit = self.units[name]
        search, design = unit.problem.settings.search, unit.problem.settings.design
        row = dict.fromkeys(COLUMNS, "") | {
            "recording": unit.recording,
            "algorithm": search.algorithm,
            "dof": design.dof,
            "D": "" if unit.angle_interval is None else unit.angle_interval,
            "seed": search.seed,
            "state": state,
            "stopped_by": reason,
            "folder": name,
        }
        if unit.work is not None:
            row |= work_entries(self.folder / name, unit)
        elif state in ("finished", "interrupted"):
            row |= result_entries(self.folder / name, optional=state == "interrupted")
        self.rows[name] = row

    def state(self, name: str) -> str:
        """State of a unit."""
        return str(self.rows[name]["state"])

    def count(self, *states: str) -> int:
        """Number of units in one of the states."""
        return sum(row["state"] in states for row in self.rows.values())

    def pending(self) -> list[Unit]:
        """Units that are not finished, in the order of the plan."""
        return [unit for unit in self.units.values() if self.state(unit.name) != "finished"]

    def write(self) -> None:
        """Write the table.

        Raises:
            RunFolderError: It cannot be written.
        """
        buffer = io.StringIO()
        table = csv.DictWriter(buffer, COLUMNS, lineterminator="\n")
        table.writeheader()
        table.writerows(self.rows.values())
        write_whole(self.folder / self.table, buffer.getvalue())


def work_entries(place: Path, unit: Unit) -> Row:
    """The columns of a unit that is no search: what it is, and what its record tells."""
    work = unit.work or {}
    record = recorded(place)
    row = {"algorithm": work.get("algorithm", ""), "seed": work.get("seed", "")}
    if record is not None:
        row |= {name: record["found"][name] for name in FOUND if record["found"].get(name) is not None}
        row["wall_time"] = record["wall_time"]
    return row


def result_entries(place: Path, *, optional: bool) -> Row:
    """The columns that come from a run's result.json.

    Args:
        place: The run folder.
        optional: Whether the result may be absent, as that of a search that was interrupted before it found anything.

    Raises:
        RunFolderError: It is damaged.
    """
    path = place / RESULT
    if optional and not path.exists():
        return {}
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        row = {name: content[name] for name in (*FOUND, "stopped_by", "wall_time")}
        verdict = content.get("verdict")  # runs from before there were verdicts have none
        if verdict is not None:
            row |= {name: verdict["hand_error"][entry] for name, entry in HAND.items()}
            row["feasible"] = verdict["feasible"]
        return row
    except (OSError, ValueError, KeyError, TypeError) as error:
        if optional:  # the search goes on from its saved state and writes its result anew
            return {}
        raise RunFolderError(
            f"{path} is damaged: {error!r}", value=str(path), fix="Remove its folder to have that run done again"
        ) from error
