"""Capsules of the search against the exact solids, and the distance of two segments."""

from __future__ import annotations

import numpy as np
import pytest

from armdesign.bodies.arm_body import arm_body
from armdesign.bodies.capsules import capsule_sizes
from armdesign.bodies.kernels.capsules import BODY, WITNESS, build_body, place_capsule, segment_segment
from armdesign.kinematics.compilation import entry
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.models import default_limits
from armdesign.settings import Body


@entry
def build_all(bodies, sizes, rows, slides):
    for k in range(len(rows)):
        build_body(bodies[k], sizes[0], rows[k], slides[k])


@entry
def place_all(ends, bodies, poses):
    for k in range(bodies[0].capsules):
        place_capsule(ends[k], bodies[0], poses, k)


@entry
def measure_all(segments, witnesses):
    for k in range(len(segments)):
        s = segments[k]
        segment_segment(s[0], s[1], s[2], s[3], witnesses[k])


def built(table, body, slides, *, placed=True):
    """The BODY record of one arm."""
    rows = np.zeros((1, table.dof + 1, 4))
    rows[0, :, 0], rows[0, :, 1], rows[0, :, 2] = table.alpha, table.a, table.d
    bodies = np.zeros(1, dtype=BODY)
    sizes = capsule_sizes(body, default_limits(table.prismatic), table.prismatic, placed=placed)
    build_all(bodies, sizes, rows, np.asarray(slides, dtype=float)[None])
    return bodies[0]


def random_body(rng, n):
    """All modules alike, or every joint with its own."""
    if rng.random() < 0.5:
        return Body()
    return Body(
        modules=[tuple(module) for module in rng.uniform([0.03, 0.03, 0.1], [0.12, 0.12, 2.0], (n, 3)).tolist()]
    )


def random_arm(rng, n):
    """A table with some lengths of 0 and some negative ones, and slides on both sides of the joints."""
    table = DHTable(
        rng.uniform(-3.0, 3.0, n + 1) * (rng.random(n + 1) < 0.8),
        rng.uniform(-0.1, 0.4, n + 1) * (rng.random(n + 1) < 0.7),
        rng.uniform(-0.1, 0.4, n + 1) * (rng.random(n + 1) < 0.7),
        joints="".join(rng.choice(["R", "R", "R", "P"], n)),
    )
    still = (rng.random(n) < 0.3) | np.array(table.prismatic)
    return table, np.where(still, table.d[:-1], table.d[:-1] + rng.uniform(-0.1, 0.1, n))


@pytest.mark.parametrize("placed", [True, False])
def test_capsules_are_about_the_parts_of_the_exact_body_in_their_order(placed):
    rng = np.random.default_rng(3)
    for _ in range(40):
        table, slides = random_arm(rng, int(rng.integers(1, 7)))
        body = random_body(rng, table.dof)
        exact = arm_body(table, body, slides, placed=placed, side=None)
        record = built(table, body, slides, placed=placed)
        assert record["parts"] == len(exact.parts)
        for k, part in enumerate(exact.parts):
            assert (record["link"][k], record["module"][k]) == (part.link, part.module)
            assert farthest_outside(record, k, part.solid) < 1e-9


def farthest_outside(record, k, solid):
    """How far a cylinder's rims stick out of capsule k [m]; where they are inside, all of it is."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24)
    ring = np.stack([solid.radius * np.cos(angle), solid.radius * np.sin(angle), 0.0 * angle], axis=1)
    ring = ring @ solid.pose[:3, :3].T
    rims = np.concatenate([end + ring for end in solid.ends])
    a, b = record["end"][k]
    span = b - a
    along = np.clip((rims - a) @ span / max(span @ span, 1e-30), 0.0, 1.0)
    beyond_ends = np.linalg.norm(rims - a - along[:, None] * span, axis=1)
    return float(beyond_ends.max() - record["radius"][k])


def test_pairs_are_those_of_the_exact_body_cut_at_the_same_spheres():
    rng = np.random.default_rng(4)
    for _ in range(60):
        table, slides = random_arm(rng, int(rng.integers(2, 7)))
        body = random_body(rng, table.dof)
        exact, record = arm_body(table, body, slides, placed=True), built(table, body, slides)

        def seen(link, ends):
            return (link, *np.round(np.sum(ends, axis=0), 6) + 0.0, round(float(np.linalg.norm(ends[1] - ends[0])), 6))

        centres = [seen(shape.link, shape.solid.ends) for shape in exact.shapes]
        expected = sorted(tuple(sorted((centres[i][:4], centres[j][:4]))) for i, j in exact.pairs)
        mine = [seen(int(record["link"][k]), record["end"][k])[:4] for k in range(record["capsules"])]
        pairs = [(record["first"][p], record["second"][p]) for p in range(record["pairs"])]
        assert np.allclose(np.array(sorted(tuple(sorted((mine[i], mine[j]))) for i, j in pairs)), np.array(expected))


def test_levers_bound_the_distance_from_every_axis_in_any_pose():
    rng = np.random.default_rng(5)
    for _ in range(20):
        n = int(rng.integers(2, 6))
        table, slides = random_arm(rng, n)
        record = built(table, Body(), slides)
        base = np.r_[np.eye(3).ravel(), np.zeros(3)][None]
        for _ in range(10):
            frames = table.frames(rng.uniform(*default_limits(table.prismatic).T))
            poses = np.stack([np.r_[f[:3, :3].T.ravel(), f[:3, 3]] for f in frames[:n]])
            ends = np.full((record["capsules"], 6), np.nan)
            place_all(ends, np.array([record]), np.concatenate([base, poses]))
            for k in range(record["capsules"]):
                for j in range(int(record["link"][k])):
                    if table.prismatic[j]:
                        assert record["lever"][k, j] == 1.0
                        continue
                    axis, origin = poses[j, 6:9], poses[j, 9:]
                    away = np.linalg.norm(np.cross(ends[k].reshape(2, 3) - origin, axis), axis=1).max()
                    assert away <= record["lever"][k, j] + 1e-9
                    if j == record["link"][k] - 1:
                        assert away == pytest.approx(record["lever"][k, j], abs=1e-9)


def test_distance_of_segments_is_the_least_over_a_fine_grid_and_exact_where_they_are_special():
    rng = np.random.default_rng(6)
    segments = rng.uniform(-1.0, 1.0, (300, 4, 3))
    segments[:60, 1] = segments[:60, 0]  # the first has no length
    segments[30:90, 3] = segments[30:90, 2]  # nor the second
    segments[90:150, 3] = segments[90:150, 2] + (segments[90:150, 1] - segments[90:150, 0]) * 0.7  # parallel
    segments[150:180, 2:] = segments[150:180, :2] * 0.5  # on one line through the room's origin or not
    witnesses = np.zeros(len(segments), dtype=WITNESS)
    measure_all(segments, witnesses)
    places = np.linspace(0.0, 1.0, 101)
    for (a, b, c, d), witness in zip(segments, witnesses, strict=True):
        first, second = a + places[:, None] * (b - a), c + places[:, None] * (d - c)
        grid = np.linalg.norm(first[:, None] - second[None], axis=2).min()
        p, q = a + witness["s"] * (b - a), c + witness["t"] * (d - c)
        assert np.linalg.norm(p - q) == pytest.approx(witness["distance"], abs=1e-12)
        assert grid - 0.05 <= witness["distance"] <= grid + 1e-12
        assert np.linalg.norm(witness["normal"]) == pytest.approx(1.0)
        if witness["distance"] > 1e-6:
            assert np.allclose(witness["normal"] * witness["distance"], p - q, atol=1e-12)


def test_segments_that_nearly_are_parallel_or_cross():
    u = np.array([1.0, 0.0, 0.0])
    cases = []
    for angle in (0.0, 1e-12, 1e-9, 1e-7, 1e-5):
        v = np.array([np.cos(angle), np.sin(angle), 0.0])
        shift = np.array([0.2, 0.0, 0.3])
        cases.append((np.stack([-u, u, shift - v, shift + v]), 0.3))
    cases.append((np.array([[-1.0, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]]), 0.0))
    cases.append((np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]), 1.0))
    witnesses = np.zeros(len(cases), dtype=WITNESS)
    measure_all(np.stack([segments for segments, _ in cases]), witnesses)
    assert witnesses["distance"] == pytest.approx([distance for _, distance in cases], abs=1e-9)
    assert np.abs(witnesses["normal"][-2] @ [0.0, 0.0, 1.0]) == pytest.approx(1.0)
