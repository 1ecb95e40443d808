"""Mass properties of cylinders by integration, and what a sphere leaves of them."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from armdesign.bodies.cylinder import Cylinder, along
from armdesign.bodies.inertia import Inertial, combine
from armdesign.errors import DesignError


def random_pose(rng):
    return pin.exp6(rng.normal(size=6)).homogeneous


def as_pin(inertial):
    return pin.Inertia(inertial.mass, inertial.com, inertial.inertia)


def integrated(part):
    """Mass, centre and inertia of a cylinder by quadrature that is exact for second moments."""
    nodes, weights = np.polynomial.legendre.leggauss(4)
    r = part.inner_radius + (nodes + 1) / 2 * (part.radius - part.inner_radius)
    phi = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    R, Phi, Z = np.meshgrid(r, phi, nodes * part.length / 2, indexing="ij")
    volume = (weights * r)[:, None, None] * np.ones_like(phi)[None, :, None] * weights[None, None, :]
    local = np.stack([R * np.cos(Phi), R * np.sin(Phi), Z], axis=-1).reshape(-1, 3)
    points = local @ part.pose[:3, :3].T + part.pose[:3, 3]
    mass = part.mass * volume.ravel() / volume.sum()
    com = mass @ points / mass.sum()
    r = points - com
    return mass.sum(), com, np.eye(3) * (mass * (r**2).sum(axis=1)).sum() - (r * mass[:, None]).T @ r


@pytest.mark.parametrize("inner", [0.0, 0.017, 0.0199])
def test_a_cylinder_weighs_what_its_integral_says(inner):
    part = Cylinder(random_pose(np.random.default_rng(1)), 0.02, 0.3, 0.7, "tube", inner)
    mass, com, inertia = integrated(part)
    np.testing.assert_allclose(part.inertial.mass, mass, rtol=1e-14)
    np.testing.assert_allclose(part.inertial.com, com, atol=1e-15)
    np.testing.assert_allclose(part.inertial.inertia, inertia, atol=1e-15)


def test_combining_is_pinocchios_sum():
    rng = np.random.default_rng(2)
    parts = [Cylinder(random_pose(rng), *rng.uniform(0.1, 1, 3), "tube", inner_radius=0.05).inertial for _ in range(5)]
    total, expected = combine(parts), sum((as_pin(part) for part in parts[1:]), as_pin(parts[0]))
    assert total.mass == pytest.approx(expected.mass, rel=1e-14)
    np.testing.assert_allclose(total.com, expected.lever, atol=1e-14)
    np.testing.assert_allclose(total.inertia, expected.inertia, atol=1e-13)


def test_moving_is_pinocchios_action():
    rng = np.random.default_rng(3)
    body, pose = Cylinder(random_pose(rng), 0.1, 0.5, 2.0, "tube").inertial, random_pose(rng)
    expected, moved = pin.SE3(pose).act(as_pin(body)), body.moved(pose)
    np.testing.assert_allclose(moved.com, expected.lever, atol=1e-14)
    np.testing.assert_allclose(moved.inertia, expected.inertia, atol=1e-14)


def test_two_halves_make_the_whole():
    whole = Cylinder(np.eye(4), 0.02, 0.4, 1.0, "tube", 0.01)
    poses = [np.eye(4), np.eye(4)]
    poses[0][2, 3], poses[1][2, 3] = -0.1, 0.1
    halves = combine([Cylinder(pose, 0.02, 0.2, 0.5, "tube", 0.01).inertial for pose in poses])
    np.testing.assert_allclose(halves.inertia, whole.inertial.inertia, atol=1e-16)
    np.testing.assert_allclose(halves.com, 0.0, atol=1e-17)


@pytest.mark.parametrize(
    ("mass", "inertia"),
    [
        (0.0, np.eye(3)),
        (np.nan, np.eye(3)),
        (1.0, np.diag([1.0, 1.0, 2.1])),
        (1.0, np.diag([1.0, 1.0, 0.0])),
        (1.0, np.eye(3) + np.eye(3, k=1)),
        (1.0, np.full((3, 3), np.nan)),
        (1.0, np.eye(2)),
    ],
)
def test_an_impossible_body_is_refused(mass, inertia):
    with pytest.raises(DesignError):
        Inertial(mass, np.zeros(3), inertia)


def test_a_body_of_nothing_is_refused():
    with pytest.raises(DesignError):
        combine([])


@pytest.mark.parametrize("seed", range(20))
def test_a_frame_along_a_piece_has_its_ends_on_it(seed):
    rng = np.random.default_rng(seed)
    start, end = rng.normal(size=(2, 3)) * (rng.random(3) > 0.4 if seed % 2 else 1.0) + [[0], [1e-3]]
    pose = along(start, end)
    np.testing.assert_allclose(pose[:3, :3].T @ pose[:3, :3], np.eye(3), atol=1e-14)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    ends = Cylinder(pose, 0.02, float(np.linalg.norm(end - start)), 1.0, "tube").ends
    np.testing.assert_allclose(sorted(ends, key=lambda point: np.linalg.norm(point - start)), [start, end], atol=1e-14)


def test_frames_along_the_axes_are_quarter_turns():
    for axis, swap in ((0, [2, 1, 0]), (1, [0, 2, 1]), (2, [0, 1, 2])):
        for sign in (-1.0, 1.0):
            turn = along(np.zeros(3), sign * np.eye(3)[axis])[:3, :3]
            np.testing.assert_array_equal(np.abs(turn), np.eye(3)[swap])


def points_of(part, rng, count=2000):
    """Points all over the surface of a cylinder, its edges among them."""
    phi, height = rng.uniform(0, 2 * np.pi, count), rng.uniform(-0.5, 0.5, count) * part.length
    radius = part.radius * np.sqrt(rng.random(count))
    on_faces = rng.random(count) < 0.5
    height[on_faces] = np.sign(height[on_faces]) * part.length / 2
    radius[~on_faces | (rng.random(count) < 0.2)] = part.radius
    local = np.stack([radius * np.cos(phi), radius * np.sin(phi), height], axis=1)
    return local @ part.pose[:3, :3].T + part.pose[:3, 3]


@pytest.mark.parametrize("seed", range(20))
def test_what_a_sphere_leaves_is_outside_and_nothing_more_is_cut(seed):
    rng = np.random.default_rng(seed)
    part = Cylinder(random_pose(rng), 0.02, 0.3, 1.0, "tube")
    centre, radius = part.pose[:3, 3] + rng.normal(size=3) * 0.06, rng.uniform(0.03, 0.12)
    pieces = part.outside(centre, radius)
    for piece in pieces:
        assert np.linalg.norm(points_of(piece, rng) - centre, axis=1).min() >= radius - 1e-12
        assert piece.mass == pytest.approx(part.mass * piece.length / part.length)
    # of every slice that is gone, some point was inside
    axis = part.pose[:3, 2]
    phi = np.linspace(0, 2 * np.pi, 721)
    for height in rng.uniform(-0.149, 0.149, 50):
        middle = part.pose[:3, 3] + height * axis
        left = any(abs((middle - piece.pose[:3, 3]) @ axis) <= piece.length / 2 for piece in pieces)
        rings = [part.pose[:3, :2] @ (r * np.stack([np.cos(phi), np.sin(phi)])) for r in np.linspace(0, 0.02, 21)]
        inside = min(np.linalg.norm(middle[:, None] + ring - centre[:, None], axis=0).min() for ring in rings) < radius
        assert left or inside or abs(height) > 0.148


def test_a_sphere_elsewhere_changes_nothing_and_one_round_it_leaves_nothing():
    part = Cylinder(np.eye(4), 0.02, 0.3, 1.0, "tube")
    assert part.outside(np.array([0.07, 0, 0]), 0.05)[0] is part
    assert part.outside(np.array([0, 0, 0.2]), 0.05)[0] is part
    assert part.outside(np.zeros(3), 0.2) == ()
    below, above = part.outside(np.array([0, 0, 0.05]), 0.05)
    np.testing.assert_allclose(below.ends[:, 2], [-0.15, 0.0], atol=1e-16)
    np.testing.assert_allclose(above.ends[:, 2], [0.1, 0.15], atol=1e-16)
