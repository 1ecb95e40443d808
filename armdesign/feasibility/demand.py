"""What a task asks of the joints: speeds, accelerations, torques, and the share of its speed at which limits hold."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody
from armdesign.bodies.loads import base_gravity, joint_torques
from armdesign.feasibility.needs import JointNeeds
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.motion import SmoothMotion


class JointDemand(NamedTuple):
    """What n joints have to do over the N frames of all demonstrations, at the demonstrated speed.

    Attributes:
        speed: Absolute values, shape (N, n) [rad/s; m/s].
        acceleration: Absolute values, shape (N, n) [rad/s^2; m/s^2].
        torque: Shape (N, n) [N m; N].
        holding: The part of it that holds the arm still, shape (N, n) [N m; N].
    """

    speed: Array
    acceleration: Array
    torque: Array
    holding: Array


def joint_demand(arm: ArmBody, motions: Sequence[SmoothMotion], payload: float, base: BasePose) -> JointDemand:
    """Speeds, accelerations and torques of motions.

    Args:
        arm: The arm with its body.
        motions: The smoothed joint paths, one for each demonstration.
        payload: Point mass at the tool [kg].
        base: Where the arm stands.
    """
    motion = SmoothMotion(*(np.concatenate([getattr(each, name) for each in motions]) for name in ("q", "v", "a")))
    still, gravity = np.zeros_like(motion.q), base_gravity(base)
    torque, holding = (
        joint_torques(arm, each, payload, gravity) for each in (motion, SmoothMotion(motion.q, still, still))
    )
    return JointDemand(np.abs(motion.v), np.abs(motion.a), torque, holding)


def speed_fraction(demand: JointDemand, limits: JointNeeds) -> float:
    """The largest share of the demonstrated speed, at most 1, at which every limit is kept; 0 where none keeps it.

    At the share c speeds are c times, accelerations c^2 times what they are, and torques g + c^2 (tau - g), with g what
    holds the arm still.

    Args:
        demand: What the joints have to do.
        limits: Their limits; where no speed is stated, that of the assumed actuators counts.
    """
    with np.errstate(divide="ignore"):
        squares = [1.0, float((limits.actuator_speed / demand.speed.max(axis=0)).min()) ** 2]
        if limits.acceleration is not None:
            squares.append(float((limits.acceleration / demand.acceleration.max(axis=0)).min()))
    if limits.torque is not None:
        moving = demand.torque - demand.holding
        room = limits.torque - np.sign(moving) * demand.holding  # up to the limit on the side it moves towards
        ratios = np.divide(room, np.abs(moving), out=np.full_like(room, np.inf), where=moving != 0.0)
        holds = bool((np.abs(demand.holding) <= limits.torque).all())
        squares.append(float(ratios.min()) if holds else 0.0)
    return float(np.sqrt(min(squares)))
