"""TRC files, as OpenSim, Cortex and many others write them: markers over time, separated by tabs.

    PathFileType  4  (X/Y/Z)  file.trc
    DataRate  CameraRate  NumFrames  NumMarkers  Units  OrigDataRate  OrigDataStartFrame  OrigNumFrames
    100.0     100.0       238        41          mm     100.0         1                   238
    Frame#  Time  R.Shoulder          L.Shoulder
                  X1  Y1  Z1          X2  Y2  Z2

    1  0.000  -652.630  1529.542  -94.520  ...

Programs do not agree on the details. Names may be padded, shifted by a tab or separated by one tab only, the line X1 Y1
Z1 and the empty one may be missing, commas may replace tabs, rows may stop early, and the counts in line 3 are often
those of another file: names are taken in their order, each with three of the columns from the third on.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

from armdesign.demonstration.files.csv_cells import read_cells
from armdesign.demonstration.files.formats.frame_clock import frame_clock, odd_rate_steps, read_rate
from armdesign.demonstration.files.formats.marker_tables import (
    clean_name,
    column_names,
    count,
    count_steps,
    once_each,
    positions,
    read_table,
    read_units,
    row_steps,
)
from armdesign.demonstration.files.text_files import LinesAhead, Place, check_names, open_text, shown, text_head
from armdesign.demonstration.recording import Take
from armdesign.errors import RecordingError

_NAME_ROW = re.compile(r'\s*"?Frame#"?[ ]*(?P<delimiter>[\t,;])', re.IGNORECASE)
_LABELS = re.compile(r'[\s,;"]*X\d*\b', re.IGNORECASE)
_HEADER_LINES = 20  # the row of names is among the first lines, or this is no TRC file
_FIX = "Export the recording again"


class _Header(NamedTuple):
    """The lines above the rows."""

    facts: Mapping[str, str]  # names in small letters, such as "datarate"
    values: Place  # of the line that holds them
    names: list[str]
    delimiter: str


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes is a TRC file."""
    return text_head(head).lstrip('\n\t ,"')[:12].lower() == "pathfiletype"


def read(path: Path) -> Take:
    """Read a TRC file."""
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        header = _read_header(lines)
        if _LABELS.match(lines.skip_blank()):
            lines.readline()
        lines.skip_blank()
        rows = read_table(lines, header.delimiter, column_names(("Frame#", "Time"), header.names, "XYZ"))
    said = header.facts.get("datarate", "")
    clock = frame_clock(rows, 0, 1, read_rate(said))
    names, name_steps = once_each(header.names)
    odd_rows = row_steps(rows, count(header.facts.get("numframes", "")))
    odd_names = count_steps("markers", count(header.facts.get("nummarkers", "")), len(header.names))
    return Take(
        time=clock.time,
        points=positions(rows.values, 2, names),
        orientations={},
        source=str(path),
        format="TRC",
        units=read_units(header.facts.get("units", ""), header.values),
        rate=clock.rate,
        steps=(*odd_rows, *odd_names, *name_steps, *odd_rate_steps(said), *clock.steps),
    )


def _read_header(lines: LinesAhead) -> _Header:
    """Everything down to the row that begins with ``Frame#``."""
    above: list[str] = []
    while len(above) < _HEADER_LINES and (text := lines.peek()):
        if found := _NAME_ROW.match(text):
            cells = [clean_name(cell) for cell in read_cells(text, found["delimiter"])]
            names = [name for name in cells[2:] if name]
            place = lines.place
            if len(cells) < 2 or cells[1].lower() != "time":
                second = shown(cells[1]) if len(cells) > 1 else ""
                message = f"{place}: '{second}' follows 'Frame#', not 'Time'"
                raise RecordingError(message, allowed="Frame#, Time, names", fix=_FIX)
            if not names:
                raise RecordingError(f"{place}: there are no names of markers", fix=_FIX)
            check_names(names, 2 + 3 * len(names), place)
            lines.readline()
            facts, line = _facts(above, found["delimiter"])
            return _Header(facts, Place(lines.place.source, line), names, found["delimiter"])
        above.append(lines.readline())
    source = lines.place.source
    message = f"{source}: none of the first {_HEADER_LINES} lines is the row of names, which begins with 'Frame#'"
    raise RecordingError(message, fix=_FIX)


def _facts(above: list[str], delimiter: str) -> tuple[dict[str, str], int]:
    """The header's pairs, name in small letters to value, and the number of the line of values."""
    for i, (names, values) in enumerate(pairwise(above)):
        if names.strip(' \t"').lower().startswith("datarate"):
            keys, found = _words(names, delimiter), _words(values, delimiter)
            if len(keys) != len(found):  # a value is missing, or one holds blanks
                keys, found = read_cells(names, delimiter), read_cells(values, delimiter)
            return {key.strip().lower(): value.strip() for key, value in zip(keys, found, strict=False)}, i + 2
    return {}, 1


def _words(text: str, delimiter: str) -> list[str]:
    """Cells that are not empty; blanks and several delimiters may separate them."""
    return [cell for cell in re.split(r"[\s]+" if delimiter == "\t" else r"[\s,;]+", text.strip(' \r\n\t,;"')) if cell]
