"""What is done to a recording before it becomes a task, each reported as a step.

In this order: stretches cut out, signs of quaternions, outliers, gaps, repeated frames, low-pass, crop, resampling,
scale. The low-pass comes before the crop, so that it has something to go on at the ends.

Every function leaves its input alone and returns the new recording with what it did. What to do is declared once, in
the settings of the task.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import (
    TIME_TOLERANCE,
    fill_gaps,
    find_repeats,
    refill_repeats,
    seconds,
    stale_frames,
)
from armdesign.demonstration.cleaning.outliers import take_out_outliers
from armdesign.demonstration.cleaning.smoothing import filter_low_pass, resample, unify_quaternions
from armdesign.demonstration.recording import MIN_FRAMES, Recording, Step
from armdesign.errors import RecordingError, SettingsError, counted
from armdesign.settings.sections import CLEANING
from armdesign.settings.sections import Task as TaskSettings

Result = tuple[Recording, tuple[Step, ...]]

CLEANING_ENTRIES = tuple(
    entry.name for entry in dataclasses.fields(TaskSettings) if entry.metadata["panel"] == CLEANING
)
"""Names of the settings that say how to clean a recording."""

LOW_PASS = 6.0  # usual for movements of people (Winter, Biomechanics and Motor Control of Human Movement)
"""Cutoff for captured recordings where none is set [Hz]."""
STILL = 0.005  # [m] what a point may have moved from one end of a cut to the other
STILL_TURN = math.radians(3.0)  # the same of an orientation
STILL_SPEED = 1.0  # [m/s] of the joint, where frames follow so fast that 5 mm would be a jerk
REST = 0.1  # [s] before and behind a cut, in which the hand may move no further than that
Stretch = tuple[float, float]


def settled_cleaning(settings: TaskSettings, recording: Recording) -> TaskSettings:
    """The settings with everything decided that they leave to the recording: captured ones are cleaned, others not.

    Args:
        settings: How to clean; None means what the recording needs.
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

    Repeated frames are found before anything is filled; neither outliers nor gaps are judged by them.
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
        given = (("start (--from)", start), ("stop (--to)", stop))
        chosen = ", ".join(f"{name} is {value} s" for name, value in given if value is not None)
        span = f"times from {seconds(recording.time[0])} to {seconds(recording.time[-1])}, start before stop"
        message = f"{chosen}: that leaves {keep.sum()} frames, a motion takes at least three"
        raise SettingsError(message, value=(start, stop), allowed=span)
    if keep.all():
        return recording, ()
    result = recording.changed(recording.time[keep], lambda positions: positions[keep], lambda q: q[keep])
    first, last = float(result.time[0]), float(result.time[-1])
    return result, (Step("crop", f"Cropped to {seconds(first)} to {seconds(last)}.", {"from": first, "to": last}),)


@dataclass(frozen=True)
class Cut:
    """A stretch that is taken out."""

    last: int  # frame before it
    next: int  # frame behind it
    shift: float  # by how much the later times move up [s]


def cut_out(recording: Recording, stretches: Sequence[Stretch]) -> tuple[Recording, tuple[Step, ...]]:
    """Take out the frames strictly between two times, for each pair; later times move up to one step behind.

    Args:
        recording: Any recording, its last point the hand; gaps within a stretch do not matter.
        stretches: Pairs of times in the recording [s].

    Raises:
        SettingsError: A stretch has no frames, overlaps another or reaches an end of the recording.
        RecordingError: The arm has moved from one end of a stretch to the other; the message says by how much.
    """
    cuts = plan_cuts(recording, stretches)
    if not cuts:
        return recording, ()
    keep = np.ones(recording.frames, dtype=bool)
    time = recording.time.copy()
    steps = []
    for cut in cuts:
        moved = _check_still(recording, cut)
        keep[cut.last + 1 : cut.next] = False
        time[cut.next :] -= cut.shift
        steps.append(_step(recording, cut, moved))
    if keep.sum() < MIN_FRAMES:
        raise SettingsError(f"cut leaves {keep.sum()} frames, a motion takes at least three", value=tuple(stretches))
    return recording.changed(time[keep], lambda p: p[keep], lambda q: q[keep]), tuple(steps)


def moved_up(recording: Recording, stretches: Sequence[Stretch], time: float | None) -> float | None:
    """Where a time of the recording lies after the cuts [s]; within a stretch, at the joint."""
    if time is None:
        return None
    moved = time
    for cut in plan_cuts(recording, stretches):
        last, next_ = recording.time[cut.last], recording.time[cut.next]
        if time >= next_ - TIME_TOLERANCE:
            moved -= cut.shift
        elif time > last + TIME_TOLERANCE:
            return float(moved - (time - last))
    return float(moved)


def plan_cuts(recording: Recording, stretches: Sequence[Stretch]) -> list[Cut]:
    """The cuts for pairs of times [s], in order of time."""
    time = recording.time
    cuts: list[Cut] = []
    for a, b in sorted(stretches):
        last = int(np.searchsorted(time, a + TIME_TOLERANCE, side="right")) - 1
        next_ = int(np.searchsorted(time, b - TIME_TOLERANCE, side="left"))
        named = f"cut {a:g}:{b:g}"
        if last < 0 or next_ >= len(time):
            span = f"times within {seconds(time[0])} and {seconds(time[-1])}"
            fix = "Take a beginning or an end away with --from and --to"
            raise SettingsError(f"{named} reaches an end of the recording", value=(a, b), allowed=span, fix=fix)
        if next_ - last < 2:
            raise SettingsError(f"{named} holds no frame", value=(a, b), fix="Give two times A:B with frames between")
        if cuts and last < cuts[-1].next:
            raise SettingsError(f"{named} overlaps another cut", value=(a, b), fix="Join them to one")
        cuts.append(Cut(last, next_, float(time[next_] - time[last]) - recording.step))
    return cuts


def _check_still(recording: Recording, cut: Cut) -> float:
    """The furthest any point has moved over a cut [m]."""
    moved = {name: _jump(values, cut) for name, values in recording.points.items()}
    limit = min(STILL, STILL_SPEED * recording.step)
    name = max(moved, key=lambda name: moved[name])
    if moved[name] > limit:
        message = f"'{name}' moves by {1e3 * moved[name]:.0f} mm"
        raise _refused(recording, cut, message, f"at most {1e3 * limit:.2g} mm", moved[name])
    for name, values in recording.orientations.items():
        turned = _jump(values, cut)
        if turned > STILL_TURN:
            message = f"'{name}' turns by {math.degrees(turned):.0f} deg"
            raise _refused(recording, cut, message, f"at most {math.degrees(STILL_TURN):.2g} deg", turned)
    hand = list(recording.points)[-1]
    time, values = recording.time, recording.points[hand]
    last, next_ = time[cut.last], time[cut.next]
    spans = {
        "before": (time >= last - REST - TIME_TOLERANCE) & (time <= last),
        "behind": (time >= next_) & (time <= next_ + REST + TIME_TOLERANCE),
    }
    for side, frames in spans.items():
        seen = values[frames & ~np.isnan(values[:, 0])]
        path = float(np.linalg.norm(seen[-1] - seen[0])) if len(seen) else 0.0
        if path > STILL:
            message = f"'{hand}' still moves {side} it, by {1e3 * path:.0f} mm in {seconds(REST)}"
            raise _refused(recording, cut, message, f"at most {1e3 * STILL:.2g} mm", path)
    return max(moved.values())


def _refused(recording: Recording, cut: Cut, what: str, allowed: str, value: float) -> RecordingError:
    """The error for a cut where the arm does not stand still."""
    span = f"from {seconds(recording.time[cut.last])} to {seconds(recording.time[cut.next])}"
    message = f"{recording.source}: the stretch {span} cannot be cut out, {what}"
    fix = "Choose both ends where the hand stands still at the same place, or crop with --from and --to"
    return RecordingError(message, value=value, allowed=allowed, fix=fix)


def _jump(values: Array, cut: Cut) -> float:
    """How far a series is from one end of a cut to the other; 0 where it was not seen at both.

    Of positions, shape (T, 3), the distance [m]; of quaternions, shape (T, 4), the angle between them [rad].
    """
    seen = np.flatnonzero(~np.isnan(values[:, 0]))
    before, after = seen[seen <= cut.last], seen[seen >= cut.next]
    if not len(before) or not len(after):
        return 0.0
    a, b = values[before[-1]], values[after[0]]
    if values.shape[1] == 3:
        return float(np.linalg.norm(b - a))
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    return float(2.0 * np.arccos(min(1.0, abs(float(a @ b)))))


def _step(recording: Recording, cut: Cut, moved: float) -> Step:
    """What was cut out."""
    last, next_ = float(recording.time[cut.last]), float(recording.time[cut.next])
    count = cut.next - cut.last - 1
    sentence = (
        f"Cut out {counted(count, 'frame')} between {seconds(last)} and {seconds(next_)}, over which no point moves "
        f"more than {1e3 * moved:.2g} mm; later times move up by {seconds(cut.shift)}."
    )
    return Step("cut", sentence, {"from": last, "to": next_, "frames": count, "moved": moved, "shift": cut.shift})
