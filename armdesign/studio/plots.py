"""Curves and gaps as SVG for the page: text in, text out; a click in a plot over time goes to that moment."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from armdesign._types import Array

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 400.0, 132.0, 44.0, 386.0, 20.0, 104.0
MOST = 400
"""Points of a curve at most; of those left out the largest is kept."""
STEPS = (1.0, 2.0, 5.0, 10.0)


class Curve(NamedTuple):
    """A line of a plot.

    Attributes:
        x: Shape (K,).
        y: Shape (K,).
        colour: As CSS has it.
        name: What it is.
    """

    x: Array
    y: Array
    colour: str
    name: str


def thinned(x: Array, y: Array, most: int = MOST) -> tuple[Array, Array]:
    """A curve of fewer points that keeps its peaks.

    Args:
        x: Shape (K,), ascending.
        y: Shape (K,).
        most: How many points may remain.
    """
    if len(x) <= most:
        return x, y
    edges = np.linspace(0, len(x), most + 1).astype(int)
    kept = np.array([low + int(np.argmax(y[low:high])) for low, high in pairwise(edges)])
    return x[kept], y[kept]


def plot(curves: Sequence[Curve], title: str, across: str, *, level: float | None = None, timed: bool = False) -> str:
    """Curves over one axis from 0 up.

    Args:
        curves: The curves.
        title: What is shown, with the unit.
        across: What runs to the right, with the unit.
        level: Height of a dashed line, such as a tolerance.
        timed: Whether it runs over the time of the take, so that a click goes there.
    """
    drawn = [curve for curve in curves if len(curve.x) and np.isfinite(curve.y).all()]
    if not drawn:
        return ""
    start, end = min(c.x[0] for c in drawn), max(c.x[-1] for c in drawn)
    end = end if end > start else start + 1.0
    top = max(1e-9, *(float(c.y.max()) for c in drawn), level or 0.0) * 1.05
    up = (BOTTOM - TOP) / top
    wide = (RIGHT - LEFT) / (end - start)
    parts = [f'<text x="{LEFT}" y="13" font-weight="600">{escape(title)}</text>']
    for tick in ticks(top):
        height = BOTTOM - up * tick
        parts.append(f'<path d="M{LEFT} {height:.1f}H{RIGHT}" stroke="#e2e5e9"/>')
        parts.append(f'<text x="{LEFT - 4}" y="{height + 3.5:.1f}" text-anchor="end">{tick:g}</text>')
    step = ticks(end - start)[1]
    for tick in step * np.arange(np.ceil(start / step - 1e-9), np.floor(end / step + 1e-9) + 1.0) + 0.0:
        parts.append(
            f'<text x="{LEFT + wide * (tick - start):.1f}" y="{BOTTOM + 12}" text-anchor="middle">{tick:.6g}</text>'
        )
    parts.append(f'<text x="{RIGHT}" y="{HEIGHT - 2}" text-anchor="end">{escape(across)}</text>')
    if level is not None:
        parts.append(f'<path d="M{LEFT} {BOTTOM - up * level:.1f}H{RIGHT}" stroke="#b00020" stroke-dasharray="4 3"/>')
    for curve in reversed(drawn):  # the first on top
        x, y = thinned(curve.x, curve.y)
        points = " ".join(f"{LEFT + wide * (a - start):.1f},{BOTTOM - up * b:.1f}" for a, b in zip(x, y, strict=True))
        parts.append(f'<polyline points="{points}" fill="none" stroke="{curve.colour}" stroke-width="1.6"/>')
    about = f"{title}: {', '.join(curve.name for curve in drawn)}"
    return frame("".join(parts), about, (start, end) if timed else None)


def gap_picture(names: Sequence[str], seen: Array, time: Array) -> str:
    """When points are seen: a row each, full where in all frames.

    Args:
        names: N names.
        seen: Shares of the frames, shape (N, C).
        time: Frame times, shape (T,) [s].
    """
    rows = min(len(names), 60)
    height = min(14.0, 100.0 / max(rows, 1))
    foot = TOP + rows * height + 12.0
    wide = (RIGHT - LEFT) / max(seen.shape[1], 1)
    parts = [f'<text x="{LEFT}" y="13" font-weight="600">When each point is seen (red: gap)</text>']
    for i in range(rows):
        y = TOP + i * height
        parts.append(
            f'<rect x="{LEFT}" y="{y:.1f}" width="{RIGHT - LEFT}" height="{height * 0.8:.1f}" fill="#7fb3d5"/>'
        )
        if height >= 9.0:
            fit = f' textLength="{LEFT - 6}" lengthAdjust="spacingAndGlyphs"' if len(names[i]) > 7 else ""
            label = f'<text x="{LEFT - 4}" y="{y + 9:.1f}" text-anchor="end"{fit}>{escape(names[i][:8])}</text>'
            parts.append(label)
        for c in np.flatnonzero(seen[i] < 1.0):
            shade = 0.35 + 0.65 * (1.0 - seen[i, c])
            parts.append(
                f'<rect x="{LEFT + c * wide:.1f}" y="{y:.1f}" width="{max(wide, 1.0):.1f}" '
                f'height="{height * 0.8:.1f}" fill="#b00020" opacity="{shade:.2f}"/>'
            )
    parts.append(f'<text x="{LEFT}" y="{foot}">{time[0]:.4g} s</text>')
    parts.append(f'<text x="{RIGHT}" y="{foot}" text-anchor="end">{time[-1]:.4g} s</text>')
    share = f"{100.0 * float(seen.mean()):.0f} %" if seen.size else "none"
    about = f"When each point is seen, {share} in all"
    return frame("".join(parts), about, (float(time[0]), float(time[-1])), foot + 3.0)


def frame(inner: str, about: str, time: tuple[float, float] | None, height: float = HEIGHT) -> str:
    """The picture around its content.

    Args:
        inner: SVG.
        about: What is shown, for who cannot see it.
        time: From when to when it runs [s]; None where it does not run over time.
        height: Of the picture.
    """
    data = f'data-start="{time[0]}" data-end="{time[1]}" data-left="{LEFT}" data-right="{RIGHT}" ' if time else ""
    return (
        f'<svg {data}data-width="{WIDTH}" viewBox="0 0 {WIDTH:g} {height:g}" role="img" '
        f'aria-label="{escape(about, quote=True)}">{inner}</svg>'
    )


def ticks(top: float) -> list[float]:
    """Round numbers from 0 to a top, four at most beyond 0."""
    raw = top / 4.0
    power = 10.0 ** np.floor(np.log10(raw))
    step = next(float(each * power) for each in STEPS if each * power >= raw)
    return [float(f"{k * step:.10g}") for k in range(int(top / step) + 1)]
