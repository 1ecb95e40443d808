"""Damped least squares with joint limits and a ball as part of the step.

One step minimises the model m(x) = g.x + x.H x / 2 over the joint displacement x, subject to

    lower <= q + x <= upper          (joint limits, by an active set)
    |q + x - q_previous| <= radius   (continuity, by its multiplier; eq. 4)

with damping mu on the diagonal of H. Clipping a step that was computed without the limits stalls on fast recordings;
here the remaining joints make up for what a limit or the ball takes away.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.kinematics.compilation import branch, leaf
from armdesign.kinematics.kernels.skeleton import MAX_DOF

STEP = np.dtype(
    [
        ("gradient", np.float64, MAX_DOF),
        ("matrix", np.float64, (MAX_DOF, MAX_DOF)),  # second-derivative model H, lower triangle
        ("factor", np.float64, (MAX_DOF, MAX_DOF)),  # Cholesky factor of the damped free part, inverse diagonal
        ("move", np.float64, MAX_DOF),  # the step x
        ("work", np.float64, MAX_DOF),  # right-hand side, then intermediate results; 0 where held
        ("held", np.int64, MAX_DOF),  # 1 where a joint is held at a limit
    ]
)
"""Scratch of one step; one record an arm."""


class Region(NamedTuple):
    """Where a step may lead: within the joint limits and a ball.

    Attributes:
        q: Present joint angles, inside the limits and the ball [rad].
        previous: Centre of the ball, inside the limits [rad].
        radius: Radius of the ball; infinite for none [rad].
        lower: Lower limits [rad].
        upper: Upper limits [rad].
    """

    q: Array
    previous: Array
    radius: float
    lower: Array
    upper: Array


ROUNDING = 1.0 - 1e-12
MULTIPLIER_STEPS = 40


@leaf
def factorise(step, n, shift):
    """Cholesky factor of H + shift I with held joints taken out; False where that is not positive definite."""
    L = step.factor
    for i in range(n):
        for j in range(i):
            total = step.matrix[i, j]
            if step.held[i] == 1 or step.held[j] == 1:
                total = 0.0
            for k in range(j):
                total -= L[i, k] * L[j, k]
            L[i, j] = total * L[j, j]
        total = step.matrix[i, i] + shift
        if step.held[i] == 1:
            total = 1.0
        for k in range(i):
            total -= L[i, k] * L[i, k]
        if not total > 1e-14 * shift:
            return False
        L[i, i] = 1.0 / np.sqrt(total)
    return True


@leaf
def solve_lower(L, x, n):
    """Solve L y = x in place; L holds its inverse diagonal."""
    for i in range(n):
        total = x[i]
        for k in range(i):
            total -= L[i, k] * x[k]
        x[i] = total * L[i, i]


@leaf
def solve_upper(L, x, n):
    """Solve L^T y = x in place; L holds its inverse diagonal."""
    for i in range(n - 1, -1, -1):
        x[i] *= L[i, i]
        for k in range(i):
            x[k] -= L[i, k] * x[i]


@leaf
def multiply(matrix, x, result, n):
    """Result = H x for a symmetric H given by its lower triangle."""
    for i in range(n):
        total = matrix[i, i] * x[i]
        for k in range(i):
            total += matrix[i, k] * x[k]
            result[k] += matrix[i, k] * x[i]
        result[i] = total


@leaf
def squared_norm(x, n):
    """Sum of squares of the first entries of x."""
    total = 0.0
    for i in range(n):
        total += x[i] * x[i]
    return total


@branch
def propose(step, n, region, mu):
    """Minimise the damped model inside the limits and the ball; the step is left in ``step.move``.

    The ball enters by its multiplier nu >= 0: x(nu) minimises m(x) + mu |x|^2 / 2 + nu |p + x|^2 / 2 inside the limits,
    with p = q - q_previous, and |p + x(nu)| falls with nu until it meets the radius. Newton's method on
    1 / |p + x| - 1 / radius, between brackets, as the active limits may change on the way.

    Args:
        step: Record of type STEP with gradient and matrix set.
        n: Number of joints.
        region: Joint limits and ball.
        mu: Damping, positive.

    Returns:
        Whether matrix + mu I is positive definite on the free joints; without that there is no step.
    """
    q, previous, radius, lower, upper = region.q, region.previous, region.radius, region.lower, region.upper
    for j in range(n):
        pinned_low = q[j] <= lower[j] and step.gradient[j] > 0.0
        pinned_high = q[j] >= upper[j] and step.gradient[j] < 0.0
        step.held[j] = 1 if pinned_low or pinned_high or lower[j] == upper[j] else 0
        step.move[j] = 0.0
    if not solve_in_limits(step, n, region, mu, 0.0):
        return False
    norm = distance_moved(step, n, q, previous)
    if norm <= radius:
        return True
    nu, low, high, aim = 0.0, 0.0, np.inf, radius * ROUNDING  # eq. 4: |q_t - q_{t-1}| <= eps holds after rounding, too
    for _ in range(MULTIPLIER_STEPS):
        nu = next_multiplier(step, n, q, previous, norm, aim, nu, low, high)
        if not solve_in_limits(step, n, region, mu, nu):
            return False
        norm = distance_moved(step, n, q, previous)
        if norm > aim:
            low = nu
        else:
            high = nu
        if aim * (1.0 - 1e-10) <= norm <= radius:
            return True
    pull_inside(step, n, q, previous, aim)  # the multiplier has not converged: a feasible step is better than none
    return True


@branch
def pull_inside(step, n, q, previous, radius):
    """Bring the free joints towards the centre of the ball until the step lies in it."""
    held, free = 0.0, 0.0
    for j in range(n):
        square = (q[j] + step.move[j] - previous[j]) ** 2
        if step.held[j] == 1:
            held += square
        else:
            free += square
    if held + free > radius * radius:
        shrink = np.sqrt(max(radius * radius - held, 0.0) / free) if free > 0.0 else 0.0
        for j in range(n):
            if step.held[j] == 0:
                away = q[j] - previous[j]
                step.move[j] = shrink * (away + step.move[j]) - away


@branch
def next_multiplier(step, n, q, previous, norm, radius, nu, low, high):
    """Newton's step for the ball's multiplier, or the middle of its bracket where that leaves it."""
    for j in range(n):
        step.work[j] = 0.0 if step.held[j] == 1 else q[j] + step.move[j] - previous[j]
    solve_lower(step.factor, step.work, n)
    slope = squared_norm(step.work, n)
    guess = nu + norm * norm / slope * (norm - radius) / radius if slope > 0.0 else np.inf
    if low < guess < high:
        return guess
    return 0.5 * (low + high) if high < np.inf else 10.0 * nu + 1e-3


@branch
def distance_moved(step, n, q, previous):
    """Distance of q + x from the centre of the ball."""
    total = 0.0
    for j in range(n):
        total += (q[j] + step.move[j] - previous[j]) ** 2
    return np.sqrt(total)


@branch
def solve_in_limits(step, n, region, mu, nu):
    """Minimise (g + nu p).x + x.(H + (mu + nu) I) x / 2 inside the limits, by a primal active set.

    The free joints go towards their minimiser until the first one meets a limit, where it is held; a held joint that
    the model pulls back is released. The search starts at ``step.move`` with the joints in ``step.held``.
    """
    q, previous, lower, upper = region.q, region.previous, region.lower, region.upper
    for _ in range(4 * n + 4):
        if not factorise(step, n, mu + nu):
            return False
        free_target(step, n, q, previous, nu)
        solve_lower(step.factor, step.work, n)
        solve_upper(step.factor, step.work, n)
        if stop_at_limit(step, n, q, lower, upper):
            continue
        held = 0
        for j in range(n):
            held += step.held[j]
        if held == 0 or not release_one(step, n, region, mu, nu):
            break
    return True


@branch
def free_target(step, n, q, previous, nu):
    """Work = right-hand side for the free joints with the held ones where they are; 0 for the held."""
    for j in range(n):
        step.work[j] = -step.gradient[j] - nu * (q[j] - previous[j])
    for k in range(n):
        if step.held[k] == 1:
            for j in range(n):
                step.work[j] -= step.matrix[max(j, k), min(j, k)] * step.move[k]
    for j in range(n):
        if step.held[j] == 1:
            step.work[j] = 0.0


@branch
def stop_at_limit(step, n, q, lower, upper):
    """Go from ``step.move`` towards ``step.work`` up to the first limit; returns whether there was one, now held."""
    share, stopped, limit = 1.0, -1, 0.0
    for j in range(n):
        if step.held[j] == 0:
            target = q[j] + step.work[j]
            bound = min(max(target, lower[j]), upper[j])
            if target != bound:
                reach = (bound - q[j] - step.move[j]) / (step.work[j] - step.move[j])
                if reach < share:
                    share, stopped, limit = max(reach, 0.0), j, bound
    for j in range(n):
        if step.held[j] == 0:
            step.move[j] += share * (step.work[j] - step.move[j])
            if share == 1.0:
                step.move[j] = step.work[j]
    if stopped < 0:
        return False
    step.move[stopped] = limit - q[stopped]
    step.held[stopped] = 1
    return True


@branch
def release_one(step, n, region, mu, nu):
    """Free the held joint that the model pulls off its limit the most; returns whether there is one."""
    q, previous, lower, upper = region.q, region.previous, region.lower, region.upper
    multiply(step.matrix, step.move, step.work, n)
    worst, chosen = 0.0, -1
    for j in range(n):
        if step.held[j] == 1 and lower[j] < upper[j]:
            slope = step.gradient[j] + nu * (q[j] - previous[j]) + step.work[j] + (mu + nu) * step.move[j]
            pull = -slope if q[j] + step.move[j] <= lower[j] else slope
            if pull > worst:
                worst, chosen = pull, j
    if chosen < 0:
        return False
    step.held[chosen] = 0
    return True
