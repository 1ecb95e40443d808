"""The area E_t: the length-weighted mean distance between the arm's parts and the demonstrator's segments."""

from __future__ import annotations

import numpy as np
import plain_reference
import pytest
from kernel_probe import Probe
from scenes import random_frames, random_table, rows_of
from scipy.integrate import quad

SIZE = 8


def straight(length, pieces=1):
    """The vertices of a straight arm along x."""
    return np.c_[np.linspace(0.0, length, pieces + 1), np.zeros((pieces + 1, 2))]


@pytest.mark.parametrize("delta", [0.0101, 0.037, 0.5])
@pytest.mark.parametrize("n", [1, 3, 6, 10])
def test_area_equals_the_plain_sum(n, delta):
    rng = np.random.default_rng([1, n])
    probe = Probe(SIZE, n)
    for m in (1, 2, 3, 5):
        tables = [random_table(rng, n, theta=True, negative=True, yaw=True) for _ in range(SIZE)]
        q, points = rng.uniform(-3, 3, (SIZE, n)), random_frames(rng, SIZE, m)
        weights = rng.dirichlet(np.ones(m))
        probe.load(tables).pose(q).look(points, weights, delta=delta)
        for b in range(SIZE):
            vertices, _ = plain_reference.arm(rows_of(tables[b]), q[b], tables[b].base_yaw)
            arcs = plain_reference.associate(vertices, points[b], weights)
            expected = plain_reference.area(vertices, arcs, points[b], delta)
            assert probe.areas[b] == pytest.approx(expected, abs=1e-9)


def test_an_arm_on_the_demonstrators_has_no_area():
    probe = Probe(2, 3).polylines([straight(0.9, 3)] * 2)
    points = np.array([[0.3, 0, 0], [0.55, 0, 0], [0.9, 0, 0]])
    probe.look(points, [0.2, 0.3, 0.5])
    assert probe.areas[0] < 1e-16


def test_a_parallel_arm_is_its_distance_away():
    probe = Probe(2, 3).polylines([straight(1.0, 2)] * 2)
    points = np.array([[0.0, 0.2, 0.0], [1.0, 0.2, 0.0]])  # the first point sits at the base, the rest runs beside
    probe.look(points, [0.5, 0.5])
    assert probe.areas[0] == pytest.approx(0.2, abs=1e-15)


def test_a_slanted_arm_has_the_area_of_a_triangle():
    """Straight arm along x against the segment from the base to a point up the slope: the mean of x sin(angle)."""
    angle = 0.3
    probe = Probe(2, 3).polylines([straight(1.0)] * 2)
    probe.look(np.array([[2.0 * np.cos(angle), 2.0 * np.sin(angle), 0.0]]), [1.0], delta=1e-3)
    assert probe.areas[0] == pytest.approx(0.5 * np.sin(angle), abs=1e-12)


def test_a_short_segment_is_left_behind_at_its_end():
    """Beyond the segment's end the distance is that to the end itself."""
    probe = Probe(2, 3).polylines([straight(1.0)] * 2)
    end = np.array([0.4, 0.3, 0.0])
    probe.look(end[None], [1.0], delta=1e-4)

    def distance(x):
        s = np.clip(x * end[0] / (end @ end), 0.0, 1.0)
        return np.hypot(x - s * end[0], s * end[1])

    expected = quad(distance, 0.0, 1.0, points=[(end @ end) / end[0]])[0]
    assert probe.areas[0] == pytest.approx(expected, abs=1e-8)


def test_points_in_one_place_make_a_segment_of_no_length():
    probe = Probe(2, 3).polylines([straight(1.0)] * 2)
    points = np.array([[0.5, 0.1, 0.0], [0.5, 0.1, 0.0]])
    probe.look(points, [0.5, 0.5], delta=1e-4)
    beyond = quad(lambda x: np.hypot(x - 0.5, 0.1), 0.5, 1.0)[0]
    before = quad(lambda x: x * np.sin(np.arctan2(0.1, 0.5)), 0.0, 0.5)[0]
    assert probe.areas[0] == pytest.approx(before + beyond, abs=1e-7)


@pytest.mark.parametrize("length", [0.11, 0.23, 0.37, 0.41, 0.53, 0.59, 0.67, 0.71, 0.83, 0.97])
def test_a_part_of_whole_pieces_is_cut_in_as_many_whatever_the_rounding(length):
    """The tool is 0.1 m, ten pieces of 0.01 m; length + 0.1 - length may come out as a last bit more or less."""
    vertices = np.array([[0.0, 0, 0], [length, 0, 0], [length, 0.1, 0]])
    points = np.array([[length + 0.3, -0.2, 0.0], [length - 0.2, 0.4, 0.3]])
    probe = Probe(2, 3).polylines([vertices] * 2)
    probe.look(points, [0.5, 0.5], delta=0.01)
    assert probe.arcs(2)[0] == pytest.approx([length, length + 0.1])
    first = plain_reference.area(vertices, [length, length], points, 0.01) * (length + 0.1)
    middle = np.c_[np.full(10, length), 0.005 + 0.01 * np.arange(10), np.zeros(10)] - points[0]
    axis = points[1] - points[0]
    s = np.clip(middle @ axis / (axis @ axis), 0.0, 1.0)
    tool = np.linalg.norm(middle - s[:, None] * axis, axis=1).mean() * 0.1
    assert probe.areas[0] == pytest.approx((first + tool) / (length + 0.1), abs=1e-12)
