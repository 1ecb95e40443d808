"""The parts of a robot as text for the templates: links with their solids, and the joints that carry them."""

from __future__ import annotations

from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.bodies.arm_body import link_name, tool_inertial
from armdesign.bodies.cylinder import Cylinder
from armdesign.bodies.inertia import Inertial
from armdesign.export.robot_file import Robot
from armdesign.export.xml_text import number, numbers, quaternion, rpy

BASE_LINK = "base_link"
TOOL_LINK = "tool0"
WORLD = "world"
MATERIALS = {"base": (0.25, 0.25, 0.28, 1.0), "joint": (0.9, 0.45, 0.1, 1.0), "tube": (0.75, 0.77, 0.8, 1.0)}
"""Colours, red green blue alpha."""


def robot_parts(robot: Robot) -> dict[str, Any]:
    """Name, materials and links of a robot, parents first; tool0 comes last."""
    names = [link_name(i) for i in range(robot.table.dof + 1)]
    placements = robot.table.placements()
    joints: list[dict[str, Any] | None] = [None]
    for i, placement in enumerate(placements[:-1]):
        lower, upper = robot.limits.position[i]
        limits = {
            "lower": lower,
            "upper": upper,
            "effort": robot.limits.effort[i],
            "velocity": robot.limits.velocity[i],
        }
        limit = {key: number(value) for key, value in limits.items()}
        kind = "prismatic" if robot.table.prismatic[i] else "revolute"
        joints.append({**joint_part(f"joint_{i + 1}", names[i], placement), "type": kind, "limit": limit})
    links = []
    for name, body, joint in zip(names, robot.bodies, joints, strict=True):
        kinds = {"visual": body.visual, "collision": body.collision}
        solids = {kind: [cylinder_part(part) for part in parts] for kind, parts in kinds.items()}
        links.append({**bare_link(name, body.inertial, joint), **solids})
    hand = joint_part(f"{TOOL_LINK}_fixed", names[-1], placements[-1])
    links.append(bare_link(TOOL_LINK, tool_inertial(robot.arm.options), hand))
    materials = {material: numbers(rgba) for material, rgba in MATERIALS.items()}
    return {"name": robot.name, "materials": materials, "links": links}


def origin_part(pose: Array) -> dict[str, str]:
    """A frame's xyz [m], its rpy [rad] and its quaternion w x y z."""
    turn = pose[:3, :3]
    return {"xyz": numbers(pose[:3, 3]), "rpy": numbers(rpy(turn)), "quat": numbers(quaternion(turn))}


def joint_part(name: str, parent: str, pose: Array) -> dict[str, Any]:
    """A fixed joint to a parent at a pose in the parent's frame."""
    return {"name": name, "parent": parent, **origin_part(pose), "type": "fixed", "limit": None}


def inertial_part(inertial: Inertial) -> dict[str, Any]:
    """An inertial given at the centre of mass along the link's axes; ``full`` has the moments before the products."""
    matrix = inertial.inertia
    entries = {f"i{'xyz'[r]}{'xyz'[c]}": number(matrix[r, c]) for r in range(3) for c in range(r, 3)}
    full = numbers([*np.diag(matrix), matrix[0, 1], matrix[0, 2], matrix[1, 2]])
    return {"mass": number(inertial.mass), "com": numbers(inertial.com), "moments": entries, "full": full}


def cylinder_part(part: Cylinder) -> dict[str, str]:
    """A cylinder."""
    lengths = {"radius": part.radius, "length": part.length, "half": part.length / 2.0}
    return {
        **origin_part(part.pose),
        **{key: number(value) for key, value in lengths.items()},
        "material": part.material,
    }


def bare_link(name: str, inertial: Inertial | None, joint: dict[str, Any] | None) -> dict[str, Any]:
    """A link without solids."""
    mass = None if inertial is None else inertial_part(inertial)
    return {"name": name, "inertial": mass, "visual": [], "collision": [], "joint": joint}
