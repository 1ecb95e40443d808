"""How a build is put together: steps in order, each with a picture of the arm so far, and poses to check it by."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import jinja2
import numpy as np

from armdesign._types import Array
from armdesign.bodies.exact import ExactScene
from armdesign.bodies.loads import base_gravity, joint_torques
from armdesign.building.arm_drawing import degrees
from armdesign.building.build import Build, assembly_of
from armdesign.building.catalogue import Actuator
from armdesign.building.clocking import clock_words
from armdesign.building.labels import Labels
from armdesign.building.part_lists import TIGHTENING, screw_length, shortened, tightening
from armdesign.building.parts import Placed, Screws, turn_between
from armdesign.building.projection import Solid, draw_solids, slanted, solids_of
from armdesign.building.sheet import Sheet, number, svg_of
from armdesign.building.shop import FLOOR, TOOL
from armdesign.building.supply import Supply
from armdesign.feasibility.words import base_words
from armdesign.kinematics.base_pose import MOUNTINGS
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.motion import SmoothMotion

ASSEMBLY = "assembly.html"
PICTURE, ROUND = (150.0, 150.0), 34.0
"""Width and greatest height of a step's picture, and what of it is left about the arm for marks [mm]."""
NEW, OLD = "#c4c4c4", "white"
"""Colours of what a step adds, and of what is there."""


HUNG = {
    "below": ("below", "floor"), "above": ("above", "ceiling"), "behind": ("behind", "wall"),
    "front": ("in front of", "wall"), "left": ("to the left of", "wall"), "right": ("to the right of", "wall"),
}  # fmt: skip
"""Of an arm that hangs, by the side its base's plate is on: where that is, and what it is screwed to."""


class Step(NamedTuple):
    """A step of the assembly.

    Attributes:
        title: What is done.
        words: How, a sentence each.
        picture: The arm so far, as SVG.
    """

    title: str
    words: list[str]
    picture: str


class Check(NamedTuple):
    """A pose to hold the finished arm against.

    Attributes:
        name: Of the pose.
        joints: Angle of every joint, in words.
        tool: Where the tool is, from the middle of the base, in millimetres.
        note: What to know before going there.
        held: Which actuators it asks for more than they bear for long; empty for none.
    """

    name: str
    joints: list[str]
    tool: list[str]
    note: str
    held: str


def assembly_page(build: Build) -> str:
    """The steps of a build as one page that needs no network; the same build gives the same page.

    Raises:
        CatalogueError: Its parts do not fit together.
    """
    result, assembly = build.result, assembly_of(build)
    places = jinja2.FileSystemLoader(Path(__file__).resolve().parent)
    page = jinja2.Environment(loader=places, autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
    checks = poses_to_check(build)
    q = np.zeros(result.table.dof) if not checks[0].note else result.evaluation.path.q[0]
    room = np.eye(4)
    room[:3, :3] = MOUNTINGS[result.base_pose.mounted]
    drawn = [(each, solids_of(each.part, room @ pose, each.link)) for each, pose in assembly.posed(result.table, q)]
    return page.get_template("assembly.html.j2").render(
        name=result.name,
        warning=build.warning,
        needed=made_first(build),
        steps=steps(build, drawn),
        checks=checks,
        drawn="with every joint at zero" if not checks[0].note else "at the start of its motion",
    )


def made_first(build: Build) -> list[str]:
    """What has to be there before the first step: what is made, with material and marks, and what is not chosen."""
    besides = ", ".join(f"{count} × {name}" for name, count in build.supply.open_items)
    return [
        f"{len(places)} × {name} ({part.material}): {', '.join(each.mark for each in places)}"
        for name, (part, places) in assembly_of(build).counted().items() if not part.bought
    ] + [f"Bought besides, and not chosen here: {besides}.", TIGHTENING[build.options.printed]]  # fmt: skip


def surface(build: Build) -> str:
    """What the base's plate is screwed to: floor, wall or ceiling."""
    if build.result.placed:
        return build.result.base_pose.mounted
    return HUNG[str(build.result.plate_side)][1]


def foot(build: Build) -> Array:
    """Middle of the face that the base's plate is screwed down with, from base_link's origin, shape (3,) [m]."""
    for each in assembly_of(build).placed:
        if each.mark == "B":
            under: Array = each.pose[:3, 3] - each.part.sizes["thickness"] / 2.0 * each.pose[:3, 2]
            return under
    return np.zeros(3)


def base_place(build: Build) -> str:
    """Where the base's plate goes, in a sentence."""
    if build.result.placed:
        return base_words(build.result.base_pose)
    x, y, z, away = (number(1e3 * float(each)) for each in (*foot(build), np.linalg.norm(foot(build))))
    side, on = HUNG[str(build.result.plate_side)]
    return (
        f"Its mounting face, on the {on}, has its middle {away} mm {side} the point that the demonstrator's arm begins "
        f"at: x {x}, y {y}, z {z} mm from it."
    )


def base_turn(build: Build) -> list[str]:
    """How what is bolted on the base's plate is turned, whose holes fit several ways; nothing without scribe lines."""
    placed = {each.mark: each for each in assembly_of(build).placed}
    words = []
    for mark in (each.joins[1] for each in assembly_of(build).screws if each.joins[0] == "B"):
        plate, other = placed["B"], placed.get(mark)
        if other is None or not other.part.scribes or not plate.part.scribes:
            continue
        x, z, line = plate.pose[:3, 0], plate.pose[:3, 2], other.pose[:3, :3] @ other.part.line
        if np.linalg.norm(np.cross(line, z)) > 1e-3:
            turn = number(round(float(np.degrees(turn_between(x, line, z))), 2) % 360.0, 2)
            words.append(
                f"Its holes fit {mark} in several ways: line S of {mark} points {turn}° counterclockwise from line x "
                "of B, seen from the arm."
            )
    return words


def steps(build: Build, drawn: Sequence[tuple[Placed, list[Solid]]]) -> list[Step]:
    """What is done in which order, from the base to the tool: an actuator with its bracket, then the link to it.

    Brackets go on actuators first, because flanges cover the heads of wedges' screws.

    Args:
        build: The parts.
        drawn: Every part with its solids as the pictures show them.
    """
    table, found = build.result.table, []
    there: list[Solid] = []
    done, screws = {FLOOR, TOOL}, assembly_of(build).screws
    late = {each.joins[0] for each in screws if each.spacer}  # has its actuator behind the heads of a spacer's screws
    whole = [solid for _, several in drawn for solid in several]
    for link in range(table.dof + 1):
        joint = link + 1
        on_bench = {f"J{joint}", f"J{joint}-L{link}"} - late
        for bench in (True, False):
            new = [
                (each, shown) for each, shown in drawn
                if (each.mark in on_bench if bench else each.link == link and each.mark not in done)
            ]  # fmt: skip
            if not new:
                continue
            marks = {each.mark for each, _ in new}
            if bench:
                actuator = build.choice.actuators[link]
                title = f"Actuator J{joint}: {build.supply.ordered(actuator)}"
                words = actuator_words(actuator, joint, table, build.supply)
                words += clock_words(build, joint)
                words += [each.part.note for each, _ in new if each.part.bought and each.part.note]
                words += [f"On the bench, bolt {mark} on it: later its screws may be covered."
                          for mark in sorted(marks - {f"J{joint}"})]  # fmt: skip
            else:
                title = "Base" if link == 0 else f"Link {link}" + (" with the tool" if link == table.dof else "")
                words = [
                    *([base_place(build), *base_turn(build)] if "B" in marks else []),
                    *part_words(new),
                    *link_words(link, table),
                ]
            joined = [s for s in screws if set(s.joins) & marks and set(s.joins) <= marks | done]
            # beside a screw across no key reaches a flange's
            joined = sorted(joined, key=lambda s: (s.nut, s.joins[1] in late and not s.spacer))
            words += screw_words(joined, surface(build), printed=build.options.printed)
            found.append(Step(title, words, pictured(there, new, whole)))
            there += [solid for _, shown in new for solid in shown]
            done |= marks
    return found


def part_words(new: Sequence[tuple[Placed, list[Solid]]]) -> list[str]:
    """The parts of a link in their order; of tubes the length and how their scribe lines are turned."""
    parts = ", ".join(f"{each.mark} ({each.part.name})" for each, _ in new)
    words = [f"From the inner to the outer end: {parts}."]
    for each, _ in new:
        if each.part.kind == "tube":
            sizes = each.part.sizes
            turn = number(np.degrees(sizes["turn of S"]), 2)
            words.append(
                f"Tube {each.mark}: {number(1e3 * sizes['length'])} mm long; S of {each.mark}-b is {turn}° from S of "
                f"{each.mark}-a, clockwise seen from the inner end."
            )
    return words


def screw_words(joined: Sequence[Screws], base_on: str = FLOOR, *, printed: bool = False) -> list[str]:
    """Screws by what they join, in words, with how long they have to be and may be.

    Args:
        joined: The screws.
        base_on: What the base's plate is screwed to.
        printed: Whether parts are printed.
    """
    words = []
    for each in joined:
        first, second = (base_on if mark == FLOOR else mark for mark in each.joins)
        if each.maker:
            words.append(
                f"{first} to {second}: number, thread and depth of the screws by the maker's drawing of the "
                f"{each.maker}; {number(1e3 * each.length, 2)} mm are between their heads and it."
            )
            continue
        through = f", through spacer {each.spacer}" if each.spacer else ""
        most = f", at most {number(1e3 * each.most)} mm" if np.isfinite(each.most) else ""
        ends = ", with a locking nut" if each.nut else ""
        if second == base_on:
            ends = f"; longer by what the {base_on} takes"
        else:
            ends += f"; {tightening(each, printed=printed)}"
            if "J" in (first[0], second[0]) and not each.spacer and "-" not in first and not np.isfinite(each.most):
                ends += f"; how deep the holes of {first} are, its maker's drawing says"
        words.append(
            f"{first} to {second}{through}: {each.count} × {each.thread} x {screw_length(each)}{shortened(each)}, at "
            f"least {number(1e3 * each.length)} mm{most} under the head{ends}{f'; {each.note}' if each.note else ''}."
        )
    return words


def actuator_words(actuator: Actuator, joint: int, table: DHTable, supply: Supply) -> list[str]:
    """What to do with the actuator of a joint.

    Args:
        actuator: The actuator.
        joint: Number of the joint.
        table: The arm.
        supply: What the arm's actuators are fed and talked to by.
    """
    volts, bus = supply.volts(actuator), supply.bus(actuator)
    words = [f"Before it is mounted: set its address on the bus to {joint}."]
    words += [f"Bus: {bus}."] if bus else []
    words += [f"Supply: {number(volts)} V."] if volts else []
    words += [actuator.note] if actuator.note else []
    theta = table.theta[joint - 1]
    if abs(theta) > 1e-9:
        words.append(
            f"At zero what follows is turned by {degrees(theta)}° about the axis of J{joint} against what was before."
        )
    return words


def link_words(link: int, table: DHTable) -> list[str]:
    """How the next joint, or the tool, lies against the last one: distance, twist and which way.

    Args:
        link: Number of the link; 0 is the base.
        table: The arm.
    """
    here = "the z axis of the base" if link == 0 else f"the axis of J{link}"
    there = "the tool's axis" if link == table.dof else f"the axis of J{link + 1}"
    alpha, a, d = table.alpha[link], table.a[link], table.d[link]
    seen = f"from J{link} to J{link + 1}" if 0 < link < table.dof else "outwards along x"
    if abs(np.sin(alpha)) < 1e-9:
        turn = f"{there} is parallel to {here}" + ("" if np.cos(alpha) > 0.0 else ", and points the other way")
    else:
        way = "clockwise" if alpha > 0.0 else "anticlockwise"
        turn = f"looking {seen}, {there} is turned {way} by {degrees(abs(alpha))}° against {here}"
    words = [f"Clocking: {turn}; both axes are {number(1e3 * abs(a))} mm apart."]
    if abs(d) > 1e-9:
        words.append(f"Along {there}, what follows begins {number(1e3 * d)} mm from the foot of their common normal.")
    return words


def pictured(there: Sequence[Solid], new: Sequence[tuple[Placed, list[Solid]]], whole: Sequence[Solid]) -> str:
    """The arm so far at an angle, what is new grey and in heavy lines, by its marks.

    Args:
        there: What is there.
        new: What the step adds.
        whole: All solids of the arm, so that every picture has the same scale and place.
    """
    view = slanted()
    seen = view.flat(np.concatenate([solid.corners for solid in whole]))
    factor = float(np.min((np.array(PICTURE) - ROUND) / np.ptp(seen, axis=0)))
    size = np.array([PICTURE[0], factor * float(np.ptp(seen[:, 1])) + ROUND])
    by = size / 2.0 - factor * (seen.min(axis=0) + seen.max(axis=0)) / 2.0
    sheet, drawn = Sheet((PICTURE[0], float(size[1]))), Sheet()
    labels = Labels(sheet)
    old = [solid._replace(fill=OLD, pen="thin") for solid in there]
    fresh = [solid._replace(fill=NEW) for _, shown in new for solid in shown]
    for outline in draw_solids(drawn, [*old, *fresh], view, factor):
        labels.keep_clear(*(outline + by))
    sheet.put(drawn, by)
    for each, shown in new:
        if "flange" not in each.part.kind:
            labels.leader(each.mark, factor * view.flat(shown[0].middle) + by)
    return svg_of(sheet)


def poses_to_check(build: Build) -> list[Check]:
    """The pose of all joints at zero, and start and middle of the motion, with what touches in them."""
    result, scene, path = build.result, ExactScene(build.result.body), build.result.evaluation.path.q
    poses = {"zero": np.zeros(result.table.dof), "start of the motion": path[0],
             "middle of the motion": path[len(path) // 2]}  # fmt: skip
    found = []
    for name, q in poses.items():
        joints = [f"{number(1e3 * x)} mm" if slides else f"{degrees(x)}°"
                  for x, slides in zip(q, result.table.prismatic, strict=True)]  # fmt: skip
        tool = [number(1e3 * x) for x in result.table.frames(q)[-1, :3, 3] - foot(build)]
        gap, note = scene.self_clearance(q[None]), ""
        if gap is not None and gap.value <= 0.0:
            note = f"Do not go there: {gap.bodies[0]} and {gap.bodies[1]} would run into each other."
        found.append(Check(name, joints, tool, note, holding(build, q)))
    return found


def holding(build: Build, pose: Array) -> str:
    """Which actuators a pose asks for more than they bear for long, at rest and without load; empty for none.

    Args:
        build: The build.
        pose: Joint angles, shape (n,) [rad].
    """
    result, rest = build.result, np.zeros((1, len(pose)))
    still = SmoothMotion(pose[None], rest, rest)
    torques = np.abs(joint_torques(result.body, still, gravity=base_gravity(result.base_pose))[0])
    heavy = [
        f"J{joint} {torque:.2g} N m, and bears {actuator.rated_torque:.2g} N m for long"
        for joint, (torque, actuator) in enumerate(zip(torques, build.choice.actuators, strict=True), start=1)
        if torque > actuator.rated_torque
    ]
    return (
        f"Without any load it takes of {'; of '.join(heavy)}: hold the arm up, or leave this pose out." if heavy else ""
    )
