"""What tables of markers have in common: names, units, three columns per marker."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import Place, shown
from armdesign.demonstration.recording import Step
from armdesign.errors import RecordingError

UNITS: Mapping[str, str] = {
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), "cm"),
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("in", "inch", "inches"), "in"),
}
_SHOWN = 5  # names listed in a sentence


def read_units(word: str, place: Place) -> str | None:
    """The unit of length that a header names; None where it names none.

    Raises:
        RecordingError: The word is no unit of length known here.
    """
    if not word.strip():
        return None
    units = UNITS.get(word.strip().lower())
    if units is None:
        fix = "Correct it in the file, or export positions in one of these"
        message = f"{place}: the unit '{shown(word.strip())}' is none of length"
        raise RecordingError(message, value=word.strip(), allowed=("m", "cm", "mm", "in"), fix=fix)
    return units


def clean_name(text: str) -> str:
    """A name without blanks around it and without letters that cannot be seen."""
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())


def once_each(names: Sequence[str]) -> tuple[list[str], list[Step]]:
    """Names used once each, the second ``ELB`` becoming ``ELB#2``, and a word on that."""
    taken, result, again = set(names), [], []
    used: dict[str, int] = {}
    for name in names:
        number = used.get(name, 0) + 1
        while number > 1 and f"{name}#{number}" in taken:
            number += 1
        used[name] = number
        result.append(name if number == 1 else f"{name}#{number}")
        again += [] if number == 1 else [result[-1]]
    if not again:
        return result, []
    sentence = f"Names that stand in the file more than once were told apart: {listed(again)}."
    return result, [Step("names", sentence, {"names": again})]


def listed(names: Sequence[str]) -> str:
    """The first few names and how many more there are."""
    more = len(names) - _SHOWN
    return ", ".join(names[:_SHOWN]) + (f" and {more} more" if more > 0 else "")


def column_names(leading: Sequence[str], names: Sequence[str], parts: Sequence[str]) -> list[str]:
    """Column names for messages: those in front, then each marker with each of its parts."""
    return [*leading, *(f"{name} {part}" for name in names for part in parts)]


def positions(values: Array, first: int, names: Sequence[str], step: int = 3, width: int = 3) -> dict[str, Array]:
    """Name to its columns, each of shape (T, width), without a copy, out of a table with ``step`` of them per name."""
    return {name: values[:, first + step * i : first + step * i + width] for i, name in enumerate(names)}


def hide_zeros(series: Mapping[str, Array]) -> list[Step]:
    """Make "not seen" of rows of zeros, in place, and a word on that."""
    hidden = 0
    for values in series.values():
        zero = ~values.any(axis=1)
        values[zero] = np.nan
        hidden += int(zero.sum())
    if not hidden:
        return []
    sentence = f"Zeros in all places stand for what was not seen: so it was taken {hidden} times."
    return [Step("zeros", sentence, {"positions": hidden})]


def decimal_mark(line: str, delimiter: str) -> str:
    """What stands in the numbers of a table, by its first row: a comma only where it is not between the cells."""
    return "," if delimiter != "," and "," in line and "." not in line else "."
