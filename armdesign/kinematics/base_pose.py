"""Where the arm's base stands in the room, and how it is mounted there."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array

MOUNTINGS = {
    "floor": np.eye(3),
    "wall": np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
    "ceiling": np.diag([1.0, -1.0, -1.0]),
}
"""Axes of a base of no yaw in the room, by what it is mounted on: its z axis points up, along the room's x (out of the
wall), or down. Yaw then turns the whole about the room's z."""


@dataclass(frozen=True, eq=False)
class BasePose:
    """Pose of base_link in the room.

    Attributes:
        translation: Origin of the base in the room, shape (3,) [m].
        rotation: Axes of the base in the room as columns, shape (3, 3).
        mounted: What it is mounted on: floor, wall or ceiling.
        frame: What the pose counts from: ``room``, the recording's own coordinates with z up, or ``base``, where the
            recording has no room frame because every frame counts from a moving base point.
    """

    translation: Array = field(default_factory=lambda: np.zeros(3))
    rotation: Array = field(default_factory=lambda: np.eye(3))
    mounted: str = "floor"
    frame: str = "room"

    @property
    def matrix(self) -> Array:
        """The pose as a homogeneous matrix, shape (4, 4)."""
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = self.rotation, self.translation
        return pose

    def inside(self, points: Array) -> Array:
        """Points of the room, shape (..., 3), as seen from the base.

        The same products in the same order as the kernel ``show_frame``, to the last bit.
        """
        x, y, z = (points[..., i] - self.translation[i] for i in range(3))
        return self.turned_back(np.stack([x, y, z], axis=-1))

    def turned_back(self, vectors: Array) -> Array:
        """Directions in the room, shape (..., 3), as seen from the base."""
        x, y, z = (vectors[..., i] for i in range(3))
        return np.stack([axis[0] * x + axis[1] * y + axis[2] * z for axis in self.rotation.T], axis=-1)

    @property
    def columns(self) -> Array:
        """The pose as the kernels read it: axes x, y, z, then the origin, shape (12,)."""
        return np.concatenate([self.rotation.T.ravel(), self.translation])


def placed_base(position: ArrayLike, yaw: float, mounted: str = "floor") -> BasePose:
    """A base at a position in the room.

    Args:
        position: x, y, z in the room, shape (3,) [m].
        yaw: Turn about the room's z axis [rad].
        mounted: floor, wall or ceiling, see ``MOUNTINGS``.
    """
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    return BasePose(np.array(position, dtype=float), turn @ MOUNTINGS[mounted], mounted)
