"""Batches of candidates on their way through the lanes, one behind the other."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armdesign.fitness.path import OUTCOME

Array = NDArray[np.float64]
Outcome = NDArray[np.void]


class Batch(NamedTuple):
    """Candidates.

    Attributes:
        rows: DH rows (alpha, a, d, theta), tool last, shape (N, n + 1, 4) [rad, m, m, rad].
        yaw: Base yaw, shape (N,) [rad].
        cutoff: Fitness beyond which a candidate may be dropped, shape (N,).
    """

    rows: Array
    yaw: Array
    cutoff: Array


class Flow:
    """Candidates in the order in which they begin, and what has come of them.

    Attributes:
        batch: All of them so far.
        outcome: OUTCOME records of those that are done, shape (N,).
        cursor: How many have begun.
        unfinished: How many are not done.
    """

    def __init__(self, batch: Batch) -> None:
        """Begin with a batch."""
        self.batch = batch
        self.outcome: Outcome = np.zeros(len(batch.rows), dtype=OUTCOME)
        self.ends, self.cursor, self.unfinished, self.given = [len(batch.rows)], 0, len(batch.rows), 0

    @property
    def exhausted(self) -> bool:
        """Whether all have begun."""
        return self.cursor == len(self.batch.rows)

    def add(self, batch: Batch) -> None:
        """Put another batch behind the others."""
        rows, yaw, cutoff = (np.concatenate(pair) for pair in zip(self.batch, batch, strict=True))
        self.batch = Batch(rows, yaw, cutoff)
        self.outcome = np.concatenate([self.outcome, np.zeros(len(batch.rows), dtype=OUTCOME)])
        self.ends.append(len(rows))
        self.unfinished += len(batch.rows)

    def complete(self) -> Iterator[Outcome]:
        """Outcomes, shape (N,), of the next batches that are done and have not been given yet."""
        while self.given < len(self.ends) and self.cursor >= self.ends[self.given]:
            first = self.ends[self.given - 1] if self.given else 0
            part = self.outcome[first : self.ends[self.given]]
            if not part["done"].all():
                return
            self.given += 1
            yield part
