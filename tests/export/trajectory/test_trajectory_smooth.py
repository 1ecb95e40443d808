"""The smooth path: its derivatives, what it keeps, its stated deviation, its limits."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from scipy.sparse import csc_array

from armdesign.errors import DesignError, SettingsError
from armdesign.export.trajectory.smooth import bounded_minimum, fit_path, peak_times
from armdesign.export.trajectory.tool_poses import tool_deviation, tool_poses
from armdesign.kinematics.dh import DHTable

ARM = DHTable.from_rows([(0.5, 0, 0), (-1.57, 0.11, 0), (-0.27, 0.4, -0.2), (-1.57, 0, 0.1)], base_yaw=0.3)


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


def test_the_stated_joint_deviation_is_the_largest_at_the_frames(run):
    task, q = run.problem.task, run.evaluation.path.q
    path = fit_path(task.time, q, run.limits)
    np.testing.assert_allclose(path.deviation, np.abs(path.at(task.time) - q).max(axis=0), atol=1e-13)
    assert 0.0 < np.degrees(path.deviation.max()) < 5.0
    assert not path.bounded


def test_a_higher_cutoff_follows_closer_and_accelerates_more(run):
    task, q = run.problem.task, run.evaluation.path.q
    paths = [fit_path(task.time, q, cutoff=cutoff) for cutoff in (3.0, 6.0, 12.0)]
    deviations = [path.deviation.max() for path in paths]
    peaks = [np.abs(path.at(peak_times(path), 2)).max() for path in paths]
    assert deviations == sorted(deviations, reverse=True)
    assert peaks == sorted(peaks)


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


def test_tool_poses_are_those_of_the_matrix_products():
    q = np.random.default_rng(2).uniform(-3, 3, (7, 3))
    np.testing.assert_allclose(tool_poses(ARM, q), [ARM.frames(row)[-1] for row in q], atol=1e-13)


def test_the_end_effector_deviation_is_that_of_brute_force(run):
    task, q = run.problem.task, run.evaluation.path.q
    path = fit_path(task.time, q)
    found = tool_deviation(run.table, q, path)
    for t in (0, 17, len(q) // 2, len(q) - 1):
        solved, fitted = run.table.frames(q[t])[-1], run.table.frames(path.at(task.time[t]))[-1]
        assert found.distance[t] == pytest.approx(np.linalg.norm(solved[:3, 3] - fitted[:3, 3]), abs=1e-12)
        cosine = (np.trace(solved[:3, :3].T @ fitted[:3, :3]) - 1.0) / 2.0
        assert np.cos(found.angle[t]) == pytest.approx(cosine, abs=1e-12)
    assert found.distance.max() < 0.01


def test_smoothing_hardly_changes_how_well_the_hand_is_followed(run):
    task, q = run.problem.task, run.evaluation.path.q
    path = fit_path(task.time, q)
    solved, fitted = (
        np.linalg.norm(tool_poses(run.table, angles)[:, :3, 3] - task.P[:, -1], axis=1).mean()
        for angles in (q, path.at(task.time))
    )
    assert fitted < solved + 5e-4


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
