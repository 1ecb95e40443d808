"""The study of solvers for a single frame: the temporal fitness G of random valid designs, by many solvers.

For every task and number of joints, random valid designs (the repetitions) at the first, middle and last frame are
solved by every solver. All metaheuristics have the same budget of evaluations. G is min over q of eq. 3 within the
joint limits; there is no previous pose, so that no ball around it applies, and the mount is the identity, since within
a single frame it could turn any orientation error to 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from armdesign.errors import SearchError, SettingsError, counted
from armdesign.experiments.studies.frame_fitness import FrameFitness
from armdesign.experiments.studies.frame_solvers import AGENTS, REFERENCE, SOLVERS, TITLES, FrameSolvers
from armdesign.experiments.studies.opytimizer_swarms import ALGORITHMS, check_budget, check_opytimizer
from armdesign.experiments.studies.study_plan import FILLS, MARKS, Defaults, Record, StudyRequest, task_name, work_unit
from armdesign.experiments.studies.study_tables import Cell, Column, Table, spread_of
from armdesign.experiments.sweep.jobs import Reporter
from armdesign.experiments.sweep.sweep_plan import Tasks, Unit
from armdesign.fitness.robot import RobotFitness
from armdesign.search.design_problem import DesignProblem
from armdesign.views.report.drawing import WIDTH

NAME = "temporal"
WITHIN = 1e-5
"""How near the best known value counts as found [m]."""
DRAWN, MOST_DRAWS = 16, 1000
"""Designs drawn at a time, and how often, until a valid one is among them."""
FREE_SIGMA = "slsqp-paper"
LINEAR = 0.01
"""Excess up to which the figure's axis is linear [mm]."""

Key = tuple[str, int, int, int]
"""Task, number of joints, design, frame."""


class Solve(NamedTuple):
    """G [m], processor time [s] and evaluations of one solver on one instance."""

    g: float
    seconds: float
    evaluations: int


def defaults(quick: bool) -> Defaults:
    """Ten designs and 20,000 evaluations as in the paper; three and 5,000 in a quick one."""
    solvers = tuple(name for name in SOLVERS if name != REFERENCE)
    options = {"algorithms": solvers, "budget": 5000 if quick else 20_000}
    return Defaults(3 if quick else 10, (3, 5) if quick else (3, 4, 5, 6), options)


def plan(request: StudyRequest, tasks: Tasks) -> list[Unit]:
    """One unit per task, number of joints, design and solver; the reference is always among the solvers.

    Raises:
        SettingsError: There is no such solver, or the budget is too small for one iteration.
        MissingExtraError: opytimizer is needed and not installed.
    """
    wanted = request.options["algorithms"]
    for name in wanted:
        if name not in SOLVERS:
            raise SettingsError(f"there is no solver '{name}'", value=name, allowed=list(SOLVERS))
    if any(name in ALGORITHMS for name in wanted):
        check_opytimizer()
        check_budget(request.options["budget"], AGENTS, "Raise --budget")
    names = dict.fromkeys([*(name for name in SOLVERS if name in wanted), REFERENCE])
    return [
        work_unit(key, tasks[key, n], f"{name}-design{k}", work_for(request, name, k))
        for key in request.tasks
        for n in request.dof
        for name in names
        for k in range(request.reps)
    ]


def work_for(request: StudyRequest, name: str, k: int) -> dict[str, Any]:
    """What a unit is to do."""
    return {
        "study": NAME,
        "algorithm": name,
        "design": k,
        "seed": request.seed,
        "budget": request.options["budget"] if name in ALGORITHMS else None,
    }


def perform(problem: DesignProblem, work: Mapping[str, Any], reporter: Reporter) -> dict[str, Any]:
    """Solve the first, middle and last frame for one design by one solver."""
    n, k, seed = problem.settings.design.dof, int(work["design"]), int(work["seed"])
    Phi = valid_design(problem, np.random.default_rng([seed, n, k]))
    table, solvers = problem.space.table(Phi), FrameSolvers(problem)
    count, solved = len(problem.task.P), []
    frames = sorted({0, count // 2, count - 1})
    for i, frame in enumerate(frames):
        reporter(i, len(frames))
        own = int(np.random.SeedSequence([seed, n, k, i]).generate_state(1)[0])
        solved.append(solvers.solve(str(work["algorithm"]), table, frame, int(work["budget"] or 0), own))
    return {
        "Phi": Phi,
        "frames": frames,
        "g": [found.g for found in solved],
        "q": [found.q for found in solved],
        "evaluations": sum(found.evaluations for found in solved),
        "cpu_times": [found.seconds for found in solved],
    }


def warm_up(problem: DesignProblem) -> None:
    """Compile the kernels of single frames."""
    arm = problem.space.table(problem.space.sample(np.random.default_rng(0), 1)[0])
    fitness = FrameFitness(arm, problem.path_problem, 0)
    q = np.zeros(fitness.dof)
    fitness(q)
    fitness.with_gradient(q)
    fitness.with_sigma(np.r_[q, np.zeros(fitness.free)])


def valid_design(problem: DesignProblem, rng: np.random.Generator) -> NDArray[np.float64]:
    """The first design drawn uniformly from Omega_l that reaches the start of the task, shape (D,).

    Raises:
        SearchError: None of very many does.
    """
    space = problem.space
    fitness = RobotFitness(problem.path_problem, space)
    at_once = np.full(DRAWN, -np.inf)  # the start decides, the path need not be followed
    for _ in range(MOST_DRAWS):
        Phi = space.sample(rng, DRAWN)
        scores, _ = fitness.evaluate(Phi, at_once)
        if scores.valid.any():
            chosen: NDArray[np.float64] = Phi[int(np.argmax(scores.valid))]
            return chosen
    raise SearchError(
        f"none of {DRAWN * MOST_DRAWS} random arms reaches the start of the task", fix="Use more joints (--dof)"
    )


class Instances(dict[str, dict[Key, Solve]]):
    """Solves by solver and instance, and the least G [m] that any solver has found, by instance.

    Attributes:
        best: The least G by instance; of the instances that have the reference.
    """

    def __init__(self, records: Sequence[Record]) -> None:
        """Collect what is finished."""
        super().__init__()
        least: dict[Key, float] = {}
        for record in (record for record in records if record.finished):
            work, content = record.unit.work or {}, record.content
            share = int(content["evaluations"]) // len(content["frames"])
            for frame, g, seconds in zip(content["frames"], content["g"], content["cpu_times"], strict=True):
                key = (record.task, record.dof, int(work["design"]), int(frame))
                self.setdefault(record.algorithm, {})[key] = Solve(float(g), float(seconds), share)
                least[key] = min(float(g), least.get(key, np.inf))
        self.best = {key: g for key, g in least.items() if key in self.get(REFERENCE, {})}

    def of(self, solver: str, task: str, n: int | None = None) -> dict[Key, Solve]:
        """The solves of a solver for a task, of all numbers of joints or of n alone."""
        return {key: solve for key, solve in self[solver].items() if key[0] == task and n in (None, key[1])}

    def share(self, solves: Mapping[Key, Solve]) -> float | None:
        """Share of instances solved as well as is known [%]; None of none."""
        hits = [solve.g - self.best[key] <= WITHIN for key, solve in solves.items() if key in self.best]
        return 100.0 * sum(hits) / len(hits) if hits else None

    def excess(self, solves: Mapping[Key, Solve]) -> float | None:
        """Mean of G above the best known [mm]; None of none."""
        excess = spread_of(1e3 * (solve.g - self.best[key]) for key, solve in solves.items() if key in self.best)
        return None if excess is None else excess.mean


def tables(request: StudyRequest, records: Sequence[Record]) -> list[Table]:
    """Mean G, time and share of the best known; then the share by number of joints."""
    instances = Instances(records)
    return [main_table(request, instances), share_table(request, instances)]


def main_table(request: StudyRequest, instances: Instances) -> Table:
    """The table in the paper's form."""
    rows: list[list[Cell]] = []
    best = instances.best
    for task in map(task_name, request.tasks):
        for solver in instances:
            solves = instances.of(solver, task)
            spreads = [spread_of(1e3 * s.g for s in instances.of(solver, task, n).values()) for n in request.dof]
            seconds = spread_of(s.seconds for s in solves.values())
            calls = spread_of(s.evaluations for s in solves.values())
            rows.append([
                task, title_of(solver), *spreads, seconds and seconds.mean, instances.share(solves),
                calls and round(calls.mean),
            ])  # fmt: skip
        spreads = [spread_of(1e3 * g for key, g in best.items() if key[:2] == (task, n)) for n in request.dof]
        rows.append([task, "best known", *spreads, None, None, None])
    columns: list[Column | str] = [
        "task", "solver", *(Column(f"n = {n}", 1) for n in request.dof),
        Column("time [s]", 4), Column("found [%]", 0), "evaluations",
    ]  # fmt: skip
    count = max((len({key[2:] for key in best if key[:2] == group[:2]}) for group in best), default=0)
    notes = [
        f"Mean ± standard deviation over {counted(request.reps, 'random valid design')} at the first, middle and last "
        f"frame ({count} instances per n); time: processor time of one solve.",
        f"found: share of instances within {1e3 * WITHIN:g} mm of the best known, which is the least that any solver "
        "of this table has found.",
        "evaluations: of DLS its steps; DLS and SLSQP end by themselves, whatever the budget of the others.",
    ]
    if any(solver in ALGORITHMS for solver in instances):
        notes.append(f"Metaheuristics of opytimizer, {AGENTS} agents, sigma eliminated exactly for them as for DLS.")
    if FREE_SIGMA in instances:
        notes.append(
            f"{TITLES[FREE_SIGMA]}: sigma as variables beside q, finite differences, one random start, as the paper "
            "probably ran it."
        )
    return Table("temporal", "Temporal fitness G [mm] by solver", columns, rows, notes)


def share_table(request: StudyRequest, instances: Instances) -> Table:
    """How often each solver finds the best known value, and how far it is from it on the mean, by number of joints."""
    rows: list[list[Cell]] = []
    for task in map(task_name, request.tasks):
        for solver in instances:
            row: list[Cell] = [task, title_of(solver)]
            for n in request.dof:
                solves = instances.of(solver, task, n)
                row += [instances.share(solves), instances.excess(solves)]
            rows.append(row)
    pairs = [(Column(f"n = {n} [%]", 0), Column("excess [mm]", 2)) for n in request.dof]
    columns: list[Column | str] = ["task", "solver", *(column for pair in pairs for column in pair)]
    title = f"Share of instances within {1e3 * WITHIN:g} mm of the best known, and mean excess over it"
    return Table("found", title, columns, rows)


def title_of(solver: str) -> str:
    """A solver's name in the table."""
    return TITLES.get(solver, solver.upper())


def figure(request: StudyRequest, records: Sequence[Record]) -> Figure:
    """Time of a solve and mean excess over the best known value of every solver, over all n; a mark per task."""
    instances = Instances(records)
    names = [task_name(key) for key in request.tasks]
    found: dict[str, dict[str, tuple[float, float]]] = {}
    for solver in instances:
        for task in names:
            solves = {key: solve for key, solve in instances.of(solver, task).items() if key in instances.best}
            seconds, excess = spread_of(solve.seconds for solve in solves.values()), instances.excess(solves)
            if seconds is not None and excess is not None:
                found.setdefault(title_of(solver), {})[task] = (seconds.mean, excess)
    return draw_solvers(found, names)


def draw_solvers(found: Mapping[str, Mapping[str, tuple[float, float]]], names: Sequence[str]) -> Figure:
    """Two columns side by side, a row per solver.

    Args:
        found: Mean time [s] and excess [mm] by solver and task.
        names: Of the tasks.
    """
    picture = Figure(figsize=(WIDTH, 0.24 * len(found) + 1.5), layout="constrained")
    exact = {
        solver: max(seconds for seconds, _ in marks.values())
        for solver, marks in found.items()
        if len(marks) == len(names) and all(1e-3 * excess <= WITHIN for _, excess in marks.values())
    }
    if exact:
        picture.suptitle(f"Quickest that finds the best known pose: {min(exact, key=exact.__getitem__)}")
    rows: Sequence[Axes] = picture.subplots(1, 2, sharey=True)
    for axes, part, label in zip(rows, (0, 1), ("time [s]", "above it [mm]"), strict=True):
        for k, name in enumerate(names):
            places = [(marks[name][part], row) for row, marks in enumerate(found.values()) if name in marks]
            axes.plot(*np.array(places).reshape(-1, 2).T, MARKS[k % len(MARKS)], color="black", markersize=5.5,
                      markerfacecolor=FILLS[k % len(FILLS)], label=name)  # fmt: skip
        axes.set_xlabel(label)
    rows[0].set_xscale("log")
    rows[1].set_xscale("symlog", linthresh=LINEAR)
    for axes in rows:
        axes.margins(x=0.08)
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.minorticks_off()
    rows[1].set_xticks([0.0, 0.1, 10.0])
    rows[0].set_yticks(range(len(found)), list(found))
    rows[0].set_ylim(len(found) - 0.5, -0.5)
    picture.legend(*rows[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, handlelength=1.0)
    return picture
