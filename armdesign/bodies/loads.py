"""The torques that move an arm's solids and a payload along a motion."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody, tool_inertial
from armdesign.errors import SettingsError
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.models import arm_model
from armdesign.kinematics.motion import SmoothMotion

GRAVITY = (0.0, 0.0, -9.81)
"""Gravity in the base frame of an arm that stands on the floor [m/s^2]."""


def base_gravity(base: BasePose) -> Array:
    """Gravity as a base feels it that stands somewhere in a room, R^T (0, 0, -g), shape (3,) [m/s^2]."""
    pull: Array = base.rotation.T @ np.array(GRAVITY)
    return pull


def joint_torques(arm: ArmBody, motion: SmoothMotion, payload: float = 0.0, gravity: ArrayLike = GRAVITY) -> Array:
    """Inverse dynamics of the arm along a motion, tau = M(q) a + C(q, v) v + g(q), by Pinocchio's ``rnea``.

    Args:
        arm: The arm and its solids.
        motion: The motion, T frames.
        payload: Point mass at tool0 [kg].
        gravity: Gravity in the base frame, shape (3,) [m/s^2]; see ``base_gravity`` for a base on a wall.

    Returns:
        Torques, shape (T, n) [N m; N of prismatic joints].
    """
    pull = np.asarray(gravity, dtype=float)
    if pull.shape != (3,) or not np.isfinite(pull).all():
        raise SettingsError("gravity is not a finite vector", value=gravity, allowed="three numbers [m/s^2]")
    model = dynamic_model(arm, payload)
    model.gravity.linear = pull
    return model_torques(model, motion)


def model_torques(model: Any, motion: SmoothMotion) -> Array:  # noqa: ANN401 (a pin.Model)
    """Inverse dynamics of a Pinocchio model along a motion of T frames, shape (T, n) [N m; N of prismatic joints]."""
    data, states = model.createData(), zip(motion.q, motion.v, motion.a, strict=True)
    return np.stack([pin.rnea(model, data, *state) for state in states])


def dynamic_model(arm: ArmBody, payload: float = 0.0) -> Any:  # noqa: ANN401 (a pin.Model)
    """The Pinocchio model of an arm with the inertias of its solids.

    Args:
        arm: The arm and its solids.
        payload: Point mass at tool0 [kg].
    """
    table = arm.table
    model = arm_model(table)
    for joint, link in enumerate(arm.links[1:], start=1):
        inertial = link.inertial
        model.appendBodyToJoint(joint, pin.Inertia(inertial.mass, inertial.com, inertial.inertia), pin.SE3.Identity())
    tool = pin.SE3(table.placements()[-1])
    hand = tool_inertial(arm.options)
    model.appendBodyToJoint(table.dof, pin.Inertia(hand.mass, hand.com, hand.inertia), tool)
    model.appendBodyToJoint(table.dof, pin.Inertia(payload, np.zeros(3), np.zeros((3, 3))), tool)
    return model
