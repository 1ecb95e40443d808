"""Which links of a robot file touch along a motion."""

from __future__ import annotations

from itertools import combinations

import coal
import pinocchio as pin

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody, link_name
from armdesign.errors import counted
from armdesign.kinematics.models import arm_model

Pair = tuple[int, int]
"""Two links: 0 is base_link, i is link_i."""
MOST_FRAMES = 2000
"""Longer motions are thinned to about so many frames."""


def touching_links(arm: ArmBody, q: Array) -> dict[Pair, int]:
    """How many frames of a motion each pair of links touches in, by their collision shapes; pairs that do at all.

    A carriage rides on its rail, which does not count.

    Args:
        arm: The arm and its solids.
        q: Joint angles, shape (T, n) [rad; m of prismatic joints].
    """
    model, shapes = arm_model(arm.table), pin.GeometryModel()
    carriages: set[int] = set()
    for link, body in enumerate(arm.links):
        for k, part in enumerate(body.collision):
            shape = coal.Cylinder(part.radius, part.length)
            shapes.addGeometryObject(pin.GeometryObject(f"{link}_{k}", link, pin.SE3(part.pose), shape))
            if part.material == "joint" and link and arm.table.prismatic[link - 1]:
                carriages.add(len(shapes.geometryObjects) - 1)
    parts = shapes.geometryObjects
    for k, j in combinations(range(len(parts)), 2):
        links = parts[k].parentJoint, parts[j].parentJoint
        if links[0] != links[1] and not (j in carriages and links[1] == links[0] + 1):
            shapes.addCollisionPair(pin.CollisionPair(k, j))
    data, room = model.createData(), pin.GeometryData(shapes)
    both = [sorted((parts[pair.first].parentJoint, parts[pair.second].parentJoint)) for pair in shapes.collisionPairs]
    counts: dict[Pair, int] = {}
    for angles in q:
        pin.computeCollisions(model, data, shapes, room, angles, False)
        for i, j in {tuple(pair) for pair, hit in zip(both, room.collisionResults, strict=True) if hit.isCollision()}:
            counts[i, j] = counts.get((i, j), 0) + 1
    return dict(sorted(counts.items()))


def touching_notes(touching: dict[Pair, int], frames: int) -> tuple[str, ...]:
    """What to say of links that touch.

    Args:
        touching: What ``touching_links`` found.
        frames: Of how many frames.
    """
    return tuple(
        f"{link_name(i)} and {link_name(j)} touch in {count} of {counted(frames, 'frame')} of the demonstrated motion."
        for (i, j), count in touching.items()
    )


def thinned(q: Array) -> Array:
    """A motion of at most about ``MOST_FRAMES`` frames, shape (T, n)."""
    return q[:: max(1, len(q) // MOST_FRAMES)]
