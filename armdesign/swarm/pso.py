"""Particle swarm optimisation (eq. 7)."""

from __future__ import annotations

import numpy as np

from armdesign._types import Array
from armdesign.swarm import checks, operators
from armdesign.swarm.base import Sampler, Swarm
from armdesign.swarm.space import Box


class PSO(Swarm):
    """Every particle is drawn to its own best and to the swarm's best (eq. 7).

    v <- w v + beta1 c1 (bp - x) + beta2 c2 (gb - x), x <- clip(x + v), with one beta1 and one beta2 per particle and
    iteration, uniform in [0, 1). Positions are clipped to the box, the velocity is kept.
    """

    name = "pso"

    def __init__(
        self,
        box: Box,
        particles: int,
        rng: np.random.Generator,
        *,
        sample: Sampler | None = None,
        w: float = 0.8,
        c1: float = 0.4,
        c2: float = 0.6,
    ) -> None:
        """Draw the initial positions.

        Args:
            box: Bounds of the positions, D entries.
            particles: Number of particles N.
            rng: Source of every draw.
            sample: Draws the initial positions; default uniform in the box.
            w: Inertia, in [0, 1].
            c1: Pull of the personal best, >= 0.
            c2: Pull of the global best, >= 0.

        Raises:
            SettingsError: A setting is out of range.
            SearchError: `sample` returned something else than N positions in the box.
        """
        self.w = checks.number("w", w, 0.0, 1.0)
        self.c1 = checks.number("c1", c1, 0.0)
        self.c2 = checks.number("c2", c2, 0.0)
        super().__init__(box, particles, rng, sample=sample)

    @property
    def parameters(self) -> dict[str, float | int | str]:
        """The factors of eq. 7."""
        return {"w": self.w, "c1": self.c1, "c2": self.c2}

    def _velocities(self) -> Array:
        """New velocities, shape (N, D)."""
        gb = self.best_position
        return operators.attract(self._rng, self._X, self._V, self._bp, gb, w=self.w, c1=self.c1, c2=self.c2)

    def _move(self) -> tuple[Array, Array]:
        """New positions and velocities; what leaves the box is clipped, its velocity stays."""
        V = self._velocities()
        return self.box.clip(self._X + V), V
