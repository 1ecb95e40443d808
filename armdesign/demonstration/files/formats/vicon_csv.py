"""Vicon Nexus CSV files: blocks one below the other, of which ``Trajectories`` holds the markers.

    Trajectories
    100
    ,,Daphnee:EPICl,,,Daphnee:EPICm,,,
    Frame,Sub Frame,X,Y,Z,X,Y,Z
    ,,mm,mm,mm,mm,mm,mm
    1,0,316.209,673.199,528.081,,,

The second line is the frame rate. There is no time; an empty cell means "not seen". Other blocks (Devices, Model
Outputs, Segments) may be above or below, with an empty line between them.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from armdesign.demonstration.files.csv_cells import read_cells
from armdesign.demonstration.files.formats.frame_clock import frame_clock, read_rate
from armdesign.demonstration.files.formats.marker_tables import (
    clean_name,
    column_names,
    listed,
    once_each,
    positions,
    read_table,
    read_units,
    row_steps,
)
from armdesign.demonstration.files.text_files import LinesAhead, Place, check_names, open_text, shown, text_head
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError

_WANTED = "trajectories"
_TITLES = (_WANTED, "devices", "model outputs", "segments", "joints", "events", "objects")
_DELIMITERS = ",;\t"
_FRAME = ("frame", "field #")
_HEADER_LINES = 5  # between the title and the row that begins with Frame
_FIX = "Export the trial from Nexus again, with trajectories"


class _Header(NamedTuple):
    """The lines above the rows of the block."""

    rate: float | None
    names: list[str]
    leading: list[str]  # columns before the first marker
    delimiter: str


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes is a Vicon CSV: a block's title, and below it a frame rate."""
    lines = [line for line in text_head(head).split("\n")[:_HEADER_LINES] if line.strip(" \t,;")]
    return len(lines) > 1 and _title(lines[0]) is not None and read_rate(_cells(lines[1])[0]) is not None


def read(path: Path) -> Take:
    """Read the trajectories of a Vicon CSV."""
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        skipped = _skip_to_block(lines)
        header = _read_header(lines)
        units = _read_units(lines, header)
        lines.skip_blank()
        lines.is_end = lambda text: _title(text) is not None
        rows = read_table(lines, header.delimiter, column_names(header.leading, header.names, "XYZ"))
        lines.is_end = None
        while text := lines.readline():
            title = _title(text)
            skipped += [] if title is None or title in skipped else [title]
    sentence = f"Besides the trajectories the file holds {listed(skipped)}; this was not read."
    blocks = [Step("blocks", sentence, {"blocks": skipped})] if skipped else []
    clock = frame_clock(rows, 0, None, header.rate)
    names, name_steps = once_each(header.names)
    return Take(
        time=clock.time,
        points=positions(rows.values, len(header.leading), names),
        orientations={},
        source=str(path),
        format="Vicon Nexus CSV",
        units=units,
        rate=clock.rate,
        steps=(*blocks, *row_steps(rows), *name_steps, *clock.steps),
    )


def _cells(text: str, delimiter: str | None = None) -> list[str]:
    """Cells without blanks around them, at least one."""
    found = delimiter or next((mark for mark in _DELIMITERS if mark in text), ",")
    return [cell.strip() for cell in read_cells(text, found)]


def _title(text: str) -> str | None:
    """The title of a block; None if the line is none."""
    if text[:1].isdigit():  # quick, as most lines are rows
        return None
    first = _cells(text)[0]
    return first if first.lower() in _TITLES and not any(_cells(text)[1:]) else None


def _skip_to_block(lines: LinesAhead) -> list[str]:
    """Go to the line below the title of the trajectories; titles of the blocks above them."""
    above: list[str] = []
    while text := lines.readline():
        title = _title(text)
        if title is not None and title.lower() == _WANTED:
            return above
        above += [] if title is None or title in above else [title]
    there = f", only {listed(above)}" if above else ""
    raise RecordingError(f"{lines.place.source} holds no block 'Trajectories'{there}", value=above, fix=_FIX)


def _read_header(lines: LinesAhead) -> _Header:
    """The rate, the names and the row that begins with Frame."""
    above: list[str] = []
    for _ in range(_HEADER_LINES):
        place, text = lines.place, lines.readline()
        delimiter = next((mark for mark in _DELIMITERS if mark in text), ",")
        if _cells(text, delimiter)[0].lower() in _FRAME:
            labels = _cells(text, delimiter)
            names = _cells(above[-1], delimiter) if len(above) > 1 else []
            upper = [label.upper() for label in labels]
            if "X" not in upper:
                allowed = "Frame, Sub Frame, X, Y, Z, X, Y, Z, ..."
                raise RecordingError(f"{place}: there is no column 'X'", allowed=allowed, fix=_FIX)
            leading = labels[: upper.index("X")]
            rate = read_rate(_cells(above[0])[0]) if above else None
            return _Header(rate, _names(labels, names, len(leading), place), leading, delimiter)
        above += [text] if text.strip() else []
    where = lines.place.source
    raise RecordingError(f"{where}: no row that begins with 'Frame' stands below 'Trajectories'", fix=_FIX)


def _names(labels: list[str], names: list[str], first: int, place: Place) -> list[str]:
    """Name of each marker, one above each X."""
    count = len("\t".join(labels).rstrip("\t").split("\t"))
    found: list[str] = []
    for column in range(first, count, 3):
        if [label.upper() for label in labels[column : column + 3]] != ["X", "Y", "Z"]:
            three = shown(", ".join(labels[column : column + 3]))
            message = f"{place}, column {column + 1}: the columns '{three}' are no position"
            raise RecordingError(message, allowed="X, Y, Z", fix=_FIX)
        name = clean_name(names[column]) if column < len(names) else ""
        found.append(name or f"unnamed {len(found) + 1}")
    check_names(found, count, place)
    return found


def _read_units(lines: LinesAhead, header: _Header) -> str | None:
    """The unit of all positions; None where the line of units is missing."""
    place, cells = lines.place, _cells(lines.skip_blank(), header.delimiter)
    if cells[0]:
        return None
    lines.readline()
    words = set(cells) - {""}
    if len(words) > 1:
        message = f"{place}: the positions have different units, {shown(listed(sorted(words)), 80)}"
        raise RecordingError(message, value=sorted(words), fix=_FIX)
    return read_units("".join(words), place)
