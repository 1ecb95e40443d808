"""Repeated frames: a capture system that has nothing new says the last frame once more."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import Gap, Interpolation, Mask, cubic, seconds
from armdesign.demonstration.files.quaternions import slerp
from armdesign.demonstration.recording import Recording, Step

_ALIKE = 1e-9  # [s] differences of times carry rounding


def find_repeats(recording: Recording) -> list[Gap]:
    """Stretches of frames that are equal to the frame before to the last bit, in every point and orientation.

    Args:
        recording: Any recording; what is missing in both frames counts as equal.

    Returns:
        As gaps: ``first`` is the first repetition, ``begins`` the time of the frame that is repeated.
    """
    series = [*recording.points.values(), *recording.orientations.values()]
    same = np.ones(recording.frames - 1, dtype=bool)
    for values in series:
        before, after = values[:-1], values[1:]
        same &= ((before == after) | (np.isnan(before) & np.isnan(after))).all(axis=1)
    seen = np.any([~np.isnan(values[:-1, 0]) for values in series], axis=0)
    edges = np.flatnonzero(np.diff((same & seen).astype(int), prepend=0, append=0)) + 1
    time, last = recording.time, recording.frames - 1
    return [
        Gap("every point", int(i), int(j), float(time[i - 1]), float(time[min(j, last)]), recording.frames)
        for i, j in edges.reshape(-1, 2)
    ]


def stale_frames(recording: Recording, longest: float = 0.2) -> Mask:
    """Which frames count as not recorded, shape (T,): repetitions between two frames that are at most so far apart.

    In longer stretches, and in one up to the last frame, the arm may stand still.

    Args:
        recording: Any recording.
        longest: Longest time from the frame repeated to the next one that differs [s].
    """
    mask = np.zeros(recording.frames, dtype=bool)
    for gap in find_repeats(recording):
        if gap.can_be_filled(_limit(recording, longest)):
            mask[gap.first : gap.stop] = True
    return mask


def refill_repeats(
    recording: Recording, longest: float = 0.2, stretches: Sequence[Gap] | None = None
) -> tuple[Recording, tuple[Step, ...]]:
    """Take frames that repeat the one before as not recorded, and interpolate them.

    Args:
        recording: Without missing values.
        longest: Longest time from the frame repeated to the next one that differs [s]; others stay as they are.
        stretches: What was found in the recording before its gaps were filled; by default what is found now.
    """
    found = find_repeats(recording) if stretches is None else _within(recording, stretches)
    limit = _limit(recording, longest)
    filled = [gap for gap in found if gap.can_be_filled(limit)]
    kept = [gap for gap in found if not gap.can_be_filled(limit)]
    steps = tuple(_steps(filled, kept))
    if not filled:
        return recording, steps
    stale = np.concatenate([np.arange(gap.first, gap.stop) for gap in filled])
    fresh = np.delete(np.arange(recording.frames), stale)
    time = recording.time

    def refilled(values: Array, interpolate: Interpolation) -> Array:
        result = values.copy()
        result[stale] = interpolate(time[fresh], values[fresh], time[stale])
        return result

    return recording.changed(time, lambda p: refilled(p, cubic), lambda q: refilled(q, slerp)), steps


def _limit(recording: Recording, longest: float) -> float:
    """The longest stretch, with room for the rounding of differences of times [s]."""
    return longest + _ALIKE * max(1.0, abs(float(recording.time[-1])))


def _within(recording: Recording, stretches: Sequence[Gap]) -> list[Gap]:
    """Stretches of a longer recording whose frames are all in this one, by its own frames."""
    time, count = recording.time, recording.frames
    moved = []
    for gap in stretches:
        first, stop = int(np.searchsorted(time, gap.begins)) + 1, int(np.searchsorted(time, gap.ends))
        reaches_end = gap.stop == gap.frames
        if time[0] <= gap.begins and gap.ends <= time[-1]:
            moved.append(Gap(gap.name, first, count if reaches_end else stop, gap.begins, gap.ends, count))
    return moved


def _steps(filled: list[Gap], kept: list[Gap]) -> list[Step]:
    """What was interpolated, and what was left as it is."""
    steps = []
    if filled:
        count, worst = sum(gap.stop - gap.first for gap in filled), _longest(filled)
        many = f"{count} frames that repeat the one before" if count > 1 else "1 frame that repeats the one before"
        sentence = (
            f"Interpolated {many}, as not recorded; the longest stretch: {seconds(worst.length)} from "
            f"{seconds(worst.begins)} to {seconds(worst.ends)}."
        )
        steps.append(Step("repeats", sentence, {"frames": count, "stretches": _spans(filled)}))
    if kept:
        count, worst = sum(gap.stop - gap.first for gap in kept), _longest(kept)
        sentence = (
            f"Left {len(kept)} stretch{'es' if len(kept) > 1 else ''} of repeated frames as standing still, the "
            f"longest from {seconds(worst.begins)} to {seconds(worst.ends)}."
        )
        steps.append(Step("repeats", sentence, {"frames_kept": count, "stretches": _spans(kept)}))
    return steps


def _longest(gaps: list[Gap]) -> Gap:
    """The longest stretch; of equals the first, whatever the rounding."""
    return max(gaps, key=lambda gap: round(gap.length, 9))


def _spans(gaps: list[Gap]) -> list[dict[str, object]]:
    """Stretches for JSON."""
    return [{"from": gap.begins, "to": gap.ends, "frames": gap.stop - gap.first} for gap in gaps]
