"""Whether a body's left is at its left: files of left-handed axes, as game engines have them, show people mirrored."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.recording import Step

_FRAMES = 300  # looked at
_MOSTLY = 0.9  # of the frames
_CLEARLY = 0.5  # sine of the angle between ahead and sideways
_SIDES = re.compile(r"^(right|left|r|l)(.+)$|^(.+?)(right|left|r|l)$")
_WIDE = ("shoulder", "sho", "uparm", "upperarm", "uarm", "arm", "hip", "upleg", "thigh", "asi", "asis")
_AHEAD = ("toe", "toebase", "bigtoe", "footindex", "mt1", "mt5", "toe1")
_BEHIND = ("heel", "hee", "calc", "ankle", "ank", "foot")


def handed_steps(points: Mapping[str, Array]) -> list[Step]:
    """A doubt where, of a body with z up, what is called right lies at the left of the way its feet point.

    Args:
        points: Name to positions, shape (T, 3) [m].
    """
    sides = {name: _sided(name) for name in points}
    ahead = _mean(points, [name for name, (_, rest) in sides.items() if rest in _AHEAD])
    behind = _mean(points, [name for name, (_, rest) in sides.items() if rest in _BEHIND])
    wide = {side: [name for name, (s, rest) in sides.items() if s == side and rest in _WIDE] for side in "rl"}
    right, left = _mean(points, wide["r"]), _mean(points, wide["l"])
    if ahead is None or behind is None or right is None or left is None:
        return []
    forward, across = (ahead - behind)[:, :2], (right - left)[:, :2]
    size = np.linalg.norm(forward, axis=1) * np.linalg.norm(across, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        # who faces +x has the right at -y
        turn = (forward[:, 1] * across[:, 0] - forward[:, 0] * across[:, 1]) / size
    turn = turn[np.isfinite(turn)]
    if not len(turn) or (turn < -_CLEARLY).mean() < _MOSTLY:
        return []
    sentence = (
        "Warning: left and right look exchanged, by the way the feet point: the file has left-handed axes, as game "
        "engines have. Say --mirror."
    )
    return [Step("handed", sentence, {"right": wide["r"], "left": wide["l"]})]


def _sided(name: str) -> tuple[str, str]:
    """The side in a name, r or l, and the rest of it in small letters; no side where there is none."""
    local = re.sub(r"[ ._\-]", "", name.rpartition(":")[2].lower())
    match = _SIDES.match(local)
    if match is None:
        return "", local
    return (match[1] or match[4])[0], match[2] or match[3]


def _mean(points: Mapping[str, Array], names: list[str]) -> Array | None:
    """Middle of some points in some frames, shape (F, 3); None where there are none."""
    if not names:
        return None
    frames = np.unique(np.linspace(0, len(points[names[0]]) - 1, _FRAMES).astype(int))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # not seen at all
        return np.asarray(np.nanmean([points[name][frames] for name in names], axis=0))
