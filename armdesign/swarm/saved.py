"""Reading the entries of a saved search, with errors that name the entry."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any, TypeVar

import numpy as np

from armdesign._types import Array
from armdesign.errors import SearchError, SettingsError
from armdesign.swarm import checks
from armdesign.swarm.checks import Mask

P = TypeVar("P")

FIX = "Start the search anew, or restore the saved state"


def entry(state: Mapping[str, Any], name: str) -> Any:  # noqa: ANN401
    """The entry of that name.

    Raises:
        SearchError: There is none.
    """
    if name not in state:
        raise SearchError(f"the saved search has no entry '{name}'", value=name, fix=FIX)
    return state[name]


def check_algorithm(state: Mapping[str, Any], name: str) -> None:
    """Refuse the state of another algorithm.

    Raises:
        SearchError: It is one, or does not say.
    """
    algorithm = entry(state, "algorithm")
    if algorithm != name:
        raise SearchError(f"the saved search used '{algorithm}', not '{name}'", value=algorithm, allowed=name)


def parameters(state: Mapping[str, Any], kind: type[P]) -> P:
    """The parameters of an algorithm in the entry "parameters".

    Args:
        state: The saved state.
        kind: Their dataclass.

    Raises:
        SearchError: The entry is missing or holds no parameters.
        SettingsError: A parameter is unknown or out of range.
    """
    value = entry(state, "parameters")
    if not isinstance(value, Mapping):
        message = f"entry 'parameters' of the saved search is a {type(value).__name__}"
        raise SearchError(message, value=value, allowed="settings by name", fix=FIX)
    known = list(inspect.signature(kind).parameters)
    for name in value:
        if name not in known:
            raise SettingsError(f"the saved search has an unknown setting '{name}'", value=name, allowed=known)
    return kind(**value)


def array(state: Mapping[str, Any], name: str, shape: tuple[int | None, ...], *, infinite: bool = False) -> Array:
    """An entry of numbers, copied; None in the shape stands for any length.

    Args:
        state: The saved state.
        name: The entry.
        shape: Its shape.
        infinite: Whether +inf may occur in it.

    Raises:
        SearchError: It is missing, does not hold numbers or has another shape.
    """
    what = f"entry '{name}' of the saved search"
    values = numbers(state, name, shape)
    if not np.all(np.isfinite(values) | (infinite & np.isposinf(values))):
        raise SearchError(f"{what} holds a value that is not finite", fix=FIX)
    return values


def flags(state: Mapping[str, Any], name: str, shape: tuple[int | None, ...]) -> Mask:
    """An entry of true and false, copied; None in the shape stands for any length.

    Raises:
        SearchError: It is missing, holds something else or has another shape.
    """
    return checks.flags(f"entry '{name}' of the saved search", entry(state, name), shape, FIX)


def hints(state: Mapping[str, Any], name: str, count: int) -> Array:
    """An entry of hints, shape (count, H); a hint that is not known is NaN.

    Raises:
        SearchError: It is missing, does not hold numbers or has another shape.
    """
    return numbers(state, name, (count, None))


def numbers(state: Mapping[str, Any], name: str, shape: tuple[int | None, ...]) -> Array:
    """An entry of numbers, NaN and infinity included, copied; arguments as for :func:`array`.

    Raises:
        SearchError: It is missing, does not hold numbers or has another shape.
    """
    value = entry(state, name)
    if isinstance(value, list) and not value and not shape[0]:  # nothing, which as a list has lost its shape
        return np.zeros([size or 0 for size in shape])
    return checks.numbers(f"entry '{name}' of the saved search", value, shape, FIX)
