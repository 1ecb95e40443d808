"""A motion recording: named points and orientations over time, whatever file they came from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import PurePath

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import RecordingError, counted
from armdesign.kinematics.line_drawing import COLOURS, Line, drawing, shown

Change = Callable[[Array], Array]

TIME_UNITS: Mapping[str, float] = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Seconds per unit."""
MIN_FRAMES = 3
_COUNTS = ("no frame", "one frame", "two frames")


@dataclass(frozen=True)
class Step:
    """Something that was found in the data or done to it.

    Attributes:
        name: Short name of the step, such as ``units`` or ``gaps``.
        sentence: What was found or done, in one or two whole sentences.
        details: The figures behind the sentence, as plain JSON values.
    """

    name: str
    sentence: str
    details: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class About:
    """Where a recording comes from and what was done on the way.

    Attributes:
        format: Format and version of the file, such as ``C3D``; empty where there was no file.
        captured: Whether the numbers come straight from a capture system and need cleaning.
        rate: Frames per second that the file declares [1/s]; None where it does not.
        bodies: Rigid bodies to the names of the markers on them, where the file says so.
        steps: What was found and done on reading.
    """

    format: str = ""
    captured: bool = False
    rate: float | None = None
    bodies: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    steps: tuple[Step, ...] = ()


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """Paths of named points, some of them with an orientation. NaN means "not seen in this frame".

    A frame in which part of a position or quaternion is missing counts as missing altogether.

    Attributes:
        time: Frame times, strictly increasing, shape (T,) [s].
        points: Name to positions, each of shape (T, 3) [m].
        orientations: Name to quaternions x, y, z, w (scalar last), each of shape (T, 4). A name may have an
            orientation and no position.
        source: The file or a few words about where this comes from, for messages.
        about: The format it had and what was done on reading.
    """

    time: Array
    points: Mapping[str, Array]
    orientations: Mapping[str, Array] = field(default_factory=dict)
    source: str = "recording"
    about: About = field(default_factory=About)

    def __post_init__(self) -> None:
        """Normalise to read-only float arrays and check them.

        Raises:
            RecordingError: Fewer than three frames, times that do not increase, a wrong shape, an infinite value.
        """
        time = np.array(self.time, dtype=float)
        time.setflags(write=False)
        object.__setattr__(self, "time", time)
        self._check_time()
        points = {name: self._series(name, values, 3) for name, values in self.points.items()}
        turns = {name: self._series(name, values, 4) for name, values in self.orientations.items()}
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "orientations", turns)

    def __repr__(self) -> str:
        turns = f", {counted(len(self.orientations), 'orientation')}" if self.orientations else ""
        name = PurePath(self.source).name or self.source
        size = f"{counted(self.frames, 'frame')}, {self.rate:.4g} Hz, {counted(len(self.points), 'point')}"
        return f"Recording {name!r}: {size}{turns}"

    def _repr_html_(self) -> str:
        return shown(repr(self), drawing(path_lines(self.points)))

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.time)

    @property
    def step(self) -> float:
        """Median time from frame to frame [s]."""
        return median_step(self.time)

    @property
    def rate(self) -> float:
        """Frames per second, from the median step [1/s]."""
        return 1.0 / self.step

    def changed(self, time: Array, positions: Change, quaternions: Change) -> Recording:
        """A recording of the same points and orientations with other values.

        Args:
            time: The new times, shape (T',) [s].
            positions: Gives the new positions, shape (T', 3), for the old ones.
            quaternions: Gives the new quaternions, shape (T', 4), for the old ones.
        """
        points = {name: positions(values) for name, values in self.points.items()}
        turns = {name: quaternions(values) for name, values in self.orientations.items()}
        return Recording(time, points, turns, self.source, self.about)

    def _check_time(self) -> None:
        if self.time.ndim != 1:
            raise RecordingError(f"{self.source}: the times have shape {self.time.shape}", allowed="(T,)")
        if self.frames < MIN_FRAMES:
            message = f"{self.source} has {_COUNTS[self.frames]}, but a motion takes at least three"
            raise RecordingError(message, value=self.frames, fix="Record longer, or cut less away")
        bad = first_bad_step(self.time)
        if bad is not None:
            message = f"{self.source}, frame {bad + 1}: {describe_bad_step(self.time, bad)}"
            fix = "Every frame needs a later time than the one before"
            raise RecordingError(message, value=float(self.time[bad]), fix=fix)

    def _series(self, name: str, values: ArrayLike, width: int) -> Array:
        """Checked, read-only copy of one point's values, with frames missing as a whole."""
        series = np.array(values, dtype=float, order="C")
        if not name or name != name.strip() or any(ord(letter) < 32 for letter in name):
            raise RecordingError(f"{self.source}: {name!r} cannot be the name of a point", value=name)
        if series.shape != (self.frames, width):
            raise RecordingError(
                f"{self.source}: point '{name}' has values of shape {series.shape}", allowed=f"({self.frames}, {width})"
            )
        if np.isinf(series).any():
            frame = int(np.argmax(np.isinf(series).any(axis=1)))
            raise RecordingError(f"{self.source}: point '{name}' is infinite in frame {frame + 1}", value=series[frame])
        series[np.isnan(series).any(axis=1)] = np.nan
        series.setflags(write=False)
        return series


def path_lines(points: Mapping[str, Array]) -> list[Line]:
    """Paths of points, by their names, as lines to draw."""
    return [Line(path, COLOURS[k % len(COLOURS)], name) for k, (name, path) in enumerate(points.items())]


def median_step(time: Array) -> float:
    """Median time from frame to frame, for times of shape (T,) [s]."""
    return float(np.median(np.diff(time)))


def median_seen(values: Array) -> float:
    """Median of the values that are there, shape (T,); NaN if there are none."""
    there = values[np.isfinite(values)]
    return float(np.median(there)) if len(there) else float("nan")


def first_bad_step(time: Array) -> int | None:
    """Index of the first time that is not a number or not later than the one before; None if there is none."""
    if len(time) == 0 or not np.isfinite(time[0]):
        return 0 if len(time) else None
    bad = np.flatnonzero(~(np.diff(time) > 0) | ~np.isfinite(time[1:]))
    return int(bad[0]) + 1 if len(bad) else None


def describe_bad_step(time: Array, index: int) -> str:
    """What is wrong with the time at an index from ``first_bad_step``, for times of shape (T,) [s]."""
    if not np.isfinite(time[index]):
        return "the time is missing" if np.isnan(time[index]) else "the time is infinite"
    return f"the time does not increase, {time[index]:.12g} s comes after {time[index - 1]:.12g} s"


@dataclass(frozen=True, eq=False)
class Take:
    """A file's content in the file's own units and axes. NaN means "not seen in this frame".

    Attributes:
        time: Frame times, strictly increasing, shape (T,) [s]; frame numbers where the file is not ``timed``.
        points: Name to positions, each of shape (T, 3) [``units``]. Markers, joints and origins of bodies alike; names
            as in the file, subject prefix included, each once.
        orientations: Name to quaternions x, y, z, w (scalar last), body to reference axes, each of shape (T, 4).
        source: The file, for messages.
        format: Format and version, such as ``OptiTrack Motive CSV 1.23``.
        units: ``m``, ``cm``, ``mm`` or ``in``; None where the file does not say and the format does not settle it.
        up: Axis that points up, ``x``, ``y`` or ``z``, with a minus one that points down; None where the file does not
            say.
        rate: Frames per second that the file declares [1/s]; None where it does not.
        bodies: Rigid bodies to the names of the markers on them, where the file says so.
        captured: Whether the numbers come straight from a capture system and need cleaning; False for plain CSV, which
            is taken as finished.
        solved: Whether places follow from the pose of a skeleton, so that they are never unseen and may be at 0.
        timed: Whether the file has times or a frame rate.
        time_unit: Unit that the reader took times to be in, ``s``, ``ms``, ``us`` or ``ns``.
        unordered: Names whose quaternions' order the file does not tell; they are as in the file.
        usual_order: The order that these mostly have, ``xyzw`` or ``wxyz``; None to leave them out unless it is said.
        confidence: Name to how well a point was seen, from 0 to 1, each of shape (T,); NaN where that is not said.
        steps: What was odd in the file and what the reader made of it.
    """

    time: Array
    points: Mapping[str, Array]
    orientations: Mapping[str, Array]
    source: str
    format: str
    units: str | None = None
    up: str | None = None
    rate: float | None = None
    bodies: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    captured: bool = True
    solved: bool = False
    timed: bool = True
    time_unit: str = "s"
    unordered: frozenset[str] = frozenset()
    usual_order: str | None = None
    confidence: Mapping[str, Array] = field(default_factory=dict)
    steps: tuple[Step, ...] = ()
