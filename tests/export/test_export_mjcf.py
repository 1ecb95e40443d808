"""The MuJoCo model: the same kinematics and dynamics as the design, drives that hold it, marks of the demonstration."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from export_designs import random_robot

from armdesign.bodies.loads import dynamic_model
from armdesign.export.mjcf import MOST_SITES, gains, robot_mjcf
from armdesign.export.options import LimitOptions, RobotOptions, SimulationOptions
from armdesign.settings import Body

mujoco = pytest.importorskip("mujoco")
DESIGNS = [(n, seed) for n in range(1, 9) for seed in range(3)]


def loaded(robot):
    model = mujoco.MjModel.from_xml_string(robot_mjcf(robot))
    return model, mujoco.MjData(model)


@pytest.mark.parametrize(("n", "seed"), DESIGNS)
def test_mujoco_reads_back_the_table(n, seed):
    robot, rng = random_robot(n, seed)
    model, data = loaded(robot)
    assert [model.joint(i).name for i in range(model.njnt)] == [f"joint_{i + 1}" for i in range(n)]
    np.testing.assert_array_equal(model.jnt_range, robot.limits.position)
    for q in (np.zeros(n), *rng.uniform(*robot.limits.position.T, (3, n))):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        frames = robot.table.frames(q)
        names = [*(f"link_{i + 1}" for i in range(n)), "tool0"]
        for name, frame in zip(names, frames, strict=True):
            np.testing.assert_allclose(data.body(name).xpos, frame[:3, 3], atol=1e-12)
            np.testing.assert_allclose(data.body(name).xmat.reshape(3, 3), frame[:3, :3], atol=1e-12)
        np.testing.assert_allclose(data.site("tool0").xpos, frames[-1][:3, 3], atol=1e-12)
        np.testing.assert_allclose(data.site("tool0").xmat.reshape(3, 3), frames[-1][:3, :3], atol=1e-12)


@pytest.mark.parametrize(("n", "seed"), DESIGNS[::3])
def test_torques_are_those_of_pinocchio(n, seed):
    silent = SimulationOptions(joint_damping=0.0, joint_armature=0.0)
    robot, rng = random_robot(n, seed, RobotOptions(simulation=silent))
    model, data = loaded(robot)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    q, v, a = rng.uniform(-1, 1, (3, n))
    data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
    mujoco.mj_inverse(model, data)
    reference = dynamic_model(robot.arm)
    expected = pin.rnea(reference, reference.createData(), q, v, a)
    np.testing.assert_allclose(data.qfrc_inverse, expected, atol=1e-8 * max(1.0, np.abs(expected).max()))


def test_every_joint_has_a_drive_with_its_limits():
    robot, _ = random_robot(5, 1)
    model, _ = loaded(robot)
    assert [model.actuator(i).name for i in range(5)] == [f"joint_{i + 1}" for i in range(5)]
    np.testing.assert_array_equal(model.actuator_ctrlrange, robot.limits.position)
    np.testing.assert_array_equal(model.actuator_forcerange[:, 1], robot.limits.effort)
    np.testing.assert_array_equal(model.actuator_forcerange[:, 0], -robot.limits.effort)
    kp, kv = gains(robot)
    np.testing.assert_allclose(model.actuator_gainprm[:, 0], kp, rtol=1e-15)
    np.testing.assert_allclose(model.actuator_biasprm[:, 1:3], -np.stack([kp, kv], axis=1), rtol=1e-15)


def test_the_drives_are_critically_damped_at_their_bandwidth():
    options = RobotOptions(simulation=SimulationOptions(bandwidth=5.0, joint_armature=0.3))
    robot, _ = random_robot(4, 2, options)
    model, data = loaded(robot)
    model.opt.gravity[:] = 0.0
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    kp, kv = gains(robot)
    omega = 2 * np.pi * 5.0
    for i in range(4):
        data.qpos[:], data.qvel[:], data.qacc[:] = robot.start, 0.0, np.eye(4)[i]
        mujoco.mj_inverse(model, data)
        inertia = data.qfrc_inverse[i]
        assert kp[i] == pytest.approx(inertia * omega**2, rel=1e-9)
        assert kv[i] == pytest.approx(2 * inertia * omega, rel=1e-9)


def test_gains_can_be_given():
    robot, _ = random_robot(3, 1, RobotOptions(simulation=SimulationOptions(kp=100.0, kv=7.0)))
    kp, kv = gains(robot)
    assert kp.tolist() == [100.0] * 3
    assert kv.tolist() == [7.0] * 3


def test_a_payload_makes_the_drives_stiffer():
    light, _ = random_robot(3, 1)
    heavy, _ = random_robot(3, 1, RobotOptions(limits=LimitOptions(payload=5.0)))
    assert (gains(heavy)[0] >= gains(light)[0]).all()


def test_joint_options_arrive():
    simulation = SimulationOptions(joint_damping=0.7, joint_friction=0.2, joint_armature=0.05)
    model, _ = loaded(random_robot(3, 0, RobotOptions(simulation=simulation))[0])
    assert model.dof_damping.tolist() == [0.7] * 3
    assert model.dof_frictionloss.tolist() == [0.2] * 3
    assert model.dof_armature.tolist() == [0.05] * 3


def test_the_start_is_a_keyframe():
    robot, _ = random_robot(6, 1)
    model, data = loaded(robot)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    np.testing.assert_array_equal(data.qpos, robot.start)
    np.testing.assert_array_equal(data.ctrl, robot.start)


def test_the_drives_hold_the_start_against_gravity():
    robot, _ = random_robot(3, 1)
    strong = replace(robot, limits=replace(robot.limits, effort=np.full(3, 1e3)))
    model, data = loaded(strong)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
    for _ in range(500):
        mujoco.mj_step(model, data)
    np.testing.assert_allclose(data.qpos, robot.start, atol=np.radians(0.5))


@pytest.mark.parametrize(("n", "seed"), DESIGNS[::4])
def test_the_bodies_weigh_what_the_solids_do(n, seed):
    robot, _ = random_robot(n, seed)
    model, _ = loaded(robot)
    expected = sum(body.inertial.mass for body in robot.bodies) + Body().tool_mass
    assert model.body_mass.sum() == pytest.approx(expected, rel=1e-12)
    shapes = sum(len(body.visual) + len(body.collision) for body in robot.bodies)
    assert model.ngeom == shapes
    assert (model.geom_contype > 0).sum() == sum(len(body.collision) for body in robot.bodies)


def test_the_demonstrated_points_are_marked():
    robot, rng = random_robot(2, 0)
    paths = {"elbow": rng.normal(size=(7, 3)), "hand": rng.normal(size=(1000, 3))}
    robot = replace(robot, paths=paths)
    model, data = loaded(robot)
    mujoco.mj_kinematics(model, data)
    names = [model.site(i).name for i in range(model.nsite)]
    assert sum(name.startswith("demo_elbow_") for name in names) == 7
    assert 30 < sum(name.startswith("demo_hand_") for name in names) <= MOST_SITES
    for name in names:
        if name.startswith("demo_"):
            _, point, frame = name.split("_")
            np.testing.assert_array_equal(data.site(name).xpos, paths[point][int(frame)])


def test_the_text_is_plain_and_repeatable():
    robot, _ = random_robot(5, 2)
    text = robot_mjcf(robot)
    assert text == robot_mjcf(robot)
    assert text.isascii()
    assert not list(ElementTree.fromstring(text).iter("mesh"))
