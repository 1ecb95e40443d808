"""From the flags of ``armdesign study`` to its request and its tasks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from armdesign.cli.command_options import WeightFlags, settings_from_flags
from armdesign.cli.input_recordings import from_run_folder, open_recording
from armdesign.demonstration import Recording
from armdesign.errors import ArmDesignError, SettingsError
from armdesign.experiments.studies.study_plan import StudyRequest
from armdesign.experiments.studies.study_registry import study_module
from armdesign.experiments.sweep.ranges import whole_numbers
from armdesign.experiments.sweep.sweep_plan import Tasks, check_stems
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Settings, read_settings

MOST_JOINTS = 10
EXAMPLES = ("packaging", "welding")
"""The recordings that come with the package, and the scenario that belongs to each."""
TASK_FLAGS = ("--base", "--points", "--weights", "--units", "--scale")
"""Flags that errors about recordings name and the studies do not have."""


@dataclass(frozen=True)
class StudyFlags:
    """What was given to a study; None where a flag was not."""

    tasks: Sequence[str] | None = None  # words that name tasks
    quick: bool = False  # whether a small study will do
    reps: int | None = None  # repetitions
    seed: int | None = None  # first seed
    dof: str | None = None  # numbers of joints, as text
    # settings whose flags were given: the scenario of every task, changes to [search]
    given: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    config: Path | None = None  # settings file
    # options of the study by name; those that are None keep their defaults
    options: Mapping[str, Any] = field(default_factory=dict)


def request_from_flags(name: str, flags: StudyFlags) -> tuple[StudyRequest, Tasks]:
    """The request of a study, and its tasks.

    Raises:
        SettingsError: A flag cannot be, or two tasks have one name.
        RecordingError: A recording cannot be read.
        TaskError: A recording does not give the task that is asked for.
    """
    usual = study_module(name).defaults(flags.quick)
    reps, seed = usual.reps if flags.reps is None else flags.reps, flags.seed or 0
    if reps < 1:
        raise SettingsError(f"--reps is {reps}: there would be nothing to repeat", value=reps, allowed="1 or more")
    if not 0 <= seed <= 2**32 - reps:
        last = "" if seed < 0 or reps == 1 else f", and the last of {reps} repetitions has {seed + reps - 1}"
        raise SettingsError(f"--seed is {seed}{last}", value=seed, allowed="a whole number from 0 to 2^32 - 1")
    dof = joints(flags.dof) or usual.dof
    search = {**usual.search, **flags.given["search"]}
    tasks = read_tasks(name, flags, search, dof)
    keys = tuple(dict.fromkeys(key for key, _ in tasks))
    options = {option: value for option, value in flags.options.items() if value is not None}
    return StudyRequest(name, keys, dof, reps, seed, {**usual.options, **options}), tasks


def joints(text: str | None) -> tuple[int, ...] | None:
    """The numbers of joints of --dof.

    Raises:
        SettingsError: They cannot be made out, or are out of range.
    """
    if text is None:
        return None
    numbers = whole_numbers(text, "--dof")
    for n in numbers:
        if not 1 <= n <= MOST_JOINTS:
            raise SettingsError(f"--dof {text} asks for {n} joints", value=n, allowed=f"1 to {MOST_JOINTS}")
    return numbers


def words(text: str | None, flag: str) -> tuple[str, ...] | None:
    """The entries of a comma-separated list, each once; None where nothing is given.

    Raises:
        SettingsError: It is given and empty.
    """
    if text is None:
        return None
    parts = [part.strip().lower() for part in text.split(",") if part.strip()]
    if not parts:
        raise SettingsError(f"{flag} is empty", value=text, fix="Name at least one, or leave it out")
    return tuple(dict.fromkeys(parts))


def read_tasks(name: str, flags: StudyFlags, search: Mapping[str, Any], dof: Sequence[int]) -> Tasks:
    """Read the recordings, and prepare them for every number of joints.

    Raises:
        SettingsError: Two tasks have one name, or settings cannot be.
    """
    settings = settings_from_flags(flags.config, {})
    named = list(flags.tasks or ())
    if not named:
        named = list(EXAMPLES) if settings.task.recording is None and not settings.task.files else [str(flags.config)]
    found = {}
    for word in dict.fromkeys(named):
        with about(word):
            key, recording, own = open_task(name, word, settings, flags.given["fitness"].get("scenario"))
        body = {} if own.cell.obstacles else {"kind": "thin"}  # the paper's arm is but lines
        own = own.replace({"search": dict(search), "body": body})
        for n in dof:
            with about(word):
                found[key, n] = prepare(recording, own.replace({"design": {"dof": n}}))
    check_stems(list(dict.fromkeys(key for key, _ in found)))
    return found


@contextmanager
def about(word: str) -> Iterator[None]:
    """Have an error tell which task it is about, and how to set what other commands have flags for.

    Raises:
        ArmDesignError: That error, with the task's name and what to do.
    """
    try:
        yield
    except ArmDesignError as error:
        where = "" if word in str(error) else f"{word}: "
        flags = [flag for flag in TASK_FLAGS if flag in str(error)]
        if not (where or flags):
            raise
        fix = None
        if flags and Path(word).suffix.lower() == ".toml":
            fix = f"In {word} these are entries of [task] and [fitness]"
        elif flags:
            how = f"armdesign search {word} {flags[0]} ... --write-config > task.toml"
            fix = f"A study takes this from a settings file: write one by '{how}' and name it as the task"
        raise type(error)(f"{where}{error}", value=error.value, fix=fix) from error


def example_recording(name: str) -> Path:
    """A recording of ``EXAMPLES``: inside the package (a wheel) or beside it (a checkout or an editable install).

    Raises:
        SettingsError: It is in neither place.
    """
    package = Path(__file__).resolve().parent.parent
    places = [above / "examples" / f"{name}.csv" for above in (package, package.parent)]
    found = next((place for place in places if place.is_file()), None)
    if found is None:
        raise SettingsError(
            f"the built-in recording '{name}' is missing; looked for {places[0]} and {places[1]}", value=name,
            fix="The installation is incomplete: reinstall armdesign, or name a recording of your own",
        )  # fmt: skip
    return found


def open_task(name: str, word: str, settings: Settings, scenario: str | None) -> tuple[str, Recording, Settings]:
    """The key, the recording and the settings of one task."""
    command = f"study {name}"
    if word in EXAMPLES:
        _, recording, own = open_recording(example_recording(word), settings, WeightFlags(scenario or word), command)
        return word, recording, own
    path = Path(word)
    if path.suffix.lower() == ".toml":
        settings = from_run_folder(read_settings(path), path.parent)
        _, recording, own = open_recording(None, settings, WeightFlags(scenario), command)
    else:
        _, recording, own = open_recording(path, settings, WeightFlags(scenario), command)
    return str(path.resolve()), recording, own
