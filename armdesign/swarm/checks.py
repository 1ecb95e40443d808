"""Checks of what the caller hands to a search algorithm: settings, positions, fitness and validity."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import SearchError, SettingsError

Mask = NDArray[np.bool_]

ROUNDING = 1e-9
"""Relative distance by which a drawn position may miss the box."""


def number(name: str, value: object, low: float = -math.inf, high: float = math.inf) -> float:
    """A finite number in [low, high].

    Raises:
        SettingsError: It is not a number, not finite or out of range.
    """
    allowed = f"a finite number in [{low:g}, {high:g}]"
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise SettingsError(f"search setting '{name}' is {value!r}, not a number", value=value, allowed=allowed)
    if not (math.isfinite(value) and low <= value <= high):
        raise SettingsError(f"search setting '{name}' is {value}", value=value, allowed=allowed)
    return float(value)


def whole(name: str, value: object, low: int = 1) -> int:
    """A whole number of at least `low`.

    Raises:
        SettingsError: It is not a whole number or too small.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)) or value < low:
        allowed = f"a whole number >= {low}"
        raise SettingsError(f"search setting '{name}' is {value!r}", value=value, allowed=allowed)
    return int(value)


def generator(value: object) -> np.random.Generator:
    """A NumPy random generator.

    Raises:
        SettingsError: It is something else, for instance a seed.
    """
    if not isinstance(value, np.random.Generator):
        message = f"a search draws from a numpy.random.Generator, got {type(value).__name__}"
        raise SettingsError(message, value=value, fix="Pass numpy.random.default_rng(seed)")
    return value


def numbers(what: str, values: object, shape: tuple[int | None, ...], fix: str | None = None) -> Array:
    """An array of numbers of that shape, copied.

    Args:
        what: Their name in the error message.
        values: The numbers.
        shape: The wanted shape; None stands for any length.
        fix: The way out, for the error message.

    Raises:
        SearchError: They are not numbers or have another shape.
    """
    try:
        found = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise SearchError(f"{what} should be numbers ({error})", value=values, fix=fix) from error
    _check_shape(what, found.shape, shape, fix)
    return found


def flags(what: str, values: object, shape: tuple[int | None, ...], fix: str | None = None) -> Mask:
    """A column of flags of that shape, copied; arguments as for :func:`numbers`.

    Raises:
        SearchError: They are not all true or false, or have another shape.
    """
    found = np.array(values, dtype=object)  # keeps 0 and 1 apart from false and true
    _check_shape(what, found.shape, shape, fix)
    for i, flag in enumerate(found):
        if not isinstance(flag, (bool, np.bool_)):
            raise SearchError(
                f"{what} should be flags, number {i} is {flag!r}", value=flag, allowed="true, false", fix=fix
            )
    return found.astype(np.bool_)


def _check_shape(what: str, found: tuple[int, ...], wanted: tuple[int | None, ...], fix: str | None) -> None:
    """Raise if the shapes differ."""
    if len(found) != len(wanted) or any(b is not None and a != b for a, b in zip(found, wanted, strict=True)):
        allowed = "(" + ", ".join("any" if size is None else str(size) for size in wanted) + ")"
        raise SearchError(f"{what} should not have shape {found}", value=found, allowed=allowed, fix=fix)


def positions(drawn: ArrayLike, lower: Array, upper: Array, count: int) -> Array:
    """Positions between their bounds, shape (N, D); rounding at a bound is forgiven.

    Args:
        drawn: The positions, shape (N, D).
        lower: Lower bounds, shape (D,).
        upper: Upper bounds, shape (D,).
        count: Number of positions N.

    Raises:
        SearchError: A wrong shape, or a position that is out of bounds.
    """
    X = numbers("the positions", drawn, (count, len(lower)))
    inside = np.clip(X, lower, upper)
    wrong = ~(np.abs(X - inside) <= ROUNDING * np.maximum(1.0, np.abs(inside)))  # NaN is wrong, too
    for j, entry in np.argwhere(wrong):
        allowed = f"[{lower[entry]:g}, {upper[entry]:g}]"
        message = f"the position of candidate {j} has entry {entry} = {X[j, entry]:g}"
        raise SearchError(message, value=float(X[j, entry]), allowed=allowed)
    return np.asarray(inside)


def fitness(told: ArrayLike, count: int) -> Array:
    """Fitness values, shape (N,).

    Args:
        told: The values.
        count: Number of candidates N.

    Raises:
        SearchError: A wrong shape, NaN or -inf.
    """
    values = numbers("the fitness", told, (count,))
    for j in np.flatnonzero(np.isnan(values) | np.isneginf(values)):
        allowed = "numbers, or inf for a candidate without a fitness"
        raise SearchError(f"the fitness of candidate {j} is {values[j]}", value=float(values[j]), allowed=allowed)
    return values
