"""The package's own searches against each other: how near to the best known arm every seed comes, and at what cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from armdesign._types import Array
from armdesign.errors import SettingsError
from armdesign.experiments.studies.best_known import fingerprint, read_best
from armdesign.experiments.studies.study_plan import Defaults, Record, StudyRequest, search_unit, task_name
from armdesign.experiments.studies.study_tables import Cell, Column, Table
from armdesign.experiments.sweep.sweep_plan import Tasks, Unit
from armdesign.runs.reading import read_history
from armdesign.views.report.drawing import line_style

ALGORITHMS = ("multibasin", "rapso", "pso")
NEAR = 1.01
"""What counts as the best known arm: 1 % above its fitness."""


def defaults(quick: bool) -> Defaults:
    """Multibasin with up to 50,000 candidates, the swarms with the 80,000 of the paper's settings."""
    options = {"algorithms": ALGORITHMS, "budget": 50_000, "swarms": 80_000}
    if quick:
        return Defaults(2, (3,), options | {"algorithms": ALGORITHMS[:2], "budget": 4_000, "swarms": 6_000})
    return Defaults(10, (3, 4, 5, 6), options)


def plan(request: StudyRequest, tasks: Tasks) -> list[Unit]:
    """Every search for every task, n and seed.

    Raises:
        SettingsError: An algorithm or a number of candidates cannot be.
    """
    check_options(request)
    units = []
    for key in request.tasks:
        for n in request.dof:
            problem = tasks[key, n]
            particles = problem.settings.search.particles
            size = {"budget": request.options["budget"], "iterations": max(1, request.options["swarms"] // particles)}
            units += [
                search_unit(key, problem, algorithm, algorithm=algorithm, seed=seed, **size)
                for algorithm in request.options["algorithms"] for seed in request.seeds
            ]  # fmt: skip
    return units


def check_options(request: StudyRequest) -> None:
    """Refuse what cannot be.

    Raises:
        SettingsError: An algorithm is unknown, or a number of candidates too small.
    """
    for algorithm in request.options["algorithms"]:
        if algorithm not in ALGORITHMS:
            raise SettingsError(f"there is no search '{algorithm}'", value=algorithm, allowed=list(ALGORITHMS))
    for name in ("budget", "swarms"):
        if request.options[name] < 100:
            raise SettingsError(f"{request.options[name]} candidates are asked for", allowed="100 or more")


@dataclass(frozen=True)
class Run:
    """A finished search."""

    fitness: float  # r [m]
    candidates: int  # candidates evaluated
    seconds: float  # time it took [s]
    best: Array  # best fitness so far, batch by batch, shape (M,) [m]
    evaluations: Array  # candidates up to there, shape (M,)
    sure: bool = False  # whether it has stopped since independent beginnings agree

    def at(self, candidates: float) -> float:
        """Best fitness after so many candidates, +inf before the first batch is through."""
        k = int(np.searchsorted(self.evaluations, candidates, side="right")) - 1
        return float(self.best[k]) if k >= 0 else np.inf

    def reaches(self, fitness: float) -> float:
        """Candidates until the best was this good, +inf for never."""
        good = np.flatnonzero(self.best <= fitness)
        return float(self.evaluations[good[0]]) if len(good) else np.inf


Group = tuple[int, str, str]


def runs_of(records: Sequence[Record]) -> dict[Group, list[Run]]:
    """Finished searches by joints, task and algorithm; r of one whose arm is infeasible includes the penalty."""
    groups: dict[Group, list[Run]] = {}
    for record in (record for record in records if record.finished):
        content, history = record.content, read_history(record.folder / "history.csv")
        run = Run(
            float(history.best[-1]), int(content["evaluations"]), float(content["wall_time"]), history.best,
            history.evaluations.astype(float), content["stopped_by"] == "agreement",
        )  # fmt: skip
        groups.setdefault((record.dof, record.task, record.algorithm), []).append(run)
    return groups


def best_known(records: Sequence[Record], groups: Mapping[Group, Sequence[Run]]) -> dict[tuple[int, str], float]:
    """Best known fitness by joints and task: of these runs, and of the record where it holds the task.

    Args:
        records: All runs, those without a result too.
        groups: The finished ones, as ``runs_of`` has them.
    """
    record_to_beat = read_best()
    best: dict[tuple[int, str], float] = {}
    for record in records:
        if (record.dof, record.task) not in best:
            known = record_to_beat.get(fingerprint(record.unit.problem))
            best[record.dof, record.task] = known.fitness if known is not None else np.inf
    for (n, task, _), runs in groups.items():
        best[n, task] = min(best[n, task], *(run.fitness for run in runs))
    return best


def tables(request: StudyRequest, records: Sequence[Record]) -> list[Table]:
    """One row per joints, task and algorithm; of the swarms also what they had at multibasin's budget."""
    groups = runs_of(records)
    best = best_known(records, groups)
    rows = []
    for n in request.dof:
        for task in map(task_name, request.tasks):
            for algorithm in request.options["algorithms"]:
                rows += rows_of((n, task, algorithm), groups, best.get((n, task), np.inf), request.options["budget"])
    columns: list[Column | str] = [
        "n", "task", "search", "seeds", Column("best known", 4), Column("median", 4), Column("best", 4),
        Column("worst", 4), Column("within 1 % [%]", 0), Column("candidates", 0), Column("to 1 %", 0), Column("s", 1),
        "sure", "sure and wrong",
    ]  # fmt: skip
    notes = (
        "Fitness r in m, lower is better. within 1 %: share of the seeds that end within 1 % of the best known arm; "
        "to 1 %: candidates until half of the seeds were. sure: seeds that stopped since independent beginnings agree; "
        "sure and wrong: those of them that are not within 1 %.",
        "Best known: the best of these runs and of benchmarks/best_known.json where it holds the task.",
    )
    return [Table("search", "The searches against each other", columns, rows, notes)]


def rows_of(group: Group, groups: dict[Group, list[Run]], best: float, budget: int) -> list[tuple[Cell, ...]]:
    """Rows of a task with n joints and an algorithm: at its end, and at the budget where it goes on beyond that."""
    runs = groups.get(group)
    if not runs:
        return []
    n, task, algorithm = group
    seconds = float(np.median([run.seconds for run in runs]))
    candidates = float(np.median([run.candidates for run in runs]))
    reached = float(np.median([run.reaches(NEAR * best) for run in runs]))
    ends = [run.fitness for run in runs]
    sure, wrong = sum(run.sure for run in runs), sum(run.sure and run.fitness > NEAR * best for run in runs)
    rows = [(n, task, algorithm, len(runs), best, *spread(ends, best), candidates, reached, seconds, sure, wrong)]
    if candidates > 1.05 * budget:
        early = [run.at(budget) for run in runs]
        title = f"{algorithm} at {budget:,}"
        rows.insert(0, (n, task, title, len(runs), best, *spread(early, best), float(budget), None, None, None, None))
    return rows


def spread(values: Sequence[float], best: float) -> tuple[Cell, ...]:
    """Median, best, worst, and the share within 1 % in percent."""
    within = float(np.mean(np.array(values) <= NEAR * best))
    return float(np.median(values)), min(values), max(values), 100.0 * within


def figure(request: StudyRequest, records: Sequence[Record]) -> Figure:
    """How often the best known arm is found: share of all searches within 1 % of it, over the candidates tried."""
    groups = runs_of(records)
    best = best_known(records, groups)
    picture = Figure(figsize=(4.8, 3.0), layout="constrained")
    axes = picture.subplots()
    most = max((run.candidates for runs in groups.values() for run in runs), default=1000)
    marks = np.geomspace(min(200, most), most, 200)
    for k, algorithm in enumerate(request.options["algorithms"]):
        near = np.array([
            [run.at(mark) <= NEAR * best[n, task] for mark in marks]
            for (n, task, name), runs in groups.items() if name == algorithm for run in runs
        ])  # fmt: skip
        if len(near):
            axes.plot(marks, 100.0 * near.mean(axis=0), label=f"{algorithm} ({len(near)} searches)", **line_style(k))
    axes.set(xscale="log", ylim=(0.0, 102.0), xlabel="candidates tried", ylabel="within 1 % of the best known [%]")
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:,.0f}")
    axes.xaxis.set_minor_formatter(lambda value, _: "")
    axes.grid(linewidth=0.35)
    if axes.lines:
        axes.legend(fontsize=8.5, frameon=False, handlelength=3.2)
    return picture
