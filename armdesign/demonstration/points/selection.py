"""Which points of a recording a task uses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.points.definitions import Point, define, orientation_of
from armdesign.demonstration.points.expressions import nearest, parse, quoted
from armdesign.demonstration.points.guess import guess_arm
from armdesign.demonstration.points.standard import is_mirrored
from armdesign.demonstration.recording import Recording, Step
from armdesign.errors import TaskError


@dataclass(frozen=True, eq=False)
class Selection:
    """The points that a task uses, under the names it calls them.

    Attributes:
        recording: Exactly base, points and the orientation, if there is one.
        base: Name of the base.
        points: Names of the points from the base to the hand.
        orientation: Name of the orientation; None for none.
        steps: What was guessed, joined and fitted.
        expressions: Name to the expression behind it, all names in full; resolving these again gives the same.
        definitions: Base and points as they were defined.
        guessed: Name of the orientation that goes with a guessed arm; None where nothing was guessed.
    """

    recording: Recording
    base: str
    points: tuple[str, ...]
    orientation: str | None
    steps: tuple[Step, ...]
    expressions: Mapping[str, str]
    definitions: Mapping[str, Point] = field(default_factory=dict)
    guessed: str | None = None


def resolve(
    recording: Recording,
    base: str | None,
    points: Sequence[str],
    orientation: str | None,
    *,
    oriented: bool = False,
) -> Selection:
    """Find or make the points that a task is to use.

    Args:
        recording: In metres with z up.
        base: Expression for the base. Where not given: the shoulder guessed by the names in a take of a capture
            system, the first point in a finished recording.
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
    base, points, guessed, steps = _completed(recording, base, tuple(points))
    defined: dict[str, Point] = {}
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
    guess = guess_arm(recording.points, side="left" if is_mirrored(recording) else "right", base=part)
    if guess.arm is None:
        listed = ", ".join(quoted(name) for name in nearest("", known))
        flags = "--points elbow=A+B,wrist=C,hand=D" if base else "--base SHOULDER --points elbow=A+B,wrist=C,hand=D"
        message = f"{source}: {guess.sentence[0].lower()}{guess.sentence[1:]}; its points are {listed}"
        raise TaskError(message, value=known, fix=f"Name those of the arm, as in {flags}")
    step = Step("guess", guess.sentence, {"base": guess.arm.base, "points": list(guess.arm.points)})
    own = None if points else guess.arm.orientation(recording.orientations)
    return base or guess.arm.base, points or guess.arm.points, own, (step,)


def _known(recording: Recording, defined: Mapping[str, Point]) -> list[str]:
    """Names that may stand in an expression for a position."""
    return list(dict.fromkeys([*defined, *recording.points, *recording.about.bodies]))


def _add(defined: dict[str, Point], text: str, recording: Recording, purpose: str = "") -> str:
    """Define one more point, and give its name."""
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
    """Values that there are in some frame."""
    if values is None:
        message = f"{recording.source}: {what} has an orientation, but no position"
        raise TaskError(message, value=what, allowed=list(recording.points))
    if np.isnan(values).all():
        message = f"{recording.source}: {what} was not seen in any frame"
        raise TaskError(message, value=what, fix="Use another one or leave it out")
    return values
