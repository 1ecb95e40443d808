"""Labels of a drawing that cover neither one another nor lines of one another, and what is drawn.

Everything that is drawn is known as boxes of text and as straight lines. A label tries its places in order, the
nearest first, and takes the first with room; far enough out there always is some, since nothing limits a view.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.building.sheet import LETTER, Box, Sheet, text_width

MARGIN = 0.7
"""Between a text and anything else [mm]."""
RAYS = tuple(np.deg2rad([45, 135, -45, -135, 20, 160, -20, -160, 70, 110, -70, -110, 0, 180, 90, -90]))
MORE_RAYS = tuple(np.deg2rad(np.arange(0.0, 360.0, 4.0)))
RINGS = tuple(float(x) for x in np.arange(6.0, 40.0, 4.0)) + tuple(np.geomspace(40.0, 600.0, 16).tolist())
OFFSETS = (8.0, 13.0, 18.0, 24.0, 30.0, 36.0, 43.0, 50.0, 58.0, 66.0)
"""Of dimension lines from what they measure [mm]."""
TINY = 1e-12


@dataclass
class Labels:
    """A drawing with what its labels have to keep clear of.

    Attributes:
        sheet: What is drawn on.
        boxes: Of texts.
        lines: What texts must not cover: starts and ends of straight lines, shape (k, 2, 2) [mm].
    """

    sheet: Sheet
    boxes: list[Box] = field(default_factory=list)
    lines: Array = field(default_factory=lambda: np.zeros((0, 2, 2)))

    def keep_clear(self, *points: ArrayLike) -> None:
        """No text shall cover a line through points, shape (2,) each [mm]."""
        through = np.array(points, dtype=float)
        self.lines = np.concatenate([self.lines, np.stack([through[:-1], through[1:]], axis=1)])

    def with_room(self, boxes: Array, lines: Array) -> NDArray[np.bool_]:
        """Which places of a text cover nothing, and have lines that cross no text.

        Args:
            boxes: Of the text, left, bottom, right, top, shape (m, 4) [mm].
            lines: What comes with it in each place, shape (m, k, 2, 2) [mm].

        Returns:
            Shape (m,).
        """
        texts = np.reshape(self.boxes, (-1, 4))
        apart = np.any((boxes[:, None, :2] >= texts[:, 2:]) | (texts[:, :2] >= boxes[:, None, 2:]), axis=2)
        covers = np.any(~apart, axis=1) | np.any(crossing(self.lines, boxes), axis=1)
        crossed = np.any(crossing(lines.reshape(-1, 2, 2), texts), axis=0).reshape(lines.shape[:2])
        room: NDArray[np.bool_] = ~(covers | np.any(crossed, axis=1))
        return room

    def leader(self, text: str, target: ArrayLike, size: float = LETTER, *, line: bool = True) -> Box:
        """A text beside a place, with a line to it where it is not close by.

        Args:
            text: The text.
            target: What it is about, shape (2,) [mm].
            size: Of the letters [mm].
            line: Whether the line ends in a dot on its target, so that it is always drawn.
        """
        at, width = np.asarray(target, dtype=float), text_width(text, size)
        for rays, strict in ((RAYS, True), (MORE_RAYS, True), (RAYS, False)):
            ways = np.stack([np.cos(rays), np.sin(rays)], axis=1)
            aside = np.stack([np.sign(np.round(ways[:, 0], 6)) * width / 2.0, np.zeros(len(ways))], axis=1)
            for ring in RINGS:
                middles, ends = at + ring * ways + aside, at + (ring - 1.0) * ways
                boxes, drawn = text_boxes(middles, width, size), line or ring > RINGS[1]
                lines = np.stack([np.broadcast_to(at, ends.shape), ends], axis=1)[:, None]
                free = np.flatnonzero(self.with_room(boxes, lines[:, : drawn and strict]))
                if len(free):
                    k = free[0]
                    box = self.taken(text, middles[k], Box(boxes[k].tolist()), size)
                    if drawn:
                        self.sheet.line(at, ends[k])
                        self.keep_clear(at, ends[k])
                    return box
        raise AssertionError("there is room far out")  # nothing is drawn 600 mm from what it is about

    def dimension(self, text: str, start: ArrayLike, end: ArrayLike, *, lines_only: bool = False) -> Box:
        """A dimension line along a straight piece, on the left of it if there is room, else on its right.

        Its arrows and the text are between the ends; where these are too close, outside. Where its lines
        would cross texts everywhere, a leader.

        Args:
            text: The dimension.
            start: One end of the piece, shape (2,) [mm].
            end: The other.
            lines_only: Rather let its lines cross texts than take a leader, which does not show what is measured.
        """
        p, q = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        span, width = float(np.linalg.norm(q - p)), text_width(text, LETTER)
        along = (q - p) / max(span, 1e-9)
        across = np.array([-along[1], along[0]])
        reach = min(width / max(abs(along[0]), 1e-9), LETTER / max(abs(along[1]), 1e-9)) + 2.0 * MARGIN
        inside = span > 7.0 + reach
        beside = 7.0 + reach / 2.0
        ends = [(q + beside * along, p - 6.0 * along, q + 7.0 * along),
                (p - beside * along, p - 7.0 * along, q + 6.0 * along)]  # fmt: skip
        ends = [((p + q) / 2.0, p, q)] if inside else ends
        near, far = OFFSETS[:5], OFFSETS[5:]
        order = [*product((1.0,), near), *product((-1.0,), near), *product((1.0, -1.0), far)]
        for strict, (side, offset) in product((True, False)[: 1 + lines_only], order) if span > TINY else ():
            by = side * offset * across
            for middle, *line in ends:
                box = text_boxes(middle + by, width, LETTER)
                feet, over = side * across, by + side * across
                lines = np.array([np.array(line) + by, (p + feet, p + over), (q + feet, q + over)])
                if self.with_room(box[None], lines[None, : 3 * strict])[0]:
                    for piece in lines:
                        self.sheet.line(*piece)
                        self.keep_clear(*piece)
                    self.sheet.arrow(p + by, -along if inside else along)
                    self.sheet.arrow(q + by, along if inside else -along)
                    return self.taken(text, middle + by, Box(box.tolist()), LETTER)
        return self.leader(text, (p + q) / 2.0)

    def taken(self, text: str, middle: Array, box: Box, size: float) -> Box:
        """Draw a text in its box, where there is room, letters of a size about a middle, shape (2,) [mm]."""
        self.sheet.text(text, middle, size=size, cleared=True)
        self.boxes.append(box)
        return box


def text_boxes(middles: Array, width: float, height: float) -> Array:
    """The room of a text about middles, shape (..., 2), with what keeps it apart from others, shape (..., 4) [mm]."""
    half = np.array([width / 2.0 + MARGIN, height / 2.0 + MARGIN])
    return np.concatenate([middles - half, middles + half], axis=-1)


def crossing(lines: Array, boxes: ArrayLike) -> NDArray[np.bool_]:
    """Which straight lines share more than their border with boxes.

    Args:
        lines: Starts and ends, shape (k, 2, 2) [mm].
        boxes: Left, bottom, right, top, shape (4,) or (m, 4) [mm].

    Returns:
        Shape (k,) or (m, k).
    """
    edges = np.asarray(boxes, dtype=float)[..., None]
    enters, leaves = np.zeros(len(lines)), np.ones(len(lines))  # shares of the way at which it does
    for k in range(2):
        start, way = lines[:, 0, k], lines[:, 1, k] - lines[:, 0, k]
        way = np.where(way == 0.0, TINY, way)
        one, other = (edges[..., k, :] - start) / way, (edges[..., k + 2, :] - start) / way
        enters, leaves = np.maximum(enters, np.minimum(one, other)), np.minimum(leaves, np.maximum(one, other))
    crossed: NDArray[np.bool_] = enters < leaves
    return crossed
