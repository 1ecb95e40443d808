"""Slope, second derivative and Gauss-Newton part of the position part of eq. 3, against finite differences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from kernel_probe import Probe
from plain_reference import arm, point_at
from scenes import random_frames, random_rotation, random_table, rows_of

H = 1e-5  # step of the central differences [rad]
WELDING_LIKE = {"w_0": 0.3, "target": random_rotation(np.random.default_rng(99))}


@dataclass
class Sample:
    """One pose with the derivatives there and their finite differences; patterns tell how the points are tied."""

    slope: np.ndarray
    newton: np.ndarray
    gauss: np.ndarray
    slope_differences: np.ndarray
    newton_differences: np.ndarray
    pools: bool
    slides: bool
    clamped: bool


def full_symmetric(lower):
    return np.tril(lower) + np.tril(lower, -1).T


def ties(probe, m):
    """What of an association must not change inside a stencil for the objective to be smooth there."""
    return np.concatenate([probe.matches[name][:, :m] for name in ("segment", "pool", "sliding")], axis=1)


def samples(seed, n, m, weights, *, count, free=None, oriented=False, joints=""):
    """Derivatives at random poses in generic position."""
    rng = np.random.default_rng([seed, n, m])
    prismatic = [kind == "P" for kind in joints or n * "R"]
    probe = Probe(2 * n + 1, n, prismatic)
    options = WELDING_LIKE if oriented else {}
    stencil = np.vstack([np.zeros(n), H * np.eye(n), -H * np.eye(n)])
    for _ in range(count):
        table = random_table(rng, n, theta=True, negative=True, yaw=True)
        q, points = rng.uniform(-np.pi, np.pi, n), random_frames(rng, 1, m)[0]
        q[prismatic] /= 10.0  # some 0.3 m; with it the piece may turn back
        probe.load(table).pose(q + stencil)
        probe.look(points, weights, free=free, differentiate=True, **options)
        tied = ties(probe, m)
        if (tied != tied[0]).any():
            continue
        value = probe.frames["root"] / m if oriented else 0.5 * probe.frames["square"]
        slopes = probe.frames["slope"][:, :n]
        match = probe.matches[0]
        tip = match["segment"][:m] == probe.chains[0]["segments"] - 1
        yield Sample(
            slope=slopes[0].copy(),
            newton=full_symmetric(probe.frames["newton"][0, :n, :n]),
            gauss=full_symmetric(probe.frames["gauss"][0, :n, :n]),
            slope_differences=(value[1 : n + 1] - value[n + 1 :]) / (2 * H),
            newton_differences=(slopes[1 : n + 1] - slopes[n + 1 :]) / (2 * H),
            pools=bool(((match["pool"][:m] != np.arange(m)) & (match["sliding"][:m] == 1)).any()),
            slides=bool(match["sliding"][:m].any()),
            clamped=bool(((match["sliding"][:m] == 0) & ~tip).any()),
        )


@pytest.mark.parametrize("oriented", [False, True], ids=["squared", "root"])
@pytest.mark.parametrize(("n", "m"), [(1, 1), (2, 2), (3, 3), (5, 3), (6, 5), (10, 4)])
def test_derivatives_equal_central_differences(n, m, oriented):
    weights = np.random.default_rng(n).dirichlet(np.full(m, 3.0))
    taken = list(samples(1, n, m, weights, count=60, oriented=oriented))
    assert len(taken) > 30
    for s in taken:
        scale = max(1e-3, np.abs(s.slope).max())
        np.testing.assert_allclose(s.slope, s.slope_differences, atol=1e-7 * scale)
        scale = max(1e-2, np.abs(s.newton).max())
        np.testing.assert_allclose(s.newton, s.newton_differences, atol=2e-6 * scale)
    if m >= 3:
        assert sum(s.pools for s in taken) >= 1
        assert sum(s.slides for s in taken) >= 10
        assert sum(s.clamped for s in taken) >= 10


@pytest.mark.parametrize("oriented", [False, True], ids=["squared", "root"])
@pytest.mark.parametrize("joints", ["P", "RP", "PR", "RRPR", "PPR", "RPRRP"])
def test_derivatives_hold_for_joints_that_slide(joints, oriented):
    n, clamped = len(joints), 0
    for s in samples(7, n, 3, np.array([0.2, 0.3, 0.5]), count=60, oriented=oriented, joints=joints):
        scale = max(1e-3, np.abs(s.slope).max())
        np.testing.assert_allclose(s.slope, s.slope_differences, atol=1e-7 * scale)
        scale = max(1e-2, np.abs(s.newton).max())
        np.testing.assert_allclose(s.newton, s.newton_differences, atol=2e-6 * scale)
        clamped += s.clamped
    assert clamped >= 5


def test_derivatives_hold_for_a_free_hand():
    for s in samples(2, 4, 3, np.array([0.2, 0.3, 0.5]), count=40, free=3):
        np.testing.assert_allclose(s.slope, s.slope_differences, atol=1e-8)
        np.testing.assert_allclose(s.newton, s.newton_differences, atol=2e-6)


def test_derivatives_hold_with_weightless_points():
    for s in samples(3, 4, 3, np.array([0.0, 0.1, 0.7]), count=40, oriented=True):
        np.testing.assert_allclose(s.slope, s.slope_differences, atol=1e-5)
        np.testing.assert_allclose(s.newton, s.newton_differences, atol=1e-4 * max(1.0, np.abs(s.newton).max()))


@pytest.mark.parametrize("oriented", [False, True], ids=["squared", "root"])
def test_gauss_newton_part_is_positive_semidefinite(oriented):
    for n, m in [(3, 3), (6, 5)]:
        for s in samples(4, n, m, np.full(m, 1.0 / m), count=40, oriented=oriented):
            eigenvalues = np.linalg.eigvalsh(s.gauss)
            assert eigenvalues.min() >= -1e-12 * max(1.0, eigenvalues.max())


def test_newton_becomes_gauss_where_every_point_is_met():
    rng = np.random.default_rng(5)
    probe = Probe(1, 4)
    for _ in range(20):
        table, q = random_table(rng, 4, zeros=False), rng.uniform(-np.pi, np.pi, 4)
        vertices, _ = arm(rows_of(table), q)
        points = point_at(vertices, np.array([0.31, 0.62, 1.0]) * table.length)
        probe.load(table).pose(q).look(points, [0.3, 0.3, 0.4], differentiate=True)
        frame = probe.frames[0]
        np.testing.assert_allclose(frame["slope"][:4], 0.0, atol=1e-13)
        np.testing.assert_allclose(np.tril(frame["newton"][:4, :4]), np.tril(frame["gauss"][:4, :4]), atol=1e-13)


def test_a_turn_about_an_axis_through_all_joints_moves_nothing():
    # joint 1 of this arm turns everything about z: with all points on z, value does not depend on q_1
    rng = np.random.default_rng(6)
    probe = Probe(1, 3)
    table = random_table(rng, 3)
    table = type(table)(np.r_[0.0, table.alpha[1:]], np.r_[0.0, table.a[1:]], table.d)
    points = np.array([[0, 0, 0.1], [0, 0, 0.3], [0, 0, 0.5]])
    probe.load(table).pose(rng.uniform(-3, 3, 3)).look(points, [0.2, 0.3, 0.5], differentiate=True)
    frame = probe.frames[0]
    assert abs(frame["slope"][0]) < 1e-15
    np.testing.assert_allclose(frame["newton"][:3, 0], 0.0, atol=1e-15)
