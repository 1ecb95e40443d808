"""The arm's solids: mass properties by integration, and which piece touches what."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest

from armdesign.errors import DesignError, SettingsError
from armdesign.export.solids import SHORTEST, Cylinder, Inertial, combine, link_bodies
from armdesign.kinematics.dh import DHTable
from armdesign.settings import Body

OPTIONS = Body()
WRIST = DHTable.from_rows([(0, 0, 0.3), (np.pi / 2, 0, 0), (-np.pi / 2, 0, 0), (0, 0, 0.1)])
ELBOW = DHTable.from_rows([(0.5, 0, 0), (-1.57, 0.11, 0), (-0.27, 0.4, -0.2), (1.2, -0.15, 0.02), (-1.57, 0, 0.1)])


def random_pose(rng):
    return pin.exp6(rng.normal(size=6)).homogeneous


def random_tables(count, seed=0):
    rng = np.random.default_rng(seed)
    for _ in range(count):
        rows = rng.uniform(-1, 1, (rng.integers(2, 8), 4)) * (np.pi, 0.4, 0.4, np.pi)
        rows *= rng.random(rows.shape) > 0.3
        yield DHTable.from_rows(rows, base_yaw=rng.uniform(-3, 3))


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


def ends(part):
    """The two ends of a cylinder's axis."""
    return [part.pose[:3, 3] + sign * part.pose[:3, 2] * part.length / 2 for sign in (-1, 1)]


def distance_to(part, point):
    """Distance of a point from a solid cylinder, 0 inside."""
    local = part.pose[:3, :3].T @ (point - part.pose[:3, 3])
    beyond = max(np.hypot(local[0], local[1]) - part.radius, 0.0), max(abs(local[2]) - part.length / 2, 0.0)
    return np.hypot(*beyond)


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


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf, "0.04", True, None])
@pytest.mark.parametrize("name", ["tube_diameter", "joint_mass", "clearance"])
def test_options_are_positive_numbers(name, bad):
    with pytest.raises(SettingsError, match=name):
        Body(**{name: bad})


def test_a_wall_fits_its_tube_and_tool0_is_heavy_enough():
    assert Body(tube_wall=0.02).tube_wall == 0.02
    with pytest.raises(SettingsError, match="tube_wall"):
        Body(tube_wall=0.0201)
    with pytest.raises(SettingsError, match="tool_mass"):
        Body(tool_mass=1e-6)


@pytest.mark.parametrize("table", [WRIST, ELBOW, *random_tables(5)])
def test_tubes_lead_from_each_frame_to_the_next(table):
    placements = table.placements()
    for i, body in enumerate(link_bodies(table, OPTIONS)):
        goal, corner = placements[i][:3, 3], np.eye(4)
        corner[0, 3] = table.a[i]
        path = [np.zeros(3), ((table.base() if i == 0 else np.eye(4)) @ corner)[:3, 3], goal]
        legs = [leg for leg in pairwise(path) if np.linalg.norm(leg[1] - leg[0]) > SHORTEST]
        tubes = body.visual[len(body.visual) - len(legs) :]
        for leg, tube in zip(legs, tubes, strict=True):
            found = sorted(ends(tube), key=lambda end: np.linalg.norm(end - leg[0]))
            np.testing.assert_allclose(found, leg, atol=1e-15)


def test_tubes_are_as_long_as_the_arm():
    for table in random_tables(5):
        tubes = [p for body in link_bodies(table, OPTIONS) for p in body.visual if p.material == "tube"]
        assert sum(tube.length for tube in tubes) == pytest.approx(table.length + OPTIONS.reach)  # post and arm
        area = np.pi * (0.02**2 - 0.017**2)
        assert sum(tube.mass for tube in tubes) == pytest.approx(2700.0 * area * (table.length + OPTIONS.reach))


def test_pieces_of_no_length_are_left_out():
    table = DHTable.from_rows([(0.3, 0, 0), (0.2, SHORTEST / 2, -SHORTEST / 2), (0, 2 * SHORTEST, 0.1)])
    base, first, last = link_bodies(table, OPTIONS)
    assert [part.material for part in base.visual] == ["base", "tube"]
    assert [part.material for part in first.visual] == ["joint"]
    assert [part.material for part in last.visual] == ["joint", "tube", "tube"]


def test_every_link_of_an_arm_without_tubes_has_its_housing():
    bare = DHTable.from_rows([(0, 0, 0), (1, 0, 0), (0, 0, 0)])
    for body in link_bodies(bare, OPTIONS)[1:]:
        assert body.inertial.mass == OPTIONS.joint_mass


def test_a_rod_is_a_tube_whose_wall_fills_it():
    rod = link_bodies(WRIST, Body(tube_wall=0.02))[0].visual[-1]
    assert rod.inner_radius == 0.0
    assert rod.mass == pytest.approx(2700.0 * np.pi * 0.02**2 * 0.3)


def test_turning_the_base_turns_the_base_alone():
    still, yaw = ELBOW, 0.7
    table = DHTable.from_rows(np.stack([still.alpha, still.a + 0.1, still.d + 0.1], axis=1))
    turned = DHTable(table.alpha, table.a, table.d, base_yaw=yaw)
    before, after = link_bodies(table, OPTIONS), link_bodies(turned, OPTIONS)
    expected = before[0].inertial.moved(turned.base())
    np.testing.assert_allclose(after[0].inertial.com, expected.com, atol=1e-15)
    np.testing.assert_allclose(after[0].inertial.inertia, expected.inertia, atol=1e-15)
    for one, other in zip(before[1:], after[1:], strict=True):
        np.testing.assert_array_equal(one.inertial.inertia, other.inertial.inertia)


def test_mirrored_offsets_mirror_the_body():
    up = link_bodies(DHTable.from_rows([(0, 0, 0.2), (0, 0.3, 0.2), (0, 0, 0.1)]), OPTIONS)[1].inertial
    down = link_bodies(DHTable.from_rows([(0, 0, 0.2), (0, -0.3, -0.2), (0, 0, 0.1)]), OPTIONS)[1].inertial
    mirror = np.diag([-1.0, 1.0, -1.0])
    np.testing.assert_allclose(down.com, mirror @ up.com, atol=1e-16)
    np.testing.assert_allclose(down.inertia, mirror @ up.inertia @ mirror, atol=1e-16)


@pytest.mark.parametrize("table", [WRIST, ELBOW, *random_tables(20)])
def test_a_link_ends_outside_the_sphere_about_the_next_joint(table):
    bodies, placements = link_bodies(table, OPTIONS), table.placements()
    for i, body in enumerate(bodies[:-1]):
        joint = placements[i][:3, 3]
        for part in body.collision:
            if part.material == "tube":
                assert distance_to(part, joint) >= OPTIONS.reach - 1e-12
        if bodies[i + 1].collision and bodies[i + 1].collision[0].material == "joint":
            housings = [part for part in body.collision if part.material == "joint"]
            assert not housings or np.linalg.norm(joint) >= 2 * OPTIONS.reach


def test_a_cluster_of_joints_has_one_housing_that_collides():
    kept = [any(p.material == "joint" for p in body.collision) for body in link_bodies(WRIST, OPTIONS)]
    assert kept == [False, False, False, True]


def test_the_plate_collides_unless_the_first_joint_stands_in_it():
    for d, collides in ((0.0, True), (0.3, True), (-0.05, False), (-0.3, True)):
        base = link_bodies(DHTable.from_rows([(0, 0, d), (0, 0, 0.1)]), OPTIONS)[0]
        assert any(part.material == "base" for part in base.collision) == collides
