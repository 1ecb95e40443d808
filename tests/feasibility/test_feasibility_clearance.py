"""Clearance along paths: against brute force, between frames, and its gradient against differences."""

from __future__ import annotations

import numpy as np
import pytest
from obstacle_scenes import at, columns, obstacle_arrays, random_arms
from scipy.spatial.transform import Rotation

from armdesign.bodies.capsules import capsule_sizes
from armdesign.bodies.kernels.capsules import BODY, WITNESS, build_body, place_capsule, segment_segment
from armdesign.cell.kernels.distance import WITNESS as OBSTACLE_WITNESS
from armdesign.cell.kernels.distance import obstacle_pose, segment_obstacle
from armdesign.cell.obstacles import Obstacles
from armdesign.feasibility.clearance import MARGIN, ClearanceCheck
from armdesign.feasibility.kernels.check_arms import check_arms, settle_slides
from armdesign.kinematics.compilation import entry
from armdesign.kinematics.dh import DHTable
from armdesign.settings import Body

CLEARANCE = 5e-3


@entry
def smallest_gaps(bodies, sizes, obstacles, rows, slides, poses, share, gaps, ends, witness, other):
    """Smallest clearance over all pairs, frame by frame of poses (T, n + 1, 12)."""
    body, pose = bodies[0], np.empty(12)
    build_body(body, sizes[0], rows, slides)
    for t in range(len(poses)):
        gaps[t] = np.inf
        for k in range(body.capsules):
            place_capsule(ends[k], body, poses[t], k)
        for p in range(body.pairs):
            i, j = body.first[p], body.second[p]
            away = segment_segment(ends[i, :3], ends[i, 3:], ends[j, :3], ends[j, 3:], witness[0])
            gaps[t] = min(gaps[t], away - body.radius[i] - body.radius[j])
        for k in range(len(obstacles.kind)):
            obstacle_pose(obstacles, k, t, share, pose)
            for i in range(body.parts):
                away = segment_obstacle(obstacles, k, pose, ends[i, :3], ends[i, 3:], other[0])
                gaps[t] = min(gaps[t], away - body.radius[i])


def brute_force(sizes, obstacles, arm, slides, share=0.0):
    """Smallest clearance of one arm (rows, base, path) in every frame, or part of the way to the next one, (T,)."""
    rows, base, path = arm
    table, place = DHTable.from_rows(rows[:, :3]), np.eye(4)
    place[:3, :3], place[:3, 3] = base[:9].reshape(3, 3).T, base[9:]
    joints = path if share == 0.0 else path[:-1] + share * np.diff(path, axis=0)
    frames = [np.concatenate([place[None], place @ table.frames(q)[:-1]]) for q in joints]
    poses = np.array([[np.r_[f[:3, :3].T.ravel(), f[:3, 3]] for f in frame] for frame in frames])
    gaps = np.empty(len(poses))
    smallest_gaps(
        np.zeros(1, BODY), sizes, obstacles, rows, slides.copy(), poses, share, gaps, np.empty((176, 6)),
        np.zeros(1, WITNESS), np.zeros(1, OBSTACLE_WITNESS),
    )  # fmt: skip
    return gaps


def scene(frames):
    """A table, a post, a ball, a wall and a part that is carried past and turned."""
    t = np.linspace(0.0, 1.0, frames)
    carried = np.tile(np.eye(4), (frames, 1, 1))
    carried[:, :3, :3] = Rotation.from_rotvec(np.outer(t, [0.3, 1.0, -0.5])).as_matrix()
    carried[:, :3, 3] = np.stack([0.5 - 0.6 * t, 0.4 + 0.2 * t, 0.3 - 0.2 * t], axis=1)
    return obstacle_arrays(
        ("box", (0.3, 0.2, 0.02), at(0.5, -0.4, -0.3, (0.0, 0.0, 0.4))),
        ("cylinder", (0.01, 0.4, 0.0), at(-0.5, 0.3, 0.2)),
        ("sphere", (0.1, 0.0, 0.0), at(0.1, 0.6, 0.5)),
        ("plane", (0.0, 0.0, 0.0), at(0.0, 0.0, -0.8)),
        ("box", (0.05, 0.1, 0.03), carried),
    )


def make_check(n, around, frames, prismatic=(), clearance=CLEARANCE):
    """The check of n joints among obstacles on one demonstration; joints that slide go from -0.2 to 0.3 m."""
    limits = np.tile([-4.0, 4.0], (n, 1))
    limits[[bool(kind) for kind in prismatic] or slice(0)] = (-0.2, 0.3)
    sizes = capsule_sizes(Body(), limits, prismatic, placed=True)
    return ClearanceCheck(sizes, n, clearance, [around], [frames])


@pytest.mark.parametrize("n", [2, 5])
def test_violation_is_that_of_all_pairs_in_all_frames_wherever_frames_tell(n):
    rng = np.random.default_rng(n)
    rows, bases, paths = random_arms(rng, 25, n, 60)
    check = make_check(n, scene(60), 60)
    slides = rows[:, :n, 2].copy()
    violation, _, _ = check.at_slides(rows, bases, slides, [paths])
    bad = 0
    for k in range(25):
        gaps = brute_force(check.sizes, scene(60), (rows[k], bases[k], paths[k]), slides[k])
        short = np.maximum(CLEARANCE + MARGIN - gaps, 0.0)
        expected = short.max() + short.mean()
        assert violation[k] >= expected - 1e-12
        if short.max() > 0.02:  # else what lies between frames may be more
            bad += 1
            assert violation[k] == pytest.approx(expected, abs=0.02)
    assert bad > 2


def test_clear_paths_are_clear_between_the_frames_too():
    rng = np.random.default_rng(8)
    n, T = 4, 12  # few frames, so that a lot happens between them
    rows, bases, paths = random_arms(rng, 50, n, T, sweep=0.6)
    check = make_check(n, scene(T), T)
    found = check(rows, bases, [paths])
    clear = np.flatnonzero(found.violation == 0.0)
    assert 5 < len(clear) < 45
    for k in clear:
        arm = rows[k], bases[k], paths[k]
        for share in np.linspace(0.0, 0.9, 7):
            assert brute_force(check.sizes, scene(T), arm, found.slides[k], float(share)).min() >= CLEARANCE - 1e-9


def test_a_search_calls_the_kernels_as_they_are_compiled_ahead():
    """Arrays in another order or that cannot be written to would have them compiled anew, in every worker."""
    rows, bases, paths = random_arms(np.random.default_rng(8), 20, 4, 12)
    check = make_check(4, scene(12), 12)
    check.compile()
    before = [list(kernel.signatures) for kernel in (check_arms, settle_slides)]
    assert (check(rows, bases, [paths]).violation > 0.0).any()
    assert [list(kernel.signatures) for kernel in (check_arms, settle_slides)] == before


def planar_pair(frames, swing):
    """A two-joint planar arm, 0.3 m and 0.3 m, its first joint turning by ``swing``, stretched out."""
    rows = np.zeros((1, 3, 4))
    rows[0, 0, 2], rows[0, 1, 1], rows[0, 2, 1] = 0.2, 0.3, 0.3
    path = np.zeros((1, frames, 2))
    path[0, :, 0] = np.linspace(-swing / 2.0, swing / 2.0, frames)
    return rows, columns((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))[None], path


def test_thin_post_between_two_frames_is_found():
    rows, bases, path = planar_pair(2, 0.9)
    post = obstacle_arrays(("cylinder", (0.002, 0.5, 0.0), at(0.55, 0.0, 0.3)))
    check = make_check(2, post, 2)
    gaps = brute_force(check.sizes, post, (rows[0], bases[0], path[0]), rows[0, :2, 2])
    assert gaps.min() > 0.02  # both frames are far from it
    assert check(rows, bases, [path]).violation[0] > 0.02
    beside = obstacle_arrays(("cylinder", (0.002, 0.5, 0.0), at(0.63, 0.0, 0.3)))  # tube's cap ends at 0.62, gap 8 mm
    assert make_check(2, beside, 2)(rows, bases, [path]).violation[0] == 0.0


def test_planar_arm_and_a_wall_in_closed_form():
    rows, bases, path = planar_pair(41, 1.2)
    for depth in (0.001, 0.02, 0.05):
        # the wall's face at x = w; the tool end is at x = 0.6 cos(q_1), its tube has 20 mm radius
        w = 0.6 + 0.02 + CLEARANCE + MARGIN - depth
        wall = obstacle_arrays(("plane", (0.0, 0.0, 0.0), at(w, 0.0, 0.0, (0.0, -np.pi / 2.0, 0.0))))
        short = np.maximum(0.6 * np.cos(path[0, :, 0]) + 0.02 + CLEARANCE + MARGIN - w, 0.0)
        violation = make_check(2, wall, 41)(rows, bases, [path]).violation[0]
        assert violation == pytest.approx(short.max() + short.mean(), abs=1e-12)


def test_modules_that_touch_slide_apart():
    rows = np.zeros((1, 4, 4))
    rows[0, 0, 2], rows[0, 1, 1], rows[0, 2, 1], rows[0, 2, 0] = 0.2, 0.02, 0.3, 0.5
    rows[0, 3, 1] = 0.2
    path = np.zeros((1, 20, 3))
    path[0, :, 0] = np.linspace(0.0, 0.5, 20)
    check = make_check(3, Obstacles().arrays(), 20)
    default, _, _ = check.at_slides(rows, columns((0, 0, 0), (0, 0, 0))[None], rows[:, :3, 2].copy(), [path])
    assert default[0] > 0.04  # housings one in the other
    found = check(rows, columns((0, 0, 0), (0, 0, 0))[None], [path])
    assert found.violation[0] == 0.0
    assert abs((found.slides[0, 1]) - (found.slides[0, 0] - 0.2)) > 0.06  # apart by more than a housing


def test_candidates_do_not_depend_on_each_other_and_far_obstacles_change_no_bit():
    rng = np.random.default_rng(9)
    n, T = 3, 30
    rows, bases, paths = random_arms(rng, 20, n, T)
    turns = rng.normal(size=(20, T, n, 3 * n + 7))
    around = obstacle_arrays(("sphere", (0.1, 0.0, 0.0), at(0.1, 0.4, 0.3)))
    check = make_check(n, around, T)
    together = check(rows, bases, [paths], [turns])
    alone = [check(rows[k : k + 1], bases[k : k + 1], [paths[k : k + 1]], [turns[k : k + 1]]) for k in range(20)]
    far = obstacle_arrays(("sphere", (0.1, 0.0, 0.0), at(0.1, 0.4, 0.3)), ("box", (1.0, 1.0, 1.0), at(40.0, 0.0, 0.0)))
    with_far = make_check(n, far, T)(rows, bases, [paths], [turns])
    for name in ("violation", "slides", "slopes"):
        whole = getattr(together, name)
        assert np.array_equal(whole, np.concatenate([getattr(one, name) for one in alone]))
        assert np.array_equal(whole, getattr(with_far, name))


def test_turned_and_moved_room_gives_the_same():
    rng = np.random.default_rng(10)
    n, T = 4, 30
    rows, bases, paths = random_arms(rng, 20, n, T)
    room = at(0.7, -0.4, 0.2, (0.4, -0.9, 1.3))[0]
    around = [("box", (0.2, 0.1, 0.05), at(0.3, -0.3, 0.1)), ("cylinder", (0.03, 0.3, 0.0), at(-0.3, 0.2, 0.1))]
    moved = [(kind, size, room @ poses) for kind, size, poses in around]
    turned = bases.copy()
    for c in range(0, 9, 3):
        turned[:, c : c + 3] = bases[:, c : c + 3] @ room[:3, :3].T
    turned[:, 9:] = bases[:, 9:] @ room[:3, :3].T + room[:3, 3]
    first = make_check(n, obstacle_arrays(*around), T)(rows, bases, [paths])
    second = make_check(n, obstacle_arrays(*moved), T)(rows, turned, [paths])
    assert np.allclose(first.violation, second.violation, atol=1e-9)
    assert np.allclose(first.slides, second.slides, atol=1e-9)


@pytest.mark.parametrize("prismatic", [(), (False, True, False, True)])
def test_gradient_against_differences(prismatic):
    rng = np.random.default_rng(11)
    n, T, h = 4, 9, 1e-6
    rows, bases, paths = random_arms(rng, 60, n, T)
    paths[..., np.flatnonzero(prismatic)] *= 0.07
    turns = rng.normal(size=(60, T, n, 3 * n + 7))
    check = make_check(n, scene(T), T, prismatic)
    slides = rows[:, :n, 2] + rng.choice([0.0, 0.03, -0.04], (60, n))
    E = 3 * n + 7
    violation, _, slopes = check.at_slides(rows, bases, slides, [paths], [turns], E)

    def moved(e, step):
        there, places, joints = rows.copy(), bases.copy(), paths + step * turns[..., e]
        if e < 3 * n + 3:
            there[:, e // 3, e % 3] += step
        elif e == 3 * n + 3:
            turn = Rotation.from_rotvec([0.0, 0.0, step]).as_matrix()
            for c in range(0, 9, 3):
                places[:, c : c + 3] = bases[:, c : c + 3] @ turn.T
        else:
            places[:, 9 + e - 3 * n - 4] += step
        return check.at_slides(there, places, slides, [joints])[0]

    agreeing = np.zeros(60, dtype=int)
    for e in range(E):
        ahead, behind = (moved(e, step) - violation for step in (h, -h))
        smooth = np.abs(ahead + behind) < 1e-9  # no kink here
        difference = (ahead - behind) / (2.0 * h)
        assert np.allclose(difference[smooth], slopes[smooth, e], atol=2e-5, rtol=1e-5)
        agreeing += smooth
    assert (violation > 0.0).sum() > 30
    assert (agreeing[violation > 0.0] > E - 3).mean() > 0.7


def test_arms_with_joints_that_slide_are_clear_between_the_frames_too():
    rng = np.random.default_rng(12)
    n, T, prismatic = 4, 10, (False, True, False, True)
    rows, bases, paths = random_arms(rng, 60, n, T, sweep=0.6)
    paths[..., 1::2] *= 0.07
    still = scene(T)
    still = still._replace(frames=np.minimum(still.frames, 1))
    found = make_check(n, still, T, prismatic)(rows, bases, [paths])
    clear = found.violation == 0.0
    assert 3 < clear.sum() < 57
    fine = np.linspace(0.0, T - 1.0, 12 * (T - 1) + 1)
    whole = np.minimum(fine.astype(int), T - 2)
    between = paths[:, whole] + (fine - whole)[:, None] * (paths[:, whole + 1] - paths[:, whole])
    finer = make_check(n, still, len(fine), prismatic, clearance=CLEARANCE - MARGIN - 1e-9)
    assert not finer.at_slides(rows[clear], bases[clear], found.slides[clear], [between[clear]])[0].any()


def test_a_rail_of_a_sliding_joint_reaches_as_far_as_it_slides():
    # a joint that slides along x from -0.2 to 0.3 m, and a wall ahead of it
    rows = np.zeros((1, 2, 4))
    rows[0, 0, 2], rows[0, 0, 0] = 0.0, np.pi / 2.0
    base = columns((0.0, 0.0, np.pi / 2.0), (0.0, 0.0, 1.0))[None]  # z of the joint along the room's x
    for gap in (0.03, 0.0):
        wall = obstacle_arrays(
            ("plane", (0.0, 0.0, 0.0), at(0.3 + 0.02 + CLEARANCE + gap, 0.0, 0.0, (0, -np.pi / 2, 0)))
        )
        violation = make_check(1, wall, 5, (True,))(rows, base, [np.zeros((1, 5, 1))]).violation[0]
        assert violation == pytest.approx(2.0 * max(MARGIN - gap, 0.0), abs=1e-12)
