"""A file per bone: one position and orientation per line, and mostly no time.

    x,y,z,q0,q1,q2,q3

The bone has the file's name. ``q0`` to ``q3`` are taken as x, y, z, w; ``qx``, ``qy``, ``qz``, ``qw`` are understood
as well. The columns may be in any order. There may be a column ``time`` in seconds; where there is none, the frame
rate has to be given.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from armdesign.demonstration.files.csv_cells import MISSING, Dialect, read_cells, read_rows
from armdesign.demonstration.files.formats.frame_clock import check_frames
from armdesign.demonstration.files.formats.marker_tables import row_steps
from armdesign.demonstration.files.text_files import LinesAhead, open_text, shown, text_head
from armdesign.demonstration.recording import Take
from armdesign.errors import RecordingError

_POSITION = ("x", "y", "z")
_QUATERNIONS = (("qx", "qy", "qz", "qw"), ("q0", "q1", "q2", "q3"))
_TIME = "time"
_ALLOWED = "x, y, z, then q0, q1, q2, q3 or qx, qy, qz, qw, and optionally time, each once"


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes holds one bone."""
    first = text_head(head).lstrip().partition("\n")[0]
    return _quaternion(_names(first)) is not None


def read(path: Path) -> Take:
    """Read a bone's file.

    Args:
        path: The file; the bone is called by its name without the ending.

    Returns:
        One point with its orientation.
    """
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        names = _header(lines)
        dialect = Dialect(
            ",", MISSING, may_be_cut=True, keep_empty=_TIME not in names
        )  # without times each line counts
        rows = read_rows(lines, names, lines.place, dialect)
    check_frames(rows)
    quaternion = _quaternion(names) or ()
    body = "".join(letter for letter in path.stem if ord(letter) >= 32).strip() or "bone"
    timed = _TIME in names
    return Take(
        time=rows.times(names.index(_TIME)) if timed else np.arange(float(len(rows.values))),
        points={body: rows.values[:, [names.index(name) for name in _POSITION]]},
        orientations={body: rows.values[:, [names.index(name) for name in quaternion]]},
        source=str(path),
        format="bone CSV",
        timed=timed,
        unordered=frozenset({body} if "q0" in quaternion else ()),
        usual_order="xyzw",
        steps=tuple(row_steps(rows)),
    )


def _names(text: str) -> list[str]:
    """Column names of a header."""
    return [name.strip().lower() for name in read_cells(text)]


def _quaternion(names: list[str]) -> tuple[str, ...] | None:
    """Names of the quaternion's columns x, y, z, w; None if these are not the columns of one bone."""
    for quaternion in _QUATERNIONS:
        wanted = sorted((*_POSITION, *quaternion))
        if sorted(names) in (wanted, sorted((*wanted, _TIME))):
            return quaternion
    return None


def _header(lines: LinesAhead) -> list[str]:
    """Column names from the first line that is not blank."""
    text, place = lines.skip_blank(), lines.place
    names = _names(text)
    if not text:
        raise RecordingError(f"{place.source} holds nothing but blank lines", fix="Export it again")
    if _quaternion(names) is None:
        message = f"{place}: this is no header of a bone's file ('{shown(text.strip(), 60)}')"
        raise RecordingError(message, allowed=_ALLOWED)
    lines.readline()
    return names
