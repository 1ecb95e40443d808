"""What every swarm shares: ask and tell, bests, history and the state to resume from."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import SearchError, SettingsError
from armdesign.swarm import checks, generator_state, operators, saved
from armdesign.swarm.space import Box, Mask

Sampler = Callable[[np.random.Generator, int], Array]
"""Draws `count` positions, shape (count, D), from a generator."""

State = dict[str, Any]
"""Arrays, and values that JSON can hold; see :meth:`Swarm.state`."""

S = TypeVar("S", bound="Swarm")


@dataclass(frozen=True, eq=False)
class History:
    """What happened, one entry per iteration (per `tell`).

    Attributes:
        best: Fitness of the global best, +inf while there is none, shape (M,).
        mean: Mean of the finite personal bests, +inf while there is none, shape (M,).
        valid: Number of particles told to be valid, shape (M,).
        evaluations: Number of particles told so far, valid or not, shape (M,).
    """

    best: Array
    mean: Array
    valid: NDArray[np.int64]
    evaluations: NDArray[np.int64]


class Swarm(ABC):
    """N particles that minimise a fitness which the caller computes.

    `ask` hands out positions, `tell` takes their fitness; the caller owns the objective, its constraints, the
    workers and the logging. After construction the generator belongs to the swarm alone. Moves are made in `ask`, so
    that a run of M iterations, saved and carried on, equals a longer one to the last bit.

    A personal best gives way only to a strictly smaller fitness. The global best is the best personal best, the
    one of lowest index among equals; while no fitness is finite it is particle 0.
    """

    name: ClassVar[str]

    def __init__(self, box: Box, particles: int, rng: np.random.Generator, *, sample: Sampler | None = None) -> None:
        """Draw the initial positions; the velocities start at zero.

        Args:
            box: Bounds of the positions, D entries.
            particles: Number of particles N.
            rng: Source of every draw.
            sample: Draws the initial positions; default uniform in the box.

        Raises:
            SettingsError: A setting is out of range.
            SearchError: `sample` returned something else than N positions in the box.
        """
        count = checks.whole("particles", particles)
        self.box = box
        self._rng = checks.generator(rng)
        drawn = operators.uniform(rng, box, count) if sample is None else sample(rng, count)
        self._X = checks.positions(drawn, box, count)  # (N, D)
        self._V = np.zeros_like(self._X)  # (N, D)
        self._valid: Mask = np.zeros(count, dtype=bool)
        self._bp = self._X.copy()  # (N, D)
        self._bp_fitness = np.full(count, np.inf)
        self._asked = False
        self._best: list[float] = []
        self._mean: list[float] = []
        self._count: list[int] = []

    def ask(self) -> Array:
        """Positions whose fitness is wanted, shape (N, D); the same ones until they are told."""
        if not self._asked and self.iteration:
            self._X, self._V = self._move()
        self._asked = True
        return self._X.copy()

    def tell(self, fitness: ArrayLike, valid: ArrayLike, hints: ArrayLike | None = None) -> None:
        """Take the fitness of the positions last asked for.

        A particle given up early, because it cannot beat its personal best, is told as +inf and valid. Validity steers
        the moves and the count in the history; a fitness counts whether the particle is valid or not.

        Args:
            fitness: Smaller is better, +inf for none, shape (N,).
            valid: Whether the particle fulfils the constraints, shape (N,).
            hints: What would help to evaluate positions nearby; particles do not use it.

        Raises:
            SearchError: Nothing was asked, a wrong shape, or a fitness of NaN or -inf. The swarm is left as it was.
        """
        if not self._asked:
            raise SearchError(
                "the swarm was told a fitness that it did not ask for", fix="Call ask() before each tell()"
            )
        values, flags = checks.fitness(fitness, self.particles), checks.validity(valid, self.particles)
        better = values < self._bp_fitness
        self._bp[better] = self._X[better]
        self._bp_fitness[better] = values[better]
        self._valid = flags
        self._asked = False
        self._record()

    def _record(self) -> None:
        """Append the present bests to the history."""
        finite = self._bp_fitness[np.isfinite(self._bp_fitness)]
        self._best.append(self.best_fitness)
        self._mean.append(float(finite.mean()) if finite.size else np.inf)
        self._count.append(int(np.count_nonzero(self._valid)))

    @abstractmethod
    def _move(self) -> tuple[Array, Array]:
        """New positions and velocities, both (N, D) and new arrays, of move number `iteration` = 1, 2, ..."""

    @property
    @abstractmethod
    def parameters(self) -> dict[str, float | int | str]:
        """The algorithm's own settings, by the names of its constructor."""

    @property
    def particles(self) -> int:
        """Number of particles N."""
        return len(self._X)

    @property
    def iteration(self) -> int:
        """Number of iterations told so far."""
        return len(self._best)

    @property
    def best_position(self) -> Array:
        """Position of the global best, shape (D,)."""
        return np.array(self._bp[np.argmin(self._bp_fitness)])

    @property
    def best_fitness(self) -> float:
        """Fitness of the global best, +inf while there is none."""
        return float(self._bp_fitness.min())

    @property
    def personal_best_positions(self) -> Array:
        """Positions of the personal bests, shape (N, D); the initial ones while there is none."""
        return self._bp.copy()

    @property
    def personal_best_fitness(self) -> Array:
        """Fitness of the personal bests, +inf while there is none, shape (N,).

        A particle whose fitness is known to reach its entry need not be evaluated further: told as +inf, the run
        stays the same to the last bit.
        """
        return self._bp_fitness.copy()

    @property
    def cutoff(self) -> Array:
        """Fitness beyond which a particle need not be evaluated further, shape (N,): its personal best."""
        return self.personal_best_fitness

    @property
    def hints(self) -> Array | None:
        """What helps to evaluate the positions asked for: nothing, a particle comes from afar."""
        return None

    @property
    def basins(self) -> tuple[Array, Array]:
        """The personal bests that have a fitness, best first: positions (A, D) and fitness (A,)."""
        order = np.argsort(self._bp_fitness, kind="stable")
        order = order[np.isfinite(self._bp_fitness[order])]
        return np.array(self._bp[order]), np.array(self._bp_fitness[order])

    @property
    def history(self) -> History:
        """The iterations so far."""
        return History(
            best=np.array(self._best, dtype=float),
            mean=np.array(self._mean, dtype=float),
            valid=np.array(self._count, dtype=np.int64),
            evaluations=self.particles * np.arange(1, self.iteration + 1, dtype=np.int64),
        )

    def state(self) -> State:
        """Everything needed to carry on, to the last bit, at any point between two calls.

        Returns:
            NumPy arrays, and beside them only values that JSON holds exactly: `algorithm`, `asked`, `parameters`
            (a dict of numbers and words) and `generator` (text).
        """
        return {
            "algorithm": self.name,
            "parameters": self.parameters,
            "generator": generator_state.encode(self._rng),
            "asked": self._asked,
            "lower": self.box.lower.copy(),
            "upper": self.box.upper.copy(),
            "angular": self.box.angular.copy(),
            "positions": self._X.copy(),
            "velocities": self._V.copy(),
            "valid": self._valid.copy(),
            "personal_best_positions": self._bp.copy(),
            "personal_best_fitness": self._bp_fitness.copy(),
            "history_best": np.array(self._best, dtype=float),
            "history_mean": np.array(self._mean, dtype=float),
            "history_valid": np.array(self._count, dtype=np.int64),
        }

    @classmethod
    def from_state(cls: type[S], state: Mapping[str, Any]) -> S:
        """The swarm that :meth:`state` described; arrays may come back as nested lists.

        Raises:
            SearchError: The state is that of another algorithm, or an entry is missing or does not fit.
            SettingsError: A setting in it is out of range.
        """
        saved.check_algorithm(state, cls.name)
        box = Box(*(saved.entry(state, name) for name in ("lower", "upper", "angular")))
        X = saved.array(state, "positions", (None, box.dimension))
        rng = generator_state.decode(saved.entry(state, "generator"))
        parameters = cls.known_parameters(saved.settings(state, "parameters"))
        swarm = cls(box, len(X), rng, sample=lambda _rng, _count: X, **parameters)
        swarm._restore(state)
        return swarm

    def _restore(self, state: Mapping[str, Any]) -> None:
        """Set what the constructor cannot: the swarm's memory."""
        shape = self._X.shape
        self._V = saved.array(state, "velocities", shape)
        self._valid = saved.flags(state, "valid", shape[:1])
        self._bp = saved.array(state, "personal_best_positions", shape)
        self._bp_fitness = saved.array(state, "personal_best_fitness", shape[:1], infinite=True)
        self._asked = bool(saved.entry(state, "asked"))
        self._best = saved.array(state, "history_best", (None,), infinite=True).tolist()
        told = (len(self._best),)
        self._mean = saved.array(state, "history_mean", told, infinite=True).tolist()
        self._count = [int(count) for count in saved.array(state, "history_valid", told)]

    @classmethod
    def known_parameters(cls, parameters: Mapping[str, Any]) -> dict[str, Any]:
        """The parameters again, if the algorithm knows them all.

        Raises:
            SettingsError: A name is unknown; the message lists the known ones.
        """
        keywords = inspect.signature(cls).parameters.values()
        names = [entry.name for entry in keywords if entry.kind is entry.KEYWORD_ONLY and entry.name != "sample"]
        for name in parameters:
            if name not in names:
                raise SettingsError(f"'{cls.name}' has no setting '{name}'", value=name, allowed=names)
        return dict(parameters)
