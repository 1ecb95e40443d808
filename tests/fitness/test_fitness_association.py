"""The association is the exact optimum over ordered places, for any polyline."""

from __future__ import annotations

import numpy as np
import pytest
from kernel_probe import Probe
from plain_reference import arc_lengths, arm, associate, point_at
from scenes import random_frames, random_table, rows_of
from scipy.optimize import minimize

SIZE = 16


@pytest.fixture(scope="module")
def probe():
    return Probe(SIZE, 3)


def random_polylines(rng, pieces):
    """Polylines of any angles, shape (SIZE, pieces + 1, 3)."""
    return np.cumsum(rng.normal(0.0, 0.15, (SIZE, pieces + 1, 3)), axis=1)


def cost(vertices, points, weights, arcs):
    distance = np.linalg.norm(point_at(vertices, arcs) - points[: len(arcs)], axis=1)
    return float(np.sum(np.maximum(weights[: len(arcs)], 1e-6) * distance**2))


@pytest.mark.parametrize("tie_hand", [True, False])
@pytest.mark.parametrize("m", [1, 2, 3, 4, 5])
def test_association_equals_the_plain_optimum(probe, m, tie_hand):
    rng = np.random.default_rng([1, m, tie_hand])
    bound = 0
    for pieces in (1, 2, 5, 9, 14):
        vertices = random_polylines(rng, pieces)
        points = rng.normal(0.0, 0.4, (SIZE, m, 3))
        weights = rng.dirichlet(np.ones(m))
        weights[rng.random(m) < 0.2] = 0.0
        probe.polylines(vertices).look(points, weights, free=m - 1 if tie_hand else m)
        for b in range(SIZE):
            exact = associate(vertices[b], points[b], weights, tie_hand)
            alone = [associate(vertices[b], points[b, i : i + 1], np.ones(1), False)[0] for i in range(m)]
            bound += bool(np.any(np.diff(alone[: m - 1 if tie_hand else m]) < 0))
            arcs = probe.arcs(m)[b]
            assert cost(vertices[b], points[b], weights, arcs) == pytest.approx(
                cost(vertices[b], points[b], weights, exact), rel=1e-12, abs=1e-16
            )
            np.testing.assert_allclose(arcs, exact, atol=1e-9)
            places = point_at(vertices[b], arcs)
            np.testing.assert_allclose(probe.matches["place"][b, :m], places, atol=1e-13)
            np.testing.assert_allclose(
                probe.matches["distance"][b, :m], np.linalg.norm(places - points[b], axis=1), atol=1e-13
            )
    assert m <= 1 + tie_hand or bound > 10  # the order must have bound often for this to mean anything


@pytest.mark.parametrize("m", [2, 3, 4, 5])
def test_no_finer_grid_finds_a_better_order(probe, m):
    rng = np.random.default_rng([2, m])
    vertices, points = random_polylines(rng, 7), rng.normal(0.0, 0.4, (SIZE, m, 3))
    weights = rng.dirichlet(np.ones(m))
    probe.polylines(vertices).look(points, weights, free=m)
    for b in range(SIZE):
        grid = np.linspace(0.0, arc_lengths(vertices[b])[-1], 2001)
        on_arm, total = point_at(vertices[b], grid), np.zeros(len(grid))
        for i in range(m):
            total = np.minimum.accumulate(total) + weights[i] * ((on_arm - points[b, i]) ** 2).sum(axis=1)
        found = cost(vertices[b], points[b], weights, probe.arcs(m)[b])
        assert found <= total.min() + 1e-15
        farthest = np.linalg.norm(on_arm[:, None] - points[b], axis=2).max()
        assert found >= total.min() - 2.0 * farthest * grid[1]  # what rounding every place to the grid can cost


def test_local_search_over_sigma_finds_nothing_better(probe):
    rng = np.random.default_rng(3)
    m, weights = 4, np.array([0.1, 0.4, 0.3, 0.2])
    vertices, points = random_polylines(rng, 6), rng.normal(0.0, 0.4, (SIZE, m, 3))
    probe.polylines(vertices).look(points, weights, free=m)
    for b in range(0, SIZE, 4):
        longest = arc_lengths(vertices[b])[-1]
        found = cost(vertices[b], points[b], weights, probe.arcs(m)[b])
        for _ in range(5):
            result = minimize(
                lambda arcs, b=b: cost(vertices[b], points[b], weights, arcs),
                np.sort(rng.uniform(0, longest, m)),
                bounds=[(0, longest)] * m,
                constraints={"type": "ineq", "fun": np.diff},
                method="SLSQP",
            )
            assert found <= cost(vertices[b], points[b], weights, np.sort(np.clip(result.x, 0, longest))) + 1e-12


@pytest.mark.parametrize("n", [1, 2, 4, 7, 10])
def test_arms_are_associated_like_plain_polylines(n):
    rng = np.random.default_rng([4, n])
    probe = Probe(6, n)
    tables = [random_table(rng, n, theta=True, negative=True, yaw=True) for _ in range(6)]
    q, points = rng.uniform(-np.pi, np.pi, (6, n)), random_frames(rng, 6, 4)
    weights = np.array([0.2, 0.0, 0.3, 0.5])
    probe.load(tables).pose(q).look(points, weights)
    for b in range(6):
        vertices, _ = arm(rows_of(tables[b]), q[b], tables[b].base_yaw)
        np.testing.assert_allclose(probe.arcs(4)[b], associate(vertices, points[b], weights), atol=1e-9)


def test_sigma_never_decreases_and_the_hand_sits_at_the_end(probe):
    rng = np.random.default_rng(5)
    for m in (2, 3, 5, 8, 12):
        vertices, points = random_polylines(rng, 8), rng.normal(0.0, 0.5, (SIZE, m, 3))
        probe.polylines(vertices).look(points, rng.dirichlet(np.ones(m)))
        arcs = probe.arcs(m)
        assert (np.diff(arcs, axis=1) >= 0.0).all()
        assert (arcs[:, 0] >= 0.0).all()
        np.testing.assert_allclose(arcs[:, -1], probe.chains["length"], rtol=1e-15)
        np.testing.assert_array_equal(probe.matches["place"][:, m - 1], vertices[:, -1])


def test_order_does_not_bind_where_points_stand_in_order(probe):
    rng = np.random.default_rng(6)
    vertices = random_polylines(rng, 6)
    where = np.sort(rng.uniform(0.05, 0.95, (SIZE, 5)), axis=1)
    points = np.stack([point_at(v, s * arc_lengths(v)[-1]) for v, s in zip(vertices, where, strict=True)])
    probe.polylines(vertices).look(points, np.full(5, 0.2), free=5)
    np.testing.assert_allclose(probe.matches["distance"][:, :5], 0.0, atol=1e-15)
    assert (probe.matches["pool"][:, :5] == np.arange(5)).all()


def test_pooled_points_share_their_weighted_mean(probe):
    vertices = np.tile([[0.0, 0, 0], [1.0, 0, 0]], (SIZE, 1, 1))
    points = np.array([[0.8, 0.1, 0], [0.2, 0.1, 0], [0.9, 0, 0.1]])
    probe.polylines(vertices).look(points, [0.3, 0.6, 0.1], free=3)
    common = (0.3 * 0.8 + 0.6 * 0.2) / 0.9
    np.testing.assert_allclose(probe.arcs(3)[0], [common, common, 0.9], atol=1e-15)
    assert probe.matches["pool"][0, :3].tolist() == [0, 0, 2]


def test_weightless_points_still_keep_their_place_near_their_point(probe):
    vertices = np.tile([[0.0, 0, 0], [1.0, 0, 0]], (SIZE, 1, 1))
    points = np.array([[0.3, 0.2, 0], [0.7, 0.2, 0], [1.0, 0, 0]])
    probe.polylines(vertices).look(points, [0.0, 0.0, 1.0])
    np.testing.assert_allclose(probe.arcs(3)[0], [0.3, 0.7, 1.0], atol=1e-15)
    assert probe.frames["g"][0] == 0.0
