"""Which axis points up, from the data themselves."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.recording import Take

_TRUNK = (
    "acromion", "acromium", "acro", "acrotip", "acr", "shoulder", "sho", "neck", "c7", "t1", "clav", "ster", "strn",
)  # fmt: skip
_HIGH = ("head", "fhd", "bhd", *_TRUNK)
_PELVIS = ("asis", "asi", "psis", "psi", "pelvis", "hips", "hip", "sacrum", "sacr")
_LOW = ("ankle", "ank", "heel", "hee", "toe", "foot", "calc", "cal", "mt5", "mt1", "lmal", "mmal")
_SIDE = re.compile(r"^(?:right|left|r|l)?(.*?)(?:right|left|r|l)?$")
_UPRIGHT = 0.85  # cosine; a trunk that leans by less than 30 degrees
_MOSTLY = 0.9  # of the frames
_LEAST_BODY, _LEAST_TRUNK = 0.5, 0.25  # [m] from the feet, and from the pelvis, to the shoulders
_FRAMES = 500  # looked at
_FLOOR = (-0.05, 0.12)  # [m] the lowest points of somebody who stands on the floor
_STANDING = (1.2, 2.4)  # [m]


class Up(NamedTuple):
    """What the data say.

    Attributes:
        axis: ``x``, ``y`` or ``z``; None where they do not say.
        why: In words.
    """

    axis: str | None
    why: str


def find_up(take: Take, factor: float, usual: str) -> Up:
    """The axis that the data decidedly tell of.

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
    return found if found.axis is not None else _by_floor(points, usual)


def _by_names(points: Mapping[str, Array], above: Iterable[str], below: Iterable[str], least: float) -> Up:
    """From points whose names tell that they are high or low on the body, if they are so in nearly all frames."""
    high = [name for name in points if _is_of(name, above)]
    low = [name for name in points if _is_of(name, below)]
    if not high or not low:
        return Up(None, "")
    rises = np.nanmean([points[name] for name in high], axis=0) - np.nanmean([points[name] for name in low], axis=0)
    rises = rises[np.isfinite(rises).all(axis=1)]
    if not len(rises):
        return Up(None, "")
    axis = int(np.median(rises, axis=0).argmax())
    upright = rises[:, axis] >= np.maximum(_UPRIGHT * np.linalg.norm(rises, axis=1), least)
    if upright.mean() < _MOSTLY:
        return Up(None, "")
    rise = float(np.median(rises[:, axis]))
    return Up("xyz"[axis], f"points such as '{high[0]}' are {rise:.2f} m above ones such as '{low[0]}' along it")


def _is_of(name: str, words: Iterable[str]) -> bool:
    """Whether a name is one of the words, with or without a side and a subject."""
    local = re.sub(r"[ ._\-]", "", name.rpartition(":")[2].lower())
    match = _SIDE.match(local)
    return local in words or (match is not None and match[1] in words) or local[1:] in words or local[:-1] in words


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
