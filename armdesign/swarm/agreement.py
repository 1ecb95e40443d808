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
LEVELS: Mapping[str, float] = MappingProxyType({"quick": 0.1, "normal": 0.05, "thorough": 0.01, "budget": 0.0})
"""The chance of a better basin at which a search ends, by its effort."""
BASE, AGREEING, APART = 0.9, 1.0, 0.35
"""Calibrated, see ``docs/search.md``: ln p falls by AGREEING with each beginning that agrees, and rises by APART with
each that does not."""


class Agreement(NamedTuple):
    """What independent beginnings say of the best basin.

    Attributes:
        agreeing: Beginnings that have ended within 1 % of the best of them.
        beginnings: Those that have ended.
        chance: p, the share of searches with these two figures in which there was another basin, better by more than
            1 %, over the tasks on which it was calibrated; 1 before two beginnings agree.
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


def agreement(ends: Sequence[float], descents: int = 0, once: int = 0) -> Agreement:
    """What beginnings say that have ended in these values.

    Args:
        ends: The best fitness of each beginning.
        descents: See Agreement.
        once: See Agreement.
    """
    values = np.array(ends)
    agreeing = int(np.count_nonzero(values <= values.min(initial=np.inf) * (1.0 + ALIKE)))
    return Agreement(agreeing, len(ends), chance(agreeing, len(ends)), descents, once)


def chance(agreeing: int, beginnings: int) -> float:
    """P of ``Agreement``.

    Args:
        agreeing: Beginnings that agree.
        beginnings: All of them.
    """
    if agreeing < LEAST:
        return 1.0
    return float(min(1.0, np.exp(BASE - AGREEING * agreeing + APART * (beginnings - agreeing))))
