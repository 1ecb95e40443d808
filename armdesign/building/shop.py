"""What an arm's parts are made for: tubes and materials, the faces they are bolted on, and frames to put them in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.building.catalogue import Actuator
from armdesign.building.parts import SCREWS, BoltCircle, Part, Prism, Rod
from armdesign.building.tubes import Tube
from armdesign.settings.sections import Body

GAP = 3e-3
"""Between a bracket and a housing that turns beside it [m]."""
SHORTEST_SPACER, SHORTEST_TUBE, WEDGE = 10e-3, 24e-3, 10e-3
"""Least lengths of spacers and tubes, and least thickness of wedges: what their screws take [m]."""
ALUMINIUM, PRINTED = ("aluminium", 2700.0), ("PETG, printed solid", 1270.0)
"""What parts are made of, and its density [kg/m^3]."""
CHEEK, CHEEK_EDGE, CHEEK_PLAY = 3e-3, 4e-3, 0.1e-3
"""Of the cheeks beside a box: thickness, what is left about their holes' middles, and their play beside it [m]."""
FLOOR, TOOL = "floor", "tool"
"""In place of a mark: what the base's plate is screwed to, and what the tool plate holds."""
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

    @property
    def web(self) -> float:
        """Least material that is left beside tapped holes [m]."""
        return 1.5e-3 if self.made == ALUMINIUM else 2e-3

    @property
    def bite(self) -> float:
        """How far screws go into tapped holes at least, one and a half times their diameter [m]."""
        return 1.5e-3 * float(self.circle.thread[1:])

    @property
    def pin(self) -> str:
        """Thread of the screws across tubes and spigots."""
        return "M4" if self.diameter > 25e-3 else "M3"

    @property
    def pin_hole(self) -> float:
        """Diameter of their holes, as large as the screws: one with play would let the tube turn [m]."""
        return 1e-3 * float(self.pin[1:])

    @property
    def tool_circle(self) -> BoltCircle:
        """The smallest of ``TOOL_CIRCLES`` outside the tube."""
        fitting = (c for c in TOOL_CIRCLES if c.diameter > self.diameter + SCREWS[c.thread][1] + 2e-3)
        return next(fitting, BoltCircle(self.diameter + 20e-3, 6, "M8"))

    def part(self, kind: str, solids: Sequence[Prism | Rod], holes: Sequence[Rod], **rest: object) -> Part:
        """A part of a kind that is made, with other attributes of ``Part``; its name is given when all are known."""
        material, density = self.tube if kind == "tube" else self.made
        return Part(kind, kind, tuple(solids), tuple(holes), material, density, **rest)  # type: ignore[arg-type]


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


class Housing(NamedTuple):
    """A housing that is a box, in the frame of the bracket that holds it: y its face's normal, its long end towards -x.

    The bracket lies on its back and has a cheek on either side, which screws go through into its sides.

    Attributes:
        near: From the axis to its near end [m].
        far: To its far end [m].
        half: Half of its width along z [m].
        front: Height of the face that its output is on, above the middle [m].
        holes: Of either side, x and y, shape (k, 2) [m]; none where they are not known, and it has no cheeks.
        thread: Of the holes.
        depth: Theirs [m].
        back: Holes in its back that are known but not drilled for, x and z, shape (k, 2) [m].
    """

    near: float
    far: float
    half: float
    front: float
    holes: Array
    thread: str = ""
    depth: float = 0.0
    back: Array = np.empty((0, 2))

    def pad(self, shop: Shop) -> tuple[float, float]:
        """How far what lies on its back reaches towards its far end, and half of its width [m]."""
        if not len(self.holes):
            return self.far, max(self.half, shop.half)
        return float(-self.holes[:, 0].min()) + CHEEK_EDGE, max(self.half + CHEEK_PLAY + CHEEK, shop.half)


def housing_of(actuator: Actuator) -> Housing | None:
    """The box of an actuator; None where it counts as round."""
    if actuator.box is None:
        return None
    near, far, width = actuator.box
    front, sides = actuator.horn - actuator.length / 2.0, actuator.side_holes
    if not sides:
        behind = actuator.back_holes
        back = [[-x, side * behind["beside"]] for x in behind.get("across", ()) for side in (1.0, -1.0)]
        return Housing(near, far, width / 2.0, front, np.empty((0, 2)), back=np.reshape(back, (-1, 2)))
    holes = np.array([[-x, front + y] for y in sides["along"] for x in sides["across"]])
    return Housing(near, far, width / 2.0, front, holes, sides["thread"], sides["depth"])


class Face(NamedTuple):
    """What a bracket can be bolted on, in a link's frame.

    Attributes:
        mark: Of what has the face.
        middle: Of the body behind it, m_j, shape (3,) [m].
        normal: Its own, shape (3,).
        height: Of the face above the middle [m].
        radius: Of the body behind it, which turns against the bracket, or to which the bracket is fixed [m].
        circle: Its holes.
        aside: Whether brackets on it keep to their side of the middle.
        housing: The body behind it where that is a box; None for a round one.
        holds: Whether the bracket holds the box, which it then moves with.
        edge: Of what is bolted on the opposite face of a box that the bracket holds: how far that reaches [m].
    """

    mark: str
    middle: Array
    normal: Array
    height: float
    radius: float
    circle: BoltCircle
    aside: bool = False
    housing: Housing | None = None
    holds: bool = False
    edge: float = 0.0

    @property
    def held(self) -> Housing | None:
        """The box that the bracket holds."""
        return self.housing if self.holds else None

    @property
    def back(self) -> Array:
        """Holes behind it that are known but not drilled for, x and z, shape (k, 2) [m]."""
        return np.empty((0, 2)) if self.held is None else self.held.back

    def pad(self, shop: Shop) -> tuple[float, float]:
        """How far what lies on it reaches backwards, and half of its width [m]."""
        if self.held is not None:
            return self.held.pad(shop)
        return self.circle.edge, max(self.circle.edge, shop.half)

    def across(self, shop: Shop) -> float:
        """Radius of what turns at the other end of the body behind it [m]."""
        if self.housing is None:
            return float(np.hypot(*self.pad(shop)))
        sides = (self.edge, max(self.edge, shop.half)) if self.holds else self.housing.pad(shop)
        return float(np.hypot(*sides))


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

    def between(self, circle: BoltCircle) -> Array:
        """From the middle to half way between its first two holes: to scribe lines and screws across, shape (3,)."""
        half = np.pi / circle.count
        way: Array = np.cos(half) * self.across + np.sin(half) * np.cross(self.along, self.across)
        return way


def generic_circle(diameter: float, maker: str = "its maker") -> BoltCircle:
    """The circle that room is left for where an actuator's own is not known, half as large as its housing [m]."""
    threads = ((0.03, "M2"), (0.045, "M2.5"), (0.07, "M3"), (0.11, "M4"))
    thread = next((name for most, name in threads if diameter < most), "M5")
    return BoltCircle(float(np.round(diameter / 2.0, 3)), 4 if diameter < 0.11 else 6, thread, maker)


def circle_of(actuator: Actuator, end: str) -> BoltCircle:
    """The bolt circle at an end of an actuator, one of ``CIRCLES``; one to leave room for where it is not known."""
    known = actuator.circles.get(end)
    if known is not None:
        deep = actuator.output_depth if end == "output" else None
        return BoltCircle(*known, deep=float("inf") if deep is None else deep)
    wide = actuator.diameter if actuator.box is None else actuator.box[2]
    circle = generic_circle(wide, f"{end} of {actuator.name}")
    if end == "output":
        room = actuator.output_room
        return circle if room is None else replace(circle, diameter=room, count=4, known=True)
    return replace(circle, thread=actuator.back_holes.get("thread", circle.thread))


def envelope(actuator: Actuator, shop: Shop) -> tuple[float, float]:
    """Diameter and length of an actuator with its brackets and half of the shortest spacer [m]."""
    more = shop.plate + 5e-3
    return actuator.diameter + 2.0 * (GAP + more), actuator.length + 2.0 * more


def unit(vector: Array) -> Array:
    """A vector of length 1."""
    unit: Array = vector / np.linalg.norm(vector)
    return unit


def drilled(places: Array, low: float, high: float, diameter: float, use: str) -> list[Rod]:
    """Holes along z from ``low`` to ``high``, of a diameter, about places, shape (k, 2) [m]."""
    return [Rod(np.array([x, y, low]), np.array([x, y, high]), diameter / 2.0, use=use) for x, y in places]


def scribed(way: Array, point: Array, half: float, wide: float = 0.0) -> tuple[Array, ...]:
    """A scribe line at the rim of a flange, or of what it is screwed to, where that reaches beyond it.

    Args:
        way: From its middle to there, a unit vector, shape (3,).
        point: Its middle, shape (3,) [m].
        half: Radius of its rim [m].
        wide: Of what it is screwed to: half the width along z [m].
    """
    beyond = wide / abs(way[2]) - half if abs(way[2]) > 0.5 else 0.0
    return (np.stack([point + (half - 4e-3) * way, point + (half + float(np.clip(beyond, 0.0, 4e-3))) * way]),)


def frame(z: Array, near: Array, point: Array | None = None) -> Array:
    """A frame with a given z and its x as near to a direction as can be, shape (4, 4).

    Args:
        z: Its z, a unit vector, shape (3,).
        near: The direction, shape (3,).
        point: Its origin, shape (3,) [m]; None for that of the frame it is in.
    """
    x = near - (near @ z) * z
    if np.linalg.norm(x) < 1e-6:
        x = np.array([0.0, 1.0, 0.0]) - z[1] * z
    found = np.eye(4)
    found[:3, 0], found[:3, 2] = unit(x), z
    found[:3, 1] = np.cross(z, found[:3, 0])
    found[:3, 3] = 0.0 if point is None else point
    return found
