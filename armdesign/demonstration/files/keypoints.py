"""Points of bodies that cameras see: what their numbers stand for, frames to a take, the axes of a camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.body_names import BY_COUNT, COCO, HUMAN36M, SMPL_X
from armdesign.demonstration.files.formats.marker_tables import clean_name, once_each
from armdesign.demonstration.recording import Step, Take, first_bad_step, median_seen
from armdesign.errors import RecordingError

_MIDDLE = 0.05  # of the hips' width; a point that is the middle of the hips
_CENTRED = 0.02  # [m] from the middle of the hips to the origin
CAMERA_UP = "-y"
"""Up in a camera's axes: x right, y down, z ahead."""


class Frame(NamedTuple):
    """What was seen in one frame."""

    time: float  # in the file's unit; NaN where it is not said
    places: Array  # (K, 3)
    confidence: Array | None = None  # (K,), from 0 to 1
    turns: Array | None = None  # (K, 4), x, y, z, w


def names_of(places: Array) -> tuple[str, ...]:
    """Names of K points that come without, by their number, shape (T, K, 3); ``point 1`` and so on where unknown."""
    count = places.shape[1]
    if count == len(COCO):  # as many as in Human3.6M, whose first point is the middle of the second and fifth
        with np.errstate(over="ignore"):  # a damaged file holds any number
            middle = np.linalg.norm(places[:, 0] - 0.5 * (places[:, 1] + places[:, 4]), axis=1)
            width = np.linalg.norm(places[:, 1] - places[:, 4], axis=1)
        return HUMAN36M if median_seen(middle) < _MIDDLE * median_seen(width) else COCO
    if count > len(SMPL_X) and count in (127, 144):  # SMPL-X with landmarks of the face behind the joints
        return (*SMPL_X, *(f"point {i + 1}" for i in range(len(SMPL_X), count)))
    return BY_COUNT.get(count) or tuple(f"point {i + 1}" for i in range(count))


def take_of_frames(
    path: Path, form: str, frames: Sequence[Frame], names: Sequence[object] | None, **said: object
) -> Take:
    """Frames as a take.

    Args:
        path: The file.
        form: What the format is called.
        frames: All with as many points.
        names: Of the points; None to take them by their number.
        said: What else a ``Take`` says, such as ``units``.

    Raises:
        RecordingError: There are no frames, they do not fit together, or times are there that do not increase.
    """
    fix = "Export the recording again"
    if not frames:
        raise RecordingError(f"{path} holds no frame with a body", value=0, fix=fix)
    count = len(frames[0].places) if names is None else len(names)
    wrong = next((i for i, frame in enumerate(frames) if frame.places.shape != (count, 3)), None)
    if wrong is not None or not count:
        found = frames[wrong or 0].places.shape
        message = f"{path}, frame {(wrong or 0) + 1}: positions of shape {found} for {count} points"
        raise RecordingError(message, value=found, allowed=f"({count}, 3)", fix=fix)
    places = np.stack([frame.places for frame in frames])
    if np.isinf(places).any():
        at = int(np.argmax(np.isinf(places).any(axis=(1, 2))))
        raise RecordingError(f"{path}, frame {at + 1}: a position is infinite", value=at + 1, fix=fix)
    time = np.array([frame.time for frame in frames], dtype=float)
    timed = not np.isnan(time).any()
    bad = first_bad_step(time) if timed else None
    if bad is not None:
        message = (
            f"{path}, frame {bad + 1}: the time does not increase, {time[bad]:.12g} comes after {time[bad - 1]:.12g}"
        )
        raise RecordingError(message, value=float(time[bad]), fix=fix)
    said_names = names_of(places) if names is None else names
    chosen, steps = once_each([clean_name(str(name)) or f"point {i + 1}" for i, name in enumerate(said_names)])
    shown = _together([frame.confidence for frame in frames], (count,), path, "confidences")
    turned = _together([frame.turns for frame in frames], (count, 4), path, "orientations")
    return Take(
        time=time if timed else np.arange(float(len(frames))),
        points={name: places[:, i] for i, name in enumerate(chosen)},
        orientations={} if turned is None else {name: turned[:, i] for i, name in enumerate(chosen)},
        source=str(path),
        format=form,
        timed=timed,
        confidence={} if shown is None else {name: shown[:, i] for i, name in enumerate(chosen)},
        steps=tuple(steps),
        **said,  # type: ignore[arg-type]
    )


def _together(values: Sequence[Array | None], shape: tuple[int, ...], path: Path, what: str) -> Array | None:
    """What each frame holds as one array, shape (T, *shape); None where one holds nothing."""
    found = [each for each in values if each is not None]
    if len(found) < len(values):
        return None
    wrong = next((each.shape for each in found if each.shape != shape), None)
    if wrong is not None:
        message = f"{path}: {what} of shape {wrong} for {shape[0]} points"
        raise RecordingError(message, value=wrong, allowed=str(shape), fix="Export the recording again")
    together = np.stack(found)
    if np.isinf(together).any():
        raise RecordingError(f"{path}: {what} are infinite", fix="Export the recording again")
    return together


def world_landmarks(take: Take) -> Take:
    """MediaPipe's world landmarks, which are metres from the middle of the hips.

    Raises:
        RecordingError: They are places in the image, from 0 to 1.
    """
    hips = [take.points[name] for name in take.points if name.lower() in ("left_hip", "right_hip")]
    every = np.concatenate([values[:, :2] for values in take.points.values()])
    if len(hips) == 2:
        with np.errstate(over="ignore"):  # a damaged file holds any number
            in_image = median_seen(np.linalg.norm(0.5 * (hips[0] + hips[1]), axis=1)) > _CENTRED
    else:
        in_image = bool((every[np.isfinite(every).all(axis=1)] >= 0).all())
    if in_image:
        message = f"{take.source} holds landmarks in the image (0 to 1), not places in the room"
        raise RecordingError(message, fix="Export MediaPipe's world landmarks (pose_world_landmarks), in metres")
    sentence = (
        "The points count from the middle of the hips in every frame, so the walk through the room is not in the file. "
        "With --base-mode shoulder, the default, that does not matter; --base-mode fixed takes the hips as standing."
    )
    return replace(take, units="m", steps=(*take.steps, Step("hips", sentence)))
