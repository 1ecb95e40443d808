"""The arm as a native MuJoCo model: drives, collision classes, a site at tool0, the demonstrated points, the start."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin

from armdesign._types import Array
from armdesign.bodies.arm_body import link_name
from armdesign.bodies.loads import dynamic_model
from armdesign.export.parts import origin_part, robot_parts
from armdesign.export.robot_file import Robot
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
    world, in its origin or, on request, where it stands in the room. Keyframe ``start`` is the first pose of the
    demonstration. Sites ``demo_POINT_k`` mark where the demonstrated points have been.
    """
    parts = robot_parts(robot)
    stiffness, damping = gains(robot)
    for i, link in enumerate(parts["links"][1:-1]):
        link["gains"] = {"kp": number(stiffness[i]), "kv": number(damping[i])}
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
        "gravity": numbers(robot.gravity),
        "root": origin_part(robot.root) if robot.options.tags.world else None,
        "drive": {name: number(value) for name, value in drive.items()},
        "start": numbers(robot.start),
        "neighbours": neighbours,
        "places": _places(robot),
    }
    return render(TEMPLATE, {**parts, **extras})


def gains(robot: Robot) -> tuple[Array, Array]:
    """Gains of the position actuators: kp = M omega^2 and kv = 2 M omega, unless they are given.

    M is what a joint moves in the start pose, the diagonal of the mass matrix with payload and armature; omega is 2 pi
    times the bandwidth.

    Returns:
        Position gains [N m/rad] and velocity gains [N m s/rad], shape (n,) each.
    """
    options = robot.options
    model = dynamic_model(robot.arm, options.limits.payload or 0.0)
    inertia = np.diag(pin.crba(model, model.createData(), robot.start)) + options.simulation.joint_armature
    omega = 2.0 * np.pi * options.simulation.bandwidth
    kp = inertia * omega**2 if options.simulation.kp is None else np.full(robot.table.dof, options.simulation.kp)
    kv = (
        2.0 * np.sqrt(kp * inertia)
        if options.simulation.kv is None
        else np.full(robot.table.dof, options.simulation.kv)
    )
    return kp, kv


def _places(robot: Robot) -> list[dict[str, Any]]:
    """Sites of the demonstrated points."""
    sites, root = [], robot.root
    for k, (name, points) in enumerate(robot.paths.items()):
        path = points @ root[:3, :3].T + root[:3, 3] if robot.options.tags.world else points
        frames = range(0, len(path), -(-len(path) // MOST_SITES))
        colour = POINT_COLOURS[k % len(POINT_COLOURS)]
        sites += [{"name": f"demo_{name}_{t}", "pos": numbers(path[t]), "rgba": colour} for t in frames]
    return sites
