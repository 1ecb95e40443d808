"""Limits of the joints as robot files carry them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import DesignError
from armdesign.feasibility.needs import SLIDING, TURNING
from armdesign.kinematics.models import default_limits

DEFAULT_EFFORT = 100.0
"""Torque limit of joints without one [N m; N]."""


@dataclass(frozen=True)
class JointLimits:
    """Limits of the n joints, checked.

    Attributes:
        position: Lowest and highest angle, shape (n, 2) [rad; m of prismatic joints]; each range holds 0.
        velocity: Speed limits, shape (n,) [rad/s; m/s], above 0.
        effort: Torque limits, shape (n,) [N m; N], above 0.
    """

    position: Array
    velocity: Array
    effort: Array

    def __post_init__(self) -> None:
        """Check what URDF readers insist on.

        Raises:
            DesignError: A limit is missing or not finite, a range is empty or leaves out 0, or a speed or torque limit
                is not positive.
        """
        n = len(self.velocity)
        for name, shape in (("position", (n, 2)), ("velocity", (n,)), ("effort", (n,))):
            array = getattr(self, name)
            if array.shape != shape or not np.isfinite(array).all():
                raise DesignError(f"{name} limits are not finite numbers of shape {shape}", value=array.tolist())
        for i, (lower, upper) in enumerate(self.position.tolist(), start=1):
            if not (lower <= 0.0 <= upper and lower < upper):
                raise DesignError(
                    f"joint_{i} ranges from {lower!r} to {upper!r}",
                    value=(lower, upper),
                    allowed="lower <= 0 <= upper, lower < upper",
                    fix="Where the range leaves out 0, move the zero pose with the joint's theta.",
                )
        for name in ("velocity", "effort"):
            for i, value in enumerate(getattr(self, name).tolist(), start=1):
                if value <= 0.0:
                    raise DesignError(f"joint_{i} has a {name} limit of {value!r}", value=value, allowed="> 0")


def joint_limits(
    prismatic: Sequence[bool],
    position: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    effort: ArrayLike | None = None,
) -> JointLimits:
    """Limits of n joints; what is not given is +-pi rad, pi rad/s and 100 N m, or +-1 m, 0.5 m/s and 100 N.

    Args:
        prismatic: Which joints slide, n of them.
        position: Shape (n, 2) [rad; m].
        velocity: Shape (n,) [rad/s; m/s].
        effort: Shape (n,) [N m; N].

    Raises:
        DesignError: As ``JointLimits``, or the shape does not fit n joints.
    """
    dof = len(prismatic)
    defaults = (default_limits(prismatic), np.where(prismatic, SLIDING, TURNING), DEFAULT_EFFORT)
    arrays = []
    for name, given, default in zip(
        ("joint", "velocity", "effort"), (position, velocity, effort), defaults, strict=True
    ):
        shape = (dof, 2) if name == "joint" else (dof,)
        array = np.full(shape, default) if given is None else np.array(given, dtype=float)
        if array.shape != shape:
            raise DesignError(
                f"{name} limits have shape {array.shape}, but the arm has {dof} joints", allowed=f"{shape}"
            )
        arrays.append(array)
    return JointLimits(*arrays)


def narrowed(position: Array, q: ArrayLike, margin: ArrayLike) -> Array:
    """Ranges cut to what a motion uses and a margin on both sides; they go on holding 0, as readers insist.

    Args:
        position: Ranges that hold the motion, shape (n, 2) [rad; m].
        q: The motion, shape (T, n) [rad; m].
        margin: What is left beyond the motion, one or by joint, shape (n,) [rad; m].

    Returns:
        Shape (n, 2) [rad]; never wider than before.
    """
    angles, beyond = np.asarray(q, dtype=float), np.asarray(margin, dtype=float)
    lower = np.minimum(np.maximum(angles.min(axis=0) - beyond, position[:, 0]), 0.0)
    upper = np.maximum(np.minimum(angles.max(axis=0) + beyond, position[:, 1]), 0.0)
    return np.stack([lower, upper], axis=1)
