"""RA-PSO against PSO with the same seeds: what its moves do to fitness and computational effort, over D."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from armdesign.errors import SettingsError
from armdesign.experiments.studies.statistics import Change, Pairs, change
from armdesign.experiments.studies.study_plan import Defaults, Record, StudyRequest, search_unit, task_name
from armdesign.experiments.studies.study_tables import Cell, Column, Spread, Table
from armdesign.experiments.sweep.sweep_plan import Tasks, Unit
from armdesign.files import csv_table, write_whole
from armdesign.views.report.drawing import GREY, WIDTH

RANGES = ("valid", "box")
READINGS = {"valid": "extent over the valid particles", "box": "width of the bounds"}
QUANTITIES = {"fitness": "fitness", "effort": "CE"}
WORDS = {"fitness": "score r", "effort": "computing effort"}
"""What they are called in the figure; less of both is better."""
MUCH = -50.0
"""Change of CE in percent that still counts as much lower; the paper's are -66.5 to -76.0."""
ASIDE = 0.22
"""How far the dots stand beside the mean."""
FEW = 6
"""Fewer pairs than this make a bootstrap interval that holds the truth less often than it says."""


def defaults(quick: bool) -> Defaults:
    """Both readings of range, D = 2..5 as in the paper."""
    options = {"d": (2, 3, 4, 5), "range": RANGES}
    if quick:
        return Defaults(8, (3,), options, {"particles": 60, "iterations": 30})
    return Defaults(10, (3, 4, 5, 6), options)


def plan(request: StudyRequest, tasks: Tasks) -> list[Unit]:
    """For every task, n and seed a PSO, and an RA-PSO for every D and reading of range; the same seeds are pairs."""
    intervals, ranges = read_options(request)
    units = []
    for key in request.tasks:
        for n in request.dof:
            for seed in request.seeds:
                units.append(search_unit(key, tasks[key, n], "pso", algorithm="pso", seed=seed))
                units += [
                    search_unit(
                        key, tasks[key, n], f"rapso-D{D}-{reading}",
                        algorithm="rapso", seed=seed, angle_interval=D, range=reading,
                    )
                    for reading in ranges for D in intervals
                ]  # fmt: skip
    return units


def read_options(request: StudyRequest) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """The values of D and the readings of range.

    Raises:
        SettingsError: One cannot be.
    """
    intervals, ranges = tuple(request.options["d"]), tuple(request.options["range"])
    for reading in ranges:
        if reading not in RANGES:
            raise SettingsError(f"--range has {reading!r}", value=reading, allowed=list(RANGES))
    if not intervals or not ranges:
        raise SettingsError("--d or --range is empty", fix="Name at least one of each")
    return intervals, ranges


@dataclass(frozen=True)
class Row:
    """A row of the table: a task with a number of joints, or the mean over all."""

    dof: int | None  # n; None for the mean
    task: str  # name of the task
    fitness: Change  # change of the fitness over D
    effort: Change  # change of CE over D


def rows_of(request: StudyRequest, records: Sequence[Record], reading: str) -> list[Row]:
    """The rows for a reading of range, the mean last; a task and n without a complete pair has none."""
    groups = {
        (n, task_name(key)): pairs
        for n in request.dof
        for key in request.tasks
        if (pairs := pairs_of(request, records, task_name(key), n, reading)) is not None
    }
    rows = [Row(n, task, *(change([pair], request.seed) for pair in both)) for (n, task), both in groups.items()]
    if groups:
        rows.append(Row(None, "", *(change(pairs, request.seed) for pairs in zip(*groups.values(), strict=True))))
    return rows


def pairs_of(
    request: StudyRequest, records: Sequence[Record], task: str, n: int, reading: str
) -> tuple[Pairs, Pairs] | None:
    """Fitness and CE of the seeds with which PSO and RA-PSO at every D have found an arm; None where there is none."""
    intervals, _ = read_options(request)
    found: dict[int, dict[int, tuple[float, float]]] = {}
    for record in records:
        search = record.unit.problem.settings.search
        if not record.finished or (record.task, record.dof) != (task, n):
            continue
        if search.has("range") and search.range != reading:
            continue
        D = search.angle_interval if search.has("angle_interval") else 0
        values = float(record.content["fitness"]), float(record.content["computational_effort"])
        found.setdefault(record.seed, {})[D] = values
    complete = [by_D for _, by_D in sorted(found.items()) if all(D in by_D for D in (0, *intervals))]
    if not complete:
        return None
    pairs = np.array([[by_D[D] for D in (0, *intervals)] for by_D in complete])  # (S, 1 + K, 2)
    return Pairs(pairs[:, 0, 0], pairs[:, 1:, 0]), Pairs(pairs[:, 0, 1], pairs[:, 1:, 1])


def tables(request: StudyRequest, records: Sequence[Record]) -> list[Table]:
    """The paper's table for every reading of range, its claims below it."""
    _, ranges = read_options(request)
    return [table_of(request, records, reading) for reading in ranges]


def table_of(request: StudyRequest, records: Sequence[Record], reading: str) -> Table:
    """The paper's table: joints by tasks, fitness and CE over D."""
    intervals, _ = read_options(request)
    rows = rows_of(request, records, reading)
    columns: list[Column | str] = ["n", "task", "pairs"]
    columns += [Column(f"{name} D={D}", 1) for name in QUANTITIES.values() for D in intervals]
    cells: list[tuple[Cell, ...]] = [
        (
            "mean" if row.dof is None else str(row.dof),
            row.task,
            row.fitness.pairs,
            *spreads(row.fitness),
            *spreads(row.effort),
        )
        for row in rows
    ]
    title = (
        f"RA-PSO against PSO, range = {reading} ({READINGS[reading]}): change of the mean in %, negative is better; "
        "± half of the 95 % interval (same seeds, bootstrap; the ends are in intervals.csv)"
    )
    return Table(f"range-{reading}", title, columns, cells, claims(rows, intervals))


def spreads(values: Change) -> list[Cell]:
    """Changes with half of their intervals; alone where there is a single pair."""
    halves = (values.high - values.low) / 2.0
    return [
        Spread(float(x), float(half), values.pairs) if np.isfinite(half) else float(x)
        for x, half in zip(values.percent, halves, strict=True)
    ]


def claims(rows: Sequence[Row], intervals: Sequence[int]) -> tuple[str, ...]:
    """A sentence for each of the paper's claims: whether it holds here. From the row of the mean."""
    if not rows:
        return ()
    mean = rows[-1]
    sentences = [claim_effort(mean.effort, intervals)]
    if 2 in intervals:
        k = list(intervals).index(2)
        sentences.append(claim_fitness(mean.fitness, k))
        if len(intervals) > 1:
            sentences.append(claim_trade_off(mean, intervals, k))
    if min(row.fitness.pairs for row in rows) < FEW:
        sentences.append(
            f"With fewer than {FEW} pairs in a row the intervals are too narrow to build on: raise --reps."
        )
    return tuple(sentences)


def claim_effort(effort: Change, intervals: Sequence[int]) -> str:
    """Whether RA-PSO's CE is much lower at every D."""
    shown = ", ".join(f"{interval(effort, k)} at D = {D}" for k, D in enumerate(intervals))
    claim = "Paper: RA-PSO's computational effort is much lower at every D (-66.5 to -76.0 % on average)."
    if np.isnan(effort.low).any():
        return f"{claim} Here: {shown}; a single pair proves nothing."
    if (effort.high < MUCH).all():
        return f"{claim} Here it holds: {shown}."
    if (effort.high < 0.0).all():
        return f"{claim} Here it is lower at every D, but not surely by half: {shown}."
    lower = [D for D, high in zip(intervals, effort.high, strict=True) if high < 0.0]
    where = f"only at D = {', '.join(map(str, lower))}" if lower else "at no D"
    return f"{claim} Here it does not hold, CE is surely lower {where}: {shown}."


def claim_fitness(fitness: Change, k: int) -> str:
    """Whether the fitness is as good as PSO's at D = 2."""
    claim = "Paper: at D = 2 the fitness is not compromised (-0.17 % on average)."
    shown = interval(fitness, k)
    if np.isnan(fitness.low[k]):
        return f"{claim} Here: {shown}; a single pair proves nothing."
    if fitness.low[k] > 0.0:
        return f"{claim} Here it does not hold: {shown}, surely worse."
    if fitness.high[k] < 0.0:
        return f"{claim} Here it holds, it is even better: {shown}."
    return f"{claim} Here nothing contradicts it: {shown}, the interval holds 0."


def claim_trade_off(mean: Row, intervals: Sequence[int], k: int) -> str:
    """Whether D = 2 is the best trade-off: the best fitness of all D, at a lower effort than PSO's."""
    claim = "Paper: D = 2 is the best trade-off, the least loss of fitness while CE is far lower."
    best = int(mean.fitness.percent.argmin())
    share = f"D = 2 has the best fitness in {100 * mean.fitness.least[k]:.0f} % of the resamples"
    if not mean.effort.percent[k] < 0.0:
        return f"{claim} Here it does not hold: at D = 2 CE is not lower ({interval(mean.effort, k)}); {share}."
    if best == k:
        return f"{claim} Here it holds: {share}, and CE changes by {interval(mean.effort, k)}."
    other = f"D = {intervals[best]} has the best mean fitness, {interval(mean.fitness, best)}"
    return f"{claim} Here it does not hold: {other} against {interval(mean.fitness, k)}; {share}."


def interval(values: Change, k: int) -> str:
    """A change with its interval."""
    if np.isnan(values.low[k]):
        return f"{values.percent[k]:+.1f} %"
    return f"{values.percent[k]:+.1f} % [{values.low[k]:+.1f}, {values.high[k]:+.1f}]"


def figure(request: StudyRequest, records: Sequence[Record]) -> Figure:
    """Change of score and of computational effort over D: the mean with its interval, every task and n as a dot."""
    intervals, ranges = read_options(request)
    return draw_readings({reading: rows_of(request, records, reading) for reading in ranges}, intervals)


def draw_readings(found: Mapping[str, Sequence[Row]], intervals: Sequence[int]) -> Figure:
    """A row of panels per reading of range."""
    picture = Figure(figsize=(WIDTH, 2.0 * len(found) + 1.1), layout="constrained")
    axes = picture.subplots(len(found), len(QUANTITIES), squeeze=False, sharex=True, sharey="col")
    means = [rows[-1] for rows in found.values() if rows]
    if means:
        spans = (
            f"{words} {min(changes):+.0f} to {max(changes):+.0f} %"
            for name, words in WORDS.items()
            if (changes := [value for row in means for value in getattr(row, name).percent])
        )
        picture.suptitle("RA-PSO, angles moved each D-th time, against PSO:\nmean " + ", ".join(spans))
    for line, (reading, rows) in zip(axes, found.items(), strict=True):
        for axis, (name, words) in zip(line, WORDS.items(), strict=True):
            draw_changes(axis, rows, intervals, name)
            axis.set(title=words, xticks=intervals)
            axis.set_xlim(min(intervals) - 0.5, max(intervals) + 0.5)
        line[0].set_ylabel(f"change [%]\nrange = {reading}")
    for axis in axes[-1]:
        axis.set_xlabel("D")
    handles, labels = axes[0][0].get_legend_handles_labels()
    picture.legend(handles, labels, loc="outside lower center", ncols=2, handlelength=2.0)
    return picture


def draw_changes(axis: Axes, rows: Sequence[Row], intervals: Sequence[int], name: str) -> None:
    """One panel: the mean with its interval, and beside it what it is the mean of."""
    axis.axhline(0.0, color="black", linewidth=0.8)
    for k, row in enumerate(row for row in rows if row.dof is not None):
        values: Change = getattr(row, name)
        axis.plot(np.array(intervals) + ASIDE, values.percent, "o", color=GREY, markersize=3.5,
                  markeredgewidth=0.0, label=None if k else "one task and number of joints")  # fmt: skip
    if rows:
        mean: Change = getattr(rows[-1], name)
        errors = np.nan_to_num(np.stack([mean.percent - mean.low, mean.high - mean.percent]))
        axis.errorbar(intervals, mean.percent, np.maximum(errors, 0.0), color="black", linewidth=1.8, capsize=4,
                      marker="o", markersize=5, label="mean with 95 % interval")  # fmt: skip


def more(request: StudyRequest, records: Sequence[Record], folder: Path) -> tuple[str, ...]:
    """Write intervals.csv: every change with the ends of its interval."""
    intervals, ranges = read_options(request)
    names = ("range", "n", "task", "quantity", "D", "pairs", "change_percent", "low", "high", "share_least")
    lines = []
    for reading in ranges:
        for row in rows_of(request, records, reading):
            for name in QUANTITIES:
                values: Change = getattr(row, name)
                columns = zip(intervals, values.percent, values.low, values.high, values.least, strict=True)
                for D, *numbers in columns:
                    head = [reading, "mean" if row.dof is None else row.dof, row.task, name, D, values.pairs]
                    lines.append([*head, *map(float, numbers)])
    write_whole(folder / "intervals.csv", csv_table(names, lines))
    return ("intervals.csv",)
