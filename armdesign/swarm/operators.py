"""The moves of the swarms as plain functions of positions, velocities and a generator.

N particles, D entries. Every function leaves its inputs alone and documents what it draws, in order.
"""

from __future__ import annotations

import numpy as np

from armdesign._types import Array
from armdesign.swarm.space import Box, Mask


def uniform(rng: np.random.Generator, box: Box, count: int) -> Array:
    """Positions drawn uniformly in the box; draws count x D numbers, row by row.

    Returns:
        Positions, shape (count, D).
    """
    return box.clip(box.lower + rng.random((count, box.dimension)) * box.width)


def attract(
    rng: np.random.Generator, X: Array, V: Array, bp: Array, gb: Array, *, w: float, c1: float, c2: float
) -> Array:
    """Velocities of eq. 7: v <- w v + beta1 c1 (bp - x) + beta2 c2 (gb - x).

    Draws beta1 of every particle, then beta2 of every particle, uniform in [0, 1).

    Args:
        rng: Source of the draws.
        X: Positions, shape (N, D).
        V: Velocities, shape (N, D).
        bp: Personal best positions, shape (N, D).
        gb: Global best position, shape (D,).
        w: Inertia.
        c1: Pull of the personal best.
        c2: Pull of the global best.

    Returns:
        New velocities, shape (N, D).
    """
    beta1, beta2 = rng.random((2, len(X), 1))
    return np.asarray(w * V + beta1 * c1 * (bp - X) + beta2 * c2 * (gb - X))  # eq. 7


def wander(rng: np.random.Generator, V: Array, reach: Array, c_min: float, c_max: float) -> Array:
    """Velocities of eq. 8: v <- v + U(c_min, c_max) range, with a draw for every entry.

    Draws len(V) x D numbers, row by row.

    Args:
        rng: Source of the draws.
        V: Velocities, shape (K, D).
        reach: The `range` of every entry, shape (D,).
        c_min: Lower bound of the factor.
        c_max: Upper bound of the factor.

    Returns:
        New velocities, shape (K, D).
    """
    return np.asarray(V + rng.uniform(c_min, c_max, V.shape) * reach)  # eq. 8


def extent(X: Array, among: Mask) -> Array:
    """Largest minus smallest value of every entry over the chosen particles, shape (D,).

    One particle alone has no extent: zeros.

    Args:
        X: Positions, shape (N, D).
        among: The particles to look at, shape (N,); at least one.
    """
    chosen = X[among]
    return np.asarray(chosen.max(axis=0) - chosen.min(axis=0))
