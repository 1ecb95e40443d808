"""Which frames of a recording the animation shows: fewer than there are, at their own times."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.search.result import Result

Indices = NDArray[np.intp]

RATE = 60.0
"""Most keyframes per second, what screens show; the browser interpolates between them."""
BUDGET = 2_000_000
"""Bytes that the motion of all designs of a page may take together, before a third is added to write them as text."""
SOLIDS_PER_JOINT, SOLID, POINT, FRAMES = 3, 36, 168, 72
"""Most solids that move with a joint; bytes per keyframe of a solid, a point with all that is drawn to it, and the
frames of hand and tool."""


def most_keyframes(runs: Sequence[Result]) -> int:
    """How many keyframes each of the runs may have so that all of them keep to the budget; 2 at least."""
    solids = SOLID * SOLIDS_PER_JOINT * sum(run.table.dof for run in runs)
    points = POINT * sum(len(run.problem.task.points) for run in runs)
    return max(2, BUDGET // (solids + points + FRAMES * len(runs)))


def choose_frames(time: Array, most: int, rate: float = RATE) -> Indices:
    """Frames that become keyframes: the first of every 1/rate seconds, and the last of all.

    Where that gives more than ``most``, the stretches are longer.

    Args:
        time: Increasing frame times, shape (T,) [s].
        most: Most keyframes, 2 or more.
        rate: Most keyframes per second [1/s].

    Returns:
        Increasing indices into ``time``, shape (K,), K <= most.
    """
    step = max(1.0 / rate, float(time[-1] - time[0]) / max(1, most - 2))
    slots = np.floor((time - time[0]) / step + 1e-6).astype(int)
    chosen = np.flatnonzero(np.r_[True, np.diff(slots) > 0])[: most - 1]
    return np.unique(np.r_[chosen, len(time) - 1])


def deviation(time: Array, paths: Array, chosen: Indices) -> float:
    """How far points get from their paths where the frames between keyframes are interpolated [m].

    Args:
        time: Frame times, shape (T,) [s].
        paths: Positions, shape (T, k, 3) [m].
        chosen: The keyframes.
    """
    flat = paths.reshape(len(time), -1)
    between = np.stack([np.interp(time, time[chosen], column[chosen]) for column in flat.T], axis=1)
    return float(np.linalg.norm((between - flat).reshape(paths.shape), axis=-1).max())
