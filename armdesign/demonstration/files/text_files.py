"""Recordings as files: the first bytes show the format, text comes in any encoding, and all of it has limits.

The limits are far above any recording. They keep a damaged or foreign file from filling the memory.
"""

from __future__ import annotations

import codecs
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol, TextIO

from armdesign.errors import RecordingError

HEAD_SIZE = 8192
MAX_SIZE = 1 << 30  # bytes
MAX_COLUMNS = 30_000
MAX_NAME = 200  # characters
MAX_LINE = 2 << 20  # characters
MAX_LINES = 20_000_000
MAX_NUMBERS = 1 << 27  # 1 GiB of them, or 100 markers at 120 frames/s for an hour
_HEADER_SIZE = 4 << 20  # more than any header; below it there are only numbers
_ZIP_MAGIC = b"PK\x03\x04"
_UTF16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
BLANK = ' \t\r\n,;"'
"""Letters of a line without anything in it."""
_LINES = 8 << 20  # characters read at a time


def read_head(path: Path) -> bytes:
    """The first bytes of a file that can be a recording.

    Returns:
        At most ``HEAD_SIZE`` bytes, not all of them blank.

    Raises:
        RecordingError: There is no such file, it is a folder or a device, it may not be read, it is empty, or it is
            larger than any recording.
    """
    try:
        if path.is_dir():
            raise RecordingError(f"{path} is a folder", value=str(path), fix="Name the recording's file in it")
        if not path.exists():
            raise RecordingError(f"the recording {path} does not exist", value=str(path), fix="Check the path")
        if not path.is_file():
            raise RecordingError(f"{path} is not a regular file", value=str(path), fix="Save the recording as a file")
        size = path.stat().st_size
        if size > MAX_SIZE:
            fix = "Export a shorter stretch, or only the points that are needed"
            message = f"{path} is {size / 2**30:.1f} GiB in size"
            raise RecordingError(message, value=size, allowed=f"at most {MAX_SIZE >> 30} GiB", fix=fix)
        with path.open("rb") as stream:
            head = stream.read(HEAD_SIZE)
    except (OSError, ValueError) as error:  # ValueError: a path with a NUL in it
        raise unreadable(path, error) from error
    if not head.strip():
        raise RecordingError(f"the recording {path} is empty", value=str(path), fix="Export it again")
    return head


def unreadable(path: Path, error: Exception) -> RecordingError:
    """The error for a file that the system refuses to read, and why it does."""
    why = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return RecordingError(f"cannot read {path}: {why}", value=str(path), fix="Check the path and its permissions")


@contextmanager
def open_text(path: Path) -> Iterator[TextIO]:
    """Open a text file, in a ``with`` statement: UTF-8 with or without a mark, UTF-16 with one, otherwise cp1252.

    Whatever ends the lines, they are read with a plain line feed. Bytes that the encoding does not know are replaced.
    """
    try:
        with path.open("rb") as stream:
            encoding = _encoding(stream.read(_HEADER_SIZE))
        with path.open(encoding=encoding, errors="replace") as text:
            yield text
    except OSError as error:
        raise unreadable(path, error) from error


def text_head(head: bytes) -> str:
    """The text in the first bytes of a file, in whatever encoding, with plain line feeds; empty if it is no text."""
    if not (is_text(head) or head.startswith(_UTF16_MARKS)):
        return ""
    text = codecs.getincrementaldecoder(_encoding(head))("replace").decode(head)
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _encoding(head: bytes) -> str:
    """The encoding of a text that begins with these bytes."""
    if head.startswith(_UTF16_MARKS):
        return "utf-16"
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)  # takes a letter that the end cuts in two
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8-sig"


def is_text(head: bytes) -> bool:
    """Whether these bytes can begin a text file of one byte or more per letter (not UTF-16)."""
    return b"\0" not in head and not head.startswith(_UTF16_MARKS)


def describe_binary(head: bytes) -> str:
    """What a file that is not text seems to be, and what to do about it."""
    if head.startswith(_ZIP_MAGIC):
        return "It looks like a spreadsheet or an archive: save it as comma separated values"
    if head.startswith(_UTF16_MARKS):
        return "It looks like UTF-16 text: save it as UTF-8"
    return "Export the recording as comma separated values"


class Lines(Protocol):
    """As much of an open text file as reading a table takes."""

    def readline(self, size: int = -1, /) -> str:
        """The next line, or so many of its characters, with its end; empty at the end of the file."""

    def read(self, size: int = -1, /) -> str:
        """So many characters, whatever lines they are in; empty at the end of the file."""


@dataclass(frozen=True)
class Place:
    """A line in a file, for messages."""

    source: Path
    line: int  # from 1

    def below(self, lines: int) -> Place:
        """The place that many lines further down."""
        return Place(self.source, self.line + lines)

    def __str__(self) -> str:
        return f"{self.source}, line {self.line}"


def read_lines(stream: Lines, place: Place, size: int = _LINES) -> list[str]:
    """The next lines with their ends, ``size`` characters or a few more; an empty list at the end of the file."""
    if isinstance(stream, LinesAhead) and (stream.is_end is not None or stream.change is not None):
        lines: list[str] = []
        total = 0
        while total < size and (text := read_line(stream, place, len(lines))):
            lines.append(text)
            total += len(text)
        return lines
    # many lines at once, which matters in takes of hours
    text = stream.read(size)
    text += "" if not text or text.endswith("\n") else read_line(stream, place)
    lines = [f"{line}\n" for line in text.split("\n")]
    lines[-1] = lines[-1][:-1]
    lengths = [len(line) for line in lines]
    _check_line(max(lengths), place.below(lengths.index(max(lengths))))
    return lines if lines[-1] else lines[:-1]


def read_line(stream: Lines, place: Place, below: int = 0) -> str:
    """The next line with its end, so many lines ``below`` a place; empty at the end of the file."""
    text = stream.readline(MAX_LINE)
    _check_line(len(text), place.below(below))
    return text


def _check_line(length: int, place: Place) -> None:
    """Turn away a line that is longer than any of a recording."""
    if length >= MAX_LINE:
        message = f"{place}: the line is longer than {MAX_LINE:,} characters"
        raise RecordingError(message, fix="This is no recording as text, or its line ends were lost: export it again")


def check_columns(count: int, place: Place) -> None:
    """Turn away a table with more columns than any recording has."""
    if count > MAX_COLUMNS:
        message, fix = f"{place}: the table has {count:,} columns", "Export only the points that are needed"
        raise RecordingError(message, value=count, allowed=f"at most {MAX_COLUMNS:,}", fix=fix)


def check_size(numbers: int, place: Place) -> None:
    """Turn away a table of which so many numbers, down to this place, would not fit into memory."""
    if numbers > MAX_NUMBERS or place.line > MAX_LINES:
        what = f"{MAX_NUMBERS:,} numbers" if numbers > MAX_NUMBERS else f"{MAX_LINES:,} lines"
        fix = "Export a shorter stretch, or only the points that are needed"
        raise RecordingError(f"{place.source} holds more than {what}", value=numbers, fix=fix)


def check_names(names: Sequence[str], columns: int, place: Place) -> None:
    """Turn away a header with more columns, or a longer name, than any recording has."""
    check_columns(columns, place)
    for name in names:
        if len(name) > MAX_NAME:
            message = f"{place}: the name '{shown(name)}' has {len(name):,} letters"
            raise RecordingError(message, value=name, allowed=f"at most {MAX_NAME}", fix="Rename it")


def shown(text: str, most: int = 40) -> str:
    """The beginning of a text for a message, with a question mark for each letter that cannot be seen."""
    seen = "".join(letter if letter.isprintable() else "?" for letter in text[:most])
    return seen if len(text) <= most else seen + "..."


class LinesAhead:
    """Reads a text file line by line.

    Attributes:
        place: The next line.
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
        """The next line with its end, which stays the next one; empty at the end."""
        if self._next is None:
            self._next = read_line(self._stream, self.place)
        return "" if self.is_end is not None and self.is_end(self._next) else self._next

    def readline(self, size: int = MAX_LINE, /) -> str:
        """The next line with its end, whatever its size; empty at the end."""
        text = self.peek()
        if text:
            self._next = None
            self.place = self.place.below(1)
            check_size(0, self.place)
        return text if self.change is None or not text else self.change(text)

    def read(self, size: int = -1, /) -> str:
        """So many characters, and those of the line that was peeked at; not where lines end or change by a rule."""
        ahead, self._next = self._next or "", None
        text = ahead + self._stream.read(size)
        self.place = self.place.below(text.count("\n"))
        check_size(0, self.place)
        return text

    def skip_blank(self) -> str:
        """Go over lines without anything in them; the next line, which stays the next one."""
        while (text := self.peek()) and not text.strip(BLANK):
            self.readline()
        return text
