"""Gradients of f, E and r by the design, from the joint paths that are solved already.

q_t minimises the objective, inside the limits and the ball around q_{t-1}; so its derivative follows from the
objective's second derivatives by joints and design entries (implicit function theorem), frame by frame from that
of q_{t-1}. Joints at a limit stay there. Where the ball binds, with multiplier nu and d = q_t - q_{t-1},

    (H + nu I) dq_t + d dnu = nu dq_{t-1} - mixed,    d . (dq_t - dq_{t-1}) = 0.

Along directions in which the objective is flat q_t keeps what q_{t-1} had, as the solver does. Then

    dg_t = partial g / partial Phi + partial g / partial q dq_t,    and the same for E_t.
"""

from __future__ import annotations

import numpy as np

from armdesign.fitness.kernels.area_slope import area_slope
from armdesign.fitness.kernels.base_frame import give_base, show_frame
from armdesign.fitness.kernels.orientation_slope import add_orientation
from armdesign.fitness.kernels.path import set_mount
from armdesign.fitness.kernels.solver_state import MOUNT_IDENTITY, MOUNT_START
from armdesign.fitness.kernels.temporal import Target, evaluate_frame
from armdesign.fitness.kernels.variations import (
    BASE,
    YAW,
    Q,
    coordinates,
    differentiate_position,
    place_joints,
    root_of_position,
    set_axes,
    tie_points,
)
from armdesign.kinematics.compilation import branch, entry
from armdesign.kinematics.kernels.dls import factorise, solve_lower, solve_upper
from armdesign.kinematics.kernels.skeleton import load_arm, set_kinds, update_skeleton

FLAT = 1e-9
"""Curvature, relative to the mean one, below which a direction counts as flat."""
ON_BALL = 1.0 - 1e-7


@entry
def slopes_along_paths(variations, pulls, arms, scratch, problem, batch, paths, slopes, turns):
    """Differentiate f and E of candidates by all entries of their designs, in the order of DesignSpace.names.

    Args:
        variations: One VARIATION record, shape (1,).
        pulls: One PULL record, shape (1,).
        arms: One ARM record, shape (1,).
        scratch: One SCRATCH record, shape (1,).
        problem: Demonstration and settings, a ProblemArrays.
        batch: The candidates, a Batch.
        paths: Their solved joint paths, shape (N, T, n) [rad].
        slopes: Gradients of f and of E, shape (2, N, E), written; E = 3 (n + 1) + 1, or more where the base moves, too.
        turns: Derivatives of the joint angles, shape (N, T, n, E), written, or (0, T, n, E) where they are not wanted.
    """
    v, arm, n, T, E = variations[0], arms[0], batch.rows.shape[1] - 1, len(problem.P), slopes.shape[2]
    placements, poses = np.empty((n, 12)), np.empty((n, 12))
    v.first = 0 if 3 * n + 4 < E else YAW
    for k in range(len(batch.rows)):
        give_base(arm.state, batch.bases[k])
        set_kinds(arm.chain, problem.record[0].slides, n)
        load_arm(arm.chain, placements, batch.rows[k], batch.yaw[k])
        given = np.isfinite(batch.mounts[k, 0, 0])
        if given:
            for i in range(3):
                for j in range(3):
                    arm.attitude.mount[i, j] = batch.mounts[k, i, j]
        for c in range(v.first, coordinates(n)):
            v.f[c] = v.E[c] = 0.0
            for j in range(n):
                v.dq[j, c] = 0.0
        for t in range(T):
            place_joints(poses, placements, paths[k, t], arm.chain)
            update_skeleton(arm.chain, poses)
            set_axes(v, poses, arm.state.base, arm.chain, batch.rows[k])
            frame_slopes(v, pulls[0], arm, scratch[0], problem, paths[k], t, given)
            if len(turns) > 0:
                for e in range(E):
                    c = coordinate_of(e, n)
                    for j in range(n):
                        turns[k, t, j, e] = v.dq[j, c] if c >= 0 else 0.0
        for e in range(E):
            c = coordinate_of(e, n)
            slopes[0, k, e] = v.f[c] / T if c >= 0 else 0.0
            slopes[1, k, e] = v.E[c] / T if c >= 0 else 0.0


@branch
def coordinate_of(e, n):
    """Coordinate that entry e of a design is; -1 for one that is no number, such as the base's site."""
    if e < 3 * n + 3:
        return BASE + 4 * (e // 3) + e % 3
    if e == 3 * n + 3:
        return YAW
    return e - (3 * n + 4) if e < 3 * n + 7 else -1  # the base's entries come last, and act first


@branch
def frame_slopes(v, pull, arm, scratch, arrays, path, t, given):
    """Differentiate frame t: first its joint angles, then g and E by them and the design."""
    n, m, problem = arm.chain.dof, arrays.P.shape[1], arrays.record[0]
    show_frame(scratch, arm.state, arrays, t)
    points = scratch.points[:m]
    target = Target(points, scratch.rotation, problem.weights[:m], problem.w_0, problem.free, problem.metric)
    follows = problem.mount == MOUNT_START and not given
    if t == 0:
        open_slopes(v, arm, scratch, problem, target, path[0], given)
    v.follows = 1 if follows else 0
    evaluate_frame(arm, scratch, target)
    second_order(v, arm, scratch.match, target, problem, path[t])
    if t > 0:
        turn_joints(v, scratch.step, problem, path[t], path[t - 1], n)
    area_slope(v, pull, arm.chain, scratch.match, points, problem.delta, n)
    scale = 1.0 if target.w_0 > 0.0 else 1.0 / (m * max(arm.frame.root, 1e-12))
    for c in range(v.first, coordinates(n)):
        g, E = v.slope[c] * scale, v.area[c]
        for j in range(n):
            q = BASE + 4 * j + Q
            g += v.slope[q] * scale * v.dq[j, c]
            E += v.area[q] * v.dq[j, c]
        v.f[c] += g
        v.E[c] += E


@branch
def open_slopes(v, arm, scratch, problem, target, q, given):
    """Differentiate the start pose, which minimises another objective: the hand has its weight of the phase POLISH."""
    n, m, attitude, chain = arm.chain.dof, len(target.weights), arm.attitude, arm.chain
    w_0 = 0.0 if problem.mount == MOUNT_START and not given else problem.w_0
    start = Target(target.points, target.rotation, problem.polish_weights[:m], w_0, problem.start_free, problem.metric)
    for c in range(v.first, coordinates(n)):
        for r in range(3):
            v.tool_turn[c, r] = 0.0
    v.follows = 0
    if problem.w_0 > 0.0 and not given:
        set_mount(attitude, chain, target.rotation, MOUNT_IDENTITY)
    evaluate_frame(arm, scratch, start)
    second_order(v, arm, scratch.match, start, problem, q)
    turn_joints(v, scratch.step, problem, q, q, n)
    if problem.w_0 > 0.0 and not given:
        set_mount(attitude, chain, target.rotation, problem.mount)
    for c in range(v.first, coordinates(n)):
        for r in range(3):
            total = 0.0
            for s in range(3):
                turn = v.axis[c, 3 + s]
                for j in range(n):
                    turn += v.axis[BASE + 4 * j + Q, 3 + s] * v.dq[j, c]
                total += chain.tip_rotation[s, r] * turn
            v.tool_turn[c, r] = total


@branch
def second_order(v, arm, match, target, problem, q):
    """Slope of the solver's objective by all coordinates, and its second derivatives by joints and coordinates."""
    chain, weights, w_0 = arm.chain, target.weights, target.w_0
    n, m = chain.dof, len(weights)
    tie_points(v, match, chain, weights, m)
    differentiate_position(v, match, weights, m, n)
    if w_0 > 0.0:
        root_of_position(v, arm.frame.root, m, n)
    v.scale = 0.0
    for j in range(n):
        v.at_limit[j] = 0 if problem.lower[j] < q[j] < problem.upper[j] else 1
        v.pull[j] = v.slope[BASE + 4 * j + Q]
        v.scale += abs(v.mixed[j, BASE + 4 * j + Q]) / n
    if w_0 > 0.0:
        add_orientation(v, arm.attitude, chain, target.rotation, problem.metric, n, w_0)


@branch
def turn_joints(v, step, problem, q, before, n):
    """Update ``v.dq`` from the previous frame, with the angles ``before``, to this one; at the start both are q."""
    nu = ball_multiplier(v, problem, q, before, n)
    for j in range(n):
        slope = v.pull[j] + nu * (q[j] - before[j])
        low = q[j] <= problem.lower[j] and slope > 0.0
        high = q[j] >= problem.upper[j] and slope < 0.0
        step.held[j] = 1 if low or high or problem.lower[j] == problem.upper[j] else 0
        for i in range(j + 1):
            step.matrix[j, i] = v.mixed[j, BASE + 4 * i + Q]
    shift = FLAT * (v.scale + 1e-12)  # along flat directions dq_t keeps what dq_{t-1} had
    while not factorise(step, n, nu + shift):
        shift *= 10.0
    for j in range(n):
        step.gradient[j] = step.move[j] = 0.0 if step.held[j] == 1 else q[j] - before[j]
    solve_lower(step.factor, step.move, n)
    solve_upper(step.factor, step.move, n)
    for c in range(v.first, coordinates(n)):
        turn_by(v, step, q, before, nu, c, n)


@branch
def ball_multiplier(v, problem, q, before, n):
    """The ball's multiplier nu; 0 where it does not bind."""
    square, free, pull = 0.0, 0.0, 0.0
    for j in range(n):
        away = q[j] - before[j]
        square += away * away
        if problem.lower[j] < q[j] < problem.upper[j]:
            free += away * away
            pull -= v.pull[j] * away
    if square < (problem.radius * ON_BALL) ** 2 or free <= 0.0:
        return 0.0
    return max(pull / free, 0.0)


@branch
def turn_by(v, step, q, before, nu, c, n):
    """One coordinate's column of dq; ``step.move`` holds (H + nu)^-1 d, ``step.gradient`` d."""
    ahead, wanted = 0.0, 0.0
    for j in range(n):
        wanted += (q[j] - before[j]) * v.dq[j, c]
        if step.held[j] == 1:
            v.dq[j, c] = 0.0
    for j in range(n):
        step.work[j] = 0.0
        if step.held[j] == 0:
            step.work[j] = -v.mixed[j, c]
            for i in range(n):
                step.work[j] -= v.mixed[j, BASE + 4 * i + Q] * v.dq[i, c]
    solve_lower(step.factor, step.work, n)
    solve_upper(step.factor, step.work, n)
    for j in range(n):
        v.dq[j, c] += step.work[j] if step.held[j] == 0 else 0.0
        ahead += step.gradient[j] * v.dq[j, c]
    if nu > 0.0:  # d . (dq_t - dq_{t-1}) = 0 settles dnu, see above
        across = 0.0
        for j in range(n):
            across += step.gradient[j] * step.move[j]
        for j in range(n):
            v.dq[j, c] -= step.move[j] * (ahead - wanted) / across
