"""The arm as a native MuJoCo model: drives, collision classes, a site at tool0, the demonstrated points, the start."""

from __future__ import annotations

from typing import Any

from armdesign.bodies.arm_body import link_name
from armdesign.export.parts import origin_part, robot_parts
from armdesign.export.robot_file import Robot
from armdesign.export.servos import servos
from armdesign.export.templates import render
from armdesign.export.xml_text import number, numbers

TEMPLATE = "arm.mjcf.j2"
MOST_SITES = 60
"""Demonstrated points are thinned to at most so many places each."""
POINT_COLOURS = ("0.0 0.447 0.698 1", "0.902 0.624 0.0 1", "0.0 0.62 0.451 1", "0.8 0.475 0.655 1")
"""Colours of the demonstrated points in turn, distinct for the colour-blind too."""


def robot_mjcf(robot: Robot) -> str:
    """Write a robot for MuJoCo; a pure function of it.

    Bodies, joints, position actuators ``joint_i`` and the frames are those of the URDF; the base is fixed to the
    world, in its origin or, on request, where it stands in the room. Keyframe ``start`` is the first point of the
    exported trajectory; site ``tool0_site`` is the frame of body ``tool0``; ``demo_POINT_k`` mark where the
    demonstrated points have been; the numeric ``lag`` says by how long each actuator lags [s]. The portable flavour has
    the bodies, joints and actuators alone, each attribute at its element.
    """
    parts, drives = robot_parts(robot), servos(robot)
    for i, link in enumerate(parts["links"][1:-1]):
        link["gains"] = {"kp": number(drives.kp[i]), "kv": number(drives.kv[i])}
    simulation = robot.options.simulation
    drive = {
        "damping": simulation.joint_damping,
        "frictionloss": simulation.joint_friction,
        "armature": simulation.joint_armature,
    }
    # neighbours meet at their joint; links that touch in the motion itself would push each other off it
    pairs = sorted({(i, i + 1) for i in range(robot.table.dof)} | set(robot.touching))
    neighbours = [(link_name(i), link_name(j)) for i, j in pairs]
    extras = {
        "portable": robot.options.tags.flavour == "portable",
        "gravitation": "1" if simulation.gravity_compensation else None,
        "step": number(drives.step),
        "lag": numbers(drives.lag),
        "gravity": numbers(robot.gravity),
        "root": origin_part(robot.root) if robot.options.tags.world else None,
        "drive": {name: number(value) for name, value in drive.items()},
        "start": numbers(robot.start),
        "neighbours": neighbours,
        "places": _places(robot),
    }
    return render(TEMPLATE, {**parts, **extras})


def _places(robot: Robot) -> list[dict[str, Any]]:
    """Sites of the demonstrated points."""
    sites, root = [], robot.root
    for k, (name, points) in enumerate(robot.paths.items()):
        path = points @ root[:3, :3].T + root[:3, 3] if robot.options.tags.world else points
        frames = range(0, len(path), -(-len(path) // MOST_SITES))
        colour = POINT_COLOURS[k % len(POINT_COLOURS)]
        sites += [{"name": f"demo_{name}_{t}", "pos": numbers(path[t]), "rgba": colour} for t in frames]
    return sites
