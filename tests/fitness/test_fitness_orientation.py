"""The three orientation errors against SciPy's rotations, and their Jacobians against finite differences."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_probe import Probe
from plain_reference import orientation_error
from scenes import random_rotation, random_table
from scipy.spatial.transform import Rotation

METRICS = ("geodesic", "euler", "axis")
POINTS, WEIGHTS = np.array([[0.3, 0.1, 0.2]]), np.array([0.5])
every_metric = pytest.mark.parametrize("metric", METRICS)


@pytest.fixture(scope="module")
def still():
    """A straight arm whose tool frame equals the base frame, so that the mount alone is the hand's rotation."""
    probe = Probe(2, 1)
    table = random_table(np.random.default_rng(0), 1)
    return probe.load(type(table)([0.0, 0.0], [0.0, 0.0], [0.2, 0.1])).pose(np.zeros(1))


def error_of(probe, hand, target, metric):
    probe.look(POINTS, WEIGHTS, target=target, w_0=0.5, metric=metric, mount=hand, differentiate=True)
    attitude = probe.attitudes[0]
    assert np.linalg.norm(attitude["rho"]) == pytest.approx(attitude["error"], abs=1e-15)
    assert np.isfinite(attitude["K"]).all()
    return attitude["error"]


@every_metric
def test_errors_equal_the_plain_formulas(still, metric):
    rng = np.random.default_rng(1)
    for _ in range(200):
        hand, target = random_rotation(rng), random_rotation(rng)
        assert error_of(still, hand, target, metric) == pytest.approx(orientation_error(hand, target, metric), abs=1e-9)


@every_metric
def test_equal_frames_have_no_error(still, metric):
    rng = np.random.default_rng(2)
    for R in (np.eye(3), random_rotation(rng), Rotation.from_euler("x", np.pi).as_matrix()):
        assert error_of(still, R, R, metric) < 1e-15


@pytest.mark.parametrize("gap", [1e-3, 1e-5, 1e-7, 1e-9, 1e-12, 0.0])
def test_geodesic_error_is_exact_up_to_half_a_turn(still, gap):
    rng = np.random.default_rng(3)
    for _ in range(30):
        target, axis = random_rotation(rng), rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        hand = Rotation.from_rotvec((np.pi - gap) * axis).as_matrix() @ target
        assert error_of(still, hand, target, "geodesic") == pytest.approx(np.pi - gap, abs=1e-9)
        rho = still.attitudes[0]["rho"]
        aligned = rho @ axis / np.pi  # the vector from target to hand; at half a turn either sign will do
        assert (aligned if gap > 1e-5 else abs(aligned)) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("angle", [1e-3, 1e-6, 1e-9, 1e-13])
def test_small_errors_keep_their_digits(still, angle):
    rng = np.random.default_rng(4)
    for _ in range(20):
        target = random_rotation(rng)
        across = np.cross(target[:, 2], rng.normal(size=3))
        across /= np.linalg.norm(across)
        hand = Rotation.from_rotvec(angle * across).as_matrix() @ target
        for metric in ("geodesic", "axis"):
            assert error_of(still, hand, target, metric) == pytest.approx(angle, abs=1e-15)


@pytest.mark.parametrize("gap", [1e-6, 1e-9, 0.0])
def test_axis_error_of_opposite_tools_is_half_a_turn(still, gap):
    rng = np.random.default_rng(5)
    for _ in range(20):
        target = random_rotation(rng)
        across = np.cross(target[:, 2], rng.normal(size=3))
        across /= np.linalg.norm(across)
        hand = Rotation.from_rotvec((np.pi - gap) * across).as_matrix() @ target
        assert error_of(still, hand, target, "axis") == pytest.approx(np.pi - gap, abs=1e-9)


def test_axis_error_ignores_turns_about_the_tool(still):
    rng = np.random.default_rng(6)
    for _ in range(20):
        hand, target = random_rotation(rng), random_rotation(rng)
        spin = Rotation.from_euler("z", rng.uniform(-3, 3)).as_matrix()
        first = error_of(still, hand, target, "axis")
        assert error_of(still, hand @ spin, target, "axis") == pytest.approx(first, abs=1e-12)


def test_euler_differences_wrap_at_half_a_turn(still):
    for angle in (np.pi - 1e-3, np.pi - 0.2):
        for place in range(3):
            if place == 1:
                continue  # pitch stays within +-90 deg
            first, second = np.zeros(3), np.zeros(3)
            first[place], second[place] = angle, -angle
            hand, target = (Rotation.from_euler("xyz", x).as_matrix() for x in (first, second))
            assert error_of(still, hand, target, "euler") == pytest.approx(2 * (np.pi - angle), abs=1e-12)
    opposite = Rotation.from_euler("xyz", [np.pi, 0.0, 0.0]).as_matrix()
    assert error_of(still, opposite, np.eye(3), "euler") == pytest.approx(np.pi, abs=1e-12)


def test_euler_error_is_the_norm_of_three_differences(still):
    hand = Rotation.from_euler("xyz", [0.3, -0.5, 1.0]).as_matrix()  # fixed axes x, y, z: roll, pitch, yaw
    target = Rotation.from_euler("xyz", [0.1, 0.2, -0.4]).as_matrix()
    expected = np.linalg.norm([0.2, -0.7, 1.4])
    assert error_of(still, hand, target, "euler") == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_gimbal_lock_gives_finite_numbers_and_no_error_between_equals(still, sign):
    for roll, yaw in ((0.0, 0.0), (0.4, -1.0), (2.0, 2.0)):
        lock = Rotation.from_euler("xyz", [roll, sign * np.pi / 2, yaw]).as_matrix()
        assert error_of(still, lock, lock, "euler") == 0.0
        other = error_of(still, lock, np.eye(3), "euler")
        assert np.pi / 2 - 1e-7 <= other <= np.sqrt(2.25) * np.pi + 1e-9


@every_metric
def test_errors_lie_between_zero_and_half_a_turn(still, metric):
    rng = np.random.default_rng(7)
    bound = np.pi * (np.sqrt(3.0) if metric == "euler" else 1.0)
    errors = [error_of(still, random_rotation(rng), random_rotation(rng), metric) for _ in range(100)]
    assert min(errors) > 0.0
    assert max(errors) <= bound


@every_metric
@pytest.mark.parametrize("n", [1, 3, 7])
def test_jacobian_gives_the_slope_of_half_the_square(metric, n):
    rng = np.random.default_rng([8, n])
    probe, h = Probe(2 * n + 1, n), 1e-6
    stencil = np.vstack([np.zeros(n), h * np.eye(n), -h * np.eye(n)])
    taken = 0
    for _ in range(60):
        q, target, mount = rng.uniform(-np.pi, np.pi, n), random_rotation(rng), random_rotation(rng)
        probe.load(random_table(rng, n, theta=True, yaw=True)).pose(q + stencil)
        probe.look(POINTS, WEIGHTS, target=target, w_0=0.5, metric=metric, mount=mount, differentiate=True)
        half_square, attitude = 0.5 * probe.attitudes["error"] ** 2, probe.attitudes[0]
        near_lock = metric == "euler" and np.hypot(*attitude["hand"][:2, 0]) < 0.1
        if np.ptp(half_square) > 0.1 or near_lock or (attitude["error"] > np.pi - 0.02 and metric != "euler"):
            continue  # across a wrap, or where the angles turn too fast for the stencil
        slope = (half_square[1 : n + 1] - half_square[n + 1 :]) / (2 * h)
        np.testing.assert_allclose(attitude["K"][:n] @ attitude["rho"], slope, atol=2e-8)
        taken += 1
    assert taken > 40


@every_metric
def test_linear_model_predicts_the_error_of_a_small_step(metric):
    """|rho + K x| is the error behind a step x, up to second order; the geodesic and Euler models are the same."""
    rng = np.random.default_rng(9)
    probe = Probe(3, 4)
    for _ in range(30):
        table, q, step = random_table(rng, 4), rng.uniform(-2, 2, 4), rng.normal(size=4)
        probe.load(table).pose(q)
        hand = probe.look(POINTS, WEIGHTS, target=np.eye(3), w_0=0.5, metric=metric).attitudes[0]["hand"].copy()
        target = Rotation.from_rotvec(rng.normal(0.0, 0.1, 3)).as_matrix() @ hand
        if np.hypot(*hand[:2, 0]) < 0.3:
            continue
        probe.pose(q + np.array([[0.0], [1e-3], [1e-4]]) * step)
        probe.look(POINTS, WEIGHTS, target=target, w_0=0.5, metric=metric, differentiate=True)
        attitude, errors = probe.attitudes[0], probe.attitudes["error"]
        predicted = [np.linalg.norm(attitude["rho"] + h * step @ attitude["K"][:4]) for h in (1e-3, 1e-4)]
        slack = [50 * 1e-3**2 + 2e-4, 50 * 1e-4**2 + 2e-5]  # K leaves out terms normal to rho, of order |rho| h
        assert abs(predicted[0] - errors[1]) < slack[0]
        assert abs(predicted[1] - errors[2]) < slack[1]


@every_metric
def test_weighted_error_enters_g(metric):
    rng = np.random.default_rng(10)
    probe = Probe(1, 3)
    table, target, mount = random_table(rng, 3), random_rotation(rng), random_rotation(rng)
    probe.load(table).pose(rng.uniform(-2, 2, 3))
    probe.look(POINTS, WEIGHTS, target=target, w_0=0.4, metric=metric, mount=mount)
    frame, hand = probe.frames[0], probe.chains[0]["tip_rotation"] @ mount
    expected = np.sqrt(0.5) * probe.matches[0]["distance"][0] + 0.4 * orientation_error(hand, target, metric)
    assert frame["g"] == pytest.approx(expected, abs=1e-12)
    assert frame["value"] == frame["g"]
