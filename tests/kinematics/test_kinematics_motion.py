"""The smooth motion: its derivatives, what it keeps, its stated deviation, its limits."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.sparse import csc_array

from armdesign.errors import DesignError, SettingsError
from armdesign.kinematics.motion import Smoothing, bounded_minimum, fit_path, smooth_motion


def wave(frequency, seconds=6.0, rate=50.0, joints=1):
    t = 2.0 + np.arange(round(seconds * rate) + 1) / rate
    return t, np.sin(2 * np.pi * frequency * t[:, None] + np.arange(joints))


def rough(joints=3, frames=120, seed=0):
    t = np.arange(frames) / 50.0
    steps = np.random.default_rng(seed).normal(scale=0.02, size=(frames, joints))
    return t, np.cumsum(steps, axis=0) + 0.3 * np.sin(3.0 * t[:, None])


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_derivatives_are_those_of_finite_differences(order):
    t, q = rough()
    path = fit_path(t, q)
    at, h = np.linspace(t[0] + 0.01, t[-1] - 0.01, 1001), 1e-5
    numeric = (path.at(at + h, order - 1) - path.at(at - h, order - 1)) / (2 * h)
    assert np.abs(path.at(at, order) - numeric).max() < 1e-4 * np.abs(numeric).max()


def test_the_path_is_continuous_up_to_the_fourth_derivative():
    t, q = rough()
    path = fit_path(t, q)
    knots = np.unique(path.spline.t)[1:-1]
    for order in range(5):
        jump = np.abs(path.at(knots + 1e-9, order) - path.at(knots - 1e-9, order)).max()
        assert jump < 1e-7 * max(1.0, np.abs(path.at(knots, order + 1)).max())


@pytest.mark.parametrize("cutoff", [1.0, 6.0, 20.0])
def test_quadratics_stay_as_they_are_also_at_uneven_times(cutoff):
    t = np.sort(np.random.default_rng(1).uniform(5.0, 8.0, 90))
    q = np.stack([1.0 - 0.3 * t + 0.1 * t**2, 0.2 * t], axis=1)
    path = fit_path(t, q, cutoff=cutoff)
    at = np.linspace(t[0], t[-1], 50)
    np.testing.assert_allclose(path.at(at), np.stack([1.0 - 0.3 * at + 0.1 * at**2, 0.2 * at], axis=1), atol=1e-8)
    np.testing.assert_allclose(path.at(at, 2), np.tile([0.2, 0.0], (50, 1)), atol=1e-5)


@pytest.mark.parametrize("frequency", [1.0, 3.0, 4.0, 6.0, 9.0])
def test_an_oscillation_is_kept_by_the_factor_of_its_frequency(frequency):
    t, q = wave(frequency, rate=100.0)
    middle = slice(200, -200)
    kept = np.abs(fit_path(t, q, cutoff=4.0).at(t))[middle].max() / np.abs(q)[middle].max()
    assert kept == pytest.approx(1.0 / (1.0 + (frequency / 4.0) ** 6), abs=0.01)


def test_the_cutoff_means_the_same_at_another_frame_rate():
    paths = [fit_path(*wave(5.0, rate=rate), cutoff=4.0).at(np.linspace(4.0, 6.0, 99)) for rate in (40.0, 333.0)]
    np.testing.assert_allclose(*paths, atol=0.02)


def test_few_frames_are_enough():
    path = fit_path([0.0, 0.5, 1.0], [[0.0], [0.2], [0.1]])
    np.testing.assert_allclose(path.at([0.0, 0.5, 1.0]), [[0.0], [0.2], [0.1]], atol=1e-8)


def test_a_cutoff_beyond_the_frame_rate_is_brought_down_to_half_of_it():
    t, q = rough()
    assert fit_path(t, q, cutoff=500.0).cutoff == pytest.approx(25.0)


def test_a_path_along_its_limit_stays_inside_everywhere():
    t, q = wave(0.7, joints=3)
    limits = np.array([[-0.8, 0.7], [-2.0, 2.0], [-1.0, 0.9]])
    clipped = np.clip(q, *limits.T)
    free, held = fit_path(t, clipped), fit_path(t, clipped, limits)
    at = np.linspace(t[0], t[-1], 20_001)
    assert (free.at(at) > limits[:, 1] + 1e-5).any()
    assert (held.at(at) >= limits[:, 0] - 1e-12).all()
    assert (held.at(at) <= limits[:, 1] + 1e-12).all()
    assert held.bounded == (0, 2)
    assert np.degrees(held.deviation).max() < 2.0
    np.testing.assert_array_equal(held.at(at)[:, 1], free.at(at)[:, 1])


def test_held_control_points_are_the_best_inside_the_limits():
    rng = np.random.default_rng(3)
    J, y = rng.normal(size=(60, 25)), rng.normal(scale=5.0, size=60)
    best = lsq_linear(J, y, bounds=(-0.4, 0.3), method="bvls").x
    np.testing.assert_allclose(bounded_minimum(csc_array(J.T @ J), J.T @ y, -0.4, 0.3), best, atol=1e-9)


@pytest.mark.parametrize(
    ("time", "q", "limits", "told"),
    [
        ([0.0, 1.0], [[0.0], [1.0]], None, "2 frame"),
        ([0.0, 2.0, 1.0], [[0.0], [1.0], [0.0]], None, "not after the one before"),
        ([0.0, 1.0, 2.0], [[0.0], [np.nan], [0.0]], None, "not finite"),
        ([0.0, 1.0, 2.0], [[0.0], [1.0], [0.0]], [[1.0, -1.0]], "lower < upper"),
        ([0.0, 1.0, 2.0], [[0.0], [1.0], [0.0]], [[-1.0, 1.0]] * 2, "(1, 2)"),
    ],
)
def test_a_motion_that_makes_no_sense_is_refused(time, q, limits, told):
    with pytest.raises(DesignError) as caught:
        fit_path(time, q, limits)
    assert told in str(caught.value)


@pytest.mark.parametrize("cutoff", [0.0, -1.0, np.nan, 1e6])
def test_a_cutoff_out_of_range_is_refused(cutoff):
    with pytest.raises(SettingsError, match=r"cutoff .* allowed: 0\.1 to 1000 Hz"):
        fit_path(*rough(), cutoff=cutoff)


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


def test_a_sampled_wave_gives_its_derivatives():
    t = np.linspace(0.0, 2.0, 201)
    angle, rate = 2.0 * np.pi * t[:, None] + np.arange(3), 2.0 * np.pi
    motion = smooth_motion(t, 0.5 * np.sin(angle))
    v, a = 0.5 * rate * np.cos(angle), -0.5 * rate**2 * np.sin(angle)
    assert np.abs(motion.v - v).max() < 0.05 * np.abs(v).max()  # the ends are free
    assert np.abs(motion.v - v)[15:-15].max() < 0.005 * np.abs(v).max()
    assert np.abs(motion.a - a)[15:-15].max() < 0.01 * np.abs(a).max()


def test_the_motion_at_the_frames_is_the_path_there_within_the_same_limits():
    t, q = wave(0.7, joints=2)
    limits = np.array([[-0.8, 0.7], [-2.0, 2.0]])
    path, motion = fit_path(t, np.clip(q, *limits.T), limits), smooth_motion(t, np.clip(q, *limits.T), limits)
    assert path.bounded == (0,)
    for order, values in enumerate((motion.q, motion.v, motion.a)):
        np.testing.assert_allclose(values, path.at(t, order), atol=1e-9)
    slower = motion.at_speed(0.5)
    np.testing.assert_array_equal(slower.q, motion.q)
    np.testing.assert_array_equal(slower.v, 0.5 * motion.v)
    np.testing.assert_array_equal(slower.a, 0.25 * motion.a)


@pytest.mark.parametrize(("order", "frame"), [(0, 7), (1, 0), (1, 60), (2, 119)])
def test_weights_are_the_derivatives_of_the_fit(order, frame):
    t, q = rough(joints=1)
    fit = Smoothing(t)
    motion = fit.motion(q)
    value = (motion.q, motion.v, motion.a)[order][frame, 0]
    assert fit.weights(order, frame) @ q[:, 0] == pytest.approx(value, rel=1e-9, abs=1e-9)  # the fit is linear
