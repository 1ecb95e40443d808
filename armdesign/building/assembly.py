"""The parts of an arm and where they go: how actuators, brackets, tubes and plates are bolted together.

**Faces.** Actuator j stands about its joint's axis, its middle m_j where the arm's body has it. The link before holds
it by the output's face, its own link by the housing's face at the other end, since the housing moves with its own link.
Which end is which is so that all fits and is lightest, by dynamic programming from link to link.

**Brackets** lead from a face to a plane square to a tube that leaves at the angle theta from the face's normal, within
``TURNS``: a **wedge** is a block on the face whose upper side is tilted, its tube points at the face's middle; an
**angle** is two plates, the second beside the housing, its tube points at m_j; a **side** bracket is one whose second
plate and tube stay on its own side of m_j, so that the joint's other bracket passes it at any angle; on a base's plate
there may be a **standing** one, whose second plate stands on the edge of the first.

**Links** follow the polyline of the arm's body from face to face. Its corners too close to a face or to each other for
brackets are cut across; at the others there is a **corner** block. Between two planes go a **tube** with a **flange**
in each end, which is bolted to the plane and pinned to the tube, or, where that is too short, a **spacer**, through
which the one plane, drilled out, is screwed to the other.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody, polyline
from armdesign.bodies.cylinder import Cylinder
from armdesign.building.catalogue import CIRCLES, Actuator
from armdesign.building.parts import SCREWS, Assembly, BoltCircle, Part, Placed, Prism, Rod, Screws
from armdesign.building.tubes import Tube
from armdesign.errors import CatalogueError
from armdesign.settings.sections import Body

TURNS = {
    "wedge": (0.0, np.radians(65.0)), "angle": (np.radians(40.0), np.radians(150.0)),
    "side": (np.radians(40.0), np.radians(115.0)), "standing": (np.radians(40.0), np.radians(110.0)),
}  # fmt: skip
"""Kinds of bracket, and the angles between tube and face's normal that they make."""
GAP = 3e-3
"""Between a bracket and a housing that turns beside it [m]."""
SHORTEST_SPACER, SHORTEST_TUBE, WEDGE = 10e-3, 24e-3, 10e-3
"""Least lengths of spacers and tubes, and least thickness of wedges: what their screws take [m]."""
ALUMINIUM, PRINTED = ("aluminium", 2700.0), ("PETG, printed solid", 1270.0)
"""What parts are made of, and its density [kg/m^3]."""
TOOL_NOTE = "screwed on from the tool's side, before the tool"
SPACER_NOTE = "screwed from inside the bracket that is drilled through, before that goes on its actuator"
FLOOR, TOOL = "floor", "tool"
"""In place of a mark: what the base's plate is screwed to, and what the tool plate holds."""
TOOL_FLANGE = 6e-3
"""Thickness of a tool's own flange, for the length of its screws [m]."""
TOOL_CIRCLES = (BoltCircle(0.0315, 4, "M5"), BoltCircle(0.05, 4, "M6"), BoltCircle(0.08, 6, "M8"))
"""Of ISO 9409-1, for the tool."""


@dataclass(frozen=True)
class Shop:
    """What brackets and flanges are made for.

    Attributes:
        diameter: Of the tubes [m].
        wall: Of the tubes [m].
        tube: Material and density of the tubes.
        made: Material and density of all else.
    """

    diameter: float
    wall: float
    tube: tuple[str, float]
    made: tuple[str, float]

    @property
    def plate(self) -> float:
        """Thickness of brackets' plates, a quarter of the tube in aluminium, more where printed [m]."""
        share = 0.25 if self.made == ALUMINIUM else 0.4
        return float(max(5e-3, np.ceil(share * self.diameter * 1e3 - 1e-9) * 1e-3))

    @property
    def flange(self) -> float:
        """Thickness of flanges [m]."""
        return 5e-3 if self.diameter <= 25e-3 else 6e-3

    @property
    def circle(self) -> BoltCircle:
        """Of the flanges on tubes: their screws' heads are beside the tube."""
        thread = "M3" if self.diameter <= 25e-3 else "M4"
        return BoltCircle(self.diameter + SCREWS[thread][2] + 2e-3, 4, thread)

    @property
    def half(self) -> float:
        """Half of the side of what a flange sits on [m]."""
        return self.circle.edge

    @property
    def tapped(self) -> float:
        """Depth of tapped holes, twice the thread's diameter [m]."""
        return 2e-3 * float(self.circle.thread[1:])

    def part(self, kind: str, solids: Sequence[Prism | Rod], holes: Sequence[Rod], **rest: object) -> Part:
        """A part that is made; its name is given when all are known.

        Args:
            kind: See ``Part``.
            solids: What it consists of.
            holes: What is taken out.
            **rest: Its other attributes.
        """
        material, density = self.tube if kind == "tube" else self.made
        return Part(kind, kind, tuple(solids), tuple(holes), material, density, **rest)  # type: ignore[arg-type]


class Face(NamedTuple):
    """What a bracket can be bolted on, in a link's frame.

    Attributes:
        mark: Of what has the face.
        middle: Of the body behind it, m_j, shape (3,) [m].
        normal: Its own, shape (3,).
        height: Of the face above the middle [m].
        radius: Of the body behind it [m].
        circle: Its holes.
        aside: Whether brackets on it keep to their side of the middle.
    """

    mark: str
    middle: Array
    normal: Array
    height: float
    radius: float
    circle: BoltCircle
    aside: bool = False


class Seat(NamedTuple):
    """A plane that a flange is bolted on, in a link's frame.

    Attributes:
        mark: Of the part that has it.
        point: Its middle, shape (3,) [m].
        along: Its normal, along the tube, shape (3,).
        across: From the middle to the first of its holes, a unit vector, shape (3,).
    """

    mark: str
    point: Array
    along: Array
    across: Array


def generic_circle(diameter: float) -> BoltCircle:
    """The circle that is assumed on an actuator whose own is not known, half as large as its housing.

    Args:
        diameter: Of the housing [m].
    """
    threads = ((0.03, "M2"), (0.045, "M2.5"), (0.07, "M3"), (0.11, "M4"))
    thread = next((name for most, name in threads if diameter < most), "M5")
    return BoltCircle(float(np.round(diameter / 2.0, 3)), 4 if diameter < 0.11 else 6, thread, generic=True)


def circle_of(actuator: Actuator, end: str) -> BoltCircle:
    """The bolt circle at an end of an actuator, one of ``CIRCLES``; assumed where it is not known."""
    known = actuator.circles.get(end)
    return generic_circle(actuator.diameter) if known is None else BoltCircle(*known)


def envelope(actuator: Actuator, shop: Shop) -> tuple[float, float]:
    """Diameter and length of an actuator with its brackets and half of the shortest spacer [m].

    Args:
        actuator: The actuator.
        shop: What its brackets are made for.
    """
    more = shop.plate + 5e-3
    return actuator.diameter + 2.0 * (GAP + more), actuator.length + 2.0 * more


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
    base = None if plate is None else base_plate(plate.solid, shop)
    best: dict[float, tuple[float, tuple[float, ...], tuple[Chain, ...]]] = {0.0: (0.0, (), ())}
    for link in range(n + 1):
        points, faults = way(arm, link), []
        after: dict[float, tuple[float, tuple[float, ...], tuple[Chain, ...]]] = {}
        for (before, (mass, signs, chains)), sign in product(best.items(), (1.0, -1.0) if link < n else (0.0,)):
            first = None if base is None else base[1]
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
    placed = [] if base is None else [base[0]]
    screws = [] if base is None else [Screws("M6", base[0].part.sizes["thickness"] + 9e-3, 4, ("B", FLOOR))]
    for link, chain in enumerate(chains):
        if link:
            placed.append(placed_actuator(arm, link, actuators[link - 1], signs[link - 1]))
        placed += chain.placed
        screws += chain.screws
    return Assembly(tuple(named(placed)), tuple(screws), tuple(sorted(apart)))


def shop_of(body: Body, tube: Tube | None, *, printed: bool) -> Shop:
    """What brackets are made for on an arm.

    Args:
        body: The arm's.
        tube: Its tubes out of stock; None for those that the body assumes.
        printed: Whether they are printed.
    """
    made = (f"tube {body.tube_diameter * 1e3:g} x {body.tube_wall * 1e3:g} mm", body.tube_density)
    if tube is not None:
        made = (tube.name, tube.density)
    return Shop(body.tube_diameter, body.tube_wall, made, PRINTED if printed else ALUMINIUM)


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
    return face, _unit(face - plate.pose[:3, 3])


def joint_axis(arm: ArmBody, joint: int) -> Array:
    """The axis of a joint in the frame of the link before it, shape (3,)."""
    row, table = joint - 1, arm.table
    axis = np.array([0.0, -np.sin(table.alpha[row]), np.cos(table.alpha[row])])
    return table.base()[:3, :3] @ axis if row == 0 else axis


def _unit(vector: Array) -> Array:
    """A vector of length 1."""
    unit: Array = vector / np.linalg.norm(vector)
    return unit


def actuator_face(arm: ArmBody, joint: int, link: int, actuator: Actuator, sign: float) -> Face:
    """The face of an actuator that a link is bolted to.

    Args:
        arm: The arm.
        joint: Its joint.
        link: The link, ``joint`` or ``joint - 1``.
        actuator: The actuator.
        sign: The end of it, along its axis.
    """
    axis = np.array([0.0, 0.0, 1.0]) if link == joint else joint_axis(arm, joint)
    circle = circle_of(actuator, "housing" if link == joint else "output")
    return Face(f"J{joint}", arm.sphere(joint, link), sign * axis, actuator.length / 2.0, actuator.diameter / 2.0,
                circle)  # fmt: skip


def placed_actuator(arm: ArmBody, joint: int, actuator: Actuator, sign: float) -> Placed:
    """An actuator as a cylinder, its z from the output to the housing's face.

    Args:
        arm: The arm.
        joint: Its joint.
        actuator: The actuator.
        sign: The end of its housing's face, along the joint's axis.
    """
    half, radius = np.array([0.0, 0.0, actuator.length / 2.0]), actuator.diameter / 2.0
    rod = Rod(-half, half, radius)
    circles = {end: circle_of(actuator, end) for end in CIRCLES}
    sizes = {"diameter": actuator.diameter, "length": actuator.length}
    note = f"{actuator.family}; output towards link {joint - 1}"
    if any(circle.generic for circle in circles.values()):
        note += "; its bolt circles are assumed: drill the brackets by the maker's drawing"
    part = Part("actuator", actuator.name, (rod,), (), "actuator", actuator.mass / rod.moments()[0], sizes,
                circles, bought=True, note=note.split("; output")[0])  # fmt: skip
    pose = np.diag([1.0, sign, sign, 1.0])
    pose[:3, 3] = arm.sphere(joint, joint)
    return Placed(replace(part, note=note), f"J{joint}", joint, pose)


def base_plate(plate: Cylinder, shop: Shop) -> tuple[Placed, Face]:
    """The plate at the base and its face.

    Args:
        plate: In base_link's frame.
        shop: What it is made for.
    """
    radius, height = plate.radius, plate.length
    top, normal = plate_face(plate)
    half = np.array([0.0, 0.0, height / 2.0])
    circle = BoltCircle(2.0 * max(shop.half, 0.45 * radius), 4, "M5")
    feet = BoltCircle(2.0 * (radius - 9e-3), 4, "M6")
    if feet.diameter < circle.diameter + 16e-3:
        radius = circle.diameter / 2.0 + 17e-3
        feet = BoltCircle(2.0 * (radius - 9e-3), 4, "M6")
    holes = [_drilled(x, y, -half[2], half[2], SCREWS["M5"][1]) for x, y in circle.places()]
    holes += [_drilled(x, y, -half[2], half[2], SCREWS["M6"][0]) for x, y in feet.places(np.pi / 4.0)]
    sizes = {"diameter": 2.0 * radius, "thickness": height}
    part = shop.part("base plate", [Rod(-half, half, radius)], holes, sizes=sizes,
                     circles={"bracket (tapped through)": circle, "floor": feet})  # fmt: skip
    frame = _seated(plate.pose[:3, 3], normal, np.array([1.0, 0.0, 0.0]))
    return Placed(part, "B", 0, frame), Face("B", top, normal, 0.0, radius, circle)


def _drilled(x: float, y: float, low: float, high: float, diameter: float) -> Rod:
    """A hole along z."""
    return Rod(np.array([x, y, low]), np.array([x, y, high]), diameter / 2.0)


def _frame(z: Array, near: Array) -> Array:
    """A frame at the origin with a given z and its x as near to a direction as can be, shape (4, 4)."""
    x = near - (near @ z) * z
    if np.linalg.norm(x) < 1e-6:
        x = np.array([0.0, 1.0, 0.0]) - z[1] * z
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 2] = _unit(x), z
    frame[:3, 1] = np.cross(z, frame[:3, 0])
    return frame


class Knot(NamedTuple):
    """A point of a link's way: a face with the bracket on it, a corner, or the tool.

    Attributes:
        point: m_j, a corner, or the tool, shape (3,) [m].
        face: Of an end with an actuator or a plate.
    """

    point: Array
    face: Face | None = None


class Chain(NamedTuple):
    """The parts of a link between its ends, and the screws that join them to others."""

    placed: tuple[Placed, ...]
    screws: tuple[Screws, ...]

    @property
    def mass(self) -> float:
        """[kg]."""
        return sum(each.part.mass for each in self.placed)


class TurnError(CatalogueError):
    """A bracket of some kind does not turn so far; another kind may."""


def telling(faults: Sequence[CatalogueError]) -> CatalogueError:
    """The fault that tells most of why nothing fits: one of brackets that turn as far as they have to, if there is."""
    return next((fault for fault in faults if not isinstance(fault, TurnError)), faults[0])


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
    for kinds in product(_kinds(knots[0].face), _kinds(knots[-1].face)):
        try:
            found.append(chained(link, knots, kinds, shop))
        except CatalogueError as error:
            faults.append(error)
    if not found:
        raise telling(faults)
    return min(found, key=lambda chain: chain.mass)


def _kinds(face: Face | None) -> tuple[str, ...]:
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
        start = anchor(knots[0], kinds[0], _unit(anchors[1] - anchors[0]), shop)
        end = anchor(knots[-1], kinds[1], _unit(anchors[-2] - anchors[-1]), shop)
        anchors[0], anchors[-1] = start, end
    screws: list[Screws] = []
    nodes: list[Placed | None] = []
    seats: list[tuple[Seat, Seat]] = []
    for i, knot in enumerate(knots):
        onward = None if i == last else _unit(anchors[i + 1] - anchors[i])
        back = None if i == 0 else _unit(anchors[i - 1] - anchors[i])
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
            hand = Seat(TOOL, anchors[i], back, _frame(back, np.array([0.0, 0.0, 1.0]))[:3, 0])
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


def wedge_size(face: Face, theta: float, shop: Shop) -> tuple[float, float, float]:
    """Half the length of a wedge along the tilt, half its width, and its height under the tube's middle [m]."""
    long = max(face.circle.edge, shop.half * np.cos(theta))
    return long, max(face.circle.edge, shop.half), WEDGE + long * np.tan(theta)


def anchor(knot: Knot, kind: str, along: Array, shop: Shop) -> Array:
    """The point that a bracket's tube points at, shape (3,) [m].

    Args:
        knot: Where the bracket is.
        kind: Of bracket.
        along: Where the tube goes, shape (3,).
        shop: What it is made for.
    """
    face = knot.face
    if face is None or kind == "angle":
        return knot.point
    if kind == "side":
        theta = float(np.clip(np.arccos(np.clip(along @ face.normal, -1.0, 1.0)), *TURNS["side"]))
        aside: Array = face.middle + side_shift(face, theta, shop) / np.sin(theta) * face.normal
        return aside
    least = np.cos(np.radians(75.0 if kind == "wedge" else 120.0))
    theta = float(np.arccos(np.clip(along @ face.normal, least, 1.0)))
    if kind == "wedge":
        x, y = 0.0, wedge_size(face, theta, shop)[2]
    else:
        x, y, _ = standing_size(face, theta, shop)
    lean = along - (along @ face.normal) * face.normal
    point: Array = face.middle + (face.height + y) * face.normal + x * lean / max(float(np.linalg.norm(lean)), 1e-9)
    return point


def bracket(face: Face, kind: str, along: Array, link: int, shop: Shop) -> tuple[Placed, Seat, Screws]:
    """A bracket, the seat it gives, and the screws that hold it on its face.

    Its frame: the origin at m_j, y along the face's normal, x where the tube leans to.

    Args:
        face: What it is bolted on.
        kind: Of bracket.
        along: Where its tube goes, shape (3,).
        link: Its link.
        shop: What it is made for.
    """
    theta = float(np.arccos(np.clip(along @ face.normal, -1.0, 1.0)))
    low, high = TURNS[kind]
    if not low <= theta <= high:
        raise TurnError(
            f"the tube of link {link} would leave {face.mark} at {np.degrees(theta):.0f} deg from its face's normal, "
            "and no bracket that fits turns so far", value=float(np.degrees(theta)),
            allowed=f"{np.degrees(low):.0f} to {np.degrees(high):.0f} deg",
            fix="Take thinner tubes or smaller actuators, or search with a larger --clearance",
        )  # fmt: skip
    mark = f"{face.mark}-L{link}"
    lean = along - (along @ face.normal) * face.normal
    turned = _frame(face.normal, lean if np.linalg.norm(lean) > 1e-6 else np.array([1.0, 0.0, 0.0]))
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1] = turned[:3, 0], face.normal
    pose[:3, 2] = np.cross(pose[:3, 0], pose[:3, 1])
    pose[:3, 3] = face.middle
    made = {"wedge": wedge, "angle": angle, "side": angle, "standing": standing}[kind](face, theta, shop)
    sizes = made.part.sizes
    u, e = np.array([np.sin(theta), np.cos(theta), 0.0]), np.array([np.cos(theta), -np.sin(theta), 0.0])
    across = np.cos(sizes["turn of the tube's circle"]) * e + np.sin(sizes["turn of the tube's circle"]) * np.cross(
        u, e
    )
    turn = pose[:3, :3]
    seat = Seat(mark, pose[:3, :3] @ made.seat + pose[:3, 3], turn @ u, turn @ across)
    thread = face.circle.thread
    screws = Screws(thread, made.under + 1.5e-3 * float(thread[1:]), face.circle.count, (face.mark, mark))
    return Placed(made.part, mark, link, pose), seat, screws


class Made(NamedTuple):
    """A bracket in its own frame.

    Attributes:
        part: The bracket.
        seat: Middle of the plane for the tube's flange, shape (3,) [m].
        under: What is between the heads of the face's screws and the face [m].
    """

    part: Part
    seat: Array
    under: float


def _tapped(middle: Array, u: Array, e: Array, turn: float, depth: float, shop: Shop) -> list[Rod]:
    """The tapped holes for a flange in a plane through ``middle``, square to ``u``, the first ``turn`` from ``e``."""
    f, radius = np.cross(u, e), SCREWS[shop.circle.thread][1] / 2.0
    places = shop.circle.places(turn)
    return [Rod(middle + x * e + y * f, middle + x * e + y * f - depth * u, radius) for x, y in places]


def wedge(face: Face, theta: float, shop: Shop) -> Made:
    """A block on a face, its upper side square to a tube that leaves at theta [rad].

    The face's screws go down through it, their heads sunk below the upper side, ``WEDGE`` - 6 mm above the face.
    """
    long, wide, middle = wedge_size(face, theta, shop)
    h, rise = face.height, long * np.tan(theta)
    corners = np.array([[-long, h], [long, h], [long, h + middle - rise], [-long, h + middle + rise]])
    u, e = np.array([np.sin(theta), np.cos(theta), 0.0]), np.array([np.cos(theta), -np.sin(theta), 0.0])
    seat = np.array([0.0, h + middle, 0.0])
    clear, _, head = SCREWS[face.circle.thread]
    under = WEDGE - 6e-3
    owns = np.radians(np.arange(0.0, 360.0 / face.circle.count, 7.5))
    turns = np.radians(np.arange(0.0, 90.0, 7.5))
    taps_at = [_tapped(seat, u, e, turn, shop.tapped, shop) for turn in turns]
    drilled = np.array([[np.linspace(tap.start, tap.end, 5) for tap in taps] for taps in taps_at])[..., [0, 2]]
    bolts = np.array([face.circle.places(own) for own in owns])
    apart = np.linalg.norm(bolts[:, None, :, None, None] - drilled[None, :, None], axis=-1).min(axis=(2, 3, 4))
    best = np.unravel_index(int(np.argmax(np.round(apart, 9))), apart.shape)
    own, taps, turn = owns[best[0]], taps_at[best[1]], turns[best[1]]
    sunk = []
    for x, z in face.circle.places(own):
        top, floor = np.array([x, h + middle - x * np.tan(theta), z]), np.array([x, h + under, z])
        sunk += [Rod(np.array([x, h, z]), floor, clear / 2.0),
                 Rod(floor, top, head / 2.0 + 0.25e-3, oblique=theta > 1e-6)]  # fmt: skip
    sizes = {
        "angle": theta, "length": 2.0 * long, "width": 2.0 * wide, "low side": middle - rise,
        "high side": middle + rise, "counterbore": 2.0 * sunk[1].radius, "under heads": under, "face above middle": h,
        "turn of the face's circle": float(own), "turn of the tube's circle": float(turn), "tapped depth": shop.tapped,
    }  # fmt: skip
    part = shop.part("bracket", [Prism(corners, 2.0 * wide)], [*sunk, *taps], sizes=sizes,
                     circles={"face": face.circle, "tube (tapped)": shop.circle}, note="wedge")  # fmt: skip
    return Made(part, seat, under)


def angle_plane(face: Face, theta: float, shop: Shop) -> float:
    """From the middle of the body behind a face to the inner side of an angle's second plate [m]."""
    s, c, h = np.sin(theta), np.cos(theta), face.height
    beside = face.radius + GAP
    inner = beside * s + (h * c if c > 0.0 else (h + GAP) * -c)
    if not face.aside and shop.half * s - inner * c > h:  # it reaches beyond the other face, where the other bracket is
        back, wide = face.circle.edge, max(face.circle.edge, shop.half)
        beside = max(beside, float(np.hypot(back, wide)) + GAP)
        inner = max(inner, beside * s + shop.half * abs(c))
    return float(inner)


def side_shift(face: Face, theta: float, shop: Shop) -> float:
    """How far up its second plate a side bracket's tube is, from the height of m_j, so that all is above m_j [m]."""
    s, c = np.sin(theta), np.cos(theta)
    inner = angle_plane(face, theta, shop)
    outer = inner + shop.plate + shop.flange
    lowest = min(inner * c, outer * c) - shop.half * s
    return float(max(0.0, (GAP / 2.0 - lowest) / s))


def angle(face: Face, theta: float, shop: Shop) -> Made:
    """Two plates, one on a face, one beside the body behind it, square to a tube that leaves at theta [rad].

    Where the face has to keep aside, the second plate is all above the body's middle.
    """
    s, c, h, t = np.sin(theta), np.cos(theta), face.height, shop.plate
    back, wide = face.circle.edge, max(face.circle.edge, shop.half)
    inner, up = angle_plane(face, theta, shop), side_shift(face, theta, shop) if face.aside else 0.0
    u, e = np.array([s, c, 0.0]), np.array([c, -s, 0.0])

    def end(y: float) -> Array:
        """Where the inner side of the second plate is at a height."""
        return np.array([(inner - y * c) / s, y, 0.0])

    top = max(shop.half + up, float(-end(h + t) @ e), float(-end(h) @ e))
    bottom = max(shop.half - up, float(end(h) @ e))
    low, high = inner * u + bottom * e, inner * u - top * e
    leg = np.stack([low, low + t * u, high + t * u, high])[:, :2]
    pad = np.stack([np.array([-back, h, 0.0]), end(h), end(h + t), np.array([-back, h + t, 0.0])])[:, :2]
    clear = SCREWS[face.circle.thread][0]
    own = np.pi / face.circle.count
    holes = [Rod(np.array([x, h, z]), np.array([x, h + t, z]), clear / 2.0) for x, z in face.circle.places(own)]
    turn, seat = np.pi / 4.0, (inner + t) * u - up * e
    holes += _tapped(seat, u, e, turn, t, shop)
    sizes = {
        "angle": theta, "plate": t, "width": 2.0 * wide, "face above middle": h, "back": back,
        "tube's plate from middle": inner + t, "tube above middle": up, "plate below tube": bottom + up,
        "plate above tube": top - up, "turn of the face's circle": float(own), "turn of the tube's circle": float(turn),
    }  # fmt: skip
    part = shop.part("bracket", [Prism(pad, 2.0 * wide), Prism(leg, 2.0 * wide)], holes, sizes=sizes,
                     circles={"face": face.circle, "tube (tapped)": shop.circle}, note="angle")  # fmt: skip
    return Made(part, seat, t)


def standing_size(face: Face, theta: float, shop: Shop) -> tuple[float, float, float]:
    """Where a standing bracket's tube's middle is from the face's, along and above it, and its thickness [m]."""
    thick = max(shop.plate, WEDGE)
    along = max(face.circle.edge, shop.half) - shop.half * np.cos(theta)
    return float(along), float(thick + shop.half * np.sin(theta)), thick


def standing(face: Face, theta: float, shop: Shop) -> Made:
    """Two plates, one on a base's plate, one standing on its edge, square to a tube that leaves at theta [rad]."""
    x, y, t = standing_size(face, theta, shop)
    back, s, c, h = max(face.circle.edge, shop.half), np.sin(theta), np.cos(theta), face.height
    u, e = np.array([s, c, 0.0]), np.array([c, -s, 0.0])
    seat = np.array([x, h + y, 0.0])
    top = seat - shop.half * e
    leg = np.array([[back, h + t], top[:2], (top - t * u)[:2], [back - t / s, h + t]])
    pad = np.array([[-back, h], [back, h], [back, h + t], [-back, h + t]])
    clear = SCREWS[face.circle.thread][0]
    own = np.pi / face.circle.count
    holes = [Rod(np.array([px, h, pz]), np.array([px, h + t, pz]), clear / 2.0) for px, pz in face.circle.places(own)]
    holes += _tapped(seat, u, e, np.pi / 4.0, t, shop)
    sizes = {
        "angle": theta, "plate": t, "width": 2.0 * back, "tube above face": y, "turn of the face's circle": float(own),
        "turn of the tube's circle": np.pi / 4.0,
    }  # fmt: skip
    part = shop.part("bracket", [Prism(pad, 2.0 * back), Prism(leg, 2.0 * back)], holes, sizes=sizes,
                     circles={"face": face.circle, "tube (tapped)": shop.circle}, note="standing")  # fmt: skip
    return Made(part, seat, t)


def corner(
    mark: str, point: Array, ways: tuple[Array, Array], link: int, shop: Shop
) -> tuple[Placed, tuple[Seat, Seat]]:
    """A block between two tubes, and its seats.

    Its frame: the origin where the tubes' axes meet, x half way between the tubes, y in their plane.

    Args:
        mark: Its mark.
        point: Where the axes meet, shape (3,) [m].
        ways: Towards the first tube and towards the second, shape (3,) each.
        link: Its link.
        shop: What it is made for.
    """
    back, onward = ways
    opening = float(np.arccos(np.clip(back @ onward, -1.0, 1.0)))
    c, s = np.cos(opening / 2.0), np.sin(opening / 2.0)
    away = max(shop.half * c / s, shop.tapped + 1e-3)
    pose = np.eye(4)
    middle = back + onward
    pose[:3, 2] = _unit(np.cross(onward, back))
    pose[:3, 0] = _unit(middle)
    pose[:3, 1] = np.cross(pose[:3, 2], pose[:3, 0])
    pose[:3, 3] = point
    normals = (np.array([c, s, 0.0]), np.array([c, -s, 0.0]))
    edges = (np.array([-s, c, 0.0]), np.array([s, c, 0.0]))
    # as thick at its edges as the holes are deep, and 2 mm more
    ends = np.stack([(away - inward) * u + sign * shop.half * e for u, e in zip(normals, edges, strict=True)
                     for sign in (1, -1) for inward in (0.0, shop.tapped + 2e-3)])  # fmt: skip
    outline = ends[ConvexHull(ends[:, :2]).vertices, :2]
    turns = (0.0, np.pi / 4.0)  # so that the holes of the two sides miss each other
    holes = [h for u, e, turn in zip(normals, edges, turns, strict=True)
             for h in _tapped(away * u, u, e, turn, shop.tapped, shop)]  # fmt: skip
    sizes = {"angle": opening, "tube's side from corner": away, "side": 2.0 * shop.half, "tapped depth": shop.tapped}
    part = shop.part("corner", [Prism(outline, 2.0 * shop.half)], holes, sizes=sizes,
                     circles={"tubes (tapped)": shop.circle})  # fmt: skip
    turn = pose[:3, :3]
    seats = [
        Seat(mark, turn @ (away * u) + point, turn @ u, turn @ (np.cos(a) * e + np.sin(a) * np.cross(u, e)))
        for u, e, a in zip(normals, edges, turns, strict=True)
    ]
    return Placed(part, mark, link, pose), (seats[0], seats[1])


class Joint(NamedTuple):
    """Two seats that face each other, and what goes between them.

    Attributes:
        mark: Mark of the tube or spacer.
        first: The seat at the base's side.
        second: The other; the tool where its mark is ``TOOL``.
        link: Their link.
    """

    mark: str
    first: Seat
    second: Seat
    link: int

    @property
    def span(self) -> float:
        """From seat to seat [m]."""
        return float((self.second.point - self.first.point) @ self.first.along)

    @property
    def turn(self) -> float:
        """From the first seat's first hole to the second's, about the tube [rad]."""
        a, b, u = self.first.across, self.second.across, self.first.along
        return float(np.arctan2(np.cross(a, b) @ u, a @ b))

    def cap(self, shop: Shop) -> float:
        """Thickness of what is on the tube's outer end [m]."""
        return max(shop.flange, 8e-3) if self.second.mark == TOOL else shop.flange

    def roomy(self) -> None:
        """Refuse what leaves no room for a spacer."""
        if self.span < SHORTEST_SPACER:
            raise CatalogueError(
                f"between {self.first.mark} and {self.second.mark} there are {self.span * 1e3:.1f} mm, too little for "
                "what joins them", value=self.span, allowed=f"at least {SHORTEST_SPACER * 1e3:g} mm",
                fix="Take thinner tubes, smaller actuators, or search with a larger --clearance",
            )  # fmt: skip


def tubed(joint: Joint, shop: Shop) -> tuple[list[Placed], list[Screws]]:
    """A tube between two seats, with its flanges, and the screws of these.

    Args:
        joint: The seats.
        shop: What the parts are made for.
    """
    first, second, mark, u = joint.first, joint.second, joint.mark, joint.first.along
    hand = second.mark == TOOL
    length = joint.span - shop.flange - joint.cap(shop)
    deep = min(shop.diameter, float(np.floor(length * 500.0 - 1.0) * 1e-3))
    ends = (
        (flange(deep, shop), _seated(first.point, u, first.across), first),
        (tool_plate(deep, shop) if hand else flange(deep, shop), _seated(second.point, -u, second.across), second),
    )
    turn = float((round(joint.turn, 9) + np.pi / 2.0) % np.pi - np.pi / 2.0)  # the holes go through both walls
    pose = _seated(first.point + shop.flange * u, u, first.across)
    placed = [Placed(tube(length, deep / 2.0, turn, shop), mark, joint.link, pose)]
    screws = []
    for letter, (part, place, seat) in zip("ab", ends, strict=True):
        pinned, own = ("M4" if shop.diameter > 25e-3 else "M3"), f"{mark}-{letter}"
        screws.append(Screws(pinned, shop.diameter + 1.6e-3 * float(pinned[1:]), 1, (mark, own), nut=True))
        held = Screws(shop.circle.thread, shop.flange + bite(shop), shop.circle.count, (own, seat.mark))
        screws.append(tool_screws(own, joint.cap(shop), shop) if seat.mark == TOOL else held)
        placed.insert(2 * (letter == "b"), Placed(part, own, joint.link, place))
    return placed, screws


def bite(shop: Shop) -> float:
    """How far screws go into tapped holes at least, one and a half times their diameter [m]."""
    return 1.5e-3 * float(shop.circle.thread[1:])


def tool_screws(mark: str, deep: float, shop: Shop) -> Screws:
    """What holds the tool.

    Args:
        mark: Of what holds it.
        deep: Depth of its tapped holes [m].
        shop: What it is made for.
    """
    circle = tool_circle(shop)
    bites = min(deep, 1e-3 * float(circle.thread[1:]))
    return Screws(circle.thread, TOOL_FLANGE + bites, circle.count, (mark, TOOL), most=TOOL_FLANGE + deep)


def _seated(point: Array, z: Array, x: Array) -> Array:
    """A frame of a point, its z and its x, shape (4, 4)."""
    frame = _frame(z, x)
    frame[:3, 3] = point
    return frame


def pin(shop: Shop) -> float:
    """Diameter of the hole across tubes and spigots [m]."""
    return SCREWS["M4" if shop.diameter > 25e-3 else "M3"][0]


def tube(length: float, from_end: float, turn: float, shop: Shop) -> Part:
    """A tube along z from 0, with a hole across either end, the first along x, the second turned by an angle.

    Its bore is a hole like the others.

    Args:
        length: [m].
        from_end: Of the holes [m].
        turn: Of the second from the first, about the axis [rad].
        shop: What it is of.
    """
    radius, bore = shop.diameter / 2.0, shop.diameter / 2.0 - shop.wall
    ends = np.zeros(3), np.array([0.0, 0.0, length])
    holes = [Rod(*ends, bore)]
    for z, angle_ in ((from_end, 0.0), (length - from_end, turn)):
        way = np.array([np.cos(angle_), np.sin(angle_), 0.0])
        middle = np.array([0.0, 0.0, z])
        holes += [Rod(middle + side * bore * way, middle + side * radius * way, pin(shop) / 2.0, oblique=True)
                  for side in (1.0, -1.0)]  # fmt: skip
    sizes = {"diameter": shop.diameter, "wall": shop.wall, "length": length, "hole from end": from_end,
             "hole": pin(shop), "turn of second hole": turn}  # fmt: skip
    return shop.part("tube", [Rod(*ends, radius)], holes, sizes=sizes)


def _spigot(deep: float, thickness: float, shop: Shop) -> tuple[list[Rod], list[Rod], dict[str, float]]:
    """What goes into a tube, from a disc of a thickness on along z, and the bore and hole across it."""
    radius = shop.diameter / 2.0 - shop.wall - 0.05e-3
    bore = max(radius - 4e-3, radius / 2.0)
    solid = Rod(np.array([0.0, 0.0, thickness]), np.array([0.0, 0.0, thickness + deep]), radius)
    middle, x = np.array([0.0, 0.0, thickness + deep / 2.0]), np.array([1.0, 0.0, 0.0])
    holes = [Rod(np.zeros(3), solid.end, bore)]
    holes += [Rod(middle + side * bore * x, middle + side * radius * x, pin(shop) / 2.0, oblique=True)
              for side in (1.0, -1.0)]  # fmt: skip
    sizes = {"spigot": 2.0 * radius, "spigot length": deep, "bore": 2.0 * bore, "hole": pin(shop),
             "hole from disc": deep / 2.0}  # fmt: skip
    return [solid], holes, sizes


def flange(deep: float, shop: Shop) -> Part:
    """A disc from z = 0 on with a spigot that goes into a tube.

    Args:
        deep: Length of the spigot [m].
        shop: What it is made for.
    """
    t = shop.flange
    solids, holes, sizes = _spigot(deep, t, shop)
    clear = SCREWS[shop.circle.thread][0]
    holes += [_drilled(x, y, 0.0, t, clear) for x, y in shop.circle.places()]
    sizes = {"diameter": 2.0 * shop.half, "thickness": t, **sizes}
    return shop.part("tube flange", [Rod(np.zeros(3), np.array([0.0, 0.0, t]), shop.half), *solids], holes, sizes=sizes,
                     circles={"bracket": shop.circle})  # fmt: skip


def tool_circle(shop: Shop) -> BoltCircle:
    """The smallest of ``TOOL_CIRCLES`` outside the tube."""
    fitting = (c for c in TOOL_CIRCLES if c.diameter > shop.diameter + SCREWS[c.thread][1] + 2e-3)
    return next(fitting, BoltCircle(shop.diameter + 20e-3, 6, "M8"))


def tool_plate(deep: float, shop: Shop) -> Part:
    """A disc from z = 0, which is at the tool, on, tapped for it, with a spigot that goes into a tube.

    Args:
        deep: Length of the spigot [m].
        shop: What it is made for.
    """
    t, circle = max(shop.flange, 8e-3), tool_circle(shop)
    solids, holes, sizes = _spigot(deep, t, shop)
    holes += [_drilled(x, y, 0.0, t, SCREWS[circle.thread][1]) for x, y in circle.places(np.pi / 4.0)]
    sizes = {"diameter": 2.0 * circle.edge, "thickness": t, **sizes}
    disc = Rod(np.zeros(3), np.array([0.0, 0.0, t]), circle.edge)
    return shop.part("tool plate", [disc, *solids], holes, sizes=sizes,
                     circles={"tool (tapped through, ISO 9409-1)": circle})  # fmt: skip


def spacer(joint: Joint, nodes: Sequence[Placed | None], shop: Shop) -> tuple[list[Placed], list[Screws]]:
    """A round between two seats, and the bracket that is drilled through for its screws, which end in the other seat.

    Args:
        joint: The seats.
        nodes: The parts that have them.
        shop: What the parts are made for.

    Raises:
        CatalogueError: There is not room enough, or neither bracket leaves room for the heads.
    """
    joint.roomy()
    span, circle, d = joint.span, shop.circle, 1e-3 * float(shop.circle.thread[1:])
    for node, own, other, held in zip(nodes, (joint.first, joint.second), (joint.second, joint.first),
                                      nodes[::-1], strict=True):  # fmt: skip
        long = shop.plate + span + bite(shop)
        through = None if node is None else drilled_through(node, own, other.across, long, shop)
        if through is None or held is None:
            continue
        pose = _seated(joint.first.point, joint.first.along, other.across)
        holes = [_drilled(x, y, 0.0, span, SCREWS[circle.thread][0]) for x, y in circle.places()]
        part = shop.part("spacer", [Rod(np.zeros(3), np.array([0.0, 0.0, span]), shop.half)], holes,
                         sizes={"diameter": 2.0 * shop.half, "length": span}, circles={"through": circle},
                         note=SPACER_NOTE)  # fmt: skip
        deep = (2.0 * d if blind(held) else shop.plate + GAP) - 0.5e-3
        under = through.part.sizes["under heads"] + span
        screws = Screws(circle.thread, under + bite(shop), circle.count, (own.mark, other.mark),
                        most=under + deep, spacer=joint.mark)  # fmt: skip
        return [Placed(part, joint.mark, joint.link, pose), through], [screws]
    raise CatalogueError(
        f"between {joint.first.mark} and {joint.second.mark} there are {span * 1e3:.1f} mm, too little for a tube, and "
        "behind neither is room for the screws of a spacer", value=span,
        allowed=f"at least {(2.0 * shop.flange + SHORTEST_TUBE) * 1e3:g} mm",
        fix="Take thinner tubes, smaller actuators, or search with a larger --clearance",
    )  # fmt: skip


def blind(node: Placed) -> bool:
    """Whether the tapped holes of a part end within it."""
    return node.part.note not in ("angle", "standing")


def drilled_through(node: Placed, seat: Seat, across: Array, long: float, shop: Shop) -> Placed | None:
    """A bracket whose second plate is drilled through instead of tapped, its heads sunk; None where that cannot be.

    Args:
        node: The bracket.
        seat: Its seat.
        across: From the seat's middle to the first hole, a unit vector, shape (3,).
        long: Length of the screws, which need as much room behind the plate [m].
        shop: What it is made for.
    """
    if blind(node):
        return None
    part, turn, circle = node.part, node.pose[:3, :3].T, shop.circle
    u, f = turn @ seat.along, turn @ across
    e, middle, pad = np.array([u[1], -u[0], 0.0]), turn @ (seat.point - node.pose[:3, 3]), part.solids[0]
    clear, _, head = SCREWS[circle.thread]
    thick, wide, holes = part.sizes["plate"], head / 2.0 + 0.25e-3, list(part.holes[: -circle.count])
    under = thick - 1e-3 * float(circle.thread[1:]) - 0.3e-3
    for x, y in circle.places():
        start = middle + x * f + y * np.cross(u, f)
        floor, back = start - under * u, start - thick * u
        heights = np.array([back[1], back[1] - long * u[1]])
        if isinstance(pad, Prism) and not (
            (heights + wide * abs(e[1]) < pad.polygon[:, 1].min()).all()
            or (heights - wide * abs(e[1]) > pad.polygon[:, 1].max()).all()
        ):
            return None
        holes += [Rod(start, floor, clear / 2.0), Rod(floor, back, wide)]
    sizes = dict(part.sizes) | {
        "turn of the tube's circle": float(np.arctan2(f @ np.cross(u, e), f @ e)), "counterbore": 2.0 * wide,
        "under heads": under,
    }  # fmt: skip
    circles = {"face": part.circles["face"], "tube (through)": circle}
    return replace(node, part=replace(part, holes=tuple(holes), sizes=sizes, circles=circles))


def tool_spacer(joint: Joint, node: Placed | None, shop: Shop) -> tuple[list[Placed], list[Screws]]:
    """A round at the tool, tapped for it, screwed to its seat from the tool's side, its heads sunk.

    Args:
        joint: The seat and the tool.
        node: The part that has the seat.
        shop: What it is made for.

    Raises:
        CatalogueError: There is not room enough.
    """
    joint.roomy()
    span, circle, tool, d = joint.span, shop.circle, tool_circle(shop), 1e-3 * float(shop.circle.thread[1:])
    clear, _, head = SCREWS[circle.thread]
    tap, wide, under = SCREWS[tool.thread][1], head / 2.0 + 0.25e-3, span - d - 0.3e-3
    turns = np.radians(np.arange(0.0, 360.0 / tool.count, 7.5))
    apart = [np.linalg.norm(tool.places(t)[:, None] - circle.places(), axis=2).min() for t in turns]
    turn = float(turns[int(np.argmax(np.round(apart, 9)))])
    if max(apart) < wide + tap / 2.0 + 1e-3:
        raise CatalogueError(
            f"the screws of a spacer at the tool of link {joint.link} meet those of the tool", value=span,
            allowed=f"at least {(shop.flange + joint.cap(shop) + SHORTEST_TUBE) * 1e3:g} mm, for a tube",
            fix="Take thinner tubes, smaller actuators, or search with a larger --clearance",
        )  # fmt: skip
    deep = 2e-3 * float(tool.thread[1:])
    deep = span if span < deep + 3e-3 else deep
    radius, top = max(shop.half, tool.edge), np.array([0.0, 0.0, span])
    holes = [hole for x, y in circle.places() for hole in (_drilled(x, y, 0.0, under, clear),
                                                           _drilled(x, y, under, span, 2.0 * wide))]  # fmt: skip
    holes += [_drilled(x, y, span - deep, span, tap) for x, y in tool.places(turn)]
    sizes = {"diameter": 2.0 * radius, "length": span, "counterbore": 2.0 * wide, "under heads": under,
             "tapped depth": deep, "turn of second circle": turn}  # fmt: skip
    part = shop.part("spacer", [Rod(np.zeros(3), top, radius)], holes, sizes=sizes,
                     circles={"through": circle, "tool (tapped, ISO 9409-1)": tool}, note=TOOL_NOTE)  # fmt: skip
    room = (2.0 * d if node is None or blind(node) else shop.plate + GAP) - 0.5e-3
    held = Screws(circle.thread, under + bite(shop), circle.count, (joint.mark, joint.first.mark), most=under + room)
    pose = _seated(joint.first.point, joint.first.along, joint.first.across)
    return [Placed(part, joint.mark, joint.link, pose)], [held, tool_screws(joint.mark, deep, shop)]


def named(placed: Sequence[Placed]) -> list[Placed]:
    """The same with parts that are alike under one name, numbered where a kind has several."""
    kinds: dict[tuple[object, ...], Part] = {}
    keys = []
    for each in placed:
        part = each.part
        numbers = tuple((name, round(value, 6)) for name, value in part.sizes.items())
        keys.append((part.kind, part.name, part.material, part.note if not part.bought else "", numbers))
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
