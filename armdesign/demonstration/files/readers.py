"""Recordings of any known format, recognised by their content, in metres with z up.

A new format is one module in ``formats`` with one entry there.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache, wraps
from pathlib import Path
from typing import NamedTuple, ParamSpec, TypeVar

import numpy as np

from armdesign.demonstration.cleaning.cleaning import crop
from armdesign.demonstration.files import formats
from armdesign.demonstration.files.foreign import foreign_format
from armdesign.demonstration.files.formats.openpose import file_in_folder
from armdesign.demonstration.files.formats.ros_bag import is_bag_folder
from armdesign.demonstration.files.formats.ros_bag import read as read_bag
from armdesign.demonstration.files.hints import Hints, completed
from armdesign.demonstration.files.stretch import part_of
from armdesign.demonstration.files.text_files import describe_binary, read_head
from armdesign.demonstration.points.standard import to_recording
from armdesign.demonstration.points.unseen import hide_unseen
from armdesign.demonstration.recording import Recording, Step, Take
from armdesign.errors import ArmDesignError, RecordingError

MOST_LETTERS = 900
_GARBLED = "\N{REPLACEMENT CHARACTER}"  # for bytes that no encoding knows
_KEPT_AT_END = 400  # which says what to do

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")
_SAME_TIME = 1e-3  # [s] times of several files may differ by rounding
_OF_OTHERS = (".c3d", ".bvh", ".mvnx", ".trc", ".npz", ".npy", ".bag", ".mcap", ".db3", ".json", ".sto", ".mot")
NO_HINTS = Hints()


def legible(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Decorate a function that reads files, so that the sentences of its errors are legible."""

    @wraps(function)
    def reader(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        try:
            return function(*args, **kwargs)
        except ArmDesignError as error:
            error.args = (legible_text(str(error)),)
            raise

    return reader


def legible_text(text: str) -> str:
    """A text without control characters, shortened in its middle where it is too long."""
    printable = "".join(
        letter if letter.isprintable() and letter != _GARBLED else " " if letter.isspace() else "?" for letter in text
    )
    if len(printable) <= MOST_LETTERS:
        return printable
    return f"{printable[: MOST_LETTERS - _KEPT_AT_END - 5]} ... {printable[-_KEPT_AT_END:]}"


@legible
def read_take(path: str | os.PathLike[str], hints: Hints = NO_HINTS) -> Take:
    """Read a file in its own units and axes, whatever the ending of its name.

    Args:
        path: The file.
        hints: What the file does not say.

    Raises:
        RecordingError: The file cannot be read, has none of the known formats, or something in it is wrong.
    """
    source = Path(path)
    if is_bag_folder(source):
        return hide_unseen(completed(read_bag(source), hints), hints.confidence)
    source = file_in_folder(source)
    head = read_head(source)
    all_formats = formats.known_formats()
    form = next((form for form in all_formats if form.matches(head)), None)
    known = [form.name for form in all_formats]
    if form is None or form is formats.FORMATS[-1]:  # plain CSV takes any text
        other = foreign_format(head)
        if other is not None:
            message = f"{source} looks like {other.name}, which is not read"
            raise RecordingError(message, value=other.name, allowed=known, fix=other.way)
    if form is not None:
        try:
            return hide_unseen(completed(form.read(source), hints), hints.confidence)
        except RecordingError:  # what is no table was not meant as one where its name says so
            if form is not formats.FORMATS[-1] or source.suffix.lower() not in _OF_OTHERS:
                raise
    message = f"{source} is not a recording of a known format"
    raise RecordingError(message, value=str(source), allowed=known, fix=describe_binary(head))


@legible
def read_recording(
    path: str | os.PathLike[str],
    *,
    units: str | None = None,
    up: str | None = None,
    mirror: bool = False,
    hints: Hints = NO_HINTS,
) -> Recording:
    """Read a recording into metres with z up, whatever the ending of its name.

    Args:
        path: The file; with ``@1.2:3.4`` behind it the part between these times [s].
        units: Unit of length, ``m``, ``cm``, ``mm``, ``in`` or metres per unit; None for what the file says.
        up: Axis that points up, ``x``, ``y`` or ``z``; None for what the file says.
        mirror: Whether to exchange left and right.
        hints: What the file does not say: its frame rate, its unit of time, the order of its quaternions.

    Returns:
        The recording; what was found and done is in its ``about.steps``. Nothing is filled or filtered.

    Raises:
        RecordingError: The file cannot be read, has none of the known formats, or something in it is wrong.
        SettingsError: ``units`` or ``up`` is none of the values allowed.
    """
    part = part_of(path)
    if part.start is None or part.stop is None:
        return to_recording(read_take(part.file, hints), units=units, up=up, mirror=mirror)
    known = replace(hints, start=None, stop=None)
    recording = _whole(part.file, _stamp(part.file), _Axes(units, up, mirror), known)
    cropped, steps = crop(replace(recording, source=os.fspath(path)), part.start, part.stop)
    return replace(cropped, about=replace(cropped.about, steps=(*cropped.about.steps, *steps)))


class _Axes(NamedTuple):
    """How a recording is put into metres with z up."""

    units: str | None
    up: str | None
    mirror: bool


def _stamp(file: str) -> tuple[int, int] | None:
    """Time and size of a file, by which a change is seen; None where it is not there."""
    try:
        found = os.stat(file)
    except (OSError, ValueError):
        return None
    return found.st_mtime_ns, found.st_size


@lru_cache(maxsize=1)  # the parts of one recording come one after the other
def _whole(file: str, _stamp: tuple[int, int] | None, axes: _Axes, hints: Hints) -> Recording:
    """A recording of which parts are wanted."""
    return to_recording(read_take(file, hints), units=axes.units, up=axes.up, mirror=axes.mirror)


@legible
def read_recordings(
    files: Mapping[str, str | os.PathLike[str]],
    *,
    rate: float | None = None,
    units: str | None = None,
    up: str | None = None,
    mirror: bool = False,
    hints: Hints = NO_HINTS,
) -> Recording:
    """Read several files with one body or point each as one recording.

    Args:
        files: Name of the point to its file.
        rate: Frames per second, for files without times [1/s]; None where the files have times.
        units: Unit of length of all files, ``m``, ``cm``, ``mm``, ``in`` or metres per unit; None for what they say.
        up: Axis that points up in all files, ``x``, ``y`` or ``z``; None for what they say.
        mirror: Whether to exchange left and right.
        hints: What else the files do not say.

    Raises:
        RecordingError: A file cannot be read or does not hold exactly one body, or the files differ in their length,
            times or format.
        SettingsError: ``units`` or ``up`` is none of the values allowed.
    """
    if not files:
        raise RecordingError("no file is named", fix="Name one file for each point")
    known = hints if rate is None else replace(hints, rate=rate)
    takes = {name: _one_point(read_take(file, known), name) for name, file in files.items()}
    return to_recording(hide_unseen(_joined(takes)), units=units, up=up, mirror=mirror)


def _one_point(take: Take, name: str) -> Take:
    """A take of nothing but its one point or its one body, under another name."""
    inside = list(take.points) if len(take.points) == 1 else [each for each in take.points if each in take.orientations]
    if len(inside) != 1:
        message = f"{take.source} holds {len(take.points)} points, but is to give the one point '{name}'"
        fix = "Name files of one body each, or this file alone"
        raise RecordingError(message, value=list(take.points)[:30], fix=fix)
    points = {name: take.points[inside[0]]}
    turns = {name: take.orientations[inside[0]]} if inside[0] in take.orientations else {}
    return replace(take, points=points, orientations=turns, bodies={})


def _joined(takes: Mapping[str, Take]) -> Take:
    """Takes of the same length, times and axes as one."""
    first = next(iter(takes.values()))
    for take in takes.values():
        _check_alike(first, take)
    points = {name: values for take in takes.values() for name, values in take.points.items()}
    turns = {name: values for take in takes.values() for name, values in take.orientations.items()}
    sources = {name: take.source for name, take in takes.items()}
    listed = ", ".join(f"{name} from {source}" for name, source in sources.items())
    step = Step("joined", f"Joined {len(takes)} files frame by frame: {listed}.", sources)
    steps = {step.sentence: step for take in takes.values() for step in take.steps}  # each once
    return replace(first, points=points, orientations=turns, steps=(step, *steps.values()))


def _check_alike(first: Take, other: Take) -> None:
    """Turn away takes that cannot be joined frame by frame."""
    both, fix = f"{first.source} and {other.source}", "Export the same stretch of one take into all files"
    if len(first.time) != len(other.time):
        message = f"{both} have {len(first.time)} and {len(other.time)} frames"
        raise RecordingError(message, value=len(other.time), fix=fix)
    apart = np.abs(first.time - other.time)
    if len(apart) and apart.max() > _SAME_TIME:
        frame = int(np.argmax(apart > _SAME_TIME))
        times = f"{first.time[frame]:.6g} s and {other.time[frame]:.6g} s"
        message = f"{both} differ in their times, first in frame {frame + 1} ({times})"
        raise RecordingError(message, value=frame, fix=fix)
    for what, ours, theirs in (("unit of length", first.units, other.units), ("up axis", first.up, other.up)):
        if ours != theirs:
            message = f"{both} differ in their {what} ({ours or 'not said'} and {theirs or 'not said'})"
            raise RecordingError(message, value=theirs, fix="Export all files alike")
