"""New places made of good basins, to begin descents from."""

from __future__ import annotations

import numpy as np

from armdesign._types import Array
from armdesign.swarm.region import Region

SPREADS = (0.03, 0.06, 0.12)
"""Standard deviations of shaken children, in unit coordinates."""
SHORT, SHORTER = 0.5, 0.3
"""Longest length drawn anew, in unit coordinates, and the probability that it is none."""
NOISE = 0.02
"""Standard deviation of the noise on children that are made otherwise, so that no child repeats a parent."""
MARGIN = 0.005
"""How far inside the slab children lie, so that descents can begin from them."""


def children(region: Region, parents: Array, count: int, rng: np.random.Generator) -> Array:
    """Make places: a parent with entries drawn anew, shaken, with twists turned over, or crossed with another parent.

    Parents are drawn by the better of two ranks. All four ways bring some of the best basins, so each is taken equally
    often.

    Args:
        region: Box and slab.
        parents: Unit coordinates of basins, best first, shape (A, K).
        count: Number of children.
        rng: Source of the draws.

    Returns:
        Unit coordinates, shape (count, K).
    """
    ways = (redrawn, shaken, turned_over, crossed)
    places = np.empty((count, region.dimension))
    for k in range(count):
        parent = parents[int(rng.integers(0, len(parents), 2).min())]
        places[k] = ways[int(rng.integers(len(ways)))](region, parent, parents, rng)
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
