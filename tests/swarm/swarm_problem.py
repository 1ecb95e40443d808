"""An objective with dozens of basins, and a caller that answers a search as an evaluation of arms would."""

from __future__ import annotations

import json

import numpy as np

from armdesign.swarm import Box, SearchSpace, Slab, make_algorithm

BOX = Box(
    lower=[-1.5, 0.0, 0.3, -1.5, 0.0, 0.0],
    upper=[1.5, 0.5, 0.3, 1.5, 0.5, 0.5],
    angular=[True, False, False, True, False, False],
)
SLAB = Slab(np.array([0.0, 1.0, 1.0, 0.0, 1.0, 1.0]), 0.5, 1.4)
SPACE = SearchSpace(BOX, slab=SLAB)
GOAL = np.array([0.9, 0.1, 0.3, -0.7, 0.0, 0.4])
SMALL = {
    "particles": 12, "iterations": 40,
    "budget": 500, "descents": 6, "parents": 8, "candidates_per_start": 150, "effort": "budget",
}  # fmt: skip
"""Parameters of short searches, of every algorithm."""


def bumpy(X):
    """Dozens of basins; the best one is at GOAL, with the value 0. Shape (N,)."""
    Y = X - GOAL
    return np.sum(Y**2 + 0.15 * (1.0 - np.cos(6.0 * Y)), axis=1) + 0.3 * np.abs(Y[:, 4])


def bumpy_slope(X):
    """Gradient of bumpy, shape (N, D)."""
    Y = X - GOAL
    slope = 2.0 * Y + 0.9 * np.sin(6.0 * Y)
    slope[:, 4] += 0.3 * np.sign(Y[:, 4])
    return slope


def evaluate(X):
    """Fitness, validity, and as hint the place itself; too short, too long or on one side there is no fitness."""
    valid = (X @ SLAB.weights > SLAB.low) & (X @ SLAB.weights < SLAB.high) & (X[:, 3] < 1.3)
    return np.where(valid, bumpy(X), np.inf), valid, np.where(valid[:, None], X[:, :2], np.nan)


def build(name, seed=5, space=SPACE, **parameters):
    """A short search."""
    return make_algorithm(name, space, np.random.default_rng(seed), SMALL | parameters)


def answer(search, X, *, slopes=True):
    """Tell a search what it asked for."""
    search.tell(*evaluate(X), bumpy_slope(X) if slopes and search.wants_slopes else None)


def run(search, batches=10**6, *, slopes=True):
    """Carry on; everything that was asked, one array per batch."""
    asked = []
    while not search.done and len(asked) < batches:
        asked.append(search.ask())
        answer(search, asked[-1], slopes=slopes)
    return asked


def through_json(state):
    """Arrays to nested lists and through JSON text, as a program without NumPy files would keep them."""
    return json.loads(json.dumps(state, default=lambda value: value.tolist()))
