"""The arm as a ROS 2 description package: URDFs, SRDF, controllers, MoveIt's files, launch files."""

from __future__ import annotations

import re
from dataclasses import replace

from armdesign._version import __version__
from armdesign.errors import SettingsError
from armdesign.export.planning import (
    BROADCASTER,
    controllers_yaml,
    joint_limits_yaml,
    kinematics_yaml,
    moveit_controllers_yaml,
    robot_srdf,
)
from armdesign.export.robot_file import Robot
from armdesign.export.templates import render
from armdesign.export.trajectory.trajectory_files import CONTROLLER
from armdesign.export.urdf import CONTROLLERS, robot_urdf

NAME = re.compile(r"[a-z][a-z0-9]*(_[a-z0-9]+)*")
"""Names of ROS 2 packages: lower case, digits and single underscores, beginning with a letter."""
LAUNCHES = ("display", "gazebo", "moveit")


def check_package_name(name: str) -> str:
    """The name, if a ROS 2 package can have it.

    Raises:
        SettingsError: It cannot.
    """
    if not NAME.fullmatch(name) or len(name) < 2:
        raise SettingsError(
            f"--package is {name!r}", value=name,
            allowed="lower-case letters, digits and single underscores, beginning with a letter",
        )  # fmt: skip
    return name


def ros_package(robot: Robot, name: str) -> dict[str, str]:
    """The files of a package by their paths in it.

    The URDF has mock hardware, so that MoveIt moves it at once; that for Gazebo has gz_ros2_control with the path of
    the controllers left open, ``@CONTROLLERS@``, which the launch file fills in. Both begin with a link ``world``.

    Args:
        robot: The robot.
        name: Name of the package.

    Raises:
        SettingsError: A ROS 2 package cannot have this name.
    """
    check_package_name(name)
    tags = (replace(robot.options.tags, ros2_control=hardware, world=True) for hardware in ("mock", "gazebo"))
    mock, gazebo = (replace(robot, options=replace(robot.options, tags=each)) for each in tags)
    open_path = f"<parameters>{CONTROLLERS}</parameters>", "<parameters>@CONTROLLERS@</parameters>"
    context = {
        "package": name, "robot": robot.name, "version": __version__, "controller": CONTROLLER,
        "broadcaster": BROADCASTER,
    }  # fmt: skip
    files = {
        "package.xml": render("ros_package.xml.j2", context),
        "CMakeLists.txt": render("ros_cmakelists.txt.j2", context),
        f"urdf/{robot.name}.urdf": robot_urdf(mock),
        f"urdf/{robot.name}_gazebo.urdf": robot_urdf(gazebo).replace(*open_path),
        f"config/{robot.name}.srdf": robot_srdf(mock),
        "config/controllers.yaml": controllers_yaml(robot),
        "config/joint_limits.yaml": joint_limits_yaml(robot),
        "config/kinematics.yaml": kinematics_yaml(robot),
        "config/moveit_controllers.yaml": moveit_controllers_yaml(robot),
        "rviz/view.rviz": render("ros_view.rviz.j2", context),
    }
    return files | {f"launch/{kind}.launch.py": render(f"ros_{kind}.launch.py.j2", context) for kind in LAUNCHES}
