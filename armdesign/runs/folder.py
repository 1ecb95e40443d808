"""The run folder: which files it has, where they are, and how one is made ready for a run."""

from __future__ import annotations

from itertools import takewhile
from pathlib import Path

from armdesign.building import BILL, CUTS, RECORD
from armdesign.errors import RunFolderError

SETTINGS, TASK, TASK_JSON, RESULT = "settings.toml", "task.csv", "task.json", "result.json"
EARLIER_SETTINGS = "study.toml"
"""What versions before the release called the settings; such run folders can still be read."""
OBSTACLES = "obstacles.json"
"""What stands in the room, where something does."""
HISTORY, ALTERNATIVES, TRAJECTORY, URDF = "history.csv", "alternatives.json", "trajectory.csv", "arm.urdf"
PREVIEW, REPORT = "preview.html", "report.html"
NOTHING_FOUND = "nothing_found.json"
"""Written instead of a result where a search has ended without any valid arm: why it has ended, and the error."""
RESULT_SCHEMA = Path(__file__).with_name("result.schema.json")
"""JSON Schema of result.json."""
TASK_FILES = (SETTINGS, EARLIER_SETTINGS, TASK, TASK_JSON, OBSTACLES)
RESULT_FILES = (RESULT, HISTORY, ALTERNATIVES, TRAJECTORY, URDF, PREVIEW, REPORT, RECORD, BILL, CUTS)
"""The result first: without it, what is left of a removal that was cut short does not look like a finished run."""
DEMONSTRATIONS, HOLDOUTS = "demonstration_*", "holdout_*"
"""Folders inside a run folder: of further demonstrations, from demonstration_2 on, and of those held out, from
holdout_1 on. Each is a run folder itself, of the same arm."""


def claim_folder(folder: Path, *, overwrite: bool = False) -> Path:
    """Make the run folder before the work begins, so that a bad path fails early.

    Args:
        folder: The run folder.
        overwrite: Whether a run that it holds may be given up.

    Raises:
        RunFolderError: It holds a run already, is a file, or cannot be written.
    """
    try:
        if folder.exists() and not folder.is_dir():
            raise RunFolderError(f"the output {folder} is a file", value=str(folder), fix="Name a folder with --out")
        if holds_run(folder) and not overwrite:
            unfinished = "" if (folder / RESULT).exists() else f", go on with it by --resume {folder}"
            raise RunFolderError(
                f"{folder} already holds a run", value=str(folder),
                fix=f"Name another with --out{unfinished}, or add --overwrite",
            )  # fmt: skip
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / ".writable"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise RunFolderError(
            f"cannot write to the output folder {folder}: {error.strerror}", value=str(folder),
            fix="Name a folder you may write to with --out",
        ) from error  # fmt: skip
    return folder


def holds_run(folder: Path) -> bool:
    """Whether a folder holds a run, finished or not."""
    return any((folder / name).exists() for name in (RESULT, "state.npz", "state-previous.npz"))


def free_folder(parent: Path, name: str) -> Path:
    """The first of NAME, NAME-2, NAME-3, ... that holds no run.

    Args:
        parent: The folder that runs are in.
        name: NAME.
    """
    folder, k = parent / name, 2
    while holds_run(folder):
        folder, k = parent / f"{name}-{k}", k + 1
    return folder


def settings_file(folder: Path) -> Path:
    """The settings of a run folder, also of one that an earlier version has written."""
    earlier = folder / EARLIER_SETTINGS
    return earlier if earlier.is_file() and not (folder / SETTINGS).is_file() else folder / SETTINGS


def old_name_note(folder: Path) -> str | None:
    """A sentence for people where the settings of a run folder have the name that earlier versions gave them."""
    path = settings_file(folder)
    if path.name != EARLIER_SETTINGS or not path.is_file():
        return None
    return f"The settings of {folder} are read from {EARLIER_SETTINGS}, which is called {SETTINGS} now."


def inner_names(pattern: str, number: int) -> list[str]:
    """Names of the folders of so many further demonstrations, or of so many held out.

    Args:
        pattern: DEMONSTRATIONS or HOLDOUTS.
        number: How many.
    """
    first = 2 if pattern == DEMONSTRATIONS else 1
    return [pattern.replace("*", str(k)) for k in range(first, first + number)]


def inner_folders(folder: Path, pattern: str) -> list[Path]:
    """Folders of further demonstrations in a run folder, in their order.

    Args:
        folder: The run folder.
        pattern: DEMONSTRATIONS or HOLDOUTS.
    """
    places = (folder / name for name in inner_names(pattern, len(list(folder.glob(pattern)))))
    return list(takewhile(lambda place: settings_file(place).is_file(), places))
