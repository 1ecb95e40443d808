"""The SDF model: poses composed as its specification says give the design's frames."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest
from export_designs import random_robot
from scipy.spatial.transform import Rotation

from armdesign.export.options import RobotOptions, SimulationOptions
from armdesign.export.sdf import robot_sdf

DESIGNS = [(n, seed) for n in range(1, 9) for seed in range(3)]


def model_of(robot):
    root = ElementTree.fromstring(robot_sdf(robot))
    assert root.tag == "sdf"
    assert tuple(map(int, root.get("version").split("."))) >= (1, 7)
    return root.find("model")


def pose(element):
    """A pose element as a matrix: x y z, then roll pitch yaw about fixed axes."""
    values = np.array([float(word) for word in element.text.split()])
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_euler("xyz", values[3:]).as_matrix()
    matrix[:3, 3] = values[:3]
    return matrix


def frames_of(model, q):
    """Poses of all links in the model frame: a link relative to its joint, a joint relative to its parent link."""
    joints = {joint.get("name"): joint for joint in model.findall("joint")}
    angles = dict(zip([f"joint_{i + 1}" for i in range(len(q))], q, strict=True))
    found = {}
    for link in model.findall("link"):
        joint = joints.get(link.find("pose").get("relative_to"))
        before = np.eye(4)
        if joint is not None:
            assert joint.find("child").text == link.get("name")
            parent = joint.find("pose").get("relative_to")
            assert parent == joint.find("parent").text
            before = found[parent] @ pose(joint.find("pose"))
            if joint.get("type") == "revolute":
                assert joint.find("axis/xyz").text == "0 0 1"
                turn = np.eye(4)
                turn[:3, :3] = Rotation.from_euler("z", angles[joint.get("name")]).as_matrix()
                before = before @ turn
            if joint.get("type") == "prismatic":
                assert joint.find("axis/xyz").text == "0 0 1"
                way = np.eye(4)
                way[2, 3] = angles[joint.get("name")]
                before = before @ way
        found[link.get("name")] = before @ pose(link.find("pose"))
    return found


@pytest.mark.parametrize(("n", "seed"), DESIGNS)
def test_the_poses_compose_to_the_table(n, seed):
    robot, rng = random_robot(n, seed)
    model = model_of(robot)
    for q in (np.zeros(n), *rng.uniform(*robot.limits.position.T, (2, n))):
        found = frames_of(model, q)
        for name, frame in zip([*(f"link_{i + 1}" for i in range(n)), "tool0"], robot.table.frames(q), strict=True):
            np.testing.assert_allclose(found[name], frame, atol=1e-12)


@pytest.mark.parametrize(("n", "seed"), DESIGNS[::4])
def test_links_have_the_bodies_of_the_design(n, seed):
    robot, _ = random_robot(n, seed)
    links = model_of(robot).findall("link")
    assert [link.get("name") for link in links] == ["base_link", *(f"link_{i + 1}" for i in range(n)), "tool0"]
    for link, body in zip(links, robot.bodies, strict=False):
        inertial = link.find("inertial")
        assert float(inertial.find("mass").text) == body.inertial.mass
        np.testing.assert_array_equal(pose(inertial.find("pose"))[:3, 3], body.inertial.com)
        found = {entry.tag: float(entry.text) for entry in inertial.find("inertia")}
        assert found["ixx"] == body.inertial.inertia[0, 0]
        assert found["iyz"] == body.inertial.inertia[1, 2]
        for kind in ("visual", "collision"):
            parts = link.findall(kind)
            assert len({part.get("name") for part in parts}) == len(parts) == len(getattr(body, kind))
            for part, solid in zip(parts, getattr(body, kind), strict=True):
                np.testing.assert_allclose(pose(part.find("pose")), solid.pose, atol=1e-15)
                assert float(part.find("geometry/cylinder/length").text) == solid.length


def test_joints_have_their_limits_and_losses():
    options = RobotOptions(simulation=SimulationOptions(joint_damping=0.4, joint_friction=0.3))
    robot, _ = random_robot(4, 1, options)
    joints = model_of(robot).findall("joint")
    moving = [joint for joint in joints if joint.get("type") in ("revolute", "prismatic")]
    assert [joint.get("name") for joint in moving] == [f"joint_{i + 1}" for i in range(4)]
    for i, joint in enumerate(moving):
        limit = {entry.tag: float(entry.text) for entry in joint.find("axis/limit")}
        assert (limit["lower"], limit["upper"]) == tuple(robot.limits.position[i])
        assert (limit["effort"], limit["velocity"]) == (robot.limits.effort[i], robot.limits.velocity[i])
        assert {entry.tag: float(entry.text) for entry in joint.find("axis/dynamics")} == {
            "damping": 0.4,
            "friction": 0.3,
        }


def test_the_base_is_fixed_to_the_world():
    joint = model_of(random_robot(3, 0)[0]).find("joint")
    assert joint.get("type") == "fixed"
    assert (joint.find("parent").text, joint.find("child").text) == ("world", "base_link")


def test_names_are_told_apart():
    model = model_of(random_robot(5, 1)[0])
    names = [item.get("name") for item in (*model.findall("link"), *model.findall("joint"))]
    assert len(set(names)) == len(names)
