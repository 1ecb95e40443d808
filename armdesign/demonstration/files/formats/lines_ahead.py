"""Lines of a text file with a look at the next one, and its number."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from armdesign.demonstration.files.csv_cells import Lines, Place, check_size, read_line


class LinesAhead:
    """Reads a text file line by line.

    Attributes:
        place: Where the next line stands.
    """

    def __init__(self, stream: Lines, source: Path) -> None:
        self.place = Place(source, 1)
        self._stream = stream
        self._next: str | None = None
        self._is_end: Callable[[str], bool] | None = None

    def peek(self) -> str:
        """The next line with its end, which stays the next one; empty at the end.

        Raises:
            RecordingError: The line is longer than any of a recording.
        """
        if self._next is None:
            self._next = read_line(self._stream, self.place)
        return "" if self._is_end is not None and self._is_end(self._next) else self._next

    def readline(self, size: int = -1, /) -> str:
        """The next line with its end, whatever its size; empty at the end.

        Raises:
            RecordingError: The line is longer than any of a recording, or there are too many.
        """
        text = self.peek()
        if text:
            self._next = None
            self.place = self.place.below(1)
            check_size(0, self.place)
        return text

    def skip_blank(self) -> str:
        """Go over lines without anything in them; the next line, which stays the next one."""
        while (text := self.peek()) and not text.strip(' \t\r\n,;"'):
            self.readline()
        return text

    def end_before(self, is_end: Callable[[str], bool] | None) -> None:
        """From here on take a line for the end, until called again.

        Args:
            is_end: Whether a line is where to stop; None to go on to the end of the file.
        """
        self._is_end = is_end
