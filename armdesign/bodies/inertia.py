"""Mass, centre of mass and inertia of rigid bodies, and of what is made of several."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.errors import DesignError


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

    @classmethod
    def of_entries(cls, entries: Sequence[float]) -> Inertial:
        """The body whose ``entries`` these are."""
        mass, x, y, z, xx, yy, zz, xy, xz, yz = entries
        return cls(mass, np.array([x, y, z]), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))

    @property
    def entries(self) -> tuple[float, ...]:
        """Mass, centre of mass and the moments before the products, Ixx, Iyy, Izz, Ixy, Ixz, Iyz, shape (10,)."""
        I = self.inertia  # noqa: E741
        return (self.mass, *self.com.tolist(), *np.diag(I).tolist(), *I[[0, 0, 1], [1, 2, 2]].tolist())

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
