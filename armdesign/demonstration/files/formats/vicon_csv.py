"""Vicon CSV files: blocks one below the other, of which ``Trajectories`` holds the markers.

    Trajectories
    100
    ,,Daphnee:EPICl,,,Daphnee:EPICm,,,
    Frame,Sub Frame,X,Y,Z,X,Y,Z
    ,,mm,mm,mm,mm,mm,mm
    1,0,316.209,673.199,528.081,,,

The second line is the frame rate. There is no time; an empty cell means "not seen". Other blocks (Devices, Model
Outputs, Segments) may be above or below, with an empty line between them. Older files have lines such as ``Date:``
above, ``100,Hz`` for the rate and ``Field #`` for the frame; velocities (X', Y', Z') beside positions are left out.

Where there are no trajectories, bodies are read: the block ``Objects`` of Tracker or ``Segments`` of Nexus, each body
with RX, RY, RZ, a turn by that angle about that axis (Vicon's helical angles), perhaps RW, which makes a quaternion of
them, and TX, TY, TZ.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import Rows, read_cells
from armdesign.demonstration.files.formats.frame_clock import frame_clock, read_rate
from armdesign.demonstration.files.formats.marker_tables import (
    clean_name,
    listed,
    once_each,
    read_table,
    read_units,
    row_steps,
)
from armdesign.demonstration.files.quaternions import rotation_vector_quaternions
from armdesign.demonstration.files.text_files import LinesAhead, Place, check_names, open_text, shown, text_head
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError

_WANTED, _BODIES = "trajectories", ("objects", "segments")
_TITLES = (_WANTED, "devices", "model outputs", "segments", "joints", "events", "objects")
_DELIMITERS = ",;\t"
_FRAME = ("frame", "field #")
_POSITION, _PLACE = ("X", "Y", "Z"), ("TX", "TY", "TZ")
_POSE = ("RX", "RY", "RZ", *_PLACE)
_VELOCITIES = tuple(tuple(f"{axis}{mark}" for axis in _POSITION) for mark in ("'", "''"))
_KNOWN = (_POSITION, _POSE, ("RX", "RY", "RZ", "RW", *_PLACE), _PLACE, *_VELOCITIES)
_OTHER_UNITS = ("rad", "deg", "mm/s", "mm/s^2", "mm/s²", "m/s", "m/s^2", "m/s²")
_HEADER_LINES = 5  # between the title and the row that begins with Frame
_FIX = "Export the trial from Nexus again, with trajectories"


class _Header(NamedTuple):
    """The lines above the rows of the block."""

    rate: float | None
    names: list[str]
    leading: list[str]  # columns before the first marker or body
    parts: tuple[tuple[str, ...], ...]  # labels of each one's columns
    firsts: list[int]  # the first column of each
    delimiter: str


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes is a Vicon CSV: a block's title, and below it a frame rate."""
    lines = [line for line in text_head(head).split("\n")[:_HEADER_LINES] if line.strip(" \t,;")]
    titles = [i for i, line in enumerate(lines[:-1]) if _title(line) is not None]
    return any(read_rate(_cells(lines[i + 1])[0]) is not None for i in titles)


def read(path: Path) -> Take:
    """Read the trajectories of a Vicon CSV."""
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        wanted, skipped = _skip_to_block(lines)
        header = _read_header(lines, wanted)
        place, words = lines.place, _read_words(lines, header)
        lines.skip_blank()
        lines.is_end = lambda text: _title(text) is not None
        named = zip(header.names, header.parts, strict=True)
        columns = [*header.leading, *(f"{name} {part}" for name, parts in named for part in parts)]
        rows = read_table(lines, header.delimiter, columns)
        lines.is_end = None
        while text := lines.readline():
            title = _title(text)
            skipped += [] if title is None or title in skipped else [title]
    sentence = f"Besides the {wanted} the file holds {listed(skipped)}; this was not read."
    blocks = [Step("blocks", sentence, {"blocks": skipped})] if skipped else []
    clock = frame_clock(rows, 0, None, header.rate)
    names, name_steps = once_each(header.names)
    points, turns, turn_steps = _series(rows, header, names, words)
    return Take(
        time=clock.time,
        points=points,
        orientations=turns,
        source=str(path),
        format="Vicon Nexus CSV" if wanted == _WANTED else f"Vicon {wanted.capitalize()} CSV",
        units=_units(words, place),
        rate=clock.rate,
        steps=(*blocks, *row_steps(rows), *name_steps, *turn_steps, *clock.steps),
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


def _skip_to_block(lines: LinesAhead) -> tuple[str, list[str]]:
    """Go to the line below the title of the trajectories, or else of bodies; that title, and the titles above it."""
    wanted = _wanted(lines.place.source)
    above: list[str] = []
    while text := lines.readline():
        title = _title(text)
        if title is not None and title.lower() == wanted:
            return wanted, above
        above += [] if title is None or title in above else [title]
    there = f", only {listed(above)}" if above else ""
    raise RecordingError(f"{lines.place.source} holds no block 'Trajectories'{there}", value=above, fix=_FIX)


def _wanted(path: Path) -> str:
    """The block to read: trajectories where there are any, else bodies."""
    found: set[str] = set()
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        while _WANTED not in found and (text := lines.readline()):
            title = _title(text)
            found |= set() if title is None else {title.lower()}
    return next((title for title in (_WANTED, *_BODIES) if title in found), _WANTED)


def _read_header(lines: LinesAhead, wanted: str) -> _Header:
    """The rate, the names and the row that begins with Frame."""
    above: list[str] = []
    first = _POSITION[0] if wanted == _WANTED else "RX"
    for _ in range(_HEADER_LINES):
        lines.skip_blank()  # between lines whose ends were doubled
        place, text = lines.place, lines.readline()
        delimiter = next((mark for mark in _DELIMITERS if mark in text), ",")
        if _cells(text, delimiter)[0].lower() in _FRAME:
            labels = _cells(text, delimiter)
            names = _cells(above[-1], delimiter) if len(above) > 1 else []
            upper = [label.upper() for label in labels]
            start = next(
                (i for i, label in enumerate(upper) if label in ({first} if wanted == _WANTED else {first, "TX"})), None
            )
            if start is None:
                allowed = f"Frame, Sub Frame, {'X, Y, Z, X, Y, Z' if first == 'X' else 'RX, RY, RZ, TX, TY, TZ'}, ..."
                raise RecordingError(f"{place}: there is no column '{first}'", allowed=allowed, fix=_FIX)
            rate = read_rate(_cells(above[0])[0]) if above else None
            found, parts, firsts = _items(labels, names, start, place)
            return _Header(rate, found, labels[:start], parts, firsts, delimiter)
        above += [text] if text.strip() else []
    where = lines.place.source
    raise RecordingError(f"{where}: no row that begins with 'Frame' stands below '{wanted.capitalize()}'", fix=_FIX)


def _items(
    labels: list[str], names: list[str], first: int, place: Place
) -> tuple[list[str], tuple[tuple[str, ...], ...], list[int]]:
    """Names of the markers or bodies, the labels of their columns, and their first columns."""
    count = len("\t".join(labels).rstrip("\t").split("\t"))
    found: list[str] = []
    parts: list[tuple[str, ...]] = []
    firsts: list[int] = []
    column = first
    while column < count:
        upper = tuple(label.upper() for label in labels[column:count])
        part = next((known for known in _KNOWN if upper[: len(known)] == known), None)
        if part is None:
            three = shown(", ".join(labels[column : column + 3]))
            message = f"{place}, column {column + 1}: the columns '{three}' are no position"
            raise RecordingError(message, allowed="X, Y, Z, or RX, RY, RZ, TX, TY, TZ", fix=_FIX)
        name = clean_name(names[column]) if column < len(names) else ""
        found.append(name or f"unnamed {len(found) + 1}")
        parts.append(part)
        firsts.append(column)
        column += len(part)
    check_names(found, count, place)
    return found, tuple(parts), firsts


def _series(
    rows: Rows, header: _Header, names: list[str], words: list[str]
) -> tuple[dict[str, Array], dict[str, Array], list[Step]]:
    """Positions, orientations of bodies, and what was assumed of their angles."""
    points: dict[str, Array] = {}
    turns: dict[str, Array] = {}
    for name, parts, first in zip(names, header.parts, header.firsts, strict=True):
        for wanted in (_POSITION, _PLACE):
            if wanted[0] in parts:
                at = first + parts.index(wanted[0])
                points[name] = rows.values[:, at : at + 3]
        if "RX" in parts:
            pose = rows.values[:, first : first + len(parts)]
            hidden = ~np.nan_to_num(pose).any(axis=1)  # Tracker writes zeros for an object that it does not see
            pose[hidden] = np.nan
            factor = np.pi / 180.0 if "deg" in words else 1.0
            turns[name] = pose[:, :4] if "RW" in parts else rotation_vector_quaternions(factor * pose[:, :3])
    if not turns or all("RW" in parts for parts in header.parts):
        return points, turns, []
    sentence = "RX, RY, RZ were taken as Vicon's helical angles: a turn about that axis by its length."
    return points, turns, [Step("angles", sentence)]


def _read_words(lines: LinesAhead, header: _Header) -> list[str]:
    """The words of the line of units, each once; none where that line is missing."""
    cells = _cells(lines.skip_blank(), header.delimiter)
    if cells[0]:
        return []
    lines.readline()
    return sorted(set(cells) - {""})


def _units(words: list[str], place: Place) -> str | None:
    """The unit of all positions; None where the line of units is missing."""
    lengths = [word for word in words if word.lower() not in _OTHER_UNITS]
    if len(lengths) > 1:
        message = f"{place}: the positions have different units, {shown(listed(lengths), 80)}"
        raise RecordingError(message, value=lengths, fix=_FIX)
    return read_units("".join(lengths), place)
