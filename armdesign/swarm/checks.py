"""Checks of what a search algorithm is given: parameters, answers to what it asked, and a saved state."""

from __future__ import annotations

import inspect
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import SearchError, SettingsError

Mask = NDArray[np.bool_]
P = TypeVar("P")

BIT_GENERATORS = ("PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64")
"""NumPy's own bit generators: those whose state can be saved."""
FIX = "Start the search anew, or restore the saved state"


def number(name: str, value: object, low: float = -math.inf, high: float = math.inf) -> float:
    """A parameter that is a finite number in [low, high].

    Args:
        name: The parameter's name.
        value: Its value.
        low: Smallest value allowed.
        high: Largest value allowed.

    Raises:
        SettingsError: It is not a number, not finite or out of range.
    """
    allowed = f"a finite number in [{low:g}, {high:g}]"
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, float, np.integer, np.floating)):
        raise SettingsError(f"search setting '{name}' is {value!r}, not a number", value=value, allowed=allowed)
    if not (math.isfinite(value) and low <= value <= high):
        raise SettingsError(f"search setting '{name}' is {value}", value=value, allowed=allowed)
    return float(value)


def whole(name: str, value: object) -> int:
    """A parameter that is a whole number of at least 1.

    Args:
        name: The parameter's name.
        value: Its value.

    Raises:
        SettingsError: It is not a whole number, or less than 1.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)) or value < 1:
        raise SettingsError(f"search setting '{name}' is {value!r}", value=value, allowed="a whole number >= 1")
    return int(value)


def numbers(what: str, values: object, shape: tuple[int | None, ...], fix: str | None = None) -> Array:
    """An array of numbers of a given shape, copied; NaN and infinity may occur in it.

    Args:
        what: What the numbers are, for the error message.
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
    """An array of true and false of a given shape, copied.

    Args:
        what: What the flags are, for the error message.
        values: The flags; 0 and 1 are none.
        shape: The wanted shape; None stands for any length.
        fix: The way out, for the error message.

    Raises:
        SearchError: They are not all true or false, or have another shape.
    """
    found = np.array(values, dtype=object)  # bool would take 0, 1 and even text for flags
    _check_shape(what, found.shape, shape, fix)
    for i, flag in enumerate(found):
        if not isinstance(flag, (bool, np.bool_)):
            raise SearchError(
                f"{what} should be flags, number {i} is {flag!r}", value=flag, allowed="true, false", fix=fix
            )
    return found.astype(np.bool_)


def _check_shape(what: str, found: tuple[int, ...], wanted: tuple[int | None, ...], fix: str | None) -> None:
    """Raise a SearchError if the shapes differ; None in the wanted one stands for any length."""
    if len(found) != len(wanted) or any(b is not None and a != b for a, b in zip(found, wanted, strict=True)):
        allowed = "(" + ", ".join("any" if size is None else str(size) for size in wanted) + ")"
        raise SearchError(f"{what} should not have shape {found}", value=found, allowed=allowed, fix=fix)


def fitness(values: ArrayLike, count: int) -> Array:
    """Fitness values, shape (N,), copied.

    Args:
        values: The values; +inf stands for none.
        count: Number of candidates N.

    Raises:
        SearchError: A wrong shape, NaN or -inf.
    """
    found = numbers("the fitness", values, (count,))
    # NaN would be lost in every comparison, and -inf would be a best that nothing can beat
    for j in np.flatnonzero(np.isnan(found) | np.isneginf(found)):
        allowed = "numbers, or inf for a candidate without a fitness"
        raise SearchError(f"the fitness of candidate {j} is {found[j]}", value=float(found[j]), allowed=allowed)
    return found


def encode_generator(rng: np.random.Generator) -> str:
    """The state of a random generator as JSON text, exact and without pickle.

    It is text, not numbers, because it holds integers of 128 bits, which few JSON readers keep.

    Raises:
        SettingsError: The generator is none of NumPy's own.
    """
    state = rng.bit_generator.state
    name = state.get("bit_generator")
    if name not in BIT_GENERATORS:
        raise SettingsError(f"the state of a '{name}' generator cannot be saved", value=name, allowed=BIT_GENERATORS)
    return json.dumps(state, default=lambda value: value.tolist())


@dataclass(frozen=True, eq=False)
class SavedState:
    """The entries of a saved search, checked as they are read; an error names the entry.

    Attributes:
        entries: What `Algorithm.state` returned, by name; arrays may have become nested lists.
        prefix: What the names of all entries of interest begin with.
    """

    entries: Mapping[str, Any]
    prefix: str = ""

    def within(self, prefix: str) -> SavedState:
        """The entries whose names begin with a further prefix, known without it."""
        return SavedState(self.entries, self.prefix + prefix)

    def entry(self, name: str) -> Any:  # noqa: ANN401 (whatever was saved)
        """The entry of that name, as it is.

        Raises:
            SearchError: There is none.
        """
        name = self.prefix + name
        if name not in self.entries:
            raise SearchError(f"the saved search has no entry '{name}'", value=name, fix=FIX)
        return self.entries[name]

    def array(
        self, name: str, shape: tuple[int | None, ...], *, infinite: bool = False, unknown: bool = False
    ) -> Array:
        """An entry of numbers, copied.

        Args:
            name: The entry.
            shape: Its shape; None stands for any length.
            infinite: Whether +inf may occur in it.
            unknown: Whether NaN may occur in it, and infinity of either sign.

        Raises:
            SearchError: It is missing, does not hold such numbers or has another shape.
        """
        value, what = self.entry(name), f"entry '{name}' of the saved search"
        if isinstance(value, list) and not value and not shape[0]:  # nothing, which as a list has lost its shape
            return np.zeros([size or 0 for size in shape])
        values = numbers(what, value, shape, FIX)
        if not unknown and not np.all(np.isfinite(values) | (infinite & np.isposinf(values))):
            raise SearchError(f"{what} holds a value that is not finite", fix=FIX)
        return values

    def flags(self, name: str, shape: tuple[int | None, ...]) -> Mask:
        """An entry of true and false, copied.

        Args:
            name: The entry.
            shape: Its shape; None stands for any length.

        Raises:
            SearchError: It is missing, holds something else or has another shape.
        """
        return flags(f"entry '{name}' of the saved search", self.entry(name), shape, FIX)

    def generator(self) -> np.random.Generator:
        """The random generator whose state :func:`encode_generator` wrote to the entry "generator".

        Raises:
            SearchError: The entry is missing or holds no such state.
        """
        text = self.entry("generator")
        try:
            state = json.loads(str(text))
            name = state["bit_generator"]
            if name not in BIT_GENERATORS:  # never a name out of a file as an attribute of a module
                raise ValueError(f"unknown generator '{name}'")
            bits = getattr(np.random, name)(0)
            bits.state = state
        except (KeyError, TypeError, ValueError, OverflowError, IndexError) as error:
            message = f"the saved state of the random generator cannot be read ({error})"
            raise SearchError(message, value=text, fix=FIX) from error
        return np.random.Generator(bits)

    def parameters(self, kind: type[P]) -> P:
        """The parameters of an algorithm, from the entry "parameters".

        Args:
            kind: Their dataclass.

        Raises:
            SearchError: The entry is missing or holds no parameters.
            SettingsError: A parameter is unknown or out of range.
        """
        value = self.entry("parameters")
        if not isinstance(value, Mapping):
            message = f"entry 'parameters' of the saved search is a {type(value).__name__}"
            raise SearchError(message, value=value, allowed="settings by name", fix=FIX)
        known = list(inspect.signature(kind).parameters)
        for name in value:
            if name not in known:
                raise SettingsError(f"the saved search has an unknown setting '{name}'", value=name, allowed=known)
        return kind(**value)
