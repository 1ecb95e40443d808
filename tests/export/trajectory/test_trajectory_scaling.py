"""Timing: the laws of scaling, rest at both ends, limits that hold."""

import numpy as np
import pytest

from armdesign.errors import SettingsError
from armdesign.export.trajectory.scaling import Timing, fastest_speed, motion_at, sample, timing_of
from armdesign.kinematics.motion import fit_path


def path_of(run):
    return fit_path(run.problem.task.time, run.evaluation.path.q, run.limits)


@pytest.mark.parametrize("speed", [0.25, 0.5, 2.0])
@pytest.mark.parametrize("ramp", [0.0, 0.5])
def test_velocities_scale_with_the_speed_and_accelerations_with_its_square(run, speed, ramp):
    path = path_of(run)
    timings = timing_of(path, ramp=ramp), timing_of(path, speed=speed, ramp=ramp)
    t = np.linspace(0.0, timings[0].total, 301)
    plain, scaled = motion_at(path, timings[0], t), motion_at(path, timings[1], t / speed)
    np.testing.assert_allclose(scaled.q, plain.q, atol=1e-12)
    np.testing.assert_allclose(scaled.v, speed * plain.v, atol=1e-9)
    np.testing.assert_allclose(scaled.a, speed**2 * plain.a, atol=1e-7)


@pytest.mark.parametrize("timing", [Timing(3.0, 2.0, 0.7, 0.5), Timing(3.0, 2.0, 1.3, 2.0), Timing(3.0, 2.0)])
def test_the_derivatives_of_the_demonstrated_time_are_those_of_finite_differences(timing):
    t, h = np.linspace(1e-3, timing.total - 1e-3, 997), 1e-6
    before, now, after = (timing.at(t + k * h) for k in (-1, 0, 1))
    np.testing.assert_allclose(now[1], (after[0] - before[0]) / (2 * h), atol=1e-8)
    np.testing.assert_allclose(now[2], (after[1] - before[1]) / (2 * h), atol=1e-4)


@pytest.mark.parametrize("ramp", [0.0, 0.3, 2.0])
def test_all_of_the_demonstration_is_passed_through_forwards(ramp):
    timing = Timing(5.0, 2.0, 0.5, ramp)
    s, ds, _ = timing.at(np.linspace(0.0, timing.total, 1000))
    assert (s[0], s[-1]) == (pytest.approx(5.0), pytest.approx(7.0))
    assert (np.diff(s) >= 0.0).all()
    assert ds.max() <= 0.5 + 1e-12
    assert timing.total == pytest.approx((2.0 + ramp) / 0.5)


def test_velocities_and_accelerations_of_the_motion_are_those_of_finite_differences(run):
    path = path_of(run)
    timing = timing_of(path, speed=0.8)
    t, h = np.linspace(0.01, timing.total - 0.01, 501), 1e-5
    before, now, after = (motion_at(path, timing, t + k * h) for k in (-1, 0, 1))
    assert np.abs(now.v - (after.q - before.q) / (2 * h)).max() < 1e-5 * np.abs(now.v).max()
    assert np.abs(now.a - (after.v - before.v) / (2 * h)).max() < 1e-4 * np.abs(now.a).max()


def test_the_arm_starts_and_ends_at_rest_on_the_ends_of_its_path(run):
    path = path_of(run)
    motion = sample(path, timing_of(path, speed=0.7), 130.0)
    for k in (0, -1):
        assert np.abs(motion.v[k]).max() < 1e-12
        assert np.abs(motion.a[k]).max() < 1e-9
    np.testing.assert_allclose(motion.q[[0, -1]], path.at(path.time[[0, -1]]), atol=1e-12)


def test_ramps_leave_the_path_where_it_is(run):
    path = path_of(run)
    motion = sample(path, timing_of(path), 200.0)
    np.testing.assert_array_equal(motion.q, path.at(motion.demonstrated))


def test_without_ramps_the_frames_come_back_at_their_times(run):
    path, task = path_of(run), run.problem.task
    motion = sample(path, timing_of(path, ramp=0.0), 1.0 / task.dt)
    np.testing.assert_allclose(motion.time, task.time - task.time[0], atol=1e-9)
    np.testing.assert_allclose(motion.q, path.at(task.time), atol=1e-9)
    np.testing.assert_allclose(motion.v, path.at(task.time, 1), atol=1e-7)


@pytest.mark.parametrize("limits", [(1.0, 1e3), (1e3, 2.0), (0.5, 1.0)])
@pytest.mark.parametrize("ramp", [0.0, 0.4])
def test_the_fastest_speed_keeps_the_limits_and_a_little_more_breaks_one(run, limits, ramp):
    path = path_of(run)
    speed, what = fastest_speed(path, ramp=ramp, velocity=limits[0], acceleration=limits[1])
    peaks = []
    for factor in (1.0, 1.004):
        motion = sample(path, timing_of(path, speed=factor * speed, ramp=ramp), 5000.0)
        peaks.append((np.abs(motion.v).max(), np.abs(motion.a).max()))
    assert peaks[0][0] <= limits[0]
    assert peaks[0][1] <= limits[1]
    assert peaks[1][0] > limits[0] or peaks[1][1] > limits[1]
    assert what.startswith("the velocity" if peaks[1][0] > limits[0] else "the acceleration")


def test_each_joint_can_have_its_own_limits(run):
    path = path_of(run)
    n = path.dof
    loose = np.full(n, 1e3)
    speed, what = fastest_speed(path, velocity=np.r_[loose[1:], 0.2], acceleration=loose)
    motion = sample(path, timing_of(path, speed=speed), 2000.0)
    assert np.abs(motion.v[:, -1]).max() == pytest.approx(0.2, rel=2e-3)
    assert what == f"the velocity of joint_{n}"


def test_an_arm_that_stands_still_has_no_fastest_speed():
    path = fit_path(np.arange(5.0), np.full((5, 2), 0.3))
    assert fastest_speed(path)[0] > 1e3


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"speed": 0.0}, "speed is 0.0; allowed: 0.01 to 10"),
        ({"speed": np.nan}, "speed is nan"),
        ({"ramp": -0.1}, "ramp is -0.1 s; allowed: 0 s or more"),
        ({"ramp": np.inf}, "ramp is inf"),
    ],
)
def test_a_timing_out_of_range_is_refused(runs, settings, told):
    with pytest.raises(SettingsError) as caught:
        timing_of(path_of(runs["packaging"]), **settings)
    assert told in str(caught.value)


@pytest.mark.parametrize("rate", [0.0, -5.0, np.nan, 1e6])
def test_a_rate_out_of_range_is_refused(runs, rate):
    path = path_of(runs["packaging"])
    with pytest.raises(SettingsError, match=r"rate is .* allowed: 1 to 10000 samples/s"):
        sample(path, timing_of(path), rate)


@pytest.mark.parametrize("velocity", [0.0, [1.0, -1.0, 1.0], [1.0, 1.0], [[1.0]]])
def test_limits_that_are_none_are_refused(runs, velocity):
    with pytest.raises(SettingsError, match="the velocity limits are"):
        fastest_speed(path_of(runs["packaging"]), velocity=velocity)
