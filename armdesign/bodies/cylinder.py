"""Cylinders: the one kind of solid that arms are built of here."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.bodies.inertia import Inertial

SHORTEST = 1e-6
"""Pieces shorter than this are left out [m]; a cylinder of no length is refused by most readers."""


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A cylinder about the z axis of its own frame, which stands at its centre; hollow where an inner radius is given.

    Attributes:
        pose: Its frame in the link's frame, shape (4, 4).
        radius: Outer radius [m].
        length: Length along z [m].
        mass: Mass [kg].
        material: Name of the material it is drawn in: base, joint or tube.
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

    @property
    def ends(self) -> Array:
        """Centres of the two end faces in the link's frame, shape (2, 3) [m]."""
        half = self.length / 2.0 * self.pose[:3, 2]
        return np.stack([self.pose[:3, 3] - half, self.pose[:3, 3] + half])

    def outside(self, centre: Array, radius: float) -> tuple[Cylinder, ...]:
        """What is left of it beyond a sphere: pieces of the same radius, every point of which is outside.

        With h the distance of the sphere's centre from the axis and k = max(h - r, 0) that from the surface round it,
        what lies within sqrt(radius^2 - k^2) of the foot of the perpendicular is cut off.

        Args:
            centre: Centre of the sphere in the link's frame, shape (3,) [m].
            radius: Its radius [m].

        Returns:
            None, one or two cylinders, the piece at the lower end of z first; it alone where nothing is cut off.
        """
        axis = self.pose[:3, 2]
        foot = float((centre - self.pose[:3, 3]) @ axis)
        away = float(np.linalg.norm(centre - self.pose[:3, 3] - foot * axis))
        gap = max(away - self.radius, 0.0)
        if gap >= radius:
            return (self,)
        inside, half = float(np.sqrt(radius**2 - gap**2)), self.length / 2.0
        if foot - inside >= half or foot + inside <= -half:
            return (self,)
        pieces = ((-half, foot - inside), (foot + inside, half))
        return tuple(self._piece(low, high) for low, high in pieces if high - low >= SHORTEST)

    def _piece(self, low: float, high: float) -> Cylinder:
        """The part between two places along z, counted from the centre [m]."""
        pose = self.pose.copy()
        pose[:3, 3] += (low + high) / 2.0 * pose[:3, 2]
        return replace(self, pose=pose, length=high - low, mass=self.mass * (high - low) / self.length)


def along(start: ArrayLike, end: ArrayLike) -> Array:
    """The frame half way between two points whose z axis runs along them, upwards, turned the shortest way from z.

    Args:
        start: One end, shape (3,) [m].
        end: The other, shape (3,) [m], not the same point.

    Returns:
        Shape (4, 4).
    """
    first, second = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    span = second - first
    x, y, z = span / np.linalg.norm(span)
    if z < 0.0:  # a cylinder has no direction, and the turn from z to -z no shortest way
        x, y, z = -x, -y, -z
    pose = np.eye(4)
    pose[:3, :3] = [
        [1.0 - x * x / (1.0 + z), -x * y / (1.0 + z), x],
        [-x * y / (1.0 + z), 1.0 - y * y / (1.0 + z), y],
        [-x, -y, z],
    ]
    pose[:3, 3] = (first + second) / 2.0
    return pose
