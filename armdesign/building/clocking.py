"""How actuators are turned when their brackets go on: their own middle in the middle of what the task asks for."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.building.arm_drawing import degrees
from armdesign.building.build import Build, assembly_of
from armdesign.building.catalogue import Actuator
from armdesign.building.parts import EDGE, Placed, Prism, turn_between
from armdesign.building.parts_clearance import near_to, pieces_of, placed_at
from armdesign.building.sheet import number
from armdesign.search.evaluation import motions

STEP = np.radians(5.0)
"""The angle of a joint at which its actuator is in its middle is a multiple of this [rad]."""
CABLES = 15e-3
"""What plugs and cables need in front of the end of a box [m]."""
POSES = 50
"""About so many poses of each demonstration are looked at for that."""


class Clock(NamedTuple):
    """How a joint's own angles and those of its actuator go together [rad].

    Attributes:
        low: Least angle of the joint on the task.
        high: Its largest.
        middle: Where its actuator is put into its middle.
        way: 1 where what the actuator reads rises with the joint's angle, -1 where it falls.
        between: At ``middle``, from the mark of the bracket on the output to the long end of a box, or to the mark of
            the bracket on a round housing, counterclockwise as the output is looked at; None where there are not both.
    """

    low: float
    high: float
    middle: float
    way: float
    between: float | None

    def reading(self, q: float, own: float) -> float:
        """What an actuator with its middle at ``own`` reads where the joint is at q."""
        return own + self.way * (q - self.middle)

    def spare(self, whole: float) -> float:
        """How far the task stays within a range whose middle is at ``middle``; below 0 where it does not."""
        return whole / 2.0 - max(self.high - self.middle, self.middle - self.low)


def clock_of(build: Build, joint: int) -> Clock:
    """How the angles of a joint and of its actuator go together.

    Args:
        build: The parts.
        joint: Number of the joint.
    """
    result, assembly, name = build.result, assembly_of(build), f"J{joint}"
    turns = np.concatenate([q[:, joint - 1] for _, q in motions(result.evaluation, result.problem)])
    low, high = float(turns.min()), float(turns.max())
    middle = float(STEP * np.round((low + high) / 2.0 / STEP))
    q = np.zeros(result.table.dof)
    q[joint - 1] = middle
    there = {each.mark: (each, pose) for each, pose in assembly.posed(result.table, q)}
    back = there[name][1][:3, 2]  # the output is looked at from the other side
    on_both = (f"{name}-L{joint - 1}", f"{name}-L{joint}")
    marks = [pose[:3, :3] @ mark_of(each)[1] for each, pose in (there[mark] for mark in on_both if mark in there)]
    if build.choice.actuators[joint - 1].box is not None:
        marks[1:] = [-there[name][1][:3, 0]]
    between = turn_between(marks[0], marks[1], -back) if len(marks) == 2 else None
    way = float(np.sign(there[name][0].pose[2, 2]))
    return Clock(low, high, middle, way, between)


def mark_of(bracket: Placed) -> tuple[str, Array]:
    """What shows on a bracket how it is turned about its actuator's axis, and that way in its own frame, shape (3,)."""
    if bracket.part.note == "wedge" and bracket.part.scribes:
        return "line S", bracket.part.line
    return "the side of the tube", np.array([1.0, 0.0, 0.0])


def clock_words(build: Build, joint: int) -> list[str]:
    """How the actuator of a joint is turned when its brackets go on, so that its range holds the task, in sentences.

    Args:
        build: The parts.
        joint: Number of the joint.
    """
    clock, actuator, name = clock_of(build, joint), build.choice.actuators[joint - 1], f"J{joint}"
    words = [range_words(clock, actuator, name)]
    placed = {each.mark: each for each in assembly_of(build).placed}
    before, after = (placed.get(f"{name}-L{link}") for link in (joint - 1, joint))
    if clock.between is not None and before is not None and after is not None:
        last = f"{mark_of(after)[0]} of {after.mark}" if actuator.box is None else "the long end of its housing"
        words.append(
            f"At {degrees(clock.middle)}° {last} is {degrees(clock.between)}° from {mark_of(before)[0]} of "
            f"{before.mark}, counterclockwise as the output is looked at. Mark a line across housing and output there."
        )
    turn = None if before is None else before.part.sizes.get("turn of the face's circle")
    if before is not None and turn is not None:
        count, (mark, line) = before.part.circles["face"].count, mark_of(before)
        hole = turn_between(line, np.array([np.cos(turn), 0.0, np.sin(turn)]), np.array([0.0, 1.0, 0.0]))
        words.append(
            f"Of the {count} holes of {before.mark} for {name} one is {degrees(hole % (2.0 * np.pi / count))}° from "
            f"{mark}, the same way about. Where those of {name} do not meet them, turn its output to the "
            f"next that do, {degrees(np.pi / count)}° at most, and enter that as its offset."
        )
    return words + long_end_words(build, joint)


def range_words(clock: Clock, actuator: Actuator, name: str) -> str:
    """Where a joint turns on the task, and where its actuator is in its middle then.

    Args:
        clock: How their angles go together.
        actuator: The actuator.
        name: Its mark.
    """
    words, at = f"On the task {name} turns from {degrees(clock.low)}° to {degrees(clock.high)}°", degrees(clock.middle)
    whole = actuator.position.get("range", actuator.angle_range)
    if whole is None:
        return f"{words}. Drive it to its own zero, and bolt its brackets on as they stand with {name} at {at}°."
    if clock.spare(whole) < 0.0:
        return (
            f"{words}, more than the {degrees(whole)}° of its range: take its mode of several turns, with its zero "
            f"where {name} is at {at}°."
        )
    spare = degrees(clock.spare(whole))
    if not actuator.position:
        return (
            f"{words}. It turns by {degrees(whole)}° in all: bolt its brackets on in the middle of that, as they stand "
            f"with {name} at {at}°; {spare}° are left at either end at least."
        )
    own = actuator.position["middle"]
    low, high, zero = (degrees(clock.reading(q, own)) for q in (clock.low, clock.high, 0.0))
    rises = "rises" if clock.way > 0.0 else "falls"
    return (
        f"{words}. Drive it to {degrees(own)}°, the middle of its range of {degrees(whole)}°, and bolt its brackets on "
        f"as they stand with {name} at {at}°. On the task it then reads {low}° to {high}°, {spare}° or more from the "
        f"ends of its range, and {zero}° with {name} at zero; it {rises} as {name} rises."
    )


def long_end_words(build: Build, joint: int) -> list[str]:
    """Which way the long end of a housing that is a box points, and where its cables can leave; nothing of others.

    Args:
        build: The parts.
        joint: Number of its joint.
    """
    actuator, name = build.choice.actuators[joint - 1], f"J{joint}"
    if actuator.box is None:
        return []
    held = f"between the cheeks of {name}-L{joint}" if actuator.side_holes else f"along the plate of {name}-L{joint}"
    near = in_front(build, joint)
    cables = (
        "No part comes in front of this end on the task: lead the cables out there." if not near else
        f"On the task {' and '.join(near)} {'comes' if len(near) == 1 else 'come'} within {number(1e3 * CABLES)} mm of "
        "this end: lead the cables out at the sides."
    )  # fmt: skip
    return [
        f"The long end of its housing, {number(1e3 * actuator.box[1], 2)} mm from its axis, lies {held}, away from "
        f"where the tube of that leans to. {cables} Where its connectors are, its maker's drawing shows."
    ]


def in_front(build: Build, joint: int) -> list[str]:
    """Marks of the parts that come into what the cables need in front of the long end of a box on the task.

    Args:
        build: The parts.
        joint: Number of its joint, whose actuator is a box.
    """
    result, assembly, actuator = build.result, assembly_of(build), build.choice.actuators[joint - 1]
    _, far, width = actuator.box or (0.0, 0.0, 0.0)
    own = next(each for each in assembly.placed if each.mark == f"J{joint}")
    room = np.array([[-far - CABLES, -width], [-far - 1e-3, -width], [-far - 1e-3, width], [-far - CABLES, width]])
    box = Prism(room * [1.0, 0.5], actuator.length - actuator.horn, actuator.horn / 2.0)
    pieces = [piece for each in assembly.placed if each is not own for piece in pieces_of(each)]
    free = pieces_of(replace(own, part=replace(own.part, solids=(box,))))
    found = set()
    for _, q in motions(result.evaluation, result.problem):
        for pose in q[:: max(1, len(q) // POSES)]:
            world = placed_at(result.table, [*pieces, *free], pose)
            near = near_to(free[0].form, world[-1], pieces, world[:-1], EDGE)
            found |= {pieces[i].part.mark for i, gap in near if gap == 0.0}
    return sorted(found)
