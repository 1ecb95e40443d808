"""The robot fitness for searches that know of no constraints: every design gets a finite number."""

from __future__ import annotations

import numpy as np

from armdesign._types import Array
from armdesign.search.design_problem import DesignProblem

MISSED, OUT_OF_REACH, OUT_OF_BOUNDS = 1e2, 1e3, 1e4
"""What is added to the fitness of an invalid design, by the first test it fails [m]; valid ones stay far below."""
WIDTH = np.pi
"""Width of the box that the entries of Phi are scaled to: that of a twist, so that angles stay in radians."""


class PenalisedFitness:
    """Robot fitness r over the box [0, pi]^D, which the free entries of Phi are scaled to.

    An invalid design gets a large number that grows with how far it is from being valid: the length beyond its
    limits, the distance between the hand's first point and the shell the arm's links can span, or the distance by
    which the best start misses that point. Opytimizer moves all variables by steps of one size, which lengths of half
    a metre and twists of half a turn would not share as they are.
    """

    def __init__(self, problem: DesignProblem) -> None:
        """Take over the objective of the search."""
        self.space, self.objective = problem.space, problem.objective()
        self.lower, self.upper = self.space.bounds
        self.length = self.space.length
        self.distance = float(np.linalg.norm(problem.task.P[0, -1]))

    @property
    def dimension(self) -> int:
        """Number of free entries D."""
        return len(self.lower)

    def __call__(self, x: Array) -> float:
        """Value at one position, shape (D,)."""
        return float(self.many(x[None])[0])

    def many(self, X: Array) -> Array:
        """Values at positions, shape (N, D) -> (N,)."""
        Phi = self.phi(X)
        scores, _ = self.objective.evaluate(Phi)
        values = scores.fitness.copy()
        invalid = ~scores.valid
        miss = np.where(np.isfinite(scores.start_error), scores.start_error, 0.0)
        values[invalid] = MISSED * (1.0 + miss[invalid])
        unreached = invalid & ~np.isfinite(scores.start_error)
        values[unreached] = OUT_OF_REACH * (1.0 + self.gap(Phi[unreached]))
        outside = ~self.space.admissible(Phi)
        values[outside] = OUT_OF_BOUNDS * (1.0 + self.excess(Phi[outside]))
        return values

    def phi(self, X: Array) -> Array:
        """Designs at positions, both (N, D)."""
        return np.clip(self.lower + X / WIDTH * (self.upper - self.lower), self.lower, self.upper)

    def positions(self, Phi: Array) -> Array:
        """Positions of designs, both (N, D)."""
        return WIDTH * (Phi - self.lower) / (self.upper - self.lower)

    def excess(self, Phi: Array) -> Array:
        """Length beyond its limits, shape (N,) [m]."""
        length = self.space.lengths(Phi)
        beyond: Array = np.maximum(0.0, np.maximum(length - self.length[1], self.length[0] - length))
        return beyond

    def gap(self, Phi: Array) -> Array:
        """Distance between the hand's first point and the shell that the links can span, shape (N,) [m]."""
        rows, _ = self.space.rows(Phi)
        pieces = np.hypot(rows[:, :, 1], rows[:, :, 2])
        outer = pieces.sum(axis=1)
        inner = 2.0 * pieces.max(axis=1, initial=0.0) - outer
        beyond: Array = np.maximum(0.0, np.maximum(self.distance - outer, inner - self.distance))
        return beyond
