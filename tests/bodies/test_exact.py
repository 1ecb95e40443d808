"""Clearance by coal over whole motions: closed forms, laws, and what a search over the frames alone would miss."""

from __future__ import annotations

import coal
import numpy as np
import pinocchio as pin
import pytest

from armdesign.bodies.arm_body import arm_body
from armdesign.bodies.exact import TOLERANCE, ExactObstacle, ExactScene, inside_mesh
from armdesign.bodies.swept import displacements, joint_radii, segment_distance
from armdesign.errors import DesignError
from armdesign.kinematics.dh import DHTable
from armdesign.settings import Body

BODY = Body()
BEAM = DHTable.from_rows([(0, 0, 0.3), (0, 0.6, 0), (0, 0, 0)])
"""A post of 0.3 m, a level beam of 0.6 m that turns about it; joint 2 at its end does nothing."""


def random_arm(rng):
    """An arm with modules somewhere on their axes, and a motion of few, wide steps."""
    n = int(rng.integers(2, 7))
    rows = rng.uniform(-1, 1, (n + 1, 4)) * (np.pi / 2, 0.5, 0.5, 1.0) * (rng.random((n + 1, 4)) > 0.2)
    table = DHTable.from_rows(rows, rng.uniform(-3, 3), "".join(rng.choice(["R", "R", "R", "P"], n)))
    slides, limits = table.d[:-1] + rng.uniform(-0.1, 0.1, n), np.tile([-0.1, 0.2], (n, 1))
    arm = arm_body(table, BODY, slides, limits, placed=bool(rng.integers(2)))
    return arm, np.cumsum(rng.normal(size=(8, n)) * np.where(table.prismatic, 0.02, 0.3), axis=0)


def random_obstacles(rng, count=3):
    shapes = [coal.Box(0.2, 0.3, 0.1), coal.Sphere(0.1), coal.Cylinder(0.05, 0.4), coal.Halfspace(np.eye(3)[2], -0.8)]
    poses = [pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3) * 0.4).homogeneous for _ in shapes]
    return [ExactObstacle(f"obstacle {k}", shapes[k], poses[k]) for k in rng.permutation(len(shapes))[:count]]


def finer(q, parts=10):
    """A motion with frames in between, shape ((T - 1) parts + 1, n)."""
    x = np.linspace(0, len(q) - 1, (len(q) - 1) * parts + 1)
    return np.stack([np.interp(x, np.arange(len(q)), column) for column in q.T], axis=1)


def transform(pose):
    return coal.Transform3s(pose[:3, :3], pose[:3, 3])


def least_by_hand(arm, q, obstacles, base):
    """The least self and obstacle clearance at given poses, pair by pair, without bounds of any kind."""
    request = coal.DistanceRequest()
    shapes = [coal.Cylinder(part.solid.radius, part.solid.length) for part in arm.shapes]
    own, against = np.inf, np.inf
    for angles in q:
        frames = [np.eye(4), *arm.table.frames(angles)]
        places = [transform(frames[part.link] @ part.solid.pose) for part in arm.shapes]
        for i, j in arm.pairs.tolist():
            found = coal.distance(shapes[i], places[i], shapes[j], places[j], request, coal.DistanceResult())
            own = min(own, found)
        for each in obstacles:
            room = transform(np.linalg.inv(base) @ each.poses)
            stands = abs(coal.distance(coal.Sphere(1e-9), transform(np.eye(4)), each.geometry, room, request,
                                       coal.DistanceResult())) < 2e-3  # fmt: skip
            for k, part in enumerate(arm.parts):
                if part.link or not stands:
                    found = coal.distance(shapes[k], places[k], each.geometry, room, request, coal.DistanceResult())
                    against = min(against, found)
    return own, against


def check_design(seed):
    rng = np.random.default_rng([13, seed])
    arm, q = random_arm(rng)
    base = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3) * 0.3).homogeneous
    obstacles = random_obstacles(rng)
    scene = ExactScene(arm, obstacles, base)
    found = scene.self_clearance(q), scene.obstacle_clearance(q)
    for clearance, least in zip(found, least_by_hand(arm, finer(q), obstacles, base), strict=True):
        if clearance is None:
            assert least == np.inf
            continue
        assert clearance.value <= least + 1e-6
        assert clearance.value >= least - 0.05  # steps of tens of degrees: between ten sub-frames it may be lower
        at_frames = clearance.each.min()
        assert clearance.value <= at_frames + 1e-12
        assert len(clearance.each) == len(q)


@pytest.mark.parametrize("seed", range(10))
def test_no_sub_frame_is_nearer_than_reported(seed):
    check_design(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10, 200))
def test_no_sub_frame_of_200_designs_is_nearer_than_reported(seed):
    check_design(seed)


@pytest.mark.parametrize("seed", range(5))
def test_the_reported_clearance_is_that_of_a_fine_motion(seed):
    rng = np.random.default_rng(seed)
    arm, q = random_arm(rng)
    scene = ExactScene(arm, random_obstacles(rng))
    for clearance in (scene.self_clearance, scene.obstacle_clearance):
        coarse, fine = clearance(q), clearance(finer(q, 100))
        if coarse is not None:
            assert coarse.value == pytest.approx(fine.value, abs=1.01 * TOLERANCE)
            assert coarse.value == pytest.approx(fine.each.min(), abs=2e-4)


@pytest.mark.parametrize("turn", np.linspace(-3, 3, 7))
def test_a_beam_over_the_floor_and_before_a_wall(turn):
    """The beam's axis is 0.3 m high; its joint module's lower face 0.03 m below that; the wall is 1 m away."""
    floor = ExactObstacle("floor", coal.Halfspace(np.eye(3)[2], 0.0), np.eye(4))
    wall = ExactObstacle("wall", coal.Halfspace(-np.eye(3)[0], -1.0), np.eye(4))
    arm, q = arm_body(BEAM, BODY, placed=True), np.array([[turn, 0.0]])
    found = ExactScene(arm, [floor]).obstacle_clearance(q)
    assert found.value == pytest.approx(0.27, abs=1e-9)
    assert found.bodies[1] == "floor"
    found = ExactScene(arm, [wall]).obstacle_clearance(q)
    ends = 0.6 * np.cos(turn) + 0.03, 0.05  # the module at the end of the beam, or the plate
    assert found.value == pytest.approx(1.0 - max(ends), abs=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_rods_that_cross_are_as_far_apart_as_their_axes_less_both_radii(seed):
    rng = np.random.default_rng(seed)
    arm, turn, away = arm_body(BEAM, BODY, placed=True), rng.uniform(-3, 3), rng.uniform(0.06, 0.3)
    slant = rng.uniform(-1, 1)  # about the vertical through the middle of the beam, and above it
    pose = pin.SE3(pin.rpy.rpyToMatrix(0, 0, turn), np.zeros(3)) * pin.SE3(
        pin.rpy.rpyToMatrix(0, np.pi / 2, 0), np.array([0.3, 0.0, 0.3 + away])
    )
    pose = pose * pin.SE3(pin.rpy.rpyToMatrix(slant, 0, 0), np.zeros(3))
    rod = ExactObstacle("rod", coal.Cylinder(0.01, 0.2), pose.homogeneous)
    found = ExactScene(arm, [rod]).obstacle_clearance(np.array([[turn, 0.0]]))
    assert found.value == pytest.approx(away - 0.03, abs=1e-9)
    assert found.bodies == ("tube of link_1", "rod")


def test_a_base_may_stand_on_what_carries_it_and_on_nothing_else():
    arm, q = arm_body(BEAM, BODY, placed=True), np.zeros((3, 2))
    table = ExactObstacle("table", coal.Box(0.4, 0.4, 0.1), pin.SE3(np.eye(3), np.array([0.0, 0, -0.05])).homogeneous)
    assert ExactScene(arm, [table]).obstacle_clearance(q).value == pytest.approx(0.27, abs=1e-6)
    sunk = table._replace(poses=pin.SE3(np.eye(3), np.array([0.0, 0, -0.04])).homogeneous)
    assert ExactScene(arm, [sunk]).obstacle_clearance(q).value == pytest.approx(-0.01, abs=1e-6)


def test_a_thin_post_between_two_frames_is_not_jumped_over():
    post = ExactObstacle("post", coal.Cylinder(0.005, 2.0), pin.SE3(np.eye(3), np.array([0.5, 0, 0])).homogeneous)
    arm = arm_body(BEAM, BODY, placed=True)
    q = np.array([[-0.6, 0.0], [0.9, 0.0]])
    found = ExactScene(arm, [post]).obstacle_clearance(q)
    assert found.each.min() > 0.2
    assert found.value == pytest.approx(-0.025, abs=2e-4)  # radius of the tube and of the post
    assert found.bodies == ("tube of link_1", "post")


def test_a_moving_post_is_met_as_one_that_stands_still_is_by_a_moving_arm():
    arm = arm_body(BEAM, BODY, placed=True)
    angles = np.linspace(-0.6, 0.9, 7)
    at = np.array([0.5, 0, 0, 1.0])
    turns = [pin.SE3(pin.rpy.rpyToMatrix(0, 0, -angle), np.zeros(3)).homogeneous for angle in angles]
    moving = np.stack([np.hstack([turn[:, :3], (turn @ at)[:, None]]) for turn in turns])
    still = ExactObstacle("post", coal.Cylinder(0.005, 2.0), pin.SE3(np.eye(3), at[:3]).homogeneous)
    one = ExactScene(arm, [still]).obstacle_clearance(np.stack([angles, 0 * angles], axis=1))
    other = ExactScene(arm, [still._replace(poses=moving)]).obstacle_clearance(np.zeros((7, 2)))
    np.testing.assert_allclose(one.each, other.each, atol=1e-9)
    assert one.value == pytest.approx(other.value, abs=2 * TOLERANCE)
    with pytest.raises(DesignError, match="post"):
        ExactScene(arm, [still._replace(poses=moving[:5])]).obstacle_clearance(np.zeros((7, 2)))


def test_turning_the_room_with_everything_in_it_changes_nothing():
    rng = np.random.default_rng(3)
    arm, q = random_arm(rng)
    obstacles, base = random_obstacles(rng), np.eye(4)
    turn = pin.SE3(pin.exp3(rng.normal(size=3)), rng.normal(size=3)).homogeneous
    moved = [each._replace(poses=turn @ each.poses) for each in obstacles]
    one = ExactScene(arm, obstacles, base).obstacle_clearance(q)
    other = ExactScene(arm, moved, turn @ base).obstacle_clearance(q)
    assert one.value == pytest.approx(other.value, abs=2 * TOLERANCE)
    np.testing.assert_allclose(one.each, other.each, atol=1e-6)


def test_an_obstacle_far_away_does_not_matter_and_without_one_there_is_nothing_to_say():
    rng = np.random.default_rng(4)
    arm, q = random_arm(rng)
    far = ExactObstacle("moon", coal.Sphere(1.0), pin.SE3(np.eye(3), np.array([400.0, 0, 0])).homogeneous)
    near = random_obstacles(rng)
    assert (
        ExactScene(arm, near).obstacle_clearance(q).value == ExactScene(arm, [*near, far]).obstacle_clearance(q).value
    )
    assert ExactScene(arm).obstacle_clearance(q) is None


def test_modules_inside_one_another_are_reported():
    """Two joints 18 mm apart with no offset: housings of 60 mm on parallel axes."""
    arm = arm_body(DHTable.from_rows([(0, 0, 0.3), (0, 0.018, 0), (0, 0.4, 0), (0, 0, 0.1)]), BODY, placed=True)
    found = ExactScene(arm).self_clearance(np.zeros((4, 3)))
    assert found.value == pytest.approx(0.018 - 0.06, abs=1e-6)
    assert found.bodies == ("module of joint_1", "module of joint_2")


def test_modules_that_slide_apart_are_clear():
    table = DHTable.from_rows([(0, 0, 0.3), (0, 0.018, 0), (0, 0.4, 0), (0, 0, 0.1)])
    arm = arm_body(table, BODY, [0.3, 0.07, 0.0], placed=True)
    found = ExactScene(arm).self_clearance(np.zeros((4, 3)))
    assert found.value == pytest.approx(0.01, abs=1e-6)


def test_an_arm_of_one_joint_has_no_pair():
    arm = arm_body(DHTable.from_rows([(0, 0, 0), (0, 0, 0.1)]), BODY, side=None)
    assert ExactScene(arm).self_clearance(np.zeros((2, 1))) is None


@pytest.mark.parametrize("shape", [(4, 3), (0, 2), (2,)])
def test_motions_that_do_not_fit_are_refused(shape):
    with pytest.raises(DesignError, match="motion"):
        ExactScene(arm_body(BEAM, BODY)).self_clearance(np.zeros(shape))


def box_mesh(half):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    faces = [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1),
             (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4), (1, 5, 7), (1, 7, 3)]  # fmt: skip
    vertices, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    vertices.extend(list(corners))
    triangles.extend([coal.Triangle(*face) for face in faces])
    mesh = coal.BVHModelOBBRSS()
    mesh.beginModel(len(faces), len(corners))
    mesh.addSubModel(vertices, triangles)
    mesh.endModel()
    return mesh


def test_a_mesh_is_what_it_is_as_a_box():
    arm, q = arm_body(BEAM, BODY, placed=True), np.array([[-1.0, 0.0], [0.0, 0.0], [0.2, 0.0]])
    pose = pin.SE3(np.eye(3), np.array([0.5, 0.4, 0.3])).homogeneous
    mesh = ExactObstacle("mesh", box_mesh(np.array([0.1, 0.2, 0.3])), pose)
    box = ExactObstacle("box", coal.Box(0.2, 0.4, 0.6), pose)
    one, other = (ExactScene(arm, [each]).obstacle_clearance(q) for each in (mesh, box))
    np.testing.assert_allclose(one.each, other.each, atol=1e-6)
    assert one.value == pytest.approx(other.value, abs=2 * TOLERANCE)


def test_an_arm_inside_a_mesh_is_not_clear_of_it():
    arm = arm_body(BEAM, BODY, placed=True)
    room = ExactObstacle("room", box_mesh(np.array([2.0, 2.0, 2.0])), np.eye(4))
    assert ExactScene(arm, [room]).obstacle_clearance(np.zeros((2, 2))).value < -1.0


def test_points_inside_a_mesh():
    mesh, rng = box_mesh(np.array([0.1, 0.2, 0.3])), np.random.default_rng(0)
    for point in rng.uniform(-0.4, 0.4, (100, 3)):
        assert inside_mesh(mesh, point) == bool((np.abs(point) < [0.1, 0.2, 0.3]).all())


@pytest.mark.parametrize("seed", range(5))
def test_no_point_moves_further_than_its_bound(seed):
    rng = np.random.default_rng(seed)
    arm, q = random_arm(rng)
    n, links = arm.table.dof, np.array([part.link for part in arm.parts])
    ends = np.stack([part.solid.ends for part in arm.parts])
    turning = ~np.array(arm.table.prismatic)
    poses = np.stack([[np.eye(4), *arm.table.frames(angles)] for angles in q])
    steps = np.abs(np.diff(q, axis=0))
    radii = joint_radii(poses, ends, links, steps, turning)
    bounds = displacements(radii, np.zeros(len(links)), links, steps, turning)
    fine = np.stack([[np.eye(4), *arm.table.frames(angles)] for angles in finer(q, 20)])
    for s, link in enumerate(links):
        for m in range(n + 1):
            seen = np.linalg.solve(fine[:, m], fine[:, link])
            points = seen[:, None, :3, :3] @ ends[s][None, :, :, None] + seen[:, None, :3, 3:]
            for t in range(len(q) - 1):
                way = points[20 * t : 20 * t + 21]
                assert np.linalg.norm(way - way[:1], axis=2).max() <= bounds[s, m, t] + 1e-12


def test_segments_are_as_far_apart_as_their_nearest_points():
    rng = np.random.default_rng(0)
    first, second = rng.normal(size=(2, 200, 2, 3))
    second[:40, 1] = second[:40, 0] + first[:40, 1] - first[:40, 0]  # parallel
    second[40:60, 1] = second[40:60, 0]  # a point
    found = segment_distance(first, second)
    request = coal.DistanceRequest()
    request.gjk_tolerance = 1e-12
    for one, other, distance in zip(first, second, found, strict=True):
        capsules = []
        for ends in (one, other):
            length, middle = np.linalg.norm(ends[1] - ends[0]), ends.mean(axis=0)
            turn = pin.Quaternion.FromTwoVectors(np.eye(3)[2], ends[1] - ends[0]).matrix() if length else np.eye(3)
            capsules += [coal.Capsule(1e-12, length), coal.Transform3s(turn, middle)]
        expected = coal.distance(*capsules, request, coal.DistanceResult())
        assert distance == pytest.approx(expected, abs=1e-9)
