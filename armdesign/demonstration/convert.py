"""From a recording in any format to a plain CSV of the points that a task uses, cleaned and still in the room."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from armdesign.demonstration import Recording, Step, resolve, write_plain_csv
from armdesign.demonstration.cleaning.cleaning import settled_cleaning
from armdesign.demonstration.provenance import Provenance, TaskRecord, provenance_of, task_json
from armdesign.demonstration.task import cleaned_points
from armdesign.files import write_whole
from armdesign.settings.sections import Settings


@dataclass(frozen=True, eq=False)
class Conversion:
    """A recording of nothing but base, points and orientation, cleaned."""

    recording: Recording  # the base first, the hand last, in metres with z up
    base: str  # name of the base
    steps: tuple[Step, ...]  # what was found and done
    provenance: Provenance  # where it comes from

    @property
    def notes(self) -> tuple[str, ...]:
        """The sentences of the steps."""
        return tuple(step.sentence for step in self.steps)


def convert(recording: Recording, settings: Settings, *, oriented: bool = False) -> Conversion:
    """Choose and clean the points that the settings ask for.

    A search on what comes out has the same task as one on the recording itself with the same settings.

    Args:
        recording: The recording.
        settings: The settings; those of the task count.
        oriented: Whether an orientation is needed, so that without task.orientation one is chosen.

    Raises:
        TaskError: A point is unknown, or the arm has no human size.
        RecordingError: The data cannot be used.
        SettingsError: A number is out of range.
    """
    task = settings.task
    chosen = resolve(recording, task.base, task.points, task.orientation, oriented=oriented)
    how = settled_cleaning(task, chosen.recording)
    cleaned, steps = cleaned_points(chosen, how)
    return Conversion(cleaned, chosen.base, steps, provenance_of(chosen, how))


def write_conversion(path: Path, conversion: Conversion) -> tuple[Path, Path]:
    """Write a converted recording, and beside it NAME.task.json with what was done.

    Returns:
        Both files.

    Raises:
        RunFolderError: One cannot be written.
        RecordingError: A point's name cannot be in a CSV header.
    """
    beside = task_json_beside(path)
    recording = conversion.recording
    write_plain_csv(path, recording)
    record = TaskRecord(conversion.base, conversion.provenance, conversion.steps)
    content = task_json(record, recording.frames, recording.rate)
    write_whole(beside, content)
    return path, beside


def task_json_beside(path: Path) -> Path:
    """Where the ``task.json`` of a converted recording lies: ``out.csv`` has ``out.task.json``."""
    return path.with_name(f"{path.stem}.task.json")
