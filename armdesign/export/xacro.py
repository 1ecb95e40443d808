"""The arm as xacro: a macro with a prefix and a parent to build it into larger robots, and a file that uses it."""

from __future__ import annotations

from armdesign.export.parts import WORLD, origin_part, robot_parts
from armdesign.export.robot_file import Robot
from armdesign.export.templates import render
from armdesign.export.urdf import tag_parts

MACRO_TEMPLATE = "arm_macro.xacro.j2"
TEMPLATE = "arm.xacro.j2"
PREFIX = "${prefix}"


def robot_xacro_macro(robot: Robot) -> str:
    """The macro ``armdesign_arm`` with the parameters prefix, parent, xyz and rpy, and the materials it uses."""
    return render(MACRO_TEMPLATE, {**robot_parts(robot), **tag_parts(robot), "prefix": PREFIX})


def robot_xacro(robot: Robot, macro_file: str) -> str:
    """A robot that is one arm; what comes out of it is the URDF.

    Args:
        robot: The robot.
        macro_file: Name of the file with the macro, in the same folder.
    """
    parent = WORLD if robot.options.tags.world else ""
    return render(TEMPLATE, {"name": robot.name, "macro_file": macro_file, "parent": parent, **origin_part(robot.root)})
