"""The arm as a URDF text: links base_link, link_1..link_n, tool0; joints joint_1..joint_n, tool0_fixed.

The frames are those of the DH table (eq. 2): the frame of link_i is that of joint_i, tool0 is the tool row's. Nothing
is rounded: every number is the shortest text that reads back as the same double.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from numpy.typing import ArrayLike

from armdesign.export.joints import joint_limits
from armdesign.export.options import DEFAULT_NAME, RobotOptions, TagOptions
from armdesign.export.parts import MATERIALS, WORLD, bare_link, joint_part, origin_part, robot_parts
from armdesign.export.robot_file import Robot, finished_robot, make_robot
from armdesign.export.templates import render
from armdesign.export.xml_text import number, safe_name
from armdesign.kinematics.dh import DHTable
from armdesign.search.result import Result
from armdesign.settings import Body

__all__ = ["HARDWARE", "MATERIALS", "result_urdf", "robot_urdf", "tag_parts", "urdf_text"]

TEMPLATE = "arm.urdf.j2"
HARDWARE = {"mock": "mock_components/GenericSystem", "gazebo": "gz_ros2_control/GazeboSimSystem"}
"""Hardware plugins of ros2_control by their short names."""
CONTROLLERS = "controllers.yaml"
"""The file of the controllers that Gazebo's plugin is told, beside the URDF."""


def urdf_text(
    table: DHTable,
    *,
    name: str = DEFAULT_NAME,
    limits: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    effort: ArrayLike | None = None,
    body: Body | None = None,
    world: bool = False,
) -> str:
    """Write an arm without a demonstration as a URDF; a pure function of its arguments.

    Args:
        table: The arm, n joints.
        name: Robot name; made safe by ``safe_name``.
        limits: Joint ranges, shape (n, 2) [rad; m of joints that slide], each holding 0; +-pi or +-1 m by default.
        velocity: Speed limits, shape (n,) [rad/s; m/s]; pi or 0.5 by default.
        effort: Torque limits, shape (n,) [N m; N]; 100 by default.
        body: What the arm is built of.
        world: Put a link ``world`` and a fixed joint before base_link, for readers that let any other root float.

    Returns:
        The text of the file, ASCII only.

    Raises:
        DesignError: Limits do not fit the arm, or are none that a joint can have.
    """
    options = RobotOptions(body=body, tags=TagOptions(world=world))
    robot = make_robot(table, joint_limits(table.prismatic, limits, velocity, effort), options)
    return robot_urdf(replace(robot, name=safe_name(name)))


def robot_urdf(robot: Robot) -> str:
    """Write a robot as a URDF; a pure function of it.

    The body is described in ``armdesign.bodies.arm_body``: tubes lead from joint to joint, a joint's module belongs to
    the link that turns with it. Every link's inertial is that of its solids.
    """
    parts = robot_parts(robot)
    for link, meshes in robot.meshes.items():
        parts["links"][link]["visual"] = [
            {**origin_part(pose), "mesh": name, "material": material} for name, pose, material in meshes
        ]
    if robot.options.tags.world:
        base, *others = parts["links"]
        base["joint"] = joint_part(f"{WORLD}_fixed", WORLD, robot.root)
        parts["links"] = [bare_link(WORLD, None, None), base, *others]
    return render(TEMPLATE, {**parts, **tag_parts(robot), "prefix": ""})


def tag_parts(robot: Robot) -> dict[str, Any]:
    """What the tags for ros2_control and transmissions say."""
    tags = robot.options.tags
    joints = [
        {"name": f"joint_{i + 1}", "lower": number(low), "upper": number(high), "start": number(start)}
        for i, ((low, high), start) in enumerate(zip(robot.limits.position, robot.start, strict=True))
    ]
    wanted = tags.ros2_control
    hardware = None if wanted is None else HARDWARE.get(wanted, wanted)
    simulated = CONTROLLERS if hardware == HARDWARE["gazebo"] else None
    return {"hardware": hardware, "controllers": simulated, "transmissions": tags.transmissions, "moving": joints}


def result_urdf(result: Result) -> str:
    """The arm's URDF with the limits and the body that its own motions ask for; a run folder's arm.urdf."""
    return robot_urdf(finished_robot(result))
