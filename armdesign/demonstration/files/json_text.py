"""JSON out of foreign files: one value, or one a line, within limits."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.text_files import open_text, text_head
from armdesign.errors import RecordingError

MOST_LETTERS = 256 << 20  # in memory it takes ten times as much
_FIX = "Export the recording again, or write its points as plain CSV"
_DEEPEST = 6  # levels of lists and objects that are looked through


def json_head(head: bytes, *keys: str) -> bool:
    """Whether a file beginning with these bytes is JSON and one of the keys stands there."""
    text = text_head(head).lstrip()
    return text[:1] in ("{", "[") and any(re.search(rf'"{key}"\s*:', text) for key in keys)


def read_json(path: Path) -> Any:  # noqa: ANN401 (whatever the file holds)
    """The value in a file, or the list of the values in its lines.

    Raises:
        RecordingError: It is no JSON, cut off, or too large.
    """
    with open_text(path) as stream:
        text = stream.read(MOST_LETTERS + 1)
    if len(text) > MOST_LETTERS:
        allowed = f"at most {MOST_LETTERS >> 20} MiB"
        raise RecordingError(f"{path} is too large for JSON", allowed=allowed, fix="Export a shorter stretch")
    try:
        return json.loads(text)
    except RecursionError as error:
        raise RecordingError(f"{path} is nested too deeply", fix=_FIX) from error
    except ValueError as error:
        lines = [line for line in text.splitlines() if line.strip()]
        try:
            return [json.loads(line) for line in lines] if len(lines) > 1 else _refused(path, error)
        except (ValueError, RecursionError):
            return _refused(path, error)


def _refused(path: Path, error: Exception) -> Any:  # noqa: ANN401
    """Say where JSON ends or is damaged."""
    line = getattr(error, "lineno", 1)
    message = f"{path}, line {line}: this is no JSON, the file may be cut off ({error})"
    raise RecordingError(message, fix=_FIX) from error


def objects_with(value: object, key: str, depth: int = _DEEPEST) -> Iterator[Mapping[str, Any]]:
    """All objects that have a key, in their order, outermost first."""
    if isinstance(value, Mapping):
        if key in value:
            yield value
        elif depth:
            for inner in value.values():
                yield from objects_with(inner, key, depth - 1)
    elif isinstance(value, list) and depth:
        for inner in value:
            yield from objects_with(inner, key, depth - 1)


def numbers(value: object, width: int, path: Path, what: str) -> Array:
    """A table of numbers of this many columns, NaN where null stands; rows may be lists, or objects with x, y, z, w.

    Args:
        value: Lists of lists, one flat list, or a list of objects.
        width: Number of columns.
        path: The file, for messages.
        what: What the table holds, for messages.

    Raises:
        RecordingError: It is none.
    """
    rows = value
    if isinstance(value, list) and value and isinstance(value[0], Mapping):
        keys = ("x", "y", "z", "w")[:width]
        rows = [
            [row.get(key, row.get(key.upper())) for key in keys] if isinstance(row, Mapping) else row for row in value
        ]
    try:
        table = np.array(rows, dtype=float)  # null becomes NaN
        if isinstance(value, list) and table.ndim == 1 and len(table) % width == 0:
            table = table.reshape(-1, width)
    except (TypeError, ValueError, OverflowError) as error:
        raise RecordingError(f"{path}: {what} are no table of numbers", fix=_FIX) from error
    if table.ndim != 2 or table.shape[1] != width:
        message = f"{path}: {what} have the shape {table.shape}"
        raise RecordingError(message, value=table.shape, allowed=f"(points, {width})", fix=_FIX)
    return table


def number(value: object) -> float:
    """A number; NaN where it is none."""
    try:
        return float(value) if not isinstance(value, bool) else float("nan")  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        return float("nan")
