"""The study engine: a study's units as a sweep, then its tables, its figure and what they depend on."""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure

from armdesign.demonstration.provenance import as_json
from armdesign.errors import RunFolderError, SettingsError, counted
from armdesign.experiments.studies.machine import about_machine, versions
from armdesign.experiments.studies.study_plan import Record, StudyRequest, task_name
from armdesign.experiments.studies.study_registry import perform, study_module
from armdesign.experiments.studies.study_store import frozen, settle_study
from armdesign.experiments.studies.study_tables import Table
from armdesign.experiments.sweep.jobs import recorded
from armdesign.experiments.sweep.run_sweep import Plan, SweepStatus, run_units
from armdesign.experiments.sweep.run_table import RunTable
from armdesign.experiments.sweep.sweep_plan import MOST_UNITS, Tasks, Unit
from armdesign.experiments.sweep.units import RESULT
from armdesign.files import write_whole
from armdesign.search.backends.workers import Workers
from armdesign.views.report.drawing import png

RUNS, TABLES, FIGURE, ABOUT = "runs.csv", "table.md", "figure.png", "about.json"


@dataclass(frozen=True)
class StudyResult:
    """The result of a study."""

    runs: RunTable  # the states of its units
    tables: tuple[Table, ...]  # its tables; of an unfinished one from what there is
    files: tuple[str, ...]  # names of the files written into its folder


def planned(request: StudyRequest, tasks: Tasks) -> list[Unit]:
    """The units of a study.

    Raises:
        SettingsError: Something asked for cannot be; no task, joint or repetition is left; or there are too many units.
    """
    if request.reps < 1:
        raise SettingsError(f"the study has {request.reps} repetitions", value=request.reps, allowed="1 or more")
    for (key, n), task in tasks.items():
        try:
            task.check()
        except SettingsError as error:
            raise SettingsError(f"{task_name(key)} with {counted(n, 'joint')}: {error}", value=error.value) from error
    units = study_module(request.study).plan(request, tasks)
    if len(units) > MOST_UNITS:
        raise SettingsError(f"the study has {len(units)} runs", value=len(units), allowed=f"up to {MOST_UNITS}")
    return units


def run_study(
    folder: Path,
    request: StudyRequest,
    tasks: Tasks,
    start_workers: Callable[[int], Workers],
    *,
    on_change: Callable[[SweepStatus], None] | None = None,
    on_interrupt: Callable[[], None] | None = None,
) -> StudyResult:
    """Carry out the units of a study that are not finished, and write its tables and its figure; like ``run_sweep``.

    Raises:
        RunFolderError: Another process uses the folder, or it cannot be used.
        SettingsError: The folder holds another study, or the request cannot be carried out.
        KeyboardInterrupt: Ctrl-C came twice.
    """
    request = replace(request, options={name: frozen(value) for name, value in request.options.items()})
    units, module = planned(request, tasks), study_module(request.study)
    began = time.monotonic()
    plan = Plan(units, lambda: settle_study(folder, request, tasks), RUNS, perform)
    runs = run_units(folder, plan, start_workers, on_change=on_change, on_interrupt=on_interrupt)
    records = records_of(runs)
    write_about(folder, request, records, time.monotonic() - began)
    if not any(record.finished for record in records):
        return StudyResult(runs, (), (RUNS, ABOUT))
    tables = marked(module.tables(request, records), records)
    files = write_tables(folder, tables, png(lambda: legible(module.figure, request, records)))
    write_more = getattr(module, "more", None)
    if write_more is None or runs.count("waiting", "interrupted"):
        more: tuple[str, ...] = ()
    else:
        more = tuple(write_more(request, records, folder))
    return StudyResult(runs, tuple(tables), (*files, *more, RUNS, ABOUT))


def records_of(runs: RunTable) -> list[Record]:
    """The results of all units, in the order of the plan.

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
    """The tables, with a note below the first where they do not hold all runs."""
    left = sum(record.state in ("waiting", "interrupted") for record in records)
    failed = sum(record.state == "failed" for record in records)
    notes = [f"Not finished: {left} of {len(records)} runs have yet to end."] if left else []
    notes += [f"{failed} of {len(records)} runs failed; runs.csv says why."] if failed else []
    return [replace(table, notes=(*notes, *table.notes)) if i == 0 else table for i, table in enumerate(tables)]


def write_tables(folder: Path, tables: Sequence[Table], picture: bytes) -> tuple[str, ...]:
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


def legible(figure: Callable[..., Figure], *given: Any) -> Figure:  # noqa: ANN401 (what a study's figure takes)
    """A figure whose letters are 6 pt and more where it is printed 80 mm wide.

    Args:
        figure: Makes it, at ``WIDTH``.
        given: What it is made from.
    """
    parameters: Any = mpl.rcParams
    parameters.update({"font.size": 9.5, "axes.titlesize": 9.5, "figure.titlesize": 10.5, "legend.fontsize": 9.5})
    return figure(*given)


def write_about(folder: Path, request: StudyRequest, records: Sequence[Record], seconds: float) -> None:
    """Write `about.json`: the machine, the versions, the requests by their commands, and how long it took.

    Every call adds an entry to its sessions; the times of the single runs are those of their own processes.

    Raises:
        RunFolderError: It cannot be written.
    """
    session = {
        "command": ["armdesign", *sys.argv[1:]],
        "ended": datetime.now(UTC).isoformat(timespec="seconds"),
        "wall_time": seconds,
        **about_machine(),
        "versions": versions(),
    }
    content = {
        "study": request.study,
        "tasks": request.tasks,
        "dof": request.dof,
        "seeds": request.seeds,
        "options": request.options,
        "runs": dict(Counter(record.state for record in records)),
        "run_time": sum(record.wall_time or 0.0 for record in records),
        "run_times": {record.unit.name: record.wall_time for record in records},
        "sessions": [*earlier_sessions(folder), session],
    }
    write_whole(folder / ABOUT, json.dumps(as_json(content), indent=2, allow_nan=False) + "\n")


def earlier_sessions(folder: Path) -> list[Any]:
    """The sessions in `about.json` so far; none where it is missing or damaged."""
    try:
        sessions = json.loads((folder / ABOUT).read_text(encoding="utf-8"))["sessions"]
    except (OSError, ValueError, KeyError, TypeError):
        return []
    return sessions if isinstance(sessions, list) else []
