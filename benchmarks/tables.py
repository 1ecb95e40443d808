"""Tables of measurements: how they are printed and what goes into the JSON."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

Value: TypeAlias = "float | int | str | None"
Row: TypeAlias = "dict[str, Value]"


@dataclass(frozen=True)
class Table:
    """Rows of equal keys.

    Attributes:
        name: Short name, the key in the JSON.
        title: What was measured and how, units not told by the header included.
        rows: Column name with its unit to value; None where there is none.
        notes: Sentences below the table.
    """

    name: str
    title: str
    rows: list[Row]
    notes: list[str] = field(default_factory=list)

    def text(self) -> str:
        """The table as it is printed."""
        if not self.rows:
            return "\n".join([self.title, *self.notes])
        lines = [list(self.rows[0]), *([shown(value) for value in row.values()] for row in self.rows)]
        widths = [max(len(line[i]) for line in lines) for i in range(len(lines[0]))]
        body = ["  ".join(cell.rjust(width) for cell, width in zip(line, widths, strict=True)) for line in lines]
        return "\n".join([self.title, *body, *self.notes])


def shown(value: Value) -> str:
    """A cell: three digits are as many as a timing bears."""
    if value is None:
        return "-"
    if not isinstance(value, float):
        return str(value)
    size = abs(value)
    return f"{value:.0f}" if size >= 100 else f"{value:.1f}" if size >= 10 else f"{value:.2f}"
