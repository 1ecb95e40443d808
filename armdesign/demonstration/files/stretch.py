"""A part of a recording by its name: ``take.c3d@1.20:3.45`` is what lies between these times [s]."""

from __future__ import annotations

import os
import re
from typing import NamedTuple

_STRETCH = re.compile(r"(?P<file>.+)@(?P<start>-?\d+(?:\.\d+)?):(?P<stop>-?\d+(?:\.\d+)?)", re.DOTALL)


class Part(NamedTuple):
    """A recording's file, and from when to when it counts."""

    file: str
    start: float | None = None  # [s]; None for the first frame
    stop: float | None = None  # [s]; None for the last frame


def part_of(path: str | os.PathLike[str]) -> Part:
    """The file and the stretch that a recording's name means; a file of that very name goes before."""
    text = os.fspath(path)
    match = _STRETCH.fullmatch(text)
    if match is None or os.path.lexists(text):
        return Part(text)
    return Part(match["file"], float(match["start"]), float(match["stop"]))


def part_name(path: str | os.PathLike[str], start: float, stop: float) -> str:
    """The name of a part of a recording.

    Args:
        path: The recording's file.
        start: Its first time [s].
        stop: Its last time [s].
    """
    return f"{part_of(path).file}@{start:.4f}:{stop:.4f}"


def file_exists(path: str) -> bool:
    """Whether the file of a recording, or of a part of one, is there."""
    return os.path.exists(part_of(path).file)  # False for names too long, too
