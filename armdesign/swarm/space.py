"""Where a search may go: a box, perhaps a slab across it, how first positions are drawn, and unit coordinates."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import SearchError, SettingsError
from armdesign.swarm import checks
from armdesign.swarm.checks import Mask

Sampler = Callable[[np.random.Generator, int], Array]
"""Draws `count` positions, shape (count, D), from a generator."""
ROUNDING = 1e-9
"""Relative distance by which a drawn position may miss the box."""
INSIDE = 1e-12
"""By how much a point is moved farther than onto the slab's bound, so that rounding leaves it inside."""


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
        flags = np.array(self.angular, dtype=object)  # bool would take 0, 1 and even text for flags
        if flags.ndim != 1 or not all(isinstance(flag, (bool, np.bool_)) for flag in flags):
            raise SettingsError(
                "box column 'angular' does not hold flags", value=self.angular, allowed="true or false per entry"
            )
        columns = {name: _column(name, getattr(self, name)) for name in ("lower", "upper")}
        for name, column in (columns | {"angular": flags.astype(np.bool_)}).items():
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

    def checked(self, drawn: ArrayLike, count: int) -> Array:
        """Positions that lie in the box, copied; rounding at a bound is forgiven.

        Args:
            drawn: The positions, shape (N, D).
            count: Number of positions N.

        Raises:
            SearchError: A wrong shape, or a position that is out of bounds.
        """
        X = checks.numbers("the positions", drawn, (count, self.dimension))
        inside = self.clip(X)
        wrong = ~(np.abs(X - inside) <= ROUNDING * np.maximum(1.0, np.abs(inside)))  # NaN is wrong, too
        for j, entry in np.argwhere(wrong):
            allowed = f"[{self.lower[entry]:g}, {self.upper[entry]:g}]"
            message = f"the position of candidate {j} has entry {entry} = {X[j, entry]:g}"
            raise SearchError(message, value=float(X[j, entry]), allowed=allowed)
        return inside


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
        return self.box.checked(draw(rng, count), count)


class Region:
    """The box scaled to [0, 1] in its free entries, and the slab across it.

    Attributes:
        space: Box, slab and canonical form of the positions.
        box: The box.
        free: Which entries are free, shape (D,).
        angular: Which of the free ones are angles, shape (K,).
        weights: The slab's weights on unit coordinates, shape (K,).
        low: Lower bound of weights u.
        high: Upper bound of weights u.
    """

    def __init__(self, space: SearchSpace) -> None:
        """Scale.

        Args:
            space: Box, slab and canonical form of the positions.

        Raises:
            SettingsError: Every entry of the box is fixed, or the slab has another number of weights.
        """
        self.space, self.box = space, space.box
        box, slab = space.box, space.slab or Slab(np.zeros(space.box.dimension), -1.0, 1.0)
        self.free = box.width > 0.0
        self.angular = box.angular[self.free]
        if not self.free.any():
            raise SettingsError("every entry of the box is fixed", fix="Free one")
        if len(slab.weights) != box.dimension:
            raise SettingsError(f"the slab has {len(slab.weights)} weights", allowed=box.dimension)
        self.weights = (slab.weights * box.width)[self.free]
        offset = float(slab.weights @ box.lower)
        self.low, self.high = slab.low - offset, slab.high - offset

    @property
    def dimension(self) -> int:
        """Number of free entries K."""
        return int(self.free.sum())

    def units(self, X: Array) -> Array:
        """Unit coordinates of positions, shape (N, D) -> (N, K)."""
        return np.asarray(((X - self.box.lower) / np.where(self.free, self.box.width, 1.0))[:, self.free])

    def positions(self, U: Array) -> Array:
        """Positions of unit coordinates, shape (N, K) -> (N, D)."""
        X = np.tile(self.box.lower, (len(U), 1))
        X[:, self.free] += U * self.box.width[self.free]
        return self.box.clip(X)

    def canonical(self, U: Array) -> Array:
        """Unit coordinates in a form that is the same for equal designs, shape (N, K) -> (N, K)."""
        return U if self.space.canonical is None else self.units(self.space.canonical(self.positions(U)))

    def unit_slopes(self, slopes: Array) -> Array:
        """Gradients by unit coordinates from those by positions, shape (N, D) -> (N, K)."""
        return np.asarray((slopes * self.box.width)[:, self.free])

    def pulled_in(self, U: Array, margin: float) -> Array:
        """Unit coordinates clipped to the box, their weighted entries scaled until the slab holds them.

        Args:
            U: Unit coordinates, shape (N, K).
            margin: How far inside the slab they shall come.
        """
        V = np.clip(U, 0.0, 1.0)
        total = V @ self.weights  # scaled, not shifted: entries that are zero stay so, and proportions are kept
        wanted = np.clip(total, self.low + margin, self.high - margin)
        factor = np.where(total > 0.0, wanted / np.where(total > 0.0, total, 1.0), 1.0)
        return np.clip(np.where(self.weights > 0.0, V * factor[:, None], V), 0.0, 1.0)


def project(V: Array, lower: Array, upper: Array, weights: Array, low: Array, high: Array) -> Array:
    """The nearest points of lower <= p <= upper, low <= weights p <= high, each row for itself.

    A row whose box misses the slab comes as near as it can.

    Args:
        V: Points, shape (N, K).
        lower: Lower bounds, shape (N, K).
        upper: Upper bounds, shape (N, K).
        weights: Weights of the slab, shape (K,).
        low: Its lower bounds, shape (N,).
        high: Its upper bounds, shape (N,).
    """
    P = np.clip(V, lower, upper)
    total = P @ weights
    # the projection meets at most one side of the slab: clip(V - t w) with the one multiplier t of that side
    for sign, bound, wrong in ((1.0, high, total > high), (-1.0, low, total < low)):
        if wrong.any():
            P[wrong] = _shifted(V[wrong], lower[wrong], upper[wrong], sign * weights, sign * bound[wrong])
    return P


def _shifted(V: Array, lower: Array, upper: Array, weights: Array, bound: Array) -> Array:
    """clip(V - t weights) with the smallest t >= 0 at which weights p <= bound, row by row.

    The sum falls with t in straight pieces between the t at which an entry meets a bound.
    """
    w = weights[weights != 0.0]
    v, low, high = (X[:, weights != 0.0] for X in (V, lower, upper))
    # between these t the sum is linear, so that the wanted t follows from the two ends around it
    ends = np.sort(np.maximum(np.hstack([np.zeros((len(v), 1)), (v - low) / w, (v - high) / w]), 0.0), axis=1)
    total = np.clip(v[:, None] - ends[:, :, None] * w, low[:, None], high[:, None]) @ w
    rows, last = np.arange(len(v)), ends.shape[1] - 1
    within = total <= bound[:, None]
    right = np.where(within.any(axis=1), np.argmax(within, axis=1), last)
    left = np.maximum(right - 1, 0)
    above, below = total[rows, left], total[rows, right]
    share = np.clip((above - bound + INSIDE) / np.where(above > below, above - below, 1.0), 0.0, 1.0)
    near, far = (np.clip(V - ends[rows, k][:, None] * weights, lower, upper) for k in (left, right))
    return np.asarray(near + share[:, None] * (far - near))


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
