"""Drawings as primitives in millimetres of paper, and the same primitives as SVG and PDF, whose text stays text."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from xml.sax.saxutils import escape

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path
from numpy.typing import ArrayLike

from armdesign._types import Array

A3 = (420.0, 297.0)
"""Width and height [mm]."""
LETTER = 3.5
"""Size of letters, from the foot of a g to the head of an A; capitals are 2.5 mm high, which ISO 3098 asks for."""
PENS: dict[str, tuple[float, tuple[float, ...]]] = {
    "heavy": (0.7, ()),
    "outline": (0.5, ()),
    "thin": (0.25, ()),
    "hidden": (0.25, (2.5, 1.2)),
    "axis": (0.25, (7.0, 1.2, 0.8, 1.2)),
}
"""Width and dashes of lines [mm], by what they mean (ISO 128)."""
AROUND = 48
"""Corners that stand for a circle."""
POINT = 72.0 / 25.4
"""Points in a millimetre."""
SCALES = (10.0, 5.0, 2.0, 1.0, 1 / 2, 1 / 2.5, 1 / 4, 1 / 5, 1 / 10, 1 / 20, 1 / 25, 1 / 50, 1 / 100)
"""Scales that drawings may have, largest first: those of ISO 5455, and two between them."""


class Box(tuple[float, float, float, float]):
    """Left, bottom, right, top [mm]."""

    __slots__ = ()

    @property
    def size(self) -> Array:
        """Width and height."""
        return np.array([self[2] - self[0], self[3] - self[1]])

    def moved(self, by: ArrayLike) -> Box:
        """The box elsewhere."""
        x, y = np.asarray(by, dtype=float)
        return Box((self[0] + x, self[1] + y, self[2] + x, self[3] + y))

    def overlaps(self, other: Box) -> bool:
        """Whether two boxes share room."""
        return self[0] < other[2] and other[0] < self[2] and self[1] < other[3] and other[1] < self[3]


@dataclass(frozen=True)
class Stroke:
    """A line, or a closed outline that covers what was drawn before.

    Attributes:
        points: Shape (k, 2) [mm].
        pen: One of ``PENS``.
        fill: Colour inside, for closed ones; None for a line.
        colour: Of the line.
    """

    points: Array
    pen: str = "thin"
    fill: str | None = None
    colour: str = "black"


@dataclass(frozen=True)
class Words:
    """A text.

    Attributes:
        text: One line.
        place: Where its middle, or its left or right end is, shape (2,) [mm]; half way up.
        align: ``center``, ``left`` or ``right``.
        size: Of the letters [mm].
        bold: Whether it is emphasised.
        cleared: Whether what lies below it is covered.
    """

    text: str
    place: Array
    align: str = "center"
    size: float = LETTER
    bold: bool = False
    cleared: bool = False

    @property
    def box(self) -> Box:
        """The room it takes."""
        width = text_width(self.text, self.size, bold=self.bold)
        left = self.place[0] - width * {"left": 0.0, "center": 0.5, "right": 1.0}[self.align]
        return Box((left, self.place[1] - self.size / 2.0, left + width, self.place[1] + self.size / 2.0))


@dataclass
class Sheet:
    """What is drawn on a piece of paper, in the order in which it is drawn.

    Attributes:
        size: Width and height [mm].
        marks: Strokes and words.
    """

    size: tuple[float, float] = A3
    marks: list[Stroke | Words] = field(default_factory=list)

    def line(self, *points: ArrayLike, pen: str = "thin", colour: str = "black") -> None:
        """A line through points, shape (2,) each [mm]."""
        self.marks.append(Stroke(np.array(points, dtype=float), pen, None, colour))

    def area(self, points: ArrayLike, pen: str = "outline", fill: str = "white") -> None:
        """A closed outline, shape (k, 2) [mm]."""
        self.marks.append(Stroke(np.array(points, dtype=float), pen, fill))

    def text(self, text: str, place: ArrayLike, align: str = "center", size: float = LETTER, **how: bool) -> Words:
        """A line of text; ``bold`` and ``cleared`` as in ``Words``."""
        words = Words(text, np.array(place, dtype=float), align, size, **how)
        self.marks.append(words)
        return words

    def arrow(self, tip: ArrayLike, way: ArrayLike) -> None:
        """A filled arrowhead of 3 mm at a tip, shape (2,) [mm], which points along a way, shape (2,)."""
        end, along = np.asarray(tip, dtype=float), np.asarray(way, dtype=float)
        along = along / np.linalg.norm(along)
        across = np.array([-along[1], along[0]])
        self.area([end, end - 3.0 * along + 0.5 * across, end - 3.0 * along - 0.5 * across], "thin", "black")

    def table(
        self, corner: ArrayLike, widths: Sequence[float], rows: Sequence[Sequence[str]], step: float = 6.0
    ) -> Box:
        """A table, its first row bold; cells that are too long are set smaller.

        Args:
            corner: Its upper left corner, shape (2,) [mm].
            widths: Of its columns [mm].
            rows: Cells.
            step: Height of a row [mm].
        """
        left, top = np.asarray(corner, dtype=float)
        edges = left + np.r_[0.0, np.cumsum(widths)]
        for k, row in enumerate(rows):
            for cell, start, width in zip(row, edges, widths, strict=False):
                size = min(LETTER, LETTER * (width - 2.0) / max(text_width(cell, LETTER, bold=k == 0), 1e-9))
                if cell:
                    self.text(cell, (start + 1.0, top - (k + 0.5) * step), "left", size, bold=k == 0)
        bottom = top - len(rows) * step
        for k in range(len(rows) + 1):
            self.line((left, top - k * step), (edges[-1], top - k * step))
        for x in edges:
            self.line((x, top), (x, bottom))
        return Box((left, bottom, float(edges[-1]), top))

    def put(self, other: Sheet, by: ArrayLike) -> None:
        """What another sheet has, moved.

        Args:
            other: The sheet.
            by: How far, shape (2,) [mm].
        """
        shift = np.asarray(by, dtype=float)
        for mark in other.marks:
            if isinstance(mark, Words):
                self.marks.append(replace(mark, place=mark.place + shift))
            else:
                self.marks.append(replace(mark, points=mark.points + shift))

    @property
    def words(self) -> list[Words]:
        """The texts alone."""
        return [mark for mark in self.marks if isinstance(mark, Words)]

    @property
    def extent(self) -> Box:
        """The room that its marks take."""
        corners = [np.reshape(m.box, (2, 2)) if isinstance(m, Words) else m.points for m in self.marks]
        every = np.concatenate(corners) if corners else np.zeros((1, 2))
        return Box((*every.min(axis=0).tolist(), *every.max(axis=0).tolist()))


@lru_cache(maxsize=4096)
def text_width(text: str, size: float, *, bold: bool = False) -> float:
    """Width of a line in the font that comes with Matplotlib, wider than most that may stand in for it [mm]."""
    font = FontProperties(family="DejaVu Sans", size=size, weight="bold" if bold else "normal")
    return float(text_to_path.get_text_width_height_descent(text, font, ismath=False)[0])


def svg_of(sheet: Sheet) -> str:
    """The sheet as an SVG file at its size on paper; the same sheet gives the same bytes."""
    width, height = sheet.size
    anchors = {"center": "middle", "left": "start", "right": "end"}
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}mm" height="{height:.4g}mm" '
        f'viewBox="0 0 {width:g} {height:.4g}">',
        '<g font-family="DejaVu Sans, Verdana, Arial, sans-serif"><rect width="100%" height="100%" fill="white"/>',
    ]
    for mark in sheet.marks:
        if isinstance(mark, Words):
            left, bottom, right, top = mark.box
            if mark.cleared:
                lines.append(
                    f'<rect x="{left - 0.3:.2f}" y="{height - top - 0.3:.2f}" width="{right - left + 0.6:.2f}" '
                    f'height="{top - bottom + 0.6:.2f}" fill="white"/>'
                )
            weight = ' font-weight="bold"' if mark.bold else ""
            lines.append(
                f'<text x="{mark.place[0]:.2f}" y="{height - mark.place[1] + 0.36 * mark.size:.2f}" '
                f'font-size="{mark.size:.3g}" text-anchor="{anchors[mark.align]}"{weight}>{escape(mark.text)}</text>'
            )
            continue
        wide, dashes = PENS[mark.pen]
        points = " ".join(f"{x:.2f},{height - y:.2f}" for x, y in mark.points)
        dashed = f' stroke-dasharray="{" ".join(f"{x:g}" for x in dashes)}"' if dashes else ""
        kind, fill = ("polyline", "none") if mark.fill is None else ("polygon", mark.fill)
        lines.append(
            f'<{kind} points="{points}" fill="{fill}" stroke="{mark.colour}" stroke-width="{wide:g}"{dashed} '
            'stroke-linejoin="round"/>'
        )
    return "\n".join([*lines, "</g></svg>\n"])


def framed(sheet: Sheet, fields: Sequence[tuple[str, str]]) -> Sheet:
    """An A3 sheet with frame and title block about a drawing.

    Args:
        sheet: What is drawn, in places of the A3 sheet.
        fields: Name and value of every field of the title block, title first, two to a row.
    """
    page = Sheet(A3)
    page.area([(20.0, 10.0), (410.0, 10.0), (410.0, 287.0), (20.0, 287.0)])
    page.put(sheet, (0.0, 0.0))
    block = block_box(fields)
    page.area(np.array(block)[[[0, 1], [2, 1], [2, 3], [0, 3]]])
    for k, (name, value) in enumerate(fields):
        row, column = divmod(k, 2)
        left, top = block[0] + 76.0 * column, block[3] - 9.0 * row
        page.text(name, (left + 1.5, top - 2.0), "left", 2.2)
        size = min(LETTER, LETTER * 72.0 / max(text_width(value, LETTER, bold=k == 0), 1e-9))
        page.text(value, (left + 1.5, top - 6.0), "left", size, bold=k == 0)
        page.line((block[0], top), (block[2] - 28.0, top))
    page.line((block[0] + 76.0, block[1]), (block[0] + 76.0, block[3]))
    page.line((block[2] - 28.0, block[1]), (block[2] - 28.0, block[3]))
    third_angle(page, (block[2] - 14.0, block[3] - 9.0))
    return page


def block_box(fields: Sequence[object]) -> Box:
    """Where the title block for so many fields stands on an A3 sheet."""
    return Box((230.0, 10.0, 410.0, 10.0 + 9.0 * max(-(-len(fields) // 2), 2)))


def third_angle(page: Sheet, middle: ArrayLike) -> None:
    """The symbol of third-angle projection about a middle [mm]: the smaller end of a cone on its view's left."""
    x, y = np.asarray(middle, dtype=float)
    for radius in (2.0, 4.0):
        page.area(circle((x - 6.0, y), radius), "thin", "none")
    page.area([(x + 1.0, y - 2.0), (x + 10.0, y - 4.0), (x + 10.0, y + 4.0), (x + 1.0, y + 2.0)], "thin", "none")
    page.line((x - 11.5, y), (x + 12.0, y), pen="axis")
    page.line((x - 6.0, y - 5.5), (x - 6.0, y + 5.5), pen="axis")


def circle(middle: ArrayLike, radius: float) -> Array:
    """Points of a circle of a radius about a middle, shape (2,); shape (``AROUND``, 2)."""
    angle = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    points: Array = np.asarray(middle, dtype=float) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return points


def number(value: float, digits: int = 1) -> str:
    """A number as drawings have it, to so many digits behind the point: no zeros behind, a true minus sign."""
    text = f"{round(float(value), digits) + 0.0:.{digits}f}".replace("-", "−")
    return text.rstrip("0").rstrip(".") if "." in text else text
