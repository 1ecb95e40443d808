"""Gradient of the violation of clearance by the entries of a design, at given slides.

A clearance c changes as its witness points do, along the unit vector between them: dc = normal . (dw_1 - dw_2). A point
of the arm moves as a turn about, or a shift along, the axis of a coordinate moves it; coordinates are

    yaw, then per row alpha, a, d and, for rows that carry a joint, q

and an end of a capsule is moved by the first few of them, see ``armdesign.bodies.kernels.capsules``. An end at which a
joint's sphere cuts a tube glides along the tube, too. Along the path the joints turn with the design: dq_t / dentry is
given.
"""

from __future__ import annotations

import numpy as np

from armdesign.bodies.kernels.capsules import WITNESS, place_capsule, segment_segment
from armdesign.cell.kernels.distance import segment_excess, segment_obstacle
from armdesign.feasibility.kernels.clearance import Pair, place_between
from armdesign.fitness.kernels.variations import set_shift, set_turn
from armdesign.kinematics.compilation import branch, leaf
from armdesign.kinematics.kernels.skeleton import MAX_DOF, ORIGIN, X, Z

MAX_COORDINATES = 4 * MAX_DOF + 4
ALPHA, A, D, Q = 1, 2, 3, 4
"""Places of row 0's coordinates, and of its joint's; those of row i come 4 i later."""

GLIDE = np.dtype(
    [
        ("axis", np.float64, (MAX_COORDINATES, 6)),  # Jacobian in the task frame: linear, then angular
        ("pull", np.float64, MAX_COORDINATES),  # dc / dcoordinate
        ("normal", np.float64, 3),
        ("whole", np.float64, 6),  # ends of the solid that a capsule is a piece of
        ("centre", np.float64, 3),  # of the sphere that has cut it
        ("witness", WITNESS),
    ]
)
"""How one clearance changes."""


@branch
def add_violation_slope(slope, glides, traced, room, turns):
    """Add the gradient of V = max S + mean_t S_t of a path that has just been checked.

    Args:
        slope: Gradient by all E entries, shape (E,), added to.
        glides: One GLIDE record, shape (1,).
        traced: The path.
        room: What is around.
        turns: Derivatives of the joint angles, shape (T, n, E).
    """
    check, frames = traced.work[0].check, len(traced.path)
    if check.largest > 0.0:
        pair = whole_pair(check.first, check.second)
        add_slope(slope, glides, traced, room, turns, pair, check.frame, check.share, -1.0)
    for f in range(frames):
        if traced.frames[f].shortfall > 0.0:
            pair = whole_pair(traced.frames[f].first, traced.frames[f].second)
            add_slope(slope, glides, traced, room, turns, pair, f, 0.0, -1.0 / frames)


@leaf
def whole_pair(first, second):
    """A pair of which the joints between do not matter."""
    return Pair(first, second, 0, 0)


@branch
def add_slope(slope, glides, traced, room, turns, pair, t, share, factor):
    """Add a multiple of the gradient of a pair's clearance in frame t, or part of the way to the next one.

    Args:
        slope: Gradient by all E entries, shape (E,), added to.
        glides: One GLIDE record, shape (1,).
        traced: The path.
        room: What is around.
        turns: Derivatives of the joint angles, shape (T, n, E).
        pair: The bodies.
        t: The frame.
        share: Part of the way to the next one.
        factor: What the gradient is multiplied by.
    """
    work = traced.work[0]
    glide, one, other = glides[0], work.between[0], work.between[1]
    place_between(traced, room, pair, t, share)
    begin_pull(glide, traced, room)
    if pair.second < 0:
        witness = work.check.witness
        segment_obstacle(room.obstacles, -1 - pair.second, work.between[2], one[:3], one[3:6], witness)
        set_normal(glide, witness.normal)
        add_pull(glide, traced, room, one, pair.first, witness.along, 1.0)
    else:
        segment_segment(one[:3], one[3:6], other[:3], other[3:6], glide.witness)
        set_normal(glide, glide.witness.normal)
        add_pull(glide, traced, room, one, pair.first, glide.witness.s, 1.0)
        add_pull(glide, traced, room, other, pair.second, glide.witness.t, -1.0)
    spread_pull(slope, glide, traced, turns, t, share, pair.second < 0, factor)


@branch
def add_excess_slope(slope, glides, traced, room, turns, grid, capsule, t):
    """Add the gradient of a capsule's largest distance from a swept volume in frame t.

    Args:
        slope: Gradient by all E entries, shape (E,), added to.
        glides: One GLIDE record, shape (1,).
        traced: The path.
        room: Sizes.
        turns: Derivatives of the joint angles, shape (T, n, E).
        grid: FieldArrays of the volume in the task frame.
        capsule: The capsule.
        t: The frame.
    """
    work = traced.work[0]
    glide, one, witness = glides[0], work.between[0], work.check.witness
    place_between(traced, room, whole_pair(capsule, capsule), t, 0.0)
    begin_pull(glide, traced, room)
    segment_excess(grid, one[:3], one[3:6], witness)
    set_normal(glide, witness.normal)
    add_pull(glide, traced, room, one, capsule, witness.along, 1.0)
    spread_pull(slope, glide, traced, turns, t, 0.0, True, 1.0)


@leaf
def set_normal(glide, normal):
    """Set what counts of how a point moves: the part along this vector."""
    for r in range(3):
        glide.normal[r] = normal[r]


@branch
def begin_pull(glide, traced, room):
    """Nothing is pulled yet; the coordinates are those at the joint poses of ``traced``."""
    n = traced.work[0].dof
    set_coordinates(glide, traced, room.sizes[0], n)
    for c in range(4 * n + 4):
        glide.pull[c] = 0.0


@branch
def spread_pull(slope, glide, traced, turns, t, share, in_room, factor):
    """Add a multiple of what the coordinates change to what the entries change, directly and through the path.

    Args:
        slope: Gradient by all E entries, shape (E,), added to.
        glide: Record of type GLIDE with its pull.
        traced: The path.
        turns: Derivatives of the joint angles, shape (T, n, E).
        t: The frame.
        share: Part of the way to the next one.
        in_room: Whether it is against something in the room, so that it matters where the base is.
        factor: What the gradient is multiplied by.
    """
    n, entries = traced.work[0].dof, len(slope)
    for e in range(3 * n + 3):
        slope[e] += factor * glide.pull[4 * (e // 3) + ALPHA + e % 3]
    if in_room:
        slope[3 * n + 3] += factor * glide.pull[0]
        for r in range(3 if entries > 3 * n + 4 else 0):
            slope[3 * n + 4 + r] += factor * glide.normal[r]
    ahead = min(t + 1, len(traced.path) - 1)
    for j in range(n):
        pull = factor * glide.pull[4 * j + Q]
        if pull != 0.0:
            for e in range(entries):
                slope[e] += pull * (turns[t, j, e] + share * (turns[ahead, j, e] - turns[t, j, e]))


@branch
def set_coordinates(glide, traced, sizes, n):
    """Write the Jacobian of all coordinates at the joint poses of ``traced``."""
    work = traced.work[0]
    axis, base = glide.axis, work.poses[0]
    set_turn(axis[0], 0.0, 0.0, 1.0, base[9], base[10], base[11])
    for i in range(n + 1):
        pose = work.poses[i]
        x, o, k = pose[X : X + 3], pose[ORIGIN:], 4 * i
        set_turn(axis[k + ALPHA], x[0], x[1], x[2], o[0], o[1], o[2])
        set_shift(axis[k + A], x[0], x[1], x[2])
        if i < n:
            z, o = work.poses[i + 1, Z : Z + 3], work.poses[i + 1, ORIGIN:]
            set_shift(axis[k + D], z[0], z[1], z[2])
            if sizes.prismatic[i] == 1:
                set_shift(axis[k + Q], z[0], z[1], z[2])
            else:
                set_turn(axis[k + Q], z[0], z[1], z[2], o[0], o[1], o[2])
        else:
            sin, cos = np.sin(work.rows[n, 0]), np.cos(work.rows[n, 0])
            y, z = pose[3:6], pose[Z : Z + 3]
            set_shift(axis[k + D], cos * z[0] - sin * y[0], cos * z[1] - sin * y[1], cos * z[2] - sin * y[2])


@branch
def add_pull(glide, traced, room, ends, k, along, sign):
    """Add how a point of a capsule moves along the normal, by every coordinate.

    Args:
        glide: Record of type GLIDE; axis and normal are set.
        traced: The path; joint poses and slides are set.
        room: Sizes.
        ends: Ends of the capsule, shape (6,) [m].
        k: The capsule.
        along: Where the point is on it, 0..1.
        sign: Factor.
    """
    work = traced.work[0]
    body, normal = work.body, glide.normal
    part, joint = body.part[k], body.cut[k]
    place_capsule(glide.whole, body, work.poses, part)
    p, q, m = glide.whole[:3], glide.whole[3:6], glide.centre
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    length = max(np.sqrt(ux * ux + uy * uy + uz * uz), 1e-12)
    ux, uy, uz = ux / length, uy / length, uz / length
    place, u = 0.0, (ux, uy, uz)
    for r in range(3):
        place += (ends[r] + along * (ends[3 + r] - ends[r]) - p[r]) * u[r]
    cut = joint > 0 and ((along == 0.0 and body.cut_end[k, 0] == 1) or (along == 1.0 and body.cut_end[k, 1] == 1))
    foot, away, gap, inside, centre_movers = 0.0, 0.0, 0.0, 1.0, 0
    ax, ay, az = 0.0, 0.0, 0.0
    if cut:
        slides = room.sizes[0].prismatic[joint - 1] == 1
        centre_movers = 4 * joint + 1 if slides else 4 * joint - 1
        lifted = 0.0 if slides else work.slides[joint - 1] - work.rows[joint - 1, 2]
        for r in range(3):
            m[r] = work.poses[joint, ORIGIN + r] + lifted * work.poses[joint, Z + r]
        ax, ay, az = m[0] - p[0], m[1] - p[1], m[2] - p[2]
        foot = ax * ux + ay * uy + az * uz
        ax, ay, az = ax - foot * ux, ay - foot * uy, az - foot * uz
        away = np.sqrt(ax * ax + ay * ay + az * az)
        gap = max(away - body.radius[k], 0.0)
        inside = np.sqrt(max(room.sizes[0].reach[joint - 1] ** 2 - gap * gap, 1e-24))
    for c in range(max(body.movers[part, 0], body.movers[part, 1])):
        px, py, pz = moved(glide.axis[c], p, c < body.movers[part, 0])
        qx, qy, qz = moved(glide.axis[c], q, c < body.movers[part, 1])
        stretch = ux * (qx - px) + uy * (qy - py) + uz * (qz - pz)
        vx, vy = (qx - px - stretch * ux) / length, (qy - py - stretch * uy) / length
        vz = (qz - pz - stretch * uz) / length
        rate = place / length * stretch
        if cut:
            mx, my, mz = moved(glide.axis[c], m, c < centre_movers)
            mx, my, mz = mx - px, my - py, mz - pz
            rate = mx * ux + my * uy + mz * uz + ax * vx + ay * vy + az * vz
            if gap > 0.0:
                widening = (ax * (mx - foot * vx) + ay * (my - foot * vy) + az * (mz - foot * vz)) / away
                # the end below the sphere is at foot - inside, the one above at foot + inside
                rate += gap * widening / inside * (1.0 if along == 1.0 else -1.0)
        glide.pull[c] += sign * (
            normal[0] * (px + rate * ux + place * vx)
            + normal[1] * (py + rate * uy + place * vy)
            + normal[2] * (pz + rate * uz + place * vz)
        )


@leaf
def moved(axis, point, moves):
    """Velocity of a point by a coordinate, 0 where that does not move it."""
    if not moves:
        return 0.0, 0.0, 0.0
    return (
        axis[0] + axis[4] * point[2] - axis[5] * point[1],
        axis[1] + axis[5] * point[0] - axis[3] * point[2],
        axis[2] + axis[3] * point[1] - axis[4] * point[0],
    )
