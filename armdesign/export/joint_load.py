"""Speed and torque limits that a given motion needs, with a margin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import DesignError, SettingsError
from armdesign.export.options import LimitOptions
from armdesign.export.solids import link_bodies, tool_inertial
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.models import arm_model
from armdesign.kinematics.motion import SmoothMotion, smooth_motion
from armdesign.settings import Body

GRAVITY = (0.0, 0.0, -9.81)
"""Gravity in the base frame [m/s^2]."""


@dataclass(frozen=True)
class TrajectoryLimits:
    """Limits for the n joints.

    Attributes:
        velocity: Speed limits, shape (n,) [rad/s].
        effort: Torque limits, shape (n,) [N m].
    """

    velocity: Array
    effort: Array


def trajectory_limits(
    table: DHTable,
    time: ArrayLike,
    q: ArrayLike,
    *,
    body: Body | None = None,
    options: LimitOptions | None = None,
    gravity: ArrayLike = GRAVITY,
) -> TrajectoryLimits:
    """Peak speed and peak inverse-dynamics torque of every joint over a motion, times a margin, never below a floor.

    The torque is what holds and moves the arm's own solids and the payload. Friction is not in it; the margin is there
    to cover it.

    Args:
        table: The arm, n joints.
        time: Times of the frames, shape (T,), T >= 3, increasing [s].
        q: Joint angles without jumps by a full turn, shape (T, n) [rad].
        body: What the arm is built of.
        options: Payload, margin, floors and smoothing window.
        gravity: Gravity in the base frame, shape (3,) [m/s^2].

    Raises:
        DesignError: The motion does not fit the arm, or its times do not increase.
    """
    chosen = options or LimitOptions()
    motion = smooth_motion(time, q, chosen.window)
    if motion.q.shape[1] != table.dof:
        raise DesignError(f"the motion has {motion.q.shape[1]} joints, but the arm has {table.dof}")
    torque = joint_torques(table, motion, body or Body(), chosen.payload, gravity)
    return TrajectoryLimits(
        velocity=np.maximum(chosen.margin * np.abs(motion.v).max(axis=0), chosen.velocity_floor),
        effort=np.maximum(chosen.margin * np.abs(torque).max(axis=0), chosen.effort_floor),
    )


def joint_torques(table: DHTable, motion: SmoothMotion, body: Body, payload: float, gravity: ArrayLike) -> Array:
    """Inverse dynamics of the arm along a motion, tau = M(q) a + C(q, v) v + g(q), by Pinocchio's ``rnea``.

    Args:
        table: The arm, n joints.
        motion: The motion, T frames.
        body: What the arm is built of.
        payload: Point mass at tool0 [kg].
        gravity: Gravity in the base frame, shape (3,) [m/s^2].

    Returns:
        Torques, shape (T, n) [N m].
    """
    pull = np.asarray(gravity, dtype=float)
    if pull.shape != (3,) or not np.isfinite(pull).all():
        raise SettingsError("gravity is not a finite vector", value=gravity, allowed="three numbers [m/s^2]")
    model = dynamic_model(table, body, payload)
    model.gravity.linear = pull
    data = model.createData()
    return np.stack([pin.rnea(model, data, *state) for state in zip(motion.q, motion.v, motion.a, strict=True)])


def dynamic_model(table: DHTable, body: Body, payload: float = 0.0) -> Any:  # noqa: ANN401 (a pin.Model)
    """The Pinocchio model of an arm with the inertias of its solids.

    Args:
        table: The arm, n joints.
        body: What the arm is built of.
        payload: Point mass at tool0 [kg].
    """
    model = arm_model(table)
    for joint, link in enumerate(link_bodies(table, body)[1:], start=1):
        inertial = link.inertial
        model.appendBodyToJoint(joint, pin.Inertia(inertial.mass, inertial.com, inertial.inertia), pin.SE3.Identity())
    tool = pin.SE3(table.placements()[-1])
    hand = tool_inertial(body)
    model.appendBodyToJoint(table.dof, pin.Inertia(hand.mass, hand.com, hand.inertia), tool)
    model.appendBodyToJoint(table.dof, pin.Inertia(payload, np.zeros(3), np.zeros((3, 3))), tool)
    return model
