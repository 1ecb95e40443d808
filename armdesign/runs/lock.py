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
    descriptor = acquire(folder)
    try:
        with contextlib.suppress(OSError):  # on a full disk the lock holds without a name
            os.ftruncate(descriptor, 0)
            os.write(descriptor, f"{this_process()}\n".encode())
        yield
    finally:
        with contextlib.suppress(OSError):
            if is_at(descriptor, folder / NAME):
                (folder / NAME).unlink()
        os.close(descriptor)


def acquire(folder: Path) -> int:
    """Open and lock the folder's lock file.

    Raises:
        RunFolderError: Another process holds it, or there can be none in this folder.
    """
    path = folder / NAME
    while True:
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
            taken = take(descriptor)
        except OSError as error:
            raise RunFolderError(f"cannot lock the run folder {folder}: {error.strerror}", value=str(folder)) from error
        if taken and is_at(descriptor, path):
            return descriptor
        holder = name_in(descriptor)
        os.close(descriptor)
        if not taken:
            raise RunFolderError(
                f"the run folder {folder} is in use by {holder}", value=holder, fix="Wait for it, or stop it first"
            )


def holder_of(folder: Path) -> str | None:
    """Who holds the folder's lock, in words; None where nobody does."""
    try:
        descriptor = os.open(folder / NAME, os.O_RDWR)
    except OSError:
        return None
    try:
        return None if take(descriptor) else name_in(descriptor)
    except OSError:
        return None
    finally:
        os.close(descriptor)


def this_process() -> str:
    """This process in words."""
    return f"process {os.getpid()} on {os.uname().nodename if hasattr(os, 'uname') else 'this machine'}"


def name_in(descriptor: int) -> str:
    """What a lock file says about its holder."""
    with contextlib.suppress(OSError):  # Windows lets nobody read a locked file
        return os.read(descriptor, 300).decode(errors="replace").strip() or "another process"
    return "another process"


def is_at(descriptor: int, path: Path) -> bool:
    """Whether an open file is still the one at that path; its holder removes it at the end."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.stat())
    except OSError:
        return False


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
    except BlockingIOError:
        return False
    return True
