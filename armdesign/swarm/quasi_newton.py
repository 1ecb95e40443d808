"""The model of a descent: a quadratic with a curvature learned from gradients, minimised in a box and a slab."""

from __future__ import annotations

import numpy as np

from armdesign._types import Array
from armdesign.swarm.region import Region, project

ROUNDS = 80
"""Rounds of accelerated projected gradients spent on a step."""
DAMPED = 0.2
"""Share of the known curvature below which a change is damped (Powell 1978)."""


def updated(B: Array, step: Array, change: Array, *, first: bool) -> Array:
    """Curvature after a step, by the damped BFGS formula (Powell 1978): it stays positive definite.

    Args:
        B: Curvature so far, shape (K, K).
        step: The step taken, shape (K,).
        change: Change of the gradient along it, shape (K,).
        first: Whether B is only a guess, to be scaled first to the curvature just seen.
    """
    along = float(step @ change)
    if first and along > 0.0:
        B = np.eye(len(step)) * (float(change @ change) / along)
    image = B @ step
    bent = float(step @ image)
    if along < DAMPED * bent:
        # the change is mixed with what B expects, until it shows at least that share of its curvature
        part = (1.0 - DAMPED) * bent / (bent - along)
        change = part * change + (1.0 - part) * image
    # BFGS: B s = y afterwards
    return np.asarray(B - np.outer(image, image) / bent + np.outer(change, change) / float(step @ change))


def best_steps(region: Region, U: Array, gradient: Array, B: Array, reach: Array, margin: float) -> Array:
    """Minimise g p + p B p / 2 over |p|_inf <= reach with U + p in the region, row by row.

    Accelerated projected gradients; the rows go side by side.

    Args:
        region: Box and slab.
        U: Where the steps begin, shape (N, K).
        gradient: g, shape (N, K).
        B: Curvatures, positive definite, shape (N, K, K).
        reach: Largest step in any entry, shape (N,).
        margin: How far the steps stay inside the slab.

    Returns:
        The steps, shape (N, K).
    """
    total = U @ region.weights
    lower, upper = np.maximum(-U, -reach[:, None]), np.minimum(1.0 - U, reach[:, None])
    slab = region.weights, region.low + margin - total, region.high - margin - total
    stiff = np.linalg.norm(B, axis=(1, 2))[:, None] + 1e-12  # the Frobenius norm bounds the largest eigenvalue
    P = ahead = np.zeros_like(U)
    t = 1.0
    for _ in range(ROUNDS):
        slope = gradient + (B @ ahead[:, :, None])[:, :, 0]
        P_next = project(ahead - slope / stiff, lower, upper, *slab)
        # Nesterov's momentum: t grows by about 1/2 a round
        t_next = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * t * t))
        ahead = P_next + (t - 1.0) / t_next * (P_next - P)
        P, t = P_next, t_next
    return P
