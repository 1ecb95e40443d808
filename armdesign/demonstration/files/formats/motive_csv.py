"""OptiTrack Motive CSV, versions 1.21 to 1.25: rigid bodies, bones and markers.

What is taken for granted, since the file does not tell:

* Times are frame number / export frame rate; the printed times are the same, rounded.
* Quaternions are x, y, z, w and turn body axes into those of the room; a bone's position is that of its origin.
* Euler angles are in degrees and intrinsic, "XYZ" being first about x, then about the new y, then about the new z.
  So says OptiTrack of the angles that Motive has shown since 1.6, the version that brought the choice of the order.
* ``Marker`` is where a marker was seen, empty where it was hidden. ``Rigid Body Marker`` and ``Bone Marker`` are where
  the solved pose puts it: never empty, and no measurement. Where a file has both, the measured one has the name.

Which axis points up is not told either; Motive has y up unless told otherwise at export.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import MISSING, Dialect, Place, Rows, read_rows
from armdesign.demonstration.files.formats.euler import ORDERS, euler_quaternions
from armdesign.demonstration.files.formats.marker_columns import listed, names_steps, read_units, unused_name
from armdesign.demonstration.files.formats.motive_header import Header, Item, is_motive, read_header
from armdesign.demonstration.files.formats.motive_times import frame_times
from armdesign.demonstration.files.formats.row_steps import count, row_steps
from armdesign.demonstration.files.lines_ahead import LinesAhead
from armdesign.demonstration.files.sniff import open_text, text_head
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError

_KNOWN = ("1.2", "1.20", "1.21", "1.22", "1.23", "1.24", "1.25")


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes is a Motive CSV, be it without its header."""
    return is_motive(text_head(head))


def read(path: Path) -> Take:
    """Read a Motive CSV.

    Args:
        path: The file.

    Returns:
        Points: origins of rigid bodies and bones, and markers. Orientations: those of rigid bodies and bones.

    Raises:
        RecordingError: The file cannot be read, or something in it is wrong; the message says what and where.
    """
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        header = read_header(lines)
        units, order = _units(header, Place(path, 1)), _rotation_order(header, Place(path, 1))
        dialect = Dialect(header.delimiter, MISSING, "." if header.delimiter == "," else ",", True, True)
        rows = read_rows(lines, header.columns, lines.place, dialect)
    clock = frame_times(rows, header.facts)
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
    """The unit of length; None where line 1 does not say.

    Raises:
        RecordingError: The unit is unknown, or the positions are not those in the room.
    """
    if header.facts.get("coordinate space", "").lower() == "local":
        message = f"{first}: the coordinate space is Local, each bone being relative to its parent"
        fix = "Export the take from Motive again, in Global coordinates"
        raise RecordingError(message, value="Local", allowed="Global", fix=fix)
    return read_units(header.facts.get("length units", ""), first)


def _rotation_order(header: Header, first: Place) -> str:
    """Axes in the order of the Euler angles; empty where the rotations are quaternions.

    Raises:
        RecordingError: The order is not told, or angles and quaternions stand side by side.
    """
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
