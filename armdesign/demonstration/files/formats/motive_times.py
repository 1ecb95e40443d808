"""Frame times of a Motive CSV."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import Rows
from armdesign.demonstration.files.formats.row_steps import hole_steps
from armdesign.demonstration.recording import Step, first_bad_step
from armdesign.errors import RecordingError

_RATES = (0.01, 100_000.0)  # [1/s]
_MAX_FRAME = 1e12
_PRINTED = 1.1e-3  # [s] printed times are rounded or cut off to milliseconds or finer
_LEFT_OUT = "Frame numbers are left out in {places} places, at most from {span}."
_FIX = "Export the take from Motive again"


def frame_times(rows: Rows, facts: Mapping[str, str]) -> tuple[Array, float | None, list[Step]]:
    """Times of all frames.

    Frame numbers are divided by the export frame rate, or by the capture frame rate where that alone fits the printed
    times. The printed times themselves are taken only where line 1 gives no rate.

    Args:
        rows: Frame numbers and printed times in the first two columns.
        facts: Line 1, name in small letters to value.

    Returns:
        Times, shape (T,) [s]; how many frames there are per second [1/s], None where it is not told; what is odd.

    Raises:
        RecordingError: There are no frames, a rate makes no sense, or frame numbers or times do not increase.
    """
    if not len(rows.values):
        raise RecordingError(f"{rows.source} holds no frame below the header", value=0, fix=_FIX)
    frames, printed = rows.values[:, 0], rows.values[:, 1]
    rates = [_rate(facts, name, rows) for name in ("export frame rate", "capture frame rate")]
    known = [rate for rate in rates if rate is not None]
    if not known:
        _check_increase(rows, 1, "time")
        sentence = "The file does not tell its frame rate: the printed times are taken, which are rounded."
        return printed.copy(), None, [Step("times", sentence)]
    _check_increase(rows, 0, "frame number")
    fitting = [rate for rate in known if _misfit(frames, printed, rate) <= _tolerance(rate)]
    rate = (fitting or known)[0]
    time = frames / rate
    every = float(np.median(np.diff(frames))) if len(frames) > 1 else 1.0
    return (
        time,
        rate / every,
        [*_rate_steps(frames, printed, rate, known), *hole_steps(time, np.diff(frames), _LEFT_OUT)],
    )


def _rate(facts: Mapping[str, str], name: str, rows: Rows) -> float | None:
    """A frame rate of line 1; None where it is not there."""
    text = facts.get(name, "")
    if not text:
        return None
    try:
        rate = float(text.replace(",", "."))
    except ValueError:
        rate = math.nan
    if not _RATES[0] <= rate <= _RATES[1]:
        message = f"{rows.source}, line 1: the {name} is '{text[:40]}'"
        allowed = f"{_RATES[0]:g} to {_RATES[1]:.0f} frames per second"
        raise RecordingError(message, value=text, allowed=allowed, fix=f"Correct it. {_FIX}")
    return rate


def _check_increase(rows: Rows, column: int, what: str) -> None:
    """Name the line where the frame number or time is missing, beyond all measure, or does not increase."""
    values = rows.values[:, column]
    wild = np.flatnonzero(~(np.abs(values) <= _MAX_FRAME))
    bad = int(wild[0]) if len(wild) else first_bad_step(values)
    if bad is None:
        return
    if len(wild):
        wrong = "is missing" if np.isnan(values[bad]) else f"is {values[bad]:.6g}"
    else:
        wrong = f"does not increase, {values[bad]:.12g} comes after {values[bad - 1]:.12g}"
    message = f"{rows.place(bad)}: the {what} {wrong}"
    raise RecordingError(message, value=float(values[bad]), fix="Every frame needs a later number than the one before")


def _misfit(frames: Array, printed: Array, rate: float) -> float:
    """Largest distance between printed times and frame / rate, both from the first printed time on [s]."""
    seen = ~np.isnan(printed)
    distance = printed[seen] - frames[seen] / rate
    return float(np.abs(distance - distance[0]).max()) if seen.any() else 0.0


def _tolerance(rate: float) -> float:
    """Distance up to which a printed time means the same frame [s]."""
    return max(0.5 / rate, 2.0 * _PRINTED)


def _rate_steps(frames: Array, printed: Array, rate: float, known: list[float]) -> list[Step]:
    """A word where the printed times mean something else, or the capture frame rate fits better."""
    misfit = _misfit(frames, printed, rate)
    details = {"rate": rate, "misfit": misfit}
    if misfit > _tolerance(rate):
        sentence = (
            f"The printed times do not fit the frame numbers at {rate:.6g} frames/s, the difference grows to "
            f"{misfit:.3g} s: times are frame number / rate."
        )
        return [Step("times", sentence, details)]
    if rate != known[0]:
        sentence = f"Frames are numbered at the capture frame rate of {rate:.6g} frames/s, as the printed times show."
        return [Step("times", sentence, details)]
    return []
