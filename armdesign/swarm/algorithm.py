"""What all search algorithms have in common: ask and tell, the best so far, history, and a state to resume from."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar, NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import SearchError, SettingsError
from armdesign.swarm import checks
from armdesign.swarm.agreement import Agreement
from armdesign.swarm.checks import Mask, SavedState
from armdesign.swarm.space import SearchSpace

State = dict[str, Any]
"""Arrays, and values that JSON can hold; see :meth:`Algorithm.state`."""
A = TypeVar("A", bound="Algorithm")
GENERATION = 400
"""Candidates of a generation of the paper's swarms."""
NEAR = 0.01
"""A search has converged where its best is this near to its last best, relative."""


class Effort(NamedTuple):
    """How much work a search took until it had, in effect, found its result (method section 7).

    Attributes:
        iterations: W, the first iteration (from 1) whose best is within 1 % of the last best; all of them if nothing
            was found.
        mean_valid: Mean number of valid candidates over those iterations.
        computational_effort: CE = mean_valid times W.
    """

    iterations: int
    mean_valid: float
    computational_effort: float


@dataclass(frozen=True, eq=False)
class History:
    """The course of a search, one entry per batch (per `tell`).

    Attributes:
        best: The best fitness, +inf while there is none, shape (M,).
        mean: Mean of what the algorithm keeps (personal bests, basins), +inf while there is none, shape (M,).
        valid: Number of valid candidates in the batch, shape (M,).
        evaluations: Number of candidates evaluated so far, valid or not, shape (M,).
    """

    best: Array
    mean: Array
    valid: NDArray[np.int64]
    evaluations: NDArray[np.int64]

    @property
    def effort(self) -> Effort:
        """The work until convergence.

        Raises:
            SearchError: There is no iteration yet.
        """
        if not len(self.best):
            raise SearchError("a search without an iteration has no effort", fix="Run at least one iteration")
        last, W = float(self.best[-1]), len(self.best)
        if np.isfinite(last):
            W = int(np.argmax(self.best <= last + NEAR * abs(last))) + 1
        total = float(self.valid[:W].sum())  # CE itself: the mean times W would be rounded twice
        return Effort(W, total / W, total)


class Algorithm(ABC):
    """Minimises a fitness which the caller computes: `ask` hands out positions, `tell` takes their fitness.

    The caller owns the objective, its constraints, the workers and the logging. After construction the generator
    belongs to the algorithm alone. Moves are made in `ask`, so that a run that is saved and carried on equals an
    uninterrupted one to the last bit.

    An algorithm implements the abstract methods below; `hints`, `wants_slopes` and `cutoff` where it has a use for
    them; `units_done` and `generation` where it counts otherwise. Its constructor draws nothing.

    Attributes:
        name: The algorithm's name in the registry and in the settings.
        unit: What its length is counted in, in the singular.
        length: The parameter that says how long it goes on; also the word for why it has ended.
        changeable: Parameters beside the length that a search may go on with when it is taken up again.
        takes_slopes: Whether it may ask for gradients of the fitness, see `wants_slopes`.
        Parameters: Dataclass of its parameters, named as in the settings of a search.
        space: Where it searches.
        parameters: Its parameters.
        label: What tells it from others, where it is a part of a search.
        note: What the caller has told with the last batch, for itself.
    """

    name: ClassVar[str]
    unit: ClassVar[str]
    length: ClassVar[str]
    changeable: ClassVar[tuple[str, ...]] = ()
    takes_slopes: ClassVar[bool] = False
    Parameters: ClassVar[type[Any]]
    parameters: Any
    label: int = 0

    def __init__(self, space: SearchSpace, rng: np.random.Generator, parameters: object = None) -> None:
        """Begin; the first draw is made by the first `ask`.

        Args:
            space: Where to search.
            rng: Source of every draw.
            parameters: An instance of `Parameters`; by default its defaults.

        Raises:
            SettingsError: The generator is none.
        """
        if not isinstance(rng, np.random.Generator):
            message = f"a search draws from a numpy.random.Generator, got {type(rng).__name__}"
            raise SettingsError(message, value=rng, fix="Pass numpy.random.default_rng(seed)")
        self.space, self.box = space, space.box
        self.parameters = self.Parameters() if parameters is None else parameters
        self._rng = rng
        self._X = np.zeros((0, self.box.dimension))  # (N, D), the positions last asked for
        self._asked = False
        self._history: list[tuple[float, float, int, int]] = []
        self.note: tuple[float, ...] = ()

    # ------------------------------------------------------------------ ask and tell

    def ask(self) -> Array:
        """Positions whose fitness is wanted, shape (N, D); the same ones until they are told. N may differ by batch.

        Raises:
            SearchError: The search is done, or the sampler returned something else than positions in the box.
        """
        if self.done:
            done, planned = self.progress
            raise SearchError(
                f"the search is done after {done} of {planned} {self.unit}s", value=done,
                fix=f"Look at `done` before ask(), or raise its {self.length}",
            )  # fmt: skip
        if not self._asked:  # moves are made here, not in tell: a state taken between the two holds all draws so far
            self._X = self._next()
            self._asked = True
        return self._X.copy()

    def tell(
        self,
        fitness: ArrayLike,
        valid: ArrayLike,
        hints: ArrayLike | None = None,
        slopes: ArrayLike | None = None,
        note: Sequence[float] = (),
    ) -> None:
        """Take the fitness of the positions last asked for.

        A candidate that was given up beyond its `cutoff` is told as +inf and valid.

        Args:
            fitness: Smaller is better, +inf for none, shape (N,).
            valid: Whether the candidate fulfils the constraints, shape (N,). A fitness counts whether it does or not.
            hints: What helps to evaluate positions nearby, shape (N, H), NaN where there is nothing; default nothing.
            slopes: Gradients of the fitness, shape (N, D), NaN where there is none; default none. They are heeded where
                `wants_slopes` is true.
            note: Numbers that the caller wants to have back as `note` when this batch has been taken in, which may be
                much later where parts are carried out elsewhere; of equal length in all batches.

        Raises:
            SearchError: Nothing was asked, a wrong shape, or a fitness of NaN or -inf. The search is left as it was.
        """
        if not self._asked:
            raise SearchError(
                "the search was told a fitness that it did not ask for", fix="Call ask() before each tell()"
            )
        count = len(self._X)
        values = checks.fitness(fitness, count)
        flags = checks.flags("the validity of the candidates", valid, (count,))
        given = np.zeros((count, 0)) if hints is None else checks.numbers("the hints", hints, (count, None))
        gradients = None if slopes is None else checks.numbers("the slopes", slopes, self._X.shape)
        self._asked = False  # only now that all of it is checked: a refused answer leaves the search as it was
        self.note = tuple(note)
        mean = self._take(values, flags, given, gradients)
        self._history.append((self.best_fitness, mean, int(np.count_nonzero(flags)), self.evaluations + count))

    @abstractmethod
    def _next(self) -> Array:
        """The next positions to evaluate, shape (N, D), a new array."""

    @abstractmethod
    def _take(self, values: Array, valid: Mask, hints: Array, slopes: Array | None) -> float:
        """Learn from the answers to what was asked; arguments as for :meth:`tell`, checked and copied.

        Returns:
            The mean for the history.
        """

    @property
    def hints(self) -> Array | None:
        """What helps to evaluate the positions last asked for, shape (N, H), rows of NaN where there is nothing."""
        return None

    @property
    def wants_slopes(self) -> bool:
        """Whether gradients of the fitness at the positions last asked for would help."""
        return False

    @property
    def coarse(self) -> int:
        """How coarsely the positions last asked for may be evaluated, 0 for not at all.

        What a number stands for is the caller's matter, who may also evaluate in full. The same one always gives the
        same fitness.
        """
        return 0

    @property
    def cutoff(self) -> Array:
        """Fitness beyond which a position last asked for need not be evaluated further, shape (N,).

        Told as +inf instead, the run stays the same to the last bit.
        """
        return np.full(len(self._X), np.inf)

    # ------------------------------------------------------------------ parts carried out elsewhere

    def parts(self, most: int) -> Sequence[Algorithm]:
        """Parts of the search that can be carried out now, side by side, by whoever asks and tells them.

        They are told apart by their `label`. None of a search that has to be asked batch by batch.

        Args:
            most: How many at most.
        """
        return ()

    def put(self, part: Algorithm) -> None:
        """Take back a part, or what another process has made of its state, further on its way; one too many is let go.

        The search then stands where it stood, and is to `read` on.
        """
        raise NotImplementedError(f"{self.name} has no parts")

    @property
    def unread(self) -> bool:
        """Whether there are batches of parts to `read`."""
        return False

    def read(self) -> None:
        """Take in the next batch of a part as if it had just been asked and told."""
        raise NotImplementedError(f"{self.name} has no parts")

    def gather(self) -> Iterator[None]:
        """End the search here, and take in the batches of all parts that are under way, one by one."""
        return iter(())

    # ------------------------------------------------------------------ how far it is

    @property
    @abstractmethod
    def done(self) -> bool:
        """Whether the search is at its end."""

    @property
    def ending(self) -> str:
        """What has ended it, where it is done: by default the parameter that is its length."""
        return self.length

    @classmethod
    def units_done(cls, evaluations: int, settings: Mapping[str, Any]) -> int:
        """How many units of its length are done: by default candidates.

        Args:
            evaluations: Candidates told so far.
            settings: The parameters by name; others may be among them.
        """
        return evaluations

    @property
    def generation(self) -> int:
        """Candidates that stop rules count as one iteration; by default as many as the paper's swarms have."""
        return GENERATION

    @property
    def progress(self) -> tuple[int, int]:
        """Units done and planned."""
        parameters = asdict(self.parameters)
        return self.units_done(self.evaluations, parameters), int(parameters[self.length])

    @property
    def iteration(self) -> int:
        """Number of batches told so far."""
        return len(self._history)

    @property
    def evaluations(self) -> int:
        """Number of candidates told so far."""
        return self._history[-1][3] if self._history else 0

    # ------------------------------------------------------------------ what was found

    @property
    @abstractmethod
    def best_position(self) -> Array:
        """Position of the best fitness, shape (D,)."""

    @property
    @abstractmethod
    def best_fitness(self) -> float:
        """The best fitness, +inf while there is none."""

    @property
    def agreement(self) -> Agreement | None:
        """What beginnings that know nothing of one another say of the best basin; None of a search without any."""
        return None

    @property
    @abstractmethod
    def basins(self) -> tuple[Array, Array]:
        """Good positions that differ, best first: positions (A, D) and fitness (A,), all of it finite."""

    @property
    def history(self) -> History:
        """The batches so far."""
        best, mean, valid, evaluations = zip(*self._history, strict=True) if self._history else ((), (), (), ())
        return History(
            np.array(best, dtype=float), np.array(mean, dtype=float),
            np.array(valid, dtype=np.int64), np.array(evaluations, dtype=np.int64),
        )  # fmt: skip

    # ------------------------------------------------------------------ the state

    def state(self) -> State:
        """Everything needed to carry on, to the last bit, at any point between two calls.

        Returns:
            NumPy arrays, and beside them only values that JSON holds exactly. The search space is not in it.
        """
        parameters = asdict(self.parameters).items()
        return {
            "algorithm": self.name,
            "parameters": {name: list(value) if isinstance(value, tuple) else value for name, value in parameters},
            "generator": checks.encode_generator(self._rng),
            "asked": self._asked,
            "positions": self._X.copy(),
            **{f"history_{name}": column for name, column in vars(self.history).items()},
            **self._memory(),
        }

    @classmethod
    def from_state(
        cls: type[A],
        state: Mapping[str, Any] | SavedState,
        space: SearchSpace,
        length: int | None = None,
        settings: Mapping[str, Any] | None = None,
    ) -> A:
        """The search that :meth:`state` described.

        Args:
            state: The state; arrays may come back as nested lists.
            space: The search space that it ran in.
            length: How long it shall go on, in its unit; by default as long as before. A search that is made longer on
                the way, or at its end, is another run than one of that length from the start.
            settings: Parameters by name, of which those that are changeable count; by default they stay, too.

        Raises:
            SearchError: The state is that of another algorithm or space, or an entry is missing or does not fit.
            SettingsError: A parameter in it is unknown or out of range.
        """
        saved = state if isinstance(state, SavedState) else SavedState(state)
        if (algorithm := saved.entry("algorithm")) != cls.name:
            raise SearchError(
                f"the saved search used '{algorithm}', not '{cls.name}'", value=algorithm, allowed=cls.name
            )
        parameters = saved.parameters(cls.Parameters)
        changes = {} if settings is None else {name: settings[name] for name in cls.changeable}
        if length is not None:
            changes[cls.length] = length
        parameters = replace(parameters, **changes)
        search = cls(space, saved.generator(), parameters)
        drawn = saved.array("positions", (None, space.box.dimension))
        search._X = space.box.checked(drawn, len(drawn))
        search._asked = bool(saved.entry("asked"))
        best = saved.array("history_best", (None,), infinite=True)
        mean = saved.array("history_mean", best.shape, infinite=True)
        counts = (saved.array(f"history_{name}", best.shape).astype(int) for name in ("valid", "evaluations"))
        columns = (column.tolist() for column in (best, mean, *counts))
        search._history = list(zip(*columns, strict=True))
        search._restore(saved)
        return search

    @abstractmethod
    def _memory(self) -> State:
        """What the algorithm itself has to remember, as copies; no name of it begins with "history"."""

    @abstractmethod
    def _restore(self, saved: SavedState) -> None:
        """Set what :meth:`_memory` described."""
