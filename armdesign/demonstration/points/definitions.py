"""Values of points that are defined by an expression: positions, and the orientation where there is one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import seconds
from armdesign.demonstration.points.expressions import Expression
from armdesign.demonstration.points.rigid_fit import MARKERS, RigidFit, fit_rigid
from armdesign.demonstration.recording import Recording, Step
from armdesign.errors import TaskError

RIGID = 0.01
"""Residual, root mean square, up to which markers count as being on one rigid body [m]."""


@dataclass(frozen=True, eq=False)
class Point:
    """A point that an expression defines.

    Attributes:
        expression: The expression, with all names in full.
        positions: Shape (T, 3) [m]; None for something that has an orientation only.
        quaternions: Shape (T, 4), of the one oriented point or body that it is; None for others.
        markers: The three or more markers it is the mean of; empty for others.
        steps: What was done.
    """

    expression: Expression
    positions: Array | None
    quaternions: Array | None = None
    markers: tuple[str, ...] = ()
    steps: tuple[Step, ...] = ()


def define(expression: Expression, recording: Recording, earlier: Mapping[str, Point]) -> Point:
    """Work out an expression.

    A mean of three or more markers of one rigid body is also known where some of them are hidden: their places follow
    from the others by a rigid fit.

    Args:
        expression: The expression.
        recording: The recording whose points it may refer to.
        earlier: Points defined before, which go before those of the recording.

    Raises:
        TaskError: It needs the position of something that has an orientation only.
    """
    if expression.single is not None:
        known = _one(expression.single, recording, earlier)
        steps = () if expression.single in earlier else known.steps  # what was told before is not told again
        return Point(expression, known.positions, known.quaternions, known.markers, steps)
    names = tuple(term.name for term in expression.terms)
    markers = all(name in recording.points and name not in earlier for name in names) and not expression.weighted
    if markers and len(set(names)) == len(names) >= MARKERS:
        return _mean_of_markers(expression, names, recording)
    total = np.zeros((recording.frames, 3))
    for term in expression.terms:
        total = total + term.weight * _position(term.name, recording, earlier)
    return Point(expression, total)


def orientation_of(point: Point, recording: Recording) -> tuple[Array, tuple[Step, ...]]:
    """The orientation of a point: that of the body it is, or of the markers it is the mean of.

    Args:
        point: The point.
        recording: Where it comes from.

    Returns:
        Quaternions of shape (T, 4), NaN where unknown, and what was done.

    Raises:
        TaskError: It has none, or its markers do not tell one.
    """
    name = point.expression.name
    if point.quaternions is not None:
        return point.quaternions, ()
    if not point.markers:
        raise _no_orientation(name, point.expression, recording)
    fit = fit_rigid(_stack(point.markers, recording), point.markers, recording.source)
    return fit.quaternions, (_fit_step(name, point.markers, fit, recording),)


def _no_orientation(name: str, expression: Expression, recording: Recording) -> TaskError:
    """The error for a point without an orientation."""
    what = "a mean with weights" if expression.weighted else "a single point"
    if expression.single is None and not expression.weighted:
        what = f"the mean of {len(expression.terms)} points"
    message = f"{recording.source}: there is no orientation of '{name}', which is {what}"
    fix = "Name an oriented point or body, or three or more markers of one rigid body, as in hand=A+B+C"
    if not recording.orientations:
        return TaskError(f"{message}, nor of any other point", value=name, fix=f"{fix}, or leave the orientation out")
    return TaskError(message, value=name, allowed=list(recording.orientations), fix=fix)


def _one(name: str, recording: Recording, earlier: Mapping[str, Point]) -> Point:
    """A point that is there already."""
    if name in earlier:
        return earlier[name]
    plain = Expression(name, ())
    if name in recording.points or name in recording.orientations:
        positions, turns = recording.points.get(name), recording.orientations.get(name)
        own = () if turns is not None else _known_markers(name, recording)
        return Point(plain, positions, turns, own)
    return _mean_of_markers(plain, _known_markers(name, recording), recording)


def _known_markers(name: str, recording: Recording) -> tuple[str, ...]:
    """The markers of a rigid body that the recording holds, if it tells and they suffice for a pose."""
    markers = tuple(marker for marker in recording.about.bodies.get(name, ()) if marker in recording.points)
    return markers if len(markers) >= MARKERS else ()


def _position(name: str, recording: Recording, earlier: Mapping[str, Point]) -> Array:
    """Positions of a point that is there already."""
    positions = _one(name, recording, earlier).positions
    if positions is None:
        message = f"{recording.source}: '{name}' has an orientation, but no position"
        raise TaskError(message, value=name, allowed=list(recording.points))
    return positions


def _stack(markers: tuple[str, ...], recording: Recording) -> Array:
    """Positions of shape (T, n, 3)."""
    return np.stack([recording.points[name] for name in markers], axis=1)


def _mean_of_markers(expression: Expression, markers: tuple[str, ...], recording: Recording) -> Point:
    """The mean of markers, also in frames in which some are hidden if they are those of a rigid body."""
    places = _stack(markers, recording)
    hidden = np.isnan(places[:, :, 0])
    mean = places.mean(axis=1)
    some = np.asarray(hidden.any(axis=1))
    partly = some & (np.count_nonzero(hidden, axis=1) <= len(markers) - MARKERS)
    if not partly.any():
        return Point(expression, mean, None, markers)
    try:
        fit = fit_rigid(places, markers, recording.source)
    except TaskError:  # nothing rigid to be had: the mean needs all of them
        return Point(expression, mean, None, markers)
    if fit.rms > RIGID:
        return Point(expression, mean, None, markers)
    filled = np.where(some[:, None], fit.markers.mean(axis=1), mean)
    count = int(np.count_nonzero(some & fit.known))
    steps = (_hidden_step(expression.name, count, fit, recording),) if count else ()
    return Point(expression, filled, None, markers, steps)


def _hidden_step(name: str, count: int, fit: RigidFit, recording: Recording) -> Step:
    """What was done about hidden markers."""
    sentence = (
        f"In {count} of {recording.frames} frames some markers of '{name}' are hidden; there they were placed by a "
        f"rigid fit to the others (residual {1e3 * fit.rms:.1f} mm rms)."
    )
    return Step("hidden-markers", sentence, {"point": name, "frames": count, "rms_mm": 1e3 * fit.rms})


def _fit_step(name: str, markers: tuple[str, ...], fit: RigidFit, recording: Recording) -> Step:
    """How well markers tell the pose of a body."""
    worst, frame, marker = fit.worst
    unknown = int((~fit.known).sum())
    sentence = (
        f"The orientation of '{name}' is a rigid fit to {', '.join(markers)}: residual {1e3 * fit.rms:.1f} mm rms, at "
        f"most {1e3 * worst:.1f} mm ({markers[marker]} at {seconds(float(recording.time[frame]))})"
    )
    sentence += f"; unknown in {unknown} of {recording.frames} frames, where too few are seen." if unknown else "."
    if fit.rms > RIGID:
        sentence += " That is much for one rigid body: check whether these markers are on one."
    details: dict[str, object] = {
        "point": name,
        "markers": list(markers),
        "rms_mm": 1e3 * fit.rms,
        "worst_mm": 1e3 * worst,
        "worst_time": float(recording.time[frame]),
        "worst_marker": markers[marker],
        "frames_unknown": unknown,
    }
    return Step("rigid-fit", sentence, details)
