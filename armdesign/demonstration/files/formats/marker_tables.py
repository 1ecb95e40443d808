"""What tables of markers have in common: names, units, three columns per point, oddities of rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Mapping, Sequence

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import MISSING, Dialect, Rows, read_rows
from armdesign.demonstration.files.text_files import LinesAhead, Place, shown
from armdesign.demonstration.recording import Step
from armdesign.errors import RecordingError

UNITS: Mapping[str, str] = {
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("cm", "centimeter", "centimeters", "centimetre", "centimetres"), "cm"),
    **dict.fromkeys(("mm", "millimeter", "millimeters", "millimetre", "millimetres"), "mm"),
    **dict.fromkeys(("in", "inch", "inches"), "in"),
}
"""Words for units of length, in small letters."""
_LISTED = 5  # names in a sentence


def read_units(word: str, place: Place) -> str | None:
    """The unit of length that a header names, at ``place`` in the file; None where it names none."""
    word = word.strip()
    if word and word.lower() not in UNITS:
        fix = "Correct it in the file, or export positions in one of these"
        if word.lower() in ("px", "pixel", "pixels"):
            fix = "Take the file in metres that Sports2D or Pose2Sim writes beside this one"
        message = f"{place}: the unit '{shown(word)}' is none of length"
        raise RecordingError(message, value=word, allowed=("m", "cm", "mm", "in"), fix=fix)
    return UNITS.get(word.lower())


def clean_name(text: str) -> str:
    """A name without blanks around it and without letters that cannot be seen."""
    return " ".join("".join(letter if letter.isprintable() else " " for letter in text).split())


def once_each(names: Sequence[str]) -> tuple[list[str], list[Step]]:
    """Names used once each, the second ``ELB`` becoming ``ELB#2``, and a step that says so."""
    taken, result = set(names), []
    used: dict[str, int] = {}
    for name in names:
        number = used.get(name, 0) + 1
        while number > 1 and f"{name}#{number}" in taken:
            number += 1
        used[name] = number
        result.append(name if number == 1 else f"{name}#{number}")
    return result, names_steps([new for new, name in zip(result, names, strict=True) if new != name])


def unused_name(name: str, used: Container[str], given: Counter[str]) -> str:
    """A name that is not used yet, the second ``Hand`` of a skeleton becoming ``Hand (2)``.

    Bodies and joints are numbered in another way than markers, as people have written such names into their settings.

    Args:
        name: The name wanted.
        used: Names that are used.
        given: How often each name was wanted so far; counted up here.
    """
    given[name] += 1
    result = name if given[name] == 1 else f"{name} ({given[name]})"
    while result in used:
        given[name] += 1
        result = f"{name} ({given[name]})"
    return result


def names_steps(changed: Sequence[str], details: object = None) -> list[Step]:
    """A step that lists names changed so that each is there once; ``details`` are kept in place of them."""
    if not changed:
        return []
    sentence = f"Names that stand in the file more than once were told apart: {listed(changed)}."
    return [Step("names", sentence, {"names": details or list(changed)})]


def listed(names: Sequence[str]) -> str:
    """The first few names and how many more there are."""
    more = len(names) - _LISTED
    return ", ".join(names[:_LISTED]) + (f" and {more} more" if more > 0 else "")


def column_names(leading: Sequence[str], names: Sequence[str], parts: Sequence[str]) -> list[str]:
    """Column names for messages: those in front of the points, then each point with each of its parts, such as X."""
    return [*leading, *(f"{name} {part}" for name in names for part in parts)]


def positions(values: Array, first: int, names: Sequence[str], width: int = 3) -> dict[str, Array]:
    """Name to its columns, each of shape (T, width), without a copy.

    Args:
        values: A table, shape (T, columns).
        first: Column of the first name.
        names: In the order of the columns.
        width: Number of columns of each name.
    """
    return {name: values[:, first + width * i : first + width * (i + 1)] for i, name in enumerate(names)}


def hide_zeros(series: Mapping[str, Array]) -> list[Step]:
    """Make "not seen" of rows of zeros, in place, and a step that says so."""
    hidden = 0
    for values in series.values():
        zero = ~values.any(axis=1)
        values[zero] = np.nan
        hidden += int(zero.sum())
    if not hidden:
        return []
    sentence = f"Zeros in all places stand for what was not seen: so it was taken {hidden} times."
    return [Step("zeros", sentence, {"positions": hidden})]


def read_table(lines: LinesAhead, delimiter: str, columns: list[str], keep_empty: bool = False) -> Rows:
    """The rows below a header. They may stop early, and the last one may be cut off.

    Args:
        lines: The file, at the first row.
        delimiter: Stands between the cells.
        columns: Column names.
        keep_empty: Whether a line of nothing but delimiters is a row.
    """
    line = lines.peek()
    # Programs follow the decimal mark of the system's language; where commas separate the cells, it is a point.
    decimal = "," if delimiter != "," and "," in line and "." not in line else "."
    dialect = Dialect(delimiter, MISSING, decimal, ragged=True, may_be_cut=True, keep_empty=keep_empty)
    return read_rows(lines, columns, lines.place, dialect)


def row_steps(rows: Rows, announced: int | None = None) -> list[Step]:
    """Steps where the last row is incomplete, others are short, or the header announces another number of frames."""
    steps = []
    if rows.cut is not None:
        sentence = f"The file ends in the middle of line {rows.cut}, which was left out: it may have been cut off."
        steps.append(Step("cut", sentence, {"line": rows.cut}))
    if rows.short:
        sentence = f"Lines that stop early: {rows.short}; what is missing in them was taken as not seen."
        steps.append(Step("short", sentence, {"lines": rows.short}))
    return [*steps, *count_steps("frames", announced, len(rows.values))]


def count_steps(what: str, announced: int | None, found: int) -> list[Step]:
    """A step where the header announces another number of ``what`` than the file holds."""
    if announced in (None, found):
        return []
    sentence = f"The header announces {announced} {what}, the file holds {found}."
    name = "count" if what == "frames" else "markers"
    return [Step(name, sentence, {"announced": announced, "found": found})]


def count(text: str) -> int | None:
    """A number of frames as a header has it; None if it is no such number."""
    return int(text) if text.isdecimal() and len(text) < 16 else None
