"""Numbers out of comma separated lines: fast where all is well, slowly where a bad cell must be named."""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armdesign.demonstration.recording import Array
from armdesign.errors import RecordingError

_BLANKS = re.compile(r"[ \t]+(?=[,\n])|(?<=[,\n])[ \t]+")


@dataclass(frozen=True)
class Place:
    """A line in a file, for messages.

    Attributes:
        source: The file.
        line: Line number, from 1.
    """

    source: Path
    line: int

    def below(self, lines: int) -> Place:
        """The place that many lines further down."""
        return Place(self.source, self.line + lines)

    def __str__(self) -> str:
        return f"{self.source}, line {self.line}"


def parse_block(lines: list[str], names: list[str], place: Place) -> Array:
    """Numbers of consecutive lines; an empty cell becomes NaN, a line without any value is left out.

    Args:
        lines: The lines with their ends.
        names: Column names, one per cell.
        place: Where the first of the lines stands.

    Returns:
        Shape (rows, columns).

    Raises:
        RecordingError: Naming the line and column of the first bad cell, or the line with a wrong number of cells.
    """
    block = _parse_fast(lines)
    if block is not None and block.shape[1] == len(names) and not np.isinf(block).any():
        return block
    rows = [parse_row(text, names, place.below(i)) for i, text in enumerate(lines) if not is_blank(text)]
    return np.array(rows, dtype=float).reshape(len(rows), len(names))


def _parse_fast(lines: list[str]) -> Array | None:
    """The same by NumPy's own parser, or None where that one does not get through."""
    text = "".join(lines)
    if " " in text or "\t" in text:
        text = _BLANKS.sub("", text)
    text = text.replace(",,", ",nan,").replace(",,", ",nan,").replace(",\n", ",nan\n")
    if not text.strip():
        return None
    try:
        return np.loadtxt(text.split("\n"), delimiter=",", comments=None, ndmin=2)
    except ValueError:
        return None


def parse_row(text: str, names: list[str], place: Place) -> list[float]:
    """Numbers of one line.

    Raises:
        RecordingError: Too few or too many cells, or one that is neither empty nor a finite number.
    """
    cells = read_cells(text)
    if len(cells) != len(names):
        few = "few" if len(cells) < len(names) else "many"
        message = f"{place}: too {few} cells, {len(cells)} where the header has {len(names)} columns"
        raise RecordingError(message, value=len(cells), fix="Complete or remove the line")
    return [_number(cell.strip(), name, place) for cell, name in zip(cells, names, strict=True)]


def read_cells(text: str) -> list[str]:
    """Cells of one line; those in quotation marks may hold commas."""
    try:
        return next(csv.reader([text.strip("\r\n")], skipinitialspace=True), [])
    except csv.Error:  # a cell beyond the size that csv takes
        return text.split(",")


def is_blank(text: str) -> bool:
    """Whether a line holds no value at all, as spreadsheets leave them below a table."""
    return not text.strip(' \t\r\n,"')


def _number(cell: str, name: str, place: Place) -> float:
    """A cell's value, NaN where it is empty."""
    try:
        value = float(cell or "nan") if "_" not in cell else None
    except ValueError:
        value = None
    if value is None:
        message = f"{place}, column '{name}': '{cell[:40]}' is not a number"
        raise RecordingError(message, value=cell, fix="Correct the cell, or leave it empty where nothing was seen")
    if math.isinf(value):
        message = f"{place}, column '{name}': '{cell[:40]}' is not a finite number"
        raise RecordingError(message, value=cell, fix="Correct the cell, or leave it empty where nothing was seen")
    return value
