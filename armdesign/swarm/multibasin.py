"""A search over many basins: beginnings that know nothing of one another, until enough of them have ended alike.

It is made of parts (`part.py`), each with a generator of its own, which anybody may carry out, side by side and in any
order. They are taken in one after another, batch by batch, by their journals, so that neither where they were carried
out nor how far the later ones have come changes anything:

    BEGIN     beginnings, one after another, until as many agree as the effort asks for, or the budget allows no other
    TOGETHER  where they do not agree: broods of the best basins of all, a few side by side, while the budget allows it
    POLISH    and descents in full from the best few
    EVOLVE    evolutions of the two best basins
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from armdesign._types import Array
from armdesign.errors import SearchError
from armdesign.swarm import checks
from armdesign.swarm.agreement import Agreement, agreement
from armdesign.swarm.algorithm import Algorithm, State
from armdesign.swarm.basins import Archive
from armdesign.swarm.checks import Mask, SavedState
from armdesign.swarm.evolution import Evolution
from armdesign.swarm.part import CHECK, CHUNK, POLISH_ROUNDS, Descending, Part

BEGIN, TOGETHER, POLISH, EVOLVE, OVER = ROUNDS = ("begin", "together", "polish", "evolve", "over")
COUNTS = ("number", "rows", "began_at", "end", "descended", "once")
POLISH_COST = POLISH_ROUNDS + 3
"""Candidates of a descent in full, at most."""
BROOD_ROUNDS = 34
"""Candidates of a descent of a brood, its check included: 40 of the better half, 8 of the others, a few more."""


class MultiBasin(Descending):
    """Descends by gradients in many basins within a budget of candidates, by parts that know nothing of one another."""

    name = "multibasin"
    changeable = ("effort",)

    def _begun(self) -> None:
        """No beginning has been made yet."""
        self.budget = self.parameters.budget
        self._end = self.budget  # candidates evaluated when the search ends; less once beginnings agree
        self._ends: list[float] = []  # the best basin of every beginning that has ended
        self._descended = self._once = 0  # descents of beginnings that have ended, and basins that only one has met
        self._round = BEGIN
        self._number = 0  # parts that have been judged
        self._parts: list[Part] = []  # those to come, in their order; of beginnings those that have been made
        self._rows, self._began_at = 0, 0  # batches of the first part that count, candidates when it began
        self._sloped = True  # whether gradients came with the fitness of the part judged last
        self._entropy = np.zeros(0)  # what the generators of the parts are made of; drawn by the first ask
        self._archive = Archive(self.region)  # of the parts that have been judged

    # ------------------------------------------------------------------ what the caller sees

    @property
    def hints(self) -> Array | None:
        """See Part.hints."""
        return self._parts[0].hints if self._parts else None

    @property
    def wants_slopes(self) -> bool:
        """Whether gradients of the fitness at the positions last asked for would help."""
        return bool(self._parts) and self._parts[0].wants_slopes

    @property
    def coarse(self) -> int:
        """See Algorithm.coarse."""
        return self._parts[0].coarse if self._parts else 0

    @property
    def cutoff(self) -> Array:
        """See Part.cutoff."""
        return self._parts[0].cutoff if self._parts else super().cutoff

    @property
    def done(self) -> bool:
        """Whether the budget is spent, or as many beginnings agree as the effort asks for."""
        return self._round == OVER

    @property
    def ending(self) -> str:
        """See Algorithm.ending."""
        return "agreement" if self._end < self.budget else self.length

    @property
    def agreement(self) -> Agreement:
        """See Algorithm.agreement.

        Beginnings share nothing, so that a basin which most of them miss would have to be rare for all.
        """
        return agreement(self._ends, self.region.dimension, self._descended, self._once)

    @property
    def basins(self) -> tuple[Array, Array]:
        """The basins found, best first: positions (A, D) and fitness (A,); before the first one the best place."""
        known = self._known()
        if not len(known) and np.isfinite(self._best_value):
            return self._best[None].copy(), np.array([self._best_value])
        return self.region.positions(known.U), known.value.copy()

    def _known(self) -> Archive:
        """All basins that count by now."""
        return self._archive.merged(self._parts[0].found(self._rows)) if self._parts else self._archive

    # ------------------------------------------------------------------ one batch at a time

    def _next(self) -> Array:
        """The batch of the first part."""
        self._have(1)
        return self._parts[0].ask()

    def _take(self, values: Array, valid: Mask, hints: Array, slopes: Array | None) -> float:
        """Pass the answers on to the first part, and take in what it makes of them."""
        self._parts[0].tell(values, valid, hints, slopes, self.note)
        return self._count()

    def _count(self) -> float:
        """Take in the next batch of the first part; returns its mean."""
        part = self._parts[0]
        _, mean, _, candidates = part.row(self._rows)
        best = part.best_of_row(self._rows)
        if best is not None and best[0] < self._best_value:
            self._best_value, self._best = best
        self._rows += 1
        self._settle(self._began_at + candidates)
        return mean

    # ------------------------------------------------------------------ parts carried out elsewhere

    def parts(self, most: int) -> Sequence[Part]:
        """See Algorithm.parts."""
        if self.done:
            return ()
        self._have(most)
        began, wanted = self._began_at, []
        for part in self._parts[:most]:
            if not (part.done or self._spent(part, began)):
                wanted.append(part)
            began += part.evaluations  # where the next one begins, or later
        return wanted

    def put(self, part: Algorithm) -> None:
        """See Algorithm.put."""
        for k, known in enumerate(self._parts):
            if isinstance(part, Part) and known.label == part.label and known.iteration < part.iteration:
                self._parts[k] = part
                self._asked &= k > 0

    @property
    def unread(self) -> bool:
        """See Algorithm.unread."""
        return bool(self._parts) and self._rows < self._parts[0].iteration

    def read(self) -> None:
        """See Algorithm.read."""
        part, self._asked = self._parts[0], False
        _, _, valid, candidates = part.row(self._rows)
        self.note, told = part.notes[self._rows], self._began_at + candidates
        mean = self._count()
        self._history.append((self.best_fitness, mean, valid, told))

    def gather(self) -> Iterator[None]:
        """See Algorithm.gather."""
        self._round = OVER
        while self._parts:
            while self.unread:
                self.read()
                yield
            self._archive = self._known()
            self._began_at += self._parts.pop(0).evaluations
            self._rows = 0

    # ------------------------------------------------------------------ rounds

    def _have(self, count: int) -> None:
        """Make the next beginnings, as far as it is known by now that they will be wanted."""
        if not len(self._entropy):
            self._entropy = self._rng.integers(0, 2**32, 4).astype(float)
        while self._round == BEGIN and len(self._parts) < count:
            told = self._began_at + sum(part.evaluations for part in self._parts)
            if self._parts and not self._allows_another(told):
                break
            self._parts.append(self._made(len(self._parts)))

    def _made(self, k: int) -> Part:
        """A part, k behind the first that has not been judged, with a generator of its own."""
        # beginnings have even labels: one that comes back late, not wanted any more, is not taken for a part of a round
        label = 2 * (self._number + k) + (self._round != BEGIN)
        part = Part(self.space, np.random.default_rng([*self._entropy.astype(int), label]), self.parameters)
        part.label, part.end = label, 0 if label else self._last
        return part

    def _settle(self, told: int) -> None:
        """Judge the first part where it is over or has to be, and see to the next ones.

        Args:
            told: Candidates evaluated.
        """
        while self._parts and self._round != OVER:
            part = self._parts[0]
            over = part.done and not self.unread
            if not over and not self._has_to_stop(part, told):
                return
            self._judge(part, told, whole=over)
            if not self._parts:
                self._next_round(told)

    def _has_to_stop(self, part: Part, told: int) -> bool:
        """Whether the first part has to stop where it is now for want of budget."""
        if self._rows and self._rests_beyond(part, self._rows - 1, self._began_at):
            return True
        last = self._last if self._round in (BEGIN, TOGETHER) else self._end
        if part.end:  # which it heeds by itself
            last = self.budget
        largest = max(CHUNK, self.region.dimension * self.parameters.size(self.region.dimension) // 200)
        if told + largest <= last:
            return False
        size = part.row(self._rows)[3] + self._began_at - told if self.unread else len(part.ask())
        return told + size > last

    def _rests_beyond(self, part: Part, row: int, began: int) -> bool:
        """Whether a beginning from so many candidates on ends behind a batch, since others are to have the rest."""
        return self._round == BEGIN and part.stage(row) == CHECK and began + part.row(row)[3] > self._soft_end

    def _spent(self, part: Part, began: int) -> bool:
        """Whether no further batch of a part will count that begins at so many candidates, or later."""
        return any(self._rests_beyond(part, row, began) for row in range(part.iteration))

    def _judge(self, part: Part, told: int, *, whole: bool) -> None:
        """Take over what the first part has found; a whole beginning counts among those that may agree."""
        found = part.found(self._rows)
        self._archive = self._archive.merged(found)
        self._sloped = part.sloped
        self._parts, self._rows, self._began_at = self._parts[1:], 0, told
        self._number, self._asked = self._number + 1, False
        if self._round != BEGIN:
            return
        if whole and len(found):
            self._ends.append(found.best)
            self._descended += int(found.hits.sum())
            self._once += int(np.count_nonzero(found.hits == 1.0))
        if self.agreement.reaches(self.parameters.effort):
            finish = round(self.parameters.finish * self.parameters.size(self.region.dimension))
            self._end, self._parts = min(self.budget, told + finish), []
            self._evolve(told)
        elif not (whole and self._allows_another(told)):
            self._parts = []
        elif not self._parts:
            self._have(1)

    def _next_round(self, told: int) -> None:
        """Begin the round that is due: broods while the budget allows them, descents in full, evolutions, the end."""
        if self._round in (BEGIN, TOGETHER):
            count = self.parameters.together_descents * (self.parameters.screened + BROOD_ROUNDS)
            groups = min(self.parameters.together_groups, (self._last - told) // count)
            if groups > 0 and len(self._archive):
                self._open(TOGETHER, groups, lambda part, k: part.brood(self._archive))
                return
            count = min(self.parameters.polished, len(self._archive), (self.budget - told) // POLISH_COST)
            if self.parameters.coarse and count > 0:
                self._open(POLISH, count, lambda part, k: part.polish(self._archive, k))
                return
        if self._round != EVOLVE:
            self._evolve(told)
        else:
            self._round = OVER

    def _evolve(self, told: int) -> None:
        """Begin the evolutions of the two best basins, or end."""
        archive = self._archive
        if not len(archive) and np.isfinite(self._best_value):
            archive = Archive(self.region)
            archive.add(self.region.units(self._best[None]), np.array([self._best_value]), np.zeros((1, 0)))
        count = min(2, len(archive))
        population = Evolution(np.zeros(self.region.dimension), 1.0).population
        generations = (self._end - told) // population
        if count < 1 or generations < 1:
            self._round = OVER
            return
        count = min(count, generations)
        shares = [(generations + k) // count for k in range(count)]
        self._open(EVOLVE, count, lambda part, k: part.evolution(archive, k, shares[k]))

    def _open(self, name: str, count: int, settle: Callable[[Part, int], None]) -> None:
        """Begin a round.

        Args:
            name: Its name.
            count: Number of its parts.
            settle: What makes each of them what it is.
        """
        self._round = name
        self._parts = [self._made(k) for k in range(count)]
        for k, part in enumerate(self._parts):
            part.sloped = self._sloped
            settle(part, k)

    # ------------------------------------------------------------------ the budget

    @property
    def _last(self) -> int:
        """Candidates evaluated when what closes the search is due: descents in full, and the evolution."""
        polish = self.parameters.polished * POLISH_COST if self.parameters.coarse else 0
        return self.budget - round(self.parameters.finish * self.budget) - min(polish, self.budget // 10)

    @property
    def _soft_end(self) -> float:
        """Candidates evaluated behind which a beginning ends as soon as none of its descents is under way."""
        return self._last - 0.5 * self.parameters.together * self.budget

    def _allows_another(self, told: int) -> bool:
        """Whether the budget allows another beginning after so many candidates."""
        size, patience = (of(self.region.dimension) for of in (self.parameters.sample_size, self.parameters.patience))
        return told + max(size + 2.0 * patience, self.parameters.together * self.budget) <= self._last

    # ------------------------------------------------------------------ the state

    def _memory(self) -> State:
        """The round with its parts, and what has been found."""
        content: State = super()._memory() | {name: getattr(self, f"_{name}") for name in ("round", "sloped", *COUNTS)}
        content |= {"ends": np.array(self._ends), "entropy": self._entropy.copy(), "parts": len(self._parts)}
        content |= self._archive.state("archive")
        for k, part in enumerate(self._parts):
            content |= {f"part_{k}_{name}": value for name, value in part.state().items()}
        return content

    def _restore(self, saved: SavedState) -> None:
        """Set what `_memory` described."""
        super()._restore(saved)
        self._round = str(saved.entry("round"))
        if self._round not in ROUNDS:
            raise SearchError(
                f"the saved search is in a round '{self._round}'", value=self._round, allowed=list(ROUNDS),
                fix=checks.FIX,
            )  # fmt: skip
        self._sloped = bool(saved.entry("sloped"))
        for name in COUNTS:
            setattr(self, f"_{name}", int(saved.entry(name)))
        self._ends = saved.array("ends", (None,), infinite=True).tolist()
        self._entropy = saved.array("entropy", (None,))
        self._archive.restore(saved, "archive")
        count = int(saved.entry("parts"))
        self._parts = [Part.from_state(saved.within(f"part_{k}_"), self.space) for k in range(count)]
        planned = int(saved.entry("parameters")["budget"])
        longer = self.budget > planned
        surer = self._end < planned and not self.agreement.reaches(self.parameters.effort)
        if self._end == planned:
            self._end = self.budget
        if (longer or surer) and self._round != BEGIN:
            # what was at its end with a smaller budget or less effort is not any more
            told = self.evaluations
            self._archive = self._known()
            self._asked, self._end, self._parts = False, self.budget, []
            self._number += 1 + self.parameters.together_groups  # their generators are spent
            self._round, self._rows, self._began_at = BEGIN, 0, told
            if not len(self._archive) or self._allows_another(told):
                self._have(1)
                if not len(self._archive):
                    self._parts[0].end = self._last - told
            else:
                self._next_round(told)
        elif longer:
            self._parts = self._parts[:1]
