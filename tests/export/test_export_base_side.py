"""Where the base plate stands, out of the way of the motion, and which links are said to touch."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from export_designs import random_design

from armdesign.bodies.arm_body import SIDES, arm_body
from armdesign.bodies.exact import free_side
from armdesign.export.contacts import touching_links
from armdesign.export.joints import joint_limits
from armdesign.export.options import RobotOptions, TagOptions
from armdesign.export.robot_file import make_robot
from armdesign.export.urdf import robot_urdf
from armdesign.kinematics.dh import DHTable
from armdesign.settings import Body

OPTIONS = Body()
ELBOW = DHTable.from_rows([(np.pi / 2, 0, 0.3), (0, 0, 0), (0, 0.3, 0), (0, 0.3, 0)])
HANGING = DHTable.from_rows([(np.pi / 2, 0, 0), (0, 0.3, 0), (0, 0.3, 0)])
DOWN = np.stack([np.linspace(-2.0, -1.0, 30), np.linspace(0.0, 1.0, 30)], axis=1)
AXES = {"below": -2, "above": 2, "behind": -3, "front": 3, "left": 1, "right": -1}
"""Axis of each side with its sign; x as 3."""


def walk(n, seed, frames=40):
    rng = np.random.default_rng([7, n, seed])
    return rng.uniform(-3, 3, n) + np.cumsum(rng.normal(scale=0.15, size=(frames, n)), axis=0)


def written(arm, q):
    """Links that touch, by Pinocchio's own reading of the written file."""
    text = robot_urdf(make_robot(arm, joint_limits(arm.table.prismatic)))
    model = pin.buildModelFromXML(text)
    shapes = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    shapes.addAllCollisionPairs()
    data, room = model.createData(), pin.GeometryData(shapes)
    found = set()
    for angles in q:
        pin.computeCollisions(model, data, shapes, room, angles, False)
        for pair, result in zip(shapes.collisionPairs, room.collisionResults, strict=True):
            if result.isCollision():
                joints = (shapes.geometryObjects[k].parentJoint for k in (pair.first, pair.second))
                found.add(tuple(sorted(joints)))
    return found


@pytest.mark.parametrize(("n", "seed"), [(n, seed) for n in range(1, 9) for seed in range(2)])
def test_links_said_to_touch_are_those_that_do_in_the_file(n, seed):
    table, q = random_design(n, seed)[0], walk(n, seed)
    slides = table.d[:-1] + np.random.default_rng(seed).uniform(-0.1, 0.1, n)
    arm = arm_body(table, OPTIONS, slides)
    said, found = set(touching_links(arm, q)), written(arm, q)
    riding = {(j, j + 1) for j in range(n) if table.prismatic[j]}  # a carriage on its rail is not said
    assert said <= found
    assert found - said <= riding


def test_an_arm_that_is_apart_has_no_link_that_touches():
    arm = arm_body(DHTable.from_rows([(0, 0, 0.3), (0, 0.3, 0), (0, 0.3, 0.0), (0, 0.2, 0)]), OPTIONS, placed=True)
    q = np.stack([np.linspace(-3, 3, 40), np.linspace(-1.5, 1.5, 40), np.linspace(1.5, -1.5, 40)], axis=1)
    assert touching_links(arm, q) == {}


def test_the_plate_makes_way_for_an_arm_that_hangs():
    below = arm_body(HANGING, OPTIONS)
    assert touching_links(below, DOWN)
    assert free_side(below, DOWN) == "above"
    assert not touching_links(arm_body(HANGING, OPTIONS, side="above"), DOWN)


def test_the_plate_stays_below_where_it_is_in_nobodys_way():
    assert free_side(arm_body(ELBOW, OPTIONS), np.array([[0.0, 0.5, 0.5], [1.0, 0.5, 1.0]])) == "below"


def test_the_side_does_not_depend_on_the_one_before():
    assert {free_side(arm_body(HANGING, OPTIONS, side=side), DOWN) for side in (*SIDES, None)} == {"above"}


@pytest.mark.parametrize("side", SIDES)
def test_the_plate_stands_on_its_side(side):
    axis = np.sign(AXES[side]) * np.eye(3)[abs(AXES[side]) % 3]
    options = RobotOptions(tags=TagOptions(base_side=side))
    plate, post = make_robot(ELBOW, joint_limits(3 * [False]), options).bodies[0].visual[:2]
    for part, distance in ((plate, OPTIONS.reach + OPTIONS.base_height / 2), (post, OPTIONS.reach / 2)):
        np.testing.assert_allclose(part.pose[:3, 3], distance * axis, atol=1e-15)
        np.testing.assert_allclose(np.abs(part.pose[:3, 2]), np.abs(axis), atol=1e-15)
