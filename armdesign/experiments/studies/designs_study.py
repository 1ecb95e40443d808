"""Fitness over the number of joints, the number that the paper's rule chooses, and its arm."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from armdesign.building.sheet import figure_of
from armdesign.errors import counted
from armdesign.experiments.auto_dof.dof_rule import ENOUGH, WITHIN, Rule, Verdict, choose_dof, explain, rule_of
from armdesign.experiments.studies.study_plan import Defaults, Record, StudyRequest, search_unit, task_name
from armdesign.experiments.studies.study_tables import Cell, Column, Table, spread_of
from armdesign.experiments.sweep.sweep_plan import Tasks, Unit
from armdesign.files import write_whole
from armdesign.kinematics.dh_files import read_design
from armdesign.runs.reading import read_result
from armdesign.views.preview import preview_html
from armdesign.views.report.drawing import ARM, GREY, HUMAN, png
from armdesign.views.report.sketch import sketch

TITLE = "Fitness over the number of joints, and the arm of the number that is chosen"
PARTS = (("fitness", 1.0, "r [m]"), ("path_fitness", 1e3, "f [mm]"), ("area", 1e3, "E [mm]"))
"""Entries of result.json, their factor and their name."""


def defaults(quick: bool) -> Defaults:
    """RA-PSO, and the rule of ``--dof auto``."""
    options = {"algorithm": "rapso", "within": 100.0 * WITHIN, "enough": 1e3 * ENOUGH}
    if quick:
        return Defaults(4, (3, 4, 5), options, {"particles": 60, "iterations": 30})
    return Defaults(10, (3, 4, 5, 6), options)


def plan(request: StudyRequest, tasks: Tasks) -> list[Unit]:
    """For every task, n and seed a search."""
    read_rule(request)
    algorithm = request.options["algorithm"]
    return [
        search_unit(key, tasks[key, n], algorithm, algorithm=algorithm, seed=seed)
        for key in request.tasks
        for n in request.dof
        for seed in request.seeds
    ]


def read_rule(request: StudyRequest) -> Rule:
    """The rule of the options.

    Raises:
        SettingsError: A figure of it cannot be.
    """
    return rule_of(request.options["within"], request.options["enough"])


@dataclass(frozen=True)
class Choice:
    """The arm for a task.

    Attributes:
        task: Its name.
        best: Of every n the search with the smallest r.
        chosen: The n of the rule; None where nothing is finished.
        explanation: Why; while searches have yet to end, that it is not the last word.
    """

    task: str
    best: dict[int, Record]
    chosen: int | None
    explanation: str


def choices(request: StudyRequest, records: Sequence[Record]) -> list[Choice]:
    """The arm for every task by the rule: of every n the design with the smallest r counts, with its f."""
    rule = read_rule(request)
    found = []
    for task in map(task_name, request.tasks):
        own = [record for record in records if record.task == task]
        best = {
            n: min(finished, key=lambda record: float(record.content["fitness"]))
            for n in request.dof
            if (finished := [record for record in own if record.finished and record.dof == n])
        }
        ended = {record.dof for record in own if record.state in ("finished", "failed")}
        f = {n: float(best[n].content["path_fitness"]) if n in best else np.inf for n in sorted(ended)}
        n = choose_dof(f, rule)
        left = sum(record.state not in ("finished", "failed") for record in own)
        if n is None:
            text = ""
        elif left:
            text = f"{counted(n, 'joint')} by what there is so far; {left} of {len(own)} searches have yet to end."
        else:
            text = explain(Verdict(n, "enough" if f[n] <= rule.enough else "all"), f, tuple(f), rule)
        found.append(Choice(task, best, n, text))
    return found


def tables(request: StudyRequest, records: Sequence[Record]) -> list[Table]:
    """Fitness over n with its spread, and the chosen arms in the paper's form."""
    found = choices(request, records)
    rule = read_rule(request)
    notes = [f"{choice.task}: {choice.explanation}" for choice in found if choice.explanation]
    columns = (
        "task",
        "n",
        "runs",
        Column("r [m]", 3),
        "f [mm]",
        "E [mm]",
        Column("best r [m]", 3),
        "its f [mm]",
        "its E [mm]",
        "L [m]",
    )
    title = (
        f"Robot fitness over the number of joints ({request.options['algorithm']}, mean ± standard deviation over "
        f"{counted(request.reps, 'seed')}, and the best arm); "
        f"rule: within {100 * rule.within:g} % or {1e3 * rule.enough:g} mm"
    )
    rows = [fitness_row(choice, n, records) for choice in found for n in request.dof]
    return [Table("fitness", title, columns, rows, notes), final_table(found)]


def fitness_row(choice: Choice, n: int, records: Sequence[Record]) -> tuple[Cell, ...]:
    """A row of the first table."""
    mine = [r.content for r in records if r.finished and (r.task, r.dof) == (choice.task, n)]
    best = choice.best[n].content if n in choice.best else None
    spread = [spread_of(factor * float(content[name]) for content in mine) for name, factor, _ in PARTS]
    figures: list[Cell] = [None if best is None else factor * float(best[name]) for name, factor, _ in PARTS]
    mark = f"{n} *" if n == choice.chosen else f"{n}  "
    return (choice.task, mark, len(mine), *spread, *figures, None if best is None else float(best["length"]))


def final_table(found: Sequence[Choice]) -> Table:
    """The chosen arms: a row per joint, the tool's last."""
    columns = (
        "Sc.",
        "n",
        Column("Phi*", 3),
        "f (mm)",
        "E (mm)",
        "i",
        Column("alpha_i", 3),
        Column("a_i", 3),
        Column("d_i", 3),
    )
    rows: list[tuple[Cell, ...]] = []
    for choice in found:
        if choice.chosen is None:
            continue
        best = choice.best[choice.chosen]
        table = read_design(best.folder / "result.json")
        figures = [factor * float(best.content[name]) for name, factor, _ in PARTS]
        for i in range(table.dof + 1):
            head: list[Cell] = [choice.task, str(choice.chosen), *figures] if i == 0 else ["", "", "", "", ""]
            label = "EE" if i == table.dof else str(i)
            rows.append((*head, label, float(table.alpha[i]), float(table.a[i]), float(table.d[i])))
    return Table("arms", "Chosen arms (modified DH; alpha in rad, a and d in m)", columns, rows)


def figure(request: StudyRequest, records: Sequence[Record]) -> Figure:
    """r, f and E over n, a column a task: every seed a dot, mean and standard deviation, the chosen n ringed."""
    found = choices(request, records)
    picture = Figure(figsize=(max(4.0, 3.1 * len(found)), 6.2), layout="constrained")
    axes = picture.subplots(len(PARTS), len(found), sharex=True, squeeze=False)
    for j, choice in enumerate(found):
        for axis, (name, factor, label) in zip(axes[:, j], PARTS, strict=True):
            draw_part(axis, choice, records, name, factor)
            axis.set(xticks=request.dof, ylabel=label if j == 0 else "")
            axis.set_xlim(min(request.dof) - 0.5, max(request.dof) + 0.5)
            axis.set_ylim(0.0, None)
        axes[0, j].set_title(choice.task)
        axes[-1, j].set_xlabel("joints n")
        axes[1, j].axhline(
            1e3 * read_rule(request).enough, color="#D55E00", linewidth=1.0, linestyle="--", label="enough"
        )
    handles, labels = axes[1, 0].get_legend_handles_labels()
    picture.legend(handles, labels, loc="outside lower center", ncols=2 if len(found) == 1 else 3)
    return picture


def draw_part(axis: Axes, choice: Choice, records: Sequence[Record], name: str, factor: float) -> None:
    """One panel: a part of the fitness over n."""
    values = {
        n: np.array(
            [factor * float(r.content[name]) for r in records if r.finished and (r.task, r.dof) == (choice.task, n)]
        )
        for n in choice.best
    }
    for i, (n, x) in enumerate(values.items()):
        axis.plot(np.full(len(x), n - 0.12), x, ".", color=GREY, markersize=4, label="each seed" if i == 0 else None)
    means, spreads = (
        [x.mean() for x in values.values()],
        [x.std(ddof=1) if len(x) > 1 else 0.0 for x in values.values()],
    )
    axis.errorbar(list(values), means, spreads, color=ARM, marker="o", markersize=4, capsize=3, label="mean, std. dev.")
    best = {n: factor * float(record.content[name]) for n, record in choice.best.items()}
    axis.plot(list(best), list(best.values()), "k_", markersize=12, markeredgewidth=1.6, label="best arm (least r)")
    if choice.chosen is not None:
        axis.plot(choice.chosen, best[choice.chosen], "o", markersize=13, markerfacecolor="none", markeredgecolor=HUMAN,
                  markeredgewidth=1.8, label="chosen")  # fmt: skip


def more(request: StudyRequest, records: Sequence[Record], folder: Path) -> tuple[str, ...]:
    """Write the chosen arm of every task as a drawing and as a preview to look at in a browser."""
    names: list[str] = []
    for choice in choices(request, records):
        if choice.chosen is None:
            continue
        run = read_result(choice.best[choice.chosen].folder)
        drawing, preview = f"{choice.task}-arm.png", f"{choice.task}-preview.html"
        write_whole(folder / drawing, png(partial(figure_of, sketch(run))))
        write_whole(folder / preview, preview_html([run]))
        names += [drawing, preview]
    return tuple(names)
