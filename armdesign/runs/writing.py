"""Run folders on the disk: every file written whole or not at all, results removed before new ones are written."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path

from armdesign.errors import RunFolderError
from armdesign.files import remove_files, write_whole
from armdesign.runs.contents import contents, inner_demonstrations
from armdesign.runs.folder import DEMONSTRATIONS, HOLDOUTS, RESULT_FILES, TASK_FILES
from armdesign.search.result import Result

ALTERNATIVES_FOLDER = "alternatives"


def write_result(folder: str | Path, result: Result) -> tuple[str, ...]:
    """Write a result as a run folder; a run that is in the folder gives way to it.

    Args:
        folder: The run folder, made where it is missing; see ``claim_folder`` where an earlier run must not be lost.
        result: What a search or an evaluation has found.

    Returns:
        The paths of the files in the folder, in the order in which they were written.

    Raises:
        RunFolderError: A file cannot be written; files written before it are whole.
    """
    place, files = Path(folder), contents(result)
    clear_result(place, keep=inner_demonstrations(result.problem))
    return write_files(place, files)


def write_files(folder: Path, files: Mapping[str, str]) -> tuple[str, ...]:
    """Write texts to the files of a folder, each whole or not at all, in their order; returns their names.

    Args:
        folder: The folder.
        files: Texts by the path of their file in the folder.

    Raises:
        RunFolderError: One cannot be written; files written before it are whole.
    """
    for name, text in files.items():
        path = folder / name
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RunFolderError(f"cannot make the folder {path.parent}: {error.strerror}", value=str(path)) from error
        write_whole(path, text)
    return tuple(files)


def clear_result(folder: Path, keep: Collection[str] = ()) -> None:
    """Remove the result of an earlier run, so that a failure on the way leaves none that looks whole.

    Args:
        folder: The run folder.
        keep: Names of the folders of further demonstrations that stay, without their result.

    Raises:
        RunFolderError: A file cannot be removed.
    """
    remove_files(folder / name for name in RESULT_FILES)
    remove_alternatives(folder)
    for pattern in (DEMONSTRATIONS, HOLDOUTS):
        for place in folder.glob(pattern):
            if place.is_dir() and place.name not in keep:
                remove_run(place)
            elif place.is_dir():
                remove_files(place / name for name in RESULT_FILES)


def remove_run(folder: Path) -> None:
    """Remove a run folder that this package has written, but for files that people have put there.

    Raises:
        RunFolderError: A file cannot be removed.
    """
    clear_result(folder)
    remove_files(folder / name for name in TASK_FILES)
    try:
        if not any(folder.iterdir()):
            folder.rmdir()
    except OSError as error:
        raise RunFolderError(f"cannot clear {folder}: {error.strerror}", value=str(folder)) from error


def remove_alternatives(folder: Path, beyond: int = 0) -> None:
    """Remove run folders that ``armdesign alternatives`` has written for an earlier result.

    Args:
        folder: The run folder.
        beyond: Rank up to which they stay.
    """
    for place in sorted((folder / ALTERNATIVES_FOLDER).glob("[0-9]*")):
        if place.is_dir() and place.name.isdecimal() and int(place.name) > beyond:
            remove_run(place)
