"""Words for messages."""

from __future__ import annotations

import shlex
from pathlib import Path


def counted(count: int, noun: str) -> str:
    """A number with its noun: ``1 joint``, ``3 joints``."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def resume_command(command: str, folder: Path, cluster: str | None = None) -> str:
    """What to type to go on with a search or a sweep, fit for a shell.

    Args:
        command: ``search`` or ``sweep``.
        folder: Its folder.
        cluster: The scheduler it was carried out on; None for this machine.
    """
    where = "" if cluster is None else f" --cluster {cluster}"
    return f"armdesign {command} --resume {shlex.quote(str(folder))}{where}"
