"""Gaps in a recording are found, short ones filled, long ones refused; repeated frames count as not recorded.

A capture system that has nothing new says the last frame once more.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.demonstration.files.quaternions import slerp
from armdesign.demonstration.recording import MIN_FRAMES, Recording, Step
from armdesign.errors import RecordingError, SettingsError, counted

Mask = NDArray[np.bool_]
Interpolation = Callable[[Array, Array, Array], Array]

TIME_TOLERANCE = 5e-5  # [s] half of the last digit that messages print, so that a printed time can be typed back
_HOLE_STEPS = 3.0  # a step in time this many times the median is a hole, if it is longer than the gap allowed


@dataclass(frozen=True)
class Gap:
    """Consecutive frames in which something was not seen."""

    name: str  # what is missing, in words
    first: int  # missing frame
    stop: int  # first frame after the gap
    begins: float  # time of the last frame in which it was seen, or of the first frame of all [s]
    ends: float  # time of the next frame in which it was seen, or of the last frame of all [s]
    frames: int  # number of frames of the recording

    @property
    def length(self) -> float:
        """How long it was not seen [s]."""
        return self.ends - self.begins

    def can_be_filled(self, longest: float) -> bool:
        """Whether it is no longer than that [s] and was seen on both sides, so that there is something between."""
        return self.first > 0 and self.stop < self.frames and self.length <= longest

    def __str__(self) -> str:
        what = f"{self.name} is not seen" if self.first < self.stop else "no frame was recorded"
        return f"{what} from {seconds(self.begins)} to {seconds(self.ends)}"


def fill_gaps(
    recording: Recording,
    max_gap: float = 0.2,
    start: float | None = None,
    stop: float | None = None,
    stale: Mask | None = None,
) -> tuple[Recording, tuple[Step, ...]]:
    """Interpolate short gaps: positions by shape-preserving cubics (PCHIP), orientations along great circles.

    Frames in which everything was seen keep their values to the last bit. A short gap at the very start or end
    cannot be interpolated: those frames are cut off. A longer gap is refused, unless it lies outside the part of
    the recording that is wanted; then that end of the recording is cut off.

    Args:
        recording: Any recording whose quaternions are normalised with continuous signs.
        max_gap: Longest time between two frames in which a point was seen [s].
        start: Begin of the part that is wanted later [s]; None for the whole recording.
        stop: End of the part that is wanted later [s].
        stale: Frames that nothing is to be interpolated from, shape (T,).

    Returns:
        The recording without missing values, and a step for each thing done.

    Raises:
        RecordingError: A gap is too long; the message names it.
        SettingsError: ``max_gap`` is negative or not finite.
    """
    if not (np.isfinite(max_gap) and max_gap >= 0):
        raise SettingsError(f"max_gap is {max_gap} s", value=max_gap, allowed="0 s or more")
    longest = _limit(recording, max_gap)
    time = recording.time
    series = {f"point '{name}'": values for name, values in recording.points.items()}
    series |= {f"the orientation of '{name}'": values for name, values in recording.orientations.items()}
    gaps = [gap for name, values in series.items() for gap in find_gaps(name, values, time)]
    short = [gap for gap in gaps if gap.can_be_filled(longest)]
    others = [gap for gap in gaps if not gap.can_be_filled(longest)] + _holes(recording, longest)
    heads, tails = _ends_to_cut(recording, others, longest, start, stop)
    first = max((gap.stop for gap in heads), default=0)
    end = min((gap.first for gap in tails), default=recording.frames)
    if end - first < MIN_FRAMES:
        message = f"{recording.source}: fewer than three frames are left without the gaps at the ends"
        raise RecordingError(message, value=max(0, end - first), fix="Use other points or another part")
    filled = recording.changed(
        time[first:end],
        lambda positions: _fill(time, positions, longest, cubic, stale)[first:end],
        lambda quaternions: _fill(time, quaternions, longest, slerp, stale)[first:end],
    )
    after, before = -np.inf if start is None else start, np.inf if stop is None else stop
    within = [gap for gap in short if first < gap.stop and gap.first < end]
    wanted = [gap for gap in within if gap.ends > after and gap.begins < before]  # those of the part that is wanted
    return filled, tuple(_gap_steps(wanted, heads, tails))


def find_gaps(name: str, series: Array, time: Array) -> list[Gap]:
    """Gaps of one point.

    Args:
        name: What to call it.
        series: Shape (T, k), NaN where missing.
        time: Shape (T,) [s].
    """
    edges = np.flatnonzero(np.diff(np.isnan(series[:, 0]).astype(int), prepend=0, append=0))
    last = len(time) - 1
    return [
        Gap(name, int(i), int(j), float(time[max(i - 1, 0)]), float(time[min(j, last)]), len(time))
        for i, j in edges.reshape(-1, 2)
    ]


def cubic(time: Array, positions: Array, at: Array) -> Array:
    """Shape-preserving cubic interpolation (PCHIP): no value leaves the range of the two it lies between.

    Args:
        time: Increasing times of the known positions, shape (K,) [s].
        positions: Known positions, shape (K, 3) [m].
        at: Times wanted, within the known ones, shape (N,) [s].

    Returns:
        Shape (N, 3) [m].
    """
    return np.asarray(scipy.interpolate.PchipInterpolator(time, positions)(at))


def seconds(time: float) -> str:
    """A time or duration in words, to a tenth of a millisecond."""
    return f"{np.format_float_positional(round(time, 4), trim='-')} s"


def in_words(parts: Sequence[str]) -> str:
    """A list for a sentence: all of it where it is short, else its beginning and how many more there are."""
    shown = list(parts) if len(parts) <= 6 else [*parts[:5], f"{len(parts) - 5} more"]
    return ", ".join(shown)


def _holes(recording: Recording, longest: float) -> list[Gap]:
    """Steps in time so long that frames must have been left out."""
    time, least = recording.time, max(longest, _HOLE_STEPS * recording.step)
    steps = np.flatnonzero(np.diff(time) > least)
    return [Gap("every point", int(i) + 1, int(i) + 1, float(time[i]), float(time[i + 1]), len(time)) for i in steps]


def _ends_to_cut(
    recording: Recording, gaps: list[Gap], longest: float, start: float | None, stop: float | None
) -> tuple[list[Gap], list[Gap]]:
    """Sort gaps that cannot be filled into those cut off with the start and with the end; refuse any other."""
    heads, tails, refused = [], [], []
    for gap in gaps:
        short = gap.length <= longest
        before = start is not None and gap.ends <= start + TIME_TOLERANCE
        after = stop is not None and gap.begins >= stop - TIME_TOLERANCE
        if gap.stop < gap.frames and (before or (short and gap.first == 0)):
            heads.append(gap)
        elif gap.first > 0 and (after or (short and gap.stop == gap.frames)):
            tails.append(gap)
        else:
            refused.append(gap)
    if refused:
        raise _too_long(recording.source, refused, longest)
    return heads, tails


def _too_long(source: str, gaps: list[Gap], longest: float) -> RecordingError:
    """The error for gaps that are neither short nor outside the part that is wanted, with all of the first one."""
    gap, *others = sorted(gaps, key=lambda gap: gap.begins)
    more = in_words([f"{each.name} from {seconds(each.begins)} to {seconds(each.ends)}" for each in others])
    before = f"--to {seconds(gap.begins).removesuffix(' s')} or less"
    after = f"--from {seconds(gap.ends).removesuffix(' s')} or more"
    ways = ([before] if gap.first > 0 else []) + ([after] if gap.stop < gap.frames else [])
    crop = f"crop the recording ({', or '.join(ways)}), " if ways else ""
    cut = ", cut the stretch out where the hand stands still (--cut)" if len(ways) == 2 else ""
    message = f"{source}: {gap}, longer than the {seconds(longest)} that may be filled"
    message += f" (too long are also {more})" if others else ""
    fix = f"{crop}use another point{cut}, or raise --max-gap"
    return RecordingError(message, value=gap.length, fix=fix[0].upper() + fix[1:])


def _fill(time: Array, values: Array, longest: float, interpolate: Interpolation, stale: Mask | None) -> Array:
    """Values of shape (T, k) with the short inner gaps filled."""
    gaps = [gap for gap in find_gaps("", values, time) if gap.can_be_filled(longest)]
    if not gaps:
        return values
    seen = ~np.isnan(values[:, 0])
    if stale is not None:
        ends = np.flatnonzero(seen)[[0, -1]]
        seen &= ~stale
        seen[ends] = True  # so that every gap lies between two frames
    missing = np.concatenate([np.arange(gap.first, gap.stop) for gap in gaps])
    result = values.copy()
    result[missing] = interpolate(time[seen], values[seen], time[missing])
    return result


def _gap_steps(filled: list[Gap], heads: list[Gap], tails: list[Gap]) -> list[Step]:
    """Which gaps were filled, and which ends were cut off."""
    steps = []
    if filled:
        counts = Counter(gap.name for gap in filled)
        listed = in_words([f"{number} of {name}" for name, number in counts.items()])
        worst = _longest(filled)
        where = f"{seconds(worst.length)}, {worst.name} from {seconds(worst.begins)} to {seconds(worst.ends)}"
        sentence = f"Filled {counted(len(filled), 'gap')} by interpolation ({listed}); the longest: {where}."
        spans = [{"of": gap.name, **span} for gap, span in zip(filled, _spans(filled), strict=True)]
        steps.append(Step("gaps", sentence, {"counts": dict(counts), "longest": worst.length, "gaps": spans}))
    if heads:
        gap = max(heads, key=lambda gap: gap.stop)
        sentence = f"Left out the frames before {seconds(gap.ends)}, because {gap}."
        steps.append(Step("ends", sentence, {"before": gap.ends}))
    if tails:
        gap = min(tails, key=lambda gap: gap.first)
        sentence = f"Left out the frames after {seconds(gap.begins)}, because {gap}."
        steps.append(Step("ends", sentence, {"after": gap.begins}))
    return steps


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
    return longest + 1e-9 * max(1.0, abs(float(recording.time[-1])))


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
