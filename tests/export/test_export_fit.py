"""Room for a motion: neighbours apart as the written file has them, the plate out of the way, the rest untouched."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from export_designs import random_design

from armdesign.export.contacts import CollisionScene
from armdesign.export.fit import fit_body, free_side, meet
from armdesign.export.joints import joint_limits
from armdesign.export.options import SIDES, RobotOptions, TagOptions
from armdesign.export.robot_file import make_robot
from armdesign.export.solids import BodyFit, link_bodies
from armdesign.export.urdf import robot_urdf
from armdesign.kinematics.dh import DHTable
from armdesign.settings import Body

OPTIONS = Body()
ELBOW = DHTable.from_rows([(np.pi / 2, 0, 0.3), (0, 0, 0), (0, 0.3, 0), (0, 0.3, 0)])
HANGING = DHTable.from_rows([(np.pi / 2, 0, 0), (0, 0.3, 0), (0, 0.3, 0)])
DOWN = np.stack([np.linspace(-2.0, -1.0, 30), np.linspace(0.0, 1.0, 30)], axis=1)


def walk(n, seed, frames=40):
    rng = np.random.default_rng([7, n, seed])
    return rng.uniform(-3, 3, n) + np.cumsum(rng.normal(scale=0.15, size=(frames, n)), axis=0)


def written(table, fit, q):
    """Links that touch, by Pinocchio's own reading of the written file."""
    text = robot_urdf(make_robot(table, joint_limits(table.dof), fit=fit))
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


@pytest.mark.parametrize(("n", "seed"), [(n, seed) for n in range(1, 9) for seed in range(3)])
def test_no_neighbours_touch_in_the_motion(n, seed):
    table, q = random_design(n, seed)[0], walk(n, seed)
    fitted = fit_body(table, q, OPTIONS)
    touching = written(table, fitted.fit, q)
    assert touching == set(fitted.touching)
    assert not {pair for pair in touching if pair[1] == pair[0] + 1}
    assert not {pair for pair in touching if meet(table, pair, OPTIONS.reach)}


@pytest.mark.parametrize("fold", [np.radians(angle) for angle in (150, 165, 175, 180)])
def test_a_folded_elbow_is_given_room_and_only_there(fold):
    q = np.stack([np.zeros(20), np.full(20, -1.0), np.linspace(0, fold, 20)], axis=1)
    before, fitted = written(ELBOW, None, q), fit_body(ELBOW, q, OPTIONS)
    assert (2, 3) in before
    assert not written(ELBOW, fitted.fit, q)
    assert fitted.notes == ()
    assert fitted.fit.spheres[:2] == (OPTIONS.reach,) * 2
    assert fitted.fit.spheres[2] > OPTIONS.reach


def test_a_motion_without_folds_leaves_the_body_as_it_is():
    q = np.stack([np.linspace(-1, 1, 20), np.linspace(0.5, 1, 20), np.linspace(-1, 0, 20)], axis=1)
    fitted = fit_body(ELBOW, q, OPTIONS)
    assert fitted.fit == BodyFit(spheres=(OPTIONS.reach,) * 3)
    robots = [make_robot(ELBOW, joint_limits(3), fit=fit) for fit in (fitted.fit, None)]
    assert robot_urdf(robots[0]) == robot_urdf(robots[1])


def test_the_plate_makes_way_for_an_arm_that_hangs():
    assert (0, 1) in written(HANGING, None, DOWN) or (0, 2) in written(HANGING, None, DOWN)
    fitted = fit_body(HANGING, DOWN, OPTIONS)
    assert fitted.fit.side == "above"
    assert fitted.fit.plate
    assert not written(HANGING, fitted.fit, DOWN)
    assert "above the base" in fitted.notes[0]


def test_the_side_with_most_room_is_taken():
    room = {}
    for side in SIDES:
        scene = CollisionScene(HANGING, link_bodies(HANGING, OPTIONS, BodyFit(side)))
        room[side] = scene.distance(DOWN, lambda pair: pair[0] == 0)
    assert room[free_side(HANGING, DOWN, OPTIONS)] == max(room.values())
    assert room["below"] < 0


@pytest.mark.parametrize("side", SIDES)
def test_a_side_that_was_asked_for_is_kept(side):
    fitted = fit_body(HANGING, DOWN, OPTIONS, side)
    assert fitted.fit.side == side
    assert not {pair for pair in written(HANGING, fitted.fit, DOWN) if meet(HANGING, pair, OPTIONS.reach)}


AXES = {"below": -2, "above": 2, "behind": -3, "front": 3, "left": 1, "right": -1}
"""Axis of each side with its sign; x as 3."""


@pytest.mark.parametrize("side", SIDES)
def test_the_plate_stands_on_its_side(side):
    axis = np.sign(AXES[side]) * np.eye(3)[abs(AXES[side]) % 3]
    options = RobotOptions(tags=TagOptions(base_side=side))
    plate, post = make_robot(ELBOW, joint_limits(3), options).bodies[0].visual[:2]
    for part, distance in ((plate, OPTIONS.reach + OPTIONS.base_height / 2), (post, OPTIONS.reach / 2)):
        np.testing.assert_allclose(part.pose[:3, 3], distance * axis, atol=1e-15)
        np.testing.assert_allclose(np.abs(part.pose[:3, 2]), np.abs(axis), atol=1e-15)
        assert np.linalg.det(part.pose) == pytest.approx(1.0)


def test_links_that_touch_across_others_are_told_and_left():
    table = DHTable.from_rows([(0, 0, 0.3), (np.pi / 2, 0, 0), (0, 0.2, 0), (0, 0.2, 0), (0, 0.3, 0)])
    q = np.tile([0.0, 0.5, 2.6, 2.6], (10, 1))
    fitted = fit_body(table, q, OPTIONS)
    assert (2, 4) in fitted.touching
    assert fitted.touching[2, 4] == 10
    assert any("link_2 and link_4 touch in 10 of 10 frames" in note for note in fitted.notes)


def test_the_fit_leaves_masses_and_moving_links_alone():
    table, q = random_design(5, 1)[0], walk(5, 1)
    fit = fit_body(table, q, OPTIONS).fit
    before, after = link_bodies(table, OPTIONS), link_bodies(table, OPTIONS, fit)
    assert before[0].inertial.mass == after[0].inertial.mass
    for one, other in zip(before[1:], after[1:], strict=True):
        np.testing.assert_array_equal(one.inertial.inertia, other.inertial.inertia)
        np.testing.assert_array_equal(one.inertial.com, other.inertial.com)
    assert fit_body(table, q, OPTIONS).fit == fit


def test_a_long_motion_is_looked_at_all_along():
    q = np.tile([0.0, -1.0, 0.0], (9000, 1))
    q[8000:, 2] = np.pi
    fitted = fit_body(ELBOW, q, OPTIONS)
    assert fitted.frames < 3000
    assert not written(ELBOW, fitted.fit, q[::1000])
    assert fitted.fit == replace(fitted.fit, side="below")
