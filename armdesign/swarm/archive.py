"""The basins a search has found, best first, each counted once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.swarm import saved

RADIUS = 0.15
"""Places nearer than this in canonical unit coordinates are one basin."""
ROOM = 60

Canonical = Callable[[Array], Array]
"""Unit coordinates in a form that is the same for equal designs, shape (N, K) -> (N, K)."""


class Archive:
    """Places with their fitness, the better one of every two that lie together.

    Attributes:
        U: Unit coordinates, best first, shape (A, K).
        value: Fitness, shape (A,).
        hint: Hints, shape (A, H).
    """

    def __init__(self, dimension: int, canonical: Canonical) -> None:
        """Empty.

        Args:
            dimension: Number of unit coordinates K.
            canonical: What makes equal designs equal.
        """
        self.canonical = canonical
        self.U, self.value, self.hint = np.zeros((0, dimension)), np.zeros(0), np.zeros((0, 0))

    def __len__(self) -> int:
        return len(self.value)

    @property
    def best(self) -> float:
        """The best fitness, +inf where the archive is empty."""
        return float(self.value[0]) if len(self) else np.inf

    def rank_value(self, rank: int) -> float:
        """Fitness of the basin of that rank, of the last one where there are fewer, +inf where there is none."""
        return float(self.value[min(rank, len(self) - 1)]) if len(self) else np.inf

    def add(self, U: Array, value: Array, hint: Array) -> None:
        """Take in places with a finite fitness; of those that lie together the best stays.

        Args:
            U: Unit coordinates, shape (N, K).
            value: Fitness, shape (N,).
            hint: Hints, shape (N, H).
        """
        new = np.isfinite(value)
        known = self.hint if len(self) else np.zeros((0, hint.shape[1]))
        U, value, hint = np.vstack([self.U, U[new]]), np.r_[self.value, value[new]], np.vstack([known, hint[new]])
        order = np.argsort(value, kind="stable")
        kept = [int(order[k]) for k in apart(self.canonical(U[order]), RADIUS, ROOM)]
        self.U, self.value, self.hint = U[kept], value[kept], hint[kept]

    def emptied(self) -> Archive:
        """An empty one that tells basins apart in the same way."""
        return Archive(self.U.shape[1], self.canonical)

    def take(self, other: Archive) -> None:
        """Take in what another archive holds."""
        if len(other):
            self.add(other.U, other.value, other.hint)

    def state(self, prefix: str) -> dict[str, Any]:
        """Arrays to carry on from."""
        return {f"{prefix}_{name}": getattr(self, name).copy() for name in ("U", "value", "hint")}

    def restore(self, state: Mapping[str, Any], prefix: str) -> None:
        """Set what :meth:`state` described."""
        self.U = saved.array(state, f"{prefix}_U", (None, self.U.shape[1]))
        self.value = saved.array(state, f"{prefix}_value", (len(self.U),))
        self.hint = saved.hints(state, f"{prefix}_hint", len(self.U))


def apart(places: Array, radius: float, most: int) -> list[int]:
    """Indices of places that lie apart, going down the list: each is farther than the radius from all before it.

    Args:
        places: Best first, shape (N, K).
        radius: Smallest distance.
        most: Largest number of them.
    """
    kept: list[int] = []
    for k, place in enumerate(places):
        if len(kept) == most:
            break
        if not kept or float(np.linalg.norm(places[kept] - place, axis=1).min()) > radius:
            kept.append(k)
    return kept
