"""Particle swarm optimisation (PSO, eq. 7), and its variant for robot arms (RA-PSO, eq. 8)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.errors import SettingsError
from armdesign.swarm import checks
from armdesign.swarm.algorithm import Algorithm, State
from armdesign.swarm.checks import Mask, SavedState
from armdesign.swarm.space import SearchSpace

RANGES = ("valid", "box")


@dataclass(frozen=True)
class PSOParameters:
    """Size of a swarm and the factors of eq. 7.

    Attributes:
        particles: Number of particles N.
        iterations: Number of iterations M.
        inertia: w, in [0, 1].
        c1: Pull of the personal best, >= 0.
        c2: Pull of the global best, >= 0.
    """

    particles: int = 400
    iterations: int = 200
    inertia: float = 0.8
    c1: float = 0.4
    c2: float = 0.6

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            SettingsError: A parameter is out of range.
        """
        checks.whole("particles", self.particles)
        checks.whole("iterations", self.iterations)
        checks.number("inertia", self.inertia, 0.0, 1.0)
        checks.number("c1", self.c1, 0.0)
        checks.number("c2", self.c2, 0.0)


class PSO(Algorithm):
    """Every particle is drawn to its own best and to the swarm's best (eq. 7).

    v <- w v + beta1 c1 (bp - x) + beta2 c2 (gb - x), x <- clip(x + v), with one beta1 and one beta2 per particle and
    iteration, uniform in [0, 1). Velocities start at zero; positions are clipped to the box, the velocity is kept.

    A personal best gives way only to a strictly smaller fitness. The global best is the best personal best, the
    one of lowest index among equals; while no fitness is finite it is particle 0.
    """

    name, unit, length = "pso", "iteration", "iterations"
    Parameters = PSOParameters
    parameters: PSOParameters

    def __init__(self, space: SearchSpace, rng: np.random.Generator, parameters: PSOParameters | None = None) -> None:
        """Begin; the first draw is made by the first `ask`.

        Args:
            space: Where to search.
            rng: Source of every draw.
            parameters: Size of the swarm and its factors; by default as published.
        """
        super().__init__(space, rng, parameters)
        shape = self.parameters.particles, self.box.dimension
        self._V = np.zeros(shape)  # (N, D)
        self._valid: Mask = np.zeros(shape[0], dtype=bool)
        self._bp = np.tile(self.box.lower, (shape[0], 1))  # (N, D)
        self._bp_fitness = np.full(shape[0], np.inf)

    def _next(self) -> Array:
        """Positions drawn at first, then moved; what leaves the box is clipped, its velocity stays."""
        if not self.iteration:
            self._bp = self.space.draw(self._rng, self.parameters.particles)
            return self._bp.copy()
        self._V = self._velocities()
        return self.box.clip(self._X + self._V)

    def _velocities(self) -> Array:
        """New velocities, shape (N, D), of move number `iteration` = 1, 2, ..."""
        w, c1, c2 = self.parameters.inertia, self.parameters.c1, self.parameters.c2
        X, bp, gb = self._X, self._bp, self.best_position
        beta1, beta2 = self._rng.random((2, len(X), 1))  # ~ U(0, 1), beta1 of all particles before beta2
        return np.asarray(w * self._V + beta1 * c1 * (bp - X) + beta2 * c2 * (gb - X))  # eq. 7

    def _take(self, values: Array, valid: Mask, hints: Array, slopes: Array | None) -> float:
        """Update the personal bests; hints and slopes are not used, as a particle comes from afar."""
        better = values < self._bp_fitness
        self._bp[better] = self._X[better]
        self._bp_fitness[better] = values[better]
        self._valid = valid
        finite = self._bp_fitness[np.isfinite(self._bp_fitness)]
        return float(finite.mean()) if finite.size else np.inf

    @property
    def cutoff(self) -> Array:
        """The personal best of each particle, shape (N,); a fitness beyond it changes nothing."""
        return self._bp_fitness.copy()

    @property
    def done(self) -> bool:
        """Whether all iterations are done."""
        return self.iteration >= self.parameters.iterations

    @classmethod
    def units_done(cls, evaluations: int, settings: Mapping[str, Any]) -> int:
        """How many iterations so many evaluations are.

        Args:
            evaluations: Candidates told so far.
            settings: The parameters by name; others may be among them.
        """
        return evaluations // int(settings["particles"])

    @property
    def generation(self) -> int:
        """Number of particles N."""
        return self.parameters.particles

    @property
    def best_position(self) -> Array:
        """Position of the global best gb, shape (D,)."""
        return np.array(self._bp[np.argmin(self._bp_fitness)])

    @property
    def best_fitness(self) -> float:
        """Fitness of the global best, +inf while there is none."""
        return float(self._bp_fitness.min())

    @property
    def basins(self) -> tuple[Array, Array]:
        """The personal bests that have a fitness, best first: positions (A, D) and fitness (A,)."""
        order = np.argsort(self._bp_fitness, kind="stable")
        order = order[np.isfinite(self._bp_fitness[order])]
        return np.array(self._bp[order]), np.array(self._bp_fitness[order])

    def _memory(self) -> State:
        """Velocities, validity and personal bests."""
        return {
            "velocities": self._V.copy(),
            "valid": self._valid.copy(),
            "personal_best_positions": self._bp.copy(),
            "personal_best_fitness": self._bp_fitness.copy(),
        }

    def _restore(self, saved: SavedState) -> None:
        """Set what `_memory` described."""
        shape = self._V.shape
        if self._asked or self._history:  # before the first ask there are no positions
            self._X = saved.array("positions", shape)
        self._V = saved.array("velocities", shape)
        self._valid = saved.flags("valid", shape[:1])
        self._bp = saved.array("personal_best_positions", shape)
        self._bp_fitness = saved.array("personal_best_fitness", shape[:1], infinite=True)


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
            V[:, held] = self._V[:, held]  # they rest, and go on with the velocity that they had
        return V

    def _next(self) -> Array:
        """Positions drawn at first, then moved; in between, angular entries stay where they are."""
        before = self._X
        X = super()._next()
        if self.iteration % self.parameters.angle_interval:
            held = self.box.angular
            X[:, held] = before[:, held]
        return X
