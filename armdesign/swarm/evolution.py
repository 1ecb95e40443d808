"""CMA-ES in the unit box, with a state to carry on from: the last stage of a many-basin search, where kinks are.

Equations (H. n) and the names of the constants are those of Hansen 2016, The CMA Evolution Strategy: A Tutorial,
without its negative weights.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.swarm.checks import SavedState


class Evolution:
    """Asks for a population, is told its fitness, and moves mean, step size and covariance.

    Candidates are clipped to the box; what was evaluated is what counts. Those without a fitness rank last.

    Attributes:
        population: Number of candidates a generation, lambda.
        generation: Generations told.
    """

    def __init__(self, mean: Array, sigma: float) -> None:
        """Begin.

        Args:
            mean: Unit coordinates, shape (K,).
            sigma: Step size.
        """
        K = len(mean)
        self.mean, self.sigma, self.generation = mean.copy(), sigma, 0
        self.C, self.path_s, self.path_c = np.eye(K), np.zeros(K), np.zeros(K)
        self.population = 4 + int(3.0 * np.log(K))  # eq. H. 48
        weights = np.log(0.5 * (self.population + 1)) - np.log(np.arange(1, self.population // 2 + 1))  # eq. H. 49
        self.weights = weights / weights.sum()
        mu = 1.0 / float(np.sum(self.weights**2))
        self.mu = mu
        self.c_s = (mu + 2.0) / (K + mu + 5.0)  # eq. H. 55, as d_s
        self.d_s = 1.0 + self.c_s + 2.0 * max(0.0, np.sqrt((mu - 1.0) / (K + 1.0)) - 1.0)
        self.c_c = (4.0 + mu / K) / (K + 4.0 + 2.0 * mu / K)  # eq. H. 56
        self.c_1 = 2.0 / ((K + 1.3) ** 2 + mu)  # eq. H. 57
        self.c_mu = min(1.0 - self.c_1, 2.0 * (mu - 2.0 + 1.0 / mu) / ((K + 2.0) ** 2 + mu))  # eq. H. 58
        self.expected = np.sqrt(K) * (1.0 - 1.0 / (4.0 * K) + 1.0 / (21.0 * K * K))  # of |N(0, I)|

    def ask(self, rng: np.random.Generator) -> Array:
        """A population, shape (lambda, K)."""
        scale, axes = self._axes()
        draws = rng.normal(size=(self.population, len(self.mean)))  # ~ N(0, I)
        return np.clip(self.mean + self.sigma * (draws * scale) @ axes.T, 0.0, 1.0)  # ~ N(mean, sigma^2 C)

    def tell(self, U: Array, value: Array) -> None:
        """Take the fitness of what was asked.

        Args:
            U: The population, shape (lambda, K).
            value: Fitness, +inf for none, shape (lambda,).
        """
        order = np.argsort(value, kind="stable")[: len(self.weights)]
        moves = (U[order] - self.mean) / self.sigma
        move = self.weights @ moves  # eq. H. 41
        scale, axes = self._axes()
        self.generation += 1
        self.mean = self.mean + self.sigma * move  # eq. H. 42
        white = axes @ ((axes.T @ move) / scale)  # C^(-1/2) move
        self.path_s = (1.0 - self.c_s) * self.path_s + np.sqrt(self.c_s * (2.0 - self.c_s) * self.mu) * white  # H. 43
        length = float(np.linalg.norm(self.path_s))
        limit = (1.4 + 2.0 / (len(self.mean) + 1.0)) * self.expected
        # h_sigma of H.: while the step size is still growing fast, C learns no direction from it
        quiet = length / np.sqrt(1.0 - (1.0 - self.c_s) ** (2 * self.generation)) < limit
        drive = np.sqrt(self.c_c * (2.0 - self.c_c) * self.mu) * move if quiet else 0.0
        self.path_c = (1.0 - self.c_c) * self.path_c + drive  # eq. H. 45
        lost = 0.0 if quiet else self.c_c * (2.0 - self.c_c)
        rank_mu = (moves.T * self.weights) @ moves
        keep = 1.0 - self.c_1 - self.c_mu + self.c_1 * lost
        self.C = keep * self.C + self.c_1 * np.outer(self.path_c, self.path_c) + self.c_mu * rank_mu  # H. 47
        # eq. H. 44, with a step size that at most grows e-fold a generation
        self.sigma *= float(np.exp(min(1.0, self.c_s / self.d_s * (length / self.expected - 1.0))))

    def _axes(self) -> tuple[Array, Array]:
        """Standard deviations and principal axes of the covariance."""
        values, axes = np.linalg.eigh(0.5 * (self.C + self.C.T))
        return np.sqrt(np.maximum(values, 1e-14)), np.asarray(axes)

    def state(self, prefix: str) -> dict[str, Any]:
        """Arrays and numbers to carry on from, their names beginning with the prefix."""
        names = ("mean", "C", "path_s", "path_c")
        return {f"{prefix}_{name}": getattr(self, name).copy() for name in names} | {
            f"{prefix}_sigma": self.sigma,
            f"{prefix}_generation": self.generation,
        }

    @classmethod
    def from_state(cls, saved: SavedState, prefix: str) -> Evolution:
        """The evolution that :meth:`state` described.

        Args:
            saved: The saved state.
            prefix: What the names of its entries begin with.
        """
        mean = saved.array(f"{prefix}_mean", (None,))
        evolution = cls(mean, float(saved.entry(f"{prefix}_sigma")))
        K = len(mean)
        for name, shape in (("C", (K, K)), ("path_s", (K,)), ("path_c", (K,))):
            setattr(evolution, name, saved.array(f"{prefix}_{name}", shape))
        evolution.generation = int(saved.entry(f"{prefix}_generation"))
        return evolution
