"""Sheets as figures of Matplotlib, and through it as PDF."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from armdesign.building.sheet import PENS, POINT, Sheet, Words


def figure_of(sheet: Sheet) -> Figure:
    """The sheet as a figure of Matplotlib at its size on paper."""
    width, height = sheet.size
    figure = Figure(figsize=(width / 25.4, height / 25.4))
    axis = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axis.set(xlim=(0.0, width), ylim=(0.0, height))
    axis.axis("off")
    for order, mark in enumerate(sheet.marks):
        if isinstance(mark, Words):
            label = axis.text(
                mark.place[0], mark.place[1], mark.text, ha=mark.align, va="center_baseline",
                fontsize=mark.size * POINT, fontweight="bold" if mark.bold else "normal", family="DejaVu Sans",
                parse_math=False, zorder=order,
            )  # fmt: skip
            if mark.cleared:
                label.set_bbox({"facecolor": "white", "edgecolor": "none", "pad": 1.0})
            continue
        wide, dashes = PENS[mark.pen]
        kind = (0.0, [x * POINT for x in dashes]) if dashes else "-"
        style: dict[str, Any] = {"linewidth": wide * POINT, "linestyle": kind, "zorder": order, "clip_on": False}
        if mark.fill is None:
            drawn: Line2D | Polygon = Line2D(*mark.points.T, color=mark.colour, **style)
        else:
            drawn = Polygon(mark.points, facecolor=mark.fill, edgecolor=mark.colour, joinstyle="round", **style)
        axis.add_artist(drawn)  # its limits are known
    return figure


def pdf_of(sheets: Iterable[Sheet]) -> bytes:
    """Sheets as one PDF file, a page each; the same sheets give the same bytes."""
    content = io.BytesIO()
    with (
        mpl.rc_context({"pdf.fonttype": 42, "lines.scale_dashes": False}),
        PdfPages(content, metadata={"CreationDate": None, "Producer": None, "Creator": "armdesign"}) as pages,
    ):
        for sheet in sheets:
            pages.savefig(figure_of(sheet))
    return content.getvalue()
