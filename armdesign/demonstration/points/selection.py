"""Which points of a recording a task uses, and the values of those that an expression defines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import seconds
from armdesign.demonstration.points.expressions import Expression, nearest, parse, quoted
from armdesign.demonstration.points.guess import Arm, Guess, guess_arm
from armdesign.demonstration.points.rigid_fit import MARKERS, RigidFit, fit_rigid
from armdesign.demonstration.points.standard import is_mirrored
from armdesign.demonstration.recording import Recording, Step
from armdesign.errors import TaskError

ORIGIN = "origin"
"""Name of the base where there is no base point: the points of a recording count from its origin."""
CARRIER = "carrier "
"""What comes before the name of a body that carries something, among the points and orientations of a selection."""
NAMED = "--base SHOULDER --points elbow=A+B,wrist=C,hand=D"
"""How the points of an arm are named, where their names are not known."""
RIGID = 0.01
"""Residual, root mean square, up to which markers count as being on one rigid body [m]."""


@dataclass(frozen=True, eq=False)
class Point:
    """A point that an expression defines."""

    expression: Expression  # with all names in full
    positions: Array | None  # (T, 3) [m]; None for something that has an orientation only
    quaternions: Array | None = None  # (T, 4), of the one oriented point or body that it is; None for others
    markers: tuple[str, ...] = ()  # the three or more markers it is the mean of; empty for others
    steps: tuple[Step, ...] = ()  # what was done


def define(expression: Expression, recording: Recording, earlier: Mapping[str, Point]) -> Point:
    """Work out an expression.

    A mean of three or more markers of one rigid body is also known where some of them are hidden: their places follow
    from the others by a rigid fit.

    Args:
        expression: The expression.
        recording: The recording whose points it may refer to.
        earlier: Points defined before, which go before those of the recording.
    """
    if expression.single is not None:
        known = _one(expression.single, recording, earlier)
        steps = () if expression.single in earlier else known.steps  # each step is reported once
        return Point(expression, known.positions, known.quaternions, known.markers, steps)
    names = tuple(term.name for term in expression.terms)
    markers = all(name in recording.points and name not in earlier for name in names) and not expression.weighted
    if markers and len(set(names)) == len(names) >= MARKERS:
        return _mean_of_markers(expression, names, recording)
    total = np.zeros((recording.frames, 3))
    for term in expression.terms:
        places = _one(term.name, recording, earlier).positions
        if places is None:
            message = f"{recording.source}: '{term.name}' has an orientation, but no position"
            raise TaskError(message, value=term.name, allowed=list(recording.points))
        total = total + term.weight * places
    return Point(expression, total)


def orientation_of(point: Point, recording: Recording) -> tuple[Array, tuple[Step, ...]]:
    """The orientation of a point, that of the body it is or of its markers, shape (T, 4), and what was done."""
    name = point.expression.name
    if point.quaternions is not None:
        return point.quaternions, ()
    if not point.markers:
        expression = point.expression
        what = "a mean with weights" if expression.weighted else "a single point"
        if expression.single is None and not expression.weighted:
            what = f"the mean of {len(expression.terms)} points"
        message = f"{recording.source}: there is no orientation of '{name}', which is {what}"
        message += "" if recording.orientations else ", nor of any other point"
        fix = "Name an oriented point or body, or three or more markers of one rigid body, as in hand=A+B+C"
        fix += "" if recording.orientations else ", or leave the orientation out"
        raise TaskError(message, value=name, allowed=list(recording.orientations) or None, fix=fix)
    fit = fit_rigid(_stack(point.markers, recording), point.markers, recording.source)
    return fit.quaternions, (_fit_step(name, point.markers, fit, recording),)


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
    """The markers of a rigid body that the recording holds, if it names them and they suffice for a pose."""
    markers = tuple(marker for marker in recording.about.bodies.get(name, ()) if marker in recording.points)
    return markers if len(markers) >= MARKERS else ()


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
    sentence = (
        f"In {count} of {recording.frames} frames some markers of '{expression.name}' are hidden; there they were "
        f"placed by a rigid fit to the others (residual {1e3 * fit.rms:.1f} mm rms)."
    )
    step = Step("hidden-markers", sentence, {"point": expression.name, "frames": count, "rms_mm": 1e3 * fit.rms})
    return Point(expression, filled, None, markers, (step,) if count else ())


def _fit_step(name: str, markers: tuple[str, ...], fit: RigidFit, recording: Recording) -> Step:
    """How well markers determine the pose of a body."""
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


@dataclass(frozen=True, eq=False)
class Selection:
    """The points that a task uses, under the names it calls them."""

    recording: Recording  # exactly base, points and the orientation, if there is one
    base: str  # name of the base
    points: tuple[str, ...]  # names of the points from the base to the hand
    orientation: str | None  # name of the orientation; None for none
    steps: tuple[Step, ...]  # what was guessed, joined and fitted
    # name to the expression behind it, all names in full; resolving these again gives the same
    expressions: Mapping[str, str]
    definitions: Mapping[str, Point] = field(default_factory=dict)  # base and points as they were defined
    guessed: str | None = None  # name of the orientation that goes with a guessed arm; None where nothing was guessed
    # names of bodies that carry something; position and orientation of each are in the recording, too
    carriers: tuple[str, ...] = ()


def resolve(
    recording: Recording, base: str | None, points: Sequence[str], orientation: str | None, *, oriented: bool = False
) -> Selection:
    """Find or make the points that a task is to use.

    Args:
        recording: In metres with z up.
        base: Expression for the base. Where not given: the shoulder guessed by the names in a take of a capture
            system, the first point in a finished recording. ORIGIN, where that is no point: there is none.
        points: Expressions for the points from the base to the hand; they may refer to points defined before.
            Where not given: guessed, or all but the base.
        orientation: Expression for what has the hand's orientation; None for none.
        oriented: Whether an orientation is needed, so that without ``orientation`` the guessed one, else that of the
            last point is taken.

    Raises:
        TaskError: A name is unknown or ambiguous, a point is used twice or was never seen, there is no such
            orientation, or nothing could be guessed; the message lists the names.
    """
    if not recording.points and not recording.about.bodies:
        raise TaskError(f"{recording.source}: there are no points, only orientations")
    defined: dict[str, Point] = {}
    if base == ORIGIN and ORIGIN not in recording.points:
        first, guessed, parts = ORIGIN, None, set()
        steps: tuple[Step, ...] = ()
    else:
        base, points, guessed, steps = _completed(recording, base, tuple(points))
        first = _add(defined, base, recording, " for the base")
        parts = {term.name for term in defined[first].expression.terms}
    for text in points or [quoted(name) for name in recording.points if name not in parts]:
        _add(defined, text, recording)
    names = tuple(name for name in defined if name != first)
    if not names:
        message = f"{recording.source}: beside the base '{first}' there is no point to follow"
        raise TaskError(message, value=first, fix="Record at least one more point, the hand")
    places = {name: _seen(point.positions, f"point '{name}'", recording) for name, point in defined.items()}
    more = [step for point in defined.values() for step in point.steps]
    expressions = {name: str(point.expression) for name, point in defined.items()}
    used = Recording(recording.time, places, {}, recording.source, recording.about)
    selection = Selection(used, first, names, None, (*steps, *more), expressions, defined, guessed)
    return with_orientation(selection, recording, orientation) if orientation or oriented else selection


def with_orientation(selection: Selection, recording: Recording, orientation: str | None = None) -> Selection:
    """Add the hand's orientation to the points of a task.

    Args:
        selection: The points.
        recording: What they were selected from.
        orientation: Expression for what has the orientation; by default what was guessed, else the last point.

    Raises:
        TaskError: There is no such orientation; the message lists the names.
    """
    text = orientation or selection.guessed or selection.points[-1]
    defined = selection.definitions
    known = list(dict.fromkeys([*_known(recording, defined), *recording.orientations]))
    expression = parse(text, known, f"{recording.source}, orientation")
    name, point = expression.name, defined.get(expression.name)
    if point is None or expression.single != name:
        point = define(expression, recording, defined)
    quaternions, steps = orientation_of(point, recording)
    turns = {name: _seen(quaternions, f"the orientation of '{name}'", recording)}
    used = Recording(recording.time, selection.recording.points, turns, recording.source, recording.about)
    expressions = {name: str(point.expression)} | dict(selection.expressions)
    steps = (*selection.steps, *steps)
    return replace(selection, recording=used, orientation=name, steps=steps, expressions=expressions)


def with_carriers(selection: Selection, recording: Recording, bodies: Sequence[str]) -> Selection:
    """Add bodies that carry something, with their positions and orientations, to the points of a task.

    Args:
        selection: The points.
        recording: What they were selected from.
        bodies: Names of oriented points, rigid bodies, or expressions such as ``A+B+C``.

    Raises:
        TaskError: There is no such body, or no orientation of it.
    """
    chosen, defined = selection.recording, selection.definitions
    points, turns, steps = dict(chosen.points), dict(chosen.orientations), selection.steps
    known = list(dict.fromkeys([*_known(recording, defined), *recording.orientations]))
    for body in bodies:
        expression = parse(body, known, f"{recording.source}, carried_by")
        point = defined.get(expression.name) or define(expression, recording, defined)
        if point.positions is None:
            message = f"{recording.source}: '{body}' has an orientation, but no position"
            raise TaskError(message, value=body, allowed=list(recording.points))
        quaternions, more = orientation_of(point, recording)
        points[CARRIER + body] = _seen(point.positions, f"'{body}'", recording)
        turns[CARRIER + body] = _seen(quaternions, f"the orientation of '{body}'", recording)
        steps = (*steps, *more)
    kept = Recording(chosen.time, points, turns, chosen.source, chosen.about)
    return replace(selection, recording=kept, steps=steps, carriers=tuple(bodies))


def _completed(
    recording: Recording, base: str | None, points: tuple[str, ...]
) -> tuple[str, tuple[str, ...], str | None, tuple[Step, ...]]:
    """Base, points and, if guessed, the orientation's name; no points where all others are meant."""
    if base is not None and points:
        return base, points, None, ()
    if not recording.about.captured:
        return base or quoted(next(iter(recording.points), "")), points, None, ()
    known, source = _known(recording, {}), recording.source
    part = None if base is None else parse(base, known, source, " for the base").terms[0].name
    guess = guess_of(recording, part)
    if guess.arm is None and any(step.name == "joined" for step in recording.about.steps):
        return base or quoted(next(iter(recording.points))), points, None, ()  # named by the user, in order
    if guess.arm is None:
        listed = ", ".join(quoted(name) for name in nearest("", known))
        flags = NAMED[NAMED.index("--points") :] if base else NAMED
        message = f"{source}: {guess.sentence[0].lower()}{guess.sentence[1:]}; its points are {listed}"
        raise TaskError(message, value=known, fix=f"Name those of the arm, as in {flags}")
    step = Step("guess", guess.sentence, {"base": guess.arm.base, "points": list(guess.arm.points)})
    own = None if points else guess.arm.orientation(recording.orientations)
    return base or guess.arm.base, points or guess.arm.points, own, (step,)


def guess_of(recording: Recording, base: str | None = None) -> Guess:
    """The arm found by the names of the points: the right one, after mirroring the left one, if both are there.

    Args:
        recording: In metres with z up.
        base: A point that has to be (part of) the shoulder; None for any.
    """
    return guess_arm(recording.points, side="left" if is_mirrored(recording) else "right", base=base)


def arm_paths(arm: Arm, recording: Recording) -> dict[str, Array]:
    """Name to positions of an arm's points, from the shoulder on, each of shape (T, 3) [m]."""
    known = list(recording.points)
    found = [define(parse(text, known, recording.source), recording, {}) for text in (arm.base, *arm.points)]
    return {point.expression.name: point.positions for point in found if point.positions is not None}


def _known(recording: Recording, defined: Mapping[str, Point]) -> list[str]:
    """Names that an expression for a position may use."""
    return list(dict.fromkeys([*defined, *recording.points, *recording.about.bodies]))


def _add(defined: dict[str, Point], text: str, recording: Recording, purpose: str = "") -> str:
    """Define one more point; its name."""
    expression = parse(text, _known(recording, defined), recording.source, purpose)
    name = expression.name
    if name in defined:
        if name == next(iter(defined)):
            others = [other for other in recording.points if other not in defined]
            raise TaskError(f"'{name}' is the base and cannot be among the points", value=name, allowed=others)
        raise TaskError(f"point '{name}' is given twice", value=name, fix="Name each point once")
    defined[name] = define(expression, recording, defined)
    return name


def _seen(values: Array | None, what: str, recording: Recording) -> Array:
    """The values, unless there are none in any frame."""
    if values is None:
        message = f"{recording.source}: {what} has an orientation, but no position"
        raise TaskError(message, value=what, allowed=list(recording.points))
    if np.isnan(values).all():
        message = f"{recording.source}: {what} was not seen in any frame"
        raise TaskError(message, value=what, fix="Use another one or leave it out")
    return values
