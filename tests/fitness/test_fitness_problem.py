"""Start poses, weights and the numbers of a problem."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import PACKAGING, WELDING, full_turn, problem_for, settings_for
from scipy.stats import qmc

from armdesign.errors import SettingsError, TaskError
from armdesign.fitness.problem import make_problem, resolve_weights, start_poses
from armdesign.settings.sections import Fitness, Solver

SIZES = range(1, 11)
UNIT = np.array([0.0, 1.0])


def random_limits(rng, n):
    middle, half = rng.uniform(-1, 1, n), rng.uniform(0.1, 3, n)
    return np.stack([middle - half, middle + half], axis=1)


@pytest.mark.parametrize("n", SIZES)
def test_start_poses_lie_in_the_limits(n):
    limits = random_limits(np.random.default_rng(n), n)
    poses = start_poses(300, limits)
    assert poses.shape == (300, n)
    assert (limits[:, 0] <= poses).all()
    assert (poses <= limits[:, 1]).all()
    np.testing.assert_allclose(poses[0], limits.mean(axis=1), atol=1e-15)


@pytest.mark.parametrize("n", SIZES)
def test_fewer_start_poses_are_the_first_of_more(n):
    limits = random_limits(np.random.default_rng(n), n)
    np.testing.assert_array_equal(start_poses(40, limits), start_poses(500, limits)[:40])


@pytest.mark.parametrize("n", SIZES)
def test_start_poses_follow_the_additive_recurrence(n):
    """frac(1/2 + k / g^j) with g^(n+1) = g + 1."""
    g = max(np.roots([1.0, *np.zeros(n - 1), -1.0, -1.0]).real)
    expected = (0.5 + np.arange(64)[:, None] * g ** -np.arange(1.0, n + 1)) % 1.0
    np.testing.assert_allclose(start_poses(64, np.tile(UNIT, (n, 1))), expected, atol=1e-12)


@pytest.mark.parametrize("n", SIZES)
def test_start_poses_cover_more_evenly_than_random_ones(n):
    poses = start_poses(128, np.tile(UNIT, (n, 1)))
    rng = np.random.default_rng(n)
    random = np.mean([qmc.discrepancy(rng.random((128, n))) for _ in range(10)])
    assert qmc.discrepancy(poses) < 0.7 * random


def test_fixed_joints_start_where_they_are():
    limits = np.array([[-1.0, 1.0], [0.3, 0.3]])
    assert (start_poses(20, limits)[:, 1] == 0.3).all()


def test_weights_come_from_the_scenario_or_the_settings():
    assert resolve_weights(Fitness(), 3) == (0.0, pytest.approx(PACKAGING))
    assert resolve_weights(Fitness(scenario="welding"), 3) == (0.2, WELDING)
    w_0, weights = resolve_weights(Fitness(), 5)
    assert w_0 == 0.0
    np.testing.assert_allclose(weights, np.arange(1, 6) / 15.0)
    assert resolve_weights(Fitness(weights=(0.4, 0.6)), 2) == (0.0, (0.4, 0.6))
    assert resolve_weights(Fitness(weights=(0.4, 0.4), orientation_weight=0.2), 2) == (0.2, (0.4, 0.4))


@pytest.mark.parametrize(
    ("settings", "m", "message"),
    [
        ({"weights": (0.5, 0.5)}, 3, "2 weights"),
        ({"scenario": "welding"}, 2, "3 weights"),
        ({"weights": (0.5, 0.6)}, 2, "sum to 1.1"),
        ({"weights": (0.5, 0.5), "orientation_weight": 0.3}, 2, "sum to 1.3"),
        ({"weights": (1.0, 0.0)}, 2, "hand"),
    ],
)
def test_weights_that_make_no_sense_are_refused(settings, m, message):
    with pytest.raises(SettingsError, match=message):
        resolve_weights(Fitness(**settings), m)


def test_a_problem_holds_metres_and_radians():
    problem = problem_for(np.zeros((4, 3, 3)), 2, PACKAGING, continuity=5.0, delta=0.02, reach_tolerance=0.002)
    record = problem.record[0]
    assert record["radius"] == pytest.approx(np.deg2rad(5.0))
    assert (record["delta"], record["reach"], record["free"]) == (0.02, 0.002, 2)
    assert (problem.frames, problem.points, problem.dof) == (4, 3, 2)
    by_speed = problem_for(np.zeros((4, 3, 3)), 2, PACKAGING, continuity_speed=200.0, dt=0.01)
    assert by_speed.record[0]["radius"] == pytest.approx(np.deg2rad(2.0))
    assert problem_for(np.zeros((4, 3, 3)), 2, PACKAGING, tie_hand=False).record[0]["free"] == 3


def test_problems_that_make_no_sense_are_refused():
    with pytest.raises(TaskError, match="13 points"):
        problem_for(np.zeros((4, 13, 3)), 2, np.full(12, 1 / 12))
    with pytest.raises(TaskError, match="no orientation"):
        problem_for(np.zeros((4, 3, 3)), 2, WELDING, w_0=0.2)
    with pytest.raises(SettingsError, match="2 weights for 3 points"):
        make_problem(np.zeros((4, 3, 3)), None, 0.1, full_turn(2), settings_for((0.5, 0.5)), Solver())


def test_the_problem_keeps_its_own_copy_of_the_task():
    P = np.zeros((4, 3, 3))
    problem = problem_for(P, 2, PACKAGING)
    P[:] = 7.0
    assert (problem.P == 0.0).all()
