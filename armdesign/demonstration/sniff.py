"""The first bytes of a recording, by which its format is recognised."""

from __future__ import annotations

from pathlib import Path

from armdesign.errors import RecordingError

HEAD_SIZE = 8192
_ZIP_MAGIC = b"PK\x03\x04"
_UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")


def read_head(path: Path) -> bytes:
    """The first bytes of a file that can be a recording.

    Args:
        path: The file.

    Returns:
        At most ``HEAD_SIZE`` bytes, not all of them blank.

    Raises:
        RecordingError: There is no such file, it is a folder or a device, it may not be read, or it is empty.
    """
    try:
        if path.is_dir():
            raise RecordingError(f"{path} is a folder", value=str(path), fix="Name the recording's file in it")
        if not path.exists():
            raise RecordingError(f"the recording {path} does not exist", value=str(path), fix="Check the path")
        if not path.is_file():
            raise RecordingError(f"{path} is not a regular file", value=str(path), fix="Save the recording as a file")
        with path.open("rb") as stream:
            head = stream.read(HEAD_SIZE)
    except (OSError, ValueError) as error:  # ValueError: a path with a NUL in it
        raise unreadable(path, error) from error
    if not head.strip():
        raise RecordingError(f"the recording {path} is empty", value=str(path), fix="Export it again")
    return head


def unreadable(path: Path, error: Exception) -> RecordingError:
    """The error for a file that the system refuses to read."""
    why = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return RecordingError(f"cannot read {path}: {why}", value=str(path), fix="Check the path and its permissions")


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
