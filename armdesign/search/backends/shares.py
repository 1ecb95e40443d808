"""How many workers a batch is worth, learnt from how long batches like it took.

Small batches do not gain from more workers: each part is handed out and fetched, and its block of arms runs half empty.
So every kind of batch is tried on all workers and on fewer, and goes where it took least; now and then the others get
another chance, since what else the machine does changes. Scores do not depend on any of this.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field

SHORT = 0.25
"""Batches that take longer on all workers go to all of them [s]."""
AGAIN = 24
"""Of so many batches of a kind one goes where it would not by what is known."""
NEWEST = 0.3
"""Weight of the newest time in what is known."""


@dataclass
class Tally:
    """What is known of batches of one kind and about one size.

    Attributes:
        seconds: Time for a candidate by the number of workers [s].
        batches: How many there were.
    """

    seconds: dict[int, float] = field(default_factory=dict)
    batches: int = 0


class Shares:
    """Chooses on how many workers a batch is evaluated."""

    def __init__(self) -> None:
        """Nothing is known."""
        self._tallies: dict[tuple[Hashable, int], Tally] = {}

    def choose(self, kind: Hashable, count: int, workers: int) -> int:
        """The number of workers for a batch.

        Args:
            kind: What takes equally long for a candidate.
            count: Candidates in the batch.
            workers: Those that are free; none counts as one.
        """
        most = max(min(workers, count), 1)
        tally = self._tally(kind, count)
        tally.batches += 1
        known = tally.seconds.get(most)
        if most == 1 or known is None or known * count > SHORT:
            return most
        halves = [most]
        while halves[-1] > 1:
            halves.append(halves[-1] // 2)
        missing = [few for few in halves if few not in tally.seconds]
        if missing:
            return missing[0]
        ranked = sorted(halves, key=lambda few: tally.seconds[few])
        turn = tally.batches // AGAIN
        return ranked[turn % len(ranked)] if tally.batches % AGAIN == 0 else ranked[0]

    def learn(self, kind: Hashable, count: int, workers: int, seconds: float) -> None:
        """Take in how long a batch took.

        Args:
            kind: As for ``choose``.
            count: Candidates in it.
            workers: On how many workers.
            seconds: From its beginning to its end [s].
        """
        known, each = self._tally(kind, count).seconds, seconds / max(count, 1)
        known[workers] = each if workers not in known else (1.0 - NEWEST) * known[workers] + NEWEST * each

    def _tally(self, kind: Hashable, count: int) -> Tally:
        """What is known of batches like this one: of its kind, and of a size within a factor of two."""
        return self._tallies.setdefault((kind, count.bit_length()), Tally())
