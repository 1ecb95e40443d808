"""C3D files: labelled points, and poses of segments in a ROTATION group.

Header and parameters are read and checked here (``c3d_layout``), the numbers by ezc3d in a process of its own
(``c3d_child``), because no file may bring this one down.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.formats import c3d_child
from armdesign.demonstration.files.formats.c3d_layout import BLOCK, MAGIC, C3DLayout, read_layout
from armdesign.demonstration.files.quaternions import from_matrices
from armdesign.demonstration.files.sniff import unreadable
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError

_UNITS = {"m": "m", "cm": "cm", "mm": "mm", "in": "in"}
_UNITS |= {"meter": "m", "meters": "m", "metre": "m", "metres": "m", "inch": "in", "inches": "in"}
_UNITS |= {"millimeter": "mm", "millimeters": "mm", "millimetre": "mm", "millimetres": "mm"}
_UNITS |= {"centimeter": "cm", "centimeters": "cm", "centimetre": "cm", "centimetres": "cm"}
_MODEL_OUTPUTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")
_UP = {"X": "x", "+X": "x", "Y": "y", "+Y": "y", "Z": "z", "+Z": "z"}
_MEMORY = 2 << 30  # [bytes] for the child, which takes a tenth of it for the largest recordings
_SHORTEST = 120.0  # [s] for the child, plus
_PER_VALUE = 2e-5  # [s] for each point or rotation in each frame; one microsecond is usual
_POSE_ENDING = "_4X4"
_SKEW = 1e-2  # a rotation's columns are unit and orthogonal to this much
_SHOWN = 5


@dataclass(frozen=True, eq=False)
class _Numbers:
    points: Array  # (T, n, 3) [file's units]
    poses: Array  # (T, k, 4, 4)


def matches(head: bytes) -> bool:
    """Whether a file begins like C3D: the block of the parameters, 0x50, and a header that is not text."""
    return len(head) > 1 and head[0] > 0 and head[1] == MAGIC and b"\0" in head[:BLOCK]


def read(path: Path) -> Take:
    """Read a C3D file.

    Args:
        path: The file.

    Raises:
        RecordingError: The file is damaged, holds no points, or cannot be read.
    """
    layout = read_layout(path)
    numbers = _numbers(path, layout)
    steps = [Step("header", note) for note in layout.notes]
    points = _points(path, layout, numbers.points, steps)
    orientations = _poses(path, layout, numbers.poses, points, steps)
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


def _numbers(path: Path, layout: C3DLayout) -> _Numbers:
    """Positions and matrices, read by the child into a temporary folder."""
    try:
        with tempfile.TemporaryDirectory(prefix="armdesign-") as folder:
            _run_child(path, _job(path, layout, folder))
            points = np.fromfile(Path(folder) / "points").reshape(layout.frames, layout.points, 3)
            poses = np.fromfile(Path(folder) / "rotations").reshape(layout.frames, layout.rotations, 4, 4)
    except (OSError, ValueError) as error:
        raise unreadable(path, error) from error
    return _Numbers(points, poses)


def _job(path: Path, layout: C3DLayout, folder: str) -> c3d_child.Job:
    values = layout.frames * (layout.points + layout.rotations)
    return c3d_child.Job(
        path=os.path.abspath(path),
        folder=folder,
        processor=layout.processor,
        scale=layout.scale,
        frames=layout.frames,
        points=layout.points,
        analog=layout.analog,
        start=layout.start,
        rotations=layout.rotations,
        ratio=layout.ratio,
        rotation_start=layout.rotation_start,
        memory=_MEMORY,
        seconds=int(_SHORTEST + _PER_VALUE * values),
    )


def _run_child(path: Path, job: c3d_child.Job) -> None:
    """Have the child do its job, and say what went wrong if it cannot."""
    command = [sys.executable, "-X", "utf8", "-W", "ignore", c3d_child.__file__, json.dumps(job._asdict())]
    one_thread = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    environment = {**os.environ, **one_thread}
    quiet = subprocess.DEVNULL
    try:
        done = subprocess.run(
            command,
            stdin=quiet,
            stdout=quiet,
            stderr=subprocess.PIPE,
            env=environment,
            timeout=job.seconds,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise _failed(path, f"did not finish in {job.seconds} s") from error
    if done.returncode:
        reason = done.stderr.decode("utf-8", "replace").strip().splitlines()[-1:]
        raise _failed(path, f"failed: {reason[0][:300]}" if reason else f"crashed (code {done.returncode})")


def _failed(path: Path, what: str) -> RecordingError:
    fix = "Open it with the software that wrote it and export it again"
    return RecordingError(f"cannot read {path}: the C3D library ezc3d {what}", fix=fix)


def _points(path: Path, layout: C3DLayout, positions: Array, steps: list[Step]) -> dict[str, Array]:
    """Positions by label, model outputs left out."""
    labels = _labels(layout, steps)
    outputs = {name for kind in _MODEL_OUTPUTS for name in layout.texts("POINT", kind)}
    left_out = [label for label in labels if label in outputs]
    if left_out:
        sentence = f"Left out {len(left_out)} model outputs, which are not positions: {_listed(left_out)}."
        steps.append(Step("model outputs", sentence, {"names": left_out}))
    _blank_zeros(positions, steps)
    named = zip(_unique(labels, steps), labels, positions.transpose(1, 0, 2), strict=True)
    points = {name: values for name, label, values in named if label not in outputs}
    for name, values in points.items():
        if np.isinf(values).any():
            frame = int(np.argmax(np.isinf(values).any(axis=1)))
            raise RecordingError(f"{path}: point '{name}' is infinite in frame {frame + 1}", fix="Export it again")
    return points


def _labels(layout: C3DLayout, steps: list[Step]) -> list[str]:
    """One label for each point, as it stands in the file; ``unlabeled 7`` for the seventh point where there is none."""
    given = layout.texts("POINT", "LABELS")[: layout.points]
    labels = [given[i] if i < len(given) and given[i] else f"unlabeled {i + 1}" for i in range(layout.points)]
    count = sum(not label for label in given) + layout.points - len(given)
    if count:
        steps.append(Step("labels", f"{count} of {layout.points} points have no label.", {"unlabeled": count}))
    return labels


def _unique(labels: Sequence[str], steps: list[Step]) -> list[str]:
    """Names used once each: the second of two ``ELB`` becomes ``ELB#2``."""
    taken = set(labels)
    counts: dict[str, int] = {}
    names = []
    for label in labels:
        number = counts.get(label, 0) + 1
        while number > 1 and f"{label}#{number}" in taken:
            number += 1
        counts[label] = number
        names.append(label if number == 1 else f"{label}#{number}")
    renamed = [name for name, label in zip(names, labels, strict=True) if name != label]
    if renamed:
        sentence = f"Labels occur more than once; all but the first of each are numbered: {_listed(renamed)}."
        steps.append(Step("labels", sentence, {"renamed": renamed}))
    return names


def _blank_zeros(positions: Array, steps: list[Step]) -> None:
    """Take a point at exactly (0, 0, 0) as missing: a marker that is not seen, in files that do not say so."""
    zero = (positions == 0).all(axis=2)
    count = int(zero.sum())
    if count:
        positions[zero] = np.nan
        steps.append(Step("zeros", f"Took {count} positions at exactly zero as missing.", {"count": count}))


def _poses(
    path: Path, layout: C3DLayout, poses: Array, points: dict[str, Array], steps: list[Step]
) -> dict[str, Array]:
    """Orientations by segment; the segments' origins are added to the points where no marker has the name."""
    given = layout.texts("ROTATION", "LABELS")
    labels = [given[i] if i < len(given) and given[i] else f"segment {i + 1}" for i in range(layout.rotations)]
    names = _unique([label[:-4] or label if label.upper().endswith(_POSE_ENDING) else label for label in labels], steps)
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
    with np.errstate(all="ignore"):
        skew = np.abs(turn.transpose(0, 2, 1) @ turn - np.eye(3)).max(axis=(1, 2))
        good = (skew < _SKEW) & (np.linalg.det(turn) > 0) & np.isfinite(pose[:, :3, 3]).all(axis=1)
    seen = ~np.isnan(pose[:, :3]).any(axis=(1, 2)) & (turn != 0).any(axis=(1, 2))
    if (seen & ~good).any():
        count = int((seen & ~good).sum())
        sentence = f"{count} poses of segment '{name}' are no rotation and were taken as missing."
        steps.append(Step("rotations", sentence, {"segment": name, "count": count}))
    return np.where(good[:, None, None], pose, np.nan)


def _units(layout: C3DLayout, steps: list[Step]) -> str | None:
    """What POINT:UNITS says, if it is a length."""
    stated = next((text for text in layout.texts("POINT", "UNITS") if text), "")
    units = _UNITS.get(stated.lower())
    if stated and units is None:
        steps.append(Step("units", f"The file states its units as '{stated[:40]}', which is no known length."))
    return units


def _up(layout: C3DLayout, steps: list[Step]) -> str | None:
    """The axis that points up on the screen on which the capture software shows the points, POINT:Y_SCREEN."""
    stated = next((text for text in layout.texts("POINT", "Y_SCREEN") if text), "")
    up = _UP.get(stated.upper())
    if stated and up is None:
        steps.append(Step("up", f"The file states the upward axis as '{stated[:40]}', which is not taken over."))
    return up


def _listed(names: Sequence[str]) -> str:
    """The first few of some names."""
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return ", ".join(f"'{name[:40]}'" for name in names[:_SHOWN]) + more
