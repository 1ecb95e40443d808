"""The parts of an arm and where they go: how actuators, brackets, tubes and plates are bolted together.

**Faces.** Actuator j stands about its joint's axis, its middle m_j where the arm's body has it. The link before holds
it by the output's face, its own link by the housing's face at the other end, since the housing moves with its own link.
Which end is which is so that all fits and is lightest, by dynamic programming from link to link.

**Links** follow the polyline of the arm's body from face to face. Its corners too close to a face or to each other for
brackets are cut across; at the others there is a **corner** block. Between two planes go a **tube** with a **flange**
in each end, which is bolted to the plane and pinned to the tube, or, where that is too short, a **spacer**, through
which the one plane, drilled out, is screwed to the other.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody, polyline
from armdesign.bodies.cylinder import Cylinder
from armdesign.building.brackets import Knot, anchor, bracket, corner
from armdesign.building.catalogue import CIRCLES, Actuator
from armdesign.building.parts import SCREWS, Assembly, BoltCircle, Part, Placed, Prism, Rod, Screws
from armdesign.building.screw_access import TurnError, overhung
from armdesign.building.shop import (
    FLOOR,
    GAP,
    SHORTEST_SPACER,
    SHORTEST_TUBE,
    TOOL,
    WEDGE,
    Face,
    Seat,
    Shop,
    circle_of,
    drilled,
    frame,
    housing_of,
    unit,
)
from armdesign.building.tube_joints import Joint, spacer, tool_spacer, tubed
from armdesign.errors import CatalogueError

RIM = 9e-3
"""From the edge of the base's plate to the screws into the floor [m]."""


def assemble(arm: ArmBody, actuators: Sequence[Actuator], shop: Shop, apart: Collection[int] = ()) -> Assembly:
    """All parts of an arm.

    Args:
        arm: The arm; its modules say where the actuators are.
        actuators: Its actuators from the base on, n of them.
        shop: What the others are made for.
        apart: Numbers of the joints whose brackets keep to their own side of its middle.

    Raises:
        CatalogueError: Parts do not fit between two actuators; which, and by how much.
    """
    if shop.diameter / 2.0 - shop.wall < 3e-3:
        raise CatalogueError(
            f"a tube of {shop.diameter * 1e3:g} mm with a wall of {shop.wall * 1e3:g} mm leaves no bore for its flange",
            value=shop.diameter - 2.0 * shop.wall, allowed="a bore of 6 mm or more", fix="Choose others with --stock",
        )  # fmt: skip
    n = arm.table.dof
    plate = next((part for part in arm.parts if part.name == "base plate"), None)
    base = None if plate is None else base_face(plate.solid, shop)
    best: dict[float, tuple[float, tuple[float, ...], tuple[Chain, ...]]] = {0.0: (0.0, (), ())}
    for link in range(n + 1):
        points, faults = way(arm, link), []
        after: dict[float, tuple[float, tuple[float, ...], tuple[Chain, ...]]] = {}
        for (before, (mass, signs, chains)), sign in product(best.items(), (1.0, -1.0) if link < n else (0.0,)):
            first = base
            if link:
                first = actuator_face(arm, link, link, actuators[link - 1], before)
                first = first._replace(aside=link in apart)
            last = actuator_face(arm, link + 1, link, actuators[link], -sign) if link < n else None
            last = None if last is None else last._replace(aside=link + 1 in apart)
            try:
                chain = linked(link, (first, last), points, shop)
            except CatalogueError as error:
                faults.append(error)
                continue
            if sign not in after or mass + chain.mass < after[sign][0]:
                after[sign] = (mass + chain.mass, (*signs, sign), (*chains, chain))
        if not after:
            raise telling(faults)
        best = after
    _, signs, chains = next(iter(best.values()))
    placed, screws = [], []
    if plate is not None and base is not None:
        placed.append(base_plate(plate.solid, base, chains[0].placed[0] if chains[0].placed else None, shop))
        screws.append(Screws("M6", plate.solid.length + 9e-3, 4, ("B", FLOOR)))
    for link, chain in enumerate(chains):
        if link:
            held = next((each for each in chain.placed if each.mark == f"J{link}-L{link}"), None)
            placed.append(placed_actuator(arm, link, actuators[link - 1], signs[link - 1], held))
        placed += chain.placed
        screws += chain.screws
    return Assembly(tuple(named(placed)), tuple(screws), tuple(sorted(apart)))


def way(arm: ArmBody, link: int) -> list[Array]:
    """The polyline of a link in its frame, from m_j, or the base's plate, to m_{j+1}, or the tool; each point once."""
    points = polyline(arm.table, link, arm.slides)
    plate = next((part for part in arm.parts if part.name == "base plate"), None)
    if link == 0 and plate is not None:
        top, normal = plate_face(plate.solid)
        points = [top, *(point for point in points if (point - top) @ normal > 1e-6)]
    kept = points[:1]
    for point in points[1:]:
        if np.linalg.norm(point - kept[-1]) > 1e-6:
            kept.append(point)
    return kept


def plate_face(plate: Cylinder) -> tuple[Array, Array]:
    """Middle and normal of the face of a base's plate that the arm is on, shape (3,) each.

    Args:
        plate: In base_link's frame. Where it stands on the mounting face z = 0 the arm is above it, else at the origin.
    """
    below, above = plate.ends
    face = above if np.allclose(below, 0.0, atol=1e-9) else min(plate.ends, key=lambda end: float(np.linalg.norm(end)))
    return face, unit(face - plate.pose[:3, 3])


def joint_axis(arm: ArmBody, joint: int) -> Array:
    """The axis of a joint in the frame of the link before it, shape (3,)."""
    row, table = joint - 1, arm.table
    axis = np.array([0.0, -np.sin(table.alpha[row]), np.cos(table.alpha[row])])
    return table.base()[:3, :3] @ axis if row == 0 else axis


def actuator_face(arm: ArmBody, joint: int, link: int, actuator: Actuator, sign: float) -> Face:
    """The face of an actuator that a link is bolted to.

    Args:
        arm: The arm.
        joint: Its joint.
        link: The link, ``joint`` or ``joint - 1``.
        actuator: The actuator.
        sign: The end of it, along its axis.
    """
    holds, box = link == joint, housing_of(actuator)
    axis = np.array([0.0, 0.0, 1.0]) if holds else joint_axis(arm, joint)
    radius = box.near if box is not None and holds else actuator.diameter / 2.0
    return Face(f"J{joint}", arm.sphere(joint, link), sign * axis, actuator.length / 2.0, radius,
                circle_of(actuator, "housing" if holds else "output"), False, box, holds,
                circle_of(actuator, "output").edge)  # fmt: skip


def placed_actuator(arm: ArmBody, joint: int, actuator: Actuator, sign: float, held: Placed | None) -> Placed:
    """An actuator as a cylinder, or as a box with its output, its z from the output to the housing's face.

    The long end of a box points away from where the tube of the bracket that holds it leans to, towards -x.

    Args:
        arm: The arm.
        joint: Its joint.
        actuator: The actuator.
        sign: The end of its housing's face, along the joint's axis.
        held: The bracket that holds its housing; None for none.
    """
    half, radius = np.array([0.0, 0.0, actuator.length / 2.0]), actuator.diameter / 2.0
    solids: list[Prism | Rod] = [Rod(-half, half, radius)]
    if actuator.box is not None:
        near, far, width = actuator.box
        y, deep = width / 2.0, actuator.length - actuator.horn
        solids = [Prism(np.array([[-far, -y], [near, -y], [near, y], [-far, y]]), deep, actuator.horn / 2.0)]
        if actuator.horn:
            solids.append(Rod(-half, -half + [0.0, 0.0, actuator.horn], circle_of(actuator, "output").diameter / 2.0))
    circles = {end: circle_of(actuator, end) for end in CIRCLES if end == "output" or not actuator.side_holes}
    sizes = {"diameter": actuator.diameter, "length": actuator.length}
    volume = sum(each.moments()[0] for each in solids)
    note = f"{actuator.family}; output towards link {joint - 1}"
    if any(circle.maker for circle in circles.values()):
        note += f"; drill its brackets by its maker's drawing{f' ({actuator.sheet})' if actuator.sheet else ''}"
    part = Part("actuator", actuator.name, tuple(solids), (), "actuator", actuator.mass / volume, sizes,
                circles, bought=True, note=note.split("; output")[0])  # fmt: skip
    pose = np.diag([1.0, sign, sign, 1.0])
    if held is not None and actuator.box is not None:
        pose[:3, 0], pose[:3, 1] = held.pose[:3, 0], sign * np.cross([0.0, 0.0, 1.0], held.pose[:3, 0])
    pose[:3, 3] = arm.sphere(joint, joint)
    return Placed(replace(part, note=note), f"J{joint}", joint, pose)


def base_face(plate: Cylinder, shop: Shop) -> Face:
    """The face of the plate at the base, which is in base_link's frame."""
    top, normal = plate_face(plate)
    return Face("B", top, normal, 0.0, plate.radius, BoltCircle(2.0 * max(shop.half, 0.45 * plate.radius), 4, "M5"))


def base_plate(plate: Cylinder, face: Face, on: Placed | None, shop: Shop) -> Placed:
    """The plate at the base: tapped where its bracket is drilled, the heads of the floor's screws beside that.

    Args:
        plate: In base_link's frame.
        face: Its face.
        on: The bracket on it; None for none.
        shop: What it is made for.
    """
    radius, height, circle = plate.radius, plate.length, face.circle
    pose = frame(face.normal, np.array([1.0, 0.0, 0.0]), plate.pose[:3, 3])
    half = np.array([0.0, 0.0, height / 2.0])
    if circle.diameter + 16e-3 > 2.0 * (radius - RIM):
        radius = circle.diameter / 2.0 + 8e-3 + RIM
    turn, feet_turn = 0.0, np.pi / 4.0
    if on is not None:  # its x is at an angle to the plate's, and its z the other way about
        x, y = (pose[:3, :3].T @ on.pose[:3, 0])[:2]
        turn = float(np.arctan2(y, x)) - on.part.sizes["turn of the face's circle"]
        turns = np.radians(np.arange(0.0, 90.0, 7.5))
        while True:
            feet = BoltCircle(2.0 * (radius - RIM), 4, "M6").places(turns)
            gaps = np.round(overhung(on.part, -np.inf, feet), 9)
            if gaps.max() >= SCREWS["M6"][2] / 2.0 + 1e-3:
                break
            radius += 1e-3
        feet_turn = float(np.arctan2(y, x) - turns[int(np.argmax(gaps))])
    floor = BoltCircle(2.0 * (radius - RIM), 4, "M6")
    use = "bracket (tapped through)"
    holes = drilled(circle.places(turn), -half[2], half[2], SCREWS["M5"][1], use)
    holes += drilled(floor.places(feet_turn), -half[2], half[2], SCREWS["M6"][0], "floor")
    sizes = {"diameter": 2.0 * radius, "thickness": height}
    rim = np.array([[radius - 5e-3, 0.0, half[2]], [radius, 0.0, half[2]], [radius, 0.0, -half[2]]])
    scribes = (rim[:2], rim[1:]) if abs(face.normal[0]) < 1e-6 else ()  # on a wall before or behind, x is no way on it
    part = shop.part("base plate", [Rod(-half, half, radius)], holes, sizes=sizes,
                     circles={use: circle, "floor": floor}, scribes=scribes)  # fmt: skip
    return Placed(part, "B", 0, pose)


class Chain(NamedTuple):
    """The parts of a link between its ends, and the screws that join them to others."""

    placed: tuple[Placed, ...]
    screws: tuple[Screws, ...]

    @property
    def mass(self) -> float:
        """[kg]."""
        return sum(each.part.mass for each in self.placed)


def linked(link: int, ends: Sequence[Face | None], points: Sequence[Array], shop: Shop) -> Chain:
    """The parts of a link from face to face: those with the kinds of brackets with which they fit and are lightest.

    Args:
        link: Number of the link.
        ends: The faces of both ends; None for the tool.
        points: The polyline.
        shop: What they are made for.

    Raises:
        CatalogueError: They do not fit.
    """
    if len(points) < 2 or ends[0] is None:
        return Chain((), ())
    knots = [Knot(points[0], ends[0]), *(Knot(p) for p in points[1:-1]), Knot(points[-1], ends[1])]
    knots = without_near(knots, shop)
    found, faults = [], []
    for kinds in product(kinds_on(knots[0].face), kinds_on(knots[-1].face)):
        try:
            found.append(chained(link, knots, kinds, shop))
        except CatalogueError as error:
            faults.append(error)
    if not found:
        raise telling(faults)
    return min(found, key=lambda chain: chain.mass)


def telling(faults: Sequence[CatalogueError]) -> CatalogueError:
    """The fault that tells most of why nothing fits: one of brackets that turn as far as they have to, if there is."""
    return next((fault for fault in faults if not isinstance(fault, TurnError)), faults[0])


def kinds_on(face: Face | None) -> tuple[str, ...]:
    """Kinds of brackets that may be on a face; "" for the tool."""
    if face is None:
        return ("",)
    return ("wedge", "standing" if face.mark == "B" else "side" if face.aside else "angle")


def chained(link: int, knots: Sequence[Knot], kinds: tuple[str, str], shop: Shop) -> Chain:
    """The parts of a link with given kinds of brackets.

    Args:
        link: Number of the link.
        knots: Its way.
        kinds: Of the brackets at both ends, "" for the tool.
        shop: What they are made for.

    Raises:
        CatalogueError: They do not fit.
    """
    anchors, last = [k.point for k in knots], len(knots) - 1
    for _ in range(30):  # a wedge's tube points at its face's middle, which moves with the angle: settles quickly
        start = anchor(knots[0], kinds[0], unit(anchors[1] - anchors[0]), shop)
        end = anchor(knots[-1], kinds[1], unit(anchors[-2] - anchors[-1]), shop)
        if np.array_equal([anchors[0], anchors[-1]], [start, end]):
            break
        anchors[0], anchors[-1] = start, end
    screws: list[Screws] = []
    nodes: list[Placed | None] = []
    seats: list[tuple[Seat, Seat]] = []
    for i, knot in enumerate(knots):
        onward = None if i == last else unit(anchors[i + 1] - anchors[i])
        back = None if i == 0 else unit(anchors[i - 1] - anchors[i])
        along = back if onward is None else onward
        if knot.face is not None and along is not None:
            made, seat, joined = bracket(knot.face, kinds[0 if i == 0 else 1], along, link, shop)
            seats.append((seat, seat))
            nodes.append(made)
            screws.append(joined)
        elif onward is not None and back is not None:
            made, pair = corner(f"L{link}-C{i}", anchors[i], (back, onward), link, shop)
            seats.append(pair)
            nodes.append(made)
        elif back is not None:
            hand = Seat(TOOL, anchors[i], back, frame(back, np.array([0.0, 0.0, 1.0]))[:3, 0])
            seats.append((hand, hand))
            nodes.append(None)
    between: list[list[Placed]] = []
    for k, ((_, before), (after, _)) in enumerate(pairwise(seats)):
        joint = Joint(f"L{link}-T{k + 1}", before, after, link)
        if joint.span - shop.flange - joint.cap(shop) >= SHORTEST_TUBE:
            pieces, own = tubed(joint, shop)
        elif after.mark == TOOL:
            pieces, own = tool_spacer(joint, nodes[k], shop)
        else:
            pieces, own = spacer(joint, nodes[k : k + 2], shop)
        between.append([each for each in pieces if each.part.kind != "bracket"])
        for each in pieces:
            if each.part.kind == "bracket":
                nodes[k if each.mark == before.mark else k + 1] = each
        screws += own
    placed = [nodes[0], *(each for piece, node in zip(between, nodes[1:], strict=True) for each in (*piece, node))]
    return Chain(tuple(each for each in placed if each is not None), tuple(screws))


def room(knot: Knot, shop: Shop) -> float:
    """About how far from a knot a tube begins [m]."""
    if knot.face is None:
        return shop.half
    return max(knot.face.radius + GAP, knot.face.height) + shop.plate + WEDGE


def without_near(knots: list[Knot], shop: Shop) -> list[Knot]:
    """The knots that are left when corners too near to others for their parts, or next to straight, are cut across.

    Args:
        knots: From end to end.
        shop: What the parts are made for.
    """
    while True:
        faults = []
        for i in range(1, len(knots) - 1):
            before, own, after = knots[i - 1 : i + 2]
            legs = [np.linalg.norm(own.point - k.point) for k in (before, after)]
            detour = sum(legs) - np.linalg.norm(after.point - before.point)
            least = [room(own, shop) + room(k, shop) + SHORTEST_SPACER for k in (before, after)]
            if legs[0] < least[0] or legs[1] < least[1] or detour < 1e-3:
                faults.append((float(detour), i))
        if not faults:
            return knots
        del knots[min(faults)[1]]


def named(placed: Sequence[Placed]) -> list[Placed]:
    """The same with parts that are alike under one name, numbered where a kind has several."""
    kinds: dict[tuple[object, ...], Part] = {}
    keys = []
    for each in placed:
        part = each.part
        numbers = tuple((name, round(value, 6)) for name, value in part.sizes.items())
        makers = tuple(circle.maker for circle in part.circles.values())
        keys.append((part.kind, part.name, part.material, part.note if not part.bought else "", numbers, makers))
        kinds.setdefault(keys[-1], part)
    names = {}
    for key, part in kinds.items():
        alike = [k for k, other in kinds.items() if other.name == part.name]
        number = "" if len(alike) == 1 or part.bought else f" {alike.index(key) + 1}"
        names[key] = replace(part, name=f"{part.name}{number}")
    return [
        replace(each, part=replace(names[key], note=each.part.note) if each.part.bought else names[key])
        for each, key in zip(placed, keys, strict=True)
    ]
