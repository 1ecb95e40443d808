"""The position actuators of a simulated arm: gains, how far they lag, and the step that can carry them.

An actuator pulls with kp (c - q) - kv dq/dt, beside the joint's own damping b, so behind a command c that moves at a
steady speed v the joint stays back by (kv + b) / kp v: it lags by the time (kv + b) / kp, for kp = M w^2 and
kv = 2 M w - b by 2 / w. Commands of c = q + lag v take that out.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from armdesign._types import Array
from armdesign.bodies.loads import dynamic_model
from armdesign.export.robot_file import Robot
from armdesign.export.trajectory.exporting import largest

BEHIND = 1e-3
"""How far the tool may lag at its fastest, where no bandwidth is given [m]."""
BANDWIDTHS = (20.0, 100.0)
"""Least and largest bandwidth that is chosen by that [Hz]; stiffer ones turn the steps of a command that is held for
1 ms into torques of tens of N m."""
STEP = 1e-3
"""Time step of a simulation [s], unless the bandwidth needs a shorter one."""
STEPS = 10.0
"""Least number of steps in a period of the bandwidth; stiffer actuators are no longer stable on every arm."""


class Servos(NamedTuple):
    """Position actuators of the n joints.

    Attributes:
        kp: Position gains, shape (n,) [N m/rad; N/m of prismatic joints].
        kv: Velocity gains, shape (n,) [N m s/rad; N s/m].
        lag: By how long each joint lags behind, shape (n,) [s].
        step: Time step that carries them [s].
    """

    kp: Array
    kv: Array
    lag: Array
    step: float


def servos(robot: Robot) -> Servos:
    """The actuators of a robot: kp = M w^2 and kv = 2 M w - b, unless they are given.

    M is what a joint moves in the start pose, the diagonal of the mass matrix with payload and armature; w is 2 pi
    times the bandwidth.
    """
    drives = robot.options.simulation
    model = dynamic_model(robot.arm, robot.options.limits.payload or 0.0)
    inertia = np.diag(pin.crba(model, model.createData(), robot.start)) + drives.joint_armature
    frequency = bandwidth(robot)
    kp = inertia * (2.0 * np.pi * frequency) ** 2
    if drives.kp is not None:
        kp = np.full(robot.table.dof, drives.kp)
    kv = np.maximum(2.0 * np.sqrt(kp * inertia) - drives.joint_damping, 0.0)
    if drives.kv is not None:
        kv = np.full(robot.table.dof, drives.kv)
    return Servos(kp, kv, (kv + drives.joint_damping) / kp, min(STEP, 1.0 / (STEPS * frequency)))


def bandwidth(robot: Robot) -> float:
    """Natural frequency of the actuators [Hz]: the one given, or one that suits the motion's tool speed."""
    given = robot.options.simulation.bandwidth
    if given is not None:
        return given
    low, high = BANDWIDTHS
    return float(np.clip(robot.pace.tool / (np.pi * BEHIND), low, high))  # lag 2 / w at the tool's speed


def lag_note(robot: Robot) -> str:
    """How far the actuators of the MJCF stay behind the trajectory, and what takes that out."""
    drives = servos(robot)
    late = float(drives.lag.max())
    behind = largest(
        drives.lag * robot.pace.joints, robot.table.prismatic, ("{:.2f} deg", "{:.2f} mm"), (np.degrees(1.0), 1e3)
    )
    return (
        f"The position actuators in the MJCF lag by {1e3 * late:.1f} ms: at the peaks of the trajectory by {behind}, "
        f"{1e3 * late * robot.pace.tool:.1f} mm at the tool. Commands of q + lag * v, with the file's numeric 'lag', "
        "at every step take that out."
    )
