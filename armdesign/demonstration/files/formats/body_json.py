"""JSON files of depth cameras: body tracking of the ZED and of the Azure Kinect.

    {"0": {"timestamp": 1700000000000000000, "body_list": [{"id": 0, "keypoint": [[x, y, z], ...],
     "keypoint_confidence": [...]}]}, ...}                                                               ZED
    {"bone_list": [...], "frames": [{"bodies": [{"body_id": 1, "joint_orientations": [[w, x, y, z], ...],
     "joint_positions": [[x, y, z], ...]}], "timestamp_usec": 100, ...}], "joint_names": [...]}          Azure Kinect

The Kinect writes millimetres in its camera's axes, y down. The ZED writes what it was told to: its unit is taken from
the arm's length, its up axis from what stands above what. Of several bodies the one that is there most is taken.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from armdesign.demonstration.files.body_names import AZURE_KINECT, BODY_18, ZED_34, ZED_38
from armdesign.demonstration.files.json_text import json_head, number, numbers, objects_with, read_json
from armdesign.demonstration.files.keypoints import CAMERA_UP, Frame, take_of_frames
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError


class _Layout(NamedTuple):
    """What the parts of a file are called."""

    form: str
    bodies: str
    number: str
    places: str
    confidence: tuple[str, ...]
    most: float  # the largest confidence
    turns: str  # quaternions; empty where they are not in the room's axes
    times: Mapping[str, float]  # keys of times, with seconds per unit


_ZED = _Layout(
    form="body tracking JSON of a ZED",
    bodies="body_list",
    number="id",
    places="keypoint",
    confidence=("keypoint_confidence",),
    most=100.0,
    turns="",
    times={"timestamp": 1e-9, "timestamp_ns": 1e-9, "ts": 1e-9},
)
_KINECT = _Layout(
    form="body tracking JSON of an Azure Kinect",
    bodies="bodies",
    number="body_id",
    places="joint_positions",
    confidence=("joint_confidences", "confidence_levels"),
    most=3.0,
    turns="joint_orientations",
    times={"timestamp_usec": 1e-6, "timestamp_us": 1e-6},
)


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes holds bodies of a ZED or an Azure Kinect."""
    return json_head(head, "body_list", "bone_list", "joint_positions")


def read(path: Path) -> Take:
    """Read tracked bodies."""
    content = read_json(path)
    is_zed = next(objects_with(content, _ZED.bodies), None) is not None
    layout = _ZED if is_zed else _KINECT
    found = [each for each in objects_with(content, layout.bodies) if isinstance(each[layout.bodies], list)]
    bodies = [[body for body in each[layout.bodies] if isinstance(body, Mapping)] for each in found]
    seen = Counter(str(body.get(layout.number)) for each in bodies for body in each if body.get(layout.places))
    if not seen:
        raise RecordingError(f"{path} holds no body with '{layout.places}'", value=0, fix="Export the recording again")
    chosen = seen.most_common(1)[0][0]
    bodies_of = [[body for body in each if str(body.get(layout.number)) == chosen] for each in bodies]
    first = next(body[0][layout.places] for body in bodies_of if body and body[0].get(layout.places))
    count = len(numbers(first, 3, path, f"'{layout.places}'"))
    frames = [
        _frame(body, time, layout, path, count)
        for body, time in zip(bodies_of, _times(found, layout.times), strict=True)
    ]
    take = take_of_frames(path, layout.form, frames, _names(content, count, layout))
    if is_zed:
        largest = max(float(np.nanmax(c, initial=0.0)) for c in take.confidence.values()) if take.confidence else 0.0
        if largest > 1.0:  # other versions write 0 to 1
            take = replace(take, confidence={name: c / layout.most for name, c in take.confidence.items()})
    else:
        take = replace(take, units="mm", up=CAMERA_UP)
    if len(seen) == 1:
        return take
    listed = f"body {chosen} was taken, which is in {seen[chosen]} of {len(frames)} frames"
    sentence = f"The file holds {len(seen)} bodies; {listed}."
    return replace(take, steps=(*take.steps, Step("people", sentence, {"people": len(seen), "taken": chosen})))


def _frame(bodies: list[Mapping[str, Any]], time: float, layout: _Layout, path: Path, count: int) -> Frame:
    """One frame, not seen where the body is not in it."""
    body = bodies[0] if bodies and bodies[0].get(layout.places) else None
    if body is None:
        turns = np.full((count, 4), np.nan) if layout.turns else None
        return Frame(time, np.full((count, 3), np.nan), np.full(count, np.nan), turns)
    places = numbers(body[layout.places], 3, path, f"'{layout.places}'")
    levels = next((body[key] for key in layout.confidence if isinstance(body.get(key), list)), None)
    scale = 1.0 if layout is _ZED else layout.most
    shown = np.full(count, np.nan) if levels is None else np.array([number(level) for level in levels]) / scale
    turns = None
    if layout.turns and body.get(layout.turns):
        turns = numbers(body[layout.turns], 4, path, f"'{layout.turns}'")[:, [1, 2, 3, 0]]
    elif layout.turns:
        turns = np.full((count, 4), np.nan)
    return Frame(time, places, shown, turns)


def _times(frames: list[Mapping[str, Any]], keys: Mapping[str, float]) -> list[float]:
    """Times of frames from the first on [s]; NaN where the file does not say them."""
    for key, factor in keys.items():
        raw: list[Any] = [frame.get(key) for frame in frames]
        if all(isinstance(each, int) for each in raw):  # nanoseconds since 1970 are more than a float holds
            return [number(each - raw[0]) * factor for each in raw]
        if all(key in frame for frame in frames):
            return [number(each) * factor for each in raw]
    return [float("nan")] * len(frames)


def _names(content: object, count: int, layout: _Layout) -> Sequence[object] | None:
    """Names of the points: those in the file, or those of the camera's skeleton."""
    for each in objects_with(content, "joint_names"):
        if isinstance(each["joint_names"], list) and len(each["joint_names"]) == count:
            return list(each["joint_names"])
    known = (AZURE_KINECT,) if layout is _KINECT else (BODY_18, ZED_34, ZED_38)
    return next((names for names in known if len(names) == count), None)
