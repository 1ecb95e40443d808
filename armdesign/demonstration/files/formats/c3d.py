"""C3D files: labelled points, and poses of segments in a ROTATION group.

``c3d_layout`` reads header and parameters and holds every count and pointer against the file's size; only then are
the data read, so that no file makes the program ask for more memory than its length explains. A point is four numbers:
x, y, z and a residual that is negative where the point was not seen. A rotation is a 4 x 4 matrix, column by column,
and a residual.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.formats.c3d_layout import (
    BLOCK,
    MAGIC,
    ORDERS,
    ROTATION_NUMBERS,
    C3DLayout,
    floats_of,
    read_layout,
)
from armdesign.demonstration.files.formats.marker_tables import UNITS, listed, once_each
from armdesign.demonstration.files.quaternions import are_rotations, from_matrices
from armdesign.demonstration.files.text_files import unreadable
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError

_MODEL_OUTPUTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
_UP = {"X": "x", "+X": "x", "Y": "y", "+Y": "y", "Z": "z", "+Z": "z"}
_POSE_ENDING = "_4X4"  # of segments, as Theia3D writes them

_PIECE = 1 << 24  # [bytes] read at a time, so that the file is never in memory as a whole


def matches(head: bytes) -> bool:
    """Whether a file begins like C3D: the block of the parameters, 0x50, and a header that is not text."""
    return len(head) > 1 and head[0] > 0 and head[1] == MAGIC and b"\0" in head[:BLOCK]


def read(path: Path) -> Take:
    """Read a C3D file."""
    layout = read_layout(path)
    shape = (layout.frames, layout.points, layout.analog)
    sets = (layout.frames, layout.rotations, layout.ratio)
    try:
        with path.open("rb") as stream:
            positions = read_positions(stream, layout.start, shape, layout.processor, layout.scale)
            poses = read_poses(stream, layout.rotation_start, sets, layout.processor)
    except (OSError, EOFError) as error:
        raise unreadable(path, error) from error
    except MemoryError as error:
        fix = "Export a shorter stretch, or only the points that are needed"
        raise RecordingError(f"{path} takes more memory than there is", fix=fix) from error
    steps = [Step("header", note) for note in layout.notes]
    points = _points(path, layout, positions, steps)
    orientations = _poses(path, layout, poses, points, steps)
    if not points and not orientations:
        raise RecordingError(f"{path} holds model outputs only, no positions", fix="Export the markers' trajectories")
    return Take(
        time=np.arange(layout.frames) / layout.rate,
        points=points,
        orientations=orientations,
        source=str(path),
        format="C3D",
        units=_units(layout, steps),
        up=_up(layout, steps),
        rate=layout.rate,
        steps=tuple(steps),
    )


def _points(path: Path, layout: C3DLayout, positions: Array, steps: list[Step]) -> dict[str, Array]:
    """Positions by label, model outputs left out."""
    labels = _labels(layout, steps)
    outputs = {name for kind in _MODEL_OUTPUTS for name in layout.parameters.texts("POINT", kind)}
    left_out = [label for label in labels if label in outputs]
    if left_out:
        sentence = f"Left out {len(left_out)} model outputs, which are not positions: {listed(left_out)}."
        steps.append(Step("model outputs", sentence, {"names": left_out}))
    names, renamed = once_each(labels)
    steps += renamed
    named = zip(names, labels, positions.transpose(1, 0, 2), strict=True)
    points = {name: values for name, label, values in named if label not in outputs}
    for name, values in points.items():
        if np.isinf(values).any():
            frame = int(np.argmax(np.isinf(values).any(axis=1)))
            raise RecordingError(f"{path}: point '{name}' is infinite in frame {frame + 1}", fix="Export it again")
    return points


def _labels(layout: C3DLayout, steps: list[Step]) -> list[str]:
    """One label for each point, as in the file; ``unlabeled 7`` for the seventh point where there is none."""
    given = layout.parameters.texts("POINT", "LABELS")[: layout.points]
    labels = [given[i] if i < len(given) and given[i] else f"unlabeled {i + 1}" for i in range(layout.points)]
    count = sum(not label for label in given) + layout.points - len(given)
    if count:
        steps.append(Step("labels", f"{count} of {layout.points} points have no label.", {"unlabeled": count}))
    return labels


def _poses(
    path: Path, layout: C3DLayout, poses: Array, points: dict[str, Array], steps: list[Step]
) -> dict[str, Array]:
    """Orientations by segment; the segments' origins are added to the points where no marker has the name."""
    given = layout.parameters.texts("ROTATION", "LABELS")
    labels = [given[i] if i < len(given) and given[i] else f"segment {i + 1}" for i in range(layout.rotations)]
    names, renamed = once_each(
        [label[:-4] or label if label.upper().endswith(_POSE_ENDING) else label for label in labels]
    )
    steps += renamed
    if layout.ratio > 1:
        sentence = f"Rotations come {layout.ratio} times a frame; the first of each frame is taken."
        steps.append(Step("rotations", sentence, {"ratio": layout.ratio}))
    orientations = {}
    for index, name in enumerate(names):
        pose = _whole(poses[:, index], name, steps)
        orientations[name] = from_matrices(pose[:, :3, :3])
        points.setdefault(name, pose[:, :3, 3].copy())
    return orientations


def _whole(pose: Array, name: str, steps: list[Step]) -> Array:
    """A segment's poses with those missing altogether whose matrix is not a rotation, shape (T, 4, 4)."""
    turn = pose[:, :3, :3]
    good = are_rotations(turn) & np.isfinite(pose[:, :3, 3]).all(axis=1)
    seen = ~np.isnan(pose[:, :3]).any(axis=(1, 2)) & (turn != 0).any(axis=(1, 2))
    if (seen & ~good).any():
        count = int((seen & ~good).sum())
        sentence = f"{count} poses of segment '{name}' are no rotation and were taken as missing."
        steps.append(Step("rotations", sentence, {"segment": name, "count": count}))
    return np.where(good[:, None, None], pose, np.nan)


def _units(layout: C3DLayout, steps: list[Step]) -> str | None:
    """What POINT:UNITS says, if it is a length."""
    stated = next((text for text in layout.parameters.texts("POINT", "UNITS") if text), "")
    units = UNITS.get(stated.lower())
    if stated and units is None:
        steps.append(Step("units", f"The file states its units as '{stated[:40]}', which is no known length."))
    return units


def _up(layout: C3DLayout, steps: list[Step]) -> str | None:
    """The axis that points up on the screen on which the capture software shows the points, POINT:Y_SCREEN."""
    stated = next((text for text in layout.parameters.texts("POINT", "Y_SCREEN") if text), "")
    up = _UP.get(stated.upper())
    if stated and up is None:
        steps.append(Step("up", f"The file states the upward axis as '{stated[:40]}', which is not taken over."))
    return up


def read_positions(stream: BinaryIO, start: int, shape: tuple[int, int, int], processor: int, scale: float) -> Array:
    """Positions of all points, shape (T, n, 3) [file's units]; NaN = not seen.

    Args:
        stream: The file.
        start: Where the data begin [bytes].
        shape: Frames T, points n, and analog samples that follow the points of each frame.
        processor: ``INTEL``, ``DEC`` or ``MIPS``.
        scale: Factor of integers; negative where the data are floats.
    """
    frames, points, analog = shape
    result = np.empty((frames, points, 3))
    width = 4 if scale < 0 else 2
    for rows, raw in _pieces(stream, start, frames, (4 * points + analog) * width):
        values = floats_of(raw, processor) if scale < 0 else np.frombuffer(raw, f"{ORDERS[processor]}i2")
        numbers = values.reshape(-1, 4 * points + analog)[:, : 4 * points].reshape(-1, points, 4)
        with np.errstate(invalid="ignore"):  # signalling NaNs of damaged files
            result[rows] = numbers[..., :3] if scale < 0 else numbers[..., :3] * scale
            result[rows][numbers[..., 3] < 0] = np.nan
    return result


def read_poses(stream: BinaryIO, start: int, shape: tuple[int, int, int], processor: int) -> Array:
    """The first of each frame's sets of matrices, shape (T, k, 4, 4).

    Args:
        stream: The file.
        start: Where the matrices begin [bytes].
        shape: Frames T, matrices k in a set, and sets in a frame.
        processor: ``INTEL``, ``DEC`` or ``MIPS``.
    """
    frames, matrices, sets = shape
    result = np.empty((frames, matrices, 4, 4))
    for rows, raw in _pieces(stream, start, frames, 4 * ROTATION_NUMBERS * matrices * sets):
        numbers = floats_of(raw, processor).reshape(-1, sets, matrices, ROTATION_NUMBERS)[:, 0, :, :16]
        with np.errstate(invalid="ignore"):
            result[rows] = numbers.reshape(-1, matrices, 4, 4).transpose(0, 1, 3, 2)
    return result


def _pieces(stream: BinaryIO, start: int, frames: int, size: int) -> Iterator[tuple[slice, bytes]]:
    """Frames and their bytes, many frames at a time, each of ``size`` bytes; nothing where that is 0."""
    stream.seek(start)
    each = max(1, _PIECE // size) if size else 1
    for first in range(0, frames if size else 0, each):
        rows = slice(first, min(first + each, frames))
        raw = stream.read((rows.stop - first) * size)
        if len(raw) < (rows.stop - first) * size:
            raise EOFError("the file became shorter while it was read")
        yield rows, raw
