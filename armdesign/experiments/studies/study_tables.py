"""Tables of a study: as plain text, as Markdown and as CSV."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from armdesign.files import csv_table


@dataclass(frozen=True)
class Spread:
    """Values summed up."""

    mean: float  # their mean
    spread: float  # their standard deviation, by n - 1; 0 of a single one
    count: int  # how many there are


Cell: TypeAlias = "str | int | float | Spread | None"


@dataclass(frozen=True)
class Column:
    """A column's heading and the digits behind the point of its numbers."""

    name: str
    digits: int = 2


@dataclass(frozen=True)
class Table:
    """A table with what is to be said of it."""

    name: str  # short name, for its file
    title: str  # what it shows, units that the headings leave out included
    columns: Sequence[Column | str]  # headings, plain or with the digits of their numbers
    rows: Sequence[Sequence[Cell]]  # cells; None where there is no value
    notes: Sequence[str] = ()  # sentences below it

    @property
    def headings(self) -> list[Column]:
        """The columns, all with digits."""
        return [column if isinstance(column, Column) else Column(column) for column in self.columns]

    def cells(self, sign: str = "±") -> list[list[str]]:
        """Headings and rows as text.

        Args:
            sign: What stands between a mean and its spread.
        """
        columns = self.headings
        lines = [[column.name for column in columns]]
        for row in self.rows:
            lines.append([shown(cell, column.digits, sign) for cell, column in zip(row, columns, strict=True)])
        return lines

    def text(self) -> str:
        """The table as it is printed."""
        lines = self.cells()
        widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
        left = [all(isinstance(row[i], str) for row in self.rows) for i in range(len(widths))]
        align = [str.ljust if words else str.rjust for words in left]
        rows = [
            "  ".join(a(cell, w) for a, cell, w in zip(align, line, widths, strict=True)).rstrip() for line in lines
        ]
        return "\n".join([self.title, *(f"  {row}" for row in rows), *self.notes])

    def markdown(self) -> str:
        """The table as Markdown."""
        head, *rows = [[cell.replace("|", "\\|") for cell in line] for line in self.cells(" ± ")]
        lines = [head, ["---"] * len(head), *rows]
        body = "\n".join(f"| {' | '.join(line)} |" for line in lines)
        notes = "\n".join(f"- {note}" for note in self.notes)
        return f"### {self.title}\n\n{body}\n" + (f"\n{notes}\n" if notes else "")

    def csv(self) -> str:
        """The table as CSV in full digits; a mean with spread takes three columns."""
        spreads = [any(isinstance(row[i], Spread) for row in self.rows) for i in range(len(self.headings))]
        names = []
        for column, wide in zip(self.headings, spreads, strict=True):
            names += [column.name, f"{column.name} spread", f"{column.name} count"] if wide else [column.name]
        rows = [[x for cell, wide in zip(row, spreads, strict=True) for x in numbers(cell, wide)] for row in self.rows]
        return csv_table(names, rows)


def spread_of(values: Iterable[float]) -> Spread | None:
    """Mean and standard deviation of values; None of none."""
    x = np.array([value for value in values if math.isfinite(value)], dtype=float)
    if not len(x):
        return None
    return Spread(float(x.mean()), float(x.std(ddof=1)) if len(x) > 1 else 0.0, len(x))


def shown(cell: Cell, digits: int, sign: str = "±") -> str:
    """A cell as text."""
    if cell is None:
        return "-"
    if isinstance(cell, Spread):
        spread = f"{sign}{cell.spread:.{digits}f}" if cell.count > 1 else ""  # a single value has none
        return f"{cell.mean:.{digits}f}{spread}"
    if isinstance(cell, float):
        return f"{cell:.{digits}f}" if math.isfinite(cell) else "-"
    return str(cell)


def numbers(cell: Cell, wide: bool) -> list[Cell]:
    """Values of a cell in CSV, three of them in a column that is wide."""
    if isinstance(cell, Spread):
        return [cell.mean, cell.spread, cell.count]
    return [cell, None, None] if wide else [cell]
