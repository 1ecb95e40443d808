"""Landmarks of MediaPipe Pose as scripts write them: CSV with a column a coordinate or a line a landmark, or JSON.

    frame,nose_x,nose_y,nose_z,nose_visibility,left_eye_inner_x,...        wide; x0,y0,z0,v0,... and landmark_0_x, too
    frame,landmark,x,y,z,visibility                                       long, a line a landmark
    [{"timestamp": 0.033, "pose_world_landmarks": [{"x": 0.1, "y": -0.5, "z": 0.2, "visibility": 0.99}, ...]}, ...]

World landmarks are read: metres from the middle of the hips, y down. A landmark with a low visibility counts as not
seen. Landmarks in the image are no places and are refused.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from armdesign.demonstration.files.body_names import MEDIAPIPE
from armdesign.demonstration.files.formats import long_csv
from armdesign.demonstration.files.json_text import json_head, number, numbers, objects_with, read_json
from armdesign.demonstration.files.keypoints import CAMERA_UP, Frame, take_of_frames, world_landmarks
from armdesign.demonstration.files.named_columns import Columns, header_of, read_columns
from armdesign.demonstration.files.text_files import read_head
from armdesign.demonstration.recording import Take
from armdesign.errors import RecordingError

_WORLD = ("pose_world_landmarks", "poseWorldLandmarks", "world_landmarks", "worldLandmarks")
_ANY = (*_WORLD, "pose_landmarks", "poseLandmarks", "landmarks")
_TIMES = {"timestamp_ms": 1e-3, "time_ms": 1e-3, "timestampMs": 1e-3, "timestamp": 1.0, "time": 1.0, "t": 1.0}
_NUMBER = re.compile(r"(?:(?:pose[ _]?)?(?:world[ _]?)?(?:landmarks?|lm|point|kp)[ _]?)?(\d{1,2})", re.IGNORECASE)
_FORM = "MediaPipe landmarks"


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes holds landmarks of MediaPipe with their visibility."""
    if json_head(head, *_ANY):
        return True
    columns = header_of(head)
    if "visibility" in (name.lower() for name in columns.names):
        return long_csv.matches(head)
    return _is_wide(columns)


def read(path: Path) -> Take:
    """Read MediaPipe's world landmarks."""
    head = read_head(path)
    if json_head(head, *_ANY):
        take = _read_json(path)
    elif long_csv.matches(head):
        take = long_csv.read_long(path, _FORM, _name)
    else:
        first = min((int(m[1]) for name in header_of(head).points if (m := _NUMBER.fullmatch(name))), default=0)
        take = read_columns(path, _FORM, lambda name: _name(name, first))
    return replace(world_landmarks(take), up=CAMERA_UP)


def _is_wide(columns: Columns) -> bool:
    """Whether most points have a visibility and a name or number of MediaPipe."""
    if "time" in (name.lower() for name in columns.names) and not columns.confidence:
        return False
    known = [name for name in columns.points if _name(name).lower() in MEDIAPIPE and name in columns.confidence]
    return len(known) >= 3 and 2 * len(known) > len(columns.points)


def _name(name: str, first: int = 0) -> str:
    """A landmark's name for its number in a header, which counts from ``first``."""
    match = _NUMBER.fullmatch(name)
    if match is None:
        plain = name.lower().removeprefix("pose_")
        return plain if plain in MEDIAPIPE else name
    index = int(match[1]) - min(first, 1)
    return MEDIAPIPE[index] if 0 <= index < len(MEDIAPIPE) else name


def _read_json(path: Path) -> Take:
    """Frames of a JSON file."""
    content = read_json(path)
    found = next(((key, list(each)) for key in _ANY if (each := list(objects_with(content, key)))), None)
    if found is None:
        raise RecordingError(f"{path} holds no landmarks", allowed=_ANY, fix="Export the landmarks of every frame")
    key, objects = found
    frames = [frame for each in objects if (frame := _frame(each, key, path)) is not None]
    return take_of_frames(path, _FORM, frames, MEDIAPIPE)


def _frame(each: Mapping[str, Any], key: str, path: Path) -> Frame | None:
    """One frame; None where it holds a list of frames itself."""
    landmarks = each[key]
    if isinstance(landmarks, Mapping):  # by name
        landmarks = [landmarks.get(name, landmarks.get(name.upper(), {})) for name in MEDIAPIPE]
    while (  # lists of people, each of landmarks: the first
        isinstance(landmarks, list)
        and landmarks
        and isinstance(landmarks[0], list)
        and landmarks[0]
        and isinstance(landmarks[0][0], (list, Mapping))
    ):
        landmarks = landmarks[0]
    known = ((number(each[name]) * factor) for name, factor in _TIMES.items() if name in each)
    time = next(known, float("nan"))
    if not landmarks:  # nobody was seen
        empty = np.full((len(MEDIAPIPE), 3), np.nan)
        return Frame(time, empty, np.full(len(MEDIAPIPE), np.nan))
    is_row = isinstance(landmarks, list) and isinstance(landmarks[0], list)
    if is_row and len(landmarks[0]) == 4:
        table = numbers(landmarks, 4, path, "the landmarks")
        return Frame(time, table[:, :3], table[:, 3])
    places = numbers(landmarks, 3, path, "the landmarks")
    seen = [number(row.get("visibility")) if isinstance(row, Mapping) else float("nan") for row in landmarks]
    return Frame(time, places, np.array(seen))
