"""A dimensioned drawing of the links: the arm unfolded into a plane, every a_i to the right, every d_i upwards.

That is the arm with all twists and angles at zero. Lengths are to scale; the twist alpha_i of a row is written where it
happens. Everything is placed in inches of the drawing, so that the room that labels take is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from armdesign._types import Array
from armdesign.bodies.cylinder import SHORTEST
from armdesign.kinematics.dh import DHTable
from armdesign.views.report.drawing import ARM, HUMAN, WIDTH, Picture, picture

LETTER, LINE = 0.074, 0.165  # room of a letter and of a line of text [inch]
LARGEST = (3.0, 3.0)  # of the arm itself [inch]
HOUSING = (0.13, 0.24)
GAP = 0.07
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


@dataclass(frozen=True)
class Piece:
    """A straight piece of the arm in the drawing.

    Attributes:
        name: ``a`` or ``d`` with its row.
        length: Its length, signed [m].
        start: Where it begins, shape (2,) [inch].
        end: Where it ends, shape (2,) [inch].
    """

    name: str
    length: float
    start: Array
    end: Array

    @property
    def label(self) -> str:
        """Name and length."""
        return f"{self.name} = {1e3 * self.length:.1f}".replace("-", "−")


@dataclass(frozen=True)
class Label:
    """A text in a box of the drawing, its right lower corner at ``corner`` (2,), for the thing at ``target`` (2,)."""

    text: str
    corner: Array
    target: Array

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, bottom, right, top [inch]."""
        x, y = self.corner
        return x - LETTER * len(self.text), y, x, y + LINE


def sketch_picture(table: DHTable) -> Picture:
    """The dimensioned drawing of an arm."""
    signs = " Negative lengths are drawn forwards." if min(table.a.min(), table.d.min()) < 0.0 else ""
    return picture(
        "sketch",
        lambda: sketch(table),
        f"Dimensioned drawing of the {table.dof} joints and the links between them, with the numbers of the table.",
        "The arm laid flat, as if no link were twisted: link lengths a to the right, link offsets d (along the joints' "
        "axes) upwards, to scale, in millimetres. J1, J2, ... are the joints, α the twist about the link before a "
        f"joint.{signs}",
    )


def sketch(table: DHTable) -> Figure:
    """Arm, joints with their twists, and a chain of dimensions below and to the right."""
    pieces, nodes = unfolded(table)
    labels = node_labels(table, nodes)
    width, height = nodes[-1]
    below = stacked([(0.5 * (p.start[0] + p.end[0]), LETTER * len(p.label) + 0.1) for p in pieces if across(p)])
    beside = stacked([(0.5 * (p.start[1] + p.end[1]), LINE + 0.02) for p in pieces if not across(p)])
    longest = max((LETTER * len(p.label) for p in pieces if not across(p)), default=0.0) + 0.15
    low = np.array([min(-0.35, *(label.extent[0] for label in labels)), -0.45 - LINE * (1 + max(below, default=-1))])
    high = np.array([width + 0.35 + longest * (1 + max(beside, default=-1)), height + 0.3])
    high[1] = max(high[1], *(label.extent[3] for label in labels)) + 0.05
    low[0], high[0] = low[0] - 0.05, max(high[0], low[0] + WIDTH)
    if any(across(p) for p in pieces):
        low[0] = min(low[0], -0.6)
    figure = Figure(figsize=tuple(high - low))
    axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axis.axis("off")
    draw_arm(axis, pieces, nodes)
    for label in labels:
        draw_label(axis, label)
    draw_chain(axis, [p for p in pieces if across(p)], below, 0)
    draw_chain(axis, [p for p in pieces if not across(p)], beside, 1, width, longest)
    return figure


def across(piece: Piece) -> bool:
    """Whether a piece is drawn to the right."""
    return piece.name.startswith("a")


def unfolded(table: DHTable) -> tuple[list[Piece], Array]:
    """The pieces that have a length, and where the rows end, shape (n + 1, 2) [inch]."""
    size = np.array([np.abs(table.a).sum(), np.abs(table.d).sum()])
    scale = float(np.min(np.array(LARGEST) / np.maximum(size, 1e-9)))
    pieces, nodes, here = [], [], np.zeros(2)
    for i in range(table.dof + 1):
        for k, (name, length) in enumerate((("a", table.a[i]), ("d", table.d[i]))):
            end = here + scale * abs(length) * np.eye(2)[k]
            if abs(length) >= SHORTEST:
                pieces.append(Piece(named(name, i, table), float(length), here, end))
            here = end
        nodes.append(here)
    return pieces, np.array(nodes)


def named(symbol: str, i: int, table: DHTable) -> str:
    """An entry of row i, its index below the line."""
    return f"{symbol} (tool)" if i == table.dof else symbol + str(i).translate(SUBSCRIPTS)


def node_labels(table: DHTable, nodes: Array) -> list[Label]:
    """Joint and twist of every row, up and to the left of where it ends, none over another.

    No piece of the arm can lie there: whatever comes later is to the right, whatever came before is below.
    """
    labels: list[Label] = []
    for i, node in enumerate(nodes):
        name = "tool" if i == table.dof else f"J{i + 1}{' slides' if table.prismatic[i] else ''}"
        degrees = round(float(np.rad2deg(table.alpha[i])), 1) + 0.0
        twist = f"{'α' if i == table.dof else named('α', i, table)} = {degrees:.1f}°".replace("-", "−")
        corner = node + np.array([-HOUSING[0] / 2 - 0.04, 0.06])
        label = Label(f"{name}, {twist}", corner, node)
        while any(overlap(label.extent, other.extent) for other in labels):
            label = Label(label.text, label.corner + np.array([0.0, LINE]), node)
        labels.append(label)
    return labels


def overlap(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    """Whether two boxes share room."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] - 1e-9 and b[1] < a[3] - 1e-9


def stacked(spans: Sequence[tuple[float, float]]) -> list[int]:
    """For labels given by middle and size the first line of several in which each has room."""
    ends: list[float] = []
    lines = []
    for middle, size in spans:
        line = next((k for k, end in enumerate(ends) if end <= middle - size / 2), len(ends))
        ends[line : line + 1] = [middle + size / 2]
        lines.append(line)
    return lines


def draw_arm(axis: Axes, pieces: Sequence[Piece], nodes: Array) -> None:
    """Tubes, housings of the joints about their axes, the base and the tool."""
    for piece in pieces:
        axis.plot(*np.stack([piece.start, piece.end]).T, color=ARM, linewidth=4.5, solid_capstyle="round", zorder=3)
    axis.plot([-0.22, 0.22], [-0.14, -0.14], color="black", linewidth=2.0, zorder=2)
    axis.plot([0.0, 0.0], [-0.14, 0.0], color="black", linewidth=2.0, zorder=2)
    width, height = HOUSING
    for x, y in np.unique(nodes[:-1], axis=0):
        place = (x - width / 2, y - height / 2)
        housing = Rectangle(place, width, height, facecolor="white", edgecolor="black", linewidth=1.2, zorder=4)
        axis.add_patch(housing)
        axis.plot([x, x], [y - 0.2, y + 0.2], color="black", linewidth=0.7, linestyle="-.", zorder=5)
    axis.plot(*nodes[-1], marker="o", markersize=7, color="white", markeredgecolor=HUMAN, markeredgewidth=2, zorder=5)


def draw_label(axis: Axes, label: Label) -> None:
    """A text and, where it had to move away, a line to what it is about."""
    x, y = label.corner
    axis.text(x, y, label.text, ha="right", va="bottom", zorder=6)
    if label.corner[1] - label.target[1] > LINE:
        axis.plot([x + 0.03, x + 0.03, label.target[0]], [y + 0.1, y, label.target[1]], color="#777777", linewidth=0.6)


def draw_chain(
    axis: Axes, pieces: Sequence[Piece], lines: Sequence[int], along: int, width: float = 0.0, step: float = 0.0
) -> None:
    """Dimensions beside one another, below the arm (along 0) or to its right (along 1)."""
    place = width + 0.3 if along else -0.36
    style = {"arrowstyle": "<->", "color": "black", "lw": 0.7, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}
    for piece, line in zip(pieces, lines, strict=True):
        ends = [piece.start[along], piece.end[along]]
        for end, corner in zip(ends, (piece.start, piece.end), strict=True):
            stretch = [[end, end], [corner[1 - along], place]]
            axis.plot(*(stretch[::-1] if along else stretch), color="#777777", linewidth=0.4, zorder=1)
        tips = [(place, end) if along else (end, place) for end in ends]
        if ends[1] - ends[0] > 0.16:
            axis.annotate("", tips[0], tips[1], arrowprops=style)
        else:
            axis.plot(*np.array(tips).T, color="black", linewidth=2.2, solid_capstyle="butt")
        middle = 0.5 * sum(ends)
        if along:
            axis.text(place + 0.08 + line * step, middle, piece.label, ha="left", va="center")
        else:
            axis.text(middle, place - 0.06 - line * LINE, piece.label, ha="center", va="top")
