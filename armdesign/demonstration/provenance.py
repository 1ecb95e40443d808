"""Where a task comes from and what was done on the way, and the ``task.json`` that keeps it beside the task."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from armdesign._version import __version__
from armdesign.demonstration import Selection, Step
from armdesign.demonstration.cleaning.cleaning import CLEANING_ENTRIES
from armdesign.demonstration.files.stretch import part_of
from armdesign.errors import RunFolderError
from armdesign.settings.sections import Task as TaskSettings

SCHEMA_VERSION = 1


@dataclass(frozen=True)
class Source:
    """A file that a recording was read from."""

    path: str | None
    sha256: str | None = None  # digest of its content; None where it cannot be read


@dataclass(frozen=True)
class Provenance:
    """Where a task comes from."""

    sources: tuple[Source, ...] = ()
    format: str = ""
    units: str | None = None  # unit of length it was read in
    up: str | None = None  # axis that pointed up
    mirror: bool = False  # whether left and right were exchanged
    base: str = ""  # expression for the base
    points: tuple[str, ...] = ()  # expressions for the points
    orientation: str | None = None  # expression for the orientation; None for none
    base_mode: str = "shoulder"  # ``shoulder`` or ``fixed``
    settings: Mapping[str, Any] = field(default_factory=dict)  # the other task settings that were used


def provenance_of(chosen: Selection, settings: TaskSettings) -> Provenance:
    """Where points selected from a recording come from.

    Args:
        chosen: The points, from ``resolve``.
        settings: The settings they were chosen and are cleaned by.
    """
    about = chosen.recording.about
    named = {step.name: step.details for step in about.steps}
    paths = list(settings.files.values()) or ([settings.recording] if settings.recording else [])
    names = (*CLEANING_ENTRIES, "file_rate", "time_unit", "quaternions")
    return Provenance(
        sources=tuple(Source(path, fingerprint(path)) for path in paths),
        format=about.format,
        units=str(named.get("units", {}).get("unit", settings.units or "m")),
        up=str(named.get("up", {}).get("axis", settings.up or "z")),
        mirror=settings.mirror,
        base=chosen.expressions.get(chosen.base, chosen.base),
        points=tuple(chosen.expressions.get(name, name) for name in chosen.points),
        orientation=None if chosen.orientation is None else chosen.expressions.get(chosen.orientation),
        base_mode=settings.base_mode,
        settings={name: getattr(settings, name) for name in names if getattr(settings, name) is not None},
    )


def fingerprint(path: str | None) -> str | None:
    """SHA-256 of a file, by which a result is known to belong to it; None where it cannot be read."""
    if path is None:
        return None
    try:
        digest = hashlib.sha256()
        with Path(part_of(path).file).open("rb") as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
        return digest.hexdigest()
    except OSError:
        return None


class TaskRecord(NamedTuple):
    """What a ``task.json`` says of the task beside it."""

    base: str  # name of the base
    provenance: Provenance  # where the task comes from
    steps: tuple[Step, ...]  # what was found and done
    # where its points count from in the room, x, y, z [m]; None where that moves with the base point
    origin: tuple[float, ...] | None = None
    shoulder: bool = False  # whether its first point is the base's own path


def task_json(record: TaskRecord, frames: int, rate: float) -> str:
    """The content of a ``task.json``, of a run folder or beside a converted recording.

    Args:
        record: What is said of the task.
        frames: Number of frames T.
        rate: Frames per second, from the median step [1/s].
    """
    room = {"origin": record.origin, "base_is_first_point": record.shoulder} if record.origin is not None else {}
    content = {
        "schema_version": SCHEMA_VERSION,
        "armdesign_version": __version__,
        "base_name": record.base,
        "frames": frames,
        "rate": rate,
        **room,
        **asdict(record.provenance),
        "steps": [asdict(step) for step in record.steps],
    }
    return json.dumps(as_json(content), indent=2, allow_nan=False) + "\n"


def read_task_json(path: Path) -> TaskRecord:
    """What a ``task.json`` says of the task beside it.

    Raises:
        RunFolderError: It is missing or damaged.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
        entries = {name: content[name] for name in Provenance.__dataclass_fields__}
        entries["sources"] = tuple(Source(**source) for source in content["sources"])
        entries["points"] = tuple(content["points"])
        steps = tuple(Step(str(s["name"]), str(s["sentence"]), dict(s["details"])) for s in content["steps"])
        origin = None if content.get("origin") is None else tuple(float(x) for x in content["origin"])
        if origin is not None and (len(origin) != 3 or not np.isfinite(origin).all()):
            raise ValueError(f"the origin is {origin}")
        shoulder = content.get("base_is_first_point", False) is True
        return TaskRecord(str(content["base_name"]), Provenance(**entries), steps, origin, shoulder)
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise RunFolderError(f"{path} is missing or damaged", value=str(path)) from error


def as_json(value: object) -> object:
    """A value as plain JSON: arrays as lists, what is not finite as null, and anything else as text."""
    if isinstance(value, Mapping):
        return {str(key): as_json(entry) for key, entry in value.items()}
    if isinstance(value, np.generic | np.ndarray):
        return as_json(value.tolist())
    if isinstance(value, (list, tuple)):
        return [as_json(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value if value is None or isinstance(value, (str, bool, int, float)) else str(value)
