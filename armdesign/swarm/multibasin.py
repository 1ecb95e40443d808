"""A search over many basins: a spread sample, descents by gradients, children of the best basins, a last evolution.

What happens in between is in :mod:`armdesign.swarm.stages`; here is what the caller sees of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import SearchError
from armdesign.swarm import checks, generator_state, saved
from armdesign.swarm.base import History, Sampler, State
from armdesign.swarm.descents import Descents, Patience
from armdesign.swarm.evolution import Evolution
from armdesign.swarm.recipe import Recipe
from armdesign.swarm.region import Slab
from armdesign.swarm.space import Box
from armdesign.swarm.stages import OVER, SLOPE, STEP, Stages


class MultiBasin(Stages):
    """Minimises a fitness which the caller computes; as with the swarms, ask for positions and tell their fitness.

    Beside the fitness the caller may tell a hint for every position, and gets it back with the positions near it.
    """

    name: ClassVar[str] = "multibasin"

    def __init__(
        self,
        box: Box,
        budget: int,
        rng: np.random.Generator,
        *,
        sample: Sampler | None = None,
        anew: Sampler | None = None,
        slab: Slab | None = None,
        canonical: Callable[[Array], Array] | None = None,
        recipe: Recipe | None = None,
    ) -> None:
        """Draw the first sample.

        Args:
            box: Bounds of the positions, D entries.
            budget: Most candidates ever asked for.
            rng: Source of every draw.
            sample: Draws the first positions; default uniform in the box.
            anew: Draws them whenever the search begins anew; default as at first.
            slab: A linear constraint that the positions fulfil; default none.
            canonical: Positions (N, D) in a form that is the same for equal designs; default as they are.
            recipe: How the budget is spent.

        Raises:
            SettingsError: A setting is out of range.
            SearchError: `sample` returned something else than positions in the box.
        """
        super().__init__(box, budget, rng, sample, anew, slab, canonical, Recipe() if recipe is None else recipe)

    # ------------------------------------------------------------------ ask and tell

    @property
    def done(self) -> bool:
        """Whether the budget is spent."""
        return self._stage == OVER

    def ask(self) -> Array:
        """Positions whose fitness is wanted, shape (N, D), N differs from time to time; the same until they are told.

        Raises:
            SearchError: The budget is spent.
        """
        if self.done:
            raise SearchError("the budget of candidates is spent", value=self.budget, fix="Look at `done` before ask()")
        if not self._asked:
            self._X, self._hints, self._extra = self._batch()
            self._asked = True
        return self._X.copy()

    @property
    def hints(self) -> Array | None:
        """Hints of the positions last asked for, shape (N, H), rows of NaN where there is none; None without any."""
        return self._hints.copy() if self._hints.shape[1] and not np.isnan(self._hints).all() else None

    @property
    def wants_slopes(self) -> bool:
        """Whether gradients of the fitness at the positions last asked for would help."""
        return self._stage in (SLOPE, STEP) and self._sloped

    @property
    def cutoff(self) -> Array:
        """Fitness beyond which a position asked for need not be evaluated further, shape (N,).

        Told as +inf instead, the run stays the same to the last bit.
        """
        limits = np.full(len(self._X), np.inf)
        if self._stage == STEP and self._descents is not None and not self._sloped:
            limits[: len(limits) - self._extra] = self._descents.value[self._descents.live]
        return limits

    def tell(
        self,
        fitness: ArrayLike,
        valid: ArrayLike,
        hints: ArrayLike | None = None,
        slopes: ArrayLike | None = None,
    ) -> None:
        """Take the fitness of the positions last asked for.

        Args:
            fitness: Smaller is better, +inf for none, shape (N,).
            valid: Whether the position fulfils the constraints, shape (N,); it is only counted.
            hints: What helps to evaluate positions nearby, shape (N, H), NaN where there is nothing; default nothing.
            slopes: Gradients of the fitness, shape (N, D), NaN where there is none; default none. They are heeded where
                ``wants_slopes`` is true; without them the search finds its gradients by probes.

        Raises:
            SearchError: Nothing was asked, a wrong shape, or a fitness of NaN or -inf. The search is left as it was.
        """
        if not self._asked:
            raise SearchError(
                "the search was told a fitness that it did not ask for", fix="Call ask() before each tell()"
            )
        values, flags = checks.fitness(fitness, len(self._X)), checks.validity(valid, len(self._X))
        given = np.zeros((len(values), 0)) if hints is None else checks.numbers("the hints", hints, (len(values), None))
        gradients = None if slopes is None else checks.numbers("the slopes", slopes, self._X.shape)
        self._asked = False
        pure = np.isnan(self._hints).all(axis=1)
        self._lead(self._X[pure], values[pure])
        told = self.evaluations + len(values)
        self._take(values, given, gradients, told)
        known = self._archive.value
        mean = float(known.mean()) if len(known) else np.inf
        self._history.append((self._best_value, mean, int(np.count_nonzero(flags)), told))
        self._settle(told)

    # ------------------------------------------------------------------ what was found

    @property
    def iteration(self) -> int:
        """Batches told so far."""
        return len(self._history)

    @property
    def best_position(self) -> Array:
        """Position of the best fitness, shape (D,)."""
        return self._best.copy()

    @property
    def best_fitness(self) -> float:
        """The best fitness, +inf while there is none."""
        return self._best_value

    @property
    def basins(self) -> tuple[Array, Array]:
        """The basins found, best first: positions (A, D) and fitness (A,); before the first one the best place."""
        known = self._archive.emptied()
        known.take(self._aside)
        known.take(self._archive)
        if not len(known) and np.isfinite(self._best_value):
            return self._best[None].copy(), np.array([self._best_value])
        return self.region.positions(known.U), known.value.copy()

    @property
    def history(self) -> History:
        """The batches so far; `mean` is that of the basins in the archive."""
        columns = zip(*self._history, strict=True) if self._history else ((), (), (), ())
        best, mean, valid, evaluations = columns
        return History(
            np.array(best, dtype=float), np.array(mean, dtype=float),
            np.array(valid, dtype=np.int64), np.array(evaluations, dtype=np.int64),
        )  # fmt: skip

    # ------------------------------------------------------------------ the state

    def state(self) -> State:
        """Everything needed to carry on, to the last bit, at any point between two calls; see Swarm.state."""
        history = self.history
        content: State = {
            "algorithm": self.name, "parameters": {f.name: getattr(self.recipe, f.name) for f in fields(Recipe)},
            "budget": self.budget, "generator": generator_state.encode(self._rng), "stage": self._stage,
            "asked": self._asked, "extra": self._extra, "sloped": self._sloped, "leg_end": self._leg_end,
            "lower": self.box.lower.copy(), "upper": self.box.upper.copy(), "angular": self.box.angular.copy(),
            "slab_weights": self.region.slab.weights.copy(), "slab": [self.region.slab.low, self.region.slab.high],
            "positions": self._X.copy(), "hints": self._hints.copy(),
            "signs": self._signs.copy(), "slopes": self._slopes.copy(),
            "sample": self._sample.copy(), "sample_value": self._sample_value.copy(),
            "sample_hint": self._sample_hint.copy(),
            "best": self._best.copy(), "best_value": np.array([self._best_value]),
            "mark": np.array([self._mark]), "mark_at": self._mark_at,
            "evolutions": len(self._evolutions), "descending": self._descents is not None,
            "history_best": history.best, "history_mean": history.mean,
            "history_valid": history.valid, "history_evaluations": history.evaluations,
        }  # fmt: skip
        content |= self._archive.state("archive") | self._aside.state("aside")
        if self._descents is not None:
            content |= self._descents.state()
        for k, evolution in enumerate(self._evolutions):
            content |= evolution.state(f"evolution_{k}")
        return content

    @classmethod
    def from_state(
        cls,
        state: Mapping[str, Any],
        *,
        anew: Sampler | None = None,
        canonical: Callable[[Array], Array] | None = None,
    ) -> MultiBasin:
        """The search that :meth:`state` described; sampler and canonical form as they were given before.

        Raises:
            SearchError: The state is that of another algorithm, or an entry is missing or does not fit.
            SettingsError: A setting in it is out of range.
        """
        saved.check_algorithm(state, cls.name)
        box = Box(*(saved.entry(state, name) for name in ("lower", "upper", "angular")))
        slab = Slab(saved.entry(state, "slab_weights"), *saved.entry(state, "slab"))
        recipe = Recipe(**saved.settings(state, "parameters"))
        rng = np.random.default_rng(0)
        search = cls(box, int(saved.entry(state, "budget")), rng, slab=slab, canonical=canonical, recipe=recipe)
        search._rng = generator_state.decode(saved.entry(state, "generator"))
        search._draw_anew = anew or search._draw_anew
        search._restore(state)
        return search

    def _restore(self, state: Mapping[str, Any]) -> None:
        """Set what the constructor cannot: the search's memory."""
        D, K = self.box.dimension, self.region.dimension
        self._stage, self._asked = str(saved.entry(state, "stage")), bool(saved.entry(state, "asked"))
        self._extra, self._leg_end = int(saved.entry(state, "extra")), int(saved.entry(state, "leg_end"))
        self._sloped = bool(saved.entry(state, "sloped"))
        self._X = saved.array(state, "positions", (None, D))
        self._hints = saved.hints(state, "hints", len(self._X))
        self._signs = saved.array(state, "signs", (None, K))
        self._slopes = saved.numbers(state, "slopes", (None, K))
        self._sample = saved.array(state, "sample", (None, D))
        self._sample_value = saved.array(state, "sample_value", (None,), infinite=True)
        self._sample_hint = saved.hints(state, "sample_hint", len(self._sample_value))
        self._best = saved.array(state, "best", (D,))
        self._best_value = float(saved.array(state, "best_value", (1,), infinite=True)[0])
        self._archive.restore(state, "archive")
        self._aside.restore(state, "aside")
        self._mark = float(saved.array(state, "mark", (1,), infinite=True)[0])
        self._mark_at = int(saved.entry(state, "mark_at"))
        count = int(saved.entry(state, "evolutions"))
        self._evolutions = [Evolution.from_state(state, f"evolution_{k}") for k in range(count)]
        if saved.entry(state, "descending"):
            self._descents = Descents.from_state(state, self.region, Patience())
        best = saved.array(state, "history_best", (None,), infinite=True)
        told = (len(best),)
        mean = saved.array(state, "history_mean", told, infinite=True)
        counts = (saved.array(state, f"history_{name}", told) for name in ("valid", "evaluations"))
        columns = zip(best.tolist(), mean.tolist(), *counts, strict=True)
        self._history = [(b, m, int(valid), int(evaluations)) for b, m, valid, evaluations in columns]
