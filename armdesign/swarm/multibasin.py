"""A search over many basins: a spread sample, descents by gradients, children of the best basins, a last evolution.

Its stages, what each asks for, what it makes of the answers, and which one comes next:

    SAMPLE   candidates of the first sample; descents begin at the best ones that lie apart
    DESCEND  steps of every descent, with gradients or probes around it (`descents.py` has the phases)
    CHECK    where the best descents have ended, evaluated afresh and in full, goes into the archive of basins
    SCREEN   children of the best basins; of every few the best begins a descent, and so on from DESCEND
             where the best of them has not gained for long, the best few descend once more, in full, and the beginning
             has ended: all begins anew, from SAMPLE with an empty archive, until enough beginnings have ended alike;
             when the budget does not allow another one, the archives are put together
    EVOLVE   CMA-ES around the best basins, where kinks stop the gradients

Sample, children and descents may be evaluated coarsely, as the caller can. Probes and steps carry a hint, whatever the
evaluation gave for the place they come from (of an arm, its start pose). A fitness that is coarse or came by a hint
never counts as the best one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.errors import SearchError, SettingsError
from armdesign.swarm import checks
from armdesign.swarm.agreement import LEVELS, Agreement, agreement
from armdesign.swarm.algorithm import Algorithm, State
from armdesign.swarm.basins import Archive, apart, children
from armdesign.swarm.checks import Mask, SavedState
from armdesign.swarm.descents import PROBE, SLOPE, STEP, Descents, Patience
from armdesign.swarm.evolution import Evolution
from armdesign.swarm.space import Region, SearchSpace

SAMPLE, DESCEND, CHECK, SCREEN, EVOLVE, OVER = "sample", "descend", "check", "screen", "evolve", "over"
CHUNK, LEAST = 400, 100
"""Most candidates of the sample in one batch, and the smallest sample."""
FIRST = 40
"""Candidates of the first batch of all, in full, so that there is a best one from then on."""
COUNTS, FLAGS = ("extra", "leg_end", "mark_at", "end", "descended", "once"), ("sloped", "fine", "closing")
POLISH_REACH, POLISH_ROUNDS = 0.02, 25
"""Length of the first step of descents in full from where coarse ones have ended, and their most rounds."""
GAIN = 5e-3
"""By how much the best basin has to become better, relative, for the search not to stall."""
AHEAD = 1e-3
"""How much better than the best a descent has to look, relative, to be evaluated without its hint on the way."""


@dataclass(frozen=True)
class MultiBasinParameters:
    """The budget and how it is spent.

    Attributes:
        budget: Largest number of candidates.
        effort: How sure the search has to be to end before: quick, normal, thorough, or budget for never.
        coarse: How coarsely candidates are looked at that only lead the way, whatever that means to the caller; 0: not.
        scale: Candidates per free entry by which a beginning is measured, where the budget is not less than that.
        sample: Share of the scale for the first sample of a beginning.
        candidates_per_start: One first descent for so many candidates of the scale.
        spread: Smallest distance of two first descents in unit coordinates.
        first_reach: Length of the first step from the sample.
        reach: Length of the first step from a child.
        descents: Descents begun at a time later on.
        screened: Children evaluated for each of them.
        parents: How many of the best basins have children.
        bar: Rank of the basin that a descent has to compare with in order not to be given up early.
        stall: Candidates per free entry squared without a gain after which a beginning ends, its basins kept aside.
        checked: Share of the descents whose ends are evaluated in full, the best.
        polished: Basins that descend in full where descents were coarse, the best.
        together: Share of the budget kept for the basins of all beginnings together, where these do not agree.
        finish: Share of the budget for the evolution; of the scale where beginnings agree.
        sigma: Step size of the evolution of the best basins.
        last_sigma: Step size of the evolution of the winner.
    """

    budget: int = 50000
    effort: str = "normal"
    coarse: int = 100
    scale: int = 2000
    sample: float = 0.06
    candidates_per_start: int = 400
    spread: float = 0.3
    first_reach: float = 0.15
    reach: float = 0.08
    descents: int = 24
    screened: int = 6
    parents: int = 8
    bar: int = 3
    stall: float = 25.0
    checked: float = 0.5
    polished: int = 4
    together: float = 0.2
    finish: float = 0.02
    sigma: float = 0.03
    last_sigma: float = 0.005

    def __post_init__(self) -> None:
        """Check what a caller sets.

        Raises:
            SettingsError: The budget or the coarseness is no whole number or too small, or the effort is unknown.
        """
        checks.whole("budget", self.budget)
        checks.number("coarse", self.coarse, 0.0)
        if self.effort not in LEVELS:
            raise SettingsError(f"there is no effort {self.effort!r}", value=self.effort, allowed=list(LEVELS))


class MultiBasin(Algorithm):
    """Descends by gradients in many basins within a budget of candidates.

    Beside the fitness the caller may tell a hint for every position, and gets it back with the positions near it; and
    gradients where `wants_slopes` is true. Without gradients the search finds them by probes.
    """

    name, unit, length, takes_slopes = "multibasin", "candidate", "budget", True
    changeable = ("effort",)
    Parameters = MultiBasinParameters
    parameters: MultiBasinParameters

    def __init__(
        self, space: SearchSpace, rng: np.random.Generator, parameters: MultiBasinParameters | None = None
    ) -> None:
        """Begin; the first draw is made by the first `ask`.

        Args:
            space: Where to search; at least one entry of a position is free.
            rng: Source of every draw.
            parameters: The budget and how it is spent; by default as published.
        """
        super().__init__(space, rng, parameters)
        self.budget, self.region = self.parameters.budget, Region(space)
        self._scale = min(self.budget, self.parameters.scale * self.region.dimension)
        self._end = self.budget  # candidates evaluated when the search ends; less once beginnings agree
        self._ends: list[float] = []  # the best basin of every beginning that has ended
        self._descended = self._once = 0  # descents of beginnings that have ended, and basins that only one has met
        self._fine = False  # whether the descents at hand are those in full
        self._closing = False  # whether the last descents are due or have been
        self._stage = SAMPLE
        self._hints = np.zeros((0, 0))
        self._best, self._best_value = self.box.lower.copy(), np.inf
        self._archive = Archive(self.region)
        self._aside = Archive(self.region)  # basins of earlier beginnings
        self._mark, self._mark_at = np.inf, 0  # the best fitness when it last gained, and the candidates by then
        self._sample, self._sample_value, self._sample_hint = (
            np.zeros((0, self.box.dimension)),
            np.zeros(0),
            np.zeros((0, 0)),
        )
        self._descents: Descents | None = None
        self._sloped = True  # whether gradients come with the fitness; found out by the first descents
        self._extra = 0  # rows at the end of the batch that check the descent in the lead
        self._evolutions: list[Evolution] = []
        self._leg_end = 0  # candidates evaluated when the evolutions end

    # ------------------------------------------------------------------ what the caller sees

    @property
    def hints(self) -> Array | None:
        """Hints of the positions last asked for, shape (N, H), rows of NaN where there is none; None without any."""
        return self._hints.copy() if self._hints.shape[1] and not np.isnan(self._hints).all() else None

    @property
    def _phase(self) -> str:
        """What the descents ask for, empty in the other stages."""
        return self._running.phase if self._stage == DESCEND else ""

    @property
    def wants_slopes(self) -> bool:
        """Whether gradients of the fitness at the positions last asked for would help."""
        return self._sloped and self._phase in (SLOPE, STEP)

    @property
    def coarse(self) -> int:
        """See Algorithm.coarse."""
        looking = self._stage == SCREEN or (self._stage == DESCEND and not self._fine)
        looking |= self._stage == SAMPLE and bool(self._history)
        return self.parameters.coarse if looking else 0

    @property
    def cutoff(self) -> Array:
        """Where steps come without gradients, the fitness that each has to fall below; else +inf, shape (N,)."""
        limits = np.full(len(self._X), np.inf)
        if self._phase == STEP and not self._sloped:
            descents = self._running
            limits[: len(limits) - self._extra] = descents.value[descents.live]
        return limits

    @property
    def done(self) -> bool:
        """Whether the budget is spent, or as many beginnings agree as the effort asks for."""
        return self._stage == OVER

    @property
    def ending(self) -> str:
        """See Algorithm.ending."""
        return "agreement" if self._end < self.budget else self.length

    @property
    def agreement(self) -> Agreement:
        """See Algorithm.agreement.

        Beginnings share nothing but the generator, so that a basin which most of them miss would have to be rare for
        all.
        """
        return agreement(self._ends, self.region.dimension, self._descended, self._once)

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
        known = self._aside.merged(self._archive)
        if not len(known) and np.isfinite(self._best_value):
            return self._best[None].copy(), np.array([self._best_value])
        return self.region.positions(known.U), known.value.copy()

    # ------------------------------------------------------------------ what is asked

    def _next(self) -> Array:
        """The batch of the present stage."""
        if self._stage == DESCEND:
            return self._descending()
        if self._stage == SAMPLE:
            if not self._history:
                self._sample = self.space.draw(self._rng, self._sample_size)
            first = len(self._sample_value)
            X = self._sample[first : first + (CHUNK if self._history or not self.parameters.coarse else FIRST)]
        else:
            if self._stage == SCREEN:
                parents = self._archive.U[: self.parameters.parents]
                count = self.parameters.descents * self.parameters.screened
                U = children(self.region, parents, count, self._rng)
            elif self._stage == EVOLVE:
                U = np.vstack([evolution.ask(self._rng) for evolution in self._evolutions])
            else:  # CHECK
                U = self._running.U[self._checkable]
            X = self.region.positions(U)
        self._hints, self._extra = np.full((len(X), self._archive.hint.shape[1]), np.nan), 0
        return X

    def _descending(self) -> Array:
        """What the descents ask for; behind it the one in the lead without its hint, where that looks a new best."""
        descents = self._running
        U, self._hints = descents.ask()
        X, self._extra = self.region.positions(U), 0
        if self.coarse:
            return X
        k = int(np.argmin(descents.value))
        ahead = descents.value[k] < self._best_value * (1.0 - AHEAD)
        soon = self._phase == PROBE or (self._phase == STEP and self._sloped)
        if not ahead or not soon or not np.any(descents.last[k]):
            return X
        self._extra = 1
        self._hints = np.vstack([self._hints, np.full((1, self._hints.shape[1]), np.nan)])
        return np.vstack([X, self.region.positions(descents.U[k : k + 1])])

    # ------------------------------------------------------------------ what is told

    def _take(self, values: Array, valid: Mask, hints: Array, slopes: Array | None) -> float:
        """Keep the best, let the present stage learn, and go to the next one."""
        told = self.evaluations + len(values)
        pure = np.where(np.isnan(self._hints).all(axis=1), values, np.inf)  # a hint may flatter
        if self.coarse:
            pure[:] = np.inf
        k = int(np.argmin(pure))
        if pure[k] < self._best_value:
            self._best, self._best_value = self._X[k].copy(), float(pure[k])
        self._learn(values, hints, slopes, told)
        # before the next stage may merge or empty the archive
        mean = float(self._archive.value.mean()) if len(self._archive) else np.inf
        self._settle(told)
        return mean

    def _learn(self, values: Array, hints: Array, slopes: Array | None, told: int) -> None:
        """Pass the answers on to the present stage, which says what comes next."""
        count = len(values) - self._extra
        U = self.region.units(self._X)
        if self._stage == CHECK:
            met = np.full(len(U), 0.0 if self._fine else 1.0)
            self._archive.add(U, values, hints, self._running.value[self._checkable], met)
        elif self._stage == EVOLVE or self._extra:  # evaluated without a hint, near a minimum
            first = count if self._extra else 0
            self._archive.add(U[first:], values[first:], hints[first:], hits=np.zeros(len(U) - first))
        if self._stage == DESCEND:
            descents = self._running
            known = None if slopes is None else self.region.unit_slopes(slopes[:count])
            descents.tell(U[:count], values[:count], hints[:count], known)
            self._sloped = descents.sloped
            if not descents.live.any():
                self._stage = CHECK
        elif self._stage == SAMPLE:
            self._sampled(values, hints)
        elif self._stage == SCREEN:
            table = values.reshape(-1, self.parameters.screened)  # a group of children per descent
            best = np.arange(len(table)) * self.parameters.screened + np.argmin(table, axis=1)
            best = best[np.isfinite(values[best])]
            if len(best):
                self._begin(U[best], values[best], hints[best], self.parameters.reach)
        elif self._stage == CHECK:
            self._checked(told)
        else:
            first = 0
            for evolution in self._evolutions:
                group = slice(first, first + evolution.population)
                evolution.tell(U[group], values[group])
                first = group.stop

    def _sampled(self, values: Array, hints: Array) -> None:
        """Collect the first sample; when it is complete, begin descents."""
        known = self._sample_hint if len(self._sample_value) else np.zeros((0, hints.shape[1]))
        self._sample_value, self._sample_hint = np.r_[self._sample_value, values], np.vstack([known, hints])
        if len(self._sample_value) < len(self._sample):
            return
        values, hints = self._sample_value, self._sample_hint
        self._sample_value, self._sample_hint = np.zeros(0), np.zeros((0, 0))
        order = np.argsort(values, kind="stable")
        order = order[np.isfinite(values[order])]
        if not len(order):  # nothing to begin from: sample on
            self._sample = self.space.draw(self._rng, CHUNK, first=False)
            return
        U = self.region.units(self._sample[order])
        starts = max(1, self._scale // self.parameters.candidates_per_start)
        chosen = apart(self.region.canonical(U), self.parameters.spread, starts)
        picked = order[chosen]
        self._archive.hint = np.zeros((0, hints.shape[1]))
        self._begin(U[chosen], values[picked], hints[picked], self.parameters.first_reach)
        self._sample = np.zeros((0, self.box.dimension))

    @property
    def _running(self) -> Descents:
        """The descents that are running.

        Raises:
            SearchError: There are none in this stage, so the state is not one of ours.
        """
        if self._descents is None:
            raise SearchError(f"the saved search has no descents in its stage '{self._stage}'", fix=checks.FIX)
        return self._descents

    def _begin(self, U: Array, values: Array, hints: Array, reach: float) -> None:
        """Begin descents."""
        ranked = np.sort(self._archive.look)  # good enough is what looks as good as the basin of that rank, or the last
        bar = float(ranked[min(self.parameters.bar, len(ranked) - 1)]) if len(ranked) else -np.inf
        self._descents = Descents(self.region, U, values, hints, Patience(reach, bar), sloped=self._sloped)
        self._stage = DESCEND

    def _polish(self) -> None:
        """Begin descents in full at the best basins."""
        best, patience = self._archive, Patience(POLISH_REACH, np.inf, halve_at=-1, rounds=POLISH_ROUNDS)
        chosen = slice(0, self.parameters.polished)
        U = self.region.pulled_in(best.U[chosen], 1e-9)
        self._descents = Descents(
            self.region, U, best.value[chosen], best.hint[chosen], patience, sloped=self._sloped
        )  # fmt: skip
        self._fine, self._stage = True, DESCEND

    @property
    def _checkable(self) -> Array:
        """Which of the descents have ended well enough to be evaluated in full: indices, in their order."""
        value = self._running.value
        count = len(value) if self._fine else max(1, round(self.parameters.checked * len(value)))
        return np.sort(np.argsort(value, kind="stable")[:count])

    def _checked(self, told: int) -> None:
        """Go on from the archive, which holds the ends of the descents now; the beginning ends if it has not gained."""
        self._descents, self._stage = None, SCREEN
        fine, self._fine = self._fine, False
        if self._closing:
            self._stage = EVOLVE
        elif fine:
            self._ended(told)
        elif self._archive.best < self._mark * (1.0 - GAIN):
            self._mark, self._mark_at = self._archive.best, told
        elif told - self._mark_at > self._patience:
            if self.parameters.coarse and len(self._archive):
                self._polish()
            else:
                self._ended(told)

    def _ended(self, told: int) -> None:
        """End a beginning: with it the search where enough have ended alike, else begin anew.

        Where the budget does not allow another beginning, the basins of all beginnings are put together instead.
        """
        self._ends.append(self._archive.best)
        self._descended += int(self._archive.hits.sum())
        self._once += int(np.count_nonzero(self._archive.hits == 1.0))
        if self.agreement.reaches(self.parameters.effort):
            self._end = min(self.budget, told + round(self.parameters.finish * self._scale))
            self._closing, self._stage = True, EVOLVE
        else:
            self._anew(told)

    def _anew(self, told: int) -> None:
        """Keep what was found aside and begin anew, or put all together where the budget does not allow that."""
        self._aside = self._aside.merged(self._archive)
        another = self.parameters.sample * self._scale + 2.0 * self._patience
        if len(self._aside) and told + max(another, self.parameters.together * self.budget) > self._last:
            self._archive, self._aside = self._aside, Archive(self.region)
            self._mark_at, self._stage = self.budget, SCREEN  # never again
        else:
            self._archive = Archive(self.region)
            self._mark, self._mark_at = np.inf, told
            self._sample, self._stage = self.space.draw(self._rng, self._sample_size, first=False), SAMPLE

    # ------------------------------------------------------------------ the budget

    @property
    def _sample_size(self) -> int:
        """Number of candidates of a sample."""
        return min(self.budget, max(LEAST, round(self.parameters.sample * self._scale)))

    @property
    def _patience(self) -> float:
        """Candidates without a gain after which a beginning ends."""
        return min(self.parameters.stall * self.region.dimension**2, 0.2 * self.budget)

    @property
    def _last(self) -> int:
        """Candidates evaluated when what closes the search is due: descents in full, and the evolution."""
        polish = self.parameters.polished * (POLISH_ROUNDS + 2) if self.parameters.coarse else 0
        return self.budget - round(self.parameters.finish * self.budget) - min(polish, self.budget // 10)

    def _settle(self, told: int) -> None:
        """Leave a stage that the budget does not allow any more; `told` is the number of candidates evaluated."""
        screened = self.parameters.descents * self.parameters.screened
        size = screened if self._descents is None else self._descents.next_size
        last = self.budget - len(self._checkable) if self._fine else self._last
        if self._stage in (DESCEND, SCREEN) and told + size > last:
            if self._descents is not None:
                self._stage = CHECK
            else:
                self._close(told)
        if self._stage == CHECK and self._descents is not None and told + len(self._checkable) > self.budget:
            self._stage = OVER
        if self._stage == EVOLVE and (not self._evolutions or told >= self._leg_end):
            self._next_leg(told)
        if self._stage == EVOLVE and told + sum(e.population for e in self._evolutions) > self._end:
            self._stage = OVER
        if self._stage == SAMPLE:
            self._sample = self._sample[: len(self._sample_value) + self.budget - told]
            if told >= self.budget:
                self._stage = OVER

    def _close(self, told: int) -> None:
        """Bring the search to its end with the budget: the best basins of all descend in full, then evolve."""
        self._archive, self._aside = self._archive.merged(self._aside), Archive(self.region)
        self._closing, self._stage = True, EVOLVE
        if self.parameters.coarse and len(self._archive) and told + 3 * self.parameters.polished <= self.budget:
            self._polish()

    def _next_leg(self, told: int) -> None:
        """Begin the evolutions: of the two best basins with two thirds of what is left, then of the winner."""
        self._archive = self._archive.merged(self._aside)
        if not len(self._archive):
            self._stage = OVER
        elif not self._evolutions:
            self._evolutions = [Evolution(u, self.parameters.sigma) for u in self._archive.U[:2]]
            self._leg_end = told + 2 * (self._end - told) // 3
        else:
            self._evolutions = [Evolution(self._archive.U[0], self.parameters.last_sigma)]
            self._leg_end = self._end

    # ------------------------------------------------------------------ the state

    def _memory(self) -> State:
        """The stage with all that it works on."""
        arrays = ("hints", "sample", "sample_value", "sample_hint", "best")
        content: State = {name: getattr(self, f"_{name}").copy() for name in arrays}
        content |= {name: getattr(self, f"_{name}") for name in ("stage", *COUNTS, *FLAGS)}
        # inf is no JSON
        content |= {"best_value": np.array([self._best_value]), "mark": np.array([self._mark])}
        content["ends"] = np.array(self._ends)
        content |= {"evolutions": len(self._evolutions), "descending": self._descents is not None}
        content |= self._archive.state("archive") | self._aside.state("aside")
        if self._descents is not None:
            content |= self._descents.state()
        for k, evolution in enumerate(self._evolutions):
            content |= evolution.state(f"evolution_{k}")
        return content

    def _restore(self, saved: SavedState) -> None:
        """Set what `_memory` described."""
        D = self.box.dimension
        self._stage = str(saved.entry("stage"))
        for name in COUNTS:
            setattr(self, f"_{name}", int(saved.entry(name)))
        for name in FLAGS:
            setattr(self, f"_{name}", bool(saved.entry(name)))
        self._ends = saved.array("ends", (None,), infinite=True).tolist()
        self._hints = saved.array("hints", (len(self._X), None), unknown=True)
        self._sample = saved.array("sample", (None, D))
        self._sample_value = saved.array("sample_value", (None,), infinite=True)
        self._sample_hint = saved.array("sample_hint", (len(self._sample_value), None), unknown=True)
        self._best = saved.array("best", (D,))
        self._best_value = float(saved.array("best_value", (1,), infinite=True)[0])
        self._archive.restore(saved, "archive")
        self._aside.restore(saved, "aside")
        self._mark = float(saved.array("mark", (1,), infinite=True)[0])
        count = int(saved.entry("evolutions"))
        self._evolutions = [Evolution.from_state(saved, f"evolution_{k}") for k in range(count)]
        if saved.entry("descending"):
            self._descents = Descents.from_state(saved, self.region, sloped=self._sloped)
        planned = int(saved.entry("parameters")["budget"])
        longer, surer = (
            self.budget > planned,
            self._end < planned and not self.agreement.reaches(self.parameters.effort),
        )
        if self._end == planned:
            self._end = self.budget
        if (longer or surer) and self._stage in (EVOLVE, OVER):
            # what was at its end with a smaller budget or less effort is not any more
            self._asked, self._descents, self._evolutions = False, None, []
            self._end, self._fine, self._closing = self.budget, False, False
            self._anew(self.evaluations)
            self._settle(self.evaluations)
