"""The unit of length that makes a human of the numbers, for files that do not say it."""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.points.guess import Arm
from armdesign.demonstration.recording import Take

CMU = 0.0254 / 0.45
"""Metres per unit of the CMU motion-capture library, whose skeletons are in 0.45 inches."""

_EVERY = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "CMU": CMU}
_DECADES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_FRAMES = 500  # looked at
_WHOLE_BODY = 15  # points


@dataclass(frozen=True)
class Size:
    """A length in the take's units, and what it would be on a human.

    Attributes:
        what: What was measured, in words up to the number.
        value: The length, in units of the take.
        usual: What it is on most humans [m].
        spread: It may be longer or shorter than that by this factor.
        units: The units that come into question, in metres.
    """

    what: str
    value: float
    usual: float
    spread: float
    units: Mapping[str, float]

    def __str__(self) -> str:
        return f"{self.what} {self.value:.4g} units"


@dataclass(frozen=True)
class Unit:
    """A unit of length and why it was taken.

    Attributes:
        name: Short name.
        factor: Metres per unit.
        why: In words.
    """

    name: str
    factor: float
    why: str


def measure(take: Take, arms: Sequence[Arm]) -> Size:
    """The length that tells most: shoulder to wrist of an arm, else the height of a body, else the points' extent.

    Args:
        take: Any take.
        arms: The arms that its names tell of.
    """
    frames = np.unique(np.linspace(0, len(take.time) - 1, _FRAMES).astype(int)) if len(take.time) else np.empty(0, int)
    points = {name: values[frames] for name, values in take.points.items()}
    for arm in arms:
        roles = [arm.roles[role] for role in ("shoulder", "elbow", "wrist")]
        places = np.array([np.mean([points[name] for name in role], axis=0) for role in roles])
        length = _median(np.linalg.norm(np.diff(places, axis=0), axis=2).sum(axis=0))
        if math.isfinite(length) and length > 0:
            return Size("from shoulder over elbow to wrist it is", length, 0.55, 1.49, _EVERY)
    extent = _extent(points)
    if len(points) >= _WHOLE_BODY:
        return Size("the body extends over", extent, 1.6, 1.49, _EVERY)
    return Size("the points extend over", extent, 0.8, math.sqrt(10.0), _DECADES)


def unit_of_size(size: Size) -> Unit | None:
    """The unit in which a length is nearest to what it is on a human; None if it is so in none.

    Args:
        size: The length.
    """
    if not (math.isfinite(size.value) and size.value > 0):
        return None
    off = {name: abs(math.log(size.value * factor / size.usual)) for name, factor in size.units.items()}
    best = min(off, key=lambda name: off[name])
    if off[best] > math.log(size.spread):
        return None
    factor = size.units[best]
    library = "those of the CMU library, " if best == "CMU" else ""
    length = f"{size.what} {size.value * factor:.2f} m"
    return Unit(
        best, factor, f"{library}assumed because the file does not say and {length} then (otherwise use --units)"
    )


def _extent(points: Mapping[str, Array]) -> float:
    """Median over the frames of the longest side of the box around all points."""
    if not points:
        return math.nan
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # frames in which nothing was seen
        every = np.stack(list(points.values()))
        sides = np.nanmax(every, axis=0) - np.nanmin(every, axis=0)
    return _median(sides.max(axis=1))


def _median(values: Array) -> float:
    """Median of the values that are there."""
    there = values[np.isfinite(values)]
    return float(np.median(there)) if len(there) else math.nan
