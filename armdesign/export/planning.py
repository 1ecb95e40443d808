"""What a motion planner wants to know of an arm: which links may touch, as SRDF, and the files that MoveIt reads.

Pairs of links that need no check are found by sampling the joint space, as MoveIt's setup assistant does, and by the
demonstrated motion: neighbours, pairs that touch in every sample, and pairs that touch in none and not in the motion.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody, link_name
from armdesign.export.contacts import Pair, contacts
from armdesign.export.parts import BASE_LINK, TOOL_LINK, WORLD
from armdesign.export.robot_file import Robot
from armdesign.export.templates import render
from armdesign.export.trajectory.scaling import MAX_ACCELERATION, MAX_SLIDE_ACCELERATION
from armdesign.export.trajectory.trajectory_files import CONTROLLER
from armdesign.export.xml_text import number

SAMPLES, FEW = 10_000, 1000
"""Poses that the joint space is looked at in, as many as MoveIt's assistant takes; and for the free share alone."""
GROUP, TOOL_GROUP, START = "arm", "tool", "demonstrated_start"
BROADCASTER = "joint_state_broadcaster"
UPDATE_RATE = 500
"""Of the controllers [1/s]."""
FULL = 6
"""Joints from which a solver can be asked for orientations, too."""


@dataclass(frozen=True)
class Contacts:
    """What was found in sampling the joint space.

    Attributes:
        reasons: Pairs of links that need no check, and why: Adjacent, Always or Never.
        free: Share of the samples in which no other pair touches.
    """

    reasons: dict[Pair, str]
    free: float


def sampled_contacts(
    arm: ArmBody, position: Array, touching: Collection[Pair] = (), samples: int | None = None
) -> Contacts:
    """Look at the joint space in evenly random poses, always the same ones.

    Args:
        arm: The arm and its solids, n joints.
        position: Joint limits, shape (n, 2) [rad; m of prismatic joints].
        touching: Pairs of links that touch in the demonstrated motion.
        samples: How many poses; ``SAMPLES`` by default.
    """
    rng = np.random.default_rng(0)
    q = rng.uniform(position[:, 0], position[:, 1], (SAMPLES if samples is None else samples, len(position)))
    pairs, hits = contacts(arm, q)
    reasons, counts = {(i, i + 1): "Adjacent" for i in range(arm.table.dof)}, np.ones(len(pairs), dtype=bool)
    for k, pair in enumerate(pairs):
        if pair in reasons:
            counts[k] = False
        elif hits[:, k].all():
            reasons[pair], counts[k] = "Always", False
        elif not hits[:, k].any() and pair not in touching:
            reasons[pair] = "Never"
    free = 1.0 - float(hits[:, counts].any(axis=1).mean())
    return Contacts(dict(sorted(reasons.items())), free)


def robot_srdf(robot: Robot) -> str:
    """The semantic description of a robot: groups, end effector, start state, pairs of links that need no check."""
    found = sampled_contacts(robot.arm, robot.limits.position, robot.touching)
    n = robot.table.dof
    pairs = [(link_name(i), link_name(j), reason) for (i, j), reason in found.reasons.items()]
    pairs.append((link_name(n), TOOL_LINK, "Adjacent"))
    states = {
        START: [(f"joint_{i + 1}", number(angle)) for i, angle in enumerate(robot.start)],
        "zero": [(f"joint_{i + 1}", number(0.0)) for i in range(n)],
    }
    context = {
        "name": robot.name, "group": GROUP, "tool_group": TOOL_GROUP, "base": BASE_LINK, "tool": TOOL_LINK,
        "world": None if robot.options.tags.world else WORLD,
        "states": states, "pairs": pairs, "free": f"{100.0 * found.free:.0f}", "samples": SAMPLES,
    }  # fmt: skip
    return render("arm.srdf.j2", context)


def joint_items(robot: Robot) -> str:
    """The joints as items of a YAML list."""
    return "".join(f"\n      - joint_{i + 1}" for i in range(robot.table.dof))


def controllers_yaml(robot: Robot) -> str:
    """Controllers for ros2_control: a joint trajectory controller and a joint state broadcaster."""
    return f"""controller_manager:
  ros__parameters:
    update_rate: {UPDATE_RATE}
    {BROADCASTER}:
      type: joint_state_broadcaster/JointStateBroadcaster
    {CONTROLLER}:
      type: joint_trajectory_controller/JointTrajectoryController

{CONTROLLER}:
  ros__parameters:
    joints:{joint_items(robot)}
    command_interfaces:
      - position
    state_interfaces:
      - position
      - velocity
"""


def joint_limits_yaml(robot: Robot) -> str:
    """Speed and acceleration limits as MoveIt reads them; the positions are those of the URDF."""
    lines = ["default_velocity_scaling_factor: 1.0", "default_acceleration_scaling_factor: 1.0", "joint_limits:"]
    for i, slides in enumerate(robot.table.prismatic):
        lines += [
            f"  joint_{i + 1}:",
            "    has_velocity_limits: true",
            f"    max_velocity: {number(robot.limits.velocity[i])}",
            "    has_acceleration_limits: true",
            f"    max_acceleration: {number(MAX_SLIDE_ACCELERATION if slides else MAX_ACCELERATION)}",
        ]
    return "\n".join(lines) + "\n"


def kinematics_yaml(robot: Robot) -> str:
    """The solver of the group; an arm of less than six joints cannot be asked for any orientation."""
    lines = [
        f"{GROUP}:",
        "  kinematics_solver: kdl_kinematics_plugin/KDLKinematicsPlugin",
        "  kinematics_solver_search_resolution: 0.005",
        "  kinematics_solver_timeout: 0.05",
        *(["  position_only_ik: true"] if robot.table.dof < FULL else []),
    ]
    return "\n".join(lines) + "\n"


def moveit_controllers_yaml(robot: Robot) -> str:
    """How MoveIt reaches the controller."""
    return f"""moveit_controller_manager: moveit_simple_controller_manager/MoveItSimpleControllerManager
moveit_simple_controller_manager:
  controller_names:
    - {CONTROLLER}
  {CONTROLLER}:
    type: FollowJointTrajectory
    action_ns: follow_joint_trajectory
    default: true
    joints:{joint_items(robot)}
"""
