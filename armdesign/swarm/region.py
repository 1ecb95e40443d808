"""Where a many-basin search may go, in unit coordinates: the box, and a slab low < w x < high across it."""

from __future__ import annotations

import numpy as np

from armdesign._types import Array
from armdesign.errors import SettingsError
from armdesign.swarm.space import Box, Slab

ROUNDING = 1e-12
"""By how much a point is drawn inside the slab that was outside, so that rounding leaves it there."""


class Region:
    """The box scaled to [0, 1] in its free entries, and the slab across it.

    Attributes:
        box: The box.
        slab: The slab.
        free: Which entries are free, shape (D,).
        angular: Which of the free ones are angles, shape (K,).
        weights: The slab's weights on unit coordinates, shape (K,).
        low: Lower bound of weights u.
        high: Upper bound of weights u.
    """

    def __init__(self, box: Box, slab: Slab | None = None) -> None:
        """Scale.

        Args:
            box: Bounds of the positions; at least one entry is free.
            slab: The slab; by default all of the box lies in it.
        """
        total = np.zeros(box.dimension)
        self.box = box
        self.slab = Slab(total, -1.0, 1.0) if slab is None else slab
        self.free = box.width > 0.0
        self.angular = box.angular[self.free]
        if not self.free.any():
            raise SettingsError("every entry of the box is fixed", fix="Free one")
        if len(self.slab.weights) != box.dimension:
            raise SettingsError(f"the slab has {len(self.slab.weights)} weights", allowed=box.dimension)
        self.weights = (self.slab.weights * box.width)[self.free]
        offset = float(self.slab.weights @ box.lower)
        self.low, self.high = self.slab.low - offset, self.slab.high - offset

    @property
    def dimension(self) -> int:
        """Number of free entries K."""
        return int(self.free.sum())

    def units(self, X: Array) -> Array:
        """Unit coordinates of positions, shape (N, D) -> (N, K)."""
        return np.asarray(((X - self.box.lower) / np.where(self.free, self.box.width, 1.0))[:, self.free])

    def positions(self, U: Array) -> Array:
        """Positions of unit coordinates, shape (N, K) -> (N, D)."""
        X = np.tile(self.box.lower, (len(U), 1))
        X[:, self.free] += U * self.box.width[self.free]
        return self.box.clip(X)

    def unit_slopes(self, slopes: Array) -> Array:
        """Gradients by unit coordinates from those by positions, shape (N, D) -> (N, K)."""
        return np.asarray((slopes * self.box.width)[:, self.free])

    def pulled_in(self, U: Array, margin: float) -> Array:
        """Unit coordinates clipped to the box, their weighted entries scaled until the slab holds them.

        Args:
            U: Unit coordinates, shape (N, K).
            margin: How far inside the slab they shall come.
        """
        V = np.clip(U, 0.0, 1.0)
        total = V @ self.weights
        wanted = np.clip(total, self.low + margin, self.high - margin)
        factor = np.where(total > 0.0, wanted / np.where(total > 0.0, total, 1.0), 1.0)
        return np.clip(np.where(self.weights > 0.0, V * factor[:, None], V), 0.0, 1.0)


def project(V: Array, lower: Array, upper: Array, weights: Array, low: Array, high: Array) -> Array:
    """The nearest points of lower <= p <= upper, low <= weights p <= high, each row for itself.

    A row whose box misses the slab comes as near as it can.

    Args:
        V: Points, shape (N, K).
        lower: Lower bounds, shape (N, K).
        upper: Upper bounds, shape (N, K).
        weights: Weights of the slab, shape (K,).
        low: Its lower bounds, shape (N,).
        high: Its upper bounds, shape (N,).
    """
    P = np.clip(V, lower, upper)
    total = P @ weights
    for sign, bound, wrong in ((1.0, high, total > high), (-1.0, low, total < low)):
        if wrong.any():
            P[wrong] = _shifted(V[wrong], lower[wrong], upper[wrong], sign * weights, sign * bound[wrong])
    return P


def _shifted(V: Array, lower: Array, upper: Array, weights: Array, bound: Array) -> Array:
    """clip(V - t weights) with the smallest t >= 0 at which weights p <= bound, row by row.

    The sum falls with t in straight pieces between the t at which an entry meets a bound.
    """
    w = weights[weights != 0.0]
    v, low, high = (X[:, weights != 0.0] for X in (V, lower, upper))
    ends = np.sort(np.maximum(np.hstack([np.zeros((len(v), 1)), (v - low) / w, (v - high) / w]), 0.0), axis=1)
    total = np.clip(v[:, None] - ends[:, :, None] * w, low[:, None], high[:, None]) @ w
    rows, last = np.arange(len(v)), ends.shape[1] - 1
    within = total <= bound[:, None]
    right = np.where(within.any(axis=1), np.argmax(within, axis=1), last)
    left = np.maximum(right - 1, 0)
    above, below = total[rows, left], total[rows, right]
    share = np.clip((above - bound + ROUNDING) / np.where(above > below, above - below, 1.0), 0.0, 1.0)
    near, far = (np.clip(V - ends[rows, k][:, None] * weights, lower, upper) for k in (left, right))
    return np.asarray(near + share[:, None] * (far - near))
