"""Mass properties of the arm's solids, and which solid belongs to which link.

The body follows the arm skeleton. Row i of the DH table is a tube from the origin of its frame along x by a_i, then
along the next joint's axis by d_i. Neither piece moves with that joint, so both belong to the link before it: row 0 to
base_link, row i to link_i, the tool row to link_n. On top of the tubes

* link_i carries the housing of joint_i, a solid cylinder about the joint's axis: the **child** link owns it;
* base_link carries a plate, ``reach`` beneath its origin (or on another side of it, where an arm on a wall or a
  ceiling needs it), and a post from the plate to the origin.

Collision shapes are the same cylinders, made so that neighbouring links do not touch where they meet: a tube ends at
the sphere of radius ``reach`` about the next joint, and of joints closer together than two such spheres only the last
keeps its housing. Links that fold back onto each other still collide, as they would in metal, unless a ``BodyFit``
makes room for the motion in question.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.errors import DesignError
from armdesign.kinematics.dh import DHTable, rot_x, translation
from armdesign.settings import Body

__all__ = [
    "SHORTEST",
    "BodyFit",
    "Cylinder",
    "Inertial",
    "LinkBody",
    "combine",
    "link_bodies",
    "tool_inertial",
]

SHORTEST = 1e-6
"""Pieces shorter than this are left out [m]; a cylinder of no length is refused by most readers."""
Z_TO_X = np.array([[0.0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])
"""A quarter turn about y, which lays a cylinder along x, shape (4, 4)."""
TURNS = {
    "below": np.eye(4),
    "above": np.diag([1.0, -1, -1, 1]),
    "behind": np.array([[0.0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]]),
    "left": np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]),
    "right": np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]),
    "front": np.array([[0.0, 0, -1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]]),
}
"""The turns that bring -z of the base to the side its plate stands on, shape (4, 4) each."""


@dataclass(frozen=True)
class Inertial:
    """Mass, centre of mass and inertia of a rigid body.

    Attributes:
        mass: Mass [kg].
        com: Centre of mass in the body's frame, shape (3,) [m].
        inertia: Inertia about the centre of mass along the frame's axes, shape (3, 3) [kg m^2].
    """

    mass: float
    com: Array
    inertia: Array

    def __post_init__(self) -> None:
        """Normalise to read-only arrays and check that such a body can exist.

        Raises:
            DesignError: The mass is not positive, or the inertia is not symmetric, not positive definite, or one of its
                principal moments exceeds the sum of the other two.
        """
        for name, shape in (("com", (3,)), ("inertia", (3, 3))):
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape or not np.isfinite(array).all():
                raise DesignError(f"{name} is not a finite array", value=array, allowed=f"shape {shape}")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if not (np.isfinite(self.mass) and self.mass > 0.0):
            raise DesignError(f"a body's mass is {self.mass!r} kg", value=self.mass, allowed="> 0")
        moments = np.linalg.eigvalsh(self.inertia)
        lopsided = np.abs(self.inertia - self.inertia.T).max() > 1e-9 * np.abs(self.inertia).max()
        if lopsided or moments[0] <= 0.0 or moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-9):
            raise DesignError(
                f"no solid has this inertia, principal moments {moments.tolist()} kg m^2",
                value=self.inertia,
                allowed="symmetric, positive definite, no moment above the sum of the other two",
            )

    def moved(self, pose: Array) -> Inertial:
        """The same body seen from a frame in which its own frame stands at ``pose``, shape (4, 4)."""
        turn = pose[:3, :3]
        inertia = turn @ self.inertia @ turn.T
        return Inertial(self.mass, turn @ self.com + pose[:3, 3], (inertia + inertia.T) / 2.0)


def combine(parts: Sequence[Inertial]) -> Inertial:
    """The body made of several parts given in one frame, by the parallel-axis rule about their common centre of mass.

    m = sum m_k, c = sum m_k c_k / m, I = sum I_k + m_k (|r_k|^2 1 - r_k r_k^T) with r_k = c_k - c.

    Args:
        parts: At least one body.

    Raises:
        DesignError: There is no part.
    """
    if not parts:
        raise DesignError("a body needs at least one part")
    mass = sum(part.mass for part in parts)
    com = sum((part.mass * part.com for part in parts), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for part in parts:
        r = part.com - com
        inertia += part.inertia + part.mass * (r @ r * np.eye(3) - np.outer(r, r))
    return Inertial(mass, com, inertia)


@dataclass(frozen=True)
class Cylinder:
    """A cylinder about the z axis of its own frame, which stands at its centre; hollow where an inner radius is given.

    Attributes:
        pose: Its frame in the link's frame, shape (4, 4).
        radius: Outer radius [m].
        length: Length along z [m].
        mass: Mass [kg].
        material: Name of the material it is drawn in.
        inner_radius: Radius of the bore [m].
    """

    pose: Array
    radius: float
    length: float
    mass: float
    material: str
    inner_radius: float = 0.0

    @property
    def inertial(self) -> Inertial:
        """Mass properties in the link's frame: I_zz = m (R^2 + r^2) / 2, I_xx = I_yy = m (3 (R^2 + r^2) + l^2) / 12."""
        squares = self.radius**2 + self.inner_radius**2
        across = self.mass * (3.0 * squares + self.length**2) / 12.0
        own = np.diag([across, across, self.mass * squares / 2.0])
        return Inertial(self.mass, np.zeros(3), own).moved(self.pose)


@dataclass(frozen=True)
class BodyFit:
    """How the body makes room for a motion, see ``armdesign.export.fit``.

    Attributes:
        side: Where the base plate stands, seen from the base; one of ``armdesign.export.options.SIDES``.
        plate: Whether the plate collides.
        spheres: Radii of the spheres about joint_1, ..., joint_n that the link before stays out of, shape (n,) [m];
            empty: all of them ``Body.reach``.
    """

    side: str = "below"
    plate: bool = True
    spheres: tuple[float, ...] = ()


@dataclass(frozen=True)
class LinkBody:
    """The solids of one link in the link's frame.

    Attributes:
        visual: Every solid, at full length.
        collision: What may touch other links, cut back at the joints.
    """

    visual: tuple[Cylinder, ...]
    collision: tuple[Cylinder, ...]

    @property
    def inertial(self) -> Inertial:
        """Mass properties of all its solids together."""
        return combine([part.inertial for part in self.visual])


def link_bodies(table: DHTable, options: Body, fit: BodyFit | None = None) -> tuple[LinkBody, ...]:
    """The bodies of base_link, link_1, ..., link_n.

    Args:
        table: The arm.
        options: What it is built of.
        fit: The room it makes for a motion; by default none in particular.

    Returns:
        n + 1 bodies; that of link_i is given in the frame of joint_i, which turns with it.
    """
    made = fit or BodyFit()
    spheres = made.spheres or (options.reach,) * table.dof
    kept = _housings_that_collide(table, options.reach, spheres)
    housing = _housing(options)
    bodies = [_base(table, options, made, spheres[0])]
    for i in range(1, table.dof + 1):
        cut = spheres[i] if i < table.dof else 0.0
        touching = (housing,) if kept[i - 1] else ()
        bodies.append(
            LinkBody((housing, *_row_tubes(table, i, options)), (*touching, *_row_tubes(table, i, options, cut)))
        )
    return tuple(bodies)


def tool_inertial(options: Body) -> Inertial:
    """Mass properties of tool0."""
    return Inertial(options.tool_mass, np.zeros(3), options.tool_inertia * np.eye(3))


def _base(table: DHTable, options: Body, fit: BodyFit, cut: float) -> LinkBody:
    """Plate, post and the tubes of row 0; the post stays inside the first joint's sphere and so never collides.

    The plate does not collide either where that sphere reaches it, which takes a first joint placed on its side.
    """
    reach, height, radius = options.reach, options.base_height, options.base_diameter / 2.0
    turn = TURNS[fit.side]
    plate = Cylinder(turn @ translation(0.0, 0.0, -reach - height / 2.0), radius, height, options.base_mass, "base")
    post = _tube(turn, -reach, options)
    x, y, z = turn[:3, :3].T @ table.placements()[0][:3, 3]
    clear = z >= -SHORTEST or z <= -2.0 * reach - height or np.hypot(x, y) >= radius + reach
    visual = (plate, *post, *_row_tubes(table, 0, options))
    return LinkBody(visual, (*((plate,) if clear and fit.plate else ()), *_row_tubes(table, 0, options, cut)))


def _housing(options: Body) -> Cylinder:
    """The housing of a joint in the frame of the link that turns with it."""
    return Cylinder(np.eye(4), options.joint_diameter / 2.0, options.joint_length, options.joint_mass, "joint")


def _housings_that_collide(table: DHTable, reach: float, spheres: Sequence[float]) -> list[bool]:
    """Whether joint_1, ..., joint_n keep a collision shape: from the tool down, each a whole sphere clear of the last.

    The last of a cluster keeps it because its link also carries the tube that leads away. Where the next joint's sphere
    was made wider than a housing, it has to be clear of that too.
    """
    kept = [False] * table.dof
    travelled, sphere = np.inf, 0.0
    for i in reversed(range(table.dof)):
        free = i + 1 == table.dof or spheres[i + 1] <= reach or _span(table, i + 1) >= reach + spheres[i + 1]
        kept[i] = bool(travelled >= reach + sphere) and free
        travelled, sphere = (0.0, spheres[i]) if kept[i] else (travelled, sphere)
        travelled += _span(table, i)
    return kept


def _span(table: DHTable, i: int) -> float:
    """Distance between the ends of row i [m]."""
    return float(np.hypot(table.a[i], table.d[i]))


def _row_tubes(table: DHTable, i: int, options: Body, cut: float = 0.0) -> tuple[Cylinder, ...]:
    """The tubes of row i in the frame of the link that carries them: along x by a_i, then along z_i by d_i.

    Args:
        table: The arm.
        i: Row, 0..n.
        options: What the tubes are made of.
        cut: End them at a sphere of this radius about the next joint [m].
    """
    a, d = float(table.a[i]), float(table.d[i])
    start = table.base() if i == 0 else np.eye(4)
    corner = start @ translation(a, 0.0, 0.0) @ rot_x(table.alpha[i])
    if cut > 0.0:
        aside = max(abs(d) - options.tube_diameter / 2.0, 0.0)
        a = _shortened(a, float(np.sqrt(max(cut**2 - aside**2, 0.0))))
        d = _shortened(d, cut)
    return (*_tube(start @ Z_TO_X, a, options), *_tube(corner, d, options))


def _shortened(span: float, cut: float) -> float:
    """A signed length made shorter at its far end, 0 where nothing remains [m]."""
    return float(np.sign(span)) * max(abs(span) - cut, 0.0)


def _tube(frame: Array, span: float, options: Body) -> tuple[Cylinder, ...]:
    """A tube from a frame's origin along its z axis by ``span``, backwards if negative; none if too short."""
    if abs(span) < SHORTEST:
        return ()
    radius = options.tube_diameter / 2.0
    inner = max(radius - options.tube_wall, 0.0)
    mass = options.tube_density * np.pi * (radius**2 - inner**2) * abs(span)
    centre = frame @ translation(0.0, 0.0, span / 2.0)
    return (Cylinder(centre, radius, abs(span), mass, "tube", inner),)
