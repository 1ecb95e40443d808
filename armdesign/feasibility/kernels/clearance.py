"""Clearance of an arm's capsules along a joint path, frame by frame and between the frames, and its violation.

Between two frames the joints move evenly. With c_0 and c_1 the clearances of a pair of bodies at both ends of an
interval, and mu a bound on how far the two move against each other in it, (c_0 + c_1 - mu) / 2 bounds the clearance
from below. Where that is enough, everything between is skipped, be it many frames or a part of one; else the interval
is cut into two. So what lies far apart is looked at a few times along the path, and nothing is jumped over.

mu is the smaller of two bounds: the ways of both bodies in the room, added up, and the turns of the joints between
them times the longest levers these can have. The way of a body from frame to frame is at most that of its ends,
straight, plus half of a bound A on its acceleration over the frame: from the outermost joint inwards, with turns w and
levers r,

    V_j = w_j r_j + V_{j+1},    A_j = w_j (w_j r_j + 2 V_{j+1}) + A_{j+1}.

The shortfall S_t is the largest amount over all pairs by which a clearance in frame t is below what is required. The
violation is V = max S + mean_t S_t, the maximum over the frames and what was met between two frames that both are
clear.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armdesign.bodies.kernels.capsules import BODY, nearest, place_capsule
from armdesign.cell.kernels.distance import WITNESS, ObstacleArrays, obstacle_pose, segment_obstacle
from armdesign.fitness.kernels.variations import place_joints
from armdesign.kinematics.compilation import branch, leaf
from armdesign.kinematics.kernels.skeleton import CHAIN, MAX_DOF, MAX_ROWS, ORIGIN, Z, load_arm

DEPTH = 14
"""An interval between two frames is halved so often at most."""
ON_SURFACE = 2e-3
"""A base so near to an obstacle's surface stands on it [m]."""

CHECK = np.dtype(
    [
        ("required", np.float64),  # what has to be between two bodies in the frames [m]
        ("margin", np.float64),  # how much less is good enough between frames [m]
        ("between", np.int64),  # 1: between the frames, too
        ("enough", np.float64),  # shortfall with which a path need not be looked at any further [m]
        ("largest", np.float64),  # largest shortfall [m]; 0: none
        # where it is: frame, part of the way to the next one, and the pair
        ("frame", np.int64),
        ("share", np.float64),
        ("first", np.int64),  # capsule
        ("second", np.int64),  # capsule, or -1 - number of an obstacle
        # intervals that wait to be looked at: their right ends in parts of a frame, and the clearance there
        ("place", np.int64, DEPTH + 2),
        ("gap", np.float64, DEPTH + 2),
        ("witness", WITNESS),
    ]
)
"""What is required, and what is missing most."""


class Room(NamedTuple):
    """What a path is checked against; the same for all candidates.

    Attributes:
        sizes: One SIZES record, shape (1,).
        obstacles: ObstacleArrays of armdesign.cell in the task frame.
        carried: Ways of the obstacles up to each frame, shape (K, T, 2): of the origin [m], and turned [rad].
    """

    sizes: np.ndarray
    obstacles: ObstacleArrays
    carried: np.ndarray


FRAME = np.dtype(
    [
        ("turned", np.float64, MAX_DOF),  # sum of |dq| up to here [rad; m]
        ("shortfall", np.float64),  # S_t [m]
        ("first", np.int64),  # the pair in it, as in CHECK
        ("second", np.int64),
    ]
)
"""One frame of a path."""

FLAGS = np.dtype(
    [
        ("stands", np.int64),  # 1: the base stands on it
        ("met", np.int64),  # 1: the arm has come too near to it; else it is left out in choosing the slides
    ]
)
"""An obstacle as a candidate meets it."""

WORK = np.dtype(
    [
        ("dof", np.int64),
        ("rows", np.float64, (MAX_ROWS, 4)),
        ("slides", np.float64, MAX_DOF),  # s_j [m]
        ("placements", np.float64, (MAX_DOF, 12)),  # of the joints, the base in the first
        ("poses", np.float64, (MAX_ROWS, 12)),  # of the frame before row 0, then of the joints, in one frame
        ("between", np.float64, (3, 12)),  # ends of two capsules there, then the pose of an obstacle
        ("q", np.float64, MAX_DOF),  # joint angles there, or turns from one frame to the next
        ("chain", CHAIN),
        ("body", BODY),
        ("check", CHECK),
    ]
)
"""A candidate with everything that does not grow with the path."""


class Traced(NamedTuple):
    """A candidate, where its capsules are along its path, and the scratch to find it.

    Attributes:
        work: One WORK record, shape (1,).
        path: Its joint path, shape (T, n) [rad; m].
        ends: Ends of the capsules, shape (capsules, T, 6) [m].
        way: Bound on the way that each capsule has gone up to every frame, shape (capsules, T) [m].
        frames: FRAME records, shape (T,).
        flags: FLAGS records, shape (K,).
    """

    work: np.ndarray
    path: np.ndarray
    ends: np.ndarray
    way: np.ndarray
    frames: np.ndarray
    flags: np.ndarray


@branch
def load_candidate(traced, rows, base):
    """Take in a candidate's design, shapes (n + 1, 4) and (12,); the base comes before the first joint."""
    work = traced.work[0]
    work.dof = rows.shape[0] - 1
    for i in range(rows.shape[0]):
        for j in range(4):
            work.rows[i, j] = rows[i, j]
    load_arm(work.chain, work.placements, rows, 0.0)
    local = work.placements[0]
    for c in range(0, 12, 3):
        x, y, z = local[c], local[c + 1], local[c + 2]
        for r in range(3):
            local[c + r] = base[r] * x + base[3 + r] * y + base[6 + r] * z + (base[9 + r] if c == ORIGIN else 0.0)
    for i in range(12):
        work.poses[0, i] = base[i]


@branch
def trace_path(traced, room):
    """Place the capsules in every frame, and bound their ways between them."""
    work = traced.work[0]
    body, sizes, path, frames, n = work.body, room.sizes[0], traced.path, len(traced.path), work.dof
    for f in range(frames):
        place_joints(work.poses[1:], work.placements, path[f], work.chain)
        for k in range(body.capsules):
            place_capsule(traced.ends[k, f], body, work.poses, k)
        for j in range(n):
            work.q[j] = abs(path[f, j] - path[f - 1, j]) if f > 0 else 0.0
            traced.frames[f].turned[j] = work.q[j] + (traced.frames[f - 1].turned[j] if f > 0 else 0.0)
        for k in range(body.parts):
            traced.way[k, f] = 0.0 if f == 0 else traced.way[k, f - 1] + way_to(traced, body, sizes, k, f)
    for k in range(body.parts, body.capsules):
        for f in range(frames):
            traced.way[k, f] = traced.way[body.part[k], f]


@leaf
def way_to(traced, body, sizes, k, f):
    """Bound on how far a capsule goes from the frame before to frame f, at its turns ``traced.work[0].q`` [m]."""
    work = traced.work[0]
    straight = 0.0
    for e in range(0, 6, 3):
        x = traced.ends[k, f, e] - traced.ends[k, f - 1, e]
        y = traced.ends[k, f, e + 1] - traced.ends[k, f - 1, e + 1]
        z = traced.ends[k, f, e + 2] - traced.ends[k, f - 1, e + 2]
        straight = max(straight, x * x + y * y + z * z)
    V, A = 0.0, 0.0
    for j in range(body.link[k] - 1, -1, -1):
        step = work.q[j] * body.lever[k, j]
        if sizes.prismatic[j] == 0:
            A += work.q[j] * (step + 2.0 * V)
        V += step
    return min(np.sqrt(straight) + A / 2.0, V)


@branch
def check_path(traced, room):
    """Find where bodies come too near to each other or to obstacles, on a path that is traced.

    What is missing is written to ``check`` and ``traced.frames``. In choosing the slides,
    which looks at frames only, obstacles that have not been met before are left out.

    Returns:
        V [m]; infinite where ``check.enough`` is missing.
    """
    work = traced.work[0]
    check, body, frames = work.check, work.body, len(traced.path)
    check.largest, check.frame, check.share, check.first, check.second = 0.0, 0, 0.0, -1, -1
    for f in range(frames):
        traced.frames[f].shortfall = 0.0
    for k in range(len(traced.flags)):
        obstacles, base, stands = room.obstacles, work.poses[0, ORIGIN:], False
        if obstacles.frames[k] == 1:
            away = segment_obstacle(obstacles, k, obstacles.poses[obstacles.first[k]], base, base, check.witness)
            for r in range(3):  # above the base it is farther away, unless that stands on the floor beneath it
                work.between[0, r] = base[r] + 2.0 * ON_SURFACE * work.poses[0, Z + r]
            above, point = 0.0, work.between[0, :3]
            if abs(away) <= ON_SURFACE:
                above = segment_obstacle(obstacles, k, obstacles.poses[obstacles.first[k]], point, point, check.witness)
            stands = above > 0.0
        traced.flags[k].stands = 1 if stands else 0
    for p in range(body.pairs + len(traced.flags) * body.parts):
        pair = pair_of(body, p)
        counts = True
        if pair.second < 0:
            k = -1 - pair.second
            counts = (body.link[pair.first] > 0 or traced.flags[k].stands == 0) and (
                check.between == 1 or traced.flags[k].met == 1
            )
        if counts:
            scan(traced, room, pair)
        if check.largest >= check.enough:
            return np.inf
    total = 0.0
    for f in range(frames):
        total += traced.frames[f].shortfall
    return check.largest + total / frames


class Pair(NamedTuple):
    """Two bodies.

    Attributes:
        first: Capsule.
        second: Capsule, or -1 - number of an obstacle.
        low: The joints low..high - 1, from 0, move the one against the other.
        high: See ``low``.
    """

    first: int
    second: int
    low: int
    high: int


@leaf
def pair_of(body, p):
    """The p-th of all pairs: those of the body, then every obstacle with every solid."""
    if p < body.pairs:
        return Pair(body.first[p], body.second[p], body.low[p], body.high[p])
    k, i = divmod(p - body.pairs, body.parts)
    return Pair(i, -1 - k, 0, 0)


@leaf
def pose_row(obstacles, k, t):
    """Number of the pose of an obstacle in a frame of the path."""
    return obstacles.first[k] + (t if obstacles.frames[k] > 1 else 0)


@leaf
def scan(traced, room, pair):
    """Follow a pair along the path, in steps as long as its clearance allows, and note where it comes too near."""
    check, last = traced.work[0].check, len(traced.path) - 1
    f, step, c = 0, last, gap_at(traced, room, pair, 0)
    note(traced, pair, 0, c)
    while f < last:
        ahead, clear_ahead, mu = min(f + step, last), False, 0.0
        c_ahead = c
        while not clear_ahead:
            mu = motion(traced, room, pair, f, ahead)
            if ahead == f + 1 or 2.0 * (c - check.required) >= 0.7 * mu:  # else there is no hope
                c_ahead = gap_at(traced, room, pair, ahead)
                clear_ahead = ahead == f + 1 or c + c_ahead - mu >= 2.0 * check.required
            if not clear_ahead:
                ahead = f + (ahead - f) // 2
        note(traced, pair, ahead, c_ahead)
        unsure = c + c_ahead - mu < 2.0 * (check.required - check.margin)
        if check.between == 1 and unsure and min(c, c_ahead) >= check.required:
            halve(traced, room, pair, f, c, c_ahead, mu)
        step = 2 * (ahead - f)
        f, c = ahead, c_ahead


@leaf
def note(traced, pair, f, c):
    """Note a clearance in a frame where it is too small, and the smallest there."""
    check = traced.work[0].check
    short = check.required - c
    if short > traced.frames[f].shortfall:
        traced.frames[f].shortfall, traced.frames[f].first, traced.frames[f].second = short, pair.first, pair.second
        if short > check.largest:
            check.largest, check.frame, check.share = short, f, 0.0
            check.first, check.second = pair.first, pair.second
        if pair.second < 0:
            traced.flags[-1 - pair.second].met = 1


@leaf
def gap_at(traced, room, pair, f):
    """Clearance of a pair in a frame [m]."""
    i, j = pair.first, pair.second
    if j < 0:
        pose = room.obstacles.poses[pose_row(room.obstacles, -1 - j, f)]
        return obstacle_gap(traced, room, pair, pose, traced.ends[i, f])
    return capsule_gap(traced.work[0].body, pair, traced.ends[i, f], traced.ends[j, f])


@leaf
def capsule_gap(body, pair, a, b):
    """Clearance of two capsules with ends of shape (6,) each [m]."""
    _, _, square = nearest(
        a[3] - a[0], a[4] - a[1], a[5] - a[2], b[3] - b[0], b[4] - b[1], b[5] - b[2], a[0] - b[0], a[1] - b[1],
        a[2] - b[2],
    )  # fmt: skip
    return np.sqrt(square) - body.radius[pair.first] - body.radius[pair.second]


@leaf
def obstacle_gap(traced, room, pair, pose, ends):
    """Clearance of a capsule to an obstacle at a pose [m]."""
    work = traced.work[0]
    k = -1 - pair.second
    away = segment_obstacle(room.obstacles, k, pose, ends[:3], ends[3:6], work.check.witness)
    return away - room.obstacles.error[k] - work.body.radius[pair.first]


@leaf
def motion(traced, room, pair, f, ahead):
    """Bound on how far two bodies move against each other between two frames [m]."""
    i, j = pair.first, pair.second
    way = traced.way[i, ahead] - traced.way[i, f]
    if j < 0:
        k = -1 - j
        if room.obstacles.frames[k] == 1:
            return way
        begin, end, far = f, ahead, 0.0
        pose = room.obstacles.poses[pose_row(room.obstacles, k, begin)]
        for e in range(0, 6, 3):
            square = 0.0
            for r in range(3):
                square += (traced.ends[i, f, e + r] - pose[ORIGIN + r]) ** 2
            far = max(far, np.sqrt(square))
        way += room.carried[k, end, 0] - room.carried[k, begin, 0]
        return way + (far + way) * (room.carried[k, end, 1] - room.carried[k, begin, 1])
    body, turned = traced.work[0].body, 0.0
    way += traced.way[j, ahead] - traced.way[j, f]
    for m in range(pair.low, pair.high):
        turned += (traced.frames[ahead].turned[m] - traced.frames[f].turned[m]) * body.lever[j, m]
    return min(way, turned)


@branch
def halve(traced, room, pair, t, c_0, c_1, mu):
    """Look between two frames that both are clear, until that is sure or a shortfall is met, and note it.

    Args:
        traced: The path.
        room: What is around.
        pair: The bodies.
        t: The frame.
        c_0: Clearance in it [m].
        c_1: Clearance in the next one.
        mu: Bound on the motion between them.
    """
    check, parts = traced.work[0].check, 1
    while parts < 2**DEPTH and mu / parts > check.margin:
        parts *= 2
    left, waiting = 0, 1
    check.place[0], check.gap[0] = parts, c_1
    while waiting > 0:
        right, c = check.place[waiting - 1], check.gap[waiting - 1]
        mu_here = mu * (right - left) / parts
        if right - left == 1 or c_0 + c - mu_here >= 2.0 * (check.required - check.margin):
            left, c_0 = right, c
            waiting -= 1
        else:
            middle = (left + right) // 2
            c = gap_between(traced, room, pair, t, middle / parts)
            short = check.required - c
            if short > check.margin / 2.0:
                if short > check.largest:
                    check.largest, check.frame, check.share = short, t, middle / parts
                    check.first, check.second = pair.first, pair.second
                if pair.second < 0:
                    traced.flags[-1 - pair.second].met = 1
                return
            check.place[waiting], check.gap[waiting] = middle, c
            waiting += 1


@branch
def gap_between(traced, room, pair, t, share):
    """Clearance of a pair part of the way from frame t to the next [m]."""
    work = traced.work[0]
    place_between(traced, room, pair, t, share)
    if pair.second < 0:
        return obstacle_gap(traced, room, pair, work.between[2], work.between[0])
    return capsule_gap(work.body, pair, work.between[0], work.between[1])


@branch
def place_between(traced, room, pair, t, share):
    """Write the ends of a pair's capsules, or the obstacle's pose, part of the way from frame t to the next.

    The joints and a recorded body's origin move evenly, its axes turn evenly.
    """
    work = traced.work[0]
    path, body, n = traced.path, work.body, traced.path.shape[1]
    ahead = min(t + 1, len(path) - 1)
    for j in range(n):
        work.q[j] = path[t, j] + share * (path[ahead, j] - path[t, j])
    place_joints(work.poses[1:], work.placements, work.q, work.chain)
    place_capsule(work.between[0], body, work.poses, pair.first)
    if pair.second >= 0:
        place_capsule(work.between[1], body, work.poses, pair.second)
    else:
        obstacle_pose(room.obstacles, -1 - pair.second, t, share, work.between[2])
