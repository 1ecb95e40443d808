"""The first bytes of a recording, by which its format is recognised, and text in whatever encoding it was written."""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from armdesign.errors import RecordingError

HEAD_SIZE = 8192
MAX_SIZE = 1 << 30  # bytes
_HEADER_SIZE = 4 << 20  # more than any header; below it there are only numbers
_ZIP_MAGIC = b"PK\x03\x04"
_UTF16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def read_head(path: Path) -> bytes:
    """The first bytes of a file that can be a recording.

    Args:
        path: The file.

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
        _check_size(path)
        with path.open("rb") as stream:
            head = stream.read(HEAD_SIZE)
    except (OSError, ValueError) as error:  # ValueError: a path with a NUL in it
        raise unreadable(path, error) from error
    if not head.strip():
        raise RecordingError(f"the recording {path} is empty", value=str(path), fix="Export it again")
    return head


def _check_size(path: Path) -> None:
    """Turn away a file that is too large."""
    size = path.stat().st_size
    if size > MAX_SIZE:
        fix = "Export a shorter stretch, or only the points that are needed"
        message = f"{path} is {size / 2**30:.1f} GiB in size"
        raise RecordingError(message, value=size, allowed=f"at most {MAX_SIZE >> 30} GiB", fix=fix)


def unreadable(path: Path, error: Exception) -> RecordingError:
    """The error for a file that the system refuses to read.

    Args:
        path: The file.
        error: What the system says.
    """
    why = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return RecordingError(f"cannot read {path}: {why}", value=str(path), fix="Check the path and its permissions")


@contextmanager
def open_text(path: Path) -> Iterator[TextIO]:
    """Open a text file, in a ``with`` statement: UTF-8 with or without a mark, UTF-16 with one, otherwise cp1252.

    Whatever ends the lines, they are read with a plain line feed. Bytes that the encoding does not know are replaced.

    Args:
        path: The file.

    Raises:
        RecordingError: The file cannot be read, now or further down.
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
