"""Plain CSV recordings: a column ``time``, then columns per point.

    time,elbow_x,elbow_y,elbow_z,hand_x,hand_y,hand_z,hand_qx,hand_qy,hand_qz,hand_qw

Times in seconds, positions in metres, quaternions scalar last. An empty cell (or ``nan``) means "not seen". Lines
without any value are skipped; without times every line is a frame, and the frame rate has to be given. The columns may
stand in any order; the points keep the order of the header.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TextIO

import numpy as np

from armdesign.demonstration.files.csv_cells import Dialect, is_number, read_cells, read_rows
from armdesign.demonstration.files.text_files import (
    Place,
    check_names,
    describe_binary,
    is_text,
    read_head,
    read_line,
    shown,
    unreadable,
)
from armdesign.demonstration.recording import Recording, Take
from armdesign.errors import RecordingError
from armdesign.files import write_whole

_POSITION = ("x", "y", "z")
_QUATERNION = ("qx", "qy", "qz", "qw")
_ALLOWED = "time, NAME_x, NAME_y, NAME_z and optionally NAME_qx, NAME_qy, NAME_qz, NAME_qw"

Layout = dict[str, dict[str, int]]  # point name -> component -> column


def read_plain_csv(path: str | os.PathLike[str]) -> Recording:
    """Read a plain CSV recording that has times.

    Returns:
        The recording as in the file: nothing filled, filtered or turned.

    Raises:
        RecordingError: The file cannot be read or a line, column or value is wrong; the message says which.
    """
    take = read(Path(path))
    if not take.timed:
        fix = "Add a column 'time' in seconds"
        raise RecordingError(f"{take.source} holds no times, it has no column 'time'", allowed=_ALLOWED, fix=fix)
    return Recording(take.time, take.points, take.orientations, take.source)


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes can be plain CSV: any text, so that reading says what is wrong."""
    return is_text(head)


def read(source: Path) -> Take:
    """Read a plain CSV recording as a take, which is in metres with z up and finished."""
    head = read_head(source)
    if not is_text(head):
        raise RecordingError(f"{source} is not a text file", value=str(source), fix=describe_binary(head))
    try:
        with source.open(encoding="utf-8-sig", errors="replace") as stream:
            names, line = _read_header(stream, source)
            layout = _layout(names, Place(source, line))
            dialect = Dialect(keep_empty="time" not in names)  # without times each line counts
            rows = read_rows(stream, names, Place(source, line + 1), dialect)
    except OSError as error:
        raise unreadable(source, error) from error
    points, turns = (
        {
            point: rows.columns([columns[component] for component in components])
            for point, columns in layout.items()
            if components[0] in columns
        }
        for components in (_POSITION, _QUATERNION)
    )
    timed = "time" in names
    return Take(
        time=rows.times(names.index("time")) if timed else np.arange(float(len(rows.values))),
        points=points,
        orientations=turns,
        source=str(source),
        format="plain CSV",
        units="m",
        up="z",
        captured=False,
        timed=timed,
    )


def write_plain_csv(path: str | os.PathLike[str], recording: Recording) -> None:
    """Write a recording as plain CSV, whole or not at all, so that reading gives every number back to the last bit.

    Args:
        path: File to create or replace.
        recording: What to write; missing values become empty cells.

    Raises:
        RunFolderError: The file cannot be written.
        RecordingError: A name holds a comma or a quotation mark.
    """
    write_whole(path, plain_csv(recording))


def plain_csv(recording: Recording) -> str:
    """A recording as plain CSV with all digits, each position followed by its orientation; missing values are empty."""
    header, columns = ["time"], [recording.time[:, None]]
    for name in dict.fromkeys([*recording.points, *recording.orientations]):
        if set(name) & set(',"'):
            raise RecordingError(f"point {name!r} has a comma or a quotation mark in its name", fix="Rename it")
        for series, components in ((recording.points, _POSITION), (recording.orientations, _QUATERNION)):
            if name in series:
                header += [f"{name}_{component}" for component in components]
                columns.append(series[name])
    rows = (",".join("" if math.isnan(v) else repr(v) for v in row.tolist()) for row in np.hstack(columns))
    return "".join(f"{line}\n" for line in (",".join(header), *rows))


def _read_header(stream: TextIO, source: Path) -> tuple[list[str], int]:
    """Column names from the first line that is not blank, and that line's number."""
    number = 0
    while text := read_line(stream, Place(source, number := number + 1)):
        if text.strip():
            names = [name.strip() for name in read_cells(text)]
            _check_header(names, text.strip(), Place(source, number))
            return [_canonical(name) for name in names], number
    raise RecordingError(f"{source} holds nothing but blank lines", fix="Export the recording again")


def _check_header(names: list[str], text: str, place: Place) -> None:
    """Turn away what is no header of this format, saying what it seems to be instead."""
    line = shown(text, 60)
    for mark, word in ((";", "semicolons"), ("\t", "tabs")):
        if len(names) == 1 and mark in text:
            fix = "Save it with commas between the columns and decimal points in the numbers"
            raise RecordingError(f"{place}: the file looks separated by {word}, not commas ('{line}')", fix=fix)
    if all(is_number(name or "0") for name in names):
        fix = f"Put a line with the column names above the numbers: {_ALLOWED}"
        raise RecordingError(f"{place}: there is no header, the first line holds numbers ('{line}')", fix=fix)
    if "\N{REPLACEMENT CHARACTER}" in text:
        raise RecordingError(f"{place}: the header is not UTF-8 text ('{line}')", fix="Save the file as UTF-8")
    check_names(names, len(names), place)
    ends = (name.lower().rpartition("_") for name in names)
    are_points = all(mark and component in _POSITION + _QUATERNION for _, mark, component in ends)
    if "time" not in map(str.lower, names) and not are_points:
        message = f"{place}: this is no header of a plain CSV recording, it has no column 'time' ('{line}')"
        raise RecordingError(message, value=names, allowed=_ALLOWED)


def _layout(names: list[str], place: Place) -> Layout:
    """The columns of each point's components; the header is complete and free of doubles afterwards."""
    layout: Layout = {}
    first: dict[str, int] = {}
    for column, name in enumerate(names):
        if name and name in first:
            both = f"columns {first[name] + 1} and {column + 1}"
            raise RecordingError(f"{place}: the name '{name}' stands twice, in {both}", fix="Rename or remove one")
        first[name] = column
        if name != "time":
            point, component = _split(name, column, place)
            layout.setdefault(point, {})[component] = column
    if not layout:
        raise RecordingError(f"{place}: there are no points beside the time", allowed=_ALLOWED)
    for point, components in layout.items():
        for wanted in (_POSITION, _QUATERNION):
            missing = [f"'{point}_{component}'" for component in wanted if component not in components]
            if 0 < len(missing) < len(wanted):
                found = ", ".join(f"'{point}_{component}'" for component in wanted if component in components)
                message = f"{place}: there is {found}, but no {' and no '.join(missing)}"
                raise RecordingError(message, value=point, fix="Add what is missing or remove the whole point")
    return layout


def _canonical(name: str) -> str:
    """A column name with ``time`` and the component in lower case and no blanks before the component."""
    point, _, component = name.rpartition("_")
    if component.lower() in _POSITION + _QUATERNION:
        return f"{point.strip()}_{component.lower()}"
    return "time" if name.lower() == "time" else name


def _split(name: str, column: int, place: Place) -> tuple[str, str]:
    """Point and component of a column name; the point may hold underscores itself."""
    if not name:
        fix = "Name it, or remove the comma too many"
        raise RecordingError(f"{place}: column {column + 1} has no name", allowed=_ALLOWED, fix=fix)
    point, _, component = name.rpartition("_")
    if not point or component not in _POSITION + _QUATERNION:
        message = f"{place}: column {column + 1}, '{name}', is neither the time nor part of a point"
        raise RecordingError(message, value=name, allowed=_ALLOWED, fix="Rename or remove the column")
    return point, component
