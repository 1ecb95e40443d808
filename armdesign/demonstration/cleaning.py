"""What can be done to a recording before it becomes a task: signs, gaps, filter, resampling, scale, crop.

Every function leaves its input alone and returns the new recording with a sentence about each thing it did.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from armdesign.demonstration.gaps import TIME_TOLERANCE, cubic, fill_gaps, seconds
from armdesign.demonstration.quaternions import slerp, unit_continuous
from armdesign.demonstration.recording import MIN_FRAMES, Array, Recording
from armdesign.errors import RecordingError, SettingsError

__all__ = ["clean", "crop", "fill_gaps", "filter_low_pass", "resample", "scale_positions", "unify_quaternions"]

Cleaned = tuple[Recording, tuple[str, ...]]

_MIN_NORM = 1e-3  # a quaternion shorter than this has no direction worth trusting
_NORM_NOTE = 1e-2  # norms further from 1 than this are mentioned
_EVEN = 0.2  # steps within 20 % of the median count as even (printed times are rounded)
_MAX_RATE = 10_000.0  # [1/s]
_MIN_CUTOFF = 1e-4  # of the frame rate; far below, the filter's coefficients run out of digits
# Two passes of a second-order Butterworth damp by 3 dB where one pass has (f / f_c)^4 = sqrt(2) - 1.
_TWO_PASSES = (math.sqrt(2.0) - 1.0) ** 0.25


def clean(
    recording: Recording,
    *,
    max_gap: float = 0.2,
    low_pass: float | None = None,
    rate: float | None = None,
    scale: float = 1.0,
    start: float | None = None,
    stop: float | None = None,
) -> Cleaned:
    """Do all of it in this order: signs, gaps, filter, resampling, scale, crop; what is not asked for is left out.

    Args:
        recording: Any recording.
        max_gap: Longest gap to be filled [s].
        low_pass: Cutoff of the filter [Hz]; None for no filter.
        rate: Frames per second to resample to [1/s]; None to keep the frames.
        scale: Factor on all positions.
        start: First time wanted [s]; None for the recording's first.
        stop: Last time wanted [s]; None for the recording's last.

    Raises:
        RecordingError: A gap is too long, or a quaternion is zero.
        SettingsError: A number is out of range.
    """
    crop(recording, start, stop)  # a senseless part is refused before its gaps are looked at
    steps: list[Callable[[Recording], Cleaned]] = [
        unify_quaternions,
        lambda current: fill_gaps(current, max_gap, start, stop),
    ]
    if low_pass is not None:
        steps.append(lambda current: filter_low_pass(current, low_pass))
    if rate is not None:
        steps.append(lambda current: resample(current, rate))
    if scale != 1.0:
        steps.append(lambda current: scale_positions(current, scale))
    steps.append(lambda current: crop(current, start, stop))
    notes: tuple[str, ...] = ()
    for step in steps:
        recording, more = step(recording)
        notes += more
    return recording, notes


def unify_quaternions(recording: Recording) -> Cleaned:
    """Normalise the quaternions and make their signs continuous.

    Args:
        recording: Any recording.

    Raises:
        RecordingError: A quaternion is (nearly) zero; the message names the point and the time.
    """
    notes = []
    for name, quaternions in recording.orientations.items():
        norms = np.linalg.norm(quaternions, axis=1)
        _refuse_zero(recording, name, norms)
        if np.nanmax(np.abs(norms - 1.0), initial=0.0) > _NORM_NOTE:
            span = f"{np.nanmin(norms):.3g} to {np.nanmax(norms):.3g}"
            notes.append(f"Normalised the quaternions of '{name}', whose norms were {span} instead of 1.")
    return recording.changed(recording.time, lambda positions: positions, unit_continuous), tuple(notes)


def filter_low_pass(recording: Recording, cutoff: float) -> Cleaned:
    """Smooth by a zero-phase Butterworth low-pass: second order, once forwards and once backwards.

    |H(f)| = 1 / (1 + (tan(pi f / rate) / W)^4) with W chosen so that |H(cutoff)| = 1 / sqrt(2) over both passes.
    Quaternions are filtered component by component and normalised. Where the steps in time are uneven, the
    filter works on an even grid of the median step.

    Args:
        recording: A recording without gaps, quaternions with continuous signs.
        cutoff: Frequency damped by 3 dB [Hz].

    Raises:
        SettingsError: The cutoff is not between a ten-thousandth and half of the frame rate.
        RecordingError: A quaternion vanishes under the filter.
    """
    least, half = recording.rate * _MIN_CUTOFF, recording.rate / 2.0
    if not least * (1.0 - 1e-9) <= cutoff < half:
        allowed = f"{least:.3g} Hz up to, but not including, {half:.6g} Hz"
        raise SettingsError(f"low_pass is {cutoff} Hz", value=cutoff, allowed=allowed)
    step = np.diff(recording.time)
    even = np.abs(step - recording.step).max() <= _EVEN * recording.step
    grid = recording if even else _sample(recording, _even_times(recording))

    def smooth(values: Array) -> Array:
        return _filtfilt(values, cutoff, grid.rate)

    result, _ = unify_quaternions(grid.changed(grid.time, smooth, smooth))
    result = result if even else _sample(result, recording.time)
    return result, (f"Smoothed by a zero-phase Butterworth low-pass at {cutoff:.6g} Hz.",)


def resample(recording: Recording, rate: float) -> Cleaned:
    """Take the motion at evenly spaced times from the first frame on.

    Args:
        recording: A recording without gaps, quaternions with continuous signs.
        rate: New frames per second [1/s].

    Raises:
        SettingsError: The rate is not in (0, 10000], or gives fewer than three frames.
    """
    duration = float(recording.time[-1] - recording.time[0])
    least = (MIN_FRAMES - 1) / duration
    if not least <= rate <= _MAX_RATE:
        raise SettingsError(f"rate is {rate} frames/s", value=rate, allowed=f"{least:.3g} to {_MAX_RATE:g} frames/s")
    count = math.floor(duration * rate + 1e-6) + 1  # a last frame missed by rounding alone is kept
    times = np.minimum(recording.time[0] + np.arange(count) / rate, recording.time[-1])
    result = _sample(recording, times)
    return result, (f"Resampled to {rate:.6g} frames/s: {result.frames} frames.",)


def scale_positions(recording: Recording, factor: float) -> Cleaned:
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
    return result, (f"Scaled all positions by {factor:.6g}.",)


def crop(recording: Recording, start: float | None = None, stop: float | None = None) -> Cleaned:
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
        chosen = ", ".join(f"{n} is {v} s" for n, v in (("start", start), ("stop", stop)) if v is not None)
        span = f"times from {seconds(recording.time[0])} to {seconds(recording.time[-1])}, start before stop"
        message = f"{chosen}: that leaves {keep.sum()} frames, a motion takes at least three"
        raise SettingsError(message, value=(start, stop), allowed=span)
    if keep.all():
        return recording, ()
    result = recording.changed(recording.time[keep], lambda positions: positions[keep], lambda q: q[keep])
    return result, (f"Cropped to {seconds(result.time[0])} to {seconds(result.time[-1])}.",)


def _refuse_zero(recording: Recording, name: str, norms: Array) -> None:
    """Raise for the first quaternion of norm (nearly) zero."""
    zero = np.flatnonzero(norms < _MIN_NORM)
    if len(zero):
        where = f"frame {zero[0] + 1}, {seconds(recording.time[zero[0]])}"
        message = f"{recording.source}: the quaternion of '{name}' is zero at {where} (norm {norms[zero[0]]:.2g})"
        raise RecordingError(message, value=float(norms[zero[0]]), fix="Leave its cells empty where it was not seen")


def _even_times(recording: Recording) -> Array:
    """Evenly spaced times from the first frame to the last at about the median step, shape (N,) [s]."""
    first, last = recording.time[[0, -1]]
    return np.linspace(first, last, max(MIN_FRAMES, round((last - first) * recording.rate) + 1))


def _sample(recording: Recording, at: Array) -> Recording:
    """Positions and orientations at other times within the recording, shape (N,) [s]."""
    time = recording.time
    return recording.changed(at, lambda p: cubic(time, p, at), lambda q: slerp(time, q, at))


def _filtfilt(values: Array, cutoff: float, rate: float) -> Array:
    """Both passes over values of shape (T, k), continued by point reflection at the ends."""
    from scipy.signal import butter, sosfiltfilt  # noqa: PLC0415  (slow to import)

    single = rate / math.pi * math.atan(math.tan(math.pi * cutoff / rate) / _TWO_PASSES)
    sections = butter(2, single, fs=rate, output="sos")
    padding = math.ceil(4.0 * rate / cutoff)  # four periods outlast the filter's memory
    extended = np.pad(values, ((padding, padding), (0, 0)), mode="reflect", reflect_type="odd")
    return np.asarray(sosfiltfilt(sections, extended, axis=0, padlen=0)[padding:-padding])
