"""Arms with a place in the room: with ``--world`` every file has the base there, and the tool where the room has it."""

from __future__ import annotations

import io
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy
from export_designs import random_robot
from scipy.spatial.transform import Rotation

from armdesign.bodies.loads import base_gravity
from armdesign.export.mjcf import robot_mjcf
from armdesign.export.options import RobotOptions, TagOptions
from armdesign.export.sdf import robot_sdf
from armdesign.export.urdf import robot_urdf
from armdesign.export.xacro import robot_xacro
from armdesign.kinematics.base_pose import MOUNTINGS, placed_base

IN_ROOM = RobotOptions(tags=TagOptions(world=True))


def standing(mounted, options=IN_ROOM):
    """A robot that stands somewhere, a pose of its joints, and where its tool then is in the room."""
    robot, rng = random_robot(4, sorted(MOUNTINGS).index(mounted), options)
    robot = replace(robot, base=placed_base(rng.uniform(-2, 2, 3), rng.uniform(-3, 3), mounted))
    q = rng.uniform(*robot.limits.position.T)
    return robot, q, robot.base.matrix @ robot.table.frames(q)[-1]


@pytest.mark.parametrize("mounted", MOUNTINGS)
def test_readers_of_the_urdf_have_the_tool_where_the_room_has_it(mounted):
    robot, q, tool = standing(mounted)
    text = robot_urdf(robot)
    model = pin.buildModelFromXML(text)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    np.testing.assert_allclose(data.oMf[model.getFrameId("tool0")].homogeneous, tool, atol=1e-9)
    loaded = yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False)
    loaded.update_cfg(dict(zip(loaded.actuated_joint_names, q, strict=True)))
    np.testing.assert_allclose(loaded.get_transform("tool0", "world"), tool, atol=1e-9)


@pytest.mark.parametrize("mounted", MOUNTINGS)
def test_mujoco_has_the_tool_where_the_room_has_it_and_the_room_s_gravity(mounted):
    mujoco = pytest.importorskip("mujoco")
    robot, q, tool = standing(mounted)
    for text in (robot_urdf(robot), robot_mjcf(robot)):
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        np.testing.assert_allclose(data.body("tool0").xpos, tool[:3, 3], atol=1e-9)
        np.testing.assert_allclose(data.body("tool0").xmat.reshape(3, 3), tool[:3, :3], atol=1e-9)
        np.testing.assert_array_equal(model.opt.gravity, [0.0, 0.0, -9.81])


@pytest.mark.parametrize("mounted", MOUNTINGS)
def test_the_drives_feel_gravity_alike_in_the_room_and_in_the_base_s_frame(mounted):
    mujoco = pytest.importorskip("mujoco")
    torques = []
    for options in (IN_ROOM, RobotOptions()):
        robot, q, _ = standing(mounted, options)
        model = mujoco.MjModel.from_xml_string(robot_mjcf(robot))
        data = mujoco.MjData(model)
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        torques.append(data.qfrc_bias.copy())
        np.testing.assert_allclose(model.opt.gravity, robot.gravity, atol=1e-15)
    np.testing.assert_allclose(*torques, atol=1e-9)
    np.testing.assert_allclose(robot.gravity, base_gravity(robot.base))


@pytest.mark.parametrize("mounted", MOUNTINGS)
def test_sdf_and_xacro_put_the_base_where_it_stands(mounted):
    robot, _, _ = standing(mounted)
    sdf = ElementTree.fromstring(robot_sdf(robot)).find("model/link[@name='base_link']/pose").text
    xacro = robot_xacro(robot, "arm_macro.xacro")
    places = {item.get("name"): item.get("default") for item in ElementTree.fromstring(xacro) if item.get("default")}
    for text in (sdf, f"{places['xyz']} {places['rpy']}"):
        numbers = np.array(text.split(), dtype=float)
        np.testing.assert_allclose(numbers[:3], robot.base.translation, atol=1e-12)
        turn = Rotation.from_euler("xyz", numbers[3:]).as_matrix()
        np.testing.assert_allclose(turn, robot.base.rotation, atol=1e-12)


def test_the_marks_of_the_demonstration_move_with_the_base():
    mujoco = pytest.importorskip("mujoco")
    robot, _, _ = standing("wall")
    path = np.random.default_rng(0).normal(size=(5, 3))
    model = mujoco.MjModel.from_xml_string(robot_mjcf(replace(robot, paths={"hand": path})))
    expected = path @ robot.base.rotation.T + robot.base.translation
    found = [model.site(f"demo_hand_{t}").pos for t in range(5)]
    np.testing.assert_allclose(found, expected, atol=1e-12)


def test_without_world_nothing_of_the_place_is_in_the_urdf():
    robot, _, _ = standing("ceiling", RobotOptions())
    assert robot_urdf(robot) == robot_urdf(replace(robot, base=placed_base([0, 0, 0], 0.0)))
