"""OptiTrack Motive CSV, versions 1.21 to 1.25: rigid bodies, bones and markers.

    Format Version,1.23,Take Name,...,Export Frame Rate,100.000000,...,Length Units,Meters,Coordinate Space,Global
    <blank line, or one of commas>
    ,Type,Rigid Body,Rigid Body,...,Marker,...
    ,Name,Hand,Hand,...,Hand:Marker1,...
    ,ID,9E207518D8A311E9,...
    ,Parent,Root,...                                 (1.25)
    ,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error,...,Position,...
    Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,,...,X,Y,Z

The words ``Type``, ``Name`` and ``ID`` are missing in 1.21, the last line says ``Time`` there. With time codes there is
a column ``TimeCode`` after the time, of text. What is assumed, since the file does not say:

* Times are frame number / export frame rate; the printed times are the same, rounded.
* Quaternions are x, y, z, w and turn body axes into those of the room; a bone's position is that of its origin.
* Euler angles are in degrees and intrinsic, "XYZ" being first about x, then about the new y, then about the new z.
  So says OptiTrack of the angles that Motive has shown since 1.6, the version that brought the choice of the order.
* ``Marker`` is where a marker was seen, empty where it was hidden. ``Rigid Body Marker`` and ``Bone Marker`` are where
  the solved pose puts it: never empty, and no measurement. Where a file has both, the measured one has the name.
* Motive has y up unless told otherwise at export.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import MISSING, Dialect, Rows, read_cells, read_rows
from armdesign.demonstration.files.formats.frame_clock import motive_clock
from armdesign.demonstration.files.formats.marker_tables import (
    clean_name,
    count,
    listed,
    names_steps,
    read_units,
    row_steps,
    unused_name,
)
from armdesign.demonstration.files.quaternions import ORDERS, euler_quaternions
from armdesign.demonstration.files.text_files import (
    BLANK,
    LinesAhead,
    Place,
    check_columns,
    open_text,
    shown,
    text_head,
)
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError

_KNOWN = ("1.2", "1.20", "1.21", "1.22", "1.23", "1.24", "1.25")
_MAX_LINES = 40  # of a header
_START = re.compile(r'\s*"?format version"?\s*([,;\t])', re.IGNORECASE)
_BARE = re.compile(  # the rows below line 1, or the last of them alone
    r',"?type"?,|,,"?(rigid body|bone|marker)( marker)?"?,|"?frame"?,"?time( \(seconds\))?"?,("?timecode"?,)?"?x"?,',
    re.IGNORECASE,
)
_ROWS = ("type", "name", "id", "parent")
_FIX = "Export the take from Motive again"


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes is a Motive CSV, be it without its header."""
    text = text_head(head).lstrip()
    return bool(_START.match(text) or _BARE.match(text))


def read(path: Path) -> Take:
    """Read a Motive CSV.

    Returns:
        Points: origins of rigid bodies and bones, and markers. Orientations: those of rigid bodies and bones.
    """
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        header = read_header(lines)
        units, order = _units(header, Place(path, 1)), _rotation_order(header, Place(path, 1))
        dialect = Dialect(header.delimiter, MISSING, "." if header.delimiter == "," else ",", True, True)
        rows = read_rows(lines, header.columns, lines.place, dialect)
    clock = motive_clock(rows, header.facts)
    names = _names(header.items)
    version = header.facts.get("format version", "")
    sentence = f"The format version '{version[:20]}' is not one of 1.21 to 1.25; it is read as if it were."
    odd_version = [] if version in _KNOWN else [Step("version", sentence, {"version": version[:20]})]
    odd_rows = row_steps(rows, count(header.facts.get("total exported frames", "")))
    return Take(
        time=clock.time,
        points={n: rows.columns([i.position[a] for a in "XYZ"]) for n, i in names.items() if i.position},
        orientations={n: _turns(rows, i, order) for n, i in names.items() if i.rotation},
        source=str(path),
        format=f"OptiTrack Motive CSV {version}".strip(),
        units=units,
        rate=clock.rate,
        bodies=_bodies(names),
        steps=(*odd_version, *odd_rows, *clock.steps, *_item_steps(names, order)),
    )


def _units(header: Header, first: Place) -> str | None:
    """The unit of length; None where line 1 does not say."""
    if header.facts.get("coordinate space", "").lower() == "local":
        message = f"{first}: the coordinate space is Local, each bone being relative to its parent"
        fix = "Export the take from Motive again, in Global coordinates"
        raise RecordingError(message, value="Local", allowed="Global", fix=fix)
    return read_units(header.facts.get("length units", ""), first)


def _rotation_order(header: Header, first: Place) -> str:
    """Axes in the order of the Euler angles; empty where the rotations are quaternions."""
    turning = [item for item in header.items if item.rotation]
    without = [item for item in turning if "W" not in item.rotation]
    if not without:
        return ""
    kind = header.facts.get("rotation type", "")
    if len(without) < len(turning) or kind.upper() not in ORDERS:
        message = f"{first}: the rotation type is '{kind[:40]}', but '{without[0].name[:40]}' has three angles"
        fix = "Export the take from Motive again, with Quaternion rotations"
        raise RecordingError(message, value=kind, allowed=("Quaternion", *ORDERS), fix=fix)
    return kind.upper()


def _turns(rows: Rows, item: Item, order: str) -> Array:
    """Quaternions of a body, shape (T, 4)."""
    turn = rows.columns([item.rotation[axis] for axis in order or "XYZW"])
    return euler_quaternions(order, np.radians(turn)) if order else turn


def _names(items: Sequence[Item]) -> dict[str, Item]:
    """A name for each item: its own, or with a word or number behind it where another one has that."""
    bodies = {item.name for item in items if not item.is_marker}
    measured = {item.name for item in items if item.is_marker and not item.is_solved}
    named: dict[str, Item] = {}
    given: Counter[str] = Counter()
    for item in items:
        name = item.name
        if item.is_solved and name in measured:
            name += " (solved)"
        elif item.is_marker and name in bodies:
            name += " (marker)"
        named[unused_name(name, named, given)] = item
    return named


def _bodies(names: Mapping[str, Item]) -> dict[str, tuple[str, ...]]:
    """Rigid bodies to the names of their markers, which have the body's name before a colon."""
    bodies: dict[str, list[str]] = {n: [] for n, item in names.items() if item.type.lower() == "rigid body"}
    for name, item in names.items():
        owner = item.name.rpartition(":")[0]
        if item.is_marker and owner in bodies and not name.endswith(" (solved)"):
            bodies[owner].append(name)
    return {name: tuple(markers) for name, markers in bodies.items()}


def _item_steps(names: Mapping[str, Item], order: str) -> list[Step]:
    """What was made of angles, of markers that are there twice, and of names that are."""
    steps = []
    if order:
        turns = f"about {order[0].lower()}, then the new {order[1].lower()}, then the new {order[2].lower()}"
        sentence = (
            f"Rotations are Euler angles {order}: taken as degrees and intrinsic ({turns}), as OptiTrack describes "
            "those of Motive; the file itself does not say."
        )
        steps.append(Step("angles", sentence, {"order": order, "intrinsic": True}))
    if solved := [name for name, item in names.items() if item.is_solved]:
        beside = [name for name in solved if name.endswith(" (solved)")]
        there = f"where the measured marker is in the file too, they are called so ({listed(beside)})" if beside else ""
        there = there or "the measured ones are not in the file"
        sentence = f"Markers placed by the solved pose instead of being seen: {listed(solved)}; {there}."
        steps.append(Step("solved", sentence, {"solved": solved}))
    changed = {name: item.name for name, item in names.items() if name not in {item.name, f"{item.name} (solved)"}}
    return steps + names_steps(list(changed), changed)


@dataclass
class Item:
    """A rigid body, bone or marker."""

    type: str  # Rigid Body, Bone, Marker, Rigid Body Marker and so on
    name: str
    key: tuple[str, ...]  # what distinguishes it from its neighbours
    position: dict[str, int] = field(default_factory=dict)  # axis, X to Z, to column
    rotation: dict[str, int] = field(default_factory=dict)  # axis, X to W, to column; empty for a marker

    @property
    def is_marker(self) -> bool:
        """Whether it is a marker, measured or solved."""
        return self.type.lower().endswith("marker") and not self.rotation

    @property
    def is_solved(self) -> bool:
        """Whether it is a marker where the body's pose puts it, instead of where it was seen."""
        return self.is_marker and self.type.lower() != "marker"


@dataclass(frozen=True)
class Header:
    """The lines above the numbers."""

    facts: Mapping[str, str]  # line 1, name in small letters to value
    items: tuple[Item, ...]  # in the order of the columns
    columns: list[str]  # a name for each column of numbers, for messages
    delimiter: str


def read_header(lines: LinesAhead) -> Header:
    """Read up to the line that names the columns; the extra columns are cut out of all lines after it."""
    place = lines.place
    first = _first_line(lines)
    start = _START.match(first)
    if start is None:
        if not _BARE.match(first):
            allowed = "'Format Version' in the first line"
            raise RecordingError(f"{place}: this is no Motive CSV ('{shown(first, 60)}')", allowed=allowed)
        message = f"{place}: the Motive file has no header, so that its units, frame rate and axes are unknown"
        raise RecordingError(message, value=first[:60], fix=f"{_FIX}, with 'Header Information' switched on")
    delimiter = start.group(1)
    facts = _facts(read_cells(first, delimiter))
    rows, last = _rows(lines, delimiter)
    width = max(2, *(len(row) for row in rows))
    check_columns(width, last)
    rows = [row + [""] * (width - len(row)) for row in rows]
    kinds = rows[-2]  # columns between the time and the first item belong to nothing
    extra = next((i for i, kind in enumerate(kinds[2:]) if kind), len(kinds) - 2)
    rows = [row[:2] + row[2 + extra :] for row in rows]
    items = _items(rows, last)

    def without_extra(text: str) -> str:
        cells = text.split(delimiter, 2 + extra)
        return delimiter.join(cells[:2] + cells[2 + extra :]) if len(cells) > 2 else text

    lines.change = without_extra if extra else None
    return Header(facts, items, _labels(rows, items), delimiter)


def _first_line(lines: LinesAhead) -> str:
    """The first line that is not blank, with those over which its last quotation goes on."""
    text = ""
    while lines.place.line <= _MAX_LINES and (more := lines.readline()):
        text += more
        if text.strip() and (text.count('"') % 2 == 0 or not more.strip()):
            break
    return text.replace("\n", " ").strip()


def _facts(cells: list[str]) -> dict[str, str]:
    """Names and values in turn; where a comma too many puts them out of step, any cell followed by its neighbour."""
    cells = [cell.strip() for cell in cells]
    pairs = list(zip(cells, [*cells[1:], ""], strict=True))
    return {name.lower(): value for name, value in pairs[1::2][::-1] + pairs[::2][::-1] if name}


def _rows(lines: LinesAhead, delimiter: str) -> tuple[list[list[str]], Place]:
    """The rows above the numbers that are not blank, and the place of the last, which begins with ``Frame``."""
    rows: list[list[str]] = []
    for _ in range(_MAX_LINES):
        place, text = lines.place, lines.readline()
        if not text.strip(BLANK):
            continue
        rows.append([" ".join(cell.split()) for cell in read_cells(text, delimiter)])
        if rows[-1][0].lower() == "frame":
            if len(rows) < 4:
                message = f"{place}: the rows with types, names and 'Position' are missing above"
                raise RecordingError(message, value=len(rows), fix=_FIX)
            return rows, place
    source = lines.place.source
    message = f"{source}: the row that names the columns, beginning with 'Frame', is missing below the header"
    raise RecordingError(message, fix=f"The file may be cut off. {_FIX}")


def _items(rows: list[list[str]], place: Place) -> tuple[Item, ...]:
    """Columns put together to bodies, bones and markers."""
    types, names, *more = _named_rows(rows)
    items: list[Item] = []
    for column in range(2, len(rows[-1])):
        kind, axis = rows[-2][column].lower(), rows[-1][column].upper()
        if kind not in ("position", "rotation") or not axis:
            continue
        key = (types[column], names[column], *(row[column] for row in more))
        if not items or items[-1].key != key or axis in getattr(items[-1], kind):
            items.append(Item(types[column], clean_name(names[column]) or f"column {column + 1}", key))
        getattr(items[-1], kind)[axis] = column
    for item in items:
        for columns, what in ((item.position, "no position along"), (item.rotation, "a rotation without")):
            missing = [axis for axis in "XYZ" if axis not in columns]
            if columns and missing:
                where = f"{place}: {item.type.lower()[:40] or 'the column'} '{item.name[:40]}'"
                raise RecordingError(f"{where} has {what} {' and '.join(missing)}", fix=_FIX)
    if not items:
        raise RecordingError(f"{place}: the file holds no rigid body, bone or marker", fix=f"{_FIX}, with some of them")
    return tuple(items)


def _named_rows(rows: list[list[str]]) -> list[list[str]]:
    """Rows with types, names and, where there is one, identifiers: by their words, in 1.21 by their order."""
    words = {row[1].lower(): row for row in rows[:-2] if row[1].lower() in _ROWS}
    if "type" in words and "name" in words:
        return [words[word] for word in _ROWS if word in words]
    return rows[:-2][:3]


def _labels(rows: list[list[str]], items: tuple[Item, ...]) -> list[str]:
    """A name for each column."""
    labels = [
        f"{name} {kind} {axis}".strip() for name, kind, axis in zip(_named_rows(rows)[1], *rows[-2:], strict=True)
    ]
    last = max(max((*item.position.values(), *item.rotation.values())) for item in items)
    while len(labels) > last + 1 and not labels[-1]:
        labels.pop()
    return ["Frame", rows[-1][1] or "Time", *labels[2:]]
