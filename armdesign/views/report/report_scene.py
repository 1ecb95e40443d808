"""The arm along its demonstrated motion beside the demonstrator's points: at an angle, and from three sides."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from armdesign._types import Array
from armdesign.search.result import Result
from armdesign.views.report.drawing import HUMAN, WIDTH, Picture, new_figure, picture

INSTANTS = 4
PATH_POINTS = 250
ELEVATION = np.deg2rad(22.0)
VIEWS = (
    ("side", "From the side", 0, 2),
    ("front", "From the front", 1, 2),
    ("top", "From above", 0, 1),
)
SHADES = ("#B9CDDD", "#86AECB", "#4189B9", "#00456E")  # the first instant to the last, also in black and white


@dataclass(frozen=True)
class Scene:
    """What is drawn, in millimetres.

    Attributes:
        corners: Arm skeleton at the instants, shape (k, 2 n + 3, 3).
        human: The demonstrator's arm at the instants, shape (k, p, 3).
        times: The instants, shape (k,) [s].
        hand: Path of the hand, shape (p, 3).
        tip: Path of the end-effector, shape (p, 3).
    """

    corners: Array
    human: Array
    times: Array
    hand: Array
    tip: Array

    @property
    def joints(self) -> Array:
        """Origins of the joints at the instants, shape (k, n, 3)."""
        return self.corners[:, 2:-1:2]

    @property
    def everything(self) -> Array:
        """All points, shape (p, 3)."""
        parts = (self.corners, self.human, self.hand, self.tip)
        return np.concatenate([part.reshape(-1, 3) for part in parts])


def scene_of(run: Result) -> Scene:
    """The arm of a run at instants between which the hand travels equally far."""
    task, q = run.problem.task, run.evaluation.path.q
    travelled = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(task.P[:, -1], axis=0), axis=1))]
    chosen = np.unique(np.searchsorted(travelled, np.linspace(0.0, travelled[-1], INSTANTS)))
    drawn = np.unique(np.linspace(0, len(q) - 1, PATH_POINTS).astype(int))
    return Scene(
        corners=1e3 * run.table.skeleton(q[chosen]),
        human=1e3 * task.arm[chosen],
        times=task.time[chosen],
        hand=1e3 * task.P[drawn, -1],
        tip=1e3 * run.table.skeleton(q[drawn])[:, -1],
    )


def scene_pictures(run: Result) -> list[Picture]:
    """The arm at an angle, then from three sides, each to its own scale."""
    scene = scene_of(run)
    when = ", ".join(f"{t - scene.times[0]:.2f}" for t in scene.times)
    caption = (
        f"The arm at {when} s, from light to dark: joints are dots, the base is the square. Dashed: the "
        "demonstrator's arm at the same times. Dotted: the path of the hand; thin line: the path of the end-effector."
    )
    alt = f"The arm of {run.table.dof} joints at {len(scene.times)} instants of the motion, and the demonstrator's arm"
    pictures = [picture("scene", lambda: slanted(scene), f"{alt}, seen at an angle.", caption)]
    for key, title, across, up in VIEWS:
        axes = f"{'xyz'[across]} and {'xyz'[up]}"

        def build(across: int = across, up: int = up) -> Figure:
            return flat(scene, across, up)

        pictures.append(picture(key, build, f"{alt}, {title.lower()}: {axes}.", f"{title}: {axes} in millimetres."))
    return pictures


def slanted(scene: Scene) -> Figure:
    """The scene at an angle, with the axes at the base and a scale instead of a frame."""
    turn = best_turn(scene.everything)
    points = scene.everything @ turn.T
    tips = 0.2 * float(np.ptp(points, axis=0).max()) * turn.T
    points = np.concatenate([points, tips])
    left, bottom = points.min(axis=0) - (0.0, 0.12 * float(np.ptp(points, axis=0).max()))
    points = np.concatenate([points, [(left, bottom)]])  # room for the scale
    low, high = box(points)
    figure = framed(low, high, left=0.05, right=0.05, bottom=0.05, top=0.05)
    axis = figure.axes[0]
    axis.axis("off")
    draw(axis, scene, turn)
    for name, tip in zip("xyz", tips, strict=True):
        axis.annotate(
            "", 0.8 * tip, (0.0, 0.0), arrowprops={"arrowstyle": "-|>", "color": "black", "lw": 1.0}, zorder=6
        )
        axis.text(tip[0], tip[1], name, ha="center", va="center", zorder=6)
    length = round_length(0.25 * float((high - low)[0]))
    axis.plot([left, left + length], [bottom, bottom], color="black", linewidth=2.5, solid_capstyle="butt")
    axis.text(left, bottom + 0.015 * (high - low)[1], f"{length:g} mm", va="bottom")
    return figure


def flat(scene: Scene, across: int, up: int) -> Figure:
    """The scene from one side."""
    turn = np.eye(3)[[across, up]]
    figure = framed(*box(scene.everything @ turn.T), left=0.72, right=0.1, bottom=0.45, top=0.08)
    axis = figure.axes[0]
    draw(axis, scene, turn)
    axis.set(xlabel=f"{'xyz'[across]} [mm]", ylabel=f"{'xyz'[up]} [mm]")
    axis.locator_params(nbins=6)
    return figure


def framed(low: Array, high: Array, **room: float) -> Figure:
    """A figure with one axes from a low to a high corner, shape (2,) each, both directions to one scale.

    Args:
        low: Lowest corner [mm].
        high: Highest corner [mm].
        room: Left, right, bottom and top margin [inch].
    """
    width = WIDTH - room["left"] - room["right"]
    size = high - low
    height = float(np.clip(width * size[1] / size[0], 2.0, 4.4))
    figure = new_figure(height + room["bottom"] + room["top"], **room)
    axis = figure.subplots()
    spare = np.maximum(np.array([width, height]) / min(np.array([width, height]) / size) - size, 0.0) / 2.0
    (left, bottom), (right, top) = low - spare, high + spare
    axis.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    return figure


def draw(axis: Axes, scene: Scene, turn: Array) -> None:
    """Paths, the demonstrator and the arm, projected by a matrix of shape (2, 3)."""
    axis.plot(*turn @ scene.hand.T, color=HUMAN, linestyle=":", linewidth=1.6, zorder=2)
    axis.plot(*turn @ scene.tip.T, color="black", linewidth=0.7, zorder=2)
    shades = SHADES[-len(scene.times) :]
    dashed: dict[str, Any] = {"color": HUMAN, "linestyle": "--", "linewidth": 0.9, "marker": "^", "markersize": 4}
    for k, shade in enumerate(shades):
        axis.plot(*turn @ scene.human[k].T, zorder=3, **dashed)
        style: dict[str, Any] = {"color": shade, "solid_capstyle": "round", "solid_joinstyle": "round"}
        axis.plot(*turn @ scene.corners[k].T, linewidth=3.6, zorder=4 + 0.1 * k, **style)
        axis.plot(
            *turn @ scene.joints[k].T, "o", color="white", markeredgecolor=shade, markersize=5.5, zorder=4.05 + 0.1 * k
        )
    axis.plot([0.0], [0.0], "s", color="black", markersize=8, zorder=5)


def box(points: Array) -> tuple[Array, Array]:
    """Lowest and highest corner around points of shape (p, 2), with a margin."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.06 * float((high - low).max()) + 1e-6
    return low - margin, high + margin


def best_turn(points: Array) -> Array:
    """The view from a little above in which the points cover most: projection matrix, shape (2, 3)."""
    spread = np.cov(points.T)
    turns = [view(azimuth) for azimuth in np.deg2rad(np.arange(-75.0, 106.0, 15.0))]

    def covered(turn: Array) -> float:
        """Area of the picture that the points cover; of points on a line, how long it is."""
        seen = turn @ spread @ turn.T
        return float(np.linalg.det(seen) + 1e-3 * np.trace(seen) ** 2)

    return max(turns, key=covered)


def view(azimuth: float) -> Array:
    """Right and up of somebody who looks at the origin from an azimuth, shape (2, 3)."""
    c, s = np.cos(azimuth), np.sin(azimuth)
    sin_e, cos_e = np.sin(ELEVATION), np.cos(ELEVATION)
    return np.array([[-s, c, 0.0], [-sin_e * c, -sin_e * s, cos_e]])


def round_length(wanted: float) -> float:
    """1, 2 or 5 times a power of ten, not above what is wanted."""
    power = 10.0 ** np.floor(np.log10(max(wanted, 1e-6)))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= max(wanted, 1e-6) * (1 + 1e-9)))
