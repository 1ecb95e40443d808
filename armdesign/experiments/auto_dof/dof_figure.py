"""The picture of what more joints bring: the hand's error over joints, with the tolerance."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from matplotlib.figure import Figure

from armdesign.experiments.auto_dof.dof_rule import DofResult
from armdesign.views.report.drawing import ARM, GREY, new_figure


def pareto(results: Sequence[DofResult], chosen: int, allowed: float | None) -> Figure:
    """The hand's largest and mean error over the number of joints.

    Args:
        results: The best arm of every number of joints that was searched.
        chosen: The chosen n.
        allowed: The stated tolerance of the hand, drawn as a line [m]; None where none is.
    """
    figure = new_figure(3.0, top=0.3)
    axis = figure.subplots()
    valid = [result for result in results if result.valid and math.isfinite(result.hand_max)]
    joints = [result.dof for result in valid]
    largest, mean = [1e3 * result.hand_max for result in valid], [1e3 * result.hand_error for result in valid]
    axis.plot(joints, largest, "o-", color=ARM, markersize=5, label="largest error")
    axis.plot(joints, mean, "s--", color=GREY, markersize=4, label="mean error")
    top = max([*largest, 1.0])
    if allowed is not None:
        level = 1e3 * allowed
        top = max(top, level)
        axis.axhline(level, color="black", linewidth=0.9, linestyle=":")
        axis.text(results[-1].dof + 0.4, level, f"allowed: {level:g} mm ", ha="right", va="bottom", fontsize=8)
    for result in valid:
        if result.dof == chosen:
            ring: dict[str, Any] = {
                "markersize": 12,
                "markerfacecolor": "none",
                "markeredgecolor": "black",
                "linestyle": "none",
            }
            axis.plot(chosen, 1e3 * result.hand_max, "o", label=f"chosen: {1e3 * result.hand_max:.1f} mm", **ring)
    for result in results:
        if not result.valid:
            axis.text(result.dof, 0.5, "no valid arm", rotation=90, ha="center", va="center", color=GREY,
                      transform=axis.get_xaxis_transform())  # fmt: skip
    axis.set(xlabel="joints", ylabel="tool to hand [mm]", ylim=(0.0, 1.15 * top))
    axis.set_xticks([result.dof for result in results])
    axis.set_xlim(results[0].dof - 0.4, results[-1].dof + 0.4)
    axis.grid(visible=False, axis="x")
    figure.legend(loc="upper left", ncols=3, columnspacing=1.2, handlelength=2.0, borderpad=0.2)
    return figure
