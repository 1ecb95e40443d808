"""Two ways of searching compared on the same seeds: mean change in percent, with bootstrap intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.errors import SettingsError

DRAWS, LEVEL = 4000, 0.95


@dataclass(frozen=True, eq=False)
class Pairs:
    """What a base method and K others found with the same seeds."""

    base: Array  # shape (S,)
    others: Array  # shape (S, K); the k-th other's value with the seed of the same row

    def __post_init__(self) -> None:
        """Check the shapes.

        Raises:
            SettingsError: They do not fit, there is no pair, a value is not finite, or a base is not positive.
        """
        base, others = np.asarray(self.base, dtype=float), np.asarray(self.others, dtype=float)
        if base.ndim != 1 or others.ndim != 2 or len(others) != len(base) or not len(base):
            raise SettingsError(f"pairs have shapes {base.shape} and {others.shape}", allowed="(S,) and (S, K), S >= 1")
        if not (np.isfinite(base).all() and np.isfinite(others).all() and (base > 0.0).all()):
            raise SettingsError("pairs hold a value that is not finite, or a base that is not positive")
        object.__setattr__(self, "base", base)
        object.__setattr__(self, "others", others)


@dataclass(frozen=True, eq=False)
class Change:
    """Change of the mean against the base's, for each of K others."""

    # 100 (mean of the other / mean of the base - 1), averaged over the groups; shape (K,). Negative: less
    percent: Array
    low: Array  # lower end of the interval, shape (K,) [%]
    high: Array  # upper end, shape (K,) [%]; both NaN where a group has a single pair
    least: Array  # share of the resamples in which the k-th other has the smallest change, shape (K,)
    pairs: int  # number of pairs


def change(groups: Sequence[Pairs], seed: int = 0, *, draws: int = DRAWS, level: float = LEVEL) -> Change:
    """Mean change in percent over groups of pairs, each group counting the same, with percentile bootstrap intervals.

    Seeds are drawn anew with replacement within every group, and with a seed the base and all others: the luck of a
    seed is shared, and so is taken out.

    Args:
        groups: One or more groups, such as a task with a number of joints.
        seed: Seed of the resampling.
        draws: Number of resamples.
        level: Level of the intervals.
    """
    rng = np.random.default_rng(seed)
    percent = np.mean([relative(group.base[None], group.others[None])[0] for group in groups], axis=0)
    resampled = np.zeros((draws, len(percent)))
    for group in groups:
        chosen = rng.integers(0, len(group.base), (draws, len(group.base)))
        resampled += relative(group.base[chosen], group.others[chosen]) / len(groups)
    tails = np.percentile(resampled, [50.0 * (1.0 - level), 50.0 * (1.0 + level)], axis=0)
    if min(len(group.base) for group in groups) < 2:
        tails = np.full_like(tails, np.nan)
    least = np.bincount(resampled.argmin(axis=1), minlength=len(percent)) / draws
    return Change(percent, tails[0], tails[1], least, sum(len(group.base) for group in groups))


def relative(base: Array, others: Array) -> Array:
    """Change of means in percent, shapes (B, S) and (B, S, K) -> (B, K)."""
    values: Array = 100.0 * (others.mean(axis=1) / base.mean(axis=1)[:, None] - 1.0)
    return values
