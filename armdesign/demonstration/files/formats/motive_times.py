"""Frame times of a Motive CSV."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import Rows
from armdesign.demonstration.files.formats.frame_clock import (
    MAX_RATE,
    MIN_RATE,
    Clock,
    check_frames,
    check_increase,
    read_rate,
)
from armdesign.demonstration.files.formats.row_steps import hole_steps
from armdesign.demonstration.recording import Step
from armdesign.errors import RecordingError

_PRINTED = 1.1e-3  # [s] printed times are rounded or cut off to milliseconds or finer
_LEFT_OUT = "Frame numbers are left out in {places} places, at most from {span}."


def frame_times(rows: Rows, facts: Mapping[str, str]) -> Clock:
    """Times of all frames.

    Unlike other tables, Motive prints times of frames that it has counted itself. So frame numbers are divided by the
    export frame rate, or by the capture frame rate where that alone fits the printed times; these are taken only where
    line 1 gives no rate.

    Args:
        rows: Frame numbers and printed times in the first two columns.
        facts: Line 1, name in small letters to value.

    Raises:
        RecordingError: There are no frames, a rate makes no sense, or frame numbers or times do not increase.
    """
    check_frames(rows)
    frames, printed = rows.values[:, 0], rows.values[:, 1]
    known = [_rate(facts, name, rows) for name in ("export frame rate", "capture frame rate") if facts.get(name)]
    if not known:
        check_increase(rows, printed, "time")
        sentence = "The file does not tell its frame rate: the printed times are taken, which are rounded."
        return Clock(printed.copy(), None, (Step("times", sentence),))
    check_increase(rows, frames, "frame number")
    rate = next((rate for rate in known if _misfit(frames, printed, rate) <= _tolerance(rate)), known[0])
    time = frames / rate
    every = float(np.median(np.diff(frames))) if len(frames) > 1 else 1.0
    holes = hole_steps(time, np.diff(frames), _LEFT_OUT)
    return Clock(time, rate / every, (*_rate_steps(frames, printed, rate, known[0]), *holes))


def _rate(facts: Mapping[str, str], name: str, rows: Rows) -> float:
    """A frame rate of line 1 [1/s]."""
    text = facts[name]
    rate = read_rate(text)
    if rate is None:
        message = f"{rows.source}, line 1: the {name} is '{text[:40]}'"
        allowed = f"{MIN_RATE:g} to {MAX_RATE:.0f} frames per second"
        fix = "Correct it. Export the take from Motive again"
        raise RecordingError(message, value=text, allowed=allowed, fix=fix)
    return rate


def _misfit(frames: Array, printed: Array, rate: float) -> float:
    """Largest distance between printed times and frame / rate, both from the first printed time on [s]."""
    seen = ~np.isnan(printed)
    distance = printed[seen] - frames[seen] / rate
    return float(np.abs(distance - distance[0]).max()) if seen.any() else 0.0


def _tolerance(rate: float) -> float:
    """Distance up to which a printed time means the same frame [s]."""
    return max(0.5 / rate, 2.0 * _PRINTED)


def _rate_steps(frames: Array, printed: Array, rate: float, declared: float) -> list[Step]:
    """A word where the printed times mean something else, or the capture frame rate fits better."""
    misfit = _misfit(frames, printed, rate)
    if misfit > _tolerance(rate):
        sentence = (
            f"The printed times do not fit the frame numbers at {rate:.6g} frames/s, the difference grows to "
            f"{misfit:.3g} s: times are frame number / rate."
        )
    elif rate != declared:
        sentence = f"Frames are numbered at the capture frame rate of {rate:.6g} frames/s, as the printed times show."
    else:
        return []
    return [Step("times", sentence, {"rate": rate, "misfit": misfit})]
