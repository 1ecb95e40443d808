"""The recordings that a command works on: named on the command line or in the settings, and read."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from glob import glob
from pathlib import Path
from typing import Any, NamedTuple

from armdesign.cli.command_options import WeightFlags
from armdesign.cli.screen import say
from armdesign.demonstration import Recording
from armdesign.demonstration.cleaning.cleaning import crop
from armdesign.demonstration.cycles import find_cycles
from armdesign.demonstration.files.formats.openpose import first_of_each_take
from armdesign.demonstration.files.formats.ros_bag import is_bag_folder
from armdesign.demonstration.files.stretch import file_exists, part_name, part_of
from armdesign.demonstration.files.text_files import unreadable
from armdesign.demonstration.points.selection import ORIGIN
from armdesign.errors import SettingsError, counted
from armdesign.runs.folder import DEMONSTRATIONS, HOLDOUTS, TASK, TASK_JSON, inner_folders, old_name_note
from armdesign.search.design_arm import recording_of
from armdesign.search.design_problem import DesignProblem
from armdesign.search.prepare import for_one, prepare
from armdesign.settings.kinds import is_unicode
from armdesign.settings.sections import Settings

ENDINGS = (
    *(".c3d", ".trc", ".csv", ".tsv", ".txt", ".bvh", ".mvnx", ".sto", ".mot", ".npz", ".npy", ".json"),
    *(".bag", ".mcap", ".db3"),
)
"""Of the files in a folder that are taken for recordings, in small letters."""


@dataclass(frozen=True)
class Demonstrations:
    """The demonstrations of a command, read."""

    source: Path  # what runs are named after
    seen: tuple[Recording, ...]  # those that the search sees
    unseen: tuple[Recording, ...]  # those that are held out
    settings: Settings  # the settings, with the paths they were read from

    def problem(self, dof: int | None = None, *, longest: float | None = None) -> DesignProblem:
        """Task and settings, for another number of joints than that of the settings where one is given."""
        settings = self.settings if dof is None else self.settings.replace({"design": {"dof": dof}})
        return prepare(self.seen, settings, holdouts=self.unseen, longest=longest)


class Split(NamedTuple):
    """How recordings become demonstrations."""

    cycles: str | None = None  # all or best; None to take each recording as one
    holdout_every: int | None = None  # every so many of them are held out; None for none


def open_demonstrations(
    recordings: Sequence[Path] | None,
    settings: Settings,
    flags: WeightFlags,
    command: str = "search",
    split: Split | None = None,
) -> Demonstrations:
    """Read all demonstrations, and settle the settings that depend on the first's points.

    Args:
        recordings: Those on the command line, which replace those in the settings.
        settings: The settings.
        flags: What --scenario and --weights say.
        command: How to write the command.
        split: What --cycles and --holdout-every say.
    """
    recordings = every_recording(recordings) if recordings else None
    if split is not None and split != Split():
        recordings, settings = split_recordings(recordings, settings, split, command)
    first = recordings[0] if recordings else None
    others = [str(path) for path in recordings[1:]] if recordings else list(settings.task.more_recordings or ())
    unseen = list(settings.task.holdouts or ())
    for path in (*others, *unseen):
        check_name(path)
    source, demonstration, single = open_recording(first, for_one(settings), flags, command)

    if not single.task.files:
        check_different([source, *map(Path, others)], [Path(path) for path in unseen])

    def read(path: str) -> Recording:
        return recording_of(single.replace({"task": {"recording": path, "files": {}}}))

    seen = (demonstration, *map(read, others))
    held = tuple(map(read, unseen))
    paths = {"more_recordings": resolved(others), "holdouts": resolved(unseen)}
    counted_how = {"demonstrations": settings.fitness.demonstrations}
    source = Path(part_of(source).file)
    return Demonstrations(source, seen, held, single.replace({"task": paths, "fitness": counted_how}))


def every_recording(named: Sequence[Path]) -> list[Path]:
    """The recordings that are named, those in a folder and those of a pattern (``takes/*.bvh``) in their order.

    Raises:
        SettingsError: A pattern or a folder holds none.
    """
    found: list[Path] = []
    for path in named:
        if os.path.isdir(path) and not is_bag_folder(path):  # False for names too long, too
            try:
                inside = sorted(path.iterdir())
            except OSError as error:
                raise unreadable(path, error) from error
            files = [each for each in inside if each.suffix.lower() in ENDINGS and each.is_file()]
        elif not file_exists(str(path)) and set(str(path)) & set("*?["):
            files = [Path(name) for name in sorted(glob(str(path), recursive=True)) if Path(name).is_file()]
        else:
            files = [path]
        if not files:
            raise SettingsError(f"{path} holds no recording", value=str(path), fix="Name the recordings' files")
        found += first_of_each_take(files) if len(files) > 1 else files
    return found


def split_recordings(
    recordings: Sequence[Path] | None, settings: Settings, split: Split, command: str
) -> tuple[list[Path], Settings]:
    """Recordings in their cycles, and every so many of them held out.

    Args:
        recordings: Those on the command line; None for those in the settings.
        settings: The settings.
        split: What is asked for.
        command: How to write the command.

    Returns:
        Those that the search sees, and the settings with those that it does not.

    Raises:
        SettingsError: Too few of them are there, or files of one point each are to be split.
        RecordingError: One has no cycles.
    """
    task, every = settings.task, split.holdout_every
    if split.cycles not in (None, "all", "best"):
        raise SettingsError(f"--cycles is '{split.cycles}'", value=split.cycles, allowed=("all", "best"))
    if every is not None and every < 2:
        raise SettingsError(f"--holdout-every is {every}", value=every, allowed="a whole number of at least 2")
    if task.files and not recordings:
        raise SettingsError("files of one point each cannot be split", fix="Leave out --cycles and --holdout-every")
    in_settings = () if recordings else (named_source(settings, command), *map(Path, task.more_recordings or ()))
    named = [*(recordings or ()), *in_settings]
    if split.cycles is not None:
        named = [part for path in named for part in cycles_in(path, settings, split.cycles)]
    if every is None:
        return named, settings
    seen = [path for i, path in enumerate(named) if (i + 1) % every]
    unseen = [path for i, path in enumerate(named) if not (i + 1) % every]
    if not unseen:
        message = f"--holdout-every is {every}, for {counted(len(named), 'demonstration')}"
        raise SettingsError(message, value=every, fix="Name more recordings, or a smaller number")
    held = [*(task.holdouts or ()), *(str(path.resolve()) for path in unseen)]
    return seen, settings.replace({"task": {"holdouts": held}})


def cycles_in(path: Path, settings: Settings, which: str) -> list[Path]:
    """The parts of a recording in which the job is done, or the most typical of them."""
    task = settings.task
    recording = recording_of(settings.replace({"task": {"recording": str(path), "files": {}}}))
    recording, _ = crop(recording, task.start, task.stop)
    found = find_cycles(recording, task.base, task.points)
    chosen = found.every if which == "all" else (found.every[found.typical],)
    return [Path(part_name(path, cycle.start, cycle.stop)) for cycle in chosen]


def from_run_folder(settings: Settings, folder: Path) -> Settings:
    """The settings of a run folder; where their recordings are gone, as after a move, with the tasks that lie beside.

    Args:
        settings: The settings.
        folder: The folder that they were read from.
    """
    if note := old_name_note(folder):
        say(note)
    task = settings.task
    first: list[str | None] = [*task.files.values()] or [task.recording]
    named = [path for path in (*first, *(task.more_recordings or ()), *(task.holdouts or ())) if path is not None]
    gone = next((path for path in named if not file_exists(path)), None)
    if gone is None or not all((folder / name).is_file() for name in (TASK, TASK_JSON)):
        return settings
    others = [str(place / TASK) for place in inner_folders(folder, DEMONSTRATIONS)]
    holdouts = [str(place / TASK) for place in inner_folders(folder, HOLDOUTS)]
    say(f"{gone} does not exist any more: the task in {folder} is used instead (--base {ORIGIN}).")
    tasks = {"recording": str(folder / TASK), "more_recordings": others or None, "holdouts": holdouts or None}
    as_it_is: dict[str, Any] = {"files": {}, "base": ORIGIN, "units": None, "up": None, "mirror": False}
    as_it_is["time_unit"] = None
    return settings.replace({"task": {**tasks, **as_it_is}})


def resolved(paths: Sequence[str]) -> list[str] | None:
    """Whole paths; None for none."""
    return [str(Path(path).resolve()) for path in paths] or None


def check_different(seen: Sequence[Path], unseen: Sequence[Path]) -> None:
    """Refuse a demonstration that would count twice, or that is held out and yet seen.

    Raises:
        SettingsError: A file is named twice.
    """
    known = {path.resolve(): path for path in seen}
    kept = {path.resolve(): path for path in unseen}
    both = [path for place, path in kept.items() if place in known]
    if both:
        message = f"{both[0]} is held out and among the demonstrations that the search sees"
        raise SettingsError(message, value=str(both[0]), fix="Leave it out of one of the two")
    if len(known) + len(kept) < len(seen) + len(unseen):
        every = [path.resolve() for path in (*seen, *unseen)]
        twice = next(path for path in every if every.count(path) > 1)
        raise SettingsError(f"{twice} is named twice, and would count double", value=str(twice), fix="Leave one out")


def check_name(path: str) -> None:
    """Refuse a path that cannot be written down.

    Raises:
        SettingsError: It is not Unicode.
    """
    if not is_unicode(path):
        raise SettingsError(f"the name of the recording {path!a} is not UTF-8", fix="Rename the file")


def open_recording(
    recording: Path | None,
    settings: Settings,
    flags: WeightFlags,
    command: str = "search",
) -> tuple[Path, Recording, Settings]:
    """Read the recording, and settle the settings that depend on its points.

    Args:
        recording: The one on the command line; None for that in the settings.
        settings: The settings.
        flags: What --scenario and --weights say.
        command: How to write the command.

    Returns:
        What runs are named after, the recording, and the settings with the paths it was read from.
    """
    task = settings.task
    if recording is not None:
        check_name(str(recording))
        named: dict[str, Any] = {"recording": str(recording), "files": {}, "more_recordings": None, "holdouts": None}
        settings = settings.replace({"task": named})
    elif task.more_recordings or task.holdouts:
        raise SettingsError(
            f"the settings name several demonstrations, but 'armdesign {command}' takes one at a time",
            value=task.more_recordings,
            fix="Name a recording on the command line, or leave out task.more_recordings and task.holdouts",
        )
    source = named_source(settings, command)
    demonstration = recording_of(settings)
    task = settings.task
    files = {name: str(Path(path).resolve()) for name, path in task.files.items()}
    single = None if files else str(source.resolve())
    settings = settings.replace({"task": {"recording": single, "files": files}})
    return source, demonstration, flags.over(settings)


def named_source(settings: Settings, command: str) -> Path:
    """The recording's path; of several files, the folder of the first.

    Raises:
        SettingsError: None is named, or both one and several.
    """
    task = settings.task
    if task.recording is not None and task.files:
        raise SettingsError("task.recording and task.files are set", fix="Leave one out")
    if task.recording is None and not task.files:
        raise SettingsError(
            "no recording given", fix=f"Write 'armdesign {command} RECORDING', or set task.recording in the settings"
        )
    return (
        Path(task.recording) if task.recording is not None else Path(next(iter(task.files.values()))).resolve().parent
    )
