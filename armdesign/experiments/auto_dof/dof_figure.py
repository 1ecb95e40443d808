"""The picture of what more joints bring: path fitness over joints, and robot fitness over length."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from armdesign.experiments.auto_dof.dof_records import DofResult
from armdesign.experiments.auto_dof.dof_rule import Rule
from armdesign.views.report.drawing import ARM, GREY, HUMAN, png


def pareto_png(results: Sequence[DofResult], chosen: int, rule: Rule) -> bytes:
    """Joints, length and fitness of the best arm of every number of joints, the chosen one marked."""
    return png(lambda: pareto(results, chosen, rule))


def pareto(results: Sequence[DofResult], chosen: int, rule: Rule) -> Figure:
    """The picture of the best arms: path fitness over joints on the left, robot fitness over length on the right.

    Args:
        results: The best arm of every number of joints that was searched.
        chosen: The chosen n.
        rule: When more joints do not pay.
    """
    figure = Figure(figsize=(8.2, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    valid = [result for result in results if result.valid]
    front = efficient(valid)
    left.axhline(1e3 * rule.enough, color=HUMAN, linewidth=1.0, linestyle="--", zorder=1)
    left.text(
        0.99, 1e3 * rule.enough, "enough ", color=HUMAN, ha="right", va="bottom", transform=left.get_yaxis_transform()
    )
    left.plot([r.dof for r in valid], [1e3 * r.path_fitness for r in valid], color=ARM, linewidth=1.0, zorder=2)
    mark(left, [(r.dof, 1e3 * r.path_fitness, f"{1e3 * r.path_fitness:.2f}", r) for r in valid], front, chosen)
    left.set(xlabel="joints n", ylabel="path fitness f [mm]", ylim=(0.0, None), title="What a joint more brings")
    left.set_xticks([r.dof for r in results])
    left.set_xlim(results[0].dof - 0.4, results[-1].dof + 0.6)
    for r in results:
        if not r.valid:
            left.text(r.dof, 0.5, "no valid arm", rotation=90, ha="center", va="center", color=GREY,
                      transform=left.get_xaxis_transform())  # fmt: skip
    mark(right, [(r.length, r.fitness, f"n = {r.dof}", r) for r in valid], front, chosen)
    right.set(xlabel="length L [m]", ylabel="robot fitness r [m]", ylim=(0.0, None), title="Length and fitness")
    right.margins(x=0.22)
    for axis in (left, right):
        axis.set_ylim(0.0, 1.12 * axis.get_ylim()[1])
    figure.supxlabel(
        "large: chosen; filled: no other arm has as few joints, is as short and fits as well", fontsize=8.5, color=GREY
    )
    return figure


def mark(
    axis: Axes, points: Sequence[tuple[float, float, str, DofResult]], front: Sequence[DofResult], chosen: int
) -> None:
    """A labelled dot for every arm."""
    for x, y, text, result in points:
        face = ARM if result in front else "white"
        size = 11 if result.dof == chosen else 6
        axis.plot(x, y, marker="o", markersize=size, color=face, markeredgecolor=ARM, markeredgewidth=1.3, zorder=3)
        axis.annotate(text, (x, y), (6, 6), textcoords="offset points", fontsize=8)


def efficient(results: Sequence[DofResult]) -> list[DofResult]:
    """The arms that no other one equals or beats in joints, length and robot fitness alike."""
    keys = [(result.dof, result.length, result.fitness) for result in results]
    return [
        result
        for result, key in zip(results, keys, strict=True)
        if not any(other != key and all(a <= b for a, b in zip(other, key, strict=True)) for other in keys)
    ]
