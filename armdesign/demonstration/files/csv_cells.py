"""Numbers out of separated lines of text: fast where all is well, slowly where a bad cell must be named."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.demonstration.files.text_files import Lines, Place, check_columns, check_size, read_lines, shown
from armdesign.demonstration.recording import describe_bad_step, first_bad_step
from armdesign.errors import RecordingError

MISSING = ("null", "none", "n/a", "nan(ind)", "-nan(ind)", "1.#qnan", "-1.#ind", "1.#ind")
"""Words for "not seen" beside an empty cell and ``nan``, in small letters."""

BLOCK = 8 << 20  # characters parsed at a time


@dataclass(frozen=True)
class Dialect:
    """How a table is written."""

    delimiter: str = ","  # between the cells
    missing: tuple[str, ...] = ()  # words for "not seen" beside an empty cell and nan, in small letters
    decimal: str = "."  # a point or a comma
    ragged: bool = False  # whether a line may stop early (what is missing was not seen) or go on with empty cells
    may_be_cut: bool = False  # whether an incomplete last line is dropped, as the end of a file that was cut off
    keep_empty: bool = False  # whether a line of nothing but delimiters is a row


@dataclass(frozen=True, eq=False)
class Rows:
    """A table of numbers, NaN where a cell is empty."""

    values: Array  # shape (T, columns)
    lines: NDArray[np.int64]  # the number of each row's line in the file, shape (T,)
    source: Path  # the file
    short: int = 0  # how many lines stopped early
    cut: int | None = None  # number of the incomplete last line that was dropped; None if there was none

    def place(self, row: int) -> Place:
        """The line of a row."""
        return Place(self.source, int(self.lines[row]))

    def columns(self, wanted: Sequence[int]) -> Array:
        """Some columns, shape (T, wanted); without a copy if they are neighbours."""
        first, end = wanted[0], wanted[0] + len(wanted)
        neighbours = list(wanted) == list(range(first, end))
        return self.values[:, first:end] if neighbours else self.values[:, list(wanted)]

    def times(self, column: int) -> Array:
        """Times in a column, shape (T,) [s]."""
        times: Array = self.values[:, column]
        bad = first_bad_step(times)
        if bad is not None:
            message = f"{self.place(bad)}, column 'time': {describe_bad_step(times, bad)}"
            fix = "Every frame needs a later time than the one before"
            raise RecordingError(message, value=float(times[bad]), fix=fix)
        return times


def read_rows(stream: Lines, names: list[str], place: Place, dialect: Dialect, block: int = BLOCK) -> Rows:
    """All rows from here to the end of the file; an empty cell becomes NaN, a line without any value is left out.

    Args:
        stream: The file, at the first row.
        names: Column names, one per cell.
        place: The line of the first row.
        dialect: How the table is written.
        block: Characters parsed at a time.

    Raises:
        RecordingError: Naming the line and column of the first bad cell, or the line with a wrong number of cells; or
            the table is larger than any recording.
    """
    check_columns(len(names), place)
    values, numbers = [np.empty((0, len(names)))], [np.empty(0, dtype=np.int64)]
    short, cut, total = 0, None, 0
    blank = "\r\n" if dialect.keep_empty else ' \t\r\n"' + dialect.delimiter
    lines = read_lines(stream, place, block)
    while lines:
        following = read_lines(stream, place.below(len(lines)), block)
        kept = [i for i, text in enumerate(lines) if text.strip(blank)]
        if not following and kept and _is_cut(lines[kept[-1]], len(names), dialect):
            cut = place.line + kept.pop()
        parsed, filled_up = _parse(lines, kept, names, place, dialect)
        values.append(parsed)
        numbers.append(np.array(kept, dtype=np.int64) + place.line)
        short += filled_up
        place, lines, total = place.below(len(lines)), following, total + parsed.size
        check_size(total, place)
    return Rows(np.concatenate(values), np.concatenate(numbers), place.source, short, cut)


def read_cells(text: str, delimiter: str = ",") -> list[str]:
    """Cells of one line; those in quotation marks may hold delimiters."""
    text = text.strip("\r\n")
    if '"' not in text or text.count('"') % 2:
        return text.split(delimiter)
    try:
        return next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error:  # a cell beyond the size that csv takes
        return text.split(delimiter)


def is_number(cell: str) -> bool:
    """Whether a cell holds a number, with a decimal point or comma."""
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _is_cut(text: str, width: int, dialect: Dialect) -> bool:
    """Whether the last line looks like that of a file cut off in the middle."""
    if not dialect.may_be_cut:
        return False
    is_short = text.count(dialect.delimiter) + 1 < width
    if text.endswith("\n"):
        return is_short and not dialect.ragged
    return is_short or _value(text.rpartition(dialect.delimiter)[2].strip(), dialect) is None


def _parse(lines: list[str], kept: list[int], names: list[str], place: Place, dialect: Dialect) -> tuple[Array, int]:
    """Numbers of those lines whose indices are kept, shape (kept, columns), and how many lines stopped early."""
    texts, short = [lines[i].strip(_blanks(dialect) + "\r\n") for i in kept], 0
    if dialect.ragged:
        texts, short = _square(texts, len(names), dialect.delimiter)
    block = _parse_fast(texts, dialect)
    if block is not None and block.shape == (len(kept), len(names)) and not np.isinf(block).any():
        return block, short
    rows = [_parse_row(text, names, place.below(i), dialect) for i, text in zip(kept, texts, strict=True)]
    return np.array(rows, dtype=float).reshape(len(rows), len(names)), short


def _square(texts: list[str], width: int, delimiter: str) -> tuple[list[str], int]:
    """Lines filled up to as many cells as the header has, or without empty cells too many; how many were filled up."""
    square, short = [], 0
    for text in texts:
        missing = width - 1 - text.count(delimiter)
        short += missing > 0
        if missing < 0:
            first, *surplus = text.rsplit(delimiter, -missing)
            square.append(text if any(cell.strip() for cell in surplus) else first)
        else:
            square.append(text + delimiter * missing)
    return square, short


def _parse_row(text: str, names: list[str], place: Place, dialect: Dialect) -> list[float]:
    """Numbers of one line, by a slower way that can name a bad cell."""
    cells = read_cells(text, dialect.delimiter)
    if len(cells) != len(names):
        few = "few" if len(cells) < len(names) else "many"
        message = f"{place}: too {few} cells, {len(cells)} where the header has {len(names)} columns"
        raise RecordingError(message, value=len(cells), fix="Complete or remove the line")
    values = []
    for cell, name in zip(map(str.strip, cells), names, strict=True):
        value = _value(cell, dialect)
        if value is None or math.isinf(value):
            what = "a number" if value is None else "a finite number"
            message = f"{place}, column '{shown(name)}': '{shown(cell)}' is not {what}"
            raise RecordingError(message, value=cell, fix="Correct the cell, or leave it empty where nothing was seen")
        values.append(value)
    return values


def _parse_fast(texts: list[str], dialect: Dialect) -> Array | None:
    """Numbers of some lines by NumPy's own parser, or None where that one does not get through."""
    mark = dialect.delimiter
    text = "\n".join(f"{'nan' * text.startswith(mark)}{text}{'nan' * text.endswith(mark)}" for text in texts)
    if dialect.decimal != ".":
        text = text.replace(dialect.decimal, ".")
    block = None if mark + mark in text else _load(text, mark)
    if block is None:  # NumPy takes no empty cells
        blanks = f"[{_blanks(dialect)}]*" if any(letter in text for letter in _blanks(dialect)) else ""
        text = re.sub(f"{re.escape(mark)}{blanks}(?={re.escape(mark)})", f"{mark}nan", text)
        block = _load(text, mark)
    if block is None and dialect.missing:
        text = text.lower()
        for word in dialect.missing:
            text = text.replace(word, "nan")
        block = _load(text, mark)
    return block


def _blanks(dialect: Dialect) -> str:
    """Letters that may surround a cell."""
    return " " if dialect.delimiter == "\t" else " \t"


def _load(text: str, mark: str) -> Array | None:
    """NumPy's parser."""
    try:
        return np.loadtxt(text.split("\n"), delimiter=mark, comments=None, ndmin=2) if text else None
    except ValueError:
        return None


def _value(cell: str, dialect: Dialect) -> float | None:
    """A cell's value, NaN where it is empty, None where it is no number."""
    if not cell or cell.lower() in dialect.missing:
        return math.nan
    try:
        return float(cell.replace(dialect.decimal, ".")) if "_" not in cell else None
    except ValueError:
        return None
