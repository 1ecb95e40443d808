"""The basins that a search has found, best first, each counted once; and children of them, to begin descents from."""

from __future__ import annotations

from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.swarm.checks import SavedState
from armdesign.swarm.space import Region

RADIUS = 0.15
"""Places nearer than this in canonical unit coordinates are one basin."""
ROOM = 60
"""Most basins kept."""
SPREADS = (0.03, 0.06, 0.12)
"""Standard deviations of shaken children, in unit coordinates."""
SHORT, SHORTER = 0.5, 0.3
"""Longest length drawn anew, in unit coordinates, and the probability that it is none."""
NOISE = 0.02
"""Standard deviation of the noise on children that are made otherwise, so that no child repeats a parent."""
NEAR, SLIGHT = 3, 0.02
"""How many entries apart lie what a joint and the next one have of a kind; what lets a link of no length be chosen."""
MARGIN = 0.005
"""How far inside the slab children lie, so that descents can begin from them."""
COLUMNS = ("U", "value", "hint", "look", "hits")
"""Columns of an archive, a row for each basin."""


class Archive:
    """Places with their fitness, the better one of every two that lie together.

    Attributes:
        region: What tells equal designs.
        U: Unit coordinates, best first, shape (A, K).
        value: Fitness, shape (A,).
        hint: Hints, shape (A, H).
        look: Fitness as the descents saw it that have ended there, perhaps a coarse one, shape (A,).
        hits: How many places taken in have come to lie there, shape (A,).
    """

    def __init__(self, region: Region) -> None:
        """Begin empty."""
        self.region = region
        self.U, self.value, self.hint = np.zeros((0, region.dimension)), np.zeros(0), np.zeros((0, 0))
        self.look, self.hits = np.zeros(0), np.zeros(0)

    def __len__(self) -> int:
        return len(self.value)

    @property
    def best(self) -> float:
        """The best fitness, +inf where the archive is empty."""
        return float(self.value[0]) if len(self) else np.inf

    def add(self, U: Array, value: Array, hint: Array, look: Array | None = None, hits: Array | None = None) -> None:
        """Take in places with a finite fitness; of those that lie together the best stays.

        Args:
            U: Unit coordinates, shape (N, K).
            value: Fitness, shape (N,).
            hint: Hints, shape (N, H).
            look: Fitness as the descents saw it, shape (N,); by default the fitness.
            hits: How often each counts among those that have met its basin, shape (N,); by default once.
        """
        new = np.isfinite(value)
        if not (new.any() or len(self)):
            return
        known = self.hint if len(self) else np.zeros((0, hint.shape[1]))
        U, hint = np.vstack([self.U, U[new]]), np.vstack([known, hint[new]])
        look = np.r_[self.look, (value if look is None else look)[new]]
        hits = np.r_[self.hits, (np.ones(len(new)) if hits is None else hits)[new]]
        value = np.r_[self.value, value[new]]
        order = np.argsort(value, kind="stable")
        # best first, so that each basin is represented by its best place
        places = self.region.canonical(U[order])
        kept = apart(places, RADIUS, ROOM)
        nearest = np.linalg.norm(places[:, None] - places[kept], axis=2)
        owner = np.argmin(nearest, axis=1)
        owned = nearest[np.arange(len(places)), owner] <= RADIUS
        met = np.bincount(owner[owned], hits[order][owned], len(kept))
        first = order[np.array(kept, dtype=int)]
        self.U, self.value, self.hint, self.look = U[first], value[first], hint[first], look[first]
        self.hits = np.asarray(met, dtype=float)

    def merged(self, other: Archive) -> Archive:
        """A new archive of all that this one and another hold."""
        both = Archive(self.region)
        for name in COLUMNS:
            setattr(both, name, getattr(self, name))
        if len(other):
            both.add(other.U, other.value, other.hint, other.look, other.hits)
        return both

    def best_of(self, count: int, first: int = 0) -> Archive:
        """A new archive of the best ones.

        Args:
            count: How many.
            first: Rank of the first of them.
        """
        some = Archive(self.region)
        for name in COLUMNS:
            setattr(some, name, getattr(self, name)[first : first + count].copy())
        return some

    def state(self, prefix: str) -> dict[str, Any]:
        """Arrays to carry on from, their names beginning with the prefix."""
        return {f"{prefix}_{name}": getattr(self, name).copy() for name in COLUMNS}

    def restore(self, saved: SavedState, prefix: str) -> None:
        """Set what :meth:`state` described.

        Args:
            saved: The saved state.
            prefix: What the names of its entries begin with.
        """
        self.U = saved.array(f"{prefix}_U", (None, self.U.shape[1]))
        self.value = saved.array(f"{prefix}_value", (len(self.U),))
        self.hint = saved.array(f"{prefix}_hint", (len(self.U), None), unknown=True)
        self.look = saved.array(f"{prefix}_look", (len(self.U),))
        self.hits = saved.array(f"{prefix}_hits", (len(self.U),))


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


def children(region: Region, parents: Array, groups: int, size: int, rng: np.random.Generator) -> Array:
    """Make places: a parent with entries drawn anew, shaken, with angles turned over, crossed, or with links exchanged.

    Parents are drawn by the better of two ranks. All ways bring some of the best basins, so each makes as many groups.
    A group is made in one way: of those together the ones that change least would look best before they have descended.

    Args:
        region: Box and slab.
        parents: Unit coordinates of basins, best first, shape (A, K).
        groups: Number of groups of children.
        size: Children of a group.
        rng: Source of the draws.

    Returns:
        Unit coordinates, group after group, shape (groups * size, K).
    """
    ways = [redrawn, shaken, turned_over, crossed]
    if np.count_nonzero(region.weights) > 1:
        ways.append(exchanged)
    places = np.empty((groups * size, region.dimension))
    for k in range(len(places)):
        parent = parents[int(rng.integers(0, len(parents), 2).min())]  # the better of two ranks ~ U{0..A-1}
        places[k] = ways[k // size % len(ways)](region, parent, parents, rng)
    return region.pulled_in(places, MARGIN)


def redrawn(region: Region, parent: Array, parents: Array, rng: np.random.Generator) -> Array:
    """One to three entries drawn anew: angles anywhere, lengths short or none."""
    child = parent.copy()
    for j in rng.permutation(len(child))[: int(rng.integers(1, 4))]:
        angle, none, draw = bool(region.angular[j]), rng.random() < SHORTER, rng.random()  # ~ U(0, 1)
        child[j] = draw if angle else 0.0 if none else SHORT * draw
    return child


def shaken(region: Region, parent: Array, parents: Array, rng: np.random.Generator) -> Array:
    """All entries moved by normal noise of one of three sizes."""
    noise = rng.normal(size=len(parent))  # ~ N(0, I)
    return np.asarray(parent + noise * SPREADS[int(rng.integers(len(SPREADS)))])


def turned_over(region: Region, parent: Array, parents: Array, rng: np.random.Generator) -> Array:
    """One or two angles mirrored about the middle of their bounds or moved by half of them, which links the bounds."""
    child, angles = parent.copy(), np.flatnonzero(region.angular)
    for j in rng.permutation(angles)[: int(rng.integers(1, 3))]:
        child[j] = 1.0 - child[j] if rng.random() < 0.5 else (child[j] + 0.5) % 1.0
    return np.asarray(child + rng.normal(size=len(child)) * NOISE)  # ~ N(child, NOISE^2 I)


def crossed(region: Region, parent: Array, parents: Array, rng: np.random.Generator) -> Array:
    """About half of the entries of another parent."""
    other = parents[int(rng.integers(len(parents)))]
    child = np.where(rng.random(len(parent)) < 0.5, parent, other)
    return np.asarray(child + rng.normal(size=len(parent)) * NOISE)  # ~ N(child, NOISE^2 I)


def exchanged(region: Region, parent: Array, parents: Array, rng: np.random.Generator) -> Array:
    """An entry of the slab changes places with one near it, and half of the angles beside them are drawn anew.

    So a link comes to lie along a joint's axis in place of across it, or before another joint.
    """
    child, links = parent.copy(), np.flatnonzero(region.weights)
    share = np.cumsum(parent[links] + SLIGHT)
    i = links[np.searchsorted(share, rng.random() * share[-1])]  # the longer the likelier
    near = links[(np.abs(links - i) <= NEAR) & (links != i)]
    j = near[int(rng.integers(len(near)))] if len(near) else i
    child[[i, j]] = child[[j, i]]
    for k in np.flatnonzero(region.angular):
        beside = min(i, j) - NEAR < k < max(i, j) + NEAR
        if beside and rng.random() < 0.5:
            child[k] = rng.random()  # ~ U(0, 1)
    return np.asarray(child + rng.normal(size=len(child)) * NOISE)  # ~ N(child, NOISE^2 I)
