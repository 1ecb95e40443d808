"""A low-pass without phase, sampling at other times, and quaternions whose signs do not flip."""

from __future__ import annotations

import math

import numpy as np
import scipy

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import cubic, seconds
from armdesign.demonstration.files.quaternions import slerp, unit_continuous
from armdesign.demonstration.recording import MIN_FRAMES, Recording, Step
from armdesign.errors import RecordingError, SettingsError

_MIN_NORM = 1e-3  # a quaternion shorter than this has no direction worth trusting
_NORM_NOTE = 1e-2  # norms further from 1 than this are mentioned
_EVEN = 0.2  # steps within 20 % of the median count as even (printed times are rounded)
_MAX_RATE = 10_000.0  # [1/s]
_MIN_CUTOFF = 1e-4  # of the frame rate; far below, the filter's coefficients run out of digits
# Two passes of a second-order Butterworth damp by 3 dB where one pass has (f / f_c)^4 = sqrt(2) - 1.
_TWO_PASSES = (math.sqrt(2.0) - 1.0) ** 0.25


def unify_quaternions(recording: Recording) -> tuple[Recording, tuple[Step, ...]]:
    """Normalise the quaternions and make their signs continuous.

    Raises:
        RecordingError: A quaternion is (nearly) zero; the message names the point and the time.
    """
    steps = []
    for name, quaternions in recording.orientations.items():
        norms = np.linalg.norm(quaternions, axis=1)
        zero = np.flatnonzero(norms < _MIN_NORM)
        if len(zero):
            where = f"frame {zero[0] + 1}, {seconds(recording.time[zero[0]])}"
            message = f"{recording.source}: the quaternion of '{name}' is zero at {where} (norm {norms[zero[0]]:.2g})"
            fix = "Leave its cells empty where it was not seen"
            raise RecordingError(message, value=float(norms[zero[0]]), fix=fix)
        if np.nanmax(np.abs(norms - 1.0), initial=0.0) > _NORM_NOTE:
            least, greatest = float(np.nanmin(norms)), float(np.nanmax(norms))
            norms_were = f"whose norms were {least:.3g} to {greatest:.3g} instead of 1"
            sentence = f"Normalised the quaternions of '{name}', {norms_were}."
            steps.append(Step("quaternions", sentence, {"of": name, "least": least, "greatest": greatest}))
    return recording.changed(recording.time, lambda positions: positions, unit_continuous), tuple(steps)


def filter_low_pass(recording: Recording, cutoff: float) -> tuple[Recording, tuple[Step, ...]]:
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
        raise SettingsError(f"low_pass is {cutoff} Hz at {recording.rate:.6g} frames/s", value=cutoff, allowed=allowed)
    step = np.diff(recording.time)
    even = np.abs(step - recording.step).max() <= _EVEN * recording.step
    grid = recording
    if not even:
        first, last = recording.time[[0, -1]]
        count = max(MIN_FRAMES, round((last - first) * recording.rate) + 1)
        grid = _sample(recording, np.linspace(first, last, count))

    def smooth(values: Array) -> Array:
        return _filtfilt(values, cutoff, grid.rate)

    result, _ = unify_quaternions(grid.changed(grid.time, smooth, smooth))
    result = result if even else _sample(result, recording.time)
    sentence = f"Smoothed by a zero-phase Butterworth low-pass at {cutoff:.6g} Hz."
    return result, (Step("low_pass", sentence, {"cutoff": cutoff}),)


def resample(recording: Recording, rate: float) -> tuple[Recording, tuple[Step, ...]]:
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
    sentence = f"Resampled to {rate:.6g} frames/s: {result.frames} frames."
    return result, (Step("resample", sentence, {"rate": rate, "from": recording.rate, "frames": result.frames}),)


def _sample(recording: Recording, at: Array) -> Recording:
    """Positions and orientations at other times within the recording, shape (N,) [s]."""
    time = recording.time
    return recording.changed(at, lambda p: cubic(time, p, at), lambda q: slerp(time, q, at))


def _filtfilt(values: Array, cutoff: float, rate: float) -> Array:
    """Both passes over values of shape (T, k), continued by point reflection at the ends."""
    single = rate / math.pi * math.atan(math.tan(math.pi * cutoff / rate) / _TWO_PASSES)
    sections = scipy.signal.butter(2, single, fs=rate, output="sos")
    padding = math.ceil(4.0 * rate / cutoff)  # four periods outlast the filter's memory
    extended = np.pad(values, ((padding, padding), (0, 0)), mode="reflect", reflect_type="odd")
    return np.asarray(scipy.signal.sosfiltfilt(sections, extended, axis=0, padlen=0)[padding:-padding])
