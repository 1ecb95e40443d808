"""The unit of length and the up axis that make a standing human of the numbers, for files that do not say them."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.points.guess import Arm, find_arms
from armdesign.demonstration.recording import Take, median_seen

CMU = 0.0254 / 0.45
"""Metres per unit of the CMU motion-capture library, whose skeletons are in 0.45 inches."""

_EVERY = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "CMU": CMU}
_DECADES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_FRAMES = 500  # looked at
_WHOLE_BODY = 15  # points
# Two neighbouring units, 0.0564 m (CMU) and 0.0254 m (inch), differ by 2.22 = 1.49^2, and decades by
# 10 = sqrt(10)^2: within these factors of the usual length at most one unit fits.
_FINE, _COARSE = 1.49, math.sqrt(10.0)
_TRUNK = (
    "acromion", "acromium", "acro", "acrotip", "acr", "shoulder", "sho", "neck", "c7", "t1", "clav", "ster", "strn",
)  # fmt: skip
_HIGH = ("head", "fhd", "bhd", *_TRUNK)
_PELVIS = ("asis", "asi", "psis", "psi", "pelvis", "hips", "hip", "sacrum", "sacr")
_LOW = ("ankle", "ank", "heel", "hee", "toe", "foot", "calc", "cal", "mt5", "mt1", "lmal", "mmal")
_SIDES = ("right", "left", "r", "l")
_UPRIGHT = 0.85  # cosine; a trunk that leans by less than 30 degrees
_MOSTLY = 0.9  # of the frames, as somebody may bend down for a moment
_LEAST_RISE, _CLEARLY = 0.1, 0.6  # [m], and part of both level lengths and height
_LEAST_BODY, _LEAST_TRUNK = 0.5, 0.25  # [m] from the feet, and from the pelvis, to the shoulders
_FLOOR = (-0.05, 0.12)  # [m] the lowest points of somebody who stands on the floor
_STANDING = (1.2, 2.4)  # [m]


@dataclass(frozen=True)
class Size:
    """A length in the take's units, and what it would be on a human."""

    what: str  # what was measured, in words up to the number
    value: float  # the length, in units of the take
    usual: float  # what it is on most humans [m]
    spread: float  # it may be longer or shorter than that by this factor
    units: Mapping[str, float]  # the units that come into question, in metres

    def __str__(self) -> str:
        return f"{self.what} {self.value:.4g} units"


@dataclass(frozen=True)
class Unit:
    """A unit of length and why it was taken."""

    name: str
    factor: float  # metres per unit
    why: str


def measure(take: Take, arms: Sequence[Arm]) -> Size:
    """The most reliable length: shoulder to wrist of an arm, else the height of a body, else the points' extent."""
    frames = np.unique(np.linspace(0, len(take.time) - 1, _FRAMES).astype(int)) if len(take.time) else np.empty(0, int)
    points = {name: values[frames] for name, values in take.points.items()}
    for arm in arms:
        last = "wrist" if "wrist" in arm.roles else "hand"
        roles = [arm.roles[role] for role in ("shoulder", "elbow", last)]
        places = np.array([np.mean([points[name] for name in role], axis=0) for role in roles])
        length = median_seen(np.linalg.norm(np.diff(places, axis=0), axis=2).sum(axis=0))
        if math.isfinite(length) and length > 0:
            # upper arm 0.186 and forearm 0.146 of a height of 1.66 m (Drillis and Contini 1966)
            return Size(f"from shoulder over elbow to {last} it is", length, 0.55, _FINE, _EVERY)
    extent = _extent(points)
    if len(points) >= _WHOLE_BODY:
        return Size("the body extends over", extent, 1.6, _FINE, _EVERY)
    return Size("the points extend over", extent, 0.8, _COARSE, _DECADES)


def unit_of_size(size: Size) -> Unit | None:
    """The unit in which a length is nearest to what it is on a human; None if it is so in none."""
    if not (math.isfinite(size.value) and size.value > 0):
        return None
    off = {name: abs(math.log(size.value * factor / size.usual)) for name, factor in size.units.items()}
    best = min(off, key=lambda name: off[name])
    if off[best] > math.log(size.spread):
        return None
    factor = size.units[best]
    library = "those of the CMU library, " if best == "CMU" else ""
    why = f"assumed because the file does not say and {size.what} {size.value * factor:.2f} m then"
    return Unit(best, factor, f"{library}{why} (otherwise use --units)")


def _extent(points: Mapping[str, Array]) -> float:
    """Median over the frames of the longest side of the box around all points."""
    if not points:
        return math.nan
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # frames in which nothing was seen
        every = np.stack(list(points.values()))
        sides = np.nanmax(every, axis=0) - np.nanmin(every, axis=0)
    return median_seen(sides.max(axis=1))


class Up(NamedTuple):
    """What the data say, and why."""

    axis: str | None  # x, y or z, with a minus where it points down
    why: str


def find_up(take: Take, factor: float, usual: str) -> Up:
    """The axis that points up by the data, where they are decided.

    That is the one along which heads are above feet, or shoulders above the pelvis; or the only one along which a
    standing body has its lowest points at 0; or, if everything is below the floor along the usual axis, the only one
    along which nothing is.

    Args:
        take: Any take.
        factor: Metres per unit.
        usual: The axis that is usual for the format.
    """
    if not take.points or len(take.time) == 0:
        return Up(None, "")
    frames = np.unique(np.linspace(0, len(take.time) - 1, _FRAMES).astype(int))
    points = {name: values[frames] * factor for name, values in take.points.items()}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # points that were never seen
        found = _by_names(points, _HIGH, _LOW, _LEAST_BODY)
        found = found if found.axis is not None else _by_names(points, _TRUNK, _PELVIS, _LEAST_TRUNK)
        found = found if found.axis is not None else _by_floor(points, usual[-1])
        return found if found.axis is not None else _by_sides(points, usual[-1])


def _by_names(points: Mapping[str, Array], above: Iterable[str], below: Iterable[str], least: float) -> Up:
    """From points that by their names are high or low on the body, if they are so in nearly all frames."""
    high = [name for name in points if _is_of(name, above)]
    low = [name for name in points if _is_of(name, below)]
    if not high or not low:
        return Up(None, "")
    rises = np.nanmean([points[name] for name in high], axis=0) - np.nanmean([points[name] for name in low], axis=0)
    rises = rises[np.isfinite(rises).all(axis=1)]
    if not len(rises):
        return Up(None, "")
    middle = np.median(rises, axis=0)
    axis = int(np.abs(middle).argmax())
    sign = -1.0 if middle[axis] < 0 else 1.0  # cameras have an axis that points down
    upright = sign * rises[:, axis] >= np.maximum(_UPRIGHT * np.linalg.norm(rises, axis=1), least)
    if upright.mean() < _MOSTLY:
        return Up(None, "")
    rise = sign * float(middle[axis])
    if sign < 0:
        return Up(f"-{'xyz'[axis]}", f"points such as '{high[0]}' are {rise:.2f} m above ones such as '{low[0]}' then")
    return Up("xyz"[axis], f"points such as '{high[0]}' are {rise:.2f} m above ones such as '{low[0]}' along it")


def _by_sides(points: Mapping[str, Array], usual: str) -> Up:
    """From left and right: where these lie along the usual axis it is level, and the shoulders are above the rest."""
    sides = {name: _sided(name) for name in points}
    right = {stem: name for name, (side, stem) in sides.items() if side == "r"}
    pairs = [(right[stem], name) for name, (side, stem) in sides.items() if side == "l" and stem in right]
    pairs = [pair for pair in pairs if np.isfinite(points[pair[0]] + points[pair[1]]).all(axis=1).any()]
    if not pairs:
        return Up(None, "")
    apart = np.nanmean([np.abs(points[a] - points[b]) for a, b in pairs], axis=0)
    apart = apart[np.isfinite(apart).all(axis=1)]
    across = int(np.median(apart, axis=0).argmax()) if len(apart) else -1
    level = len(apart) and (apart[:, across] >= _UPRIGHT * np.linalg.norm(apart, axis=1)).mean() >= _MOSTLY
    if not level or "xyz"[across] != usual:
        return Up(None, "")
    others = [axis for axis in range(3) if axis != across]
    rises = _rises(points)
    rise = np.zeros(3) if rises is None else np.median(rises, axis=0)
    axis = max(others, key=lambda axis: rise[axis])
    why = f"points such as '{pairs[0][0]}' and '{pairs[0][1]}' lie left and right of each other along {usual}"
    if rise[axis] < _LEAST_RISE or rise[axis] < _CLEARLY * np.abs(rise[others]).sum():
        return Up("y" if usual == "z" else "z", why)
    return Up("xyz"[axis], f"{why}, and the shoulders are {rise[axis]:.2f} m above the arms along it")


def _rises(points: Mapping[str, Array]) -> Array | None:
    """How far shoulders are from elbows, wrists and hands in each frame, shape (F, 3) [m]; None where unknown."""
    found = []
    for arm in find_arms(points):
        shoulder = np.mean([points[name] for name in arm.roles["shoulder"]], axis=0)
        found += [
            shoulder - np.mean([points[name] for name in names], axis=0)
            for role, names in arm.roles.items()
            if role != "shoulder"
        ]
    every = np.concatenate(found) if found else np.empty((0, 3))
    every = every[np.isfinite(every).all(axis=1)]
    return every if len(every) else None


def _sided(name: str) -> tuple[str, str]:
    """The side in a name, ``r`` or ``l``, and the rest of it; no side where there is none."""
    local = re.sub(r"[ ._\-]", "", name.rpartition(":")[2].lower())
    for word in ("right", "left", "r", "l"):
        if local.startswith(word):
            return word[0], f"{local[len(word) :]}"
        if local.endswith(word):
            return word[0], f"{local[: -len(word)]}"
    return "", local


def _is_of(name: str, words: Iterable[str]) -> bool:
    """Whether a name is one of the words, with or without a side and a subject."""
    local = re.sub(r"[ ._\-]", "", name.rpartition(":")[2].lower())
    before = {local.removeprefix(side) for side in _SIDES}
    return not before.isdisjoint(words) or not {local.removesuffix(side) for side in _SIDES}.isdisjoint(words)


def _by_floor(points: Mapping[str, Array], usual: str) -> Up:
    """From a floor at 0, with somebody standing on it or at least nobody below it."""
    every = np.concatenate(list(points.values()))
    every = every[np.isfinite(every).all(axis=1)]
    if not len(every):
        return Up(None, "")
    lowest, highest = np.quantile(every, [0.005, 0.995], axis=0)
    low = (lowest > _FLOOR[0]) & (lowest < _FLOOR[1])
    stands = low & (highest - lowest > _STANDING[0]) & (highest - lowest < _STANDING[1])
    if low.sum() == 1 and stands.sum() == 1:
        axis = int(np.argmax(stands))
        why = f"its lowest values are at 0 and its highest at {highest[axis]:.2f} m, as of somebody standing"
        return Up("xyz"[axis], why)
    above = (lowest > _FLOOR[0]) & (highest < _STANDING[1])
    if highest["xyz".index(usual)] < 0.0 and above.sum() == 1:
        axis = int(np.argmax(above))
        why = f"all points are {lowest[axis]:.2f} to {highest[axis]:.2f} m above 0 along it, but below 0 along {usual}"
        return Up("xyz"[axis], why)
    return Up(None, "")
