"""Points of bodies that cameras see: what their numbers stand for, frames to a take, the axes of a camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.body_names import BY_COUNT, COCO, HUMAN36M, MEDIAPIPE, SMPL_X
from armdesign.demonstration.files.formats.marker_tables import clean_name, once_each
from armdesign.demonstration.recording import Step, Take, describe_bad_step, first_bad_step, median_seen
from armdesign.errors import RecordingError

_FIRST = {127: SMPL_X, 144: SMPL_X, 75: MEDIAPIPE, 543: MEDIAPIPE, 553: MEDIAPIPE}
"""Number of points to the names of the first: behind them are landmarks of the face, or MediaPipe's hands and face."""
_FIX = "Export the recording again"
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


class Seen(NamedTuple):
    """What was seen in all frames."""

    time: Array  # (T,) in the file's unit; NaN where it is not said
    places: Array  # (T, K, 3)
    confidence: Array | None = None  # (T, K), from 0 to 1
    turns: Array | None = None  # (T, K, 4), x, y, z, w


def names_of(places: Array) -> tuple[str, ...]:
    """Names of K points that come without, by their number, shape (T, K, 3); ``point 1`` and so on where unknown."""
    count = places.shape[1]
    if count == len(COCO):  # as many as in Human3.6M, whose first point is the middle of the second and fifth
        with np.errstate(over="ignore"):  # a damaged file holds any number
            middle = np.linalg.norm(places[:, 0] - 0.5 * (places[:, 1] + places[:, 4]), axis=1)
            width = np.linalg.norm(places[:, 1] - places[:, 4], axis=1)
        return HUMAN36M if median_seen(middle) < _MIDDLE * median_seen(width) else COCO
    known = BY_COUNT.get(count) or _FIRST.get(count, ())
    return (*known, *(f"point {i + 1}" for i in range(len(known), count)))


def take_of_frames(path: Path, form: str, frames: Sequence[Frame], names: Sequence[object] | None) -> Take:
    """Frames as a take.

    Args:
        path: The file.
        form: What the format is called.
        frames: All with as many points.
        names: Of the points; None to take them by their number.

    Raises:
        RecordingError: There are no frames, they do not fit together, or times are there that do not increase.
    """
    if not frames:
        raise RecordingError(f"{path} holds no frame with a body", value=0, fix=_FIX)
    count = len(frames[0].places) if names is None else len(names)
    places = _together([frame.places for frame in frames], (count, 3), path, "positions")
    shown = _together([frame.confidence for frame in frames], (count,), path, "confidences")
    turned = _together([frame.turns for frame in frames], (count, 4), path, "orientations")
    time = np.array([frame.time for frame in frames], dtype=float)
    return take_of_arrays(path, form, Seen(time, np.asarray(places), shown, turned), names)


def take_of_arrays(path: Path, form: str, seen: Seen, names: Sequence[object] | None) -> Take:
    """What was seen in all frames as a take.

    Args:
        path: The file.
        form: What the format is called.
        seen: Times, positions, and what goes with them.
        names: Of the points; None to take them by their number.

    Raises:
        RecordingError: There are no points, a number is infinite, or times are there that do not increase.
    """
    time, places, shown, turned = seen
    for what, values in (("a position", places), ("a confidence", shown), ("an orientation", turned)):
        if values is not None and np.isinf(values).any():
            at = int(np.argmax(np.isinf(values).reshape(len(values), -1).any(axis=1)))
            raise RecordingError(f"{path}, frame {at + 1}: {what} is infinite", value=at + 1, fix=_FIX)
    if not places.size:
        raise RecordingError(f"{path} holds no points", value=places.shape, fix=_FIX)
    timed = not np.isnan(time).any()
    bad = first_bad_step(time) if timed else None
    if bad is not None:
        raise RecordingError(f"{path}, frame {bad + 1}: {describe_bad_step(time, bad)}", value=bad + 1, fix=_FIX)
    said_names = names_of(places) if names is None else names
    chosen, steps = once_each([clean_name(str(name)) or f"point {i + 1}" for i, name in enumerate(said_names)])
    return Take(
        time=time if timed else np.arange(float(len(time))),
        points={name: places[:, i] for i, name in enumerate(chosen)},
        orientations={} if turned is None else {name: turned[:, i] for i, name in enumerate(chosen)},
        source=str(path),
        format=form,
        timed=timed,
        confidence={} if shown is None else {name: shown[:, i] for i, name in enumerate(chosen)},
        steps=tuple(steps),
    )


def _together(values: Sequence[Array | None], shape: tuple[int, ...], path: Path, what: str) -> Array | None:
    """What each frame holds as one array, shape (T, *shape); None where one holds nothing."""
    found = [each for each in values if each is not None]
    if len(found) < len(values):
        return None
    wrong = next((each.shape for each in found if each.shape != shape), None)
    if wrong is not None:
        message = f"{path}: {what} of shape {wrong} for {shape[0]} points"
        raise RecordingError(message, value=wrong, allowed=str(shape), fix=_FIX)
    return np.stack(found)


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
