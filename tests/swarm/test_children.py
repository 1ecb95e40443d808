"""Children of basins: where they lie, in which ways they are made, and what an exchange leaves as it was."""

from __future__ import annotations

import numpy as np
import pytest

from armdesign.swarm import Box, SearchSpace, Slab
from armdesign.swarm.basins import NEAR, NOISE, children, exchanged
from armdesign.swarm.space import Region

ANGULAR = np.array([True, *[True, False, False] * 3, True])
"""Entries of an arm: a twist, three times twist, length across and along, the tool's twist."""


def arm(*, slab=True):
    """The box of such arms, in unit coordinates."""
    box = Box(np.zeros(len(ANGULAR)), np.ones(len(ANGULAR)), ANGULAR)
    weights = np.where(ANGULAR, 0.0, 1.0)
    return Region(SearchSpace(box, slab=Slab(weights, 0.5, 1.5) if slab else None))


def parents(region, rng):
    """Basins with two long links and four of next to no length."""
    U = rng.random((5, region.dimension))
    lengths = np.array([0.02, 0.4, 0.0, 0.01, 0.35, 0.0])
    U[:, ~ANGULAR] = [rng.permutation(lengths) for _ in U]
    return U


@pytest.mark.parametrize("slab", [True, False])
def test_children_lie_in_box_and_slab(slab):
    region, rng = arm(slab=slab), np.random.default_rng(1)
    U = children(region, parents(region, rng), 40, 6, rng)
    assert U.shape == (240, region.dimension)
    assert (U >= 0.0).all()
    assert (U <= 1.0).all()
    total = U @ region.weights
    assert (total > region.low).all()
    assert (total < region.high).all()


def test_a_group_is_made_in_one_way_and_all_ways_take_turns(monkeypatch):
    region, rng = arm(), np.random.default_rng(2)
    used = []

    def watched(name):
        def way(region, parent, parents, rng):
            used.append(name)
            return parent

        return way

    names = ["redrawn", "shaken", "turned_over", "crossed", "exchanged"]
    for name in names:
        monkeypatch.setattr(f"armdesign.swarm.basins.{name}", watched(name))
    children(region, parents(region, rng), 12, 6, rng)
    assert used == [names[k % 5] for k in range(12) for _ in range(6)]


def test_without_links_there_is_nothing_to_exchange(monkeypatch):
    region, rng = arm(slab=False), np.random.default_rng(3)
    monkeypatch.setattr("armdesign.swarm.basins.exchanged", None)  # calling it would fail
    assert len(children(region, parents(region, rng), 10, 2, rng)) == 20


def test_an_exchange_moves_two_neighbouring_links_and_leaves_what_is_far_from_them():
    region, rng = arm(), np.random.default_rng(4)
    swapped = set()
    for parent in np.repeat(parents(region, rng), 100, axis=0):
        child = exchanged(region, parent, parent[None], rng)
        close = 6.0 * NOISE
        np.testing.assert_allclose(np.sort(child[~ANGULAR]), np.sort(parent[~ANGULAR]), atol=close)
        moved = np.flatnonzero((np.abs(child - parent) > close) & ~ANGULAR)
        if len(moved) == 0:  # two of about the same length
            continue
        i, j = moved
        assert j - i <= NEAR
        swapped.add((int(i), int(j)))
        far = np.flatnonzero((np.abs(child - parent) > close) & ANGULAR)
        assert ((far > i - NEAR) & (far < j + NEAR)).all()
    # across against along within a row and the next, and one row's against the next row's
    assert {(2, 3), (3, 5), (2, 5), (3, 6), (5, 6), (6, 8)} <= swapped


def test_long_links_are_exchanged_more_often_than_two_of_no_length():
    region, rng = arm(), np.random.default_rng(5)
    parent = np.full(region.dimension, 0.5)
    parent[~ANGULAR] = [0.5, 0.0, 0.0, 0.0, 0.0, 0.0]
    moved = sum(exchanged(region, parent, parent[None], rng)[2] < 0.3 for _ in range(400))
    assert moved > 300  # 0.52 of 0.62 and more: 84 % begin with it, others meet it from beside
