"""One damped least squares step: the model of the objective, the trial it proposes, and what comes of it."""

from __future__ import annotations

import numpy as np

from armdesign.fitness.kernels.solver_state import DESCEND, FOLLOW, GAUSS, NEWTON, SMALLEST_DAMPING
from armdesign.kinematics.compilation import branch, leaf
from armdesign.kinematics.kernels.dls import Region, multiply, propose

KINK = 1e-7  # e_R below which the orientation counts as met [rad]
KINK_RANGE = 0.3  # e_R below which meeting it in one step is tried [rad]
ROUGH = 1e-3  # tolerance of the descents
BEHIND_FROM, BEHIND = 3, 3.0  # a descent is given up if, after so many steps, it needs so many times its next gain
TRUST = 1.0  # longest step of a start pose [rad]


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
def solve_model(arm, step, problem, radius, mu, w_0):
    """Leave the best step of the present model in ``step.move``; False where the model is not convex.

    With orientation the model is the position part plus w_0 |rho + K x|, a norm with a kink where the orientation is
    met. That is first tried to be the answer (a stiff square); where it costs more than w_0 per radian, the norm is
    reweighted with the error it leads to.
    """
    state, frame, attitude, n = arm.state, arm.frame, arm.attitude, arm.chain.dof
    region = Region(state.q, state.previous, radius, problem.lower, problem.upper)
    if w_0 == 0.0:
        compose(step, frame, attitude, n, state.model, 0.0)
        return propose(step, n, region, mu)
    if attitude.base_error < KINK_RANGE:
        compose(step, frame, attitude, n, state.model, w_0 / KINK)
        if not propose(step, n, region, mu):
            return False
        if error_after(attitude, step.move, n) <= KINK:
            return True
    error = attitude.base_error
    for _ in range(3):
        compose(step, frame, attitude, n, state.model, w_0 / max(error, KINK))
        if not propose(step, n, region, mu):
            return False
        error = error_after(attitude, step.move, n)
    return True


@leaf
def predicted_decrease(arm, step, w_0):
    """How much the model says the objective falls with ``step.move``."""
    frame, attitude, n = arm.frame, arm.attitude, arm.chain.dof
    multiply(frame.newton if arm.state.model == NEWTON else frame.gauss, step.move, step.work, n)
    total = 0.0
    for i in range(n):
        total -= (frame.slope[i] + 0.5 * step.work[i]) * step.move[i]
    if w_0 > 0.0:
        total += w_0 * (attitude.base_error - error_after(attitude, step.move, n))
    return total


@leaf
def falls_behind(state, problem):
    """Whether a descent will hardly come among the best few: it needs far more than its next step promises."""
    if state.tries < BEHIND_FROM or state.final_count < problem.finalists:
        return False
    return state.value - BEHIND * state.predicted > state.final_value[problem.finalists - 1]


@branch
def propose_trial(arm, step, problem, w_0, m):
    """Propose the next trial from the model at q. Returns False where the frame counts as solved."""
    state, frame, n = arm.state, arm.frame, arm.chain.dof
    radius = problem.radius if state.phase == FOLLOW else TRUST
    tolerance = max(problem.tolerance, ROUGH) if state.phase == DESCEND else problem.tolerance
    trace = 0.0
    for j in range(n):
        trace += frame.gauss[j, j]
        if state.phase != FOLLOW:
            state.previous[j] = state.q[j]
    while True:
        mu = state.damping * (trace / n + 1e-12)
        if solve_model(arm, step, problem, radius, mu, w_0):
            break
        if state.model == NEWTON:
            state.model = GAUSS
        elif state.damping > 1e6:
            return False
        else:
            state.damping *= 10.0
    state.predicted = predicted_decrease(arm, step, w_0)
    gain = state.predicted
    if w_0 == 0.0:
        # S / 2 is minimised, but the tolerance is one of g = sqrt(S) / m
        gain = state.g - np.sqrt(max(2.0 * (state.value - state.predicted), 0.0)) / m
    if not gain > max(tolerance * state.g, problem.floor):
        return False
    if state.phase == DESCEND and falls_behind(state, problem):
        return False
    for j in range(n):
        state.trial[j] = min(max(state.q[j] + step.move[j], problem.lower[j]), problem.upper[j])
    return True


@leaf
def judge(frame, state, problem, n):
    """Accept or reject the trial just evaluated, and set damping and model for the next one."""
    state.tries += 1
    state.steps += 1
    # Levenberg-Marquardt: damping follows the ratio of the actual to the predicted decrease
    if state.fresh == 0 and not frame.value < state.value:
        state.damping = max(10.0 * state.damping, 1e-3)
        state.model = GAUSS
        return False
    if state.fresh == 0:
        ratio = (state.value - frame.value) / state.predicted
        if ratio > 0.5:
            state.damping = max(0.1 * state.damping, SMALLEST_DAMPING)
        elif ratio < 0.1:
            state.damping = max(4.0 * state.damping, 1e-4)
        state.model = NEWTON if problem.second_order == 1 else GAUSS
        state.accepted += 1
    state.fresh, state.value, state.g = 0, frame.value, frame.g
    for j in range(n):
        state.q[j] = state.trial[j]
    return True
