"""One process per run folder: a lock that names its holder and ends with it."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from armdesign.errors import RunFolderError

NAME = ".lock"


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder's lock; the system lets go of it when the process ends, however it ends.

    Raises:
        RunFolderError: Another process holds it; the message names that process.
    """
    path = folder / NAME
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
    except OSError as error:
        raise RunFolderError(f"cannot lock the run folder {folder}: {error.strerror}", value=str(folder)) from error
    try:
        if not take(descriptor):
            holder = path.read_text(encoding="utf-8").strip() or "another process"
            raise RunFolderError(
                f"the run folder {folder} is in use by {holder}", value=holder, fix="Wait for it, or stop it first"
            )
        os.ftruncate(descriptor, 0)
        os.write(
            descriptor,
            f"process {os.getpid()} on {os.uname().nodename if hasattr(os, 'uname') else 'this machine'}\n".encode(),
        )
        yield
        with contextlib.suppress(OSError):
            path.unlink()
    finally:
        os.close(descriptor)


def holder_of(folder: Path) -> str | None:
    """Who holds the folder's lock, in words; None where nobody does."""
    try:
        descriptor = os.open(folder / NAME, os.O_RDWR)
    except OSError:
        return None
    try:
        if take(descriptor):
            return None
        return (folder / NAME).read_text(encoding="utf-8").strip() or "another process"
    finally:
        os.close(descriptor)


def take(descriptor: int) -> bool:
    """Try to lock an open file without waiting."""
    try:
        import fcntl  # noqa: PLC0415 (not on Windows)
    except ImportError:
        import msvcrt  # noqa: PLC0415

        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined,unused-ignore]
        except OSError:
            return False
        return True
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
