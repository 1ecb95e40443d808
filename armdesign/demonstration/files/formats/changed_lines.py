"""A text file whose lines are put into order while they are read."""

from __future__ import annotations

from collections.abc import Callable
from typing import TextIO, cast


class _ChangedLines:
    """Reads lines of another file and changes each."""

    def __init__(self, stream: TextIO, change: Callable[[str], str]) -> None:
        self._stream = stream
        self._change = change

    def readline(self, size: int = -1) -> str:
        """The next line, changed; empty at the end of the file. One that is too long is left as it is."""
        text = self._stream.readline(size)
        return text if not text or len(text) == size else self._change(text)


def changed_lines(stream: TextIO, change: Callable[[str], str]) -> TextIO:
    """A file, as far as ``readline`` goes, with other lines.

    Args:
        stream: The file, at the first line to be changed.
        change: Gives the new line for an old one, both with their ends; never an empty text.
    """
    return cast(TextIO, _ChangedLines(stream, change))
