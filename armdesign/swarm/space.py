"""Where a search may go: a box, perhaps a slab across it, and how first positions are drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import SettingsError
from armdesign.swarm import checks
from armdesign.swarm.checks import Mask

Sampler = Callable[[np.random.Generator, int], Array]
"""Draws `count` positions, shape (count, D), from a generator."""


@dataclass(frozen=True, eq=False)
class Box:
    """Lower and upper bound of every entry of a position, and which entries are angles.

    Equal bounds fix an entry. Any array-like is accepted; what is kept are read-only copies.

    Attributes:
        lower: Lower bounds, shape (D,).
        upper: Upper bounds, shape (D,).
        angular: True for the entries that are angles, shape (D,).
    """

    lower: Array
    upper: Array
    angular: Mask

    def __post_init__(self) -> None:
        """Normalise the three columns and check them.

        Raises:
            SettingsError: Columns of unequal length, a bound that is not a finite number, or lower > upper.
        """
        for name, read in (("lower", _column), ("upper", _column), ("angular", _flags)):
            column = read(name, getattr(self, name))
            column.setflags(write=False)
            object.__setattr__(self, name, column)
        if not len(self.lower) == len(self.upper) == len(self.angular):
            lengths = f"{len(self.lower)}, {len(self.upper)} and {len(self.angular)}"
            raise SettingsError(
                f"the box columns lower, upper and angular have {lengths} entries", allowed="equal lengths"
            )
        for entry in np.flatnonzero(self.lower > self.upper):
            bounds = float(self.lower[entry]), float(self.upper[entry])
            message = f"box entry {entry} has lower bound {bounds[0]:g} above upper bound {bounds[1]:g}"
            raise SettingsError(message, value=bounds, allowed="lower <= upper", fix="Swap the two, or set them equal")

    @property
    def dimension(self) -> int:
        """Number of entries D, the fixed ones included."""
        return len(self.lower)

    @property
    def width(self) -> Array:
        """Extent of every entry, upper - lower, shape (D,)."""
        return np.asarray(self.upper - self.lower)

    def clip(self, X: ArrayLike) -> Array:
        """Positions moved to the nearest point of the box, a new array.

        Args:
            X: Positions, shape (..., D).

        Returns:
            Positions inside the box, shape (..., D).
        """
        return np.asarray(np.clip(np.asarray(X, dtype=float), self.lower, self.upper))

    def uniform(self, rng: np.random.Generator, count: int) -> Array:
        """Positions drawn uniformly in the box, row by row.

        Args:
            rng: Source of count x D draws.
            count: Number of positions.

        Returns:
            Positions, shape (count, D).
        """
        return self.clip(self.lower + rng.random((count, self.dimension)) * self.width)  # ~ U(lower, upper)


@dataclass(frozen=True, eq=False)
class Slab:
    """A linear constraint low < w x < high with weights w >= 0; of an arm, its total length.

    Attributes:
        weights: w, shape (D,).
        low: Lower bound of w x.
        high: Upper bound of w x.
    """

    weights: Array
    low: float
    high: float

    def __post_init__(self) -> None:
        """Normalise and check.

        Raises:
            SettingsError: A weight is negative, a value is no finite number, or the bounds are upside down.
        """
        weights = checks.numbers("the weights of the slab", self.weights, (None,))
        low, high = checks.number("slab.low", self.low), checks.number("slab.high", self.high)
        if not (np.isfinite(weights).all() and (weights >= 0.0).all() and low < high):
            raise SettingsError("a slab needs weights >= 0 and low < high", value=(low, high))
        weights.setflags(write=False)
        for name, value in (("weights", weights), ("low", low), ("high", high)):
            object.__setattr__(self, name, value)


@dataclass(frozen=True, eq=False)
class SearchSpace:
    """All that a search algorithm may know of the positions; each algorithm takes what it has a use for.

    Attributes:
        box: Bounds of the positions, D entries.
        sample: Draws the first positions; by default uniform in the box.
        anew: Draws positions where a search begins anew on the way; by default as at first.
        slab: A linear constraint that every valid position fulfils; by default none.
        canonical: Positions (N, D) in a form that is the same for equal designs; by default as they are.
    """

    box: Box
    sample: Sampler | None = None
    anew: Sampler | None = None
    slab: Slab | None = None
    canonical: Callable[[Array], Array] | None = None

    def draw(self, rng: np.random.Generator, count: int, *, first: bool = True) -> Array:
        """Positions to begin with, checked.

        Args:
            rng: Source of the draws.
            count: Number of positions N.
            first: Whether this is the first beginning of the search.

        Returns:
            Positions in the box, shape (N, D).

        Raises:
            SearchError: The sampler returned something else than N positions in the box.
        """
        draw = self.sample or self.box.uniform
        if not first and self.anew is not None:
            draw = self.anew
        return checks.positions(draw(rng, count), self.box.lower, self.box.upper, count)


def _column(name: str, values: ArrayLike) -> Array:
    """A copied column of finite numbers, shape (D,)."""
    try:
        column = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise SettingsError(f"box column '{name}' does not hold numbers: {error}", value=values) from error
    if column.ndim != 1 or column.size == 0:
        raise SettingsError(f"box column '{name}' has shape {column.shape}", value=values, allowed="(D,) with D >= 1")
    for entry in np.flatnonzero(~np.isfinite(column)):
        message = f"box entry {entry} has '{name}' bound {column[entry]}"
        raise SettingsError(message, value=float(column[entry]), allowed="finite numbers")
    return column


def _flags(name: str, values: ArrayLike) -> Mask:
    """A copied column of flags, shape (D,)."""
    flags = np.array(values, dtype=object)  # keeps 0 and 1 apart from false and true
    if flags.ndim != 1 or not all(isinstance(flag, (bool, np.bool_)) for flag in flags):
        raise SettingsError(f"box column '{name}' does not hold flags", value=values, allowed="true or false per entry")
    return np.asarray(flags, dtype=np.bool_)
