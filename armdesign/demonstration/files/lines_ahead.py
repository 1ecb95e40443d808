"""Lines of a text file with a look at the next one, and its number."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from armdesign.demonstration.files.csv_cells import BLANK, MAX_LINE, Lines, Place, check_size, read_line


class LinesAhead:
    """Reads a text file line by line.

    Attributes:
        place: Where the next line stands.
        is_end: Whether a line is to be taken for the end of the file; None to go on to the real end.
        change: Gives the new line for one, both with their ends; None to leave them as they are.
    """

    def __init__(self, stream: Lines, source: Path) -> None:
        self.place = Place(source, 1)
        self.is_end: Callable[[str], bool] | None = None
        self.change: Callable[[str], str] | None = None
        self._stream = stream
        self._next: str | None = None

    def peek(self) -> str:
        """The next line with its end, which stays the next one; empty at the end.

        Raises:
            RecordingError: The line is longer than any of a recording.
        """
        if self._next is None:
            self._next = read_line(self._stream, self.place)
        return "" if self.is_end is not None and self.is_end(self._next) else self._next

    def readline(self, size: int = MAX_LINE, /) -> str:
        """The next line with its end, whatever its size; empty at the end.

        Raises:
            RecordingError: The line is longer than any of a recording, or there are too many.
        """
        text = self.peek()
        if text:
            self._next = None
            self.place = self.place.below(1)
            check_size(0, self.place)
        return text if self.change is None or not text else self.change(text)

    def skip_blank(self) -> str:
        """Go over lines without anything in them; the next line, which stays the next one."""
        while (text := self.peek()) and not text.strip(BLANK):
            self.readline()
        return text
