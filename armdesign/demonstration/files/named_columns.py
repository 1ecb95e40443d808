"""Tables whose header names a column for each number: ``hand_x``, ``Hand.Position.X``, ``x1``, ``hand_qw``.

One grammar for the many programs that write such tables, and one reader. A column is a coordinate of a point, one of
the four numbers of a quaternion, a confidence, the time or the frame; what is none of these is left out.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import Rows, is_number, read_cells
from armdesign.demonstration.files.formats.frame_clock import check_frames, check_increase
from armdesign.demonstration.files.formats.marker_tables import UNITS, clean_name, listed, read_table, row_steps
from armdesign.demonstration.files.text_files import LinesAhead, Place, check_names, open_text, shown, text_head
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError

_WORDS_OF_PLACE = "position|pos|translation|trans|location|loc|world"
_WORDS_OF_TURN = "quaternion|quat|rotation|rot|orientation|orient|ori"
_KIND = rf"(?:(?P<word>(?i:{_WORDS_OF_PLACE}|{_WORDS_OF_TURN}))[ _.:\-]*|(?P<letter>[ptqrPTQR]))?"
_NEXT = r"(?:[ _.:/\-]+|(?<=[a-z0-9])(?=[A-Z]))"
_COMPONENTS = (
    re.compile(rf"(?P<name>){_KIND}(?P<axis>[xyzwXYZW])"),
    re.compile(rf"(?P<name>.+?){_NEXT}{_KIND}(?P<axis>[xyzwXYZW])"),
    re.compile(r"(?P<word>)(?P<letter>)(?P<axis>[xyzXYZ])(?:_(?P<name>.{2,})|(?P<number>\d+))"),
)
_NUMBERED = re.compile(r"(?P<name>.*?)[ _.:\-]*[qQ](?P<number>[0-4])")
_CONFIDENCE = re.compile(
    r"(?P<name>.+?)[ _.:\-]+(?P<word>visibility|vis|confidence|conf|score|likelihood|presence|accuracy|accu|prob"
    r"|probability|c|v|p)|(?:v|c|vis|visibility|conf|confidence|score)[ _]?(?P<number>\d+)",
    re.IGNORECASE,
)
_TIME = re.compile(
    r"(?:(?:elapsed|relative|video|frame)[ _]*)?(?:time[ _]?stamp|time|t|seconds|secs?)(?:[ _]*(?P<unit>[a-zµ]+))?",
    re.IGNORECASE,
)
_FRAME = re.compile(
    r"(?:frame|sample|index|idx|#)(?:[ _]*(?:number|num|no\.?|nr|id|idx|index|count|#))?", re.IGNORECASE
)
_UNIT = re.compile(r"(?P<text>.*?)(?:\s*[(\[]\s*(?P<inner>[^)\]]{1,12})\s*[)\]]|(?<=[xyzXYZ])_(?P<end>mm|cm|m))")
_OF_TIME = {
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("ms", "msec", "millis", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("us", "µs", "usec", "micros", "microsecond", "microseconds"), "us"),
    **dict.fromkeys(("ns", "nsec", "nanos", "nanosecond", "nanoseconds"), "ns"),
}
_DELIMITERS = ",;\t"
_FIX = "Export the recording again"


@dataclass
class Columns:
    """What the columns of a table hold, by their names."""

    names: list[str]  # all column names, in their order
    # name to the columns of x, y, z; the empty name where there is but one body
    points: dict[str, list[int]] = field(default_factory=dict)
    # name to the columns of a quaternion, x, y, z, w or, where that is not said, in their order
    turns: dict[str, list[int]] = field(default_factory=dict)
    unordered: set[str] = field(default_factory=set)  # names whose quaternions' order is not said
    confidence: dict[str, int] = field(default_factory=dict)  # name to the column that tells how well a point was seen
    # columns of times, each with its unit in the name, the best first
    times: list[tuple[int, str | None]] = field(default_factory=list)
    frame: int | None = None  # column of frame numbers
    units: str | None = None  # unit of length in the names; None where they have none
    left: list[str] = field(default_factory=list)  # names of the other columns


def columns_of(names: Iterable[str]) -> Columns:
    """What columns hold, by their names; see the head of this file."""
    found = Columns([clean_name(name) for name in names])
    parts: dict[tuple[str, str], dict[str, int]] = {}  # point and kind to component to column
    used: set[int] = set()
    for column, name in enumerate(found.names):
        text, unit = _without_unit(name)
        if (time := _TIME.fullmatch(text)) and (time["unit"] or "s").lower() in _OF_TIME:
            word = unit if unit in _OF_TIME else time["unit"]
            found.times.append((column, _OF_TIME[word.lower()] if word else None))
        elif _FRAME.fullmatch(text):
            found.frame = column if found.frame is None else found.frame
        elif (part := _component(text)) is not None:
            point, kind, component = part
            once, number = point, 1
            while component in parts.get((point, kind), {}):  # a point that stands twice
                number += 1
                point = f"{once}#{number}"
            parts.setdefault((point, kind), {})[component] = column
            if unit in UNITS and kind != "turn":
                found.units = UNITS[unit]
            continue
        elif seen := _CONFIDENCE.fullmatch(text):
            point = seen["name"] or seen["number"]
            if point not in found.confidence or (seen["word"] or "").lower() in ("visibility", "confidence"):
                found.confidence[point] = column
        else:
            continue
        used.add(column)
    found.times.sort(key=lambda each: each[1] is None)
    _take_parts(found, parts, used)
    found.left = [name for column, name in enumerate(found.names) if column not in used]
    return found


def header_of(head: bytes) -> Columns:
    """What the columns of a file beginning with these bytes hold; of a header cut off, all but the last."""
    lines = [line for line in text_head(head).split("\n") if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        return columns_of([])
    cells = read_cells(lines[0], delimiter_of(lines[0]))
    return columns_of(cells if len(lines) > 1 else cells[:-1])


def read_columns(path: Path, form: str, rename: Callable[[str], str] = str) -> Take:
    """Read a table whose header names each column.

    Args:
        path: The file.
        form: What the format is called.
        rename: Gives the name of a point for that in the header.

    Returns:
        In the file's axes; without the unit of length and the up axis unless the names of columns say them.
    """
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        while (text := lines.skip_blank()).lstrip().startswith("#"):
            lines.readline()
        place, delimiter = lines.place, delimiter_of(text)
        columns = columns_of(read_cells(lines.readline(), delimiter))
        check_names(columns.names, len(columns.names), place)
        if not columns.points:
            raise RecordingError(f"{place}: no three columns are the x, y and z of a point", fix=_FIX)
        row = lines.skip_blank()
        time, unit = _time_column(columns, row, delimiter)
        dated = None if time is not None else _date_column(columns, row, delimiter)
        time = dated if time is None else time
        wanted = _wanted(columns, time)
        if len(wanted) < len(columns.names) or dated is not None:
            lines.change = _selection(wanted, len(columns.names), delimiter, lines, dated)
        rows = read_table(
            lines, delimiter, [columns.names[i] for i in wanted], keep_empty=time is None and columns.frame is None
        )
    check_frames(rows)
    at = {column: i for i, column in enumerate(wanted)}
    steps = row_steps(rows)
    if columns.left:
        sentence = f"Columns that are no part of a point were left out: {listed(columns.left)}."
        steps.append(Step("columns", sentence, {"columns": columns.left}))
    names = {name: rename(name) or shown(clean_name(path.stem)) or "body" for name in columns.points}
    points = {names[name]: rows.values[:, [at[c] for c in each]] for name, each in columns.points.items()}
    turned = {name: each for name, each in columns.turns.items() if name in names}
    return Take(
        time=_times(rows, at, time, columns.frame),
        points=points,
        orientations={names[name]: rows.values[:, [at[c] for c in each]] for name, each in turned.items()},
        source=str(path),
        format=form,
        units=columns.units,
        timed=time is not None,
        time_unit=unit or "s",
        unordered=frozenset(names[name] for name in turned if name in columns.unordered),
        confidence={
            names[name]: rows.values[:, at[column]] for name, column in columns.confidence.items() if name in names
        },
        steps=tuple(steps),
    )


def _without_unit(name: str) -> tuple[str, str]:
    """A column's name without a unit at its end, and that unit in small letters."""
    match = _UNIT.fullmatch(name)
    if match is None:
        return name, ""
    unit = (match["inner"] or match["end"]).strip().lower()
    return (match["text"].strip(), unit) if unit in UNITS or unit in _OF_TIME else (name, "")


def _component(text: str) -> tuple[str, str, str] | None:
    """Point, kind (place, world, turn or numbers) and component of a column; None if it is no part of a point."""
    for pattern in _COMPONENTS:
        if match := pattern.fullmatch(text):
            groups = match.groupdict()
            word, letter, axis = (groups[key] or "" for key in ("word", "letter", "axis"))
            is_turn = letter.lower() in ("q", "r") or (word and re.fullmatch(_WORDS_OF_TURN, word, re.IGNORECASE))
            kind = "turn" if is_turn else "world" if word.lower() == "world" else "place"
            return groups["name"] or groups.get("number") or "", kind, axis.lower()
    if match := _NUMBERED.fullmatch(text):
        return match["name"], "numbers", match["number"]
    return None


def _take_parts(found: Columns, parts: dict[tuple[str, str], dict[str, int]], used: set[int]) -> None:
    """The points and quaternions that are complete; their columns are used."""
    for (point, kind), components in parts.items():
        place = [components[axis] for axis in "xyz" if axis in components]
        if kind == "world" or (kind == "place" and (point, "world") not in parts):
            if len(place) == 3:
                found.points[point] = place
                used.update(place)
        elif kind == "turn" and len(place) == 3 and "w" in components:
            found.turns[point] = [*place, components["w"]]
            used.update(found.turns[point])
        elif kind == "numbers" and len(components) == 4:
            found.turns[point] = [components[number] for number in sorted(components)]
            found.unordered.add(point)
            used.update(found.turns[point])


def delimiter_of(text: str) -> str:
    """What stands between the cells of a header."""
    return max(_DELIMITERS, key=text.count)


def _time_column(columns: Columns, row: str, delimiter: str) -> tuple[int | None, str | None]:
    """The column of the times and its unit: the first that holds a number."""
    cells = read_cells(row, delimiter)
    for column, unit in columns.times:
        if column < len(cells) and is_number(cells[column].strip() or "0"):
            return column, unit
    return None, None


def _date_column(columns: Columns, row: str, delimiter: str) -> int | None:
    """The column of the times where they are dates with a time, as in ``2024-05-01T12:30:00.25``."""
    cells = read_cells(row, delimiter)
    dates = (column for column, _ in columns.times if column < len(cells) and _seconds(cells[column]) is not None)
    return next(dates, None)


def _seconds(text: str) -> float | None:
    """Seconds since 1970 of a date with a time; None where it is none."""
    try:
        date = datetime.fromisoformat(text.strip())
    except ValueError:
        return None
    return (date if date.tzinfo is not None else date.replace(tzinfo=UTC)).timestamp()


def _wanted(columns: Columns, time: int | None) -> list[int]:
    """All columns that are read."""
    every = {column for each in (*columns.points.values(), *columns.turns.values()) for column in each}
    every.update(columns.confidence.values(), [i for i in (time, columns.frame) if i is not None])
    return sorted(every)


def _selection(
    wanted: list[int], width: int, delimiter: str, lines: LinesAhead, dated: int | None
) -> Callable[[str], str]:
    """A function that gives a line's cells in these columns alone, a date as seconds."""

    def selected(text: str) -> str:
        end = "\n" * text.endswith("\n")
        if not text.strip(" \r\n\t" + delimiter):
            return end
        cells = read_cells(text, delimiter)
        if len(cells) > width and any(cell.strip() for cell in cells[width:]):
            place = Place(lines.place.source, lines.place.line - 1)
            message = f"{place}: too many cells, {len(cells)} where the header has {width} columns"
            raise RecordingError(message, value=len(cells), fix="Complete or remove the line")
        if dated is not None and dated < len(cells) and (seconds := _seconds(cells[dated])) is not None:
            cells[dated] = f"{seconds:.6f}"
        kept = [cells[i] for i in wanted if i < len(cells)]
        if len(cells) <= wanted[-1] and not end:
            kept = kept[: len(wanted) - 1]  # a last line that was cut off
        return delimiter.join(f'"{cell}"' if delimiter in cell else cell for cell in kept) + end

    return selected


def _times(rows: Rows, at: dict[int, int], time: int | None, frame: int | None) -> Array:
    """Times, or frame numbers from 0 on where there are none."""
    if time is not None:
        return rows.times(at[time])
    if frame is None:
        return np.arange(float(len(rows.values)))
    numbers = rows.values[:, at[frame]]
    check_increase(rows, numbers, "frame number")
    return np.asarray(numbers - numbers[0])
