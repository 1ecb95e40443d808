"""Words for messages."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Sequence
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


def short_names(paths: Sequence[str]) -> list[str]:
    """Names of files without their folders; whole paths where two files would have one name."""
    last = {path: path.replace("\\", "/").rpartition("/")[2] for path in paths}
    files = Counter(last.values())
    return [last[path] if files[last[path]] == 1 else path for path in paths]
