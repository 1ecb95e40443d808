"""Skeletons of Qualisys as TSV: lines of a name and its value, then for each segment its place and its quaternion.

    NO_OF_FRAMES  100
    FREQUENCY     100
    REFERENCE     GLOBAL
    SCALE         1.00000
    SOLVER        Human
    Frame  Time  Hips  X  Y  Z  QX  QY  QZ  QW  Spine  X  Y  ...
    1      0.0         12.3  ...

A segment's name has a column of its own, empty in the rows. Lengths are millimetres, quaternions scalar last.
Segments that count from their parent (REFERENCE LOCAL) are refused.
"""

from __future__ import annotations

from pathlib import Path

from armdesign.demonstration.files.csv_cells import read_cells
from armdesign.demonstration.files.formats.frame_clock import frame_clock, read_rate
from armdesign.demonstration.files.formats.marker_tables import clean_name, count, once_each, read_table, row_steps
from armdesign.demonstration.files.text_files import LinesAhead, check_names, open_text, shown, text_head
from armdesign.demonstration.recording import Take
from armdesign.errors import RecordingError

_PARTS = ["X", "Y", "Z", "QX", "QY", "QZ", "QW"]
_KEYS = ("NO_OF_FRAMES", "NO_OF_CAMERAS", "FREQUENCY", "TIME_STAMP", "REFERENCE", "SCALE", "SOLVER")
_WIDTH = 1 + len(_PARTS)
_FIX = "Export the skeleton from Qualisys Track Manager again, with global reference"


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes is a skeleton: known lines, and columns of quaternions."""
    text = text_head(head)
    first = text.lstrip('\n "').partition("\t")[0]
    return first in _KEYS and "\tX\tY\tZ\tQX\tQY\tQZ\tQW" in text.upper()


def read(path: Path) -> Take:
    """Read the segments of a skeleton."""
    facts: dict[str, str] = {}
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        while (text := lines.skip_blank()) and not text.lower().startswith("frame\t"):
            key, *values = [cell.strip() for cell in read_cells(lines.readline(), "\t")]
            facts[key.upper()] = values[0] if values else ""
        place = lines.place
        cells = [clean_name(cell) for cell in read_cells(lines.readline().rstrip("\t\r\n"), "\t")]
        if facts.get("REFERENCE", "GLOBAL").upper() not in ("GLOBAL", ""):
            message = f"{path}: segments count from '{shown(facts['REFERENCE'])}', not from the room"
            raise RecordingError(message, value=facts["REFERENCE"], allowed="GLOBAL", fix=_FIX)
        names = cells[2::_WIDTH]
        groups = [[cell.upper() for cell in cells[i + 1 : i + _WIDTH]] for i in range(2, len(cells), _WIDTH)]
        if not names or any(group != _PARTS for group in groups):
            message = f"{place}: the columns are none of a skeleton"
            raise RecordingError(message, allowed=f"Frame, Time, then a name and {', '.join(_PARTS)}", fix=_FIX)
        check_names(names, len(cells), place)
        unique, steps = once_each([name or f"unnamed {i + 1}" for i, name in enumerate(names)])
        columns = ["Frame", "Time", *(f"{name} {part}" for name in unique for part in ("", *_PARTS))]
        rows = read_table(lines, "\t", columns)
    clock = frame_clock(rows, 0, 1, read_rate(facts.get("FREQUENCY", "")))
    firsts = {name: 3 + _WIDTH * i for i, name in enumerate(unique)}
    return Take(
        time=clock.time,
        points={name: rows.values[:, first : first + 3] for name, first in firsts.items()},
        orientations={name: rows.values[:, first + 3 : first + 7] for name, first in firsts.items()},
        source=str(path),
        format="Qualisys skeleton TSV",
        units="mm",
        rate=clock.rate,
        solved=True,
        steps=(*row_steps(rows, count(facts.get("NO_OF_FRAMES", ""))), *steps, *clock.steps),
    )
