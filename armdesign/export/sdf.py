"""The arm as an SDF 1.7 model, as Gazebo reads it: base fixed to the world, frames stated relative to one another."""

from __future__ import annotations

from armdesign.export.parts import origin_part, robot_parts
from armdesign.export.robot_file import Robot
from armdesign.export.templates import render
from armdesign.export.xml_text import number

TEMPLATE = "arm.sdf.j2"


def robot_sdf(robot: Robot) -> str:
    """Write a robot as SDF; a pure function of it.

    The pose of a joint is ``relative_to`` its parent link, that of a link ``relative_to`` its joint.
    """
    simulation = robot.options.simulation
    dynamics = {"damping": number(simulation.joint_damping), "friction": number(simulation.joint_friction)}
    root = origin_part(robot.root) if robot.options.tags.world else None
    return render(TEMPLATE, {**robot_parts(robot), "dynamics": dynamics, "root": root})
