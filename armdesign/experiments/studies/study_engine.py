"""The study engine: a study's units as a sweep, then its tables, its figure and what they hang on."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from armdesign.demonstration.provenance import as_json
from armdesign.errors import RunFolderError, SettingsError, counted
from armdesign.experiments.studies.machine import about_machine, command_line, versions
from armdesign.experiments.studies.study_plan import Asked, Record, Tasks, Unit, check_units, task_name
from armdesign.experiments.studies.study_registry import further_files, perform, study_module
from armdesign.experiments.studies.study_store import frozen, settle_study
from armdesign.experiments.studies.study_tables import Table
from armdesign.experiments.sweep import Plan, RunTable, SweepStatus, run_units
from armdesign.experiments.sweep.jobs import recorded
from armdesign.experiments.sweep.units import RESULT
from armdesign.files import write_whole
from armdesign.search.backends.workers import Workers
from armdesign.views.report.drawing import png

RUNS, TABLES, FIGURE, ABOUT = "runs.csv", "table.md", "figure.png", "about.json"


@dataclass(frozen=True)
class Finding:
    """What came of a study.

    Attributes:
        runs: The states of its units.
        tables: Its tables; of an unfinished one from what there is.
        files: Names of the files written into its folder.
    """

    runs: RunTable
    tables: tuple[Table, ...]
    files: tuple[str, ...]


def planned(asked: Asked, tasks: Tasks) -> list[Unit]:
    """The units of a study.

    Raises:
        SettingsError: Something asked for cannot be; no task, joint or repetition is left; or there are too many units.
    """
    if asked.reps < 1:
        raise SettingsError(f"the study has {asked.reps} repetitions", value=asked.reps, allowed="1 or more")
    for (key, n), task in tasks.items():
        try:
            task.check()
        except SettingsError as error:
            raise SettingsError(f"{task_name(key)} with {counted(n, 'joint')}: {error}", value=error.value) from error
    units = study_module(asked.study).plan(asked, tasks)
    check_units(units)
    return units


def run_study(
    folder: Path,
    asked: Asked,
    tasks: Tasks,
    start_workers: Callable[[int], Workers],
    *,
    on_change: Callable[[SweepStatus], None] | None = None,
    on_interrupt: Callable[[], None] | None = None,
) -> Finding:
    """Carry out the units of a study that are not finished, and write its tables and its figure.

    Args:
        folder: The study's folder; made, taken up or extended.
        asked: What is asked.
        tasks: Its tasks, prepared for each number of joints.
        start_workers: Starts workers with the setup ``unit_worker``, for so many units at most; not called for none.
        on_change: Called when a unit has ended or moved on, and twice a second.
        on_interrupt: Called when Ctrl-C or SIGTERM asks for the end.

    Raises:
        RunFolderError: Another process uses the folder, or it cannot be used.
        SettingsError: The folder holds another study, or what is asked cannot be.
        KeyboardInterrupt: Ctrl-C came twice.
    """
    asked = replace(asked, options={name: frozen(value) for name, value in asked.options.items()})
    units, module = planned(asked, tasks), study_module(asked.study)
    began = time.monotonic()
    plan = Plan(units, lambda: settle_study(folder, asked, tasks), RUNS, perform)
    runs = run_units(folder, plan, start_workers, on_change=on_change, on_interrupt=on_interrupt)
    records = records_of(runs)
    write_about(folder, asked, records, time.monotonic() - began)
    if not any(record.finished for record in records):
        return Finding(runs, (), (RUNS, ABOUT))
    tables = marked(module.tables(asked, records), records)
    files = write_findings(folder, tables, png(lambda: module.figure(asked, records)))
    more = further_files(module, asked, records, folder) if not runs.count("waiting", "interrupted") else ()
    return Finding(runs, tuple(tables), (*files, *more, RUNS, ABOUT))


def records_of(runs: RunTable) -> list[Record]:
    """What came of every unit, in the order of the plan.

    Raises:
        RunFolderError: A result is damaged.
    """
    records = []
    for name, unit in runs.units.items():
        place, row = runs.folder / name, runs.rows[name]
        content = content_of(place, unit) if row["state"] == "finished" else {}
        wall_time = float(row["wall_time"]) if content and row["wall_time"] != "" else None
        reason = str(row["stopped_by"]) if row["state"] == "failed" else ""
        records.append(Record(unit, str(row["state"]), reason, content, place, wall_time))
    return records


def content_of(place: Path, unit: Unit) -> Mapping[str, Any]:
    """What a finished unit has found.

    Raises:
        RunFolderError: It is damaged.
    """
    if unit.work is not None:
        record = recorded(place)
        return {} if record is None else dict(record["found"])
    try:
        return dict(json.loads((place / RESULT).read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError) as error:
        raise RunFolderError(
            f"{place / RESULT} is damaged: {error!r}", value=str(place), fix="Remove its folder to have it done again"
        ) from error


def marked(tables: Sequence[Table], records: Sequence[Record]) -> list[Table]:
    """The tables, with a note below the first where they do not stand on all runs."""
    left = sum(record.state in ("waiting", "interrupted") for record in records)
    failed = sum(record.state == "failed" for record in records)
    notes = [f"Not finished: {left} of {len(records)} runs have yet to end."] if left else []
    notes += [f"{failed} of {len(records)} runs failed; runs.csv says why."] if failed else []
    return [replace(table, notes=(*notes, *table.notes)) if i == 0 else table for i, table in enumerate(tables)]


def write_findings(folder: Path, tables: Sequence[Table], picture: bytes) -> tuple[str, ...]:
    """Write the tables and the figure; returns the names of the files.

    Raises:
        RunFolderError: A file cannot be written.
    """
    files = {TABLES: "\n".join(table.markdown() for table in tables)}
    files |= {"table.csv" if i == 0 else f"table_{table.name}.csv": table.csv() for i, table in enumerate(tables)}
    for name, text in files.items():
        write_whole(folder / name, text)
    write_whole(folder / FIGURE, picture)
    return (*files, FIGURE)


def write_about(folder: Path, asked: Asked, records: Sequence[Record], seconds: float) -> None:
    """Write `about.json`: the machine, the versions, what was asked by which commands, and how long it took.

    Every call adds an entry to its sessions; the times of the single runs are those of their own processes.

    Raises:
        RunFolderError: It cannot be written.
    """
    session = {
        "command": command_line(),
        "ended": datetime.now(UTC).isoformat(timespec="seconds"),
        "wall_time": seconds,
        **about_machine(),
        "versions": versions(),
    }
    content = {
        "study": asked.study,
        "tasks": asked.tasks,
        "dof": asked.dof,
        "seeds": asked.seeds,
        "options": asked.options,
        "runs": dict(Counter(record.state for record in records)),
        "run_time": sum(record.wall_time or 0.0 for record in records),
        "run_times": {record.unit.name: record.wall_time for record in records},
        "sessions": [*earlier_sessions(folder), session],
    }
    write_whole(folder / ABOUT, json.dumps(as_json(content), indent=2, allow_nan=False) + "\n")


def earlier_sessions(folder: Path) -> list[Any]:
    """The sessions told of in `about.json` so far; none where it is missing or damaged."""
    try:
        sessions = json.loads((folder / ABOUT).read_text(encoding="utf-8"))["sessions"]
    except (OSError, ValueError, KeyError, TypeError):
        return []
    return sessions if isinstance(sessions, list) else []
