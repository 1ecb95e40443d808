"""Qualisys TSV files: lines of a name and its values, then a table of markers (3D) or of rigid bodies (6D).

    NO_OF_FRAMES    1000
    NO_OF_MARKERS   2
    FREQUENCY       100
    DATA_INCLUDED   3D
    MARKER_NAMES    elbow     wrist
    Frame  Time     elbow X   elbow Y   elbow Z   wrist X   wrist Y   wrist Z
    1      0.00000  316.209   673.199   528.081   nan       nan       nan

The row of column names is missing in older files, the columns Frame and Time where they were not asked for. What was
not seen is ``nan``, an empty cell, NULL, or 0 0 0, as chosen on export. Lengths are millimetres.

In a 6D file each body has the columns X Y Z, three angles, Residual and Rot[0] to Rot[8]: the rotation matrix from the
body's axes to those of the room, column by column. The angles, whose meaning can be set on export, are not used.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import MISSING, Rows, is_number, read_cells
from armdesign.demonstration.files.formats.frame_clock import frame_clock, read_rate
from armdesign.demonstration.files.formats.marker_tables import (
    clean_name,
    column_names,
    count,
    count_steps,
    hide_zeros,
    once_each,
    positions,
    read_table,
    row_steps,
)
from armdesign.demonstration.files.quaternions import are_rotations, from_matrices
from armdesign.demonstration.files.text_files import LinesAhead, Place, check_names, open_text, shown, text_head
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError

_KEYS = (
    *("FILE_VERSION", "NO_OF_FRAMES", "NO_OF_CAMERAS", "NO_OF_MARKERS", "NO_OF_BODIES", "FREQUENCY"),
    *("NO_OF_ANALOG", "ANALOG_FREQUENCY", "DESCRIPTION", "TIME_STAMP", "DATA_INCLUDED", "EVENT"),
    *("MARKER_NAMES", "TRAJECTORY_TYPES", "BODY_NAMES"),
)
_POSITION = ("X", "Y", "Z")
_POSE = (*_POSITION, "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{i}]" for i in range(9)))
_ROTATION = 7  # column of Rot[0] among those of a body
_FIX = "Export the measurement from Qualisys Track Manager again"


class _Layout(NamedTuple):
    """What the columns hold."""

    leading: tuple[str, ...]  # "frame" and "time", as far as there
    names: list[str]
    parts: tuple[str, ...]  # columns of each marker or body


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes is a Qualisys TSV file."""
    lines = [line for line in text_head(head).split("\n") if line.strip()][:2]
    return len(lines) == 2 and all(_key(line) is not None for line in lines)


def read(path: Path) -> Take:
    """Read a 3D or 6D TSV file.

    Returns:
        Markers, or origins and orientations of bodies.
    """
    facts: dict[str, list[str]] = {}
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        while (key := _key(lines.skip_blank())) is not None:
            facts[key] = [cell.strip() for cell in read_cells(lines.readline(), "\t")][1:]
        layout = _read_layout(lines, facts)
        names = column_names(layout.leading, layout.names, layout.parts)
        rows = read_table(lines, "\t", names, keep_empty=not layout.leading)  # without numbers, each line counts
    columns = {name: i for i, name in enumerate(layout.leading)}
    clock = frame_clock(rows, columns.get("frame"), columns.get("time"), read_rate(_first(facts, "FREQUENCY")))
    names, name_steps = once_each(layout.names)
    points, turns, zero_steps = _series(rows, layout, names)
    odd_rows = row_steps(rows, count(_first(facts, "NO_OF_FRAMES")))
    what = "bodies" if turns else "markers"
    odd_names = count_steps(what, count(_first(facts, f"NO_OF_{what.upper()}")), len(names))
    return Take(
        time=clock.time,
        points=points,
        orientations=turns,
        source=str(path),
        format=f"Qualisys TSV {'6D' if turns else '3D'}",
        units="mm",
        rate=clock.rate,
        steps=(*odd_rows, *odd_names, *name_steps, *zero_steps, *clock.steps),
    )


def _key(text: str) -> str | None:
    """The name at the beginning of a header line; None if it is none of those known."""
    word = re.split(r"[\s,;]", text.strip(' \t"'), maxsplit=1)[0].strip('"')
    return word if word in _KEYS else None


def _first(facts: Mapping[str, list[str]], key: str) -> str:
    """The first value of a line; empty where there is none."""
    return next(iter(facts.get(key, [])), "")


def _read_layout(lines: LinesAhead, facts: Mapping[str, list[str]]) -> _Layout:
    """What the columns hold, by the header and the row of column names or, without that, the number of cells."""
    included = _first(facts, "DATA_INCLUDED").upper()
    if included not in ("", "3D", "6D"):
        message = f"{lines.place.source}: the file holds '{shown(included)}' data"
        raise RecordingError(message, value=included, allowed=("3D", "6D"), fix=_FIX)
    parts = _POSE if included == "6D" or "BODY_NAMES" in facts else _POSITION
    names = [clean_name(name) for name in facts.get("BODY_NAMES" if parts is _POSE else "MARKER_NAMES", [])]
    names = names[: max((i + 1 for i, name in enumerate(names) if name), default=0)]
    cells = [cell.strip() for cell in read_cells(lines.peek().rstrip("\t\r\n"), "\t")]
    place = lines.place
    if all(not cell or cell.lower() in MISSING or is_number(cell) for cell in cells):  # no row of column names
        if not names:
            raise RecordingError(f"{place}: the header names no marker or body", fix=_FIX)
        surplus = len(cells) - len(names) * len(parts)
        if surplus == 1:
            message = f"{place}: there is one column more than the {len(cells) - 1} of the names"
            raise RecordingError(f"{message}, and no row of column names", value=len(cells), fix=_FIX)
        layout = _Layout(("frame", "time") if surplus > 0 else (), names, parts)
    else:
        lines.readline()
        layout = _labelled(cells, names, parts, place)
    check_names(layout.names, len(layout.leading) + len(layout.names) * len(parts), place)
    return layout._replace(names=[name or f"unnamed {i + 1}" for i, name in enumerate(layout.names)])


def _labelled(cells: list[str], names: list[str], parts: tuple[str, ...], place: Place) -> _Layout:
    """Columns as their own row names them; the header's names where there are as many."""
    lower = [cell.lower() for cell in cells]
    leading = tuple(lower[: next((i for i, cell in enumerate(lower) if cell not in ("frame", "time")), len(lower))])
    if len(set(leading)) < len(leading):
        raise RecordingError(f"{place}: the column '{leading[0]}' stands twice", fix=_FIX)
    groups, rest = divmod(len(cells) - len(leading), len(parts))
    found = [clean_name(cell.rpartition(" ")[0]) for cell in cells[len(leading) :: len(parts)]]
    fixed = [part.upper() if part in _POSITION or part.startswith("Rot") else "" for part in parts]
    wanted = zip(cells[len(leading) :], fixed * groups, strict=False)  # the angles go by other names in other settings
    if rest or not groups or not all(cell.upper().endswith(part) for cell, part in wanted):
        first = shown(", ".join(cells[len(leading) : len(leading) + len(parts)]), 80)
        message = f"{place}: the columns '{first}' are none of this format"
        raise RecordingError(message, allowed=f"for each name {', '.join(parts)}", fix=_FIX)
    return _Layout(leading, names if len(names) == groups else found, parts)


def _series(rows: Rows, layout: _Layout, names: list[str]) -> tuple[dict[str, Array], dict[str, Array], list[Step]]:
    """Positions and orientations by name, and a step where some were not seen."""
    first, width = len(layout.leading), len(layout.parts)
    if layout.parts is _POSITION:
        points = positions(rows.values, first, names)
        return points, {}, []
    poses = positions(rows.values, first, names, width)
    steps = hide_zeros({name: pose[:, _ROTATION:] for name, pose in poses.items()})
    turns = {name: _turns(pose, name, rows) for name, pose in poses.items()}
    return {name: pose[:, :3] for name, pose in poses.items()}, turns, steps


def _turns(pose: Array, name: str, rows: Rows) -> Array:
    """Quaternions of a body, shape (T, 4); its position is made "not seen" where the rotation is, in place."""
    matrices = pose[:, _ROTATION:].reshape(-1, 3, 3).transpose(0, 2, 1)  # column by column
    hidden = np.isnan(matrices).any(axis=(1, 2))
    pose[hidden, :3] = np.nan
    bad = ~are_rotations(matrices) & ~hidden
    if bad.any():
        row = int(np.argmax(bad))
        message = f"{rows.place(row)}, body '{shown(name)}': Rot[0] to Rot[8] are no rotation matrix"
        raise RecordingError(message, value=pose[row, _ROTATION:], fix=_FIX)
    return from_matrices(matrices)
