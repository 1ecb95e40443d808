"""RA-PSO, the particle swarm for robot arms (eq. 8)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.errors import SettingsError
from armdesign.swarm import checks
from armdesign.swarm.pso import PSO, PSOParameters

RANGES = ("valid", "box")


@dataclass(frozen=True)
class RAPSOParameters(PSOParameters):
    """Size of a swarm, the factors of eq. 7 and those of eq. 8.

    Attributes:
        c_range: c_min and c_max, the bounds of the factor in eq. 8.
        range: What `range` in eq. 8 is the extent of: the particles now "valid", or the "box".
        angle_interval: Angular entries move in every D-th iteration; D >= 1.
    """

    c_range: tuple[float, float] = (-0.5, 0.5)
    range: str = "valid"
    angle_interval: int = 2

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            SettingsError: A parameter is out of range.
        """
        super().__post_init__()
        object.__setattr__(self, "c_range", tuple(self.c_range))  # a saved state holds a list
        c_min, c_max = self.c_range
        if checks.number("c_range", c_min) > checks.number("c_range", c_max):
            message = f"search setting 'c_range' has c_min = {c_min:g} above c_max = {c_max:g}"
            raise SettingsError(message, value=self.c_range, allowed="c_min <= c_max")
        if self.range not in RANGES:
            raise SettingsError(f"search setting 'range' is {self.range!r}", value=self.range, allowed=RANGES)
        checks.whole("angle_interval", self.angle_interval)


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
    Parameters = RAPSOParameters
    parameters: RAPSOParameters

    def _velocities(self) -> Array:
        """New velocities, shape (N, D): eq. 7, then eq. 8 in the rows of the valid particles."""
        V, valid = super()._velocities(), self._valid
        if valid.any():
            reach = self.box.width if self.parameters.range == "box" else np.ptp(self._X[valid], axis=0)
            still = self._V[valid]
            factor = self._rng.uniform(*self.parameters.c_range, still.shape)  # ~ U(c_min, c_max), one per entry
            V[valid] = still + factor * reach  # eq. 8
        if self.iteration % self.parameters.angle_interval:
            held = self.box.angular
            V[:, held] = self._V[:, held]
        return V

    def _next(self) -> Array:
        """Positions drawn at first, then moved; in between, angular entries stay where they are."""
        before = self._X
        X = super()._next()
        if self.iteration % self.parameters.angle_interval:
            held = self.box.angular
            X[:, held] = before[:, held]
        return X
