"""Outliers: frames in which a point is seen where it cannot be. They are taken out and become gaps.

Hampel's rule, on what the neighbours say. For a frame t the straight lines through the frames t - j and t + j,
j = 1..k, give k estimates of its place, and d is the running median of the distances from them, s their median
deviation from it. Uniform motion has d = 0, and in a bend s grows as d does, so that motion is no outlier. A frame is
one where d > max(10 mm, 3 * 1.4826 * max(s, median of d over the recording)): far off against the bend and the noise.
The 10 mm keep noise-free data and still phases as they are. k is 0.08 s of frames, at least 5; up to k / 2 bad frames
in a row are found. At both ends the lines go through t + j and t + 2 j, or t - j and t - 2 j.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import Mask, in_words, seconds
from armdesign.demonstration.recording import Recording, Step
from armdesign.errors import counted

WINDOW = 0.08  # [s] to either side
MIN_NEIGHBOURS = 5  # frames to either side
FLOOR = 0.01  # [m]
THRESHOLD = 3.0 * 1.4826  # three standard deviations of normal noise, by the median deviation
_LEAST = 3  # estimates a frame needs to be judged


def take_out_outliers(recording: Recording, stale: Mask | None = None) -> tuple[Recording, tuple[Step, ...]]:
    """Take the outliers of every point out, so that they are missing like frames in which it was hidden.

    Args:
        recording: Any recording [m].
        stale: Frames that count as not recorded, shape (T,).

    Returns:
        The recording with more gaps, to the bit the same elsewhere, and a step where there were outliers.
    """
    ignored = np.zeros(recording.frames, dtype=bool) if stale is None else stale
    masks = {
        name: find_outliers(recording.time, np.where(ignored[:, None], np.nan, values))
        for name, values in recording.points.items()
    }
    found = {name: mask for name, mask in masks.items() if mask.any()}
    if not found:
        return recording, ()
    points = {name: np.where(masks[name][:, None], np.nan, values) for name, values in recording.points.items()}
    kept = Recording(recording.time, points, recording.orientations, recording.source, recording.about)
    return kept, (_step(recording, found),)


def find_outliers(time: Array, positions: Array) -> Mask:
    """Which frames of a point are outliers.

    Args:
        time: Shape (T,) [s].
        positions: Shape (T, 3) [m], NaN where missing.

    Returns:
        Shape (T,); False where missing.
    """
    seen = np.flatnonzero(~np.isnan(positions[:, 0]))
    mask = np.zeros(len(time), dtype=bool)
    if len(seen) < 2 * _LEAST + 1:
        return mask
    reach = max(MIN_NEIGHBOURS, round(WINDOW / float(np.median(np.diff(time)))))
    distance = _distances(time[seen], positions[seen], min(reach, (len(seen) - 1) // 2))
    middle = np.nanmedian(distance, axis=1)
    spread = np.nanmedian(np.abs(distance - middle[:, None]), axis=1)
    limit = np.maximum(FLOOR, THRESHOLD * np.maximum(spread, np.median(middle)))
    mask[seen] = middle > limit
    return mask


def _distances(time: Array, positions: Array, reach: int) -> Array:
    """Distances of every frame from its estimates, shape (K, reach); NaN where there is no such neighbour."""
    count = len(time)
    here = np.arange(count)
    result = np.full((count, reach), np.nan)
    for j in range(1, reach + 1):
        at_start, at_end = here - j < 0, here + j >= count
        a = np.where(at_start, here + j, np.where(at_end, here - 2 * j, here - j))
        b = np.where(at_start, here + 2 * j, np.where(at_end, here - j, here + j))
        use = (a >= 0) & (b < count)
        a, b, t = a[use], b[use], here[use]
        share = ((time[t] - time[a]) / (time[b] - time[a]))[:, None]
        line = positions[a] + share * (positions[b] - positions[a])
        result[t, j - 1] = np.linalg.norm(positions[t] - line, axis=1)
    return result


def _step(recording: Recording, found: Mapping[str, Mask]) -> Step:
    """What was taken out, with the times."""
    counts = {name: int(mask.sum()) for name, mask in found.items()}
    times = {name: [float(t) for t in recording.time[mask]] for name, mask in found.items()}
    total = sum(counts.values())
    where = in_words([f"{count} of '{name}'" for name, count in counts.items()])
    first = min(times, key=lambda name: times[name][0])
    first_one = f"the first of '{first}' at {seconds(times[first][0])}"
    sentence = f"Took out {counted(total, 'outlier')} ({where}), {first_one}."
    details = {"counts": counts, "times": times, "floor": FLOOR, "threshold": THRESHOLD, "window": WINDOW}
    return Step("outliers", sentence, details)
