"""Limits from a motion: known speeds and torques, smoothing, floors and refusals."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from armdesign.bodies.arm_body import arm_body
from armdesign.bodies.loads import base_gravity, joint_torques
from armdesign.errors import DesignError, SettingsError
from armdesign.export.joints import joint_limits
from armdesign.export.limits import actuator_limits, excess_notes, peak_limits
from armdesign.export.mjcf import robot_mjcf
from armdesign.export.options import LimitOptions, RobotOptions, SimulationOptions
from armdesign.export.robot_file import make_robot
from armdesign.export.urdf import urdf_text
from armdesign.feasibility.demand import joint_demand
from armdesign.feasibility.needs import JointNeeds
from armdesign.kinematics.base_pose import BasePose, placed_base
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.motion import smooth_motion
from armdesign.settings import Body

ARM = DHTable.from_rows(
    [
        (0.5, 0, 0),
        (
            -1.57,
            0.11,
            0,
        ),
        (-0.27, 0.4, -0.2),
        (-1.57, 0, 0.1),
    ],
    base_yaw=0.3,
)
PENDULUM = DHTable.from_rows([(np.pi / 2, 0, 0), (0, 0.5, 0)])


IDEAL = SimulationOptions(joint_damping=0.0, joint_armature=0.0)
"""Drives that need nothing for themselves."""


def peaks(table, time, q, options=None, base=None, drives=IDEAL):
    assumed = RobotOptions(limits=options or LimitOptions(margin=1.5), simulation=drives)
    arm = arm_body(table, Body())
    return peak_limits(arm, [smooth_motion(time, q, arm.limits)], assumed, base or BasePose())


def wave(frames=201, seconds=2.0, joints=3):
    t = np.linspace(0.0, seconds, frames)
    phase = np.arange(joints)
    angle = 2 * np.pi * t[:, None] + phase
    return t, 0.5 * np.sin(angle), 0.5 * 2 * np.pi * np.cos(angle), -0.5 * (2 * np.pi) ** 2 * np.sin(angle)


def test_noise_barely_moves_the_peaks():
    t, q, v, _ = wave()
    noisy = q + np.random.default_rng(0).normal(scale=1e-3, size=q.shape)
    options = LimitOptions(margin=1.0, velocity_floor=1e-3, effort_floor=1e-3)
    found, clean = peaks(ARM, t, noisy, options), peaks(ARM, t, q, options)
    np.testing.assert_allclose(found[0], np.abs(v).max(axis=0), rtol=0.05)
    np.testing.assert_allclose(found[1], clean[1], rtol=0.1)


def test_a_held_pendulum_needs_its_weight_times_its_lever():
    options = Body()
    body = arm_body(PENDULUM, options).links[1].inertial
    lever = body.mass * body.com[0] + (options.tool_mass + 2.0) * 0.5
    held = peaks(PENDULUM, [0.0, 1.0, 2.0], np.zeros((3, 1)), LimitOptions(payload=2.0, margin=1.5))
    assert held[1][0] == pytest.approx(1.5 * 9.81 * lever, rel=1e-12)
    assert held[0][0] == 1.0


def test_gravity_is_felt_as_the_base_stands():
    still = np.zeros((3, 1))
    hung = peaks(PENDULUM, [0, 1, 2], still, base=placed_base([0, 0, 3.0], 0.4, "ceiling"))
    np.testing.assert_allclose(hung[1], peaks(PENDULUM, [0, 1, 2], still)[1], rtol=1e-12)
    along = peaks(PENDULUM, [0, 1, 2], still, base=placed_base([0, 0, 1.0], 0.4, "wall"))
    assert along[1][0] == pytest.approx(1.0)  # the rod hangs along the wall, its weight along itself
    np.testing.assert_allclose(base_gravity(placed_base([0, 0, 1.0], 0.4, "wall")), [9.81, 0, 0], atol=1e-15)


def test_torques_are_those_of_the_written_file():
    t, q, _, _ = wave()
    motion = smooth_motion(t, q)
    model = pin.buildModelFromXML(urdf_text(ARM))
    data = model.createData()
    expected = [pin.rnea(model, data, *s) for s in zip(motion.q, motion.v, motion.a, strict=True)]
    np.testing.assert_allclose(joint_torques(arm_body(ARM, Body()), motion), expected, atol=1e-11)


def test_torques_are_those_of_the_written_mjcf_with_its_armature_damping_and_friction():
    mujoco = pytest.importorskip("mujoco")
    drives = SimulationOptions(joint_damping=0.3, joint_armature=0.05, joint_friction=0.2)
    limits = LimitOptions(margin=1.0, velocity_floor=1e-9, effort_floor=1e-9)
    t, q, _, _ = wave()
    _, effort = peaks(ARM, t, q, limits, drives=drives)
    robot = make_robot(ARM, joint_limits(ARM.prismatic), RobotOptions(limits=limits, simulation=drives))
    model = mujoco.MjModel.from_xml_string(robot_mjcf(robot))
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    data, motion, needed = mujoco.MjData(model), smooth_motion(t, q), []
    for angles, speeds, rises in zip(motion.q, motion.v, motion.a, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = angles, speeds, rises
        mujoco.mj_inverse(model, data)
        needed.append(data.qfrc_inverse + data.qfrc_constraint + 0.2 * np.sign(speeds))
    np.testing.assert_allclose(effort, np.abs(needed).max(axis=0), rtol=1e-9)


def test_limits_scale_with_the_margin_and_stop_at_the_floor():
    t, q, _, _ = wave()
    one, two = (peaks(ARM, t, q, LimitOptions(margin=m, velocity_floor=1e-9, effort_floor=1e-9)) for m in (1.0, 2.0))
    for single, double in zip(one, two, strict=True):
        np.testing.assert_allclose(double, 2 * single, rtol=1e-14)
    high = peaks(ARM, t, q, LimitOptions(margin=1.5, velocity_floor=100.0, effort_floor=1000.0))
    assert (high[0] == 100.0).all()
    assert (high[1] == 1000.0).all()


def test_the_limits_go_into_the_file():
    t, q, _, _ = wave()
    velocity, effort = peaks(ARM, t, q, LimitOptions(payload=1.0, margin=1.5))
    model = pin.buildModelFromXML(urdf_text(ARM, velocity=velocity, effort=effort))
    np.testing.assert_array_equal(model.velocityLimit, velocity)
    np.testing.assert_array_equal(model.effortLimit, effort)


def test_stated_needs_go_over_the_assumed_actuator():
    options, sliding = LimitOptions(actuator_speed=90.0, slide_force=300.0), np.array([False, True])
    speed, torque = actuator_limits(JointNeeds(sliding), options)
    np.testing.assert_allclose(speed, [np.pi / 2, 0.5])
    np.testing.assert_allclose(torque, [50.0, 300.0])
    stated = JointNeeds(sliding, speed=np.array([1.0, 0.2]), torque=np.array([7.0, 70.0]))
    np.testing.assert_array_equal(actuator_limits(stated, options), [[1.0, 0.2], [7.0, 70.0]])


def test_what_the_motion_needs_beyond_its_limits_is_said_with_the_speed_that_keeps_them():
    t, q, _, _ = wave()
    arm, free = arm_body(ARM, Body()), np.full(3, 1e6)
    demand = joint_demand(arm, [smooth_motion(t, q, arm.limits)], 0.0, BasePose())
    fits = JointNeeds(np.zeros(3, bool), speed=np.full(3, 4.0), torque=free)
    assert excess_notes(demand, fits) == []
    limit = 0.5 * demand.speed[:, 0].max()
    slow = JointNeeds(np.zeros(3, bool), speed=np.array([limit, 10.0, 10.0]), torque=free)
    (note,) = excess_notes(demand, slow)
    assert "joint_1" in note
    assert "joint_2" not in note
    assert "--speed 0.5)" in note or "--speed 0.49)" in note
    weak = JointNeeds(np.zeros(3, bool), speed=np.full(3, 10.0), torque=np.full(3, 1e-3))
    (note,) = excess_notes(demand, weak)
    assert "no slower motion" in note


def test_inputs_stay_as_they_are():
    t, q, _, _ = wave()
    t_before, q_before = t.copy(), q.copy()
    peaks(ARM, t, q)
    np.testing.assert_array_equal(t, t_before)
    np.testing.assert_array_equal(q, q_before)


@pytest.mark.parametrize(
    ("time", "q"),
    [
        ([0, 1], np.zeros((2, 3))),
        ([0, 1, 2], np.zeros((4, 3))),
        ([0, 1, 2], np.zeros((3, 2))),
        ([0, 1, 2], np.zeros(3)),
        ([0, 1, 1], np.zeros((3, 3))),
        ([0, 2, 1], np.zeros((3, 3))),
        ([0, np.nan, 1], np.zeros((3, 3))),
        ([0, 1, 2], np.full((3, 3), np.inf)),
    ],
)
def test_what_is_no_motion_is_refused(time, q):
    with pytest.raises(DesignError):
        peaks(ARM, np.asarray(time), q)


@pytest.mark.parametrize(
    "setting",
    [
        {"margin": 0.9},
        {"margin": np.nan},
        {"payload": -1.0},
        {"velocity_floor": 0.0},
        {"effort_floor": 0.0},
        {"actuator_speed": 0.0},
        {"actuator_torque": -1.0},
    ],
)
def test_settings_out_of_range_are_refused(setting):
    with pytest.raises(SettingsError):
        LimitOptions(**setting)


def test_gravity_is_a_vector():
    with pytest.raises(SettingsError):
        joint_torques(arm_body(ARM, Body()), smooth_motion([0, 1, 2], np.zeros((3, 3))), gravity=(0, 0))
