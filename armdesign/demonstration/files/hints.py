"""What a file does not say and a user may: its frame rate, its unit of time, the order of its quaternions."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from armdesign.demonstration.files.formats.frame_clock import MAX_RATE
from armdesign.demonstration.recording import MIN_FRAMES, TIME_UNITS, Step, Take, describe_bad_step, first_bad_step
from armdesign.errors import RecordingError, SettingsError

_LONG, _MARGIN = 100_000, 10.0  # frames; [s] kept at either end, for gaps and filters
_LONG_AGO = 1e8  # [s] times that count from 1970
ORDERS = ("xyzw", "wxyz")
LEAST_CONFIDENCE = 0.5
"""Confidence or visibility below which a point counts as not seen, where nothing else is asked for."""


@dataclass(frozen=True)
class Hints:
    """What to know about a file that it does not say itself.

    Attributes:
        rate: Frames per second of a file without times [1/s]; others keep theirs.
        time_unit: Unit of its times, ``s``, ``ms``, ``us`` or ``ns``; None for what the file says, or seconds.
        quaternions: Order of quaternions whose columns do not say it, ``xyzw`` or ``wxyz``.
        confidence: Confidence or visibility, from 0 to 1, below which a point counts as not seen.
        start: First time that is wanted [s]; of a long take only what lies near is looked at. None for all.
        stop: Last time that is wanted [s]; None for all.
    """

    rate: float | None = None
    time_unit: str | None = None
    quaternions: str | None = None
    confidence: float = LEAST_CONFIDENCE
    start: float | None = None
    stop: float | None = None

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            SettingsError: One is not allowed.
        """
        if self.rate is not None and not (math.isfinite(self.rate) and 0 < self.rate <= MAX_RATE):
            message = f"the frame rate is {self.rate:g}"
            raise SettingsError(message, value=self.rate, allowed=f"above 0, up to {MAX_RATE:g}")
        for what, value, known in (
            ("time_unit", self.time_unit, tuple(TIME_UNITS)), ("quaternions", self.quaternions, ORDERS)
        ):  # fmt: skip
            if value is not None and value not in known:
                raise SettingsError(f"{what} is '{value}'", value=value, allowed=", ".join(known))
        if not 0 <= self.confidence <= 1:
            raise SettingsError(f"confidence is {self.confidence}", value=self.confidence, allowed="0 to 1")


def completed(take: Take, hints: Hints) -> Take:
    """A take with times in seconds and quaternions x, y, z, w, by what was said of it.

    Args:
        take: As the reader gives it.
        hints: What was said.

    Raises:
        RecordingError: The file holds no times, and no rate was given.
    """
    return _wanted(_with_quaternions(_with_times(take, hints), hints), hints)


def _with_times(take: Take, hints: Hints) -> Take:
    """Frame numbers divided by the rate, or times in seconds."""
    if not take.timed:
        if hints.rate is None:
            message = f"{take.source} ({take.format}) holds no times, so its frame rate is unknown"
            fix = "Say it with --rate, such as --rate 100, or add a column 'time' in seconds"
            raise RecordingError(message, value=None, allowed=f"a rate up to {MAX_RATE:g} frames per second", fix=fix)
        sentence = f"The file holds no times: frames follow at {hints.rate:g} frames/s, as asked for."
        step = Step("rate", sentence, {"rate": hints.rate})
        return replace(take, time=take.time / hints.rate, rate=hints.rate, timed=True, steps=(*take.steps, step))
    unit = hints.time_unit or take.time_unit
    factor, steps = TIME_UNITS[unit], list(take.steps)
    time, rate = take.time, take.rate
    if factor != 1.0:
        why = "as the file says" if hints.time_unit is None else "as asked for"
        steps.append(Step("time-unit", f"Times are in {unit}, {why}; multiplied by {factor:g}.", {"unit": unit}))
        rate = None if rate is None else rate / factor
    if take.captured and len(time) and abs(time[0]) * factor > _LONG_AGO:
        steps.append(Step("start", f"Times count from the first frame, at {time[0] * factor:.6f} s in the file."))
        time = time - time[0]
    if time is take.time and factor == 1.0:
        return take
    bad = first_bad_step(time * factor)
    if bad is not None:
        message = f"{take.source}, frame {bad + 1}: {describe_bad_step(time * factor, bad)}"
        raise RecordingError(message, value=bad, fix="Correct the times")
    return replace(take, time=time * factor if factor != 1.0 else time, rate=rate, steps=tuple(steps))


def _wanted(take: Take, hints: Hints) -> Take:
    """Of a long take the part that is wanted, with a margin; others are cropped when they have been cleaned."""
    if len(take.time) <= _LONG or (hints.start is None and hints.stop is None):
        return take
    low, high = (
        -math.inf if hints.start is None else hints.start - _MARGIN,
        math.inf if hints.stop is None else hints.stop + _MARGIN,
    )
    part = slice(*np.searchsorted(take.time, [low, high]).tolist())
    time = take.time[part].copy()
    if len(time) < MIN_FRAMES or len(time) == len(take.time):
        return take
    sentence = f"Of {len(take.time):,} frames only those from {time[0]:.2f} s to {time[-1]:.2f} s were looked at."
    return replace(
        take,
        time=time,
        points={name: values[part].copy() for name, values in take.points.items()},
        orientations={name: values[part].copy() for name, values in take.orientations.items()},
        confidence={name: values[part].copy() for name, values in take.confidence.items()},
        steps=(*take.steps, Step("part", sentence, {"frames": len(take.time)})),
    )


def _with_quaternions(take: Take, hints: Hints) -> Take:
    """Quaternions whose order was not said put in order; left out where that is still unknown."""
    unknown = [name for name in take.orientations if name in take.unordered]
    if not unknown:
        return take
    turns = dict(take.orientations)
    known = hints.quaternions or take.usual_order
    if known is None:
        for name in unknown:
            del turns[name]
        sentence = (
            "Orientations were left out, as the columns do not tell the order of their four numbers: say "
            "--quaternions xyzw or --quaternions wxyz."
        )
    else:
        order = [known.index(letter) for letter in "xyzw"]
        turns |= {name: np.asarray(turns[name])[:, order] for name in unknown}
        why = "as asked for" if hints.quaternions else f"as is usual for {take.format} (otherwise use --quaternions)"
        sentence = f"Quaternions were taken as {', '.join(known)}, {why}."
    step = Step("quaternions", sentence, {"names": unknown, "order": known})
    return replace(take, orientations=turns, unordered=frozenset(), steps=(*take.steps, step))
