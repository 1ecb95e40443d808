"""Damped least squares with joint limits and a ball as part of the step.

One step minimises the model m(x) = g.x + x.H x / 2 over the joint displacement x, subject to

    lower <= q + x <= upper          (joint limits, by an active set)
    |q + x - q_previous| <= radius   (continuity, by its multiplier; eq. 4)

with damping mu on the diagonal of H. Clipping a step that was computed without the limits stalls on fast recordings;
here the remaining joints make up for what a limit or the ball takes away.
"""

from __future__ import annotations

import numpy as np

from armdesign.compilation import branch, leaf
from armdesign.kinematics.skeleton import MAX_DOF

STEP = np.dtype(
    [
        ("gradient", np.float64, MAX_DOF),
        ("matrix", np.float64, (MAX_DOF, MAX_DOF)),  # second-derivative model H, lower triangle
        ("factor", np.float64, (MAX_DOF, MAX_DOF)),  # Cholesky factor of the damped free part, inverse diagonal
        ("move", np.float64, MAX_DOF),  # the step x
        ("work", np.float64, MAX_DOF),  # right-hand side, then intermediate results; 0 where held
        ("reach", np.float64, MAX_DOF),  # q + x - q_previous; 0 where held
        ("held", np.int64, MAX_DOF),  # 1 where a joint is held at a limit
    ]
)
"""Scratch of one step; one record an arm."""

ROUNDING = 1.0 - 1e-12


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
def propose(step, n, q, previous, radius, lower, upper, mu):
    """Minimise the damped model inside the limits and the ball; the step is left in ``step.move``.

    Args:
        step: Record of type STEP with gradient and matrix set.
        n: Number of joints.
        q: Present joint angles, inside the limits and the ball [rad].
        previous: Centre of the ball [rad].
        radius: Radius of the ball; infinite for none [rad].
        lower: Lower limits [rad].
        upper: Upper limits [rad].
        mu: Damping, positive.

    Returns:
        Whether matrix + mu I is positive definite on the free joints; without that there is no step.
    """
    for j in range(n):
        pinned_low = q[j] <= lower[j] and step.gradient[j] > 0.0
        pinned_high = q[j] >= upper[j] and step.gradient[j] < 0.0
        step.held[j] = 1 if pinned_low or pinned_high or lower[j] == upper[j] else 0
        step.move[j] = 0.0
    released = False
    for _ in range(2 * n + 2):
        if not solve_free(step, n, q, previous, radius, mu):
            return False
        if hold_violators(step, n, q, lower, upper):
            continue
        if released or not release_pulled_back(step, n, q, lower, upper):
            return True
        released = True
    return True


@branch
def release_pulled_back(step, n, q, lower, upper):
    """Free joints that the model, at the step found, pulls off the limit they are held at."""
    if not any_held(step, n):
        return False
    multiply(step.matrix, step.move, step.work, n)
    found = False
    for j in range(n):
        if step.held[j] == 1 and lower[j] < upper[j]:
            slope = step.gradient[j] + step.work[j]
            at_low = q[j] + step.move[j] <= lower[j]
            if (at_low and slope < 0.0) or (not at_low and slope > 0.0):
                step.held[j] = 0
                found = True
    return found


@branch
def any_held(step, n):
    """Whether any joint is held at a limit."""
    count = 0
    for j in range(n):
        count += step.held[j]
    return count > 0


@branch
def hold_violators(step, n, q, lower, upper):
    """Stop joints that overstep a limit there and hold them. Returns whether there were any."""
    found = False
    for j in range(n):
        if step.held[j] == 0 and not lower[j] <= q[j] + step.move[j] <= upper[j]:
            step.move[j] = (lower[j] if q[j] + step.move[j] < lower[j] else upper[j]) - q[j]
            step.held[j] = 1
            found = True
    return found


@branch
def solve_free(step, n, q, previous, radius, mu):
    """Minimise over the free joints with the held ones where they are, inside the ball.

    With p = q - q_previous the constrained minimiser is y - p, y = (H + (mu + nu) I)^-1 ((H + mu I) p - g), and the
    multiplier nu >= 0 solves |y| = radius: Newton's method on 1 / |y| - 1 / radius, which converges from below.
    """
    if not factorise(step, n, mu):
        return False
    add_held(step, n)
    solve_lower(step.factor, step.work, n)
    solve_upper(step.factor, step.work, n)
    used, free = 0.0, 0.0
    for j in range(n):
        if step.held[j] == 1:
            used += (q[j] + step.move[j] - previous[j]) ** 2
        else:
            step.move[j] = step.work[j]
            free += (q[j] + step.move[j] - previous[j]) ** 2
    if free + used <= radius * radius:
        return True
    return land_on_ball(step, n, q, previous, np.sqrt(max(radius * radius - used, 0.0)) * ROUNDING, mu)


@branch
def add_held(step, n):
    """Work = minus the gradient of the model for the free joints with the held ones moved; 0 for the held."""
    for j in range(n):
        step.work[j] = -step.gradient[j]
    for k in range(n):
        if step.held[k] == 1:
            for j in range(n):
                step.work[j] -= step.matrix[max(j, k), min(j, k)] * step.move[k]
    for j in range(n):
        if step.held[j] == 1:
            step.work[j] = 0.0


@branch
def land_on_ball(step, n, q, previous, room, mu):
    """The free joints' part of the step when the ball binds: find the multiplier nu."""
    for j in range(n):
        step.reach[j] = 0.0 if step.held[j] == 1 else q[j] + step.move[j] - previous[j]
    nu = 0.0
    for _ in range(20):
        norm = np.sqrt(squared_norm(step.reach, n))
        if norm <= room * (1.0 + 1e-9) or norm == 0.0:
            break
        for j in range(n):
            step.work[j] = step.reach[j]
        solve_lower(step.factor, step.work, n)
        nu += norm * norm / squared_norm(step.work, n) * (norm - room) / max(room, 1e-12)
        if not factorise(step, n, mu + nu):
            return False
        pull_to_centre(step, n, q, previous, mu)
        solve_lower(step.factor, step.reach, n)
        solve_upper(step.factor, step.reach, n)
    norm = np.sqrt(squared_norm(step.reach, n))
    shrink = min(1.0, room / norm) if norm > 0.0 else 1.0
    for j in range(n):
        if step.held[j] == 0:
            step.move[j] = shrink * step.reach[j] - (q[j] - previous[j])
    return True


@branch
def pull_to_centre(step, n, q, previous, mu):
    """Reach = (H + mu I) p - g for the free joints, with p = q - q_previous; 0 for the held."""
    add_held(step, n)
    for j in range(n):
        step.reach[j] = step.work[j] + mu * (q[j] - previous[j])
        for k in range(n):
            if step.held[k] == 0:
                step.reach[j] += step.matrix[max(j, k), min(j, k)] * (q[k] - previous[k])
    for j in range(n):
        if step.held[j] == 1:
            step.reach[j] = 0.0
