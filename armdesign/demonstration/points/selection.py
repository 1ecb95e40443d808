"""Which points of a recording a task uses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

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
    """

    recording: Recording
    base: str
    points: tuple[str, ...]
    orientation: str | None
    steps: tuple[Step, ...]
    expressions: Mapping[str, str]


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
    wanted = orientation or ((guessed or names[-1]) if oriented else None)
    places = {name: _seen(point.positions, f"point '{name}'", recording) for name, point in defined.items()}
    turn = None if wanted is None else _turn(wanted, recording, defined)
    turns = {} if turn is None else {turn.name: turn.quaternions}
    more = [step for point in defined.values() for step in point.steps]
    expressions = {name: str(point.expression) for name, point in defined.items()}
    if turn is not None:
        more += turn.steps
        expressions.setdefault(turn.name, turn.expression)
    used = Recording(recording.time, places, turns, recording.source, recording.about)
    return Selection(used, first, names, turn.name if turn else None, (*steps, *more), expressions)


class _Turn(NamedTuple):
    """An orientation that was found."""

    name: str
    expression: str
    quaternions: Array
    steps: tuple[Step, ...]


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


def _turn(text: str, recording: Recording, defined: Mapping[str, Point]) -> _Turn:
    """The orientation that an expression means."""
    known = list(dict.fromkeys([*_known(recording, defined), *recording.orientations]))
    source = f"{recording.source}, orientation"
    expression = parse(text, known, source)
    point = defined.get(expression.name)
    if point is None or expression.single != expression.name:
        point = define(expression, recording, defined)
    quaternions, steps = orientation_of(point, recording)
    values = _seen(quaternions, f"the orientation of '{expression.name}'", recording)
    return _Turn(expression.name, str(point.expression), values, steps)


def _seen(values: Array | None, what: str, recording: Recording) -> Array:
    """Values that there are in some frame."""
    if values is None:
        message = f"{recording.source}: {what} has an orientation, but no position"
        raise TaskError(message, value=what, allowed=list(recording.points))
    if np.isnan(values).all():
        message = f"{recording.source}: {what} was not seen in any frame"
        raise TaskError(message, value=what, fix="Use another one or leave it out")
    return values
