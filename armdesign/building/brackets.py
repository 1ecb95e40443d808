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
from armdesign.errors import CatalogueError

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
SINK, BESIDE = 0.25e-3, 1e-3
"""Of what heads are sunk in: how much wider it is on either side, and what is left beside it [m]."""
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


class TurnError(CatalogueError):
    """A bracket of some kind does not turn so far; another kind may."""


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
    cheeked = face.housing if face.holds and face.housing is not None and len(face.housing.holes) else None
    made = made if cheeked is None else with_cheeks(made, cheeked, face, shop)
    sizes = made.part.sizes
    u, e = np.array([np.sin(theta), np.cos(theta), 0.0]), np.array([np.cos(theta), -np.sin(theta), 0.0])
    across = np.cos(sizes["turn of the tube's circle"]) * e + np.sin(sizes["turn of the tube's circle"]) * np.cross(
        u, e
    )
    turn = pose[:3, :3]
    seat = Seat(mark, pose[:3, :3] @ made.seat + pose[:3, 3], turn @ u, turn @ across)
    part = replace(
        made.part, scribes=scribed(turn.T @ seat.between(shop.circle), made.seat, shop.half, sizes["width"] / 2.0)
    )
    thread, joins = face.circle.thread, (face.mark, mark)
    bite = min(1.5e-3 * float(thread[1:]), face.circle.deep - 0.5e-3)
    most = made.under + face.circle.deep - SPARE
    screws = Screws(thread, made.under + bite, face.circle.count, joins, most=most)
    if cheeked is not None:
        bite = min(cheeked.depth - 1e-3, 3e-3)
        screws = Screws(cheeked.thread, CHEEK + bite, 2 * len(cheeked.holes), joins, most=CHEEK + cheeked.depth - SPARE,
                        note=BY_CHEEKS)  # fmt: skip
    elif face.circle.maker:
        room = replace(face.circle, diameter=face_room(part, face))
        part = replace(part, circles={**part.circles, "face": room})
        screws = Screws("", made.under, 0, joins, maker=face.circle.maker)
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
    """Largest radius of a mill between the two plates of a bracket [m].

    Args:
        reach: From the corner to the edge of what is between them [m].
        theta: From the face's normal to the tube [rad].
    """
    room = np.floor(2e3 * reach * np.tan((np.pi - theta) / 2.0) + 1e-6) / 2e3
    return {"inner radius": min(INNER, float(room))}


def undrilled_turn(face: Face, theta: float, shop: Shop) -> float:
    """How far the tube's circle is turned on a wedge that is not drilled for its face's screws, 0 to pi / 4 [rad].

    A quarter of a right angle, away from the high side, which is shortest; less where that is beside known holes of
    the face, whose screws' heads are sunk in the wedge.
    """
    back = face.housing.back if face.holds and face.housing is not None else np.empty((0, 2))
    turns = np.radians(np.arange(45.0, -1.0, -7.5))
    if not len(back):
        return float(turns[0])
    u, e = np.array([np.sin(theta), np.cos(theta), 0.0]), np.array([np.cos(theta), -np.sin(theta), 0.0])
    tap, head = SCREWS[shop.circle.thread][1], SCREWS[face.circle.thread][2]
    least = head / 2.0 + SINK + tap / 2.0 + BESIDE
    gaps = []
    for turn in turns:
        taps = tapped_holes(np.zeros(3), u, e, turn, shop.tapped, shop)
        plan = np.concatenate([np.linspace(each.start, each.end, 9) for each in taps])[:, [0, 2]]
        gaps.append(float(np.linalg.norm(plan[:, None] - back, axis=2).min()))
    clear = next((float(turn) for turn, gap in zip(turns, gaps, strict=True) if gap >= least), None)
    if clear is None:
        raise TurnError(
            f"the holes for a tube meet those of {face.mark}, however they are turned", value=max(gaps),
            allowed=f"at least {1e3 * least:.1f} mm between them", fix="Take thicker tubes or other actuators",
        )  # fmt: skip
    return clear


def face_room(part: Part, face: Face) -> float:
    """Diameter of the largest circle for screws of a face that is not drilled, with heads that are clear of all [m].

    Args:
        part: The bracket.
        face: The face; 0 where the places of its holes are known, but are on no circle about the axis.

    Raises:
        TurnError: There is no room for its holes as far as they are known.
    """
    turns, head = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False), SCREWS[face.circle.thread][2] / 2.0
    ring, up = np.stack([np.cos(turns), 0.0 * turns, np.sin(turns)], axis=1), np.array([0.0, 1.0, 0.0])
    block, taps = part.note == "wedge", [hole for hole in part.holes if "tapped" in hole.use]
    thick = WEDGE - 1e-3 if block else part.sizes["plate"]
    plan = np.concatenate([np.linspace(hole.start, hole.end, 9) for hole in taps])[:, [0, 2]]

    def clear(places: Array) -> bool:
        """Whether heads at some x and z are clear: sunk beside the tapped holes, or on a plate beside the other."""
        if block:
            gap = np.linalg.norm(plan[:, None] - places, axis=2).min()
            return bool(gap >= taps[0].radius + head + SINK + BESIDE)
        points = np.insert(places, 1, face.height + thick, axis=1)[:, None] + (head + SINK) * ring
        return not any(part.holds((points + y * up).reshape(-1, 3)).any() for y in (1e-6, 2.0 * head))

    def on(radius: float) -> bool:
        """Whether a disc about the axis is on the face, and as thick as heads need."""
        return all(part.holds(radius * ring + (face.height + y) * up).all() for y in (0.0, thick))

    back = face.housing.back if face.holds and face.housing is not None else np.empty((0, 2))
    owns, found = np.radians(np.arange(0.0, 360.0 / face.circle.count, 7.5)), 0.0
    for half in np.arange(0.25e-3, 0.1, 0.25e-3) if not len(back) else ():
        circle = replace(face.circle, diameter=2.0 * float(half))
        if not on(half + head + 1.5e-3) or not any(clear(circle.places(own)) for own in owns):
            break
        found = circle.diameter
    least = face.circle.diameter - 1e-9 if face.circle.known else 1e-9
    if not clear(back) if len(back) else found < least:
        raise TurnError(
            f"heads of the screws into {face.mark} have no room on its bracket", value=found,
            fix="Take other tubes or actuators, or search with a larger --clearance",
        )  # fmt: skip
    return found


def wedge_size(face: Face, theta: float, shop: Shop) -> tuple[float, float, float]:
    """Half the length of a wedge along the tilt, half its width, and its height under the tube's middle [m]."""
    theta = theta if theta >= FLAT else 0.0
    c, s, radius = np.cos(theta), np.sin(theta), SCREWS[shop.circle.thread][1] / 2.0
    held = face.housing is not None and face.holds  # a block on a plate that covers the box
    edge, plate = (0.0, shop.plate) if held else (face.circle.edge, 0.0)
    far = shop.circle.diameter / 2.0 * (np.cos(undrilled_turn(face, theta, shop)) if held or face.circle.maker else 1.0)
    long = float(max(edge, shop.half * c, (far + radius) * c + shop.tapped * s + shop.web))
    return long, max(edge, shop.half), WEDGE + plate + long * np.tan(theta)


def wedge(face: Face, theta: float, shop: Shop) -> Made:
    """A block on a face, its upper side square to a tube that leaves at theta [rad].

    The face's screws go down through it, their heads sunk below the upper side, ``WEDGE`` - 6 mm above the face.
    """
    theta = theta if theta >= FLAT else 0.0
    long, wide, middle = wedge_size(face, theta, shop)
    h, rise = face.height, long * np.tan(theta)
    held = face.housing is not None and face.holds
    foot = h + shop.plate if held else h
    corners = np.array([[-long, foot], [long, foot], [long, h + middle - rise], [-long, h + middle + rise]])
    u, e = np.array([np.sin(theta), np.cos(theta), 0.0]), np.array([np.cos(theta), -np.sin(theta), 0.0])
    seat = np.array([0.0, h + middle, 0.0])
    clear, _, head = SCREWS[face.circle.thread]
    under = WEDGE - 6e-3
    owns = np.radians(np.arange(0.0, 360.0 / face.circle.count, 7.5))
    turns = [undrilled_turn(face, theta, shop)] if held or face.circle.maker else np.radians(np.arange(0.0, 90.0, 7.5))
    taps_at = [tapped_holes(seat, u, e, turn, shop.tapped, shop) for turn in turns]
    drilled = np.array([[np.linspace(tap.start, tap.end, 5) for tap in taps] for taps in taps_at])[..., [0, 2]]
    bolts = np.array([face.circle.places(own) for own in owns])
    apart = np.linalg.norm(bolts[:, None, :, None, None] - drilled[None, :, None], axis=-1).min(axis=(2, 3, 4))
    best = np.unravel_index(int(np.argmax(np.round(apart, 9))), apart.shape)
    own, taps, turn = owns[best[0]], taps_at[best[1]], turns[best[1]]
    sunk = []
    for x, z in face.circle.places(own):
        top, floor = np.array([x, h + middle - x * np.tan(theta), z]), np.array([x, h + under, z])
        sunk += [Rod(np.array([x, h, z]), floor, clear / 2.0, use="face"),
                 Rod(floor, top, head / 2.0 + 0.25e-3, oblique=theta > 1e-6, use="face")]  # fmt: skip
    sizes = {
        "angle": theta, "length": 2.0 * long, "width": 2.0 * wide, "low side": middle - rise,
        "high side": middle + rise, "under heads": under, "face above middle": h,
        "turn of the tube's circle": float(turn), "tapped depth": shop.tapped,
    }  # fmt: skip
    solids = [Prism(corners, 2.0 * wide)]
    if held or face.circle.maker:
        sunk = []
    else:
        sizes |= {"turn of the face's circle": float(own), "counterbore": 2.0 * sunk[1].radius}
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
    u, e = np.array([s, c, 0.0]), np.array([c, -s, 0.0])

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
    thick, circle = max(shop.plate, WEDGE), face.circle
    heads = circle.diameter / 2.0 * np.cos(np.pi / circle.count) + SCREWS[circle.thread][2] / 2.0
    theta = float(np.clip(theta, *TURNS["standing"]))
    over = 2.0 * shop.half * max(0.0, np.cos(theta)) + thick * np.sin(theta)  # how far its upper end leans over them
    front = float(max(circle.edge, shop.half, heads + INNER + thick / np.sin(theta), heads + KEY + over))
    return float(front - shop.half * np.cos(theta)), float(thick + shop.half * np.sin(theta)), thick, front


def standing(face: Face, theta: float, shop: Shop) -> Made:
    """Two plates, one on a base's plate, one standing on its edge, square to a tube that leaves at theta [rad]."""
    x, y, t, front = standing_size(face, theta, shop)
    back, s, c, h = max(face.circle.edge, shop.half), np.sin(theta), np.cos(theta), face.height
    u, e = np.array([s, c, 0.0]), np.array([c, -s, 0.0])
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
    own = [Seat(mark, away * u, u, np.cos(a) * e + np.sin(a) * np.cross(u, e))
           for u, e, a in zip(normals, edges, turns, strict=True)]  # fmt: skip
    scribes = tuple(line for seat in own
                    for line in scribed(seat.between(shop.circle), seat.point, shop.half, shop.half))  # fmt: skip
    part = shop.part("corner", [Prism(outline, 2.0 * shop.half)], holes, sizes=sizes,
                     circles={"tubes (tapped)": shop.circle}, scribes=scribes)  # fmt: skip
    turn = pose[:3, :3]
    seats = [Seat(mark, turn @ seat.point + point, turn @ seat.along, turn @ seat.across) for seat in own]
    return Placed(part, mark, link, pose), (seats[0], seats[1])
