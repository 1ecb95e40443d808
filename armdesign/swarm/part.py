"""A part of a search over many basins that needs nothing of the others, so that any process can carry it out.

Its stages, what each asks for, what it makes of the answers, and which one comes next:

    SAMPLE   candidates of a first sample; descents begin at the best ones that lie apart
    DESCEND  steps of every descent, with gradients or probes around it (`descents.py` has the phases)
    LEAD     a coarse descent that looks a new best, evaluated in full on its way; DESCEND goes on
    CHECK    where the best descents have ended, evaluated afresh and in full, goes into the archive of basins
    SCREEN   children of the best basins; of every few the best begins a descent, and so on from DESCEND
             where the best of them has not gained for long, the best few descend once more, in full
    EVOLVE   CMA-ES around a basin, where kinks stop the gradients

A beginning goes through all but the last one; a brood is a SCREEN with its descents, a polish descends in full, an
evolution evolves. Sample, children and descents may be evaluated coarsely, as the caller can. Probes and steps carry a
hint, whatever the evaluation gave for the place they come from (of an arm, its start pose). A fitness that is coarse or
came by a hint never counts as the best one.

A part keeps a journal of its batches, so that whoever owns it can take them in one after another, long after they were
done, and need not take all.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

from armdesign._types import Array
from armdesign.errors import SearchError, SettingsError
from armdesign.swarm import checks
from armdesign.swarm.agreement import LEVELS
from armdesign.swarm.algorithm import Algorithm, State
from armdesign.swarm.basins import COLUMNS, Archive, apart, children
from armdesign.swarm.checks import Mask, SavedState
from armdesign.swarm.descents import PROBE, SLOPE, STEP, Descents, Patience
from armdesign.swarm.evolution import Evolution
from armdesign.swarm.space import Region, SearchSpace

T = TypeVar("T")
SAMPLE, DESCEND, LEAD, CHECK, SCREEN, EVOLVE, OVER = "sample", "descend", "lead", "check", "screen", "evolve", "over"
CHUNK, LEAST = 400, 100
"""Most candidates of the sample in one batch, and the smallest sample."""
COUNTS, FLAGS = ("extra", "left", "mark_at"), ("fine", "brood")
FIRST = 40
"""Candidates of the first batch of all, in full, so that there is a best one from then on."""
POLISH_REACH, POLISH_ROUNDS = 0.02, 25
"""Length of the first step of descents in full from where coarse ones have ended, and their most rounds."""
GAIN = 5e-3
"""By how much the best basin has to become better, relative, for a beginning not to stall."""
AHEAD = 1e-3
"""How much better than the best a descent has to look, relative, to be evaluated without its hint on the way."""


@dataclass(frozen=True)
class MultiBasinParameters:
    """The budget and how it is spent.

    Attributes:
        budget: Largest number of candidates.
        effort: How sure the search has to be to end before: quick, normal, thorough, or budget for never.
        coarse: How coarsely candidates are looked at that only lead the way, whatever that means to the caller; 0: not.
        doubted: Whether a coarse look may miss what is good in full: first samples are then evaluated in full, and once
            a round the coarse descent in the lead.
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
        together_groups: Groups of their children that descend side by side, knowing nothing of one another.
        together_descents: Descents of each group.
        finish: Share of the budget for the evolution; of the scale where beginnings agree.
        sigma: Step size of the evolution of the best basins.
    """

    budget: int = 50000
    effort: str = "normal"
    coarse: int = 100
    doubted: bool = False
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
    together_groups: int = 4
    together_descents: int = 12
    finish: float = 0.02
    sigma: float = 0.03

    def __post_init__(self) -> None:
        """Check what a caller sets.

        Raises:
            SettingsError: The budget or the coarseness is no whole number or too small, or the effort is unknown.
        """
        checks.whole("budget", self.budget)
        checks.number("coarse", self.coarse, 0.0)
        if self.effort not in LEVELS:
            raise SettingsError(f"there is no effort {self.effort!r}", value=self.effort, allowed=list(LEVELS))

    def size(self, entries: int) -> int:
        """Candidates by which a beginning is measured.

        Args:
            entries: Free entries of a position.
        """
        return min(self.budget, entries * self.scale)

    def sample_size(self, entries: int) -> int:
        """Candidates of the first sample of a beginning.

        Args:
            entries: Free entries of a position.
        """
        return min(self.budget, max(LEAST, round(self.sample * self.size(entries))))

    def patience(self, entries: int) -> float:
        """Candidates without a gain after which a beginning ends.

        Args:
            entries: Free entries of a position.
        """
        return min(self.stall * entries**2, 0.2 * self.budget)


class Found(NamedTuple):
    """Basins that a batch has brought, as `Archive.add` takes them.

    Attributes:
        row: The batch.
        U: Unit coordinates, shape (N, K).
        value: Fitness, shape (N,).
        hint: Hints, shape (N, H).
        look: Fitness as the descents saw it, shape (N,).
        hits: How often each counts among those that have met its basin, shape (N,).
    """

    row: int
    U: Array
    value: Array
    hint: Array
    look: Array
    hits: Array


class Descending(Algorithm):
    """What a search over many basins and its parts have in common: they descend by gradients, and keep the best.

    Beside the fitness the caller may tell a hint for every position, and gets it back with the positions near it; and
    gradients where `wants_slopes` is true. Without gradients they are found by probes.

    Attributes:
        region: Box and slab, scaled.
    """

    unit, length, takes_slopes = "candidate", "budget", True
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
        self.region = Region(space)
        self._best, self._best_value = self.box.lower.copy(), np.inf
        self._begun()

    @abstractmethod
    def _begun(self) -> None:
        """Set what it works on, before anything has been asked."""

    @property
    def best_position(self) -> Array:
        """Position of the best fitness, shape (D,)."""
        return self._best.copy()

    @property
    def best_fitness(self) -> float:
        """The best fitness, +inf while there is none."""
        return self._best_value

    def _memory(self) -> State:
        """The best position and its fitness, which as inf would be no JSON."""
        return {"best": self._best.copy(), "best_value": np.array([self._best_value])}

    def _restore(self, saved: SavedState) -> None:
        """Set what `_memory` described."""
        self._best = saved.array("best", (self.box.dimension,))
        self._best_value = float(saved.array("best_value", (1,), infinite=True)[0])


class Part(Descending):
    """A part of a search, asked and told like a search: a beginning, or what `brood`, `polish` or `evolution` makes it.

    Attributes:
        sloped: Whether gradients come with the fitness; found out by the first descents.
        end: Candidates after which it looks where its descents are by then, and is over; 0 for never.
        stages: The stage of every batch.
        notes: Of every batch, what the caller wants kept with it, rows of equal length.
    """

    name = "part"

    def _begun(self) -> None:
        """A beginning, before its first sample."""
        self.stages: list[str] = []
        self.notes: list[tuple[float, ...]] = []
        self.archive = Archive(self.region)
        self._found: list[Found] = []
        self._stage = SAMPLE
        self._brood = False  # whether it ends with its first descents
        self._fine = False  # whether the descents at hand are those in full
        self._hints = np.zeros((0, 0))
        self._bests: list[tuple[int, float, Array]] = []  # batch, fitness and position of every new best
        self._mark, self._mark_at = np.inf, 0  # the best fitness when it last gained, and the candidates by then
        self._sample = np.zeros((0, self.box.dimension))
        self._sample_value, self._sample_hint = np.zeros(0), np.zeros((0, 0))
        self._descents: Descents | None = None
        self.sloped = True
        self._extra = 0  # rows at the end of the batch that check the descent in the lead
        self._evolution: Evolution | None = None
        self._left = 0  # generations of the evolution that are left
        self.end = 0  # candidates after which its descents end at once; 0 for never

    # ------------------------------------------------------------------ the four kinds

    def brood(self, archive: Archive) -> None:
        """Make it, before it begins, one group of children of the best basins, with their descents.

        Args:
            archive: The basins.
        """
        self.archive, self._stage, self._brood = archive.best_of(2 * self.parameters.parents), SCREEN, True

    def polish(self, archive: Archive, k: int) -> None:
        """Make it, before it begins, the descent in full of one basin.

        Args:
            archive: The basins.
            k: Which of them.
        """
        self.archive, self._brood = archive.best_of(1, k), True
        self._polish()

    def evolution(self, archive: Archive, k: int, generations: int) -> None:
        """Make it, before it begins, the evolution of one basin.

        Args:
            archive: The basins.
            k: Which of them.
            generations: Of the evolution.
        """
        self._stage, self._left = EVOLVE, generations
        self._evolution = Evolution(archive.U[k], self.parameters.sigma)

    # ------------------------------------------------------------------ what the caller sees

    @property
    def hints(self) -> Array | None:
        """Hints of the positions last asked for, shape (N, H), rows of NaN where there is none; None without any."""
        return self._hints.copy() if self._hints.shape[1] and not np.isnan(self._hints).all() else None

    @property
    def _phase(self) -> str:
        """What the descents ask for, empty in the other stages."""
        return self._running(self._descents).phase if self._stage == DESCEND else ""

    @property
    def wants_slopes(self) -> bool:
        """Whether gradients of the fitness at the positions last asked for would help."""
        return self.sloped and self._phase in (SLOPE, STEP)

    @property
    def coarse(self) -> int:
        """See Algorithm.coarse."""
        looking = self._stage == SCREEN or (self._stage == DESCEND and not self._fine)
        if self._stage == SAMPLE and not self.parameters.doubted:
            looking = self.label > 0 or bool(self._history)
        return self.parameters.coarse if looking else 0

    @property
    def cutoff(self) -> Array:
        """Where steps come without gradients, the fitness that each has to fall below; else +inf, shape (N,)."""
        limits = np.full(len(self._X), np.inf)
        if self._phase == STEP and not self.sloped:
            descents = self._running(self._descents)
            limits[: len(limits) - self._extra] = descents.value[descents.live]
        return limits

    @property
    def done(self) -> bool:
        """Whether it has nothing more to ask."""
        return self._stage == OVER

    @property
    def basins(self) -> tuple[Array, Array]:
        """The basins found, best first: positions (A, D) and fitness (A,)."""
        known = self.found(self.iteration)
        return self.region.positions(known.U), known.value.copy()

    # ------------------------------------------------------------------ the journal

    def stage(self, k: int) -> str:
        """The stage of a batch, of the next one where there is none yet."""
        return self.stages[k] if k < len(self.stages) else self._stage

    def row(self, k: int) -> tuple[float, float, int, int]:
        """Best, mean, valid candidates and candidates in all, as the history has them for the batch."""
        return self._history[k]

    def best_of_row(self, k: int) -> tuple[float, Array] | None:
        """Fitness and position of the new best that a batch has brought; None where it has brought none."""
        return next(((value, X) for row, value, X in self._bests if row == k), None)

    def found(self, rows: int) -> Archive:
        """The basins that its first batches have brought, those it was given not among them."""
        archive = Archive(self.region)
        for entry in self._found:
            if entry.row < rows:
                archive.add(*entry[1:])
        return archive

    def _add(self, U: Array, value: Array, hint: Array, look: Array, hits: Array) -> None:
        """Take basins into the archive and the journal."""
        self._found.append(Found(self.iteration, U, value, hint, look, hits))
        self.archive.add(U, value, hint, look, hits)

    # ------------------------------------------------------------------ what is asked

    def _next(self) -> Array:
        """The batch of the present stage."""
        if self._stage == DESCEND:
            return self._descending()
        if self._stage == SAMPLE:
            if not self._history:
                self._sample = self.space.draw(self._rng, self._sample_size, first=not self.label)
            first = len(self._sample_value)
            whole = self.label or self._history or not self.parameters.coarse
            X = self._sample[first : first + (CHUNK if whole else FIRST)]
        else:
            if self._stage == SCREEN:
                parents = self.archive.U[: self.parameters.parents]
                groups = self.parameters.together_descents if self._brood else self.parameters.descents
                U = children(self.region, parents, groups, self.parameters.screened, self._rng)
            elif self._stage == EVOLVE:
                U = self._running(self._evolution).ask(self._rng)
            elif self._stage == LEAD:
                descents = self._running(self._descents)
                U = descents.U[[np.argmin(descents.value)]]
            else:  # CHECK
                U = self._running(self._descents).U[self._checkable]
            X = self.region.positions(U)
        self._hints, self._extra = np.full((len(X), self.archive.hint.shape[1]), np.nan), 0
        return X

    def _descending(self) -> Array:
        """What the descents ask for; behind it the one in the lead without its hint, where that looks a new best."""
        descents = self._running(self._descents)
        U, self._hints = descents.ask()
        leader = [] if self.coarse else self._leader
        self._extra = len(leader)
        self._hints = np.vstack([self._hints, np.full((self._extra, self._hints.shape[1]), np.nan)])
        return self.region.positions(np.vstack([U, descents.U[leader]]))

    @property
    def _leader(self) -> list[int]:
        """The index of the best descent where, once a round, it has moved and looks a new best; else none."""
        descents = self._running(self._descents)
        k = int(np.argmin(descents.value))
        ahead = descents.value[k] < self._best_value * (1.0 - AHEAD)
        soon = descents.phase == PROBE or (descents.phase == STEP and self.sloped)
        return [k] if ahead and soon and np.any(descents.last[k]) else []

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
            self._bests.append((self.iteration, self._best_value, self._best))
        self.stages.append(self._stage)
        self.notes.append(self.note)
        self._learn(values, hints, slopes, told)
        if self.end and self._stage in (DESCEND, LEAD, SCREEN):
            size = self._descents.next_size if self._descents else self.parameters.descents * self.parameters.screened
            if told + size > self.end:
                self._brood, self._stage = True, CHECK if self._descents else OVER
        return float(self.archive.value.mean()) if len(self.archive) else np.inf

    def _learn(self, values: Array, hints: Array, slopes: Array | None, told: int) -> None:
        """Pass the answers on to the present stage, which says what comes next."""
        count = len(values) - self._extra
        U = self.region.units(self._X)
        if self._stage == CHECK:
            met = np.full(len(U), 0.0 if self._fine else 1.0)
            self._add(U, values, hints, self._running(self._descents).value[self._checkable], met)
        elif self._stage == EVOLVE or self._extra:  # evaluated without a hint, near a minimum
            first = count if self._extra else 0
            self._add(U[first:], values[first:], hints[first:], values[first:], np.zeros(len(U) - first))
        elif self._stage == LEAD:
            self._add(U, values, hints, self._running(self._descents).value.min(keepdims=True), np.zeros(1))
            self._stage = DESCEND
            return
        if self._stage == DESCEND:
            descents = self._running(self._descents)
            known = None if slopes is None else self.region.unit_slopes(slopes[:count])
            descents.tell(U[:count], values[:count], hints[:count], known)
            self.sloped = descents.sloped
            if not descents.live.any():
                self._stage = CHECK
            elif self.parameters.doubted and self.coarse and self._leader:
                self._stage = LEAD
        elif self._stage == SAMPLE:
            self._sampled(values, hints)
            if self._stage == SAMPLE:
                # a smaller budget than a sample: all of it is sample
                self._sample = self._sample[: len(self._sample_value) + self.parameters.budget - told]
                if told >= self.parameters.budget:
                    self._stage = OVER
        elif self._stage == SCREEN:
            table = values.reshape(-1, self.parameters.screened)  # a group of children per descent
            best = np.arange(len(table)) * self.parameters.screened + np.argmin(table, axis=1)
            best = best[np.isfinite(values[best])]
            if len(best):
                self._begin(U[best], values[best], hints[best], self.parameters.reach)
            elif self._brood:
                self._stage = OVER
        elif self._stage == CHECK:
            self._checked(told)
        else:
            self._running(self._evolution).tell(U, values)
            self._left -= 1
            self._stage = EVOLVE if self._left else OVER

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
        self.archive.hint = np.zeros((0, hints.shape[1]))
        self._begin(U[chosen], values[picked], hints[picked], self.parameters.first_reach)
        self._sample = np.zeros((0, self.box.dimension))

    def _running(self, work: T | None) -> T:
        """The descents or the evolution that the present stage is about.

        Raises:
            SearchError: There is none, so the state is not one of ours.
        """
        if work is None:
            raise SearchError(f"the saved search has nothing to do in its stage '{self._stage}'", fix=checks.FIX)
        return work

    def _begin(self, U: Array, values: Array, hints: Array, reach: float) -> None:
        """Begin descents."""
        ranked = np.sort(self.archive.look)  # good enough is what looks as good as the basin of that rank, or the last
        bar = float(ranked[min(self.parameters.bar, len(ranked) - 1)]) if len(ranked) else -np.inf
        self._descents = Descents(self.region, U, values, hints, Patience(reach, bar), sloped=self.sloped)
        self._stage = DESCEND

    def _polish(self) -> None:
        """Begin descents in full at the best basins."""
        best, patience = self.archive, Patience(POLISH_REACH, np.inf, halve_at=-1, rounds=POLISH_ROUNDS)
        chosen = slice(0, self.parameters.polished)
        U = self.region.pulled_in(best.U[chosen], 1e-9)
        self._descents = Descents(
            self.region, U, best.value[chosen], best.hint[chosen], patience, sloped=self.sloped
        )  # fmt: skip
        self._fine, self._stage = True, DESCEND

    @property
    def _checkable(self) -> Array:
        """Which of the descents have ended well enough to be evaluated in full: indices, in their order."""
        value = self._running(self._descents).value
        count = len(value) if self._fine else max(1, round(self.parameters.checked * len(value)))
        return np.sort(np.argsort(value, kind="stable")[:count])

    def _checked(self, told: int) -> None:
        """Go on from the archive, which holds the ends of the descents now; over if it has not gained for long."""
        self._descents, self._stage = None, SCREEN
        if self._brood or self._fine:
            self._stage = OVER
        elif not len(self.archive):  # none of them is anything in full: sample on
            self._sample, self._stage = self.space.draw(self._rng, CHUNK, first=False), SAMPLE
        elif self.archive.best < self._mark * (1.0 - GAIN):
            self._mark, self._mark_at = self.archive.best, told
        elif told - self._mark_at > self.parameters.patience(self.region.dimension):
            if self.parameters.coarse and len(self.archive):
                self._polish()
            else:
                self._stage = OVER

    # ------------------------------------------------------------------ the state

    @property
    def _scale(self) -> int:
        """Candidates by which a beginning is measured."""
        return self.parameters.size(self.region.dimension)

    @property
    def _sample_size(self) -> int:
        """Number of candidates of a sample."""
        return self.parameters.sample_size(self.region.dimension)

    def _memory(self) -> State:
        """The stage with all that it works on, and the journal."""
        arrays = ("hints", "sample", "sample_value", "sample_hint")
        content: State = super()._memory() | {name: getattr(self, f"_{name}").copy() for name in arrays}
        content |= {name: getattr(self, f"_{name}") for name in ("stage", *COUNTS, *FLAGS)}
        content |= {"mark": np.array([self._mark])}  # inf is no JSON
        content |= {"label": self.label, "end": self.end, "sloped": self.sloped, "stages": list(self.stages)}
        width = len(self.notes[0]) if self.notes else 0
        content["notes"] = np.array(self.notes, dtype=float).reshape(len(self.notes), width)
        content["bests"] = np.array([[row, value] for row, value, _ in self._bests], dtype=float).reshape(-1, 2)
        content["bests_at"] = stacked([X for *_, X in self._bests], self.box.dimension)
        content["found_rows"] = np.array([[entry.row, len(entry.U)] for entry in self._found], dtype=float).reshape(
            -1, 2
        )
        width = max((entry.hint.shape[1] for entry in self._found), default=0)
        for name, size in (("U", self.region.dimension), ("hint", width)):
            content[f"found_{name}"] = stacked([getattr(entry, name) for entry in self._found], size)
        for name in ("value", "look", "hits"):
            content[f"found_{name}"] = np.concatenate([np.zeros(0), *(getattr(entry, name) for entry in self._found)])
        content |= {"descending": self._descents is not None, "evolving": self._evolution is not None}
        content |= self.archive.state("archive")
        if self._descents is not None:
            content |= self._descents.state()
        if self._evolution is not None:
            content |= self._evolution.state("evolution")
        return content

    def _restore(self, saved: SavedState) -> None:
        """Set what `_memory` described."""
        super()._restore(saved)
        D, K, M = self.box.dimension, self.region.dimension, self.iteration
        self._stage = str(saved.entry("stage"))
        self.label, self.end = int(saved.entry("label")), int(saved.entry("end"))
        for name in COUNTS:
            setattr(self, f"_{name}", int(saved.entry(name)))
        for name in FLAGS:
            setattr(self, f"_{name}", bool(saved.entry(name)))
        self.sloped = bool(saved.entry("sloped"))
        self.stages = [str(stage) for stage in saved.entry("stages")]
        self.notes = [tuple(row) for row in saved.array("notes", (M, None), unknown=True).tolist()]
        self._hints = saved.array("hints", (len(self._X), None), unknown=True)
        self._sample = saved.array("sample", (None, D))
        self._sample_value = saved.array("sample_value", (None,), infinite=True)
        self._sample_hint = saved.array("sample_hint", (len(self._sample_value), None), unknown=True)
        self._mark = float(saved.array("mark", (1,), infinite=True)[0])
        bests = saved.array("bests", (None, 2))
        places = saved.array("bests_at", (len(bests), D))
        self._bests = [(int(row), float(value), X) for (row, value), X in zip(bests, places, strict=True)]
        rows = saved.array("found_rows", (None, 2)).astype(int)
        count = int(rows[:, 1].sum())
        shapes: dict[str, tuple[int | None, ...]] = {"U": (count, K), "hint": (count, None)}
        columns = {
            name: saved.array(
                f"found_{name}", shapes.get(name, (count,)), infinite=name in ("value", "look"), unknown=name == "hint"
            )
            for name in COLUMNS
        }
        ends = np.cumsum(rows[:, 1])
        self._found = [
            Found(int(row), **{name: values[end - size : end] for name, values in columns.items()})
            for (row, size), end in zip(rows, ends, strict=True)
        ]
        self.archive.restore(saved, "archive")
        if saved.entry("evolving"):
            self._evolution = Evolution.from_state(saved, "evolution")
        if saved.entry("descending"):
            self._descents = Descents.from_state(saved, self.region, sloped=self.sloped)


def stacked(arrays: Sequence[Array], width: int) -> Array:
    """Rows below one another, shape (N, width); none where there are none."""
    return np.vstack([np.zeros((0, width)), *arrays])
