"""The stages of a many-basin search: what each asks for, what it makes of the answers, and which one comes next.

    SAMPLE   candidates of the first sample; descents begin at the best ones that lie apart
    SLOPE    where every descent begins, its gradient is asked for
    PROBE    without gradients: forward differences around it (RETRY: in the other direction where there was no value)
    STEP     a step of every descent, taken where it is better, with its gradient
    CHECK    where the descents have ended, evaluated afresh, goes into the archive of basins
    SCREEN   children of the best basins; of every few the best begins a descent, and so on from PROBE
             where the best of them has not gained for long, all begins anew, from SAMPLE with an empty archive; when
             the budget does not allow that any more, the archives are put together
    EVOLVE   CMA-ES around the best basins, where kinks stop the gradients, with the last share of the budget

Probes and steps carry a hint, whatever the evaluation gave for the place they come from (of an arm, its start pose).
A fitness that came by a hint never counts as the best one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from armdesign._types import Array
from armdesign.errors import SearchError
from armdesign.swarm import checks, operators, saved
from armdesign.swarm.archive import Archive, Canonical, apart
from armdesign.swarm.base import Sampler
from armdesign.swarm.children import children
from armdesign.swarm.descents import STEEPEST, Descents, Patience
from armdesign.swarm.evolution import Evolution
from armdesign.swarm.recipe import Recipe
from armdesign.swarm.region import Region, Slab
from armdesign.swarm.space import Box

SAMPLE, SLOPE, PROBE, RETRY, STEP, CHECK, SCREEN, EVOLVE, OVER = (
    "sample", "slope", "probe", "retry", "step", "check", "screen", "evolve", "over",
)  # fmt: skip
CHUNK, LEAST = 400, 100
GAIN = 5e-3
"""By how much the best basin has to become better, relative, for the search not to stall."""
AHEAD = 1e-3
"""How much better than the best a descent has to look, relative, to be evaluated without its hint on the way."""


class Stages:
    """The memory of a many-basin search and what it does with it; :class:`MultiBasin` gives it ask and tell."""

    def __init__(
        self,
        box: Box,
        budget: int,
        rng: np.random.Generator,
        sample: Sampler | None,
        anew: Sampler | None,
        slab: Slab | None,
        canonical: Callable[[Array], Array] | None,
        recipe: Recipe,
    ) -> None:
        """Draw the first sample; see MultiBasin."""
        self.budget = checks.whole("budget", budget)
        self.box, self._rng = box, checks.generator(rng)
        self.region, self.recipe = Region(box, slab), recipe
        self._draw = sample or (lambda rng, count: operators.uniform(rng, box, count))
        self._draw_anew = anew or self._draw
        self._archive = Archive(self.region.dimension, unit_form(self.region, canonical))
        self._aside = self._archive.emptied()  # basins of earlier beginnings
        self._mark, self._mark_at = np.inf, 0  # the best basin when it last gained, and the candidates told by then
        self._best, self._best_value = box.lower.copy(), np.inf
        self._stage, self._asked = SAMPLE, False
        self._X, self._hints = np.zeros((0, box.dimension)), np.zeros((0, 0))
        self._sloped = True  # whether gradients come with the fitness; found out at the first SLOPE
        self._extra = 0  # rows at the end of the batch that check the descent in the lead
        self._signs = self._slopes = np.zeros((0, self.region.dimension))
        self._descents: Descents | None = None
        self._evolutions: list[Evolution] = []
        self._leg_end = 0
        self._sample_value = np.zeros(0)
        self._sample_hint = np.zeros((0, 0))
        self._history: list[tuple[float, float, int, int]] = []
        self._sample = self._sample_by(self._draw)

    def _sample_by(self, draw: Sampler) -> Array:
        """Positions to begin with."""
        count = min(self.budget, max(LEAST, round(self.recipe.sample * self.budget)))
        return checks.positions(draw(self._rng, count), self.box, count)

    @property
    def evaluations(self) -> int:
        """Candidates told so far."""
        return self._history[-1][3] if self._history else 0

    def _lead(self, X: Array, values: Array) -> None:
        """Keep the best of what was evaluated without a hint."""
        if len(values) and values.min() < self._best_value:
            k = int(np.argmin(values))
            self._best, self._best_value = X[k].copy(), float(values[k])

    # ------------------------------------------------------------------ what is asked

    def _batch(self) -> tuple[Array, Array, int]:
        """Positions, their hints, and how many at the end are extra, of the present stage."""
        if self._stage == SAMPLE:
            first = len(self._sample_value)
            return self._unhinted(self._sample[first : first + CHUNK])
        if self._stage == SCREEN:
            parents = self._archive.U[: self.recipe.parents]
            count = self.recipe.descents * self.recipe.screened
            return self._unhinted(self.region.positions(children(self.region, parents, count, self._rng)))
        if self._stage == EVOLVE:
            U = np.vstack([evolution.ask(self._rng) for evolution in self._evolutions])
            return self._unhinted(self.region.positions(U))
        if self._stage == CHECK:
            return self._unhinted(self.region.positions(self._at_hand().U))
        if self._stage == STEP:
            U, hints = self._at_hand().steps()
            batch = self.region.positions(U), hints
            return self._with_leader(*batch) if self._sloped else (*batch, 0)
        if self._stage == SLOPE:
            U, hints = self._at_hand().places()
            return self.region.positions(U), hints, 0
        U, hints = self._at_hand().probes(self._signs)
        return self._with_leader(self.region.positions(U), hints)

    def _unhinted(self, X: Array) -> tuple[Array, Array, int]:
        """A batch without hints."""
        return X, np.full((len(X), self._archive.hint.shape[1]), np.nan), 0

    def _with_leader(self, X: Array, hints: Array) -> tuple[Array, Array, int]:
        """A batch; behind it the descent in the lead without its hint, where that looks like a new best."""
        descents = self._at_hand()
        k = int(np.argmin(descents.value))
        ahead = descents.value[k] < self._best_value * (1.0 - AHEAD)
        if not ahead or self._stage not in (PROBE, STEP) or not np.any(descents.last[k]):
            return X, hints, 0
        place = self.region.positions(descents.U[k : k + 1])
        return np.vstack([X, place]), np.vstack([hints, np.full((1, hints.shape[1]), np.nan)]), 1

    # ------------------------------------------------------------------ what is told

    def _take(self, values: Array, hints: Array, slopes: Array | None, told: int) -> None:
        """Pass the values on to the present stage, and go to the next one."""
        if self._stage in (SLOPE, STEP):
            self._take_slopes(values, hints, slopes)
            return
        if self._extra:
            place = self.region.units(self._X[-1:])
            self._archive.add(place, values[-1:], hints[-1:])
            values, hints = values[:-1], hints[:-1]
        {
            SAMPLE: self._sampled, SCREEN: self._screened, EVOLVE: self._evolved, CHECK: self._checked,
            PROBE: self._probed, RETRY: self._retried,
        }[self._stage](values, hints, told)  # fmt: skip

    def _take_slopes(self, values: Array, hints: Array, slopes: Array | None) -> None:
        """Pass on values that may have gradients; without any, probe from now on."""
        count = len(values) - self._extra
        if self._extra:
            self._archive.add(self.region.units(self._X[count:]), values[count:], hints[count:])
        descents = self._at_hand()
        known = None if slopes is None else self.region.unit_slopes(slopes[:count])
        if self._stage == STEP:
            self._stepped(values[:count], hints[:count], known if self._sloped else None)
        elif known is None:
            self._sloped = False
            self._signs, self._stage = descents.signs(), PROBE
        else:
            descents.learn(np.clip(known, -STEEPEST, STEEPEST))
            self._stage = STEP

    def _sampled(self, values: Array, hints: Array, told: int) -> None:
        """Collect the first sample; when it is complete, begin descents."""
        known = self._sample_hint if len(self._sample_value) else np.zeros((0, hints.shape[1]))
        self._sample_value, self._sample_hint = np.r_[self._sample_value, values], np.vstack([known, hints])
        if len(self._sample_value) < len(self._sample):
            return
        order = np.argsort(self._sample_value, kind="stable")
        order = order[np.isfinite(self._sample_value[order])]
        if not len(order):  # nothing to begin from: sample on
            self._sample = checks.positions(self._draw_anew(self._rng, CHUNK), self.box, CHUNK)
            self._sample_value, self._sample_hint = np.zeros(0), np.zeros((0, 0))
            return
        U = self.region.units(self._sample[order])
        starts = max(1, self.budget // self.recipe.candidates_per_start)
        chosen = apart(self._archive.canonical(U), self.recipe.spread, starts)
        picked = order[chosen]
        self._archive.hint = np.zeros((0, hints.shape[1]))
        self._begin(U[chosen], self._sample_value[picked], self._sample_hint[picked], self.recipe.first_reach)
        self._sample = np.zeros((0, self.box.dimension))
        self._sample_value, self._sample_hint = np.zeros(0), np.zeros((0, 0))

    def _screened(self, values: Array, hints: Array, told: int) -> None:
        """Begin a descent from the best child of every group."""
        table = values.reshape(-1, self.recipe.screened)
        best = np.arange(len(table)) * self.recipe.screened + np.argmin(table, axis=1)
        best = best[np.isfinite(values[best])]
        if len(best):
            self._begin(self.region.units(self._X[best]), values[best], hints[best], self.recipe.reach)

    def _at_hand(self) -> Descents:
        """The descents under way.

        Raises:
            SearchError: There are none in this stage, so the state is not one of ours.
        """
        if self._descents is None:
            raise SearchError(f"the saved search has no descents in its stage '{self._stage}'", fix=saved.FIX)
        return self._descents

    def _begin(self, U: Array, values: Array, hints: Array, reach: float) -> None:
        """Begin descents."""
        bar = self._archive.rank_value(self.recipe.bar) if len(self._archive) else -np.inf
        self._descents = Descents(self.region, U, values, hints, reach, Patience(), bar)
        self._signs, self._stage = self._descents.signs(), SLOPE if self._sloped else PROBE

    def _probed(self, values: Array, hints: Array, told: int) -> None:
        """Take the gradients, or try the other direction where a probe had no value."""
        self._slopes = self._at_hand().slopes(self._signs, values)
        unknown = np.isnan(self._slopes) & (self._signs != 0.0)
        if unknown.any():
            self._signs, self._stage = np.where(unknown, -self._signs, 0.0), RETRY
            return
        self._at_hand().learn(self._slopes)
        self._stage = STEP

    def _retried(self, values: Array, hints: Array, told: int) -> None:
        """Complete the gradients."""
        others = self._at_hand().slopes(self._signs, values)
        self._at_hand().learn(np.where(np.isnan(self._slopes), others, self._slopes))
        self._stage = STEP

    def _stepped(self, values: Array, hints: Array, slopes: Array | None) -> None:
        """Move the descents."""
        descents = self._at_hand()
        gradients = None if slopes is None else np.clip(slopes, -STEEPEST, STEEPEST)
        descents.move(self.region.units(self._X[: len(values)]), values, hints, gradients)
        if not descents.live.any():
            self._stage = CHECK
        elif not self._sloped and descents.moved().any():
            self._signs, self._stage = descents.signs(), PROBE
        else:
            self._stage = STEP

    def _checked(self, values: Array, hints: Array, told: int) -> None:
        """Put the ends of the descents into the archive."""
        self._archive.add(self.region.units(self._X), values, hints)
        self._descents, self._stage = None, SCREEN
        if self._archive.best < self._mark * (1.0 - GAIN):
            self._mark, self._mark_at = self._archive.best, told
        elif told - self._mark_at > self.recipe.stall * self.budget:
            self._begin_anew(told)

    def _begin_anew(self, told: int) -> None:
        """Begin with another sample, or go on with all basins where the budget does not allow that."""
        needed = (self.recipe.sample + self.recipe.stall + self.recipe.finish) * self.budget
        self._aside.take(self._archive)
        if told + needed > self.budget:
            self._archive, self._aside = self._aside, self._archive.emptied()
            self._mark_at = self.budget
            return
        self._archive = self._archive.emptied()
        self._mark, self._mark_at = np.inf, told
        self._sample, self._stage = self._sample_by(self._draw_anew), SAMPLE

    def _evolved(self, values: Array, hints: Array, told: int) -> None:
        """Let the evolutions go on."""
        U, first = self.region.units(self._X), 0
        self._archive.add(U, values, hints)
        for evolution in self._evolutions:
            group = slice(first, first + evolution.population)
            evolution.tell(U[group], values[group])
            first = group.stop

    # ------------------------------------------------------------------ the budget

    def _settle(self, told: int) -> None:
        """Leave a stage that the budget does not allow any more."""
        last = self.budget - round(self.recipe.finish * self.budget)
        if self._stage in (SLOPE, PROBE, RETRY, STEP, SCREEN) and told + self._next_size() > last:
            self._stage = CHECK if self._descents is not None else EVOLVE
        if self._stage == CHECK and self._descents is not None and told + len(self._descents.U) > self.budget:
            self._stage = OVER
        if self._stage == EVOLVE and (not self._evolutions or told >= self._leg_end):
            self._next_leg(told)
        if self._stage == EVOLVE and told + sum(e.population for e in self._evolutions) > self.budget:
            self._stage = OVER
        if self._stage == SAMPLE:
            self._sample = self._sample[: len(self._sample_value) + self.budget - told]
            if told >= self.budget:
                self._stage = OVER

    def _next_size(self) -> int:
        """Number of candidates of the next batch, or a few more."""
        if self._stage == SCREEN or self._descents is None:
            return self.recipe.descents * self.recipe.screened
        live = int(self._descents.live.sum())
        if self._sloped:
            return 2 * live + 1
        return live * (self.region.dimension + 3) if self._stage == PROBE else live * self.region.dimension

    def _next_leg(self, told: int) -> None:
        """Begin the evolutions: of the two best basins with two thirds of what is left, then of the winner."""
        self._archive.take(self._aside)
        if not len(self._archive):
            self._stage = OVER
        elif not self._evolutions:
            self._evolutions = [Evolution(u, self.recipe.sigma) for u in self._archive.U[:2]]
            self._leg_end = told + 2 * (self.budget - told) // 3
        else:
            self._evolutions = [Evolution(self._archive.U[0], self.recipe.last_sigma)]
            self._leg_end = self.budget


def unit_form(region: Region, canonical: Callable[[Array], Array] | None) -> Canonical:
    """The canonical form on unit coordinates."""
    if canonical is None:
        return lambda U: U
    return lambda U: region.units(canonical(region.positions(U)))
