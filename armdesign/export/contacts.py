"""Which links of a robot file touch along a motion."""

from __future__ import annotations

from itertools import combinations

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

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
    pairs, hits = contacts(arm, q)
    counts = hits.sum(axis=0)
    return {pair: int(count) for pair, count in zip(pairs, counts, strict=True) if count}


def contacts(arm: ArmBody, q: Array) -> tuple[list[Pair], NDArray[np.bool_]]:
    """Which links touch in each of some poses, by their collision shapes; a carriage on its rail does not count.

    Args:
        arm: The arm and its solids.
        q: Joint angles, shape (T, n) [rad; m of prismatic joints].

    Returns:
        The pairs of links that could, ascending, and whether they do, shape (T, pairs).
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
    both = [(parts[pair.first].parentJoint, parts[pair.second].parentJoint) for pair in shapes.collisionPairs]
    pairs = sorted(set(both))
    owner = np.array([pairs.index(pair) for pair in both], dtype=np.intp)
    hits = np.zeros((len(q), len(pairs)), dtype=bool)
    for t, angles in enumerate(q):
        pin.computeCollisions(model, data, shapes, room, angles, False)
        hit = np.array([result.isCollision() for result in room.collisionResults], dtype=bool)
        hits[t, owner[hit]] = True
    return pairs, hits


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
