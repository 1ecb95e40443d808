"""Which points of a recording a task uses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armdesign.demonstration.recording import Recording
from armdesign.errors import TaskError


def choose_base(recording: Recording, base: str | None) -> str:
    """The base point, by default the recording's first.

    Raises:
        TaskError: There is no such point.
    """
    if not recording.points:
        raise TaskError(f"{recording.source}: there are no points, only orientations")
    if base is None:
        return next(iter(recording.points))
    _require(recording, base, " for the base")
    return base


def choose_points(recording: Recording, base: str, points: Sequence[str]) -> tuple[str, ...]:
    """The points from the base to the hand, by default all others in their order.

    Raises:
        TaskError: A point does not exist, is the base or is given twice, or there is none left.
    """
    names = tuple(points) or tuple(name for name in recording.points if name != base)
    if not names:
        message = f"{recording.source}: beside the base '{base}' there is no point to follow"
        raise TaskError(message, value=base, fix="Record at least one more point, the hand")
    for i, name in enumerate(names):
        _require(recording, name)
        if name == base:
            others = [other for other in recording.points if other != base]
            raise TaskError(f"'{name}' is the base and cannot be among the points", value=name, allowed=others)
        if name in names[:i]:
            raise TaskError(f"point '{name}' is given twice", value=name, fix="Name each point once")
    return names


def select(recording: Recording, base: str, points: tuple[str, ...], orientation: str | None) -> Recording:
    """The recording with nothing but base, points and orientation.

    Raises:
        TaskError: The orientation does not exist, or something was not seen in any frame.
    """
    oriented = list(recording.orientations)
    if orientation is not None and orientation not in oriented:
        message = f"{recording.source}: there is no orientation of '{orientation}'"
        if not oriented:
            raise TaskError(f"{message}, nor of any other point", value=orientation, fix="Leave the orientation out")
        raise TaskError(message, value=orientation, allowed=oriented)
    used = {name: recording.points[name] for name in (base, *points)}
    turns = {} if orientation is None else {orientation: recording.orientations[orientation]}
    for kind, series in (("point", used), ("the orientation of", turns)):
        for name, values in series.items():
            if np.isnan(values).all():
                message = f"{recording.source}: {kind} '{name}' was not seen in any frame"
                raise TaskError(message, value=name, fix="Use another one or leave it out")
    return Recording(recording.time, used, turns, recording.source)


def _require(recording: Recording, name: str, purpose: str = "") -> None:
    """Raise unless the recording has a point of that name."""
    if name not in recording.points:
        message = f"{recording.source}: there is no point '{name}'{purpose}"
        raise TaskError(message, value=name, allowed=list(recording.points))
