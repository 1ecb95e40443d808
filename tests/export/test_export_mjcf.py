"""The MuJoCo model: the same kinematics and dynamics as the design, drives that hold it, marks of the demonstration."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from export_designs import random_robot

from armdesign.bodies.loads import dynamic_model
from armdesign.export.mjcf import MOST_SITES, robot_mjcf
from armdesign.export.options import LimitOptions, RobotOptions, SimulationOptions, TagOptions
from armdesign.export.robot_file import Pace, finished_robot
from armdesign.export.servos import BEHIND, lag_note, servos
from armdesign.export.trajectory.exporting import TrajectoryOptions, make_trajectory
from armdesign.export.trajectory.tool_poses import tool_poses
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
        np.testing.assert_allclose(data.site("tool0_site").xpos, frames[-1][:3, 3], atol=1e-12)
        np.testing.assert_allclose(data.site("tool0_site").xmat.reshape(3, 3), frames[-1][:3, :3], atol=1e-12)


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
    np.testing.assert_allclose(model.actuator_ctrlrange, robot.limits.position, atol=1e-15)  # inherited, in MuJoCo
    np.testing.assert_array_equal(model.actuator_forcerange[:, 1], robot.limits.effort)
    np.testing.assert_array_equal(model.actuator_forcerange[:, 0], -robot.limits.effort)
    kp, kv, _, _ = servos(robot)
    np.testing.assert_allclose(model.actuator_gainprm[:, 0], kp, rtol=1e-15)
    np.testing.assert_allclose(model.actuator_biasprm[:, 1:3], -np.stack([kp, kv], axis=1), rtol=1e-15)


def test_the_drives_are_critically_damped_at_their_bandwidth():
    options = RobotOptions(simulation=SimulationOptions(bandwidth=5.0, joint_armature=0.3))
    robot, _ = random_robot(4, 2, options)
    model, data = loaded(robot)
    model.opt.gravity[:] = 0.0
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    kp, kv, lag, _ = servos(robot)
    omega = 2 * np.pi * 5.0
    for i in range(4):
        data.qpos[:], data.qvel[:], data.qacc[:] = robot.start, 0.0, np.eye(4)[i]
        mujoco.mj_inverse(model, data)
        inertia = data.qfrc_inverse[i]
        assert kp[i] == pytest.approx(inertia * omega**2, rel=1e-9)
        assert kv[i] + 0.1 == pytest.approx(2 * inertia * omega, rel=1e-9)
    np.testing.assert_allclose(lag, 2 / omega, rtol=1e-9)


def test_gains_can_be_given():
    robot, _ = random_robot(3, 1, RobotOptions(simulation=SimulationOptions(kp=100.0, kv=7.0)))
    kp, kv, lag, _ = servos(robot)
    assert kp.tolist() == [100.0] * 3
    assert kv.tolist() == [7.0] * 3
    np.testing.assert_allclose(lag, 0.071)


def test_a_payload_makes_the_drives_stiffer():
    light, _ = random_robot(3, 1)
    heavy, _ = random_robot(3, 1, RobotOptions(limits=LimitOptions(payload=5.0)))
    assert (servos(heavy).kp >= servos(light).kp).all()


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


def test_the_bandwidth_keeps_the_tool_near_and_the_step_carries_it():
    robot, _ = random_robot(3, 0)
    for tool, frequency in ((0.0, 20.0), (0.2, 0.2 / (np.pi * BEHIND)), (5.0, 100.0)):
        drives = servos(replace(robot, pace=Pace(np.ones(3), tool)))
        np.testing.assert_allclose(drives.lag, 1.0 / (np.pi * frequency))
        assert drives.step * frequency <= 0.1 + 1e-12
    stiff, _ = random_robot(3, 0, RobotOptions(simulation=SimulationOptions(bandwidth=200.0)))
    assert servos(stiff).step == pytest.approx(5e-4)


def test_gravity_can_be_taken_off():
    robot, _ = random_robot(4, 1, RobotOptions(simulation=SimulationOptions(gravity_compensation=True)))
    model, data = loaded(robot)
    data.qpos[:] = robot.start
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.qfrc_bias, data.qfrc_passive, atol=1e-9)


def test_the_model_follows_the_exported_trajectory_and_the_lag_takes_the_rest_out(each):
    timing = TrajectoryOptions(rate=1000.0)
    robot, motion = finished_robot(each.run, timing=timing), make_trajectory(each.run, timing).motion
    np.testing.assert_array_equal(robot.start, motion.q[0])
    np.testing.assert_allclose(robot.pace.joints, np.abs(motion.v).max(axis=0), rtol=0.02)
    model, data = loaded(robot)
    lag = model.numeric("lag").data
    np.testing.assert_array_equal(lag, servos(robot).lag)
    wanted = tool_poses(robot.table, motion.q)[:, :3, 3]
    worst = []
    for ahead in (0.0, lag):
        mujoco.mj_resetDataKeyframe(model, data, model.key("start").id)
        q = []
        for angles, speeds in zip(motion.q, motion.v, strict=True):
            data.ctrl[:] = angles + ahead * speeds
            q.append(data.qpos.copy())
            mujoco.mj_step(model, data)
            assert (np.abs(data.actuator_force) < robot.limits.effort).all()
            assert data.ncon == 0
        worst.append(np.linalg.norm(tool_poses(robot.table, np.array(q))[:, :3, 3] - wanted, axis=1).max())
    assert worst[0] < 1.2 * lag.max() * robot.pace.tool + 3e-4
    assert worst[1] < 3e-4
    assert f"{1e3 * lag.max() * robot.pace.tool:.1f} mm" in lag_note(robot)


@pytest.mark.parametrize("flavour", ["mujoco", "portable"])
def test_frames_have_names_of_their_own_in_pinocchio(flavour, tmp_path):
    robot, rng = random_robot(4, 2, RobotOptions(tags=TagOptions(flavour=flavour)))
    path = tmp_path / "arm.xml"
    path.write_text(robot_mjcf(robot))
    model = pin.buildModelFromMJCF(str(path))
    data, q = model.createData(), rng.uniform(*robot.limits.position.T)
    pin.framesForwardKinematics(model, data, q)
    np.testing.assert_allclose(data.oMf[model.getFrameId("tool0")].homogeneous, robot.table.frames(q)[-1], atol=1e-9)


@pytest.mark.slow  # PyBullet has no wheels for newer Pythons
@pytest.mark.parametrize("seed", [2, 3])
def test_bullet_reads_the_portable_flavour(seed, tmp_path):
    bullet = pytest.importorskip("pybullet")
    robot, rng = random_robot(5, seed, RobotOptions(tags=TagOptions(flavour="portable")))
    path = tmp_path / "arm.xml"
    path.write_text(robot_mjcf(robot))
    client = bullet.connect(bullet.DIRECT)
    try:
        arms = bullet.loadMJCF(str(path))
        joints = [(arm, j) for arm in arms for j in range(bullet.getNumJoints(arm))]
        moving = {bullet.getJointInfo(*joint)[1].decode(): joint for joint in joints}
        q = rng.uniform(*robot.limits.position.T)
        for i, angle in enumerate(q):
            bullet.resetJointState(*moving[f"joint_{i + 1}"], angle)
        tool = next(joint for joint in joints if bullet.getJointInfo(*joint)[12].decode() == "tool0")
        place = bullet.getLinkState(*tool, computeForwardKinematics=True)[4]
        place = np.add(place, bullet.getDynamicsInfo(tool[0], -1)[3])  # Bullet puts the base's centre of mass at 0
        np.testing.assert_allclose(place, robot.table.frames(q)[-1][:3, 3], atol=1e-5)
    finally:
        bullet.disconnect(client)


def test_the_portable_flavour_is_the_same_arm_to_mujoco():
    models = [
        loaded(random_robot(5, 3, RobotOptions(tags=TagOptions(flavour=flavour)))[0])[0]
        for flavour in ("mujoco", "portable")
    ]
    joints = ("body_mass", "jnt_range", "jnt_axis", "jnt_type", "dof_armature", "dof_damping")
    drives = ("actuator_gainprm", "actuator_biasprm", "actuator_ctrlrange", "actuator_forcerange")
    for name in (*joints, "geom_size", "geom_contype", *drives):
        np.testing.assert_array_equal(*(getattr(model, name) for model in models))
    assert models[1].nsite == models[1].nkey == 0
