"""What goes between two planes: a tube with a flange in each end, or a spacer where there is no room for one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.building.brackets import HELD
from armdesign.building.parts import SCREWS, Part, Placed, Prism, Rod, Screws, turn_between
from armdesign.building.shop import GAP, SHORTEST_SPACER, SHORTEST_TUBE, TOOL, Seat, Shop, drilled, frame, scribed
from armdesign.errors import CatalogueError

TOOL_NOTE = "screwed on from the tool's side, before the tool"
SPACER_NOTE = "screwed from inside the bracket that is drilled through, before that goes on its actuator"
FIT = 0.1e-3
"""By how much a spigot's diameter is less than its tube's bore at most [m]; half of it is the least."""
ACROSS = "screw across"
TOGETHER = "hole across: with tube and spigot put together, drilled once through both, so that the screw has no play"
BOTH = "its hole is drilled through both together"
IN_LINE = "scribe lines S of both in line"
ALL_IN_LINE = "lines S of all in line, else it is a quarter turn wrong"
ONE_WAY = "S of tube and flange in line, else it is half a turn wrong"
SCRIBED = 15e-3
"""Length of the scribe lines on tubes, from their ends [m]."""
TOOL_FLANGE = 6e-3
"""Thickness of a tool's own flange, for the length of its screws [m]."""


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

    def pins(self, shop: Shop) -> tuple[Array, Array]:
        """Where the screws across the tube point at either end, shape (3,) each: half way between two of a flange."""
        last = self.second.across if self.second.mark == TOOL else self.second.between(shop.circle)
        return self.first.between(shop.circle), last

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
    hand, (a, b) = second.mark == TOOL, joint.pins(shop)
    length = joint.span - shop.flange - joint.cap(shop)
    deep = min(shop.diameter, float(np.floor(length * 500.0 - 1.0) * 1e-3))
    ends = (
        (flange(deep, shop), frame(u, a, first.point), first),
        (tool_plate(deep, shop) if hand else flange(deep, shop), frame(-u, b, second.point), second),
    )
    turn = turn_between(a, b, u)
    turn = 0.0 if 2.0 * np.pi - turn < 1e-6 else turn
    pose = frame(u, a, first.point + shop.flange * u)
    placed = [Placed(tube(length, deep / 2.0, turn, shop), mark, joint.link, pose)]
    screws = []
    for letter, (part, place, seat) in zip("ab", ends, strict=True):
        own, reach = f"{mark}-{letter}", shop.diameter + 1.6e-3 * float(shop.pin[1:])
        screws.append(Screws(shop.pin, reach, 1, (mark, own), nut=True, note=f"{BOTH}; {ONE_WAY}"))
        held = Screws(shop.circle.thread, shop.flange + shop.bite, shop.circle.count, (own, seat.mark), note=IN_LINE)
        screws.append(tool_screws(own, joint.cap(shop), shop) if seat.mark == TOOL else held)
        placed.insert(2 * (letter == "b"), Placed(part, own, joint.link, place))
    return placed, screws


def tool_screws(mark: str, deep: float, shop: Shop) -> Screws:
    """What holds the tool on what has a mark, whose tapped holes are so deep [m]."""
    circle = shop.tool_circle
    bites = min(deep, 1e-3 * float(circle.thread[1:]))
    note = f"for a tool whose own flange is {1e3 * TOOL_FLANGE:g} mm thick"
    return Screws(circle.thread, TOOL_FLANGE + bites, circle.count, (mark, TOOL), most=TOOL_FLANGE + deep, note=note)


def tube(length: float, from_end: float, turn: float, shop: Shop) -> Part:
    """A tube along z from 0, with a hole across and a scribe line at either end: at the first x, the second turned.

    Its bore is a hole like the others.

    Args:
        length: [m].
        from_end: Of the holes [m].
        turn: From the first line to the second, clockwise seen from the first end, 0 to 2 pi [rad].
        shop: What it is of.
    """
    radius, bore = shop.diameter / 2.0, shop.diameter / 2.0 - shop.wall
    ends = np.zeros(3), np.array([0.0, 0.0, length])
    holes = [Rod(*ends, bore)]
    for z, angle_ in ((from_end, 0.0), (length - from_end, turn)):
        way = np.array([np.cos(angle_), np.sin(angle_), 0.0])
        middle = np.array([0.0, 0.0, z])
        holes += [Rod(middle + side * bore * way, middle + side * radius * way, shop.pin_hole / 2.0, True, ACROSS)
                  for side in (1.0, -1.0)]  # fmt: skip
    sizes = {"diameter": shop.diameter, "wall": shop.wall, "length": length, "hole from end": from_end,
             "hole": shop.pin_hole, "turn of S": turn}  # fmt: skip
    scribes = tuple(radius * np.array([np.cos(angle_), np.sin(angle_), 0.0]) + np.array([[0.0, 0.0, z] for z in along])
                    for angle_, along in ((0.0, (0.0, SCRIBED)), (turn, (length, length - SCRIBED))))  # fmt: skip
    return shop.part("tube", [Rod(*ends, radius)], holes, sizes=sizes, note=TOGETHER, scribes=scribes)


def _spigot(deep: float, thickness: float, shop: Shop) -> tuple[list[Rod], list[Rod], dict[str, float]]:
    """What goes into a tube, from a disc of a thickness on along z, and the bore and hole across it."""
    radius = shop.diameter / 2.0 - shop.wall - FIT / 2.0
    bore = max(radius - 4e-3, radius / 2.0)
    solid = Rod(np.array([0.0, 0.0, thickness]), np.array([0.0, 0.0, thickness + deep]), radius)
    middle, x = np.array([0.0, 0.0, thickness + deep / 2.0]), np.array([1.0, 0.0, 0.0])
    holes = [Rod(np.zeros(3), solid.end, bore)]
    holes += [Rod(middle + side * bore * x, middle + side * radius * x, shop.pin_hole / 2.0, True, ACROSS)
              for side in (1.0, -1.0)]  # fmt: skip
    sizes = {"spigot": 2.0 * radius, "spigot length": deep, "bore": 2.0 * bore, "hole": shop.pin_hole,
             "hole from disc": deep / 2.0}  # fmt: skip
    return [solid], holes, sizes


def _flange_scribes(radius: float, thickness: float, shop: Shop) -> tuple[Array, ...]:
    """Scribe lines along x on a disc: on its side at the tube from there to the rim, and over the rim."""
    ends = (shop.diameter / 2.0, thickness), (radius, thickness), (radius, 0.0)
    points = np.array([[x, 0.0, z] for x, z in ends])
    return points[:2], points[1:]


def flange(deep: float, shop: Shop) -> Part:
    """A disc from z = 0 on with a spigot that goes into a tube, the hole across it between those of the disc.

    Args:
        deep: Length of the spigot [m].
        shop: What it is made for.
    """
    t = shop.flange
    solids, holes, sizes = _spigot(deep, t, shop)
    clear = SCREWS[shop.circle.thread][0]
    holes += drilled(shop.circle.places(np.pi / shop.circle.count), 0.0, t, clear, "bracket")
    scribes = _flange_scribes(shop.half, t, shop)
    sizes = {"diameter": 2.0 * shop.half, "thickness": t, **sizes}
    return shop.part("tube flange", [Rod(np.zeros(3), np.array([0.0, 0.0, t]), shop.half), *solids], holes, sizes=sizes,
                     circles={"bracket": shop.circle}, note=TOGETHER, scribes=scribes)  # fmt: skip


def tool_plate(deep: float, shop: Shop) -> Part:
    """A disc from z = 0, which is at the tool, on, tapped for it, with a spigot that goes into a tube.

    Args:
        deep: Length of the spigot [m].
        shop: What it is made for.
    """
    t, circle = max(shop.flange, 8e-3), shop.tool_circle
    solids, holes, sizes = _spigot(deep, t, shop)
    use = "tool (tapped through, ISO 9409-1)"
    holes += drilled(circle.places(np.pi / circle.count), 0.0, t, SCREWS[circle.thread][1], use)
    sizes = {"diameter": 2.0 * circle.edge, "thickness": t, **sizes}
    disc = Rod(np.zeros(3), np.array([0.0, 0.0, t]), circle.edge)
    return shop.part("tool plate", [disc, *solids], holes, sizes=sizes,
                     circles={use: circle}, note=TOGETHER,
                     scribes=_flange_scribes(circle.edge, t, shop))  # fmt: skip


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
        long = shop.plate + span + shop.bite
        through = None if node is None else drilled_through(node, own, other.across, long, shop)
        if through is None or held is None:
            continue
        pose = frame(joint.first.along, other.across, joint.first.point)
        holes = drilled(circle.places(), 0.0, span, SCREWS[circle.thread][0], "through")
        scribes = _spacer_scribe(pose[:3, :3].T @ other.between(circle), shop.half, span)
        part = shop.part("spacer", [Rod(np.zeros(3), np.array([0.0, 0.0, span]), shop.half)], holes,
                         sizes={"diameter": 2.0 * shop.half, "length": span}, circles={"through": circle},
                         note=SPACER_NOTE, scribes=scribes)  # fmt: skip
        deep = (2.0 * d if blind(held) else shop.plate + GAP) - 0.5e-3
        under = through.part.sizes["under heads"] + span
        screws = Screws(circle.thread, under + shop.bite, circle.count, (own.mark, other.mark),
                        most=under + deep, spacer=joint.mark, note=ALL_IN_LINE)  # fmt: skip
        return [Placed(part, joint.mark, joint.link, pose), through], [screws]
    raise CatalogueError(
        f"between {joint.first.mark} and {joint.second.mark} there are {span * 1e3:.1f} mm, too little for a tube, and "
        "behind neither is room for the screws of a spacer", value=span,
        allowed=f"at least {(2.0 * shop.flange + SHORTEST_TUBE) * 1e3:g} mm",
        fix="Take thinner tubes, smaller actuators, or search with a larger --clearance",
    )  # fmt: skip


def _spacer_scribe(way: Array, radius: float, span: float) -> tuple[Array, ...]:
    """The scribe line along a spacer, in a direction from its axis, shape (3,)."""
    return (radius * way + np.array([[0.0, 0.0, 0.0], [0.0, 0.0, span]]),)


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
        if HELD in part.circles and abs(start[2]) + wide > part.sizes["between cheeks"] / 2.0:
            return None
        holes += [Rod(start, floor, clear / 2.0, use="tube (through)"), Rod(floor, back, wide, use="tube (through)")]
    sizes = dict(part.sizes) | {
        "turn of the tube's circle": float(np.arctan2(f @ np.cross(u, e), f @ e)), "counterbore": 2.0 * wide,
        "under heads": under,
    }  # fmt: skip
    circles = {name: own for name, own in part.circles.items() if name in ("face", HELD)} | {"tube (through)": circle}
    half = np.pi / circle.count  # its line is in line with the other seat's, which looks the other way
    scribes = scribed(np.cos(half) * f - np.sin(half) * np.cross(u, f), middle, shop.half, part.sizes["width"] / 2.0)
    return replace(node, part=replace(part, holes=tuple(holes), sizes=sizes, circles=circles, scribes=scribes))


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
    span, circle, tool, d = joint.span, shop.circle, shop.tool_circle, 1e-3 * float(shop.circle.thread[1:])
    clear, _, head = SCREWS[circle.thread]
    tap, wide, under = SCREWS[tool.thread][1], head / 2.0 + 0.25e-3, span - d - 0.3e-3
    apart = np.linalg.norm(tool.places(tool.turns)[:, :, None] - circle.places(), axis=-1).min(axis=(1, 2))
    turn = float(tool.turns[int(np.argmax(np.round(apart, 9)))])
    if apart.max() < wide + tap / 2.0 + 1e-3:
        raise CatalogueError(
            f"the screws of a spacer at the tool of link {joint.link} meet those of the tool", value=span,
            allowed=f"at least {(shop.flange + joint.cap(shop) + SHORTEST_TUBE) * 1e3:g} mm, for a tube",
            fix="Take thinner tubes, smaller actuators, or search with a larger --clearance",
        )  # fmt: skip
    deep = 2e-3 * float(tool.thread[1:])
    deep = span if span < deep + 3e-3 else deep
    radius, top = max(shop.half, tool.edge), np.array([0.0, 0.0, span])
    holes = drilled(circle.places(), 0.0, under, clear, "through")
    holes += drilled(circle.places(), under, span, 2.0 * wide, "through")
    use = "tool (tapped, ISO 9409-1)"
    holes += drilled(tool.places(turn), span - deep, span, tap, use)
    sizes = {"diameter": 2.0 * radius, "length": span, "counterbore": 2.0 * wide, "under heads": under,
             "tapped depth": deep, "turn of second circle": turn}  # fmt: skip
    half = np.pi / circle.count
    part = shop.part("spacer", [Rod(np.zeros(3), top, radius)], holes, sizes=sizes,
                     circles={"through": circle, use: tool}, note=TOOL_NOTE,
                     scribes=_spacer_scribe(np.array([np.cos(half), np.sin(half), 0.0]), radius, span))  # fmt: skip
    room = (2.0 * d if node is None or blind(node) else shop.plate + GAP) - 0.5e-3
    held = Screws(circle.thread, under + shop.bite, circle.count, (joint.mark, joint.first.mark), most=under + room,
                  note=ALL_IN_LINE)  # fmt: skip
    pose = frame(joint.first.along, joint.first.across, joint.first.point)
    return [Placed(part, joint.mark, joint.link, pose)], [held, tool_screws(joint.mark, deep, shop)]
