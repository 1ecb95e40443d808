"""Path fitness, eq. 4-6: every arm of a block follows the demonstration frame by frame.

``advance`` is the inner loop: Pinocchio has just updated the joint poses of the whole block at the trial angles; for
every arm one damped least squares step is judged and the next one proposed. Arms are independent of each other and
of their place in the block, so the result is the same for any block size. An arm goes through these phases:

    SAMPLE   judge each of the start poses as it is, keep the best few
    DESCEND  solve the first frame roughly from each of those, with a raised weight of the hand
    POLISH   solve it to the end from the best few of the outcomes, the hand's weight so high that it reaches its
             point (method section 4);
             an arm with a start pose of its own begins here, with that one alone
    OPEN     take a start that reaches, the best one first, fix the mount, accumulate frame 0
    FOLLOW   solve frame t from q_{t-1}, accumulate it, until the last frame or the cutoff; then OPEN the next start
             where several paths are wanted
    REPLAY   accumulate given joint angles as they are
    DONE     the outcome can be collected, and the place given to the next candidate
"""

from __future__ import annotations

import numpy as np

from armdesign.fitness.kernels.area import frame_area
from armdesign.fitness.kernels.base_frame import give_base, show_frame
from armdesign.fitness.kernels.solver_state import (
    DESCEND,
    DONE,
    FOLLOW,
    IDLE,
    MOUNT_IDENTITY,
    MOUNT_START,
    OPEN,
    POLISH,
    REPLAY,
    SAMPLE,
)
from armdesign.fitness.kernels.starts import (
    begin_candidate,
    begin_frame,
    keep_finalist,
    keep_reaching,
    keep_start,
    next_start,
    open_path,
)
from armdesign.fitness.kernels.temporal import Target, differentiate_frame, evaluate_frame
from armdesign.fitness.kernels.trial import judge, propose_trial
from armdesign.kinematics.compilation import branch, leaf, plain_entry
from armdesign.kinematics.kernels.skeleton import MAX_DOF, load_arm, set_kinds, update_skeleton


@branch
def accumulate(arm, match, target, delta, trace, frames):
    """Add the frame at the present poses to the sums, and to the path's part of the trace where one is kept."""
    state, chain, g = arm.state, arm.chain, arm.frame.g
    area = frame_area(chain, match, target.points, delta)
    state.f_sum += g  # eq. 5, divided by T at the end
    state.E_sum += area
    if len(trace) > 0:
        row = trace[state.path * frames + state.t]
        for j in range(chain.dof):
            row.q[j] = state.trial[j]
        row.g, row.area = g, area
        row.orientation_error = arm.attitude.error if target.w_0 > 0.0 else 0.0
        for i in range(len(target.points)):
            row.sigma[i] = (chain.arc[match.segment[i]] + match.along[i]) / chain.length
            row.distance[i] = match.distance[i]


@branch
def over(state, attitude, problem, frames, n):
    """Whether the path ends behind the frame just accumulated: the last one, or the sum is past the cutoff.

    The fitness is a mean of terms >= 0, so a partial sum beyond the cutoff settles it (method section 7); so does one
    beyond the fitness of another start's path. With several paths the whole sum counts too: which of them is the best
    is known only where all below the cutoff are followed to their end.
    """
    state.t += 1
    state.frames += 1
    partial = (problem.lambda_f * state.f_sum + problem.lambda_E * state.E_sum) / frames  # eq. 6
    # the margin covers the rounding of the sum: a candidate exactly at its cutoff is never dropped
    beyond = partial > min(state.cutoff, state.best_r) * (1.0 + 1e-12)
    if state.t < frames and not beyond:
        return False
    if state.t == frames and (state.start_count < 2 or not beyond):
        if state.best < 0 or partial < state.best_r:
            state.best, state.best_r, state.best_f, state.best_E = state.path, partial, state.f_sum, state.E_sum
            keep_mount(state, attitude)
    else:
        state.pruned = 1
    end_path(state, attitude, problem, frames, n)
    return True


@branch
def keep_mount(state, attitude):
    """Keep the mount of the present path."""
    for i in range(3):
        for j in range(3):
            state.mount[i, j] = attitude.mount[i, j]


@branch
def end_path(state, attitude, problem, frames, n):
    """Go to the next start's path; behind the last one, the best path is the outcome."""
    if state.path == 0 and state.best < 0:
        keep_mount(state, attitude)
    if state.path + 1 < state.start_count:
        state.path += 1
        open_path(state, problem, n)
        return
    state.phase, state.valid = DONE, 1
    if state.best >= 0:
        state.path, state.t, state.pruned = state.best, frames, 0
        state.f_sum, state.E_sum = state.best_f, state.best_E
    elif state.pruned == 1:
        state.path = 0
    else:
        state.path, state.t, state.valid = state.farthest, state.miss_frame, 0


@branch
def set_mount(attitude, chain, target, kind):
    """Mount of the hand on the end-effector: identity, or such that e_R = 0 at the present pose."""
    for i in range(3):
        for j in range(3):
            if kind == MOUNT_IDENTITY:
                attitude.mount[i, j] = 1.0 if i == j else 0.0
            else:
                total = 0.0
                for k in range(3):
                    total += chain.tip_rotation[k, i] * target[k, j]
                attitude.mount[i, j] = total


@branch
def tip_error(chain, point):
    """Distance of the end-effector to a point [m]."""
    total = 0.0
    for c in range(3):
        total += (chain.tip[c] - point[c]) ** 2
    return np.sqrt(total)


@plain_entry
def advance(arms, block, scratch, problem, traces):
    """Judge the trial of every arm of the block and propose the next one.

    Args:
        arms: ARM records, shape (B,).
        block: Poses, Jacobian and joint angles of the block in Pinocchio's memory; q is overwritten with the next
            trials.
        scratch: One SCRATCH record, shape (1,).
        problem: Demonstration and settings, a ProblemArrays.
        traces: TRACE records, shape (B, K T) for K paths, or (B, 0) where none are kept.

    Returns:
        Number of arms that are done.
    """
    done = 0
    for b in range(len(arms)):
        arm = arms[b]
        if arm.state.phase == IDLE:
            continue
        if arm.state.phase != DONE:
            n = arm.chain.dof
            update_skeleton(arm.chain, block.poses[b * n :])
            advance_arm(arm, scratch[0], problem, block.jacobian[b * n :], traces[b])
            for j in range(n):
                block.q[b * n + j] = arm.state.trial[j]
        if arm.state.phase == DONE:
            done += 1
    return done


@leaf
def target_of(state, scratch, arrays, starting):
    """The frame that the arm is compared with in its present phase, and the weights that hold there."""
    problem, m = arrays.record[0], arrays.P.shape[1]
    show_frame(scratch, state, arrays, state.t)
    # a mount that is chosen at the start makes e_R = 0 there, so that orientation has no weight before
    w_0 = 0.0 if starting and problem.mount == MOUNT_START and state.mounted == 0 else problem.w_0
    weights = problem.weights[:m]
    if state.phase == POLISH:
        weights = problem.polish_weights[:m]
    elif starting:
        weights = problem.descent_weights[:m]
    free = problem.start_free if starting else problem.free
    return Target(scratch.points[:m], scratch.rotation, weights, w_0, free, problem.metric)


@branch
def advance_arm(arm, scratch, arrays, jacobian, trace):
    """Evaluate one arm once; more than once only where the next frame begins at the same pose."""
    state, frame, chain, attitude, match, problem = (
        arm.state, arm.frame, arm.chain, arm.attitude, scratch.match, arrays.record[0],
    )  # fmt: skip
    starts, frames, n, m = arrays.starts, len(arrays.P), chain.dof, arrays.P.shape[1]
    while True:
        phase = state.phase
        starting = phase in (SAMPLE, DESCEND, POLISH)
        target = target_of(state, scratch, arrays, starting)
        if (starting or phase == OPEN) and problem.w_0 > 0.0 and state.mounted == 0:
            set_mount(attitude, chain, target.rotation, MOUNT_IDENTITY if starting else problem.mount)
        evaluate_frame(arm, scratch, target)
        if phase == SAMPLE:
            state.steps += 1
            keep_start(state, frame.value, problem.descents)
            state.k += 1
            if state.k < len(starts):
                for j in range(n):
                    state.trial[j] = starts[state.k, j]
            else:
                state.k = 0
                next_start(state, problem, starts, n)
            return
        if phase in (DESCEND, POLISH, FOLLOW):
            if state.closing == 0:
                moved = judge(frame, state, problem, n)
                if moved:
                    differentiate_frame(arm, scratch, target, jacobian)
                if state.tries < problem.max_steps and propose_trial(arm, scratch.step, problem, target.w_0, m):
                    return
                if not moved:  # the poses are those of a rejected trial: go back once
                    state.closing = 1
                    for j in range(n):
                        state.trial[j] = state.q[j]
                    return
            for j in range(n):
                state.trial[j] = state.q[j]
        if phase == DESCEND:
            keep_finalist(state, n, problem.finalists)
            state.k += 1
            next_start(state, problem, starts, n)
            return
        if phase == POLISH:
            error = tip_error(chain, target.points[m - 1])
            if error <= problem.reach:
                # starts compete by g with the weights of the path, not with the raised one of the hand
                weights = problem.weights[:m]
                followed = Target(target.points, target.rotation, weights, target.w_0, problem.free, problem.metric)
                evaluate_frame(arm, scratch, followed)
                keep_reaching(state, n, frame.g, error, problem.start_paths)
            else:
                state.nearest = min(state.nearest, error)
            state.k += 1
            next_start(state, problem, starts, n)
            return
        if problem.every == 1 and phase == FOLLOW:
            error = tip_error(chain, target.points[m - 1])
            if error > problem.reach:
                if state.t > state.miss_frame:
                    state.farthest, state.miss_frame, state.miss = state.path, state.t, error
                end_path(state, attitude, problem, frames, n)
                return
        accumulate(arm, match, target, problem.delta, trace, frames)
        if over(state, attitude, problem, frames, n):
            return
        if phase == REPLAY:
            for j in range(n):
                state.trial[j] = trace[state.t].q[j]
            return
        state.phase = FOLLOW
        begin_frame(state, problem, n)  # eq. 4: the ball is centred at q_{t-1}


@leaf
def collect(outcome, state):
    """Keep what counts of a candidate that is done."""
    for j in range(MAX_DOF):
        outcome.best_q[j] = state.start_q[state.path, j]
    for i in range(3):
        for j in range(3):
            outcome.mount[i, j] = state.mount[i, j]
    outcome.path, outcome.t, outcome.frames = state.path, state.t, state.frames
    outcome.f_sum, outcome.E_sum = state.f_sum, state.E_sum
    outcome.start_error = state.start_miss[state.path] if state.start_count > 0 else state.nearest
    outcome.miss_frame, outcome.miss = state.miss_frame, state.miss
    outcome.steps, outcome.start_steps, outcome.accepted = state.steps, state.start_steps, state.accepted
    outcome.pruned, outcome.valid, outcome.done = state.pruned, state.valid, 1


@plain_entry
def exchange(arms, block, problem, batch, outcome, cursor):
    """Collect finished candidates and give their places to the next candidates.

    Args:
        arms: ARM records, shape (B,).
        block: Placements and joint angles of the block in Pinocchio's memory, written.
        problem: Demonstration and settings, a ProblemArrays.
        batch: The candidates, a Batch.
        outcome: OUTCOME records, shape (N,); those of finished candidates are written.
        cursor: Index of the next candidate.

    Returns:
        Index of the next candidate.
    """
    for b in range(len(arms)):
        state, n = arms[b].state, batch.rows.shape[1] - 1
        if state.phase == DONE:
            collect(outcome[state.candidate], state)
            state.phase = IDLE
        if state.phase == IDLE and cursor < len(batch.rows):
            set_kinds(arms[b].chain, problem.record[0].slides, n)
            load_arm(arms[b].chain, block.placements[b * n :], batch.rows[cursor], batch.yaw[cursor])
            begin_candidate(
                state, problem.record[0], n, problem.starts, batch.cutoff[cursor], batch.poses[cursor], cursor
            )
            give_base(state, batch.bases[cursor])
            give_mount(state, arms[b].attitude, batch.mounts[cursor])
            for j in range(n):
                block.q[b * n + j] = state.trial[j]
            cursor += 1
    return cursor


@branch
def give_mount(state, attitude, mount):
    """Set the mount of the hand where one is given; NaN leaves it to the start."""
    state.mounted = 1 if np.isfinite(mount[0, 0]) else 0
    for i in range(3):
        for j in range(3):
            attitude.mount[i, j] = mount[i, j] if state.mounted == 1 else 0.0
