"""Limits from a motion: known speeds and torques, smoothing, floors and refusals."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from armdesign.errors import DesignError, SettingsError
from armdesign.export.joint_load import joint_torques, trajectory_limits
from armdesign.export.options import LimitOptions
from armdesign.export.solids import link_bodies
from armdesign.export.urdf import urdf_text
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


def wave(frames=201, seconds=2.0, joints=3):
    t = np.linspace(0.0, seconds, frames)
    phase = np.arange(joints)
    angle = 2 * np.pi * t[:, None] + phase
    return t, 0.5 * np.sin(angle), 0.5 * 2 * np.pi * np.cos(angle), -0.5 * (2 * np.pi) ** 2 * np.sin(angle)


def test_cubics_are_smoothed_to_themselves():
    t = np.linspace(1.0, 3.0, 41)
    motion = smooth_motion(t, np.stack([t**3, 2 - t**2], axis=1), window=0.4)
    np.testing.assert_allclose(motion.q, np.stack([t**3, 2 - t**2], axis=1), atol=1e-11)
    np.testing.assert_allclose(motion.v, np.stack([3 * t**2, -2 * t], axis=1), atol=1e-10)
    np.testing.assert_allclose(motion.a[4:-4], np.stack([6 * t, -2 + 0 * t], axis=1)[4:-4], atol=1e-9)


def test_a_sampled_wave_gives_its_derivatives():
    t, q, v, a = wave()
    motion = smooth_motion(t, q)
    assert np.abs(motion.v - v).max() < 0.01 * np.abs(v).max()
    assert np.abs(motion.a - a)[8:-8].max() < 0.03 * np.abs(a).max()


def test_noise_barely_moves_the_peaks():
    t, q, v, _ = wave()
    noisy = q + np.random.default_rng(0).normal(scale=1e-3, size=q.shape)
    found = trajectory_limits(ARM, t, noisy, options=LimitOptions(margin=1.0, velocity_floor=1e-3, effort_floor=1e-3))
    clean = trajectory_limits(ARM, t, q, options=LimitOptions(margin=1.0, velocity_floor=1e-3, effort_floor=1e-3))
    np.testing.assert_allclose(found.velocity, np.abs(v).max(axis=0), rtol=0.05)
    np.testing.assert_allclose(found.effort, clean.effort, rtol=0.1)


@pytest.mark.parametrize("frames", [3, 4, 5, 6, 7])
def test_the_shortest_motions_work(frames):
    t = np.linspace(0.0, 1.0, frames)
    motion = smooth_motion(t, np.stack([3 * t, t**2], axis=1))
    np.testing.assert_allclose(motion.v, np.stack([3 + 0 * t, 2 * t], axis=1), atol=1e-12)
    np.testing.assert_allclose(motion.a, np.stack([0 * t, 2 + 0 * t], axis=1), atol=1e-11)


def test_uneven_times_are_allowed():
    t = np.sort(np.random.default_rng(1).uniform(0, 2, 300))
    motion = smooth_motion(t, np.sin(2 * t)[:, None])
    assert np.abs(motion.v).max() == pytest.approx(2.0, rel=0.02)


def test_a_held_pendulum_needs_its_weight_times_its_lever():
    options = Body()
    body = link_bodies(PENDULUM, options)[1].inertial
    lever = body.mass * body.com[0] + (options.tool_mass + 2.0) * 0.5
    held = trajectory_limits(PENDULUM, [0.0, 1.0, 2.0], np.zeros((3, 1)), options=LimitOptions(payload=2.0, margin=1.5))
    assert held.effort[0] == pytest.approx(1.5 * 9.81 * lever, rel=1e-12)
    assert held.velocity[0] == 1.0


def test_torques_are_those_of_the_written_file():
    t, q, _, _ = wave()
    motion = smooth_motion(t, q)
    model = pin.buildModelFromXML(urdf_text(ARM))
    data = model.createData()
    expected = [pin.rnea(model, data, *s) for s in zip(motion.q, motion.v, motion.a, strict=True)]
    found = joint_torques(ARM, motion, Body(), 0.0, (0, 0, -9.81))
    np.testing.assert_allclose(found, expected, atol=1e-11)


def test_limits_scale_with_the_margin_and_stop_at_the_floor():
    t, q, _, _ = wave()
    one = trajectory_limits(ARM, t, q, options=LimitOptions(margin=1.0, velocity_floor=1e-9, effort_floor=1e-9))
    two = trajectory_limits(ARM, t, q, options=LimitOptions(margin=2.0, velocity_floor=1e-9, effort_floor=1e-9))
    np.testing.assert_allclose(two.velocity, 2 * one.velocity, rtol=1e-14)
    np.testing.assert_allclose(two.effort, 2 * one.effort, rtol=1e-14)
    high = trajectory_limits(ARM, t, q, options=LimitOptions(velocity_floor=100.0, effort_floor=1000.0))
    assert (high.velocity == 100.0).all()
    assert (high.effort == 1000.0).all()


def test_without_gravity_a_still_arm_needs_only_the_floor():
    still = trajectory_limits(ARM, [0, 1, 2, 3], np.ones((4, 3)), gravity=(0, 0, 0))
    assert (still.effort == 1.0).all()
    assert (still.velocity == 1.0).all()


def test_the_limits_go_into_the_file():
    t, q, _, _ = wave()
    limits = trajectory_limits(ARM, t, q, options=LimitOptions(payload=1.0))
    model = pin.buildModelFromXML(urdf_text(ARM, velocity=limits.velocity, effort=limits.effort))
    np.testing.assert_array_equal(model.velocityLimit, limits.velocity)
    np.testing.assert_array_equal(model.effortLimit, limits.effort)


def test_inputs_stay_as_they_are():
    t, q, _, _ = wave()
    t_before, q_before = t.copy(), q.copy()
    trajectory_limits(ARM, t, q)
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
        trajectory_limits(ARM, time, q)


@pytest.mark.parametrize(
    "setting",
    [
        {"margin": 0.9},
        {"margin": np.nan},
        {"payload": -1.0},
        {"velocity_floor": 0.0},
        {"effort_floor": 0.0},
        {"window": 0.0},
    ],
)
def test_settings_out_of_range_are_refused(setting):
    with pytest.raises(SettingsError):
        trajectory_limits(ARM, [0, 1, 2], np.zeros((3, 3)), options=LimitOptions(**setting))


def test_gravity_is_a_vector():
    with pytest.raises(SettingsError):
        trajectory_limits(ARM, [0, 1, 2], np.zeros((3, 3)), gravity=(0, 0))
