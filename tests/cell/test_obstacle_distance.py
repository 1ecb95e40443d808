"""Distance of segments to obstacles: against coal and brute force, its gradient, what a room's motion leaves alone."""

import coal
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from armdesign.cell.distance_field import swept_field
from armdesign.cell.kernels.distance import WITNESS, segment_distances, segment_excesses
from armdesign.cell.obstacles import Box, Cylinder, Mesh, Obstacle, Obstacles, Plane, Sphere
from armdesign.errors import ObstacleError
from armdesign.kinematics.base_pose import BasePose

SOLIDS = [Box(np.array([0.4, 0.3, 0.2])), Sphere(0.15), Cylinder(0.1, 0.5), Plane()]
HERE = BasePose().columns


def posed(rng):
    pose = np.eye(4)
    pose[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    pose[:3, 3] = rng.uniform(-0.3, 0.3, 3)
    return pose


def distances(shape, pose, ends):
    arrays = Obstacles((Obstacle("it", shape, pose),)).arrays()
    witness = np.zeros(len(ends), dtype=WITNESS)
    return segment_distances(arrays, 0, arrays.poses[0].copy(), np.ascontiguousarray(ends), witness), witness


def by_coal(shape, pose, ends, radius):
    """Distance of capsules by coal."""
    found = []
    request = coal.DistanceRequest()
    request.gjk_tolerance, request.gjk_max_iterations = 1e-10, 1000
    for a, b in ends:
        along = b - a
        length = np.linalg.norm(along)
        turn, _ = Rotation.align_vectors([along / length], [[0.0, 0.0, 1.0]])
        at = coal.Transform3s(turn.as_matrix(), (a + b) / 2.0)
        capsule, room = coal.Capsule(radius, length), coal.Transform3s(pose[:3, :3], pose[:3, 3])
        found.append(coal.distance(capsule, at, shape.geometry(), room, request, coal.DistanceResult()))
    return np.array(found)


@pytest.mark.parametrize("shape", SOLIDS, ids=lambda shape: type(shape).__name__)
def test_capsules_outside_are_as_far_as_coal_says(shape):
    rng = np.random.default_rng(3)
    pose, ends = posed(rng), rng.uniform(-1.0, 1.0, (200, 2, 3))
    ours = distances(shape, pose, ends)[0] - 0.02
    coals, outside = by_coal(shape, pose, ends, 0.02), ours > 1e-6
    assert outside.sum() > 30
    np.testing.assert_allclose(ours[outside], coals[outside], rtol=0.0, atol=1e-9)
    assert (coals[~outside] <= 1e-6).all()


@pytest.mark.parametrize("shape", SOLIDS, ids=lambda shape: type(shape).__name__)
def test_no_point_of_a_segment_is_nearer_and_the_nearest_is_that_near(shape):
    rng = np.random.default_rng(5)
    pose, ends = posed(rng), rng.uniform(-0.5, 0.5, (60, 2, 3))
    ours, witness = distances(shape, pose, ends)
    obstacle, shares = Obstacle("it", shape, pose), np.linspace(0.0, 1.0, 2001)
    for (a, b), distance, found in zip(ends, ours, witness, strict=True):
        brute = obstacle.distances(a + shares[:, None] * (b - a)).min()
        assert distance <= brute + 1e-12
        assert brute - distance < 1e-3
        there = a + found["along"] * (b - a)
        assert obstacle.distances(there[None])[0] == pytest.approx(distance, abs=1e-9)
        assert np.linalg.norm(found["normal"]) <= 1.0 + 1e-12  # 1 but at a kink, where it is a mean


@pytest.mark.parametrize("shape", SOLIDS, ids=lambda shape: type(shape).__name__)
def test_the_gradient_is_that_of_differences(shape):
    rng = np.random.default_rng(7)
    pose, ends = posed(rng), rng.uniform(-0.6, 0.6, (40, 2, 3))
    _, witness = distances(shape, pose, ends)
    step, right = 1e-6, 0
    for axis in range(3):
        shift = step * np.eye(3)[axis]
        slope = (distances(shape, pose, ends + shift)[0] - distances(shape, pose, ends - shift)[0]) / (2.0 * step)
        right += np.isclose(slope, witness["normal"][:, axis], atol=1e-5).sum()
    assert right >= 3 * len(ends) - 6  # but at kinks


def test_a_room_turned_and_moved_changes_nothing():
    rng = np.random.default_rng(9)
    move, ends = posed(rng), rng.uniform(-0.6, 0.6, (30, 2, 3))
    moved = ends @ move[:3, :3].T + move[:3, 3]
    for shape in SOLIDS:
        pose = posed(rng)
        before = Obstacles((Obstacle("it", shape, pose),))
        after = before.moved(move).arrays()
        there = segment_distances(after, 0, after.poses[0].copy(), np.ascontiguousarray(moved), np.zeros(30, WITNESS))
        np.testing.assert_allclose(there, distances(shape, pose, ends)[0], atol=1e-12)


@pytest.mark.parametrize("made", [trimesh.creation.box((0.3, 0.2, 0.4)), trimesh.creation.torus(0.2, 0.06, 24, 12)])
def test_a_mesh_is_as_far_as_its_triangles_within_the_grids_bound(made):
    mesh = Mesh(np.array(made.vertices), np.array(made.faces))
    rng = np.random.default_rng(11)
    points = rng.uniform(-0.4, 0.4, (300, 3))
    exact = Obstacle("it", mesh, np.eye(4)).distances(points)
    inside = made.contains(points)
    np.testing.assert_array_equal(exact < 0.0, inside)
    near = trimesh.proximity.closest_point(made, points)[1]
    np.testing.assert_allclose(np.abs(exact), near, atol=1e-9)
    ours = distances(mesh, np.eye(4), np.stack([points, points], axis=1))[0]
    reach = exact < 0.09  # within the grid's margin
    assert (ours <= exact + mesh.field.bound).all()  # never farther than it is by more than that
    np.testing.assert_allclose(ours[reach], exact[reach], atol=mesh.field.bound)


def test_a_carried_obstacle_goes_with_its_carrier():
    turn = Rotation.from_rotvec([[0.0, 0.0, 0.1 * k] for k in range(5)]).as_matrix()
    carrier = np.tile(np.eye(4), (5, 1, 1))
    carrier[:, :3, :3], carrier[:, 0, 3] = turn, 0.1 * np.arange(5)
    pose = np.eye(4)
    pose[2, 3] = 0.2
    room = Obstacles((Obstacle("part", SOLIDS[0], pose, "tray"), Obstacle("still", SOLIDS[1], pose)))
    arrays = room.carried({"tray": carrier}).arrays()
    with pytest.raises(ObstacleError, match="'part' is carried by 'tray'"):
        room.carried({})
    np.testing.assert_array_equal(arrays.frames, [5, 1])
    np.testing.assert_array_equal(arrays.first, [0, 5])
    np.testing.assert_allclose(arrays.poses[:5, 9:], [[0.1 * k, 0.0, 0.2] for k in range(5)], atol=1e-15)
    np.testing.assert_allclose(arrays.turns[:4], [[0.0, 0.0, 0.1]] * 4, atol=1e-12)


def test_the_swept_volume_is_as_far_as_its_segments():
    arm = np.array([[[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]], [[0.0, 0.0, 0.0], [0.0, 0.3, 0.0]]])
    field = swept_field(arm)
    points = np.array([[0.1, 0.0, 0.0], [0.1, 0.0, 0.1], [-0.1, 0.0, 0.0]])
    excess = segment_excesses(field.arrays, np.stack([points, points], axis=1), np.zeros(3, dtype=WITNESS))
    np.testing.assert_allclose(excess, [0.0, 0.1, 0.1], atol=field.bound)
