"""What can be odd about the rows of any table, in words."""

from __future__ import annotations

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import Rows
from armdesign.demonstration.recording import Step


def row_steps(rows: Rows, announced: int | None = None) -> list[Step]:
    """An incomplete last row, short ones, another number of rows than the header says.

    Args:
        rows: The rows.
        announced: Number of frames that the header announces; None where it does not.
    """
    steps = []
    if rows.cut is not None:
        sentence = f"The file ends in the middle of line {rows.cut}, which was left out: it may have been cut off."
        steps.append(Step("cut", sentence, {"line": rows.cut}))
    if rows.short:
        sentence = f"Lines that stop early: {rows.short}; what is missing in them was taken as not seen."
        steps.append(Step("short", sentence, {"lines": rows.short}))
    return [*steps, *count_steps("frames", announced, len(rows.values))]


def count_steps(what: str, announced: int | None, found: int) -> list[Step]:
    """Another number than the header says.

    Args:
        what: What is counted.
        announced: Their number in the header; None where it tells none.
        found: Their number in the file, which is taken.
    """
    if announced in (None, found):
        return []
    sentence = f"The header announces {announced} {what}, the file holds {found}."
    name = "count" if what == "frames" else "markers"
    return [Step(name, sentence, {"announced": announced, "found": found})]


def hole_steps(time: Array, steps: Array, sentence: str) -> list[Step]:
    """A word about frames that are left out.

    Args:
        time: Frame times, shape (T,) [s].
        steps: How far each frame is from the one before, in time or in frame numbers, shape (T - 1,).
        sentence: What to say, with ``{places}`` for their number and ``{span}`` for the longest of them.
    """
    holes = np.flatnonzero(steps > 1.5 * np.median(steps)) if len(steps) else np.empty(0, dtype=int)
    if not len(holes):
        return []
    widest = int(holes[np.argmax(steps[holes])])
    span = f"{time[widest]:.3f} s to {time[widest + 1]:.3f} s"
    details = {"holes": len(holes), "from": float(time[widest]), "to": float(time[widest + 1])}
    return [Step("holes", sentence.format(places=len(holes), span=span), details)]


def count(text: str) -> int | None:
    """A number of frames as a header has it; None if it is no such number."""
    return int(text) if text.isdecimal() and len(text) < 16 else None
