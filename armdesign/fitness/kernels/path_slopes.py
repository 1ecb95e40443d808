"""Gradients of f, E and r by the design, from the joint paths that are solved already.

q_t minimises the objective, inside the limits and the ball around q_{t-1}; so its derivative follows from the
objective's second derivatives by joints and design entries (implicit function theorem), frame by frame with that of
q_{t-1} at hand. Joints at a limit stay there. Where the ball binds, with multiplier nu and d = q_t - q_{t-1},

    (H + nu I) dq_t + d dnu = nu dq_{t-1} - mixed,    d . (dq_t - dq_{t-1}) = 0.

Along directions in which the objective is flat q_t keeps what q_{t-1} had, as the solver does. Then

    dg_t = partial g / partial Phi + partial g / partial q dq_t,    and the same for E_t.
"""

from __future__ import annotations

import numpy as np

from armdesign.fitness.kernels.area_slope import area_slope
from armdesign.fitness.kernels.orientation_slope import add_orientation
from armdesign.fitness.kernels.path import set_mount
from armdesign.fitness.kernels.solver_state import MOUNT_IDENTITY, MOUNT_START
from armdesign.fitness.kernels.temporal import evaluate_frame
from armdesign.fitness.kernels.variations import (
    Q,
    differentiate_position,
    place_joints,
    root_of_position,
    set_axes,
    tie_points,
)
from armdesign.kinematics.compilation import branch, entry
from armdesign.kinematics.kernels.dls import factorise, solve_lower, solve_upper
from armdesign.kinematics.kernels.skeleton import load_arm, update_skeleton

FLAT = 1e-9
"""Curvature, relative to the mean one, below which a direction counts as flat."""
ON_BALL = 1.0 - 1e-7


@entry
def slopes_along_paths(
    variations, pulls, chains, frames, attitudes, matches, steps, problems, P, R, rows, yaws, paths, mounts, f, E
):  # fmt: skip
    """Write the gradients of f and E, shape (N, 3 (n + 1) + 1), of N arms by their paths (N, T, n)."""
    v, chain, n = variations[0], chains[0], rows.shape[1] - 1
    placements, poses = np.empty((n, 12)), np.empty((n, 12))
    for k in range(len(rows)):
        load_arm(chain, placements, rows[k], yaws[k])
        given = np.isfinite(mounts[k, 0, 0])
        if given:
            for i in range(3):
                for j in range(3):
                    attitudes[0].mount[i, j] = mounts[k, i, j]
        for c in range(4 * n + 4):
            v.f[c] = v.E[c] = 0.0
            for j in range(n):
                v.dq[j, c] = 0.0
        for t in range(len(P)):
            place_joints(poses, placements, paths[k, t], n)
            update_skeleton(chain, poses)
            set_axes(v, poses, chain, rows[k], n)
            frame_slopes(
                v, pulls[0], chain, frames[0], attitudes[0], matches[0], steps[0], problems[0], P, R, paths[k], t,
                given,
            )  # fmt: skip
        for e in range(3 * n + 3):
            c = 1 + 4 * (e // 3) + e % 3
            f[k, e], E[k, e] = v.f[c] / len(P), v.E[c] / len(P)
        f[k, 3 * n + 3], E[k, 3 * n + 3] = v.f[0] / len(P), v.E[0] / len(P)


@branch
def frame_slopes(v, pull, chain, frame, attitude, match, step, problem, P, R, path, t, given):
    """Differentiate frame t: first its joint angles, then g and E by them and the design."""
    n, m = chain.dof, P.shape[1]
    follows = problem.mount == MOUNT_START and not given
    points, target, weights = P[t], R[min(t, len(R) - 1)], problem.weights[:m]
    if t == 0:
        open_slopes(v, chain, frame, attitude, match, step, problem, points, target, path[0], follows, given)
    v.follows = 1 if follows else 0
    w_0 = problem.w_0
    evaluate_frame(frame, match, attitude, chain, points, target, weights, problem.free, w_0, problem.metric)
    second_order(v, chain, frame, attitude, match, weights, target, problem, path[t], w_0)
    if t > 0:
        turn_joints(v, step, problem, path[t], path[t - 1], n)
    area_slope(v, pull, chain, match, points, problem.delta, n)
    scale = 1.0 if w_0 > 0.0 else 1.0 / (m * max(frame.root, 1e-12))
    for c in range(4 * n + 4):
        g, E = v.slope[c] * scale, v.area[c]
        for j in range(n):
            q = 1 + 4 * j + Q
            g += v.slope[q] * scale * v.dq[j, c]
            E += v.area[q] * v.dq[j, c]
        v.f[c] += g
        v.E[c] += E


@branch
def open_slopes(v, chain, frame, attitude, match, step, problem, points, target, q, follows, given):
    """Differentiate the start pose, which minimises another objective: the hand is held, see PROBLEM."""
    n, m = chain.dof, len(points)
    weights, w_0 = problem.held_weights[:m], 0.0 if follows else problem.w_0
    for c in range(4 * n + 4):
        for r in range(3):
            v.tool_turn[c, r] = 0.0
    v.follows = 0
    if problem.w_0 > 0.0 and not given:
        set_mount(attitude, chain, target, MOUNT_IDENTITY)
    evaluate_frame(frame, match, attitude, chain, points, target, weights, problem.start_free, w_0, problem.metric)
    second_order(v, chain, frame, attitude, match, weights, target, problem, q, w_0)
    turn_joints(v, step, problem, q, q, n)
    if problem.w_0 > 0.0 and not given:
        set_mount(attitude, chain, target, problem.mount)
    for c in range(4 * n + 4):
        for r in range(3):
            total = 0.0
            for s in range(3):
                turn = v.axis[c, 3 + s]
                for j in range(n):
                    turn += v.axis[1 + 4 * j + Q, 3 + s] * v.dq[j, c]
                total += chain.tip_rotation[s, r] * turn
            v.tool_turn[c, r] = total


@branch
def second_order(v, chain, frame, attitude, match, weights, target, problem, q, w_0):
    """Slope of the solver's objective by all coordinates, and its second derivatives by joints and coordinates."""
    n, m = chain.dof, len(weights)
    tie_points(v, match, chain, weights, m)
    differentiate_position(v, match, weights, m, n)
    if w_0 > 0.0:
        root_of_position(v, frame.root, m, n)
    v.scale = 0.0
    for j in range(n):
        v.at_limit[j] = 0 if problem.lower[j] < q[j] < problem.upper[j] else 1
        v.pull[j] = v.slope[1 + 4 * j + Q]
        v.scale += abs(v.mixed[j, 1 + 4 * j + Q]) / n
    if w_0 > 0.0:
        add_orientation(v, attitude, chain, target, problem.metric, n, w_0)


@branch
def turn_joints(v, step, problem, q, before, n):
    """Bring ``v.dq`` from the frame before, with the angles ``before``, to the one at hand; both are q at the start."""
    nu = ball_multiplier(v, problem, q, before, n)
    for j in range(n):
        slope = v.pull[j] + nu * (q[j] - before[j])
        low = q[j] <= problem.lower[j] and slope > 0.0
        high = q[j] >= problem.upper[j] and slope < 0.0
        step.held[j] = 1 if low or high or problem.lower[j] == problem.upper[j] else 0
        for i in range(j + 1):
            step.matrix[j, i] = v.mixed[j, 1 + 4 * i + Q]
    shift = FLAT * (v.scale + 1e-12)
    while not factorise(step, n, nu + shift):
        shift *= 10.0
    for j in range(n):
        step.gradient[j] = step.move[j] = 0.0 if step.held[j] == 1 else q[j] - before[j]
    solve_lower(step.factor, step.move, n)
    solve_upper(step.factor, step.move, n)
    for c in range(4 * n + 4):
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
                step.work[j] -= v.mixed[j, 1 + 4 * i + Q] * v.dq[i, c]
    solve_lower(step.factor, step.work, n)
    solve_upper(step.factor, step.work, n)
    for j in range(n):
        v.dq[j, c] += step.work[j] if step.held[j] == 0 else 0.0
        ahead += step.gradient[j] * v.dq[j, c]
    if nu > 0.0:
        across = 0.0
        for j in range(n):
            across += step.gradient[j] * step.move[j]
        for j in range(n):
            v.dq[j, c] -= step.move[j] * (ahead - wanted) / across
