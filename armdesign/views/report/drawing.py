"""Matplotlib figures as SVG inside a page: no pyplot, no settings of the user's, the same bytes every time."""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from armdesign._types import Array

COLOURS = ("#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")  # Okabe and Ito, no yellow
DASHES: tuple[Any, ...] = ("-", "--", "-.", ":", (0, (6, 2, 1, 2, 1, 2)), (0, (9, 3)))  # colour alone tells nothing
ARM, HUMAN, GREY = "#0072B2", "#D55E00", "#777777"
WIDTH = 4.8
"""Width of every figure [inch]: two beside each other on a screen, one on a phone, the letters legible in both."""
DOTS_PER_INCH = 150
"""Of figures as PNG."""
MOST_DRAWN = 400
"""Samples of a series that are drawn; more look no different."""
STYLE: dict[str, Any] = {
    "svg.hashsalt": "armdesign",
    "svg.fonttype": "none",
    "text.parse_math": False,
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "grid.linewidth": 0.35,
    "grid.color": "#cccccc",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "legend.handlelength": 3.2,
    "lines.linewidth": 1.4,
    "hatch.linewidth": 0.6,
}
_TAG = re.compile(r"<[^<>]*>")
_IDENTIFIER = re.compile(r'(\bid="|\bhref="#|url\(#)')
_LEFT_OUT = (
    re.compile(r"<!--.*?-->", re.DOTALL),
    re.compile(r"<metadata>.*?</metadata>", re.DOTALL),
    re.compile(r"<defs>\s*<style\b.*?</style>\s*</defs>", re.DOTALL),  # it would hold for the whole page
)


@dataclass(frozen=True)
class Picture:
    """A figure of the page.

    Attributes:
        key: Its name, part of every identifier in it.
        svg: The picture as an ``<svg>`` element without size.
        alt: What it shows, for those who do not see it.
        caption: The text below it.
    """

    key: str
    svg: str
    alt: str
    caption: str = ""


def picture(key: str, build: Callable[[], Figure], alt: str, caption: str = "") -> Picture:
    """Draw a figure for a page.

    Args:
        key: Name of the picture, ASCII letters.
        build: Makes the figure.
        alt: What it shows.
        caption: The text below it.
    """
    content = io.StringIO()
    with own_style():
        build().savefig(content, format="svg", metadata={"Date": None})
    return Picture(key, inlined(content.getvalue(), key), alt, caption)


def png(build: Callable[[], Figure]) -> bytes:
    """Draw a figure as PNG.

    Args:
        build: Makes the figure.
    """
    content = io.BytesIO()
    with own_style():
        build().savefig(content, format="png", dpi=DOTS_PER_INCH, metadata={"Software": None})
    return content.getvalue()


@contextmanager
def own_style() -> Iterator[None]:
    """Figures drawn meanwhile have our style, apart from whatever settings of matplotlib are in force."""
    with mpl.rc_context(), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph")  # the browser has letters that the font at hand lacks
        mpl.rcdefaults()
        parameters: Any = mpl.rcParams
        parameters.update(STYLE)
        yield


def inlined(svg: str, key: str) -> str:
    """An SVG file as an element of a page: as wide as its place, its identifiers its own."""
    head, _, body = svg[svg.index("<svg") :].partition(">")
    found = re.search(r'viewBox="[^"]*"', head)
    view = found.group() if found else ""
    for pattern in _LEFT_OUT:
        body = pattern.sub("", body)
    body = _TAG.sub(lambda tag: _IDENTIFIER.sub(rf"\g<1>{key}-", tag.group().replace("xlink:href=", "href=")), body)
    return f"<svg {view}>{body.strip()}"


def new_figure(
    height: float, *, left: float = 0.66, right: float = 0.1, bottom: float = 0.45, top: float = 0.1
) -> Figure:
    """An empty figure with room around its axes [inch]; a figure that measures its letters takes twice as long."""
    figure = Figure(figsize=(WIDTH, height))
    figure.subplots_adjust(left / WIDTH, bottom / height, 1.0 - right / WIDTH, 1.0 - top / height)
    return figure


def line_style(i: int) -> dict[str, Any]:
    """Colour and dashes of the i-th line."""
    return {"color": COLOURS[i % len(COLOURS)], "linestyle": DASHES[i % len(DASHES)]}


def thinned(time: Array, values: Array, most: int = MOST_DRAWN) -> tuple[Array, Array]:
    """A series with fewer samples and every peak still in it: the lowest and the highest of each stretch.

    Args:
        time: Shape (T,).
        values: Shape (T,).
        most: Samples that may be left.
    """
    if len(values) <= most:
        return time, values
    edges = np.linspace(0, len(values), most // 2 + 1).astype(int)
    kept = {0, len(values) - 1}
    for first, stop in pairwise(edges):
        stretch = np.where(np.isfinite(values[first:stop]), values[first:stop], 0.0)
        kept |= {first + int(stretch.argmin()), first + int(stretch.argmax())}
    chosen = np.array(sorted(kept))
    return time[chosen], values[chosen]


def legend_lines(names: Sequence[str]) -> tuple[int, int]:
    """Columns and lines of a legend above a figure."""
    longest = max(map(len, names), default=1)
    lines = -(-len(names) // max(1, min(62 // (longest + 8), 4)))
    return -(-len(names) // max(lines, 1)), lines  # as even as may be, so that none stands alone in the last line


def legend_room(names: Sequence[str]) -> float:
    """Height that a legend takes above the axes [inch]."""
    return 0.12 + 0.19 * legend_lines(names)[1]


def legend_above(figure: Figure, axis: Axes) -> None:
    """The lines of an axis by name above it, in as many columns as fit, to be read line by line."""
    handles, labels = axis.get_legend_handles_labels()
    columns = legend_lines(labels)[0]
    order = [i for column in range(columns) for i in range(column, len(labels), columns)]  # Matplotlib fills columns
    figure.legend([handles[i] for i in order], [labels[i] for i in order], loc="upper left", ncols=columns,
                  columnspacing=1.4, borderpad=0.2)  # fmt: skip


def short(name: str, length: int = 28) -> str:
    """A name that leaves room for the rest, and that a legend does not take for one to leave out."""
    half = length // 2 - 2
    kept = name if len(name) <= length else f"{name[:half]}...{name[-half:]}"
    plain = "".join(c if c.isprintable() else " " for c in kept)
    return (" " if plain.startswith("_") else "") + plain
