"""RA-PSO, the particle swarm for robot arms (eq. 8)."""

from __future__ import annotations

import numpy as np

from armdesign._types import Array
from armdesign.errors import SettingsError
from armdesign.swarm import checks, operators
from armdesign.swarm.base import Sampler
from armdesign.swarm.pso import PSO
from armdesign.swarm.space import Box

RANGES = ("valid", "box")


class RAPSO(PSO):
    """Invalid particles move as in PSO (eq. 7), valid ones wander near where they are (eq. 8).

    A particle valid at the last `tell` moves by v <- v + U(c_min, c_max) range, componentwise; `range` is the extent of
    that entry over the particles now valid (zero, if there is but one), or the width of the box.

    Moves are numbered k = 1, 2, ...; move k leads from the k-th asked positions to the next. Angular entries, of valid
    and invalid particles alike, move only if k is a multiple of D; in between neither their position nor their velocity
    changes.

    The draws of eq. 7 are made for every particle and first, those of eq. 8 after them and for valid particles only, so
    that with every particle invalid and D = 1 the run is that of PSO, draw by draw.
    """

    name = "rapso"

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
        c_min: float = -0.5,
        c_max: float = 0.5,
        range_of: str = "valid",
        angle_interval: int = 2,
    ) -> None:
        """Draw the initial positions.

        Args:
            box: Bounds of the positions, D entries.
            particles: Number of particles N.
            rng: Source of every draw.
            sample: Draws the initial positions; default uniform in the box.
            w: Inertia of eq. 7, in [0, 1].
            c1: Pull of the personal best, >= 0.
            c2: Pull of the global best, >= 0.
            c_min: Lower bound of the factor in eq. 8.
            c_max: Upper bound of the factor in eq. 8.
            range_of: What `range` in eq. 8 is the extent of: the particles now "valid", or the "box".
            angle_interval: Angular entries move in every D-th iteration; D >= 1.

        Raises:
            SettingsError: A setting is out of range.
            SearchError: `sample` returned something else than N positions in the box.
        """
        self.c_min = checks.number("c_min", c_min)
        self.c_max = checks.number("c_max", c_max)
        if self.c_min > self.c_max:
            message = f"swarm setting 'c_min' is {self.c_min:g}, above 'c_max' = {self.c_max:g}"
            raise SettingsError(message, value=c_min, allowed="c_min <= c_max")
        self.range_of = checks.choice("range_of", range_of, RANGES)
        self.angle_interval = checks.whole("angle_interval", angle_interval)
        super().__init__(box, particles, rng, sample=sample, w=w, c1=c1, c2=c2)

    @property
    def parameters(self) -> dict[str, float | int | str]:
        """The factors of eq. 7 and 8, the meaning of `range` and the interval D."""
        return super().parameters | {
            "c_min": self.c_min,
            "c_max": self.c_max,
            "range_of": self.range_of,
            "angle_interval": self.angle_interval,
        }

    def _velocities(self) -> Array:
        """New velocities, shape (N, D): eq. 7, then eq. 8 in the rows of the valid particles."""
        V = super()._velocities()
        if self._valid.any():
            reach = self.box.width if self.range_of == "box" else operators.extent(self._X, self._valid)
            V[self._valid] = operators.wander(self._rng, self._V[self._valid], reach, self.c_min, self.c_max)
        return V

    def _move(self) -> tuple[Array, Array]:
        """New positions and velocities; in between, angular entries keep both."""
        X, V = super()._move()
        if self.iteration % self.angle_interval:
            held = self.box.angular
            X[:, held] = self._X[:, held]
            V[:, held] = self._V[:, held]
        return X, V
