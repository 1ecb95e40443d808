"""Frame times out of what a table holds: frame numbers, printed times and a frame rate, which need not agree."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import Rows
from armdesign.demonstration.files.text_files import shown
from armdesign.demonstration.recording import Step, first_bad_step, median_step
from armdesign.errors import RecordingError

MIN_RATE, MAX_RATE = 0.01, 100_000.0  # [1/s]
_LARGEST = 1e9  # frame number or time [s]
_EVEN = 1e-3  # printed times this near to even ones, in frames, are not rounded
_SAME_RATE = 0.01  # rates printed as 60 and meant as 59.94 agree
_LEFT_OUT = "Frames are left out in {places} places, most of them from {span}."
_FIX = "Export the recording again"
_PRINTED = 1.1e-3  # [s] printed times are rounded or cut off to milliseconds or finer
_NUMBERS_LEFT_OUT = "Frame numbers are left out in {places} places, at most from {span}."


class Clock(NamedTuple):
    """Times of all frames."""

    time: Array  # (T,) [s]
    rate: float | None  # that of the header, or of the times where these contradict it [1/s]; None where it has none
    steps: tuple[Step, ...]  # what did not agree and what was made of it


def read_rate(text: str) -> float | None:
    """A frame rate as a header has it; None if it is no rate of a motion recording."""
    try:
        rate = float(text.split(maxsplit=1)[0].replace(",", "."))
    except (ValueError, IndexError):
        return None
    return rate if MIN_RATE <= rate <= MAX_RATE else None


def odd_rate_steps(text: str) -> list[Step]:
    """A step where the frame rate in a header makes no sense."""
    if not text.strip() or read_rate(text) is not None:
        return []
    sentence = f"The header gives '{shown(text.strip())}' as the frame rate, which cannot be; the times were taken."
    return [Step("rate", sentence, {"declared": text.strip()})]


def frame_clock(rows: Rows, frames: int | None, times: int | None, rate: float | None) -> Clock:
    """Times of all frames.

    Printed times count. Where they are rounded, so that they come in uneven steps, even ones are made of the frame
    numbers, at the rate of the header or else at that of the printed times. Where none are printed, they are
    frame numbers over the rate, from 0 on. Frame numbers that are left out leave a hole in the times.

    Args:
        rows: The table.
        frames: Column of the frame numbers; None where there is none.
        times: Column of the times [s]; None where there is none.
        rate: The rate that the header declares [1/s]; None where it does not.

    Raises:
        RecordingError: There are no frames, their times are unknown, or these do not increase.
    """
    check_frames(rows)
    numbers = np.arange(float(len(rows.values))) if frames is None else rows.values[:, frames]
    if times is not None and np.diff(rows.values[:, times][~np.isnan(rows.values[:, times])]).any():
        clock = _printed(rows, numbers, rows.values[:, times], rate)
    elif rate is not None:
        check_increase(rows, numbers, "frame number")
        clock = Clock((numbers - numbers[0]) / rate, rate, ())
    else:
        allowed = f"{MIN_RATE:g} to {MAX_RATE:,.0f} frames per second"
        message = f"{rows.source} tells neither the times of the frames nor a frame rate that makes sense"
        raise RecordingError(message, allowed=allowed, fix=f"Correct the rate in the header. {_FIX}")
    time, found, steps = clock
    if found is not None and _rate_steps(time, found):
        found = float(f"{1.0 / median_step(time):.6g}")
    return Clock(time, found, (*steps, *hole_steps(time, np.diff(time), _LEFT_OUT)))


def hole_steps(time: Array, steps: Array, sentence: str) -> list[Step]:
    """A step where frames are left out.

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


def check_frames(rows: Rows, header: str = "the header") -> None:
    """Turn away a table without rows."""
    if not len(rows.values):
        raise RecordingError(f"{rows.source} holds no frame below {header}", value=0, fix=_FIX)


def check_increase(rows: Rows, values: Array, what: str) -> None:
    """Turn away frame numbers or times, shape (T,), of which one is missing, huge or not larger than the one before."""
    bad = _first_wrong(values)
    if bad is None:
        return
    if np.isnan(values[bad]):
        wrong = "is missing"
    elif abs(values[bad]) > _LARGEST:
        wrong = f"is {values[bad]:.6g}"
    else:
        wrong = f"does not increase, {values[bad]:.12g} comes after {values[bad - 1]:.12g}"
    fix = f"Every frame needs a larger {what} than the one before; two takes in one file have to be split"
    raise RecordingError(f"{rows.place(bad)}: the {what} {wrong}", value=float(values[bad]), fix=fix)


def _first_wrong(values: Array) -> int | None:
    """Index of the first frame number or time that is missing, too large or not larger than the one before."""
    bad = first_bad_step(values)
    large = np.flatnonzero(np.abs(values) > _LARGEST)
    if len(large):
        return int(large[0]) if bad is None else min(bad, int(large[0]))
    return bad


def _printed(rows: Rows, numbers: Array, printed: Array, rate: float | None) -> Clock:
    """Printed times, or even ones in their place."""
    if _first_wrong(numbers) is not None:
        check_increase(rows, printed, "time")
        sentence = "Frame numbers are missing or do not increase; the printed times do, and were taken."
        return Clock(printed.copy(), rate, (Step("frames", sentence), *_rate_steps(printed, rate)))
    grain, seen = _grain(printed), ~np.isnan(printed)
    first, last = np.flatnonzero(seen)[[0, -1]]
    span = float(printed[last] - printed[first])
    with np.errstate(over="ignore"):
        printed_rate = float(f"{(numbers[last] - numbers[first]) / span:.12g}") if span > 0 else 0.0
    for even_rate in (rate, printed_rate if MIN_RATE <= printed_rate <= MAX_RATE else None):
        if even_rate is None:
            continue
        even = (numbers - numbers[first]) / even_rate + printed[first]
        misfit = float(np.abs(even - printed)[seen].max())
        # Times that are exact need no mending; those rounded or cut off lie within one and a half of the last digit.
        if misfit <= _EVEN / even_rate and seen.all() and _first_wrong(printed) is None:
            return Clock(printed.copy(), rate and even_rate, _rate_steps(printed, rate))
        if misfit <= 1.5 * grain + 1e-6:
            digits = max(0, round(-math.log10(grain))) if grain > 0 else 6
            sentence = (
                f"The printed times are rounded to {10.0**-digits:g} s; times were made of the frame numbers at "
                f"{even_rate:.6g} frames/s, which agree with them."
            )
            rounded = Step("times", sentence, {"rounded to": grain, "rate": even_rate})
            return Clock(even, rate and even_rate, (rounded, *_rate_steps(even, rate)))
    check_increase(rows, printed, "time")
    return Clock(printed.copy(), rate, _rate_steps(printed, rate))


def _grain(printed: Array) -> float:
    """What printed times were rounded to [s]: 0.1, 0.01, ...; 0 where they have more digits than that shows."""
    seen = printed[~np.isnan(printed) & (np.abs(printed) <= _LARGEST)]
    for digits in range(6):
        if np.allclose(seen, np.round(seen, digits), rtol=1e-12, atol=1e-9):
            return float(10.0**-digits)
    return 0.0


def _rate_steps(time: Array, declared: float | None) -> tuple[Step, ...]:
    """A step where the header declares another rate than the times have."""
    if declared is None or len(time) < 2:
        return ()
    found = 1.0 / median_step(time)
    if abs(found - declared) <= _SAME_RATE * declared:
        return ()
    sentence = f"The header declares {declared:.6g} frames/s, but the times tell {found:.6g}; the times were taken."
    return (Step("rate", sentence, {"declared": declared, "found": found}),)


def motive_clock(rows: Rows, facts: Mapping[str, str]) -> Clock:
    """Times of all frames.

    Unlike other tables, Motive prints times of frames that it has counted itself. So frame numbers are divided by the
    export frame rate, or by the capture frame rate where that alone fits the printed times; these are taken only where
    line 1 gives no rate.

    Raises:
        RecordingError: There are no frames, a rate makes no sense, or frame numbers or times do not increase.
    """
    check_frames(rows)
    frames, printed = rows.values[:, 0], rows.values[:, 1]
    known = [_motive_rate(facts, name, rows) for name in ("export frame rate", "capture frame rate") if facts.get(name)]
    if not known:
        check_increase(rows, printed, "time")
        sentence = "The file does not tell its frame rate: the printed times are taken, which are rounded."
        return Clock(printed.copy(), None, (Step("times", sentence),))
    check_increase(rows, frames, "frame number")
    rate = next((rate for rate in known if _misfit(frames, printed, rate) <= _tolerance(rate)), known[0])
    time = frames / rate
    every = float(np.median(np.diff(frames))) if len(frames) > 1 else 1.0
    holes = hole_steps(time, np.diff(frames), _NUMBERS_LEFT_OUT)
    return Clock(time, rate / every, (*_misfit_steps(frames, printed, rate, known[0]), *holes))


def _motive_rate(facts: Mapping[str, str], name: str, rows: Rows) -> float:
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


def _misfit_steps(frames: Array, printed: Array, rate: float, declared: float) -> list[Step]:
    """A step where the printed times mean something else, or the capture frame rate fits better."""
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
