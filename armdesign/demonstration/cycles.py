"""The same job done several times in one recording: where each time begins and ends, and which is the most typical.

A cycle leaves a pose and comes back to it. The pose is that of the first frame where coming back to it cuts the
recording into pieces that are alike, else another that does so better.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.points.selection import resolve
from armdesign.demonstration.recording import Recording
from armdesign.errors import RecordingError

_OUT, _BACK = 0.5, 0.25  # of the way: beyond the one it has left, within the other it is back
_REST = 0.5  # [s] of rest that belongs to a cycle on either side
_SMOOTHED = 0.15  # [s]
_MOST_FRAMES = 20_000  # looked at
_POSES = 24  # tried beside the first
_SAMPLES = 60  # of a cycle, to compare it with others
_ALIKE = 0.35  # of the way; pieces that differ by more are no cycles of one job
_PREFERRED = 1.25  # the first pose, unless another is better by this factor
_SHORTEST = 0.3  # [s]


class Cycle(NamedTuple):
    """One time that the job is done."""

    start: float  # [s]
    stop: float  # [s]
    apart: float  # how far its path is from those of the others on the mean [m]


class Cycles(NamedTuple):
    """All times that the job is done."""

    every: tuple[Cycle, ...]
    typical: int  # index of the one that is nearest to the others
    pose: float  # time of the pose that each comes back to [s]


def find_cycles(recording: Recording, base: str | None = None, points: Sequence[str] = ()) -> Cycles:
    """The times that the same job is done in a recording.

    Args:
        recording: In metres with z up.
        base: The shoulder, a name or an expression; None for a guess.
        points: Those that come back to the same pose, names or expressions; empty for a guess.

    Raises:
        TaskError: A point is unknown.
        RecordingError: The points do not come back to a pose at least twice, or what they do between is not alike.
    """
    selection = resolve(recording, base, points, None)
    recording = selection.recording
    time, pose = _poses(recording, [selection.base, *selection.points])
    frames = np.unique(np.linspace(0, len(time) - 1, _POSES + 1).astype(int))
    found = [(cut, frame) for frame in frames if len(cut := _pieces(time, pose, pose[frame])) > 1]
    scored = [(_unlike(time, pose, cut), cut, frame) for cut, frame in found]
    if not scored or min(score for score, *_ in scored) > _ALIKE:
        message = f"{recording.source}: no motion is found that is done again and again, coming back to the same pose"
        fix = "Cut the takes out with --from and --to, or choose --base and --points that come back"
        raise RecordingError(message, value=len(scored), allowed="two cycles or more", fix=fix)
    first = next((each for each in scored if each[2] == 0), None)
    best = min(scored, key=lambda each: (each[0], each[2]))
    _, pieces, frame = first if first is not None and first[0] <= _PREFERRED * best[0] else best
    apart = _apart(np.stack([_sampled(pose, piece) for piece in pieces]))
    every = tuple(
        Cycle(float(time[a]), float(time[b]), float(each)) for (a, b), each in zip(pieces, apart, strict=True)
    )
    return Cycles(every, int(np.argmin(apart)), float(time[frame]))


def _poses(recording: Recording, names: Sequence[str]) -> tuple[Array, Array]:
    """Times and, for each, the points relative to the first, smoothed, gaps bridged: shapes (F,) and (F, 3 m)."""
    series = [recording.points[name] for name in names if name in recording.points]
    if len(series) > 1:
        series = [values - series[0] for values in series[1:]]
    pose = np.hstack(series)
    seen = np.isfinite(pose).all(axis=1)
    if seen.sum() < 2:
        raise RecordingError(
            f"{recording.source}: the points are never seen together", fix="Choose others with --points"
        )
    time = np.asarray(recording.time)
    every = max(1, len(time) // _MOST_FRAMES)
    width = max(1, round(_SMOOTHED * recording.rate))
    filled = np.stack([np.interp(time, time[seen], column[seen]) for column in pose.T], axis=1)
    kernel = np.ones(width) / width
    padded = np.pad(filled, ((width // 2, width - 1 - width // 2), (0, 0)), mode="edge")
    smooth = np.stack([np.convolve(column, kernel, mode="valid") for column in padded.T], axis=1)
    return time[::every], smooth[::every]


def _distance(pose: Array, other: Array) -> Array:
    """Root mean square distance of the points of poses, shape (F,) [m]."""
    points = (pose - other).reshape(len(pose), -1, 3)
    return np.asarray(np.sqrt(np.mean(np.sum(points**2, axis=2), axis=1)))


def _pieces(time: Array, pose: Array, home: Array) -> list[tuple[int, int]]:
    """First and last frame of each time that the points leave a pose and come back to it."""
    away = _distance(pose, home)
    way = float(np.quantile(away, 0.98))
    if way <= 0:
        return []
    back = away < _BACK * way
    edges = np.flatnonzero(np.diff(back.astype(int)))
    stays = [piece for piece in np.split(np.arange(len(time)), edges + 1) if back[piece[0]]]
    # between two stays it has to go far enough, or they are one
    homes: list[tuple[int, int]] = []
    for stay in stays:
        first, last = int(stay[0]), int(stay[-1])
        if homes and away[homes[-1][1] : first + 1].max() < _OUT * way:
            homes[-1] = (homes[-1][0], last)
        else:
            homes.append((first, last))
    pieces = []
    for (begin, leaves), (returns, end) in pairwise(homes):
        # a rest between two cycles is shared by both
        earliest = time[0] if begin == 0 else 0.5 * (time[begin] + time[leaves])
        latest = time[-1] if end == len(time) - 1 else 0.5 * (time[returns] + time[end])
        start = np.searchsorted(time, max(earliest, time[leaves] - _REST))
        stop = np.searchsorted(time, min(latest, time[returns] + _REST), side="right") - 1
        if time[stop] - time[start] > _SHORTEST:
            pieces.append((int(start), int(stop)))
    return pieces


def _sampled(pose: Array, piece: tuple[int, int]) -> Array:
    """A piece at even shares of its way, whatever its speed, shape (samples, 3 m)."""
    part = pose[piece[0] : piece[1] + 1]
    steps = np.linalg.norm(np.diff(part, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(steps + 1e-9)])
    at = np.linspace(0.0, way[-1], _SAMPLES)
    return np.stack([np.interp(at, way, column) for column in part.T], axis=1)


def _apart(paths: Array) -> Array:
    """Mean distance of each path to the others, shape (K,) [m], for paths of shape (K, samples, 3 m)."""
    count = len(paths)
    between = np.array([[_distance(a, b).mean() for b in paths] for a in paths])
    return np.asarray(between.sum(axis=1) / max(1, count - 1))


def _unlike(time: Array, pose: Array, pieces: list[tuple[int, int]]) -> float:
    """How much pieces differ in their paths, as part of the way, and in their lengths, and what they leave out."""
    paths = np.stack([_sampled(pose, piece) for piece in pieces])
    way = float(np.quantile(_distance(pose, np.median(pose, axis=0)), 0.98))
    lengths = np.array([time[last] - time[first] for first, last in pieces])
    motion = np.concatenate([[0.0], np.cumsum(np.sum(np.diff(pose, axis=0) ** 2, axis=1))])  # rests count nothing
    covered = sum(motion[last] - motion[first] for first, last in pieces) / max(float(motion[-1]), 1e-12)
    spread = float(lengths.std() / lengths.mean())
    return float(np.median(_apart(paths)) / max(way, 1e-12) + 0.2 * spread + 0.5 * (1.0 - covered))
