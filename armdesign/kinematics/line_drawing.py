"""Small pictures of paths and arms as SVG text, for the HTML form in which notebooks show things."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from armdesign._types import Array

GREY, DARK = "#b0b0b0", "#202020"
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")  # Okabe and Ito
SIZE, MARGIN = 200.0, 12.0
MOST_PLACES = 200
"""Places of a line that are drawn; more cannot be told apart."""
VIEWS = (("from one side: x and z", 0, 2), ("from above: x and y", 0, 1))


@dataclass(frozen=True, eq=False)
class Line:
    """A line in space.

    Attributes:
        places: Its places in their order, shape (K, 3) [m]; NaN is a gap.
        colour: As CSS writes it.
        name: What a mouse over it shows.
        width: In pixels.
    """

    places: Array
    colour: str = DARK
    name: str = ""
    width: float = 1.5


def drawing(lines: Sequence[Line]) -> str:
    """Lines from one side and from above, at one scale, as two SVG elements.

    Args:
        lines: The first is drawn first, below the others; without any finite place the result is empty.
    """
    every = np.concatenate([line.places for line in lines] or [np.zeros((0, 3))])
    every = every[np.isfinite(every).all(axis=1)]
    if not len(every):
        return ""
    low, high = every.min(axis=0), every.max(axis=0)
    scale = SIZE / max(float((high - low).max()), 1e-3)
    return "".join(view(lines, title, (across, up), low, high, scale) for title, across, up in VIEWS)


def view(lines: Sequence[Line], title: str, plane: tuple[int, int], low: Array, high: Array, scale: float) -> str:
    """One view as an SVG element.

    Args:
        lines: What is drawn.
        title: What a mouse over it shows.
        plane: Indices of the axes to the right and up.
        low: Lowest corner of the box around everything, shape (3,) [m].
        high: Its highest corner, shape (3,) [m].
        scale: Pixels per metre.
    """
    width, height = (2.0 * MARGIN + scale * (high - low)[[*plane]]).round(1)
    drawn = []
    for line in lines:
        step = -(-len(line.places) // MOST_PLACES) or 1
        places = line.places[np.r_[: len(line.places) : step, len(line.places) - 1 : len(line.places)]]
        x = MARGIN + scale * (places[:, plane[0]] - low[plane[0]])
        y = height - MARGIN - scale * (places[:, plane[1]] - low[plane[1]])
        seen = np.isfinite(x) & np.isfinite(y)
        for run in np.split(np.arange(len(x)), np.flatnonzero(np.diff(seen)) + 1):
            if len(run) and seen[run[0]]:
                shown = " ".join(f"{x[k]:.1f},{y[k]:.1f}" for k in run)
                style = f'stroke="{escape(line.colour)}" stroke-width="{line.width:g}"'
                drawn.append(f'<polyline points="{shown}" {style}><title>{escape(line.name)}</title></polyline>')
    head = f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="{height:g}" role="img"'
    style = 'fill="none" stroke-linejoin="round" stroke-linecap="round" style="margin:4px"'
    return f"{head} {style}><title>{escape(title)}</title>{''.join(drawn)}</svg>"


def shown(text: str, picture: str) -> str:
    """A text and a picture as HTML.

    Args:
        text: Plain text, escaped here.
        picture: SVG.
    """
    return f"<div><pre>{escape(text)}</pre>{picture}</div>"
