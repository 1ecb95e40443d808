"""Tables with a line for each point of each frame, as a data frame is written in its long form.

    frame,time,name,x,y,z,confidence
    0,0.00,elbow,0.1,0.2,1.1,0.9
    0,0.00,hand,0.3,0.2,1.0,0.8

Lines of one frame have the same frame number or, where there is none, the same time. What the columns are called may
differ (``landmark``, ``joint``, ``marker``, ``id`` for the name). A point without a line in a frame was not seen.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from armdesign.demonstration.files.csv_cells import MISSING, read_cells
from armdesign.demonstration.files.formats.marker_tables import clean_name
from armdesign.demonstration.files.named_columns import Columns, columns_of, delimiter_of, header_of
from armdesign.demonstration.files.text_files import LinesAhead, Place, check_names, open_text, shown
from armdesign.demonstration.recording import Take, first_bad_step
from armdesign.errors import RecordingError

_NAMES = (
    *("name", "landmark", "landmark_name", "joint", "joint_name", "marker", "marker_name", "point", "keypoint", "bone"),
    *("body", "bodypart", "body_part", "tracker", "device", "landmark_id", "joint_id", "keypoint_id", "landmark_index"),
    *("point_id", "marker_id", "id", "idx", "index", "landmark_idx", "type", "label"),
)
_CONFIDENCE = ("visibility", "confidence", "conf", "score", "likelihood", "presence", "v")
_MOST_POINTS = 2_000
_FIX = "Export the recording again"


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes has a line for each point of each frame."""
    columns = header_of(head)
    is_long = "" in columns.points and _name_column(columns) is not None
    return is_long and bool(columns.times or _frame_column(columns) is not None)


def read(path: Path) -> Take:
    """Read a table with a line for each point of each frame."""
    return read_long(path, "long CSV", str)


def read_long(path: Path, form: str, rename: Callable[[str], str]) -> Take:
    """Read a table with a line for each point of each frame.

    Args:
        path: The file.
        form: What the format is called.
        rename: Gives the name of a point for that in the file.
    """
    points: dict[str, dict[int, list[float]]] = {}  # name to frame to its numbers
    frames: dict[float, int] = {}  # frame number or time to frame
    times: list[float] = []
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        while (text := lines.skip_blank()).lstrip().startswith("#"):
            lines.readline()
        delimiter, place = delimiter_of(text), lines.place
        columns = columns_of(read_cells(lines.readline(), delimiter))
        check_names(columns.names, len(columns.names), place)
        at = _Places(columns)
        while text := lines.skip_blank():
            place, cells = lines.place, [cell.strip() for cell in read_cells(lines.readline(), delimiter)]
            if len(cells) < at.width and not text.endswith("\n"):
                break  # a last line that was cut off
            if len(cells) <= max(at.name, at.key):
                message = f"{place}: too few cells, {len(cells)} where the header has {at.width} columns"
                raise RecordingError(message, value=len(cells), fix="Complete or remove the line")
            numbers = [_number(cells, column, columns, place) for column in at.numbers]
            key = _number(cells, at.key, columns, place)
            name = clean_name(rename(cells[at.name])) or "point"
            if key not in frames:
                frames[key] = len(frames)
                times.append(key if at.time is None else _number(cells, at.time, columns, place))
            seen = points.setdefault(name, {})
            if frames[key] in seen:
                message = f"{place}: '{shown(name)}' stands twice in one frame"
                raise RecordingError(message, value=name, fix="Keep one person, or number the frames")
            if len(points) > _MOST_POINTS:
                message = f"{place}: there are more than {_MOST_POINTS} names of points"
                raise RecordingError(message, allowed=_MOST_POINTS, fix=_FIX)
            seen[frames[key]] = numbers
    return _take(path, form, points, np.array(times), at)


class _Places:
    """Which columns hold what."""

    def __init__(self, columns: Columns) -> None:
        name, frame = _name_column(columns), _frame_column(columns)
        self.time: int | None = columns.times[0][0] if columns.times else None
        self.unit: str | None = columns.times[0][1] if columns.times else None
        key = frame if frame is not None else self.time
        if name is None or key is None:
            raise RecordingError("no columns for name and frame", fix=_FIX)
        self.name, self.key = name, key
        confidence = [i for i, text in enumerate(columns.names) if text.lower() in _CONFIDENCE]
        self.turns = columns.turns.get("", [])
        self.numbers = [*columns.points[""], *self.turns, *confidence[:1]]
        self.has_confidence, self.is_unordered = bool(confidence), "" in columns.unordered
        self.width = len(columns.names)


def _take(path: Path, form: str, points: dict[str, dict[int, list[float]]], times: np.ndarray, at: _Places) -> Take:
    """The lines as a take."""
    if not len(times):
        raise RecordingError(f"{path} holds no frame below the header", value=0, fix=_FIX)
    bad = first_bad_step(times)
    if bad is not None:
        message = f"{path}, frame {bad + 1}: the time or frame number does not increase"
        raise RecordingError(message, value=float(times[bad]), fix="Sort the lines by frame")
    tables = {}
    for name, seen in points.items():
        tables[name] = np.full((len(times), len(at.numbers)), np.nan)
        tables[name][list(seen)] = list(seen.values())
    return Take(
        time=times if at.time is not None else times - times[0],
        points={name: table[:, :3] for name, table in tables.items()},
        orientations={name: table[:, 3:7] for name, table in tables.items()} if at.turns else {},
        source=str(path),
        format=form,
        timed=at.time is not None,
        time_unit=at.unit or "s",
        unordered=frozenset(tables) if at.is_unordered else frozenset(),
        confidence={name: table[:, -1] for name, table in tables.items()} if at.has_confidence else {},
    )


def _name_column(columns: Columns) -> int | None:
    """The column with the names of points."""
    lower = [name.lower().replace(" ", "_") for name in columns.names]
    return next((lower.index(name) for name in _NAMES if name in lower and lower.index(name) != columns.frame), None)


def _frame_column(columns: Columns) -> int | None:
    """The column with the frame numbers, called so."""
    frame = columns.frame
    return frame if frame is not None and columns.names[frame].lower().startswith(("frame", "sample")) else None


def _number(cells: list[str], column: int, columns: Columns, place: Place) -> float:
    """The number in a cell, NaN where it is empty."""
    cell = cells[column] if column < len(cells) else ""
    if not cell or cell.lower() in MISSING:
        return float("nan")
    try:
        value = float(cell) if "_" not in cell else float("inf")
    except ValueError:
        value = float("inf")
    if np.isinf(value):
        message = f"{place}, column '{shown(columns.names[column])}': '{shown(cell)}' is not a finite number"
        raise RecordingError(message, value=cell, fix="Correct the cell, or leave it empty where nothing was seen")
    return value
