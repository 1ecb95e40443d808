"""Where the base may stand: regions as people write them, read into boxes of x, y, z and yaw with a mounting each."""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Protocol

import numpy as np

from armdesign._types import Array
from armdesign.errors import SettingsError
from armdesign.settings.kinds import LENGTHS

Range = tuple[float, float]
MOUNTINGS = ("floor", "wall", "ceiling")
FARTHEST = 100.0
"""Largest coordinate of a base in the room [m]."""
ANY_YAW = (-math.pi, math.pi)
LIKE = "a region such as 'x=-0.2..0.6 y=0.3..0.9 z=0 yaw=-90..90', lengths in metres, angles in degrees"
ENTRY = re.compile(r"([^\s,=]+)=([^\s,=]+)")


@dataclass(frozen=True)
class Site:
    """A box of places with one mounting; equal ends fix a coordinate."""

    mounted: str  # floor (z axis of the base up), wall (level) or ceiling (down)
    x: Range  # from where to where in the room [m]
    y: Range  # the same along y [m]
    z: Range  # the same along z, upwards [m]
    yaw: Range = ANY_YAW  # turn of the base about the vertical [rad]

    @property
    def box(self) -> Array:
        """Lower and upper corner [m], shape (2, 3)."""
        return np.array([self.x, self.y, self.z]).T

    def __str__(self) -> str:
        """The region as one would write it."""
        ends = [(axis, low, high) for axis, (low, high) in zip("xyz", self.box.T.tolist(), strict=True)]
        if self.yaw != ANY_YAW:
            ends.append(("yaw", math.degrees(self.yaw[0]), math.degrees(self.yaw[1])))
        texts = [f"{axis}={low:.6g}" + (f"..{high:.6g}" if high > low else "") for axis, low, high in ends]
        return " ".join([*texts, f"mounted={self.mounted}"])


NEAR_TASK = Site("floor", (-math.inf, math.inf), (-math.inf, math.inf), (0.0, 0.0))
"""Somewhere on the floor: where, only the task tells; see :func:`near_task`."""


class Place(Protocol):
    """What says where the base stands: the entries of the section Cell."""

    @property
    def place(self) -> tuple[str, ...]: ...  # noqa: D102
    @property
    def base_at(self) -> tuple[float, ...] | None: ...  # noqa: D102
    @property
    def stand(self) -> str | None: ...  # noqa: D102
    @property
    def mounted(self) -> str | None: ...  # noqa: D102


def sites(cell: Place) -> tuple[Site, ...]:
    """The places that a cell allows for the base; none where the base is a point of the recording.

    Args:
        cell: Regions as texts, or a point, and the mounting. On the floor without either: NEAR_TASK.

    Raises:
        SettingsError: A region cannot be read or is empty, or two entries contradict each other.
    """
    if cell.place and cell.base_at is not None:
        allowed = "a region (cell.place) or a point (cell.base_at), not both"
        raise SettingsError("the base has two places", value=cell.base_at, allowed=allowed)
    if cell.stand and cell.mounted and cell.mounted != cell.stand:
        what = f"setting 'cell.mounted' is '{cell.mounted}', but the base stands on the {cell.stand}"
        fix = "Leave cell.mounted out, or cell.stand"
        raise SettingsError(what, value=cell.mounted, allowed=cell.stand, fix=fix)
    mounted = cell.stand or cell.mounted
    if cell.base_at is not None:
        x, y, z = cell.base_at
        return tuple(Site(each, (x, x), (y, y), (z, z)) for each in mountings(mounted or "floor"))
    if cell.place:
        return tuple(site for text in cell.place for site in read_region(text, cell))
    if cell.stand == "floor":
        return (NEAR_TASK,)
    if mounted:
        entry = "stand" if cell.stand else "mounted"
        what = f"setting 'cell.{entry}' is '{mounted}', but nothing says where"
        fix = "Add a region (cell.place) or a point (cell.base_at)"
        raise SettingsError(what, value=mounted, fix=fix)
    return ()


def mountings(mounted: str) -> tuple[str, ...]:
    """The mountings that a word allows: itself, or all."""
    return MOUNTINGS if mounted == "any" else (mounted,)


def read_region(text: str, cell: Place) -> tuple[Site, ...]:
    """A region's text as sites, one for every mounting that it allows.

    Args:
        text: Entries ``x=from..to``, ``y``, ``z``, ``yaw``, ``mounted`` in any order, spaces or commas between them.
        cell: What mounting holds where the text names none.

    Raises:
        SettingsError: The text cannot be read, its bounds are upside down or out of range.
    """
    tight = re.sub(r"\s*(=|\.\.)\s*", r"\1", text)
    entries: dict[str, str] = {}
    rest = ENTRY.sub("", tight).strip(" ,\t\n")
    if rest or not tight.strip(" ,\t\n"):
        raise SettingsError(f"the place {text!r} cannot be read" + (f" at {rest!r}" if rest else ""), value=text,
                            allowed=LIKE)  # fmt: skip
    for key, value in ENTRY.findall(tight):
        if key not in ("x", "y", "z", "yaw", "mounted"):
            close = difflib.get_close_matches(key, ("yaw", "mounted"), n=1)
            fix = f"Did you mean {close[0]}?" if close else None
            what = f"the place {text!r} has the unknown entry '{key}'"
            raise SettingsError(what, value=key, allowed=["x", "y", "z", "yaw", "mounted"], fix=fix)
        if key in entries:
            what = f"the place {text!r} gives {key} twice"
            raise SettingsError(what, value=value, allowed="each once", fix="Write two places for two regions")
        entries[key] = value
    mounted = entries.pop("mounted", cell.stand or cell.mounted or "floor")
    if mounted not in (*MOUNTINGS, "any") or (cell.stand and mounted != cell.stand):
        allowed = cell.stand or ", ".join((*MOUNTINGS, "any"))
        why = f", but the base stands on the {cell.stand}" if cell.stand and mounted in (*MOUNTINGS, "any") else ""
        raise SettingsError(f"the place {text!r} is mounted={mounted}{why}", value=mounted, allowed=allowed)
    box = {key: read_range(key, value, text) for key, value in entries.items()}
    ranges = {axis: box.get(axis, (0.0, 0.0)) for axis in "xyz"}
    yaw = box.get("yaw", (-180.0, 180.0))
    turn = (math.radians(yaw[0]), math.radians(yaw[1]))
    return tuple(Site(each, **ranges, yaw=turn) for each in mountings(mounted))


def read_range(key: str, value: str, text: str) -> Range:
    """From where to where an entry of a region allows [m, deg].

    Args:
        key: x, y, z or yaw.
        value: A number or ``from..to``, each with or without its unit.
        text: The region, for messages.

    Raises:
        SettingsError: It is neither, upside down or out of range.
    """
    unit, most = ("deg", 360.0) if key == "yaw" else ("m", FARTHEST)
    allowed = f"a number or from..to, each from -{most:g} to {most:g} {unit}"
    ends = value.split("..")
    try:
        numbers = [read_measure(end, unit) for end in ends]
    except (ValueError, ZeroDivisionError, OverflowError) as error:
        raise SettingsError(f"the place {text!r} has {key}={value}", value=value, allowed=allowed) from error
    if len(numbers) > 2 or any(not -most <= number <= most for number in numbers):
        raise SettingsError(f"the place {text!r} has {key}={value}", value=value, allowed=allowed)
    low, high = numbers[0], numbers[-1]
    if low > high:
        what = f"the place {text!r} is empty: {key} goes from {ends[0]} down to {ends[-1]}"
        raise SettingsError(what, value=value, allowed=allowed, fix=f"Write {key}={ends[-1]}..{ends[0]}")
    return low, high


def read_measure(text: str, unit: str) -> float:
    """A number with or without its unit, in metres or degrees.

    Args:
        text: Such as ``0.3``, ``300mm``, ``90`` or ``90deg``.
        unit: ``m`` or ``deg``.

    Raises:
        ValueError: It is none.
    """
    text = text.strip()
    factors = LENGTHS if unit == "m" else {unit: Fraction(1)}
    for name in sorted(factors, key=len, reverse=True):
        if text.endswith(name):
            return float(Fraction(text[: -len(name)].strip()) * factors[name])
    return float(text)


def near_task(places: tuple[Site, ...], hand: Array, longest: float) -> tuple[Site, ...]:
    """Places with NEAR_TASK made a box: wherever on the floor an arm comes to every point of the hand's path.

    Args:
        places: What :func:`sites` gives.
        hand: Path of the hand in the room, shape (T, 3) [m].
        longest: L_max, largest length of an arm [m].
    """
    low, high = hand[:, :2].max(axis=0) - longest, hand[:, :2].min(axis=0) + longest
    if (low > high).any():  # the path is longer than any arm reaches: wherever one comes to a part of it
        low, high = hand[:, :2].min(axis=0) - longest, hand[:, :2].max(axis=0) + longest
    (x, y) = zip(low.tolist(), high.tolist(), strict=True)
    return tuple(replace(site, x=x, y=y) if site == NEAR_TASK else site for site in places)
