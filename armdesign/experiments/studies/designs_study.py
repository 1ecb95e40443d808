"""Fitness over the number of joints, the number that the paper's rule chooses, and its arm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from armdesign.building.sheet_figure import figure_of
from armdesign.errors import counted
from armdesign.experiments.auto_dof.dof_rule import ENOUGH, WITHIN, Rule, Verdict, choose_dof, explain, rule_of
from armdesign.experiments.studies.study_plan import Defaults, Record, StudyRequest, search_unit, task_name
from armdesign.experiments.studies.study_tables import Cell, Column, Spread, Table, spread_of
from armdesign.experiments.sweep.sweep_plan import Tasks, Unit
from armdesign.files import write_whole
from armdesign.kinematics.dh_files import read_design
from armdesign.runs.reading import read_result
from armdesign.views.preview import preview_html
from armdesign.views.report.drawing import GREY, WIDTH, png
from armdesign.views.report.sketch import sketch

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
    """The arm for a task."""

    task: str  # its name
    best: dict[int, Record]  # of every n the search with the smallest r
    chosen: int | None  # the n of the rule; None where nothing is finished
    explanation: str  # why; while searches have yet to end, that it is not the last word


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
    """The path fitness f over n, a panel per task: mean and standard deviation of the seeds, best arm, chosen n."""
    found = {}
    for choice in choices(request, records):
        spreads = {
            n: spread_of(1e3 * float(r.content["path_fitness"])
                         for r in records if r.finished and (r.task, r.dof) == (choice.task, n))
            for n in choice.best
        }  # fmt: skip
        best = {n: 1e3 * float(record.content["path_fitness"]) for n, record in choice.best.items()}
        found[choice.task] = (spreads, best, choice.chosen)
    return draw_numbers(found, request.dof, 1e3 * read_rule(request).enough)


def draw_numbers(
    found: Mapping[str, tuple[Mapping[int, Spread | None], Mapping[int, float], int | None]],
    dof: Sequence[int],
    enough: float,
) -> Figure:
    """Two panels beside each other.

    Args:
        found: By task f of the seeds and of the best arm by n [mm], and the n that is chosen.
        dof: All n.
        enough: f that is good enough [mm].
    """
    lines = max(1, -(-len(found) // 2))
    picture = Figure(figsize=(WIDTH, 1.75 * lines + 1.0), layout="constrained")
    panels = picture.subplots(lines, 2, sharex=True, squeeze=False).ravel()
    chosen = [f"{task} {n}" for task, (_, _, n) in found.items() if n is not None]
    picture.suptitle("Joints that do:\n" + ", ".join(chosen) if chosen else "")
    for axes, (task, (spreads, best, n)) in zip(panels, found.items(), strict=False):
        known = {n: spread for n, spread in spreads.items() if spread is not None}
        means = [each.mean for each in known.values()]
        below = [min(each.spread, each.mean) for each in known.values()]
        above = [each.spread for each in known.values()]
        axes.errorbar(list(known), means, [below, above], color=GREY, marker="o", markersize=3.5, capsize=3,
                      label="mean of the seeds, std. dev.")  # fmt: skip
        axes.plot(
            list(best),
            list(best.values()),
            "k_",
            markersize=9,
            markeredgewidth=2.0,
            clip_on=False,
            label="arm of the least score r",
        )
        if n is not None:
            axes.plot(n, best[n], "o", markersize=12, markerfacecolor="none", markeredgecolor="black",
                      markeredgewidth=1.6, clip_on=False, label="chosen")  # fmt: skip
        axes.axhline(enough, color="black", linewidth=1.0, linestyle="--", label="good enough")
        axes.set(title=task, xticks=dof, xlim=(min(dof) - 0.5, max(dof) + 0.5))
        axes.set_ylim(0.0, None)
    for axes in panels[len(found) :]:
        axes.set_visible(False)
    for axes in panels[-2:]:
        axes.set_xlabel("joints")
    picture.supylabel("path fitness f [mm]", fontsize=9.5)
    handles, labels = panels[0].get_legend_handles_labels()
    picture.legend(handles, labels, loc="outside lower center", ncols=2, handlelength=2.0)
    return picture


def more(request: StudyRequest, records: Sequence[Record], folder: Path) -> tuple[str, ...]:
    """Write the chosen arm of every task as a drawing and as a preview to look at in a browser."""
    names: list[str] = []
    for choice in choices(request, records):
        if choice.chosen is None:
            continue
        run = read_result(choice.best[choice.chosen].folder)
        drawing, preview = f"{choice.task}-arm.png", f"{choice.task}-preview.html"
        write_whole(folder / drawing, png(partial(figure_of, sketch(run)[0])))
        write_whole(folder / preview, preview_html([run]))
        names += [drawing, preview]
    return tuple(names)
