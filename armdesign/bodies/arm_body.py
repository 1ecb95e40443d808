"""The body of an arm: which solid belongs to which link, and which of them have to stay clear of one another.

The one geometry of the project: the search's capsules contain these cylinders, the exact check measures them, robot
files, preview and report show them.

**Points.** Row i = j - 1 of the DH table leads to joint j. C_j is the corner behind its a piece, O_j = C_j + d z_j the
origin of the joint's frame; both lie on the joint's axis z_j. The joint's module, a cylinder about z_j with its motor
and gear, has its centre at

    m_j = C_j + s_j z_j,    s_j in [min(0, d) - module_slide, max(0, d) + module_slide],

the slide s_j chosen once per design; s_j = d, so m_j = O_j, where none is given. A prismatic joint's carriage is always
at O_j, which slides.

**Links.** The module of joint j belongs to link j, the child. Link j is a polyline of straight tubes

    m_j, O_j, C_{j+1}, m_{j+1},

link 0 starts at the base's origin, B, C_1, m_1, and link n ends at the tool, m_n, O_n, C_{n+1}, tool0. O_j is left out
where the module sits beyond it (s_j beyond d, seen from 0), C_{j+1} where the next module sits on the other side of it
(s_{j+1} beyond 0, seen from d); with d = 0 the direction from 0 to d counts as that of z. Instead of the last piece,
the link before a prismatic joint has a **rail** along z_j, over [min(0, d + lower), max(0, d + upper)] from C_j. Pieces
shorter than ``SHORTEST`` are left out.

**Base.** A placed arm's plate fills z in [0, base_height] of the base frame, whose origin is on the mounting face. An
arm that hangs at a point of the recording has its plate ``Body.reach`` away on one of six sides, with a post from the
plate to the origin, or, where no side is given, neither.

**Pairs that have to stay clear of each other**, and nothing else:

* two modules, whichever: also those of neighbouring joints, which one link ties to each other;
* a module and what belongs to neither link j - 1 nor link j: it is round about its axis, so it stands still in both;
* parts of links that differ by two or more, whole;
* parts of neighbours j - 1 and j, their tubes cut off inside the sphere about m_j of radius ``Body.reach_about``; a
  rail's own link is not cut, since the sphere slides along it.

Tubes of one link never. Cut is so that the whole solid that remains is outside the sphere, ``Cylinder.outside``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.bodies.cylinder import SHORTEST, Cylinder, along
from armdesign.bodies.inertia import Inertial, combine
from armdesign.errors import DesignError, SettingsError
from armdesign.kinematics.dh import DHTable, rot_x, translation
from armdesign.kinematics.models import default_limits
from armdesign.settings.sections import Body, Module

SIDES = ("below", "above", "behind", "left", "right", "front")
"""Sides of the base that a plate may stand on: -z, +z, -x, +y, -y, +x."""
TURNS = {
    "below": np.eye(4),
    "above": np.diag([1.0, -1, -1, 1]),
    "behind": np.array([[0.0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]]),
    "left": np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
    "right": np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]),
    "front": np.array([[0.0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]]),
}
"""The turns that bring -z of the base to the side its plate stands on, shape (4, 4) each."""
WHOLE = 0
"""In place of a joint: no joint's sphere cuts these."""


class Part(NamedTuple):
    """A solid of an arm.

    Attributes:
        name: What to call it, such as ``tube of link_1``.
        link: The link it belongs to: 0 is base_link, i is link_i, in whose frame it is given.
        solid: The cylinder.
        module: Number of the joint whose module it is, 1..n; 0 for all else.
        fixed: Whether it is one piece that no joint's sphere cuts: a module, a plate or a rail.
    """

    name: str
    link: int
    solid: Cylinder
    module: int = 0
    fixed: bool = False


@dataclass(frozen=True)
class LinkBody:
    """The solids of one link in the link's frame.

    Attributes:
        visual: Every solid, at full length.
        collision: The same, the tubes cut back at the spheres about both the link's joints, so that neighbours do not
            touch where they meet. Never empty.
        known: Mass properties where they are those of other parts, as of a build; None for those of its solids.
    """

    visual: tuple[Cylinder, ...]
    collision: tuple[Cylinder, ...]
    known: Inertial | None = None

    @property
    def inertial(self) -> Inertial:
        """Mass properties of all its solids together, or those that are known."""
        return self.known or combine([part.inertial for part in self.visual])


@dataclass(frozen=True, eq=False)
class ArmBody:
    """The body of an arm, made by ``arm_body``.

    Attributes:
        table: The arm, n joints.
        options: What it is built of.
        slides: s_j of every joint, shape (n,) [m].
        limits: Joint limits, shape (n, 2) [rad; m of joints that slide]; they say how long rails are.
        parts: Every solid at full length; of link 0 first, then of link 1, and so on.
    """

    table: DHTable
    options: Body
    slides: Array
    limits: Array
    parts: tuple[Part, ...]

    @property
    def shapes(self) -> tuple[Part, ...]:
        """The parts, then pieces of tubes cut off at a joint's sphere; what ``pairs`` counts in."""
        return self._shapes_and_pairs[0]

    @property
    def pairs(self) -> NDArray[np.int64]:
        """Which shapes have to stay clear of which, shape (K, 2)."""
        return self._shapes_and_pairs[1]

    @property
    def moving_mass(self) -> float:
        """Mass of what moves, from link 1 on [kg]."""
        return float(sum(link.inertial.mass for link in self.links[1:]))

    @property
    def links(self) -> tuple[LinkBody, ...]:
        """The bodies of base_link, link_1, ..., link_n; that of link_i is given in the frame of joint_i."""
        bodies, known = [], self.options.inertials or (None,) * (self.table.dof + 1)
        for link, entries in enumerate(known):
            own = [part for part in self.parts if part.link == link]
            cut = [piece for part in own for piece in self._collision(part)]
            bodies.append(LinkBody(tuple(part.solid for part in own), tuple(cut or [part.solid for part in own[:1]]),
                                   None if entries is None else Inertial.of_entries(entries)))  # fmt: skip
        return tuple(bodies)

    def sphere(self, joint: int, link: int) -> Array:
        """Centre of the sphere about the module of a joint, whose radius is ``reaches``.

        Args:
            joint: Number of the joint, 1..n.
            link: The link in whose frame: ``joint`` or ``joint - 1``; of a prismatic joint the latter only at q = 0.

        Returns:
            Shape (3,) [m].
        """
        if link == joint:
            return np.array([0.0, 0.0, self.slides[joint - 1] - self.table.d[joint - 1]])
        corner = _corner(self.table, joint - 1)
        centre: Array = corner[:3, 3] + self.slides[joint - 1] * corner[:3, 2]
        return centre

    @cached_property
    def reaches(self) -> tuple[float, ...]:
        """Radii of the spheres about the modules of all joints, n of them [m]."""
        return tuple(self.options.reach_about(module) for module in self.options.modules_of(self.table.dof))

    @cached_property
    def _shapes_and_pairs(self) -> tuple[tuple[Part, ...], NDArray[np.int64]]:
        """Shapes and pairs, made together, because the pairs say which cut pieces there are."""
        shapes, pairs = list(self.parts), []
        cut: dict[tuple[int, int], list[int]] = {}

        def pieces(index: int, joint: int) -> list[int]:
            """The shapes that are left of a part beyond a joint's sphere."""
            part = self.parts[index]
            if part.fixed or (part.link < joint and self.table.prismatic[joint - 1]):
                return [index]
            if (index, joint) not in cut:
                rest = part.solid.outside(self.sphere(joint, part.link), self.reaches[joint - 1])
                whole = len(rest) == 1 and rest[0] is part.solid
                cut[index, joint] = [index] if whole else list(range(len(shapes), len(shapes) + len(rest)))
                shapes.extend([] if whole else [part._replace(solid=solid) for solid in rest])
            return cut[index, joint]

        for i, first in enumerate(self.parts):
            for j, second in enumerate(self.parts[i + 1 :], start=i + 1):
                joint = _meeting(first, second)
                if joint == WHOLE:
                    pairs.append((i, j))
                elif joint is not None:
                    pairs += [(k, m) for k in pieces(i, joint) for m in pieces(j, joint)]
        return tuple(shapes), np.array(pairs, dtype=np.int64).reshape(-1, 2)

    def _collision(self, part: Part) -> list[Cylinder]:
        """A part cut back at the spheres about both joints of its link."""
        pieces = [part.solid]
        for joint in (part.link, part.link + 1):
            own = joint == part.link  # along the next joint's axis, where that slides, its sphere does
            if not part.fixed and 1 <= joint <= self.table.dof and (own or not self.table.prismatic[joint - 1]):
                centre = self.sphere(joint, part.link)
                pieces = [rest for piece in pieces for rest in piece.outside(centre, self.reaches[joint - 1])]
        return pieces


def arm_body(
    table: DHTable,
    options: Body,
    slides: ArrayLike | None = None,
    limits: ArrayLike | None = None,
    *,
    placed: bool = False,
    side: str | None = "below",
) -> ArmBody:
    """The body of an arm.

    Args:
        table: The arm, n joints.
        options: What it is built of.
        slides: Where the module of every joint sits on its axis, s_j from C_j on, shape (n,) [m]; by default d_j,
            and always that of a joint that slides.
        limits: Joint limits, shape (n, 2) [rad; m of joints that slide], for the rails; +-1 m by default.
        placed: Whether the base stands on a mounting face at z = 0 of its frame.
        side: Of an arm that is not placed, the side its plate stands on, one of ``SIDES``; None for no plate.

    Raises:
        DesignError: The slides do not fit the arm.
        SettingsError: The body has modules for another number of joints.
    """
    s = np.array(table.d[:-1] if slides is None else slides, dtype=float)
    if s.shape != (table.dof,) or not np.isfinite(s).all():
        raise DesignError("the slides of the joint modules are not finite numbers", value=s, allowed=f"({table.dof},)")
    s[np.array(table.prismatic)] = table.d[:-1][np.array(table.prismatic)]
    s.setflags(write=False)
    if options.inertials is not None and len(options.inertials) != table.dof + 1:
        raise SettingsError(
            f"setting 'body.inertials' has {len(options.inertials)} links for {table.dof + 1}",
            value=len(options.inertials), allowed=table.dof + 1, fix="Leave body.inertials out",
        )  # fmt: skip
    ends = default_limits(table.prismatic) if limits is None else np.asarray(limits, dtype=float)
    if ends.shape != (table.dof, 2):
        raise DesignError(f"joint limits have shape {ends.shape}", allowed=f"({table.dof}, 2)")
    modules, parts = options.modules_of(table.dof), [*_base(options, placed=placed, side=side)]
    for link in range(table.dof + 1):
        if link:
            parts.append(_module(link, float(s[link - 1] - table.d[link - 1]), modules[link - 1]))
        corners = polyline(table, link, s)
        parts += [
            Part(f"tube of {link_name(link)}", link, tube(start, end, options))
            for start, end in pairwise(corners)
            if np.linalg.norm(end - start) >= SHORTEST
        ]
        if link < table.dof and table.prismatic[link]:
            corner, way = _corner(table, link), np.sort(np.r_[0.0, table.d[link] + ends[link]])[[0, -1]]
            start, end = corner[:3, 3] + way[:, None] * corner[:3, 2]
            rail = tube(start, end, options)
            parts.append(Part(f"rail of joint_{link + 1}", link, rail, fixed=True))
    return ArmBody(table, options, s, ends, tuple(parts))


def link_name(i: int) -> str:
    """Name of a link: 0 is base_link, i is link_i."""
    return "base_link" if i == 0 else f"link_{i}"


def tool_inertial(options: Body) -> Inertial:
    """Mass properties of tool0."""
    return Inertial(options.tool_mass, np.zeros(3), options.tool_inertia * np.eye(3))


def tube(start: Array, end: Array, options: Body) -> Cylinder:
    """A tube between two points of a link's frame, shape (3,) each [m], not the same."""
    radius, length = options.tube_diameter / 2.0, float(np.linalg.norm(end - start))
    inner = max(radius - options.tube_wall, 0.0)
    mass = options.tube_density * np.pi * (radius**2 - inner**2) * length
    return Cylinder(along(start, end), radius, length, mass, "tube", inner)


def _base(options: Body, *, placed: bool, side: str | None) -> Iterator[Part]:
    """Plate and post."""
    radius, height = options.base_diameter / 2.0, options.base_height
    if not placed and side is None:
        return
    turn = np.eye(4) if placed else TURNS[str(side)]
    centre = height / 2.0 if placed else -options.reach - height / 2.0
    plate = Cylinder(turn @ translation(0.0, 0.0, centre), radius, height, options.base_mass, "base")
    yield Part("base plate", 0, plate, fixed=True)
    if not placed:
        yield Part("post of base_link", 0, tube(np.zeros(3), -options.reach * turn[:3, 2], options))


def _module(joint: int, height: float, module: Module) -> Part:
    """The module of a joint, ``height`` above the origin of the joint's frame along its axis [m]."""
    solid = Cylinder(translation(0.0, 0.0, height), module.diameter / 2.0, module.length, module.mass, "joint")
    return Part(f"module of joint_{joint}", joint, solid, module=joint, fixed=True)


def _corner(table: DHTable, row: int) -> Array:
    """The frame behind the a piece of a row, its z axis that of the joint, in the frame of the link it belongs to."""
    start = table.base() if row == 0 else np.eye(4)
    return start @ translation(table.a[row], 0.0, 0.0) @ rot_x(table.alpha[row])


def polyline(table: DHTable, link: int, s: Array) -> list[Array]:
    """Corners of the tubes of a link in its frame, from its own module to the next or to the tool."""
    corners = [np.zeros(3)]
    if link:
        lifted, onward = s[link - 1] - table.d[link - 1], _direction(table.d[link - 1])
        origin = [] if lifted * onward > 0.0 else corners
        corners = [np.array([0.0, 0.0, lifted]), *origin]
    corner = _corner(table, link)
    last = link == table.dof
    if not last and table.prismatic[link]:
        return [*corners, corner[:3, 3]]
    ahead = float(table.d[link] if last else s[link])
    if last or ahead * _direction(table.d[link]) >= 0.0:
        corners.append(corner[:3, 3])
    corners.append(corner[:3, 3] + ahead * corner[:3, 2])
    return corners


def _direction(d: float) -> float:
    """Which way a row's d piece runs along z: 1 or -1; 1 where it has no length."""
    return -1.0 if d < 0.0 else 1.0


def _meeting(first: Part, second: Part) -> int | None:
    """How two parts, the second of the same link or a later one, count as a pair.

    Returns:
        The joint whose sphere cuts them, ``WHOLE`` for none, or None where they do not count.
    """
    if first.module and second.module:
        return WHOLE
    for module, other in ((first, second), (second, first)):
        if module.module:
            return None if other.link in (module.module - 1, module.module) else WHOLE
    apart = second.link - first.link
    if apart == 0:
        return None
    return second.link if apart == 1 else WHOLE
