"""What is done to a recording before it becomes a task, each reported as a step.

In this order: stretches cut out, signs of quaternions, outliers, gaps, repeated frames, low-pass, crop, resampling,
scale. The low-pass comes before the crop, so that it has something to go on at the ends.

Every function leaves its input alone and returns the new recording with what it did. What to do is declared once, in
the settings of the task.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Literal

from armdesign.demonstration.cleaning.cuts import cut_out, moved_up
from armdesign.demonstration.cleaning.gaps import TIME_TOLERANCE, fill_gaps, seconds
from armdesign.demonstration.cleaning.outliers import take_out_outliers
from armdesign.demonstration.cleaning.repeats import find_repeats, refill_repeats, stale_frames
from armdesign.demonstration.cleaning.signs import unify_quaternions
from armdesign.demonstration.cleaning.smoothing import filter_low_pass, resample
from armdesign.demonstration.recording import MIN_FRAMES, Recording, Step
from armdesign.errors import RecordingError, SettingsError
from armdesign.settings.sections import CLEANING
from armdesign.settings.sections import Task as TaskSettings

Result = tuple[Recording, tuple[Step, ...]]

CLEANING_ENTRIES = tuple(
    entry.name for entry in dataclasses.fields(TaskSettings) if entry.metadata["panel"] == CLEANING
)
"""Names of the settings that say how to clean a recording."""

LOW_PASS = 6.0
"""Cutoff for captured recordings where none is set [Hz]."""


def settled_cleaning(settings: TaskSettings, recording: Recording) -> TaskSettings:
    """The settings with everything decided that they leave to the recording: captured ones are cleaned, others not.

    Args:
        settings: How to clean; None stands for what the recording needs.
        recording: What is to be cleaned.
    """
    captured = recording.about.captured
    usual: float | Literal["off"] = LOW_PASS if captured and recording.rate > 2.0 * LOW_PASS else "off"
    return dataclasses.replace(
        settings,
        outliers=captured if settings.outliers is None else settings.outliers,
        repeats=captured if settings.repeats is None else settings.repeats,
        low_pass=usual if settings.low_pass is None else settings.low_pass,
    )


def clean(recording: Recording, settings: TaskSettings | None = None) -> Result:
    """Do all of it, in the order above; what is not asked for is left out.

    Args:
        recording: Any recording, its last point the hand.
        settings: What to do; by default what the recording needs.

    Raises:
        RecordingError: A gap is too long, a quaternion is zero, or the arm moves over a stretch to be cut out.
        SettingsError: A number is out of range.
    """
    how = settled_cleaning(settings or TaskSettings(), recording)
    crop(recording, how.start, how.stop)  # a senseless part is refused before its gaps are looked at
    start, stop = (moved_up(recording, how.cut, time) for time in (how.start, how.stop))
    recording, steps = cut_out(recording, how.cut)
    recording, more = unify_quaternions(recording)
    for do in _what_to_do(how, recording, start, stop):
        steps += more
        try:
            recording, more = do(recording)
        except RecordingError as error:
            if not any(step.name == "outliers" for step in steps):
                raise
            fix = "Outliers count as not seen; --no-outliers leaves them in"
            raise RecordingError(str(error), value=error.value, fix=fix) from error
    return recording, steps + more


def _what_to_do(
    how: TaskSettings, recording: Recording, start: float | None, stop: float | None
) -> list[Callable[[Recording], Result]]:
    """The functions to call after the cuts, in their order; start and stop as they are after them.

    Frames are told to be repeated before anything is filled, and neither outliers nor gaps go by them.
    """
    low_pass, rate = how.low_pass, how.rate
    repeats = find_repeats(recording) if how.repeats else []
    stale = stale_frames(recording, how.max_gap) if how.repeats else None
    steps: list[Callable[[Recording], Result]] = []
    if how.outliers:
        steps.append(lambda current: take_out_outliers(current, stale))
    steps.append(lambda current: fill_gaps(current, how.max_gap, start, stop, stale))
    if how.repeats:
        steps.append(lambda current: refill_repeats(current, how.max_gap, repeats))
    if low_pass is not None and low_pass != "off":
        steps.append(lambda current: filter_low_pass(current, low_pass))
    steps.append(lambda current: crop(current, start, stop))
    if rate is not None:
        steps.append(lambda current: resample(current, rate))
    if how.scale != 1.0:
        steps.append(lambda current: scale_positions(current, how.scale))
    return steps


def scale_positions(recording: Recording, factor: float) -> Result:
    """Multiply all positions by a factor, as for a mock-up recorded at 1:k or for millimetres.

    Args:
        recording: Any recording.
        factor: The factor.

    Raises:
        SettingsError: The factor is not a positive finite number.
    """
    if not (math.isfinite(factor) and factor > 0):
        raise SettingsError(f"scale is {factor}", value=factor, allowed="a number above 0")
    result = recording.changed(recording.time, lambda positions: positions * factor, lambda quaternions: quaternions)
    return result, (Step("scale", f"Scaled all positions by {factor:.6g}.", {"factor": factor}),)


def crop(recording: Recording, start: float | None = None, stop: float | None = None) -> Result:
    """Keep the frames from ``start`` to ``stop``, both included; the frames keep their times.

    Args:
        recording: Any recording.
        start: First time wanted [s]; None for the recording's first.
        stop: Last time wanted [s]; None for the recording's last.

    Raises:
        SettingsError: Fewer than three frames lie between the two.
    """
    low = -math.inf if start is None else start - TIME_TOLERANCE
    high = math.inf if stop is None else stop + TIME_TOLERANCE
    keep = (recording.time >= low) & (recording.time <= high)
    if keep.sum() < MIN_FRAMES:
        chosen = ", ".join(
            f"{n} is {v} s" for n, v in (("start (--from)", start), ("stop (--to)", stop)) if v is not None
        )
        span = f"times from {seconds(recording.time[0])} to {seconds(recording.time[-1])}, start before stop"
        message = f"{chosen}: that leaves {keep.sum()} frames, a motion takes at least three"
        raise SettingsError(message, value=(start, stop), allowed=span)
    if keep.all():
        return recording, ()
    result = recording.changed(recording.time[keep], lambda positions: positions[keep], lambda q: q[keep])
    first, last = float(result.time[0]), float(result.time[-1])
    return result, (Step("crop", f"Cropped to {seconds(first)} to {seconds(last)}.", {"from": first, "to": last}),)
