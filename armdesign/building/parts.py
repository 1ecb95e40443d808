"""Parts as solids: what each consists of, what it weighs, and where it is in the arm. Nothing here needs a CAD library.

A part's **shape** is a few convex solids that touch and do not overlap, less holes within them that do not meet:
its volume, centre of mass and inertia are sums over them. Lengths in metres, in the part's own frame.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.bodies.inertia import Inertial, combine
from armdesign.kinematics.dh import DHTable

SCREWS: Mapping[str, tuple[float, float, float]] = {
    "M2": (2.4e-3, 1.6e-3, 3.8e-3),
    "M2.5": (2.9e-3, 2.05e-3, 4.5e-3),
    "M3": (3.4e-3, 2.5e-3, 5.5e-3),
    "M4": (4.5e-3, 3.3e-3, 7.0e-3),
    "M5": (5.5e-3, 4.2e-3, 8.5e-3),
    "M6": (6.6e-3, 5.0e-3, 10.0e-3),
    "M8": (9.0e-3, 6.8e-3, 13.0e-3),
}
"""Diameters of the hole for a screw (ISO 273, medium), of the hole to tap, and of its head (ISO 4762) [m]."""
PITCHES = {"M2": 0.4e-3, "M2.5": 0.45e-3, "M3": 0.5e-3, "M4": 0.7e-3, "M5": 0.8e-3, "M6": 1e-3, "M8": 1.25e-3}
"""Of coarse threads (ISO 261) [m]."""
EDGE = 1e-7
"""By how much a point on a surface may be beside it [m]."""


@dataclass(frozen=True)
class BoltCircle:
    """Holes on a circle.

    Attributes:
        diameter: Of the circle [m].
        count: How many holes, evenly spaced.
        thread: Of their screws, one of ``SCREWS``.
        maker: Of which end of which actuator its maker's drawing gives the real one, where the catalogue does not:
            then this one is only what room is left for, at most, and not drilled; "" where it is known.
        known: Of one with a maker: whether its diameter and number are known, but its screws have other threads.
        deep: How deep screws may go into what has its threads, where somebody else makes that [m].
    """

    diameter: float
    count: int
    thread: str
    maker: str = ""
    deep: float = float("inf")
    known: bool = False

    def places(self, turn: float | Array = 0.0) -> Array:
        """Middles of the holes, the first at an angle, or several, from x [rad], shape (..., count, 2) [m]."""
        angles = np.asarray(turn)[..., None] + 2.0 * np.pi * np.arange(self.count) / self.count
        places: Array = self.diameter / 2.0 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        return places

    @property
    def turns(self) -> Array:
        """Angles of its first hole that are tried [rad]."""
        turns: Array = np.radians(np.arange(0.0, 360.0 / self.count, 7.5))
        return turns

    @property
    def edge(self) -> float:
        """Radius of what holds the circle and its screws' heads [m]."""
        return self.diameter / 2.0 + SCREWS[self.thread][2] / 2.0 + 1.5e-3


@dataclass(frozen=True, eq=False)
class Prism:
    """A convex polygon in the x-y plane, drawn out along z, half to either side of its middle.

    Attributes:
        polygon: Its corners, counterclockwise, shape (K, 2) [m].
        width: How wide it is along z [m].
        z: Of its middle [m].
    """

    polygon: Array
    width: float
    z: float = 0.0

    @property
    def ends(self) -> Array:
        """Corners of its lower and of its upper face, shape (2, K, 3) [m]."""
        half = self.width / 2.0
        return np.stack([np.insert(self.polygon, 2, self.z + z, axis=1) for z in (-half, half)])

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Which points, shape (k, 3) [m], are within it or on its surface."""
        edges = np.roll(self.polygon, -1, axis=0) - self.polygon
        off = points[:, None, :2] - self.polygon
        side = (edges[:, 0] * off[..., 1] - edges[:, 1] * off[..., 0]) / np.linalg.norm(edges, axis=1)
        held: NDArray[np.bool_] = (side > -EDGE).all(axis=1) & (np.abs(points[:, 2] - self.z) < self.width / 2.0 + EDGE)
        return held

    def moments(self) -> tuple[float, Array, Array]:
        """Volume, first moments (3,) and second moments (3, 3) about the origin: int dV, int x dV, int x x^T dV."""
        volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
        a = self.polygon[0]
        for b, c in zip(self.polygon[1:-1], self.polygon[2:], strict=True):
            area = 0.5 * float((b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0])
            total, corners = a + b + c, np.stack([a, b, c])
            volume += self.width * area
            first[:2] += self.width * area * total / 3.0
            second[:2, :2] += self.width * area / 12.0 * (corners.T @ corners + np.outer(total, total))
            second[2, 2] += area * self.width**3 / 12.0
        if self.z:
            first[2] = self.z * volume
            second[2, 2] += self.z**2 * volume
            second[2, :2] = second[:2, 2] = self.z * first[:2]
        return volume, first, second


@dataclass(frozen=True, eq=False)
class Rod:
    """A full cylinder; as a hole, what is drilled out.

    Attributes:
        start: Middle of the face it begins at, shape (3,) [m].
        end: Middle of the other, shape (3,) [m].
        radius: [m].
        oblique: Of a hole: whether it leaves through a face that its end lies on, but that is not square to it.
        use: Of a hole: what it is for, as in ``Part.circles``.
    """

    start: Array
    end: Array
    radius: float
    oblique: bool = False
    use: str = ""

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Which points, shape (k, 3) [m], are within it or on its surface."""
        length = np.linalg.norm(self.end - self.start)
        u = (self.end - self.start) / length
        high = (points - self.start) @ u
        away = np.linalg.norm(points - self.start - high[:, None] * u, axis=1)
        held: NDArray[np.bool_] = (high > -EDGE) & (high < length + EDGE) & (away < self.radius + EDGE)
        return held

    def moments(self) -> tuple[float, Array, Array]:
        """Volume, first moments (3,) and second moments (3, 3) about the origin: int dV, int x dV, int x x^T dV."""
        length = float(np.linalg.norm(self.end - self.start))
        u, middle = (self.end - self.start) / length, (self.start + self.end) / 2.0
        volume = np.pi * self.radius**2 * length
        across, along = self.radius**2 / 4.0, length**2 / 12.0
        own = across * (np.eye(3) - np.outer(u, u)) + along * np.outer(u, u)
        return volume, volume * middle, volume * (own + np.outer(middle, middle))


@dataclass(frozen=True, eq=False)
class Part:
    """A kind of part: what it looks like and weighs. Two parts with the same number are alike.

    Attributes:
        kind: ``tube``, ``tube flange``, ``bracket``, ``corner``, ``spacer``, ``base plate``, ``tool plate`` or
            ``actuator``.
        name: What it is called in lists and files, such as ``bracket 3``; parts that are alike share it.
        solids: What it consists of.
        holes: What is taken out of them.
        material: What it is made of.
        density: [kg/m^3]; of an actuator its mass over the volume of its housing.
        sizes: Its dimensions by name [m; rad for angles]: what a drawing shows.
        circles: Its bolt circles by what they hold.
        bought: Whether it is bought as it is.
        note: What a mechanic has to know.
        scribes: Lines scribed on it, start and end, shape (2, 3) each [m]: in line with those of what is put on
            it where that is turned as it has to be.
    """

    kind: str
    name: str
    solids: tuple[Prism | Rod, ...]
    holes: tuple[Rod, ...]
    material: str
    density: float
    sizes: Mapping[str, float] = field(default_factory=dict)
    circles: Mapping[str, BoltCircle] = field(default_factory=dict)
    bought: bool = False
    note: str = ""
    scribes: tuple[Array, ...] = ()

    @property
    def look(self) -> str:
        """What it is drawn as: ``joint``, ``base`` or ``tube``, the materials of an arm's body."""
        return {"actuator": "joint", "base plate": "base"}.get(self.kind, "tube")

    @property
    def line(self) -> Array:
        """The way its first scribe line points, a unit vector, shape (3,)."""
        start, end = self.scribes[0]
        way: Array = (end - start) / np.linalg.norm(end - start)
        return way

    def holds(self, points: Array) -> NDArray[np.bool_]:
        """Which points, shape (k, 3) [m], are within its solids, holes not taken out."""
        held: NDArray[np.bool_] = np.any([form.holds(points) for form in self.solids], axis=0)
        return held

    @property
    def volume(self) -> float:
        """[m^3]."""
        return sum(s.moments()[0] for s in self.solids) - sum(h.moments()[0] for h in self.holes)

    @property
    def mass(self) -> float:
        """[kg]."""
        return self.density * self.volume

    @property
    def inertial(self) -> Inertial:
        """Mass properties in its own frame, its density everywhere the same."""
        volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
        for sign, shapes in ((1.0, self.solids), (-1.0, self.holes)):
            for shape in shapes:
                v, f, s = shape.moments()
                volume, first, second = volume + sign * v, first + sign * f, second + sign * s
        centre = first / volume
        about = second - volume * np.outer(centre, centre)
        inertia = self.density * (np.trace(about) * np.eye(3) - about)
        return Inertial(self.density * volume, centre, inertia)


@dataclass(frozen=True, eq=False)
class Placed:
    """A part in its place.

    Attributes:
        part: Which.
        mark: What is scribed on it, once in an arm: ``J2-L1`` is the bracket on actuator 2 that belongs to link 1,
            ``J2`` the actuator, ``L1-T1`` the first tube of link 1, ``L1-T1-a`` its flange at the base's side.
        link: The link it moves with, 0 for base_link.
        pose: Its frame in the link's frame (of base_link the base's own), shape (4, 4).
    """

    part: Part
    mark: str
    link: int
    pose: Array


@dataclass(frozen=True)
class Screws:
    """Screws that are alike.

    Attributes:
        thread: Their thread; "" where only the maker of what they go into knows it.
        length: Least length under the head [m]; without a thread what is between heads and that.
        count: How many; 0 without a thread.
        joins: The marks of what they join, that with the heads first where they go through a spacer.
        nut: Whether each takes a nut: they go right through.
        most: Largest length under the head; longer ones have to be shortened [m].
        spacer: Mark of the spacer that they go through, "" for none.
        maker: Without a thread: what they go into, whose maker's drawing gives thread, number and greatest depth.
        note: What to look after when they go in.
    """

    thread: str
    length: float
    count: int
    joins: tuple[str, str]
    nut: bool = False
    most: float = float("inf")
    spacer: str = ""
    maker: str = ""
    note: str = ""


@dataclass(frozen=True, eq=False)
class Assembly:
    """All parts of an arm.

    Attributes:
        placed: The parts in their places, from the base to the tool.
        screws: What joins them, in the same order.
        apart: Numbers of the joints whose brackets keep to their own side of its middle.
    """

    placed: tuple[Placed, ...]
    screws: tuple[Screws, ...]
    apart: tuple[int, ...] = ()

    def counted(self) -> dict[str, tuple[Part, list[Placed]]]:
        """Every kind of part by its name, with its places."""
        kinds: dict[str, tuple[Part, list[Placed]]] = {}
        for each in self.placed:
            kinds.setdefault(each.part.name, (each.part, []))[1].append(each)
        return kinds

    def inertials(self, dof: int) -> tuple[tuple[float, ...], ...]:
        """Mass properties of base_link, link_1, ..., link_n as ``body.inertials`` has them."""
        links = [combine([p.part.inertial.moved(p.pose) for p in self.of_link(link)]) for link in range(dof + 1)]
        return tuple(link.entries for link in links)

    def posed(self, table: DHTable, q: Array) -> list[tuple[Placed, Array]]:
        """Every part with its pose in the base's frame, shape (4, 4), at an arm's joints q, shape (n,) [rad]."""
        frames = [np.eye(4), *table.frames(q)]
        return [(each, frames[each.link] @ each.pose) for each in self.placed]

    def of_link(self, link: int) -> Sequence[Placed]:
        """The parts that move with a link."""
        return [each for each in self.placed if each.link == link]


def turn_between(first: Array, last: Array, axis: Array) -> float:
    """From one direction to another about an axis, counterclockwise where it is looked against, 0 to 2 pi [rad]."""
    return float(np.arctan2(np.cross(first, last) @ axis, first @ last)) % (2.0 * np.pi)


def file_name(name: str) -> str:
    """A part's name as that of a file."""
    return re.sub(r"[^a-z0-9.]+", "_", name.lower()).strip("_")
