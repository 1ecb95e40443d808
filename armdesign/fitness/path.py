"""Path fitness, eq. 4-6: every arm of a block follows the demonstration frame by frame.

``advance`` is the inner loop: Pinocchio has just updated the joint poses of the whole block at the trial angles; for
every arm one damped least squares step is judged and the next one proposed. Arms are independent of each other and
of their place in the block, so the result is the same for any block size. An arm goes through these phases:

    SAMPLE   judge each of the start poses as it is, keep the best few
    DESCEND  solve the first frame roughly from each of those, the hand drawn to its point
    POLISH   solve it to the end from the best few of the outcomes, the hand held to its point (method section 4)
    OPEN     take the best start that reaches, fix the mount, book frame 0
    FOLLOW   solve frame t from q_{t-1}, book it, go on, until the last frame or the cutoff
    REPLAY   book given joint angles as they are
    DONE     the outcome can be collected, and the place given to the next candidate
"""

from __future__ import annotations

import numpy as np

from armdesign.compilation import branch, entry, leaf
from armdesign.fitness.area import frame_area
from armdesign.fitness.association import MAX_POINTS
from armdesign.fitness.temporal import differentiate_frame, evaluate_frame
from armdesign.kinematics.dls import multiply, propose
from armdesign.kinematics.skeleton import MAX_DOF, hang_arm, update_skeleton

IDLE, SAMPLE, DESCEND, POLISH, OPEN, FOLLOW, REPLAY, DONE = range(8)
MOUNT_IDENTITY, MOUNT_START = 0, 1
NEWTON, GAUSS = 0, 1
MAX_DESCENTS, MAX_FINALISTS = 256, 16

PROBLEM = np.dtype(
    [
        ("weights", np.float64, MAX_POINTS),
        ("drawn_weights", np.float64, MAX_POINTS),  # the same with the hand's raised, for DESCEND
        ("held_weights", np.float64, MAX_POINTS),  # the same with the hand's raised further, for POLISH
        ("w_0", np.float64),
        ("free", np.int64),  # number of free sigma
        ("metric", np.int64),
        ("mount", np.int64),
        ("lambda_f", np.float64),
        ("lambda_E", np.float64),
        ("delta", np.float64),
        ("radius", np.float64),  # eps, largest |q_t - q_{t-1}| [rad]
        ("lower", np.float64, MAX_DOF),
        ("upper", np.float64, MAX_DOF),
        ("reach", np.float64),  # how near the hand must come at the start [m]
        ("tolerance", np.float64),  # predicted relative decrease of g at which a frame is solved
        ("floor", np.float64),  # the same, absolute [m]
        ("max_steps", np.int64),
        ("descents", np.int64),
        ("finalists", np.int64),
        ("second_order", np.int64),
    ]
)
"""Everything about the task and the method that is one number; the frames come beside it."""

WALK = np.dtype(
    [
        ("phase", np.int64),
        ("candidate", np.int64),
        ("cutoff", np.float64),  # robot fitness beyond which the candidate is of no interest
        ("t", np.int64),
        ("k", np.int64),  # start pose at hand
        ("kept", np.int64, MAX_DESCENTS),  # best start poses so far, best first
        ("kept_value", np.float64, MAX_DESCENTS),
        ("kept_count", np.int64),
        ("final_q", np.float64, (MAX_FINALISTS, MAX_DOF)),  # best outcomes of the descents, best first
        ("final_value", np.float64, MAX_FINALISTS),
        ("final_count", np.int64),
        ("best_q", np.float64, MAX_DOF),
        ("best_g", np.float64),
        (
            "start_error",
            np.float64,
        ),  # smallest distance of the hand at the start, of the chosen start once there is one
        # the frame at hand
        ("q", np.float64, MAX_DOF),  # accepted angles
        ("trial", np.float64, MAX_DOF),  # angles to be judged next
        ("previous", np.float64, MAX_DOF),  # centre of the ball
        ("value", np.float64),  # objective at q
        ("g", np.float64),
        ("predicted", np.float64),  # decrease the model promises for the trial
        ("damping", np.float64),  # relative to the mean diagonal of the model
        ("model", np.int64),
        ("fresh", np.int64),  # 1: the trial opens a frame
        ("closing", np.int64),  # 1: solved, but the poses are those of a rejected trial
        ("tries", np.int64),
        # sums
        ("f_sum", np.float64),
        ("E_sum", np.float64),
        ("steps", np.int64),
        ("start_steps", np.int64),  # those spent on the start
        ("accepted", np.int64),
        ("pruned", np.int64),
        ("valid", np.int64),
    ]
)
"""Where an arm stands; one record an arm."""

OUTCOME = np.dtype(
    [
        ("done", np.int64),
        ("t", np.int64),
        ("best_q", np.float64, MAX_DOF),
        ("start_error", np.float64),
        ("f_sum", np.float64),
        ("E_sum", np.float64),
        ("steps", np.int64),
        ("start_steps", np.int64),
        ("accepted", np.int64),
        ("pruned", np.int64),
        ("valid", np.int64),
    ]
)
"""What is kept of a walk that is done."""

TRACE = np.dtype(
    [
        ("q", np.float64, MAX_DOF),
        ("g", np.float64),
        ("area", np.float64),
        ("orientation_error", np.float64),
        ("sigma", np.float64, MAX_POINTS),
        ("distance", np.float64, MAX_POINTS),
    ]
)
"""What is booked of a frame; kept only where somebody asks for it."""

SMALLEST_DAMPING = 1e-9
KINK = 1e-7  # e_R below which the orientation counts as met [rad]
KINK_RANGE = 0.3  # e_R below which meeting it in one step is tried [rad]
SAME_POSE = 0.05  # poses nearer than this count as one [rad]
TIE = 1.0 - 1e-6  # a later start has to be better by this much
ROUGH = 1e-3  # tolerance of the descents
RACE_FROM, RACE = 3, 3.0  # a descent is given up that after so many steps needs so many times the gain it promises
TRUST = 1.0  # longest step of a start pose [rad]


@branch
def begin_walk(walk, problem, n, starts, cutoff, candidate):
    """Put a new candidate at its first start pose."""
    walk.phase, walk.candidate, walk.cutoff = SAMPLE, candidate, cutoff
    walk.t, walk.k, walk.kept_count, walk.final_count, walk.best_g = 0, 0, 0, 0, np.inf
    walk.f_sum, walk.E_sum, walk.steps, walk.accepted = 0.0, 0.0, 0, 0
    walk.pruned, walk.valid, walk.start_error, walk.closing = 0, 0, np.inf, 0
    for j in range(n):
        walk.trial[j] = starts[0, j]


@branch
def begin_frame(walk, problem, n):
    """The trial opens a frame; the ball is centred there unless the caller moves it."""
    walk.fresh, walk.closing, walk.tries = 1, 0, 0
    walk.damping, walk.model = SMALLEST_DAMPING, NEWTON if problem.second_order == 1 else GAUSS
    for j in range(n):
        walk.previous[j] = walk.trial[j]


@branch
def keep_start(walk, value, limit):
    """Insert the start pose at hand into the best few, stable for equal values."""
    place = walk.kept_count if walk.kept_count < limit else limit
    while place > 0 and value < walk.kept_value[place - 1]:
        if place < limit:
            walk.kept[place], walk.kept_value[place] = walk.kept[place - 1], walk.kept_value[place - 1]
        place -= 1
    if place < limit:
        walk.kept[place], walk.kept_value[place] = walk.k, value
        walk.kept_count = min(walk.kept_count + 1, limit)


@branch
def keep_finalist(walk, n, limit):
    """Insert the outcome of a descent into the best few, unless the same pose is among them."""
    for i in range(walk.final_count):
        distance = 0.0
        for j in range(n):
            distance += (walk.final_q[i, j] - walk.q[j]) ** 2
        if distance < SAME_POSE * SAME_POSE:
            if not walk.value < walk.final_value[i]:
                return
            walk.final_count -= 1  # the better one takes its place below
            for k in range(i, walk.final_count):
                walk.final_value[k] = walk.final_value[k + 1]
                for j in range(n):
                    walk.final_q[k, j] = walk.final_q[k + 1, j]
            break
    place = walk.final_count if walk.final_count < limit else limit
    while place > 0 and walk.value < walk.final_value[place - 1]:
        if place < limit:
            walk.final_value[place] = walk.final_value[place - 1]
            for j in range(n):
                walk.final_q[place, j] = walk.final_q[place - 1, j]
        place -= 1
    if place < limit:
        walk.final_value[place] = walk.value
        for j in range(n):
            walk.final_q[place, j] = walk.q[j]
        walk.final_count = min(walk.final_count + 1, limit)


@leaf
def compose(step, frame, attitude, n, model, stiffness):
    """Model of the whole objective: the position part plus stiffness |rho + K x|^2 / 2."""
    for i in range(n):
        step.gradient[i] = frame.slope[i]
        for j in range(i + 1):
            step.matrix[i, j] = frame.newton[i, j] if model == NEWTON else frame.gauss[i, j]
    if stiffness > 0.0:
        K, rho = attitude.K, attitude.base_rho
        for i in range(n):
            step.gradient[i] += stiffness * (K[i, 0] * rho[0] + K[i, 1] * rho[1] + K[i, 2] * rho[2])
            for j in range(i + 1):
                step.matrix[i, j] += stiffness * (K[i, 0] * K[j, 0] + K[i, 1] * K[j, 1] + K[i, 2] * K[j, 2])


@leaf
def error_after(attitude, move, n):
    """e_R the linear model expects behind a move, |rho + K x|."""
    x, y, z = attitude.base_rho[0], attitude.base_rho[1], attitude.base_rho[2]
    for j in range(n):
        x += attitude.K[j, 0] * move[j]
        y += attitude.K[j, 1] * move[j]
        z += attitude.K[j, 2] * move[j]
    return np.sqrt(x * x + y * y + z * z)


@branch
def solve_model(step, frame, attitude, walk, problem, n, radius, mu, w_0):
    """Leave the best step of the present model in ``step.move``; False where the model is not convex.

    With orientation the model is the position part plus w_0 |rho + K x|, a norm with a kink where the orientation is
    met. That is first tried to be the answer (a stiff square); where it costs more than w_0 per radian, the norm is
    reweighted with the error it leads to.
    """
    if w_0 == 0.0:
        compose(step, frame, attitude, n, walk.model, 0.0)
        return propose(step, n, walk.q, walk.previous, radius, problem.lower, problem.upper, mu)
    if attitude.base_error < KINK_RANGE:
        compose(step, frame, attitude, n, walk.model, w_0 / KINK)
        if not propose(step, n, walk.q, walk.previous, radius, problem.lower, problem.upper, mu):
            return False
        if error_after(attitude, step.move, n) <= KINK:
            return True
    error = attitude.base_error
    for _ in range(3):
        compose(step, frame, attitude, n, walk.model, w_0 / max(error, KINK))
        if not propose(step, n, walk.q, walk.previous, radius, problem.lower, problem.upper, mu):
            return False
        error = error_after(attitude, step.move, n)
    return True


@leaf
def predicted_decrease(step, frame, attitude, walk, n, w_0):
    """How much the model says the objective falls with ``step.move``."""
    multiply(frame.newton if walk.model == NEWTON else frame.gauss, step.move, step.work, n)
    total = 0.0
    for i in range(n):
        total -= (frame.slope[i] + 0.5 * step.work[i]) * step.move[i]
    if w_0 > 0.0:
        total += w_0 * (attitude.base_error - error_after(attitude, step.move, n))
    return total


@leaf
def out_of_the_race(walk, problem):
    """Whether a descent will hardly come among the best few: it needs far more than its next step promises."""
    if walk.tries < RACE_FROM or walk.final_count < problem.finalists:
        return False
    return walk.value - RACE * walk.predicted > walk.final_value[problem.finalists - 1]


@branch
def propose_trial(step, frame, attitude, walk, problem, n, w_0, m):
    """Propose the next trial from the model at q. Returns False where the frame counts as solved."""
    radius = problem.radius if walk.phase == FOLLOW else TRUST
    tolerance = max(problem.tolerance, ROUGH) if walk.phase == DESCEND else problem.tolerance
    trace = 0.0
    for j in range(n):
        trace += frame.gauss[j, j]
        if walk.phase != FOLLOW:
            walk.previous[j] = walk.q[j]
    while True:
        mu = walk.damping * (trace / n + 1e-12)
        if solve_model(step, frame, attitude, walk, problem, n, radius, mu, w_0):
            break
        if walk.model == NEWTON:
            walk.model = GAUSS
        elif walk.damping > 1e6:
            return False
        else:
            walk.damping *= 10.0
    walk.predicted = predicted_decrease(step, frame, attitude, walk, n, w_0)
    gain = walk.predicted
    if w_0 == 0.0:
        gain = walk.g - np.sqrt(max(2.0 * (walk.value - walk.predicted), 0.0)) / m
    if not gain > max(tolerance * walk.g, problem.floor):
        return False
    if walk.phase == DESCEND and out_of_the_race(walk, problem):
        return False
    for j in range(n):
        walk.trial[j] = min(max(walk.q[j] + step.move[j], problem.lower[j]), problem.upper[j])
    return True


@leaf
def judge(frame, walk, problem, n):
    """Accept or reject the trial just evaluated, and set damping and model for the next one."""
    walk.tries += 1
    walk.steps += 1
    if walk.fresh == 0 and not frame.value < walk.value:
        walk.damping = max(10.0 * walk.damping, 1e-3)
        walk.model = GAUSS
        return False
    if walk.fresh == 0:
        ratio = (walk.value - frame.value) / walk.predicted
        if ratio > 0.5:
            walk.damping = max(0.1 * walk.damping, SMALLEST_DAMPING)
        elif ratio < 0.1:
            walk.damping = max(4.0 * walk.damping, 1e-4)
        walk.model = NEWTON if problem.second_order == 1 else GAUSS
        walk.accepted += 1
    walk.fresh, walk.value, walk.g = 0, frame.value, frame.g
    for j in range(n):
        walk.q[j] = walk.trial[j]
    return True


@branch
def book(walk, frame, match, attitude, chain, points, problem, trace, n, w_0):
    """Add the frame at the present poses to the sums, and to the trace where one is kept."""
    area = frame_area(chain, match, points, problem.delta)
    walk.f_sum += frame.g
    walk.E_sum += area
    if len(trace) > 0:
        row = trace[walk.t]
        for j in range(n):
            row.q[j] = walk.trial[j]
        row.g, row.area = frame.g, area
        row.orientation_error = attitude.error if w_0 > 0.0 else 0.0
        for i in range(len(points)):
            row.sigma[i] = (chain.arc[match.segment[i]] + match.along[i]) / chain.length
            row.distance[i] = match.distance[i]


@branch
def over(walk, problem, frames):
    """Whether the walk ends behind the frame just booked: the last one, or the sum is past the cutoff.

    The fitness is a mean of terms >= 0, so a partial sum beyond the cutoff settles it (method section 7).
    """
    walk.t += 1
    if walk.t == frames:
        walk.phase = DONE
        return True
    partial = (problem.lambda_f * walk.f_sum + problem.lambda_E * walk.E_sum) / frames
    if partial > walk.cutoff * (1.0 + 1e-12):
        walk.phase, walk.pruned = DONE, 1
        return True
    return False


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


@branch
def next_start(walk, problem, starts, n):
    """Go to the next start pose to be solved from, or to the best one found; without one the walk is over."""
    walk.start_steps = walk.steps
    if walk.phase in (SAMPLE, DESCEND) and walk.k < walk.kept_count:
        for j in range(n):
            walk.trial[j] = starts[walk.kept[walk.k], j]
        walk.phase = DESCEND
    elif walk.phase == DESCEND or walk.k < walk.final_count:
        walk.k = 0 if walk.phase == DESCEND else walk.k
        for j in range(n):
            walk.trial[j] = walk.final_q[walk.k, j]
        walk.phase = POLISH
    elif walk.best_g < np.inf:
        for j in range(n):
            walk.trial[j] = walk.best_q[j]
        walk.phase, walk.valid = OPEN, 1
    else:
        walk.phase = DONE
    begin_frame(walk, problem, n)


@entry
def advance(
    walks, chains, frames, attitudes, motions, matches, steps, problems, P, R, starts, poses, jacobian, q, traces
):
    """Judge the trial of every arm of the block and propose the next one.

    Args:
        walks: WALK records, shape (B,).
        chains: CHAIN records, shape (B,).
        frames: FRAME records, shape (B,).
        attitudes: ATTITUDE records, shape (B,).
        motions: One MOTION record, shape (1,); this and the next two are scratch all arms share.
        matches: One MATCH record, shape (1,).
        steps: One STEP record, shape (1,).
        problems: One PROBLEM record, shape (1,).
        P: Points, shape (T, m, 3) [m].
        R: Hand rotations, shape (T, 3, 3), or (1, 3, 3) where they do not count.
        starts: Start poses, shape (K, n) [rad].
        poses: Joint poses of the block at q, shape (B n, 12).
        jacobian: World Jacobian of the block at q, shape (B n, 6).
        q: Joint angles of the block, shape (B n,); overwritten with the next trials.
        traces: TRACE records, shape (B, T), or (B, 0) where none are kept.

    Returns:
        Number of arms that are done.
    """
    problem = problems[0]
    done = 0
    for b in range(len(walks)):
        walk = walks[b]
        if walk.phase == IDLE:
            continue
        if walk.phase != DONE:
            n = chains[b].dof
            update_skeleton(chains[b], poses, b * n)
            advance_arm(
                walk, chains[b], frames[b], attitudes[b], motions[0], matches[0], steps[0], problem, P, R, starts,
                jacobian, b * n, traces[b],
            )  # fmt: skip
            for j in range(n):
                q[b * n + j] = walk.trial[j]
        if walk.phase == DONE:
            done += 1
    return done


@branch
def advance_arm(walk, chain, frame, attitude, motion, match, step, problem, P, R, starts, jacobian, first, trace):
    """One evaluation of one arm; more than one only where the next frame opens at the same pose."""
    n, m = chain.dof, P.shape[1]
    while True:
        phase = walk.phase
        points, target = P[walk.t], R[min(walk.t, len(R) - 1)]
        starting = phase in (SAMPLE, DESCEND, POLISH)
        w_0 = 0.0 if starting and problem.mount == MOUNT_START else problem.w_0
        if (starting or phase == OPEN) and problem.w_0 > 0.0:
            set_mount(attitude, chain, target, MOUNT_IDENTITY if starting else problem.mount)
        weights = problem.weights[:m]
        if phase == POLISH:
            weights = problem.held_weights[:m]
        elif starting:
            weights = problem.drawn_weights[:m]
        evaluate_frame(frame, match, attitude, chain, points, target, weights, problem.free, w_0, problem.metric)
        if phase == SAMPLE:
            walk.steps += 1
            keep_start(walk, frame.value, problem.descents)
            walk.k += 1
            if walk.k < len(starts):
                for j in range(n):
                    walk.trial[j] = starts[walk.k, j]
            else:
                walk.k = 0
                next_start(walk, problem, starts, n)
            return
        if phase in (DESCEND, POLISH, FOLLOW):
            if walk.closing == 0:
                moved = judge(frame, walk, problem, n)
                if moved:
                    differentiate_frame(
                        frame, motion, match, attitude, chain, jacobian, first, weights, w_0, problem.metric
                    )
                if walk.tries < problem.max_steps and propose_trial(step, frame, attitude, walk, problem, n, w_0, m):
                    return
                if not moved:  # the poses are those of a rejected trial: go back once
                    walk.closing = 1
                    for j in range(n):
                        walk.trial[j] = walk.q[j]
                    return
            for j in range(n):
                walk.trial[j] = walk.q[j]
        if phase == DESCEND:
            keep_finalist(walk, n, problem.finalists)
            walk.k += 1
            next_start(walk, problem, starts, n)
            return
        if phase == POLISH:
            error = tip_error(chain, points[m - 1])
            if error <= problem.reach:
                evaluate_frame(
                    frame, match, attitude, chain, points, target, problem.weights[:m], problem.free, w_0,
                    problem.metric,
                )  # fmt: skip
                if frame.g < walk.best_g * TIE:  # of equally good starts the first one, whatever the last bit
                    walk.best_g, walk.start_error = frame.g, error
                    for j in range(n):
                        walk.best_q[j] = walk.q[j]
            elif walk.best_g == np.inf:
                walk.start_error = min(walk.start_error, error)
            walk.k += 1
            next_start(walk, problem, starts, n)
            return
        book(walk, frame, match, attitude, chain, points, problem, trace, n, w_0)
        if over(walk, problem, len(P)):
            return
        if phase == REPLAY:
            for j in range(n):
                walk.trial[j] = trace[walk.t].q[j]
            return
        walk.phase = FOLLOW
        begin_frame(walk, problem, n)


@leaf
def collect(outcome, walk):
    """Keep what counts of a walk that is done."""
    for j in range(MAX_DOF):
        outcome.best_q[j] = walk.best_q[j]
    outcome.t, outcome.start_error, outcome.f_sum, outcome.E_sum = walk.t, walk.start_error, walk.f_sum, walk.E_sum
    outcome.steps, outcome.start_steps, outcome.accepted = walk.steps, walk.start_steps, walk.accepted
    outcome.pruned, outcome.valid, outcome.done = walk.pruned, walk.valid, 1


@entry
def exchange(walks, chains, placements, q, problems, starts, rows, yaws, cutoffs, outcome, cursor):
    """Collect finished walks and give their places to the next candidates. Returns the index of the next one."""
    for b in range(len(walks)):
        if walks[b].phase == DONE:
            collect(outcome[walks[b].candidate], walks[b])
            walks[b].phase = IDLE
        if walks[b].phase == IDLE and cursor < len(rows):
            n = rows.shape[1] - 1
            hang_arm(chains[b], placements, b * n, rows[cursor], yaws[cursor])
            begin_walk(walks[b], problems[0], n, starts, cutoffs[cursor], cursor)
            for j in range(n):
                q[b * n + j] = walks[b].trial[j]
            cursor += 1
    return cursor
