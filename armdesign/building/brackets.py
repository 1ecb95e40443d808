"""Brackets and corners: what leads from a face to a plane that a tube's flange, or a spacer, is bolted on.

**Brackets** lead from a face to a plane square to a tube that leaves at the angle theta from the face's normal, within
``TURNS``: a **wedge** is a block on the face whose upper side is tilted, its tube points at the face's middle; an
**angle** is two plates, the second beside the housing, its tube points at m_j; a **side** bracket is one whose second
plate and tube stay on its own side of m_j, so that the joint's other bracket passes it at any angle; on a base's plate
there may be a **standing** one, whose second plate stands on the edge of the first.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

from armdesign._types import Array
from armdesign.building.part_tolerances import ANGLE
from armdesign.building.parts import SCREWS, BoltCircle, Part, Placed, Prism, Rod, Screws
from armdesign.building.screw_access import TurnError, head_room, heads_reach, passed_by, wall_beside
from armdesign.building.shop import (
    CHEEK,
    CHEEK_EDGE,
    CHEEK_PLAY,
    GAP,
    WEDGE,
    Face,
    Housing,
    Seat,
    Shop,
    frame,
    scribed,
    unit,
)

TURNS = {
    "wedge": (0.0, np.radians(65.0)), "angle": (np.radians(40.0), np.radians(150.0)),
    "side": (np.radians(40.0), np.radians(115.0)), "standing": (np.radians(40.0), np.radians(110.0)),
}  # fmt: skip
"""Kinds of bracket, and the angles between tube and face's normal that they make."""
FLAT = ANGLE / 2.0
"""A wedge's angle below which it is made flat: half of what angles may be off [rad]."""
SPARE = 0.4e-3
"""What screws into an actuator stay clear of the ground of their holes: they and the bracket may be off by 0.34 mm."""
BY_CHEEKS = "through its cheeks into both sides of the housing"
HELD = "housing"
"""What the holes in cheeks are for."""
RIMS = 0.5e-3
"""Between the rims of two flanges at a corner [m]."""
KEY = 1e-3
"""What a screw's head and its key stay clear of a plate that leans over them [m]."""
INNER = 3e-3
"""Radius that a mill leaves in an inner corner, where there is room for it [m]."""


class Knot(NamedTuple):
    """A point of a link's way: a face with the bracket on it, a corner, or the tool.

    Attributes:
        point: m_j, a corner, or the tool, shape (3,) [m].
        face: Of an end with an actuator or a plate.
    """

    point: Array
    face: Face | None = None


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
    turned = frame(face.normal, lean if np.linalg.norm(lean) > 1e-6 else np.array([1.0, 0.0, 0.0]))
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1] = turned[:3, 0], face.normal
    pose[:3, 2] = np.cross(pose[:3, 0], pose[:3, 1])
    pose[:3, 3] = face.middle
    made = {"wedge": wedge, "angle": angle, "side": angle, "standing": standing}[kind](face, theta, shop)
    cheeked = face.held if face.held is not None and len(face.held.holes) else None
    made = made if cheeked is None else with_cheeks(made, cheeked, face, shop)
    (u, e), sizes, turn = square_to(theta), made.part.sizes, pose[:3, :3]
    across = turned_from(u, e, sizes["turn of the tube's circle"])
    seat = Seat(mark, turn @ made.seat + pose[:3, 3], turn @ u, turn @ across)
    scribes = scribed(turn.T @ seat.between(shop.circle), made.seat, shop.half, sizes["width"] / 2.0)
    part, circle, joins = replace(made.part, scribes=scribes), face.circle, (face.mark, mark)
    room = head_room(part, face, shop) if cheeked is None else 0.0
    if cheeked is not None:
        bite = min(cheeked.depth - 1e-3, 3e-3)
        screws = Screws(cheeked.thread, CHEEK + bite, 2 * len(cheeked.holes), joins, most=CHEEK + cheeked.depth - SPARE,
                        note=BY_CHEEKS)  # fmt: skip
    elif circle.maker:
        part = replace(part, circles={**part.circles, "face": replace(circle, diameter=room)})
        screws = Screws("", made.under, 0, joins, maker=circle.maker)
    else:
        bite = min(1.5e-3 * float(circle.thread[1:]), circle.deep - 0.5e-3)
        most = made.under + circle.deep - SPARE
        screws = Screws(circle.thread, made.under + bite, circle.count, joins, most=most)
    return Placed(part, mark, link, pose), seat, screws


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
        x, y, _, _ = standing_size(face, theta, shop)
    lean = along - (along @ face.normal) * face.normal
    point: Array = face.middle + (face.height + y) * face.normal + x * lean / max(float(np.linalg.norm(lean)), 1e-9)
    return point


def with_cheeks(made: Made, housing: Housing, face: Face, shop: Shop) -> Made:
    """A bracket on the back of a box with a cheek on either side, drilled for the screws into the sides.

    Args:
        made: The bracket.
        housing: The box.
        face: Its back.
        shop: What it is made for.
    """
    reach, _ = housing.pad(shop)
    x, y = float(housing.holes[:, 0].max()) + CHEEK_EDGE, float(housing.holes[:, 1].min()) - CHEEK_EDGE
    outline = np.array([[-reach, y], [x, y], [x, face.height], [-reach, face.height]])
    inner = housing.half + CHEEK_PLAY
    cheeks = [Prism(outline, CHEEK, z * (inner + CHEEK / 2.0)) for z in (1.0, -1.0)]
    clear = SCREWS[housing.thread][0] / 2.0
    holes = [Rod(np.array([*place, z * inner]), np.array([*place, z * (inner + CHEEK)]), clear, use=HELD)
             for z in (1.0, -1.0) for place in housing.holes]  # fmt: skip
    sizes = {**made.part.sizes, "between cheeks": 2.0 * inner, "cheek": CHEEK, "cheeks' depth": face.height - y,
             "cheeks from axis": -x, "cheeks' end from axis": reach}  # fmt: skip
    circles = {name: circle for name, circle in made.part.circles.items() if name != "face"}
    circles[HELD] = BoltCircle(0.0, len(holes), housing.thread)
    part = replace(made.part, solids=(*made.part.solids, *cheeks), holes=(*holes, *made.part.holes), sizes=sizes,
                   circles=circles)  # fmt: skip
    return made._replace(part=part)


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


def square_to(theta: float) -> tuple[Array, Array]:
    """Along a tube that leaves a face's normal y at theta [rad], and along its flange, away from y, shape (3,) each."""
    return np.array([np.sin(theta), np.cos(theta), 0.0]), np.array([np.cos(theta), -np.sin(theta), 0.0])


def turned_from(u: Array, e: Array, turn: float) -> Array:
    """A direction e turned about u, to which it is square, shape (3,)."""
    way: Array = np.cos(turn) * e + np.sin(turn) * np.cross(u, e)
    return way


def tapped_holes(
    middle: Array, u: Array, e: Array, turn: float, depth: float, shop: Shop, use: str = "tube (tapped)"
) -> list[Rod]:
    """The tapped holes for a flange in a plane through ``middle``, square to ``u``, the first ``turn`` from ``e``."""
    f, radius = np.cross(u, e), SCREWS[shop.circle.thread][1] / 2.0
    places = shop.circle.places(turn)
    return [Rod(middle + x * e + y * f, middle + x * e + y * f - depth * u, radius, use=use) for x, y in places]


def face_holes(circle: BoltCircle, low: float, high: float) -> tuple[list[Rod], dict[str, float]]:
    """Holes along y for the screws of a face, and how they are turned; none where its maker alone knows them.

    Args:
        circle: Of the face.
        low: Where they begin [m].
        high: Where they end [m].
    """
    if circle.maker:
        return [], {}
    own, radius = np.pi / circle.count, SCREWS[circle.thread][0] / 2.0
    holes = [Rod(np.array([x, low, z]), np.array([x, high, z]), radius, use="face") for x, z in circle.places(own)]
    return holes, {"turn of the face's circle": float(own)}


def inner_radius(reach: float, theta: float) -> dict[str, float]:
    """Largest radius of a mill in the corner of two plates at theta [rad], ``reach`` from what is between [m]."""
    room = np.floor(2e3 * reach * np.tan((np.pi - theta) / 2.0) + 1e-6) / 2e3
    return {"inner radius": min(INNER, float(room))}


def wedge_turns(face: Face, theta: float, shop: Shop) -> tuple[float, float]:
    """How the circles of a wedge's face and of its tube are turned [rad].

    So that both are as far apart as can be; where the face's is not drilled the tube's by a quarter of a right angle,
    away from the high side, which is shortest, or by less where that is beside known holes of the face.
    """
    bolts, turns, enough = face.back[None], np.arange(45.0, -1.0, -7.5), wall_beside(face, shop)
    if not (face.circle.maker or face.held):
        bolts, turns, enough = face.circle.places(face.circle.turns), np.arange(0.0, 90.0, 7.5), np.inf
    if not bolts.size:
        return 0.0, np.pi / 4.0
    u, e = square_to(theta)
    taps = [tapped_holes(np.zeros(3), u, e, turn, shop.tapped, shop) for turn in np.radians(turns)]
    apart = np.stack([passed_by(each, bolts) for each in taps], axis=1)
    own, turn = np.unravel_index(int(np.argmax(np.round(np.minimum(apart, enough), 9))), apart.shape)
    return float(face.circle.turns[own]), float(np.radians(turns[turn]))


def wedge_size(face: Face, theta: float, shop: Shop) -> tuple[float, float, float]:
    """Half the length of a wedge along the tilt, half its width, and its height under the tube's middle [m]."""
    theta = theta if theta >= FLAT else 0.0
    c, s, radius = np.cos(theta), np.sin(theta), SCREWS[shop.circle.thread][1] / 2.0
    held = face.held is not None  # a block on a plate that covers the box
    edge, plate = (0.0, shop.plate) if held else (face.circle.edge, 0.0)
    far = shop.circle.diameter / 2.0 * (np.cos(wedge_turns(face, theta, shop)[1]) if held or face.circle.maker else 1.0)
    long = float(max(edge, shop.half * c, (far + radius) * c + shop.tapped * s + shop.web))
    return long, max(edge, shop.half), WEDGE + plate + long * np.tan(theta)


def wedge(face: Face, theta: float, shop: Shop) -> Made:
    """A block on a face, its upper side square to a tube that leaves at theta [rad].

    The face's screws go down through it, their heads sunk below the upper side, ``WEDGE`` - 6 mm above the face.
    """
    theta = theta if theta >= FLAT else 0.0
    long, wide, middle = wedge_size(face, theta, shop)
    h, rise = face.height, long * np.tan(theta)
    held = face.held is not None
    foot = h + shop.plate if held else h
    corners = np.array([[-long, foot], [long, foot], [long, h + middle - rise], [-long, h + middle + rise]])
    (u, e), (own, turn), seat = square_to(theta), wedge_turns(face, theta, shop), np.array([0.0, h + middle, 0.0])
    taps = tapped_holes(seat, u, e, turn, shop.tapped, shop)
    (clear, _, head), under = SCREWS[face.circle.thread], WEDGE - 6e-3
    sunk = []
    for x, z in face.circle.places(own):
        top, floor = np.array([x, h + middle - x * np.tan(theta), z]), np.array([x, h + under, z])
        sunk += [Rod(np.array([x, h, z]), floor, clear / 2.0, use="face"),
                 Rod(floor, top, head / 2.0 + 0.25e-3, oblique=theta > 1e-6, use="face")]  # fmt: skip
    sizes = {
        "angle": theta, "length": 2.0 * long, "width": 2.0 * wide, "low side": middle - rise,
        "high side": middle + rise, "under heads": under, "face above middle": h,
        "turn of the tube's circle": turn, "tapped depth": shop.tapped,
    }  # fmt: skip
    solids = [Prism(corners, 2.0 * wide)]
    if held or face.circle.maker:
        sunk = []
    else:
        sizes |= {"turn of the face's circle": own, "counterbore": 2.0 * sunk[1].radius}
    if held:
        back, half = face.pad(shop)
        pad = np.array([[-back, h], [long, h], [long, foot], [-back, foot]])
        solids.append(Prism(pad, 2.0 * half))
        sizes |= {"plate": shop.plate, "plate's width": 2.0 * half, "back": back}
    part = shop.part("bracket", solids, [*sunk, *taps], sizes=sizes,
                     circles={"face": face.circle, "tube (tapped)": shop.circle}, note="wedge")  # fmt: skip
    return Made(part, seat, under)


def angle_plane(face: Face, theta: float, shop: Shop) -> float:
    """From the middle of the body behind a face to the inner side of an angle's second plate [m]."""
    s, c, h = np.sin(theta), np.cos(theta), face.height
    beside = face.radius + GAP
    inner = beside * s + (h * c if c > 0.0 else (h + GAP) * -c)
    if not face.aside and shop.half * s - inner * c > h:  # it reaches beyond the other face, where the other bracket is
        beside = max(beside, face.across(shop) + GAP)
        inner = max(inner, beside * s + shop.half * abs(c))
    if c > 0.0:  # it leans over the face, but not over its screws, a side bracket's all that it is shifted up
        clear = heads_reach(face) + KEY
        shifted = s * (clear + 2.0 * shop.half * c) + GAP / 2.0 * c if face.aside else 0.0
        inner = max(inner, (clear + shop.half * c) / s, shifted)
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
    back, wide = face.pad(shop)
    inner, up = angle_plane(face, theta, shop), side_shift(face, theta, shop) if face.aside else 0.0
    u, e = square_to(theta)

    def end(y: float) -> Array:
        """Where the inner side of the second plate is at a height."""
        return np.array([(inner - y * c) / s, y, 0.0])

    top = max(shop.half + up, float(-end(h + t) @ e), float(-end(h) @ e))
    bottom = max(shop.half - up, float(end(h) @ e))
    low, high = inner * u + bottom * e, inner * u - top * e
    leg = np.stack([low, low + t * u, high + t * u, high])[:, :2]
    pad = np.stack([np.array([-back, h, 0.0]), end(h), end(h + t), np.array([-back, h + t, 0.0])])[:, :2]
    holes, turned = face_holes(face.circle, h, h + t)
    turn, seat = np.pi / 4.0, (inner + t) * u - up * e
    holes += tapped_holes(seat, u, e, turn, t, shop)
    sizes = {
        "angle": theta, "plate": t, "width": 2.0 * wide, "face above middle": h, "back": back,
        "tube's plate from middle": inner + t, "tube above middle": up, "plate below tube": bottom + up,
        "plate above tube": top - up, "turn of the tube's circle": float(turn), **turned,
        **inner_radius(float(end(h)[0]) - face.radius, theta),
    }  # fmt: skip
    part = shop.part("bracket", [Prism(pad, 2.0 * wide), Prism(leg, 2.0 * wide)], holes, sizes=sizes,
                     circles={"face": face.circle, "tube (tapped)": shop.circle}, note="angle")  # fmt: skip
    return Made(part, seat, t)


def standing_size(face: Face, theta: float, shop: Shop) -> tuple[float, float, float, float]:
    """Where a standing bracket's tube's middle is, along and above its face, its thickness, its length in front [m].

    Before its second plate the heads of the face's screws have room, beside the radius that a mill leaves, and are
    reached from above where it leans over them.
    """
    thick, heads = max(shop.plate, WEDGE), heads_reach(face)
    theta = float(np.clip(theta, *TURNS["standing"]))
    over = 2.0 * shop.half * max(0.0, np.cos(theta)) + thick * np.sin(theta)  # how far its upper end leans over them
    front = float(max(face.circle.edge, shop.half, heads + INNER + thick / np.sin(theta), heads + KEY + over))
    return float(front - shop.half * np.cos(theta)), float(thick + shop.half * np.sin(theta)), thick, front


def standing(face: Face, theta: float, shop: Shop) -> Made:
    """Two plates, one on a base's plate, one standing on its edge, square to a tube that leaves at theta [rad]."""
    x, y, t, front = standing_size(face, theta, shop)
    back, s, h = max(face.circle.edge, shop.half), np.sin(theta), face.height
    u, e = square_to(theta)
    seat = np.array([x, h + y, 0.0])
    top = seat - shop.half * e
    leg = np.array([[front, h + t], top[:2], (top - t * u)[:2], [front - t / s, h + t]])
    pad = np.array([[-back, h], [front, h], [front, h + t], [-back, h + t]])
    holes, turned = face_holes(face.circle, h, h + t)
    holes += tapped_holes(seat, u, e, np.pi / 4.0, t, shop)
    sizes = {
        "angle": theta, "plate": t, "width": 2.0 * back, "length": back + front, "back": back, "tube above face": y,
        "turn of the tube's circle": np.pi / 4.0,
        **turned, "inner radius": INNER,
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
    # no hole of one side comes out of the other: at its mouth, at its end
    far, radius = shop.circle.diameter / 2.0, SCREWS[shop.circle.thread][1] / 2.0
    inside = (far + radius) * np.sin(opening) + shop.web - min(0.0, shop.tapped * np.cos(opening))
    rims = (shop.half * c + RIMS / 2.0) / s
    away = float(max(rims, shop.tapped + 1e-3, inside / (1.0 - np.cos(opening))))
    pose = np.eye(4)
    middle = back + onward
    pose[:3, 2] = unit(np.cross(onward, back))
    pose[:3, 0] = unit(middle)
    pose[:3, 1] = np.cross(pose[:3, 2], pose[:3, 0])
    pose[:3, 3] = point
    normals = (np.array([c, s, 0.0]), np.array([c, -s, 0.0]))
    edges = (np.array([-s, c, 0.0]), np.array([s, c, 0.0]))
    # as thick at its edges as the holes are deep, and 2 mm more; less at the tip that the other face cuts
    thick = shop.tapped + 2e-3
    room = away * (1.0 - np.cos(opening)) - shop.half * np.sin(opening)  # from the tip of a face to the other face
    tip = min(thick, room / max(-np.cos(opening), 1e-9))
    ends = np.stack([(away - inward) * u + sign * shop.half * e
                     for u, e, inner in zip(normals, edges, (-1, 1), strict=True) for sign in (1, -1)
                     for inward in (0.0, tip if sign == inner else thick)])  # fmt: skip
    outline = ends[ConvexHull(ends[:, :2]).vertices, :2]
    turns = (0.0, np.pi / 4.0)  # so that the holes of the two sides miss each other
    holes = [h for u, e, turn in zip(normals, edges, turns, strict=True)
             for h in tapped_holes(away * u, u, e, turn, shop.tapped, shop, "tubes (tapped)")]  # fmt: skip
    sizes = {"angle": opening, "tube's side from corner": away, "side": 2.0 * shop.half, "tapped depth": shop.tapped}
    own = [Seat(mark, away * u, u, turned_from(u, e, a))
           for u, e, a in zip(normals, edges, turns, strict=True)]  # fmt: skip
    scribes = tuple(line for seat in own
                    for line in scribed(seat.between(shop.circle), seat.point, shop.half, shop.half))  # fmt: skip
    part = shop.part("corner", [Prism(outline, 2.0 * shop.half)], holes, sizes=sizes,
                     circles={"tubes (tapped)": shop.circle}, scribes=scribes)  # fmt: skip
    turn = pose[:3, :3]
    seats = [Seat(mark, turn @ seat.point + point, turn @ seat.along, turn @ seat.across) for seat in own]
    return Placed(part, mark, link, pose), (seats[0], seats[1])
