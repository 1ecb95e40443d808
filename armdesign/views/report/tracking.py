"""How well the exported arm follows the hand in a physics simulation, as a figure."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from armdesign.export.trajectory.simulation import Tracking
from armdesign.search.result import Result
from armdesign.views.report.drawing import (
    GREY,
    Picture,
    legend_above,
    legend_room,
    line_style,
    new_figure,
    picture,
    thinned,
)


def tracking_picture(run: Result, tracking: Tracking) -> Picture:
    """Distance of the simulated end-effector to the demonstrated hand, and to the pose that the servos aim at."""
    error, servo = 1e3 * tracking.error, 1e3 * tracking.servo_error

    def build() -> Figure:
        names = ["to the demonstrated hand", "to the pose asked for"]
        figure = new_figure(2.4 + legend_room(names), top=legend_room(names))
        axis = figure.subplots()
        axis.plot(*thinned(tracking.time, error), label=names[0], **line_style(0))
        axis.plot(*thinned(tracking.time, servo), label=names[1], **line_style(2))
        axis.axhline(1e3 * design_error(run), color=GREY, linewidth=0.8, linestyle=":")
        axis.set(xlabel="time in the simulation [s]", ylabel="distance [mm]", ylim=(0.0, None))
        axis.set(xlim=(tracking.time[0], tracking.time[-1]))
        legend_above(figure, axis)
        return figure

    saturated = ", ".join(f"joint {i + 1}" for i in np.flatnonzero(tracking.saturated > 0.0))
    caption = (
        "The arm under position control in MuJoCo, with gravity: its end-effector stays "
        f"{error.mean():.1f} mm from the demonstrated hand on average and {error.max():.1f} mm at worst, and "
        f"{servo.mean():.1f} and {servo.max():.1f} mm from where the joint angles asked for put it. Dotted: the mean "
        f"error of the design itself, {1e3 * design_error(run):.1f} mm. "
        + (f"At the torque limit for a time: {saturated}." if saturated else "No joint reaches its torque limit.")
    )
    return picture("tracking", build, "Tracking error of the simulated arm over time.", caption)


def design_error(run: Result) -> float:
    """Mean error of the hand that the design itself leaves [m]."""
    return float(run.evaluation.path.distance[:, -1].mean())
