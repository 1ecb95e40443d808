"""What was not seen, but stands in the file as a number: zeros, sentinels, and values held while all else moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import in_words, seconds
from armdesign.demonstration.files.hints import LEAST_CONFIDENCE
from armdesign.demonstration.recording import Step, Take

Mask = NDArray[np.bool_]

_FAR = 3.0  # a sentinel is further out than this many times the extent of everything else
_LEAST_HELD = 5  # frames that repeat the one before
_OTHERS = 0.5  # of the other points move meanwhile
_JUMP = 2.0  # a point that was held goes on with a step this many times its longest elsewhere


def hide_unseen(take: Take, least: float = LEAST_CONFIDENCE) -> Take:
    """Make "not seen" of numbers that stand for it, in any format, with a step for each kind that says how often.

    - A point whose confidence or visibility is below a threshold.
    - ``0 0 0`` of a marker, as many programs write it. Where places follow from a pose they may well be at 0, and what
      is finished or all relative to a base is left alone, too.
    - Three equal numbers far from everything else, such as ``-9999 -9999 -9999``.
    - A marker that holds its place to the last bit while most others move, and then jumps to where it is by then.
      Without the jump it may lie still, and the step only says so.

    Args:
        take: With times.
        least: Confidence, from 0 to 1, below which a point counts as not seen.
    """
    points: dict[str, Array] = dict(take.points)
    steps: list[Step] = []

    def hide(kind: str, found: Mapping[str, Mask], what: str) -> None:
        masks = {name: mask for name, mask in found.items() if mask.any()}
        if masks:
            points.update({name: np.where(mask[:, None], np.nan, points[name]) for name, mask in masks.items()})
            count = sum(int(mask.sum()) for mask in masks.values())
            spans = {name: _span(mask, take.time) for name, mask in masks.items()}
            listed = in_words([f"'{name}' {int(masks[name].sum())} times, {span}" for name, span in spans.items()])
            details = {"count": count, "points": {name: int(mask.sum()) for name, mask in masks.items()}}
            steps.append(Step(kind, f"Took {count} {what}, as gaps: {listed}.", details))

    known = [name for name in take.confidence if name in points]
    doubtful = {name: (take.confidence[name] < least) & ~np.isnan(points[name][:, 0]) for name in known}
    hide("confidence", doubtful, f"positions with a confidence below {least:g} (--confidence)")
    zeros = _zeros(take, points)
    hide("zeros", zeros, "positions at exactly 0 0 0, which stand for a marker that was not seen")
    far = _sentinels(take, points)
    hide("sentinels", far, "positions of three equal numbers far from all else, which stand for 'not seen'")
    stretches = _stretches(take, points)
    if stretches:
        hide("held", _held(stretches, points), "positions that are held to the last bit while other points move")
        steps += _still(take, points)
    return replace(take, points=points, steps=(*take.steps, *steps)) if steps else take


def _in_all(mask: Mask) -> Mask:
    """Where all three columns of a mask of shape (T, 3) are set; far quicker than ``all`` along so short an axis."""
    return np.asarray(mask[:, 0] & mask[:, 1] & mask[:, 2])


def _zeros(take: Take, points: Mapping[str, Array]) -> dict[str, Mask]:
    """Where a marker is at the origin to the last bit."""
    if not take.captured or take.solved:
        return {}
    return {name: _in_all(values == 0) for name, values in points.items()}


def _sentinels(take: Take, points: Mapping[str, Array]) -> dict[str, Mask]:
    """Where all three coordinates are the same number, far out of all that have not."""
    equal = {name: _in_all(values[:, :1] == values) & (values[:, 0] != 0) for name, values in points.items()}
    if not any(mask.any() for mask in equal.values()):
        return {}
    rest = np.concatenate([values[~equal[name]] for name, values in points.items()])
    rest = rest[np.isfinite(rest).all(axis=1)]
    if not len(rest):
        return {}
    low, high = np.quantile(rest, [0.01, 0.99], axis=0)
    reach = _FAR * max(float((high - low).max()), float(np.abs(rest).max(initial=0.0)) / 10.0)
    middle = 0.5 * (low + high)
    return {name: mask & (np.abs(points[name] - middle).min(axis=1) > reach) for name, mask in equal.items()}


def _held(stretches: list[tuple[str, int, int]], points: Mapping[str, Array]) -> dict[str, Mask]:
    """Where a marker is held, if it jumps at the end."""
    found: dict[str, Mask] = {}
    for name, first, stop in stretches:
        values = points[name]
        steps = np.linalg.norm(np.diff(values, axis=0), axis=1)
        longest = np.nanmax(np.delete(steps, np.arange(first - 1, min(stop, len(steps)))), initial=0.0)
        if stop < len(values) and steps[stop - 1] > _JUMP * longest > 0:
            found.setdefault(name, np.zeros(len(values), dtype=bool))[first:stop] = True
    return found


def _still(take: Take, points: Mapping[str, Array]) -> list[Step]:
    """A doubt about markers that hold their place to the last bit, and may have been seen there."""
    spans: dict[str, list[str]] = {}
    for name, first, stop in _stretches(take, points):
        spans.setdefault(name, []).append(_stretch(take.time, first - 1, stop - 1))
    if not spans:
        return []
    listed = in_words([f"'{name}' from {each[0]}" for name, each in spans.items()])
    sentence = f"Warning: while most others move, points stay where they are to the last bit: {listed}."
    return [Step("still", f"{sentence} Where one was not seen, cut the stretch out or use another.", {"points": spans})]


def _stretches(take: Take, points: Mapping[str, Array]) -> list[tuple[str, int, int]]:
    """Markers that repeat their last place while most others move: name, first repetition, frame after the last.

    Those that stand still most of the time are left out.
    """
    if not take.captured or take.solved or len(points) < 3 or len(take.time) <= _LEAST_HELD:
        return []
    same = {name: _in_all(values[1:] == values[:-1]) for name, values in points.items()}
    seen = {name: ~np.isnan(values[1:, 0]) & ~np.isnan(values[:-1, 0]) for name, values in points.items()}
    movers = [name for name in points if np.count_nonzero(seen[name] & ~same[name]) > np.count_nonzero(same[name])]
    moving = sum((seen[name] & ~same[name]).astype(int) for name in movers)
    visible = sum(seen[name].astype(int) for name in movers)
    found = []
    for name in movers:
        alone = same[name] & (moving >= 1) & (moving >= _OTHERS * (visible - 1))
        edges = np.flatnonzero(np.diff(alone.astype(int), prepend=0, append=0)).reshape(-1, 2) + 1
        found += [(name, int(a), int(b)) for a, b in edges if b - a >= _LEAST_HELD]
    return found


def _span(mask: Mask, time: Array) -> str:
    """From when to when a mask is set first, and how often."""
    edges = np.flatnonzero(np.diff(mask.astype(int), prepend=0, append=0)).reshape(-1, 2)
    more = f" and {len(edges) - 1} times more" if len(edges) > 1 else ""
    return f"{_stretch(time, edges[0][0], edges[0][1] - 1)}{more}"


def _stretch(time: Array, first: int, last: int) -> str:
    """A stretch of frames in words."""
    return f"{seconds(float(time[first]))} to {seconds(float(time[last]))}"
