"""Files that are written whole or not at all, JSON files read with one kind of error, tables as CSV."""

from __future__ import annotations

import contextlib
import csv
import errno
import io
import json
import math
import os
import secrets
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from armdesign.errors import RunFolderError

_REASONS = {
    errno.ENOSPC: ("the disk is full", "Free some space or choose another place"),
    errno.EDQUOT: ("the disk quota is used up", "Free some space or choose another place"),
    errno.EFBIG: ("the file would be larger than allowed here", "Choose another place"),
    errno.EACCES: ("the folder cannot be written to", "Choose another place or change its permissions"),
    errno.EPERM: ("the folder cannot be written to", "Choose another place or change its permissions"),
    errno.EROFS: ("the disk is read-only", "Choose another place"),
    errno.ENOENT: ("the folder does not exist", "Create it or choose another place"),
    errno.ENOTDIR: ("part of the path is a file, not a folder", "Choose another place"),
    errno.EISDIR: ("it is a folder", "Give the name of a file"),
    errno.ENAMETOOLONG: ("the name is too long", "Choose a shorter one"),
}


def write_whole(path: str | os.PathLike[str], content: str | bytes) -> None:
    """Write a file so that readers find either the old content or the new one, never a part of it.

    The content goes to a temporary file in the same folder, is flushed to the disk and renamed into place. A link
    is followed: what it points to is replaced.

    Args:
        path: File to create or replace.
        content: Bytes, or text to be stored as UTF-8 with the line ends it has.

    Raises:
        RunFolderError: The file cannot be written; what was there before is untouched.
    """
    data = content.encode() if isinstance(content, str) else content
    target = Path(os.path.realpath(path))
    try:
        if target.exists() and not target.is_file():
            raise OSError(errno.EISDIR if target.is_dir() else errno.EINVAL, "it is not a regular file")
        _write_and_rename(target, data)
    except OSError as error:
        why, fix = _REASONS.get(error.errno or 0, (error.strerror or str(error), "Choose another place"))
        raise RunFolderError(f"cannot write {path}: {why}", value=str(path), fix=fix) from error


def read_json(path: Path, fix: str | None = None) -> dict[str, Any]:
    """The table that a JSON file holds.

    Args:
        path: The file.
        fix: What to do where it cannot be used.

    Raises:
        RunFolderError: It is missing or damaged; the message says which.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise RunFolderError(f"{path} is missing", value=str(path), fix=fix) from error
    except OSError as error:
        raise RunFolderError(f"cannot read {path}: {error.strerror}", value=str(path), fix=fix) from error
    except (ValueError, RecursionError) as error:
        raise RunFolderError(f"{path} is damaged: {error}", value=str(path), fix=fix) from error
    if not isinstance(content, dict):
        raise RunFolderError(f"{path} is damaged: it holds no table", value=str(path), fix=fix)
    return content


def is_number(value: object) -> bool:
    """Whether a value of a file is a number that a float can hold."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max  # also of whole numbers that no float can hold; not of nan


def csv_table(names: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table as CSV; a cell that is None or a number that is not finite is empty.

    Args:
        names: Headings.
        rows: Cells of every row, one for each heading.
    """
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(names)
    for row in rows:
        writer.writerow(["" if isinstance(cell, float) and not math.isfinite(cell) else cell for cell in row])
    return buffer.getvalue()


def remove_files(paths: Iterable[Path]) -> None:
    """Remove files where they are there.

    Raises:
        RunFolderError: A file cannot be removed.
    """
    for path in paths:
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise RunFolderError(f"cannot remove {path}: {error.strerror}", value=str(path)) from error


def _write_and_rename(target: Path, data: bytes) -> None:
    """Write ``data`` beside ``target`` and rename it over; on any failure nothing is left behind."""
    name = target.name[:100]  # leaves room for the ending where the name is as long as names may be
    temporary = target.with_name(f".{name}.{secrets.token_hex(8)}.tmp")
    descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, target)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise
    _flush_folder(target.parent)


def _flush_folder(folder: Path) -> None:
    """Make the rename itself last through a power cut, where the system can do that for folders."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
