"""The drawing of a whole arm: front, top and side view in third angle, with every true length, offset and twist."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody
from armdesign.bodies.cylinder import SHORTEST
from armdesign.building.labels import Labels
from armdesign.building.projection import (
    VIEWS,
    Solid,
    View,
    draw_solids,
    end_on,
    least_shortened,
    posed,
    silhouette,
    slanted,
)
from armdesign.building.sheet import LETTER, SCALES, Box, Sheet, block_box, framed, number
from armdesign.kinematics.dh import DHTable

SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
GAP = 10.0
"""Between views [mm]."""
BEYOND = 5.0
"""How far a joint's axis is drawn beyond its module [mm]."""
WIDTH, TALLEST = 180.0, 150.0
"""Of the drawing without a frame [mm]."""
DRAWN = (380.0, 265.0)
"""Room inside the frame of an A3 sheet [mm]."""
NOTES = (
    "Lengths in mm. Dimensions are true lengths, also where a view shows them shortened.",
    "α: twist about x of the link before the joint. J: joint; dash-dotted: its axis.",
)


@dataclass(frozen=True, eq=False)
class Pose:
    """An arm as it is drawn.

    Attributes:
        arm: The arm.
        q: Its joints, shape (n,) [rad; m of joints that slide].
        turn: Axes of its base in the room as columns, shape (3, 3).
    """

    arm: ArmBody
    q: Array
    turn: Array

    @property
    def table(self) -> DHTable:
        """Its dimensions."""
        return self.arm.table

    @cached_property
    def corners(self) -> Array:
        """Where the pieces of the arm begin and end, shape (2 n + 3, 3) [m]."""
        corners: Array = self.table.skeleton(self.q[None])[0] @ self.turn.T
        return corners

    @cached_property
    def frames(self) -> Array:
        """Axes of base, joints and tool in the room as columns, shape (n + 2, 3, 3)."""
        own = np.concatenate([self.table.base()[None], self.table.frames(self.q)])
        turned: Array = self.turn @ own[:, :3, :3]
        return turned

    @cached_property
    def solids(self) -> list[Solid]:
        """Its solids in the room."""
        return posed(self.arm, self.q, self.turn)


def entry(symbol: str, i: int, table: DHTable) -> str:
    """Name of an entry of row i, as ``a₂`` or ``d tool``."""
    return f"{symbol} tool" if i == table.dof else symbol + str(i).translate(SUBSCRIPTS)


def dimensions(pose: Pose) -> list[tuple[str, Array, Array]]:
    """Every length that is not zero, in millimetres, with the ends of its piece, shape (3,) each [m]."""
    table, corners = pose.table, pose.corners
    found = []
    for i in range(table.dof + 1):
        for k, (symbol, length) in enumerate((("a", table.a[i]), ("d", table.d[i]))):
            start, end = corners[2 * i + k], corners[2 * i + k + 1]
            if np.linalg.norm(end - start) >= SHORTEST:
                slides = " + q" if k and i < table.dof and table.prismatic[i] else ""
                found.append((f"{entry(symbol, i, table)} {number(1e3 * length)}{slides}", start, end))
    return found


def twists(pose: Pose) -> list[tuple[str, Array, Array]]:
    """Every twist in degrees, with the corner it happens at and the direction it turns about, shape (3,) each."""
    table, corners, frames = pose.table, pose.corners, pose.frames
    return [
        (f"{entry('α', i, table)} {number(np.degrees(table.alpha[i]), 2)}°", corners[2 * i + 1], frames[i][:, 0])
        for i in range(table.dof + 1)
    ]


def arm_views(pose: Pose, scale: float) -> list[Sheet]:
    """Front, top and side view, the origin of the base in the origin of each.

    Args:
        pose: The arm.
        scale: Of the drawing.
    """
    factor = 1e3 * scale
    drawn = [Labels(Sheet()) for _ in VIEWS]
    for labels, view in zip(drawn, VIEWS, strict=True):
        outlines = draw_solids(labels.sheet, pose.solids, view, factor)
        for outline in outlines:
            labels.keep_clear(*outline)
        labels.keep_clear(*(factor * view.flat(pose.corners)))
        draw_axes(labels, pose, view, factor)
    for text, start, end in dimensions(pose):
        k = least_shortened(end - start)
        drawn[k].dimension(text, *(factor * VIEWS[k].flat([start, end])))
    for text, corner, about in twists(pose):
        k = int(np.argmax([abs(about @ view.towards) for view in VIEWS]))  # where the twist is seen as it is
        drawn[k].leader(text, factor * VIEWS[k].flat(corner))
    for labels, view in zip(drawn, VIEWS, strict=True):
        for name, middle in joints(pose):
            labels.leader(name, factor * view.flat(middle))
        extent = labels.sheet.extent
        caption = ((extent[0] + extent[2]) / 2.0, extent[1] - LETTER - 1.0)
        labels.sheet.text(view.name, caption, size=3.0)
    return [labels.sheet for labels in drawn]


def joints(pose: Pose) -> list[tuple[str, Array]]:
    """Names of joints and tool, and where they are, shape (3,) each [m]."""
    modules = [solid for solid in pose.solids if solid.name.startswith("module")]
    named = [(f"J{solid.link}", solid.middle) for solid in modules]
    slides = {f"J{i + 1}" for i in range(pose.table.dof) if pose.table.prismatic[i]}
    return [*((f"{n} slides" if n in slides else n, at) for n, at in named), ("tool", pose.corners[-1])]


def draw_axes(labels: Labels, pose: Pose, view: View, factor: float) -> None:
    """Axes of the joints, and the tool.

    Args:
        labels: The view as drawn so far.
        pose: The arm.
        view: How it is looked at.
        factor: Millimetres on paper per metre.
    """
    for solid in pose.solids:
        if not solid.name.startswith("module"):
            continue
        along, middle = factor * view.flat(solid.half), factor * view.flat(solid.middle)
        if end_on(solid.half / np.linalg.norm(solid.half), view):
            crosses = [*((factor * solid.radius + BEYOND / 2.0) * np.eye(2))]
        else:
            crosses = [along + BEYOND * along / np.linalg.norm(along)]
        for reach in crosses:
            labels.sheet.line(middle - reach, middle + reach, pen="axis")
            labels.keep_clear(middle - reach, middle + reach)
    tip = factor * view.flat(pose.corners[-1])
    for cross in ((1.5, 1.5), (1.5, -1.5)):
        labels.sheet.line(tip - cross, tip + cross, pen="outline")


def arranged(views: Sequence[Sheet]) -> tuple[Sheet, list[Box]]:
    """Views in third angle, aligned with one another, and the room that each takes.

    Args:
        views: Front, top and right side view, the same point of the arm in the origin of each.
    """
    front, top, side = (view.extent for view in views)
    left, bottom = min(front[0], top[0]), min(front[1], side[1])
    across = max(front[2], top[2]) + GAP - side[0]
    above = max(front[3], side[3]) + GAP - top[1]
    sheet = Sheet((across + side[2] - left, above + top[3] - bottom))
    places = [np.array(by) - (left, bottom) for by in ((0.0, 0.0), (0.0, above), (across, 0.0))]
    for view, place in zip(views, places, strict=True):
        sheet.put(view, place)
    return sheet, [extent.moved(place) for extent, place in zip((front, top, side), places, strict=True)]


def draw_angled(sheet: Sheet, room: Box, solids: Sequence[Solid], view: View | None = None) -> float:
    """Solids at an angle with the axes of the room beside them, as large as fits.

    Args:
        sheet: What is drawn on.
        room: Where [mm].
        solids: The solids.
        view: How they are looked at; by default from the front right and above.

    Returns:
        Millimetres on paper per metre.
    """
    angled = view or slanted()
    seen = np.concatenate([silhouette(solid, angled) for solid in solids])
    factor = float(np.min((room.size - 8.0) / np.ptp(seen, axis=0)))
    picture = Sheet()
    draw_solids(picture, solids, angled, factor)
    low, high = np.reshape(picture.extent, (2, 2))
    sheet.put(picture, np.array(room[:2]) + room.size / 2.0 - (low + high) / 2.0)
    foot = np.array([room[2] - 8.0, room[1] + 8.0])
    for name, axis in zip("xyz", np.eye(3), strict=True):
        way = 7.0 * angled.flat(axis)
        sheet.line(foot, foot + way)
        sheet.arrow(foot + way, way)
        sheet.text(name, foot + 1.4 * way, size=3.0)
    return factor


def words_of_scale(scale: float) -> str:
    """A scale as drawings have it."""
    return f"{scale:g} : 1" if scale > 1.0 else f"1 : {1.0 / scale:g}"


def arm_drawing(pose: Pose) -> tuple[Sheet, float]:
    """The drawing of an arm without a frame, as wide as a page of text, and where it can be cut in two from above."""
    seen = np.concatenate([solid.corners for solid in pose.solids])
    scale = 0.6 * WIDTH / 1e3 / float(np.ptp(seen, axis=0)[:2].sum())
    sheet, (_, top, side) = arranged(arm_views(pose, scale))
    while sheet.size[0] > WIDTH or sheet.size[1] > TALLEST:
        scale *= 0.85
        sheet, (_, top, side) = arranged(arm_views(pose, scale))
    wide = Sheet((WIDTH, sheet.size[1] + 4.0))
    by = np.array([(WIDTH - sheet.size[0]) / 2.0, 2.0])
    wide.put(sheet, by)
    draw_angled(wide, Box((side[0], top[1], side[2], top[3])).moved(by), pose.solids)
    return wide, float(by[0]) + side[0] - GAP / 2.0


def arm_sheet(pose: Pose, title: str, more: Sequence[tuple[str, str]] = ()) -> Sheet:
    """The drawing of an arm as an A3 sheet, its numbers as a table in the corner that the views leave.

    Args:
        pose: The arm.
        title: What it is called.
        more: Further fields of the title block.
    """
    table = pose.table
    rows = [("row", "α [°]", "a [mm]", "d [mm]", "θ [°]", "drawn at")]
    for i in range(table.dof + 1):
        drawn = "" if i == table.dof else f"J{i + 1} {degrees(pose.q[i])}°"
        if i < table.dof and table.prismatic[i]:
            drawn = f"J{i + 1} {number(1e3 * pose.q[i])} mm"
        lengths = number(1e3 * table.a[i]), number(1e3 * table.d[i])
        name = "tool" if i == table.dof else str(i)
        rows.append((name, degrees(table.alpha[i]), *lengths, degrees(table.theta[i]), drawn))
    widths = (12.0, 22.0, 22.0, 22.0, 22.0, 35.0)
    sheet = Sheet()
    numbers = sheet.table((405.0 - sum(widths), 282.0), widths, rows)
    for k, line in enumerate(NOTES):
        sheet.text(line, (numbers[0], numbers[1] - 4.0 - 5.0 * k), "left", 3.0)
    taken = sheet.extent, block_box([*more, "", ""])
    for scale in SCALES:
        views, places = arranged(arm_views(pose, scale))
        by = np.array([25.0, 282.0 - views.size[1]])
        apart = not any(place.moved(by).overlaps(other) for place in places for other in taken)
        if views.size[0] <= DRAWN[0] and views.size[1] <= DRAWN[1] and apart:
            break
    sheet.put(views, by)
    return framed(sheet, [("title", title), ("scale", words_of_scale(scale)), *more])


def degrees(angle: float) -> str:
    """An angle in degrees."""
    return number(float(np.degrees(angle)), 2)
