"""Everything this package raises for bad input, in one family, and the words that messages share.

The command line turns any :class:`ArmDesignError` into one sentence and exit code 2. The message says
what is wrong, where, which values are allowed and what to do; the offending value travels along for callers.
"""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Sequence
from pathlib import Path


class ArmDesignError(Exception):
    """Base of every error raised for bad input.

    Attributes:
        value: The offending value, if there is one.
        allowed: The values that would have been accepted, in words or as a list.
        fix: What the user can do about it.
        what: The sentence without the fix.
        exit_code: What the command line ends with.
    """

    exit_code = 2

    def __init__(self, message: str, *, value: object = None, allowed: object = None, fix: str | None = None) -> None:
        """Compose the sentence out of its parts.

        Args:
            message: What is wrong and where.
            value: The offending value.
            allowed: The accepted values; appended as "allowed: ...".
            fix: The way out; appended as a second sentence.
        """
        self.value = value
        self.allowed = allowed
        self.fix = fix
        text = message
        if allowed is not None:
            shown = ", ".join(map(str, allowed)) if isinstance(allowed, (list, tuple)) else str(allowed)
            text += f"; allowed: {shown}"
        self.what = text
        if fix is not None:
            text += f". {fix}"
        super().__init__(text)


class RecordingError(ArmDesignError):
    """A recording cannot be read or does not make sense."""


class TaskError(ArmDesignError):
    """A recording does not give the task that was asked for."""


class SettingsError(ArmDesignError):
    """A setting is unknown, of the wrong type or out of range."""


class DesignError(ArmDesignError):
    """A design (DH table) cannot be read or is not a serial arm this package handles."""


class ObstacleError(ArmDesignError):
    """An obstacle cannot be read or used."""


class CatalogueError(ArmDesignError):
    """A catalogue of parts is faulty, or has none that would do."""


class SearchError(ArmDesignError):
    """The search cannot start or has found nothing."""


class RunFolderError(ArmDesignError):
    """A run folder cannot be read or written."""


class PluginError(ArmDesignError):
    """A plug-in cannot be loaded or fails; the message names its package."""


class MissingExtraError(ArmDesignError):
    """An optional dependency is needed; the message names the pip line."""


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
