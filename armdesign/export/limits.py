"""Speed and torque limits of the joints in robot files: those of an actuator, or those that the motion needs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody
from armdesign.bodies.loads import base_gravity, joint_torques
from armdesign.export.joints import JointLimits, joint_limits, narrowed
from armdesign.export.options import LimitOptions, RobotOptions, SimulationOptions
from armdesign.feasibility.demand import JointDemand, joint_demand, speed_fraction
from armdesign.feasibility.needs import JointNeeds, joint_needs
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.motion import SmoothMotion
from armdesign.search.evaluation import motions
from armdesign.search.result import Result

LEAST = 1.0
"""Limits by a motion are at least so much [rad/s, N m]: a joint that stands still needs none, but readers insist."""


def exported_limits(result: Result, arm: ArmBody, assumed: RobotOptions) -> tuple[JointLimits, tuple[str, ...]]:
    """The limits that the robot files of a result carry, and what a user should know about them.

    Speeds and torques that the task states (``needs.max_speed``, ``needs.max_torque``) go over those of the assumed
    actuator; with a margin both are by the motion.

    Args:
        result: The arm with its paths.
        arm: Its solids.
        assumed: How the limits come about, and what the drives themselves need.
    """
    options = assumed.limits
    needs, base, payload = joint_needs(result.problem.settings), result.base_pose, options.payload or 0.0
    velocity, effort = actuator_limits(needs, options)
    if options.margin is not None:
        velocity, effort = peak_limits(arm, result.moved, assumed, base)
    velocity = np.maximum(velocity, options.velocity_floor or 0.0)
    effort = np.maximum(effort, options.effort_floor or 0.0)
    position, notes = result.limits, []
    if options.narrow_limits is not None:
        q = np.concatenate([angles for _, angles in motions(result.evaluation, result.problem)])
        margin = options.narrow_limits * np.where(needs.prismatic, 1e-3, np.deg2rad(1.0))
        position = narrowed(position, q, margin)
        notes += widened_notes(position, q)
    if options.margin is None:
        stated = JointNeeds(needs.prismatic, velocity, None, effort)
        demand = joint_demand(arm, result.moved, payload, base)
        own = [drive_torques(each, assumed.simulation) for each in result.moved]
        notes += excess_notes(demand._replace(torque=demand.torque + np.concatenate(own)), stated)
    return joint_limits(arm.table.prismatic, position, velocity, effort), tuple(notes)


def actuator_limits(needs: JointNeeds, options: LimitOptions) -> tuple[Array, Array]:
    """Speeds and torques that the task states, or else those of the assumed actuator, shape (n,) each.

    Args:
        needs: What the task states.
        options: The actuator.
    """
    speed = np.where(needs.prismatic, options.slide_speed, np.deg2rad(options.actuator_speed))
    torque = np.where(needs.prismatic, options.slide_force, options.actuator_torque)
    return speed if needs.speed is None else needs.speed, torque if needs.torque is None else needs.torque


def peak_limits(
    arm: ArmBody, moved: Sequence[SmoothMotion], assumed: RobotOptions, base: BasePose
) -> tuple[Array, Array]:
    """Peak speeds and peak inverse-dynamics torques of every joint over some motions, times the margin.

    The torque is what holds and moves the arm's own solids, the payload and the drives themselves, whose armature,
    damping and friction the simulators' files have. No limit is below ``LEAST``, unless other floors are given.

    Args:
        arm: The arm and its solids, n joints.
        moved: The smoothed motions, one for each demonstration.
        assumed: Payload, margin and floors; and the drives.
        base: Where the arm stands.

    Returns:
        Speeds [rad/s; m/s] and torques [N m; N], shape (n,) each.
    """
    options, speeds, torques = assumed.limits, [], []
    for motion in moved:
        speeds.append(np.abs(motion.v).max(axis=0))
        torque = joint_torques(arm, motion, options.payload or 0.0, base_gravity(base))
        torques.append(np.abs(torque + drive_torques(motion, assumed.simulation)).max(axis=0))
    margin = 1.0 if options.margin is None else options.margin
    floors = (LEAST if floor is None else floor for floor in (options.velocity_floor, options.effort_floor))
    peaks = (margin * np.max(each, axis=0) for each in (speeds, torques))
    velocity, effort = (np.maximum(peak, floor) for peak, floor in zip(peaks, floors, strict=True))
    return velocity, effort


def drive_torques(motion: SmoothMotion, drives: SimulationOptions) -> Array:
    """What the drives need for themselves: armature a + damping v + friction sign(v), shape (T, n) [N m; N].

    Args:
        motion: The motion, T frames.
        drives: The drives.
    """
    torque: Array = drives.joint_armature * motion.a + drives.joint_damping * motion.v
    return torque + drives.joint_friction * np.sign(motion.v)


def excess_notes(demand: JointDemand, limits: JointNeeds) -> list[str]:
    """Which joints need more than their limits at the demonstrated speed, and at which share of it they do not.

    Args:
        demand: What the joints have to do.
        limits: Speed and torque limits.
    """
    speed, torque = demand.speed.max(axis=0), np.abs(demand.torque).max(axis=0)
    over = []
    for i, slides in enumerate(limits.prismatic):
        units = (1.0, "m/s", "N") if slides else (float(np.degrees(1.0)), "deg/s", "N m")
        for needed, limit, unit, factor in (
            (speed[i], limits.actuator_speed[i], units[1], units[0]),
            (torque[i], np.inf if limits.torque is None else limits.torque[i], units[2], 1.0),
        ):
            if needed > limit:
                over.append(f"joint_{i + 1} {needed * factor:.3g} of {limit * factor:.3g} {unit}")
    if not over:
        return []
    share = np.floor(speed_fraction(demand, limits) * 100.0)
    slower = f"at {share:.0f} % of that speed (--speed {share / 100.0:g}) it keeps them"
    if share < 1.0:
        slower = "no slower motion keeps them, since the arm's own weight is too much"
    return [f"At the demonstrated speed the motion needs more than the limits: {', '.join(over)}; {slower}."]


def widened_notes(position: Array, q: Array) -> list[str]:
    """Which narrowed ranges reach further than the motion and its margin, to hold 0.

    Args:
        position: The ranges, shape (n, 2) [rad; m].
        q: The motion, shape (T, n) [rad; m].
    """
    far = (position[:, 0] == 0.0) & (q.min(axis=0) > 0.0) | (position[:, 1] == 0.0) & (q.max(axis=0) < 0.0)
    names = ", ".join(f"joint_{i + 1}" for i in np.flatnonzero(far))
    if not names:
        return []
    return [f"The narrowed range of {names} reaches to 0, which the motion does not use: many readers insist on it."]
