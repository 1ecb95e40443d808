"""The report's diagrams: fitness in its parts, errors, joint motion, convergence."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from armdesign._types import Array
from armdesign.bodies.exact import ExactScene
from armdesign.feasibility.needs import joint_needs
from armdesign.feasibility.verdict import exact_obstacles
from armdesign.feasibility.violations import Gap
from armdesign.feasibility.violations import figure as figure_words
from armdesign.feasibility.words import pace
from armdesign.search.result import Result
from armdesign.swarm import History
from armdesign.views.report.drawing import (
    ARM,
    COLOURS,
    GREY,
    HUMAN,
    MOST_DRAWN,
    Picture,
    legend_above,
    legend_room,
    line_style,
    new_figure,
    picture,
    short,
    thinned,
)
from armdesign.views.report.facts import FitnessParts, JointLoads

BINS = 24
BEST, MEAN = "best", "mean of all particles' bests"
LETTER = 0.078
"""Room of a letter [inch]."""


def fitness_picture(run: Result, parts: FitnessParts) -> Picture:
    """What makes up the robot fitness, a bar a part."""
    factor_f, factor_E = parts.factors
    names = [short(name) for name in run.problem.task.points]
    values = [factor_f * value for value in parts.points]
    if run.problem.settings.fitness.orientation_weight:
        names, values = [*names, "orientation"], [*values, factor_f * parts.orientation]
    names, values = [*names, "area E"], [*values, factor_E * parts.area]

    def build() -> Figure:
        figure = new_figure(0.6 + 0.3 * len(names), left=0.2 + LETTER * max(map(len, names)), top=0.05)
        axis = figure.subplots()
        bars = axis.barh(names, 1e3 * np.array(values), color=ARM, edgecolor="black", linewidth=0.6, height=0.62)
        bars[-1].set(facecolor="white", hatch="////", edgecolor=HUMAN)
        axis.bar_label(bars, [f"{1e3 * value:.1f}" for value in values], padding=3)
        axis.margins(x=0.12)
        axis.invert_yaxis()
        axis.grid(visible=False, axis="y")
        axis.set(xlabel=f"part of r = {1e3 * parts.total:.1f} mm")
        return figure

    said = ", ".join(f"{name.strip()} {1e3 * value:.1f} mm" for name, value in zip(names, values, strict=True))
    return picture("fitness", build, f"Bars of the parts of the fitness: {said}.")


def error_picture(run: Result) -> Picture:
    """Distance of each point to its place on the arm over time; below it the orientation error."""
    task, path = run.problem.task, run.evaluation.path
    oriented = bool(run.problem.settings.fitness.orientation_weight)

    def build() -> Figure:
        top = legend_room([short(name) for name in task.points])
        figure = new_figure(2.4 + top + (1.1 if oriented else 0.0), top=top)
        axes = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1]) if oriented else [figure.subplots()]
        for i, name in enumerate(task.points):
            axes[0].plot(*thinned(task.time, 1e3 * path.distance[:, i]), label=short(name), **line_style(i))
        axes[0].set(ylabel="error [mm]", ylim=(0.0, None))
        if oriented:
            angle = np.rad2deg(path.orientation_error)
            axes[1].plot(*thinned(task.time, angle), color="black")
            axes[1].set(ylabel="turn [deg]", ylim=(0.0, max(1.1 * float(angle.max()), 0.1)))
        axes[-1].set(xlabel="time [s]", xlim=(task.time[0], task.time[-1]))
        legend_above(figure, axes[0])
        return figure

    also = " and of the orientation" if oriented else ""
    return picture("errors", build, f"Error of each point{also} over time; the table gives mean and largest value.")


def clearance_picture(run: Result) -> Picture | None:
    """How far the bodies stay from one another and from obstacles over time; nothing for a thin arm."""
    settings, task = run.problem.settings, run.problem.task
    if settings.body.kind == "thin":
        return None
    verdict, q = run.verdict, run.evaluation.path.q
    gaps = {"from one another": verdict.self_clearance, "from obstacles": verdict.obstacle_clearance}
    least_at = [gap.frame for gap in gaps.values() if gap is not None and gap.demonstration == 0]
    chosen = np.unique([*np.linspace(0, len(q) - 1, min(len(q), MOST_DRAWN)).astype(int), *least_at])
    solids = [
        one if one.poses.ndim == 2 else one._replace(poses=one.poses[chosen])
        for one in exact_obstacles(run.problem.first.obstacles)
    ]
    scene, time = ExactScene(run.body, solids, run.base_pose.matrix), task.time[chosen]
    found = zip(gaps.items(), (scene.self_clearance(q[chosen]), scene.obstacle_clearance(q[chosen])), strict=True)
    shown = {}
    for (name, gap), drawn in found:
        if gap is None or drawn is None:
            continue
        own = Gap(drawn.value, int(chosen[drawn.frame]), drawn.bodies, float(time[drawn.frame]))
        shown[name] = (drawn.each, gap if gap.demonstration == 0 else own)
    if not shown:
        return None
    required = 1e3 * settings.body.clearance

    def build() -> Figure:
        figure = new_figure(2.4 + legend_room(list(shown)), top=legend_room(list(shown)))
        axis = figure.subplots()
        for k, (name, (each, gap)) in enumerate(shown.items()):
            style = line_style(1 + k)
            axis.plot(time, 1e3 * each, label=name, **style)
            axis.plot(gap.time, 1e3 * gap.value, "o", color=style["color"], markersize=5, zorder=4)
        axis.axhline(required, color="black", linewidth=0.8, linestyle=":")
        axis.text(task.time[-1], required, f"asked for: {required:g}", ha="right", va="bottom", fontsize=8)
        top = 1.05 * max(1.2 * required, *(float(1e3 * each.max()) for each, _ in shown.values()))
        low = min(0.0, *(1e3 * gap.value for _, gap in shown.values()))
        axis.set(xlabel="time [s]", ylabel="clearance [mm]", xlim=(task.time[0], task.time[-1]), ylim=(1.1 * low, top))
        legend_above(figure, axis)
        return figure

    least = [
        f"least {name} {figure_words(1e3 * gap.value)} mm, {' and '.join(gap.bodies)}, at {gap.time:.2f} s"
        for name, (_, gap) in shown.items()
    ]
    words = f"How far the bodies stay apart: {'; '.join(least)}. Dots: where it is least; below 0 they overlap."
    return picture("clearance", build, f"Clearance over time: {'; '.join(least)}.", words)


def limits_picture(run: Result, loads: JointLoads) -> Picture:
    """Speed of every joint as a share of what it may do, stated or assumed.

    Args:
        run: The run.
        loads: Its smoothed motion.
    """
    limits = joint_needs(run.problem.settings)
    used = 100.0 * np.abs(loads.motion.v) / limits.actuator_speed
    names = [f"joint {i + 1}" for i in range(used.shape[1])]

    def build() -> Figure:
        figure = new_figure(2.4 + legend_room(names), top=legend_room(names))
        axis = figure.subplots()
        for i, name in enumerate(names):
            axis.plot(*thinned(loads.time, used[:, i]), label=name, **line_style(i))
        axis.axhline(100.0, color="black", linewidth=0.8, linestyle=":")
        top = 1.08 * max(100.0, float(used.max()))
        axis.set(
            xlabel="time [s]", ylabel="share of its limit [%]", xlim=(loads.time[0], loads.time[-1]), ylim=(0, top)
        )
        legend_above(figure, axis)
        return figure

    worst = int(used.max(axis=0).argmax())
    whose = "the assumed actuator" if limits.speed is None else "its stated limit"
    said = f"at the demonstrated speed joint {worst + 1} comes to {used.max():.0f} % of {whose}"
    fraction = run.verdict.speed_fraction
    kept = "the limits are kept at no speed" if fraction == 0.0 else f"all limits are kept at {pace(fraction)}"
    words = f"Speed of each joint as a share of what it may do (dotted): {said}; {kept}."
    return picture("limits", build, f"Joint speeds against their limits over time: {said}.", words)


def histogram_picture(run: Result) -> Picture:
    """How often each point is how far from its place, a row a point."""
    task, errors = run.problem.task, 1e3 * run.evaluation.path.distance

    def build() -> Figure:
        figure = new_figure(0.65 + 0.72 * len(task.points), top=0.2)
        axes = np.atleast_1d(figure.subplots(len(task.points), 1, sharex=True))
        figure.subplots_adjust(hspace=0.62)
        edges = np.linspace(0.0, max(1.02 * float(errors.max()), 1e-3), BINS + 1)
        for i, (axis, name) in enumerate(zip(axes, task.points, strict=True)):
            weights = np.full(len(errors), 100.0 / len(errors))
            axis.hist(errors[:, i], edges, weights=weights, color=COLOURS[i % len(COLOURS)], alpha=0.55)
            axis.hist(errors[:, i], edges, weights=weights, histtype="step", color="black", linewidth=0.8)
            axis.set_title(f"{short(name, 40)}: half below {np.median(errors[:, i]):.1f} mm", fontsize=8.5, pad=2)
            axis.locator_params(axis="y", nbins=3)
        figure.supylabel("share of the frames [%]", fontsize=9)
        axes[-1].set(xlabel="error [mm]", xlim=(0.0, edges[-1]))
        return figure

    return picture("histogram", build, "Histogram of the error of each point over all frames.")


UNITS = (("deg", "cm"), ("deg/s", "cm/s"), ("N m", "N"))
"""Units of angles, speeds and torques of joints that turn, and of the same of joints that slide."""


def joint_pictures(loads: JointLoads) -> list[Picture]:
    """Angles, speeds and torques of all joints over time, and how much of their limits each uses."""
    scale = np.where(loads.prismatic, 100.0, np.rad2deg(1.0))
    speed, effort = loads.limits.velocity * scale, loads.limits.effort
    sliding = " and ".join(str(i + 1) for i in np.flatnonzero(loads.prismatic))
    units = [f"{turns}; {slides} of {sliding}" if sliding else turns for turns, slides in UNITS]
    both = (
        ("angles", "angle", units[0], loads.motion.q * scale, loads.limits.position * scale[:, None]),
        ("speeds", "speed", units[1], loads.motion.v * scale, np.stack([-speed, speed], axis=1)),
        ("torques", "torque", units[2], loads.torque, np.stack([-effort, effort], axis=1)),
    )
    pictures = []
    for key, what, unit, values, limits in both:

        def build(label: str = f"{what} [{unit}]", values: Array = values, limits: Array = limits) -> Figure:
            return joint_figure(loads.time, values, limits, label)

        alt = f"Joint {key} over time, and beside it the range each joint uses within its limits."
        pictures.append(picture(key, build, alt))
    return pictures


def joint_figure(time: Array, values: Array, limits: Array, label: str) -> Figure:
    """Values of shape (T, n) over time, and beside it their range in the limits of shape (n, 2)."""
    n = values.shape[1]
    names = [f"joint {i + 1}" for i in range(n)]
    figure = new_figure(2.5 + legend_room(names), top=legend_room(names) + 0.1)
    left, right = figure.subplots(1, 2, width_ratios=[3.2, 0.55 + 0.13 * n])
    figure.subplots_adjust(wspace=0.42)
    for i, name in enumerate(names):
        left.plot(*thinned(time, values[:, i]), label=name, **line_style(i))
    left.set(xlabel="time [s]", ylabel=label, xlim=(time[0], time[-1]))
    show_ranges(right, values, limits)
    legend_above(figure, left)
    return figure


def show_ranges(axis: Axes, values: Array, limits: Array) -> None:
    """A bar from lowest to highest value of every joint between its limits."""
    for i, (lower, upper) in enumerate(limits):
        colour = COLOURS[i % len(COLOURS)]
        style: dict[str, Any] = {
            "color": GREY,
            "linewidth": 0.8,
            "marker": "_",
            "markersize": 9,
            "markeredgewidth": 1.4,
        }
        axis.plot([i + 1, i + 1], [lower, upper], **style)
        low, high = float(values[:, i].min()), float(values[:, i].max())
        axis.bar(i + 1, high - low, 0.5, low, color=colour, edgecolor="black", linewidth=0.5, zorder=3)
    axis.axhline(0.0, color="black", linewidth=0.5, zorder=1)
    axis.set(xlabel="joint", xticks=range(1, len(limits) + 1), xlim=(0.3, len(limits) + 0.7), title="in its limits")
    axis.title.set_fontsize(8.5)
    axis.tick_params(labelsize=8 if len(limits) < 9 else 6.5)
    axis.grid(visible=False, axis="x")


def convergence_picture(history: History) -> Picture:
    """Best and mean fitness over the iterations, and below it the valid particles."""
    best, mean, valid = history.best, history.mean, history.valid.astype(float)
    steps = np.arange(1, len(best) + 1, dtype=float)
    found = best[np.isfinite(best)]

    def build() -> Figure:
        figure = new_figure(3.2, top=legend_room([BEST, MEAN]))
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
        for k, (values, name) in enumerate(((best, BEST), (mean, MEAN))):
            shown = np.isfinite(values)
            style = line_style(2 * k) | {"marker": "." if shown.sum() == 1 else ""}
            upper.plot(*thinned(steps[shown], values[shown]), label=name, **style)
        upper.set(ylabel="fitness r [m]")
        lower.fill_between(*thinned(steps, valid), step="mid", color=ARM, alpha=0.35, linewidth=0.0)
        lower.plot(*thinned(steps, valid), drawstyle="steps-mid", color=ARM, linewidth=1.0)
        lower.set(ylabel="valid", xlabel="iteration", ylim=(0.0, None), xlim=(1.0, max(len(steps), 2)))
        legend_above(figure, upper)
        return figure

    span = f", from {found[0]:.4g} to {found[-1]:.4g} m" if len(found) else ""
    alt = f"Best fitness over {len(best)} iterations{span}, and the valid particles."
    return picture("convergence", build, alt)
