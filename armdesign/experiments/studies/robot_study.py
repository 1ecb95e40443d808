"""The study of searches for the whole robot: the robot fitness r by opytimizer's ABC, GA, PSO, SA, and by ours.

All spend the same number of evaluations, N M, on the same objective from the same first generation. Opytimizer's
algorithms know of no constraints: an invalid design gets a large finite number that falls with the distance from being
valid, see ``penalised``. They need every value in full, so that nothing is pruned for them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from armdesign.errors import SearchError, SettingsError, counted
from armdesign.experiments.studies.opytimizer_swarms import check_budget, check_opytimizer, minimise
from armdesign.experiments.studies.penalised import MISSED, WIDTH, PenalisedFitness
from armdesign.experiments.studies.study_plan import (
    FILLS,
    MARKS,
    Defaults,
    Record,
    StudyRequest,
    search_unit,
    task_name,
    work_unit,
)
from armdesign.experiments.studies.study_tables import Cell, Column, Table, spread_of
from armdesign.experiments.sweep.jobs import Reporter
from armdesign.experiments.sweep.sweep_plan import Tasks, Unit
from armdesign.search.design_problem import DesignProblem
from armdesign.search.evaluation import evaluate_design
from armdesign.settings.sections import Search as SearchSettings
from armdesign.views.report import drawing

NAME = "robot"
FOREIGN = {"abc": "abc", "ga": "ga", "pso-opytimizer": "pso", "sa": "sa", "sa-default": "sa-default"}
"""Opytimizer's algorithms, by the names they have here."""
OWN = ("pso", "rapso")
TITLES = {
    "abc": "ABC", "ga": "GA", "pso-opytimizer": "PSO of opytimizer", "sa": "SA", "sa-default": "SA, its defaults",
    "pso": "PSO", "rapso": "RA-PSO",
}  # fmt: skip
TEMPERATURE = 1.0
"""What SA starts at: r differs by some decimetres between good arms [m]."""
OWN_WAYS = ("patience", "target", "time_limit", "first")
"""Settings by which our own searches would end before the others or begin ahead of them."""
LOOK_EVERY = 50
"""Evaluations between two looks whether to stop."""


def defaults(quick: bool) -> Defaults:
    """Three repetitions at the published N = 400 and M = 200; two of 800 evaluations each in a quick one."""
    options = {"algorithms": tuple(name for name in TITLES if name != "sa-default")}
    if quick:
        return Defaults(2, (3, 5), options, {"particles": 40, "iterations": 20})
    return Defaults(3, (3, 4, 5, 6), options)


def plan(request: StudyRequest, tasks: Tasks) -> list[Unit]:
    """One unit per task, number of joints, algorithm and seed.

    Raises:
        SettingsError: There is no such algorithm, or fewer evaluations than one iteration takes.
        MissingExtraError: opytimizer is needed and not installed.
    """
    wanted = request.options["algorithms"]
    for name in wanted:
        if name not in TITLES:
            raise SettingsError(f"there is no search algorithm '{name}'", value=name, allowed=list(TITLES))
    if any(name in FOREIGN for name in wanted):
        check_opytimizer()
    for task in tasks.values():
        check_search(task.settings.search, foreign=any(name in FOREIGN for name in wanted))
    return [
        unit_for(key, tasks[key, n], name, seed)
        for key in request.tasks
        for n in request.dof
        for name in wanted
        for seed in request.seeds
    ]


def check_search(search: SearchSettings, *, foreign: bool) -> None:
    """Refuse settings under which the searches would not spend the same, from the same first generation.

    Raises:
        SettingsError: Fewer evaluations than an iteration of opytimizer's takes, or what only our own would heed.
    """
    if foreign:
        fix = "Raise --iterations: a search has particles times iterations evaluations"
        check_budget(search.particles * search.iterations, search.particles, fix)
    for name in OWN_WAYS:
        if (value := getattr(search, name)) is not None:
            raise SettingsError(
                f"search.{name} is set, but the searches of this study all spend the same evaluations from the same "
                "first generation",
                value=value,
                fix=f"Leave search.{name} out of the settings",
            )


def unit_for(key: str, problem: DesignProblem, name: str, seed: int) -> Unit:
    """One search: our own as a run, the others as a work."""
    if name in OWN:
        return search_unit(key, problem, name, algorithm=name, seed=seed)
    return work_unit(key, problem, f"{name}-seed{seed}", {"study": NAME, "algorithm": name, "seed": seed})


def perform(problem: DesignProblem, work: Mapping[str, Any], reporter: Reporter) -> dict[str, Any]:
    """Search by one of opytimizer's algorithms.

    Raises:
        SearchError: It has found no valid design.
    """
    search, fitness = problem.settings.search, PenalisedFitness(problem)
    budget, seed = search.particles * search.iterations, int(work["seed"])

    def report(spent: int, best: float) -> None:
        if spent % LOOK_EVERY == 0:
            reporter(spent, budget, best if best < MISSED else np.inf)

    first = fitness.space.sample(np.random.default_rng(seed), search.particles)  # as our own searches draw it
    found = minimise(
        FOREIGN[str(work["algorithm"])], fitness, np.zeros(fitness.dimension), np.full(fitness.dimension, WIDTH),
        budget=budget, agents=search.particles, seed=seed, temperature=TEMPERATURE,
        first=fitness.positions(first), prefetch=fitness.many, on_evaluation=report,
    )  # fmt: skip
    if found.value >= MISSED:
        raise SearchError(f"no valid arm was found in {found.evaluations} evaluations")
    Phi = fitness.phi(found.x[None])[0]
    best = evaluate_design(fitness.space.table(Phi), problem)
    return {
        "Phi": Phi,
        "fitness": best.fitness,
        "path_fitness": best.path_fitness,
        "area": best.area,
        "length": best.table.length,
        "evaluations": found.evaluations,
    }


def tables(request: StudyRequest, records: Sequence[Record]) -> list[Table]:
    """Mean r over all n by algorithm, as the paper has it; then by number of joints."""
    names = [task_name(key) for key in request.tasks]
    return [summary(request, records, names), by_joints(request, records, names)]


def summary(request: StudyRequest, records: Sequence[Record], names: Sequence[str]) -> Table:
    """The table in the paper's form."""
    rows: list[list[Cell]] = []
    for algorithm in request.options["algorithms"]:
        runs = [record for record in records if record.algorithm == algorithm]
        done = [record for record in runs if record.finished]
        times = spread_of(record.wall_time for record in done if record.wall_time is not None)
        calls = spread_of(float(record.content["evaluations"]) for record in done)
        rows.append([
            TITLES[algorithm], *(mean_fitness(done, name) for name in names), mean_fitness(done),
            times, calls and round(calls.mean), f"{len(done)}/{len(runs)}",
        ])  # fmt: skip
    columns: list[Column | str] = [
        "search", *(Column(f"r, {name}", 3) for name in names), Column("r, all", 3), Column("time [s]", 1),
        "evaluations", "runs",
    ]  # fmt: skip
    notes = [
        f"Mean ± standard deviation of the robot fitness r [m] over n = {', '.join(map(str, request.dof))} and "
        f"{counted(request.reps, 'seed')}; time of one search on one core.",
        "ABC, GA, SA and PSO of opytimizer need every value in full; PSO and RA-PSO drop candidates that cannot beat "
        "their own best, which changes nothing but the time.",
    ]
    return Table(NAME, "Robot fitness r [m] by search, over all n", columns, rows, notes)


def by_joints(request: StudyRequest, records: Sequence[Record], names: Sequence[str]) -> Table:
    """Mean r and its spread over the seeds by number of joints."""
    rows: list[list[Cell]] = []
    for name in names:
        for algorithm in request.options["algorithms"]:
            done = [record for record in records if record.finished and record.algorithm == algorithm]
            cells = [mean_fitness(done, name, n) for n in request.dof]
            rows.append([name, TITLES[algorithm], *cells])
    columns: list[Column | str] = ["task", "search", *(Column(f"n = {n}", 3) for n in request.dof)]
    return Table("joints", "Robot fitness r [m] by number of joints", columns, rows)


def mean_fitness(done: Sequence[Record], task: str | None = None, n: int | None = None) -> Cell:
    """Mean r of finished runs, of one task and one number of joints if asked for."""
    kept = [record for record in done if task in (None, record.task) and n in (None, record.dof)]
    return spread_of(float(record.content["fitness"]) for record in kept)


def figure(request: StudyRequest, records: Sequence[Record]) -> Figure:
    """How good every search's arms are: r on the mean of all n and seeds, a row per search and a mark per task."""
    algorithms = list(request.options["algorithms"])
    found = {
        name: {
            algorithm: float(np.mean(values))
            for algorithm in algorithms
            if (values := [float(r.content["fitness"]) for r in records
                           if r.finished and (r.task, r.algorithm) == (name, algorithm)])
        }
        for name in map(task_name, request.tasks)
    }  # fmt: skip
    return draw_searches(found, algorithms)


def draw_searches(found: Mapping[str, Mapping[str, float]], algorithms: Sequence[str]) -> Figure:
    """One panel, the best search on top.

    Args:
        found: Mean r by task and algorithm [m].
        algorithms: All.
    """
    picture = Figure(figsize=(drawing.WIDTH, 0.28 * len(algorithms) + 1.5), layout="constrained")
    axes = picture.subplots()
    whole = {each: [marks.get(each, np.inf) for marks in found.values()] for each in algorithms}
    order = sorted(algorithms, key=lambda each: float(np.mean(whole[each])))
    if np.isfinite(whole[order[0]]).all():
        axes.set_title(f"Least r on the mean of the tasks: {TITLES[order[0]]}")
    for k, (name, marks) in enumerate(found.items()):
        places = [(marks[each], row) for row, each in enumerate(order) if each in marks]
        axes.plot(*np.array(places).reshape(-1, 2).T, MARKS[k % len(MARKS)], color="black", markersize=6,
                  markerfacecolor=FILLS[k % len(FILLS)], label=name)  # fmt: skip
    axes.set_yticks(range(len(order)), [TITLES[each] for each in order])
    axes.set_ylim(len(order) - 0.5, -0.5)
    axes.set_xlim(left=0.0)
    axes.set_xlabel("mean r over all n [m]; less is better")
    picture.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4, handlelength=1.0)
    return picture
