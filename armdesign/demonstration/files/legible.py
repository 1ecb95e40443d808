"""Errors that quote a file are one line of printable letters and of a length that can be read, whatever it holds."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

from armdesign.errors import ArmDesignError

MOST_LETTERS = 900
_KEPT_AT_END = 400  # there stands what to do

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")


def legible(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Decorate a function that reads files, so that the sentences of its errors are legible."""

    @wraps(function)
    def reader(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        try:
            return function(*args, **kwargs)
        except ArmDesignError as error:
            error.args = (legible_text(str(error)),)
            raise

    return reader


def legible_text(text: str) -> str:
    """A text without control characters, shortened in its middle where it is too long."""
    printable = "".join(letter if letter.isprintable() else " " if letter.isspace() else "?" for letter in text)
    if len(printable) <= MOST_LETTERS:
        return printable
    return f"{printable[: MOST_LETTERS - _KEPT_AT_END - 5]} ... {printable[-_KEPT_AT_END:]}"
