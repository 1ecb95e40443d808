"""The report's diagrams: fitness in its parts, errors, joint motion, convergence."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from armdesign._types import Array
from armdesign.feasibility.needs import joint_needs
from armdesign.feasibility.violations import figure as rounded
from armdesign.feasibility.words import pace, sentence
from armdesign.search.result import Result, done
from armdesign.settings import Body
from armdesign.swarm import History
from armdesign.views.report.answers import Worst
from armdesign.views.report.drawing import (
    ARM,
    COLOURS,
    GREY,
    HUMAN,
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
from armdesign.views.report.gaps import ALWAYS, Clearances, Near

LETTER = 0.078
"""Room of a letter [inch]."""
PALE = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.4}
"""Behind a text over what else is drawn there."""
EXACT = 0.05
"""An orientation that is never further off is followed exactly: it is said, not drawn [deg]."""
LEAP = 2.0
"""A first frame from whose error that of the second differs by more is told [mm]."""
STEEP = 3.0
"""A search whose best fitness falls by more than this factor is drawn to a logarithmic scale."""


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


def error_picture(run: Result, worst: Worst) -> Picture:
    """Distance of the tool from the hand over time, with what is allowed; below it the orientation error.

    Args:
        run: The run.
        worst: Where the error is largest; its demonstration is drawn.
    """
    shown, scored = run.problem.demonstrations[worst.demonstration], run.evaluation.demonstrations[worst.demonstration]
    followed, needs = done(run.table, shown, scored), run.problem.settings.needs
    time, miss = followed.time, 1e3 * followed.miss
    allowed = None if needs.hand_tolerance is None else 1e3 * needs.hand_tolerance
    angle = None if followed.angle is None else np.rad2deg(followed.angle)
    exact = angle is not None and float(angle.max()) < EXACT

    def build() -> Figure:
        oriented = angle is not None and not exact
        figure = new_figure(2.5 + (1.1 if oriented else 0.0))
        axes = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1]) if oriented else [figure.subplots()]
        axes[0].plot(*thinned(time, miss), color=ARM)
        axes[0].plot(worst.time, 1e3 * worst.error, "o", color=HUMAN, markersize=6, zorder=4)
        axes[0].set(ylabel="tool to hand [mm]", ylim=(0.0, 1.15 * max(1e3 * worst.error, allowed or 0.0, 1e-3)))
        side = "right" if worst.time > (time[0] + time[-1]) / 2.0 else "left"
        axes[0].annotate(
            f"{1e3 * worst.error:.1f} mm at {worst.time:.2f} s", (worst.time, 1e3 * worst.error),
            (-8 if side == "right" else 8, 3), textcoords="offset points", ha=side, va="bottom",
        )  # fmt: skip
        if allowed is not None:
            bound(axes[0], time, miss, allowed, "allowed: ")
        if angle is not None and oriented:
            axes[1].plot(*thinned(time, angle), color=ARM)
            axes[1].set(
                ylabel="turn [deg]", ylim=(0.0, max(1.15 * float(angle.max()), needs.tolerance_angle or 0.0, 0.1))
            )
            if needs.tolerance_angle is not None:
                bound(axes[1], time, angle, needs.tolerance_angle, "allowed: ")
        axes[-1].set(xlabel="time [s]", xlim=(time[0], time[-1]))
        return figure

    of = f" of {worst.name}" if worst.name else ""
    said = f"at most {1e3 * worst.error:.1f} mm, {worst.at}, on average {miss.mean():.1f} mm"
    said += "" if allowed is None else f"; allowed are {allowed:g} mm"
    words = f"How far the tool is from the hand over time{of}: {said}."
    words += f" Its orientation is followed exactly, to {EXACT:g} deg." if exact else ""
    leap = float(miss[1] - miss[0])  # only the first frame has to reach the hand
    if leap > LEAP and leap > 3.0 * float(np.abs(np.diff(miss[1:])).max(initial=0.0)):
        words += f" It begins at the hand, and is {miss[1]:.1f} mm off one frame later."
    return picture("errors", build, words, words)


def bound(axis: Axes, time: Array, values: Array, value: float, label: str) -> None:
    """A dotted line at what is allowed or asked for, with its value at the end where the curve is further off.

    Args:
        axis: Where.
        time: Times of the figure, shape (T,).
        values: The curve, shape (T,).
        value: Where the line is.
        label: What to write before the value.
    """
    axis.axhline(value, color="black", linewidth=0.9, linestyle=":")
    third = max(1, len(values) // 3)
    left, right = (float(np.abs(part - value).min()) for part in (values[:third], values[-third:]))
    end, side = (time[0], "left") if left >= right else (time[-1], "right")
    axis.annotate(f" {label}{value:g} ", (end, value), (0, 2), textcoords="offset points", ha=side, va="bottom",
                  fontsize=8, bbox=PALE, zorder=5)  # fmt: skip


def clearance_picture(run: Result, found: Clearances) -> Picture | None:
    """How far bodies stay from one another and from obstacles over time; nothing where no distance changes.

    Args:
        run: The run.
        found: How near it comes to what.
    """
    shown, time = found.series, found.time
    if not shown:
        return None
    required = 1e3 * run.problem.settings.body.clearance
    whose = "assumed" if run.problem.settings.body.clearance == Body().clearance else "asked for"
    still = [1e3 * near.value for near in found.least if near.when == ALWAYS and near.gap is None][:1]
    part = next((near for near in found.least if near.gap is not None), None)

    def build() -> Figure:
        names = [*(f"from {name}" for name in shown), *(["unchanging"] if still else [])]
        figure = new_figure(2.4 + legend_room(names), top=legend_room(names) + (0.1 if part else 0.0))
        if part is None:
            axis = figure.subplots()
        else:
            axis, beside = figure.subplots(1, 2, width_ratios=[3.2, 0.9])
            figure.subplots_adjust(wspace=0.42)
            show_parts(beside, part)
        for value in still:
            axis.axhline(value, color=GREY, linewidth=1.0, linestyle="--", label="unchanging")
        for k, (name, each) in enumerate(shown.items()):
            style = line_style(1 + k)
            axis.plot(time, 1e3 * each, label=f"from {name}", **style)
            at = int(each.argmin())
            axis.plot(time[at], 1e3 * each[at], "o", color=style["color"], markersize=5, zorder=4)
        nearest = np.min(list(shown.values()), axis=0)
        bound(axis, time, np.asarray(1e3 * nearest, dtype=float), required, f"{whose}: ")
        top = max(
            1.25 * required, *(1.2 * value for value in still), *(1050.0 * float(each.max()) for each in shown.values())
        )
        low = min(0.0, *still, *(float(1e3 * each.min()) for each in shown.values()))
        axis.set(xlabel="time [s]", ylabel="clearance [mm]", xlim=(time[0], time[-1]), ylim=(1.1 * low, top))
        legend_above(figure, axis)
        return figure

    alt = f"Clearance over time: {'; '.join(near.words for near in found.least)}."
    words = "How far bodies stay from one another and from obstacles, of those whose distance changes; dots: where it "
    words += "is least" + ("; grey: the least of what keeps one distance on this motion" if still else "")
    words += f"; dotted: what is {whose} of bodies"
    words += "; right: the least between parts of the build, which have a rule of their own. " if part else ". "
    words += f"{'. '.join(sentence(near.words) for near in found.least)}."
    return picture("clearance", build, alt, words)


def show_parts(axis: Axes, part: Near) -> None:
    """How near parts of a build come, as a bar, and a dotted line at what they have to keep; to a scale of their own.

    Args:
        axis: Where.
        part: Where they come nearest.
    """
    value, required = 1e3 * part.value, 0.0 if part.gap is None else 1e3 * part.gap.required
    axis.bar(0.0, value, 0.5, color=GREY, edgecolor="black", linewidth=0.5)
    axis.axhline(required, color="black", linewidth=0.9, linestyle=":", zorder=4)
    axis.annotate(f"required: {required:g}", (0.0, required), (0, 2), textcoords="offset points", ha="center",
                  va="bottom", fontsize=7, bbox=PALE, zorder=5)  # fmt: skip
    high = max(value, required + 0.1 * value)
    axis.text(0.0, high, rounded(value), ha="center", va="bottom", fontsize=8)
    axis.set(title="parts [mm]", xticks=[], xlim=(-0.6, 0.6), ylim=(0.0, 1.25 * max(high, 1.5 * required)))
    axis.title.set_fontsize(8.5)
    axis.tick_params(labelsize=8)


def limits_picture(run: Result, loads: JointLoads) -> Picture:
    """Speed of every joint as a share of what it may do, stated or assumed.

    Args:
        run: The run.
        loads: Its smooth motion.
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
    kept = (
        "the limits are kept at no speed"
        if fraction == 0.0
        else f"all limits are kept at {pace(fraction)} of that speed"
    )
    words = f"Speed of each joint as a share of what it may do (dotted): {said}; {kept}."
    return picture("limits", build, f"Joint speeds against their limits over time: {said}.", words)


UNITS = (("deg", "cm"), ("N m", "N"))
"""Units of angles and torques of joints that turn, and of the same of joints that slide."""


def joint_pictures(run: Result, loads: JointLoads) -> list[Picture]:
    """Angles and torques of all joints over time, and how much of its limits each uses.

    Args:
        run: The run.
        loads: What its motion asks of the joints.
    """
    scale = np.where(loads.prismatic, 100.0, np.rad2deg(1.0))
    effort = loads.limits.effort
    sliding = " and ".join(str(i + 1) for i in np.flatnonzero(loads.prismatic))
    units = [f"{turns}; {slides} of {sliding}" if sliding else turns for turns, slides in UNITS]
    stated = None if run.problem.settings.needs.max_torque is None else np.stack([-effort, effort], axis=1)
    both = (
        ("angles", "angle", units[0], loads.motion.q * scale, loads.limits.position * scale[:, None]),
        ("torques", "torque", units[1], loads.torque, stated),
    )
    pictures = []
    for key, what, unit, values, limits in both:

        def build(label: str = f"{what} [{unit}]", values: Array = values, limits: Array | None = limits) -> Figure:
            return joint_figure(loads.time, values, limits, label)

        words = f"{what.capitalize()} of every joint over time"
        load = "gravity and payload included" if loads.payload else "gravity included, without payload"
        words += f", {load}" if what == "torque" else ""
        words += (
            "; its limits are assumed, as in the table."
            if limits is None
            else "; right: what each uses (bar) of its limits."
        )
        pictures.append(picture(key, build, words, words))
    return pictures


def joint_figure(time: Array, values: Array, limits: Array | None, label: str) -> Figure:
    """Values of shape (T, n) over time, and their range in limits of shape (n, 2), where there are any."""
    n = values.shape[1]
    names = [f"joint {i + 1}" for i in range(n)]
    figure = new_figure(2.5 + legend_room(names), top=legend_room(names) + 0.1)
    if limits is None:
        left = figure.subplots()
    else:
        left, right = figure.subplots(1, 2, width_ratios=[3.2, 0.55 + 0.13 * n])
        figure.subplots_adjust(wspace=0.42)
        show_ranges(right, values, limits)
    for i, name in enumerate(names):
        left.plot(*thinned(time, values[:, i]), label=name, **line_style(i))
    left.set(xlabel="time [s]", ylabel=label, xlim=(time[0], time[-1]))
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
    """The best fitness over the candidates tried: when the search found its arm."""
    good = np.isfinite(history.best)
    tried, best = history.evaluations[good].astype(float), history.best[good]
    steep = len(best) > 1 and 0.0 < STEEP * best[-1] < best.max()

    def build() -> Figure:
        figure = new_figure(2.4)
        axis = figure.subplots()
        axis.plot(*thinned(tried, best), drawstyle="steps-post", color=ARM, marker="o" if len(best) == 1 else "")
        axis.set(xlabel="candidates tried", ylabel="best r so far [m]", xlim=(0.0, max(1.0, history.evaluations[-1])))
        if steep:
            axis.set(yscale="log", ylim=(0.9 * float(best[-1]), 1.1 * float(best.max())))
            axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.yaxis.set_major_formatter("{x:g}")
            axis.yaxis.set_minor_formatter(NullFormatter())
        else:
            axis.set_ylim(0.0, 1.1 * float(best.max(initial=1e-3)))
        return figure

    if not len(best):
        return picture("convergence", build, "No valid arm was found.")
    near = int(tried[np.flatnonzero(best <= 1.01 * best[-1])[0]])
    words = f"Best r over the candidates: from {best[0]:.3g} to {best[-1]:.3g} m; after {near:,} it was within 1 % of "
    words += "the end." + (" The scale is logarithmic." if steep else "")
    return picture("convergence", build, words, words)
