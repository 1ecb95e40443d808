"""What a planner reads: which links may touch, SRDF, controllers, MoveIt's files, the ROS 2 package."""

from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
import yaml
from export_designs import random_robot

from armdesign.bodies.arm_body import arm_body, link_name
from armdesign.errors import SettingsError
from armdesign.export import planning
from armdesign.export.contacts import contacts
from armdesign.export.joints import joint_limits
from armdesign.export.options import RobotOptions, TagOptions
from armdesign.export.planning import (
    CONTROLLER,
    GROUP,
    START,
    controllers_yaml,
    joint_limits_yaml,
    kinematics_yaml,
    moveit_controllers_yaml,
    robot_srdf,
    sampled_contacts,
)
from armdesign.export.robot_file import make_robot
from armdesign.export.ros_package import LAUNCHES, ros_package
from armdesign.export.urdf import robot_urdf
from armdesign.kinematics.dh import DHTable
from armdesign.settings import Body


def touching(robot, q):
    """Pairs of links that touch, by Pinocchio's own reading of the URDF."""
    text = robot_urdf(robot)
    model = pin.buildModelFromXML(text)
    shapes = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    shapes.addAllCollisionPairs()
    data, room, found = model.createData(), pin.GeometryData(shapes), set()
    for pose in q:
        pin.computeCollisions(model, data, shapes, room, pose, False)
        for pair, result in zip(shapes.collisionPairs, room.collisionResults, strict=True):
            if result.isCollision():
                found.add(tuple(sorted(shapes.geometryObjects[k].parentJoint for k in (pair.first, pair.second))))
    return found


@pytest.fixture(autouse=True)
def few_samples(monkeypatch):
    monkeypatch.setattr(planning, "SAMPLES", 150)


@pytest.mark.parametrize("seed", [0, 2, 4])
def test_pairs_that_never_touch_do_not_touch_in_other_poses_either(seed):
    robot, rng = random_robot(5, seed)
    reasons = sampled_contacts(robot.arm, robot.limits.position, samples=4000).reasons
    assert all(reasons[i, i + 1] == "Adjacent" for i in range(5))
    others = touching(robot, rng.uniform(*robot.limits.position.T, (200, 5)))
    never = {pair for pair, reason in reasons.items() if reason == "Never"}
    assert len(never & others) <= 1  # a few samples may miss one
    assert {pair for pair, reason in reasons.items() if reason == "Always"} <= others


def test_pairs_that_the_demonstration_touches_are_checked():
    robot, _ = random_robot(5, 0)
    before = sampled_contacts(robot.arm, robot.limits.position, samples=200).reasons
    never = next(pair for pair, reason in before.items() if reason == "Never")
    assert never not in sampled_contacts(robot.arm, robot.limits.position, {never}, samples=200).reasons


def test_the_free_share_of_a_folding_arm_is_that_of_its_angles():
    # the third link of a planar arm meets the first link's side where joint 2 folds far enough; joint 1 does not matter
    table = DHTable.from_rows([(0, 0, 0.3), (0, 0.5, 0.0), (0, 0.5, 0.0), (0, 0.5, 0.0)])
    arm = arm_body(table, Body(), placed=True)
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (1500, 3))
    robot = make_robot(arm, joint_limits(3 * [False]))
    pairs, hits = contacts(arm, q)
    apart = np.array([second - first > 1 for first, second in pairs])
    hit = hits[:, apart].any(axis=1)
    assert 0.02 < hit.mean() < 0.9
    assert np.abs(q[hit, 1:]).max(axis=1).min() > 1.3  # only where one of the two folds
    assert sampled_contacts(arm, robot.limits.position, samples=1500).free == pytest.approx(1 - hit.mean(), abs=0.04)


@pytest.mark.parametrize(("n", "seed"), [(1, 0), (3, 1), (6, 5)])
def test_the_srdf_names_what_the_urdf_has(n, seed):
    robot, _ = random_robot(n, seed)
    urdf, srdf = ElementTree.fromstring(robot_urdf(robot)), ElementTree.fromstring(robot_srdf(robot))
    links = {link.get("name") for link in urdf.findall("link")}
    assert srdf.get("name") == urdf.get("name")
    chain = srdf.find(f"group[@name='{GROUP}']/chain")
    assert {chain.get("base_link"), chain.get("tip_link")} <= links
    pairs = [(each.get("link1"), each.get("link2")) for each in srdf.findall("disable_collisions")]
    assert len(set(pairs)) == len(pairs)
    assert {link for pair in pairs for link in pair} <= links
    assert (link_name(n), "tool0") in pairs
    state = srdf.find(f"group_state[@name='{START}']")
    assert [float(joint.get("value")) for joint in state] == robot.start.tolist()
    assert srdf.find("virtual_joint").get("child_link") == "base_link"
    model = pin.buildModelFromXML(robot_urdf(robot))
    shapes = pin.buildGeomFromUrdfString(model, robot_urdf(robot), pin.GeometryType.COLLISION)
    shapes.addAllCollisionPairs()
    before = len(shapes.collisionPairs)
    pin.removeCollisionPairsFromXML(model, shapes, robot_srdf(robot))  # Pinocchio reads SRDF
    assert len(shapes.collisionPairs) < before
    pin.loadReferenceConfigurationsFromXML(model, robot_srdf(robot))
    np.testing.assert_array_equal(model.referenceConfigurations[START], robot.start)


def test_controllers_and_moveit_name_every_joint():
    robot, _ = random_robot(4, 3)
    joints = [f"joint_{i + 1}" for i in range(4)]
    controllers = yaml.safe_load(controllers_yaml(robot))
    assert CONTROLLER in controllers["controller_manager"]["ros__parameters"]
    assert controllers[CONTROLLER]["ros__parameters"]["joints"] == joints
    moveit = yaml.safe_load(moveit_controllers_yaml(robot))["moveit_simple_controller_manager"]
    assert moveit["controller_names"] == [CONTROLLER]
    assert moveit[CONTROLLER]["joints"] == joints
    limits = yaml.safe_load(joint_limits_yaml(robot))["joint_limits"]
    assert [limits[name]["max_velocity"] for name in joints] == robot.limits.velocity.tolist()
    assert yaml.safe_load(kinematics_yaml(robot))[GROUP]["position_only_ik"] is True
    assert "position_only_ik" not in yaml.safe_load(kinematics_yaml(random_robot(6, 1)[0]))[GROUP]


def test_gazebo_gets_its_plugin_and_nothing_else_does():
    for hardware, there in (("gazebo", True), ("mock", False), ("my_package/Arm", False), (None, False)):
        robot, _ = random_robot(3, 1, RobotOptions(tags=TagOptions(ros2_control=hardware)))
        plugin = ElementTree.fromstring(robot_urdf(robot)).find("gazebo/plugin")
        assert (plugin is not None) == there
        if there:
            assert plugin.get("filename") == "gz_ros2_control-system"
            assert plugin.find("parameters").text == "controllers.yaml"


def test_a_package_is_whole():
    robot, rng = random_robot(5, 1)
    files = ros_package(robot, "my_arm2")
    manifest = ElementTree.fromstring(files["package.xml"])
    assert manifest.find("name").text == "my_arm2"
    assert "project(my_arm2)" in files["CMakeLists.txt"]
    for folder in ("urdf", "config", "launch", "rviz"):
        assert any(name.startswith(f"{folder}/") for name in files)
    for kind in LAUNCHES:
        text = files[f"launch/{kind}.launch.py"]
        compile(text, kind, "exec")
        for part in ("urdf/", "config/", "rviz/"):
            for word in text.split('"'):
                if word.startswith(part):
                    assert word in files, (kind, word)
    yaml.safe_load(files["rviz/view.rviz"])
    srdf = ElementTree.fromstring(files[f"config/{robot.name}.srdf"])
    assert srdf.find("virtual_joint") is None  # its URDF begins with the world
    model = pin.buildModelFromXML(files[f"urdf/{robot.name}.urdf"])
    q = rng.uniform(*robot.limits.position.T)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    tool = data.oMf[model.getFrameId("tool0")].homogeneous
    np.testing.assert_allclose(tool, robot.base.matrix @ robot.table.frames(q)[-1], atol=1e-12)
    assert files[f"urdf/{robot.name}_gazebo.urdf"].count("@CONTROLLERS@") == 1


@pytest.mark.parametrize("name", ["", "Arm", "my-arm", "1arm", "my__arm", "arm_", "../x", "a", 'x"'])
def test_names_that_no_package_can_have_are_refused(name):
    with pytest.raises(SettingsError, match="--package"):
        ros_package(random_robot(2, 0)[0], name)
