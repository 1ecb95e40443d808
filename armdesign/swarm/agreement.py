"""How sure a search is of its best basin: beginnings that know nothing of one another, and how many end alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

ALIKE = 0.01
"""Beginnings agree whose best basins differ by no more, relative."""
LEAST = 2
"""Beginnings that have to agree at least."""
LEVELS: Mapping[str, float] = MappingProxyType({"quick": 0.25, "normal": 0.1, "thorough": 0.01, "budget": 0.0})
"""The chance of a better basin at which a search ends, by its effort."""
BEST, ENTRIES, FADING = 0.8, 8, 5.0
"""Calibrated, see ``docs/search.md``: of the beginnings that end in the best basin or in the one most often taken for
it, the share of the best, on most tasks with ENTRIES free entries; with FADING more it is e times smaller."""


class Agreement(NamedTuple):
    """What independent beginnings say of the best basin.

    Attributes:
        agreeing: Beginnings that have ended within 1 % of the best of them.
        beginnings: Those that have ended.
        chance: p, of searches that end once so many beginnings agree, the share that misses a basin better by more
            than 1 %, on tasks like those on which it was calibrated; 1 before two agree.
        descents: Descents of all beginnings whose ends were evaluated in full.
        once: Basins among their ends that only one of them has met.
    """

    agreeing: int
    beginnings: int
    chance: float
    descents: int
    once: int

    def reaches(self, effort: str) -> bool:
        """Whether that is as sure as an effort asks for."""
        return self.agreeing >= LEAST and self.chance <= LEVELS[effort]


def agreement(ends: Sequence[float], entries: int, descents: int = 0, once: int = 0) -> Agreement:
    """What beginnings say that have ended in these values.

    Args:
        ends: The best fitness of each beginning.
        entries: Free entries of a position.
        descents: See Agreement.
        once: See Agreement.
    """
    values = np.array(ends)
    agreeing = int(np.count_nonzero(values <= values.min(initial=np.inf) * (1.0 + ALIKE)))
    return Agreement(agreeing, len(ends), chance(agreeing, entries), descents, once)


def chance(agreeing: int, entries: int) -> float:
    """P of ``Agreement``: that beginning after beginning ends in one that is not the best, before any finds the best.

    Args:
        agreeing: Beginnings that agree.
        entries: Free entries of a position.
    """
    if agreeing < LEAST:
        return 1.0
    best = BEST * float(np.exp(-max(0, entries - ENTRIES) / FADING))
    return float((1.0 - best) ** agreeing)
