"""JSON files of keypoints in the COCO manner: MMPose, AlphaPose, Halpe, and scripts that write 3D results alike.

    [{"image_id": 0, "keypoints": [x, y, z, score, ...], "score": 0.9}, ...]
    {"meta_info": {"keypoint_id2name": {...}}, "instance_info": [{"frame_id": 0, "instances": [{"keypoints": [[x, y, z],
     ...], "keypoint_scores": [...]}]}, ...]}

Points without names have those of their number: 17 of COCO or Human3.6M, 26 of Halpe. Of several people in a frame the
first is taken. Keypoints in the image (two numbers each) are refused. There are no times.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.json_text import json_head, number, numbers, objects_with, read_json
from armdesign.demonstration.files.keypoints import Frame, take_of_frames
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError

_FRAME_KEYS = ("image_id", "frame_id", "frame", "frame_index", "frame_idx")
_KEYS = ("keypoints_3d", "keypoints3d", "keypoints")
_SCORES = ("keypoint_scores", "scores", "confidence")
_NAMES = ("keypoint_names", "joint_names", "keypoints_names")


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes holds keypoints of people."""
    return json_head(head, *_KEYS, "instance_info") and not json_head(head, "body_list")


def read(path: Path) -> Take:
    """Read 3D keypoints."""
    content = read_json(path)
    key = next((key for key in _KEYS if any(_is_person(each, key) for each in objects_with(content, key))), None)
    if key is None:
        message = f"{path} holds no keypoints of people"
        raise RecordingError(message, allowed=_KEYS, fix="Write its points as plain CSV")
    people: dict[object, list[Frame]] = {}
    for number_, (frame, person) in enumerate(_people(content, key)):
        people.setdefault(number_ if frame is None else frame, []).append(_frame(person, key, path))
    frames = [found[0] for found in people.values()]
    take = take_of_frames(path, "COCO keypoints JSON", frames, _names(content, len(frames[0].places)))
    most = max(map(len, people.values()))
    if most < 2:
        return take
    sentence = f"Up to {most} people are in a frame; the first was taken."
    return replace(take, steps=(*take.steps, Step("people", sentence, {"people": most})))


def _is_person(each: Mapping[str, Any], key: str) -> bool:
    """Whether an object holds numbers of keypoints, not their names."""
    first = each[key][0] if isinstance(each[key], list) and each[key] else None
    return isinstance(first, (int, float, list, Mapping))


def _people(content: object, key: str) -> list[tuple[object, Mapping[str, Any]]]:
    """People with the frame they are in; None where that is not said."""
    found: list[tuple[object, Mapping[str, Any]]] = []
    for frame in objects_with(content, "instances"):
        number_ = next((frame[name] for name in _FRAME_KEYS if name in frame), len(found))
        found += [(str(number_), each) for each in objects_with(frame["instances"], key) if _is_person(each, key)]
    if found:
        return found
    people = [each for each in objects_with(content, key) if _is_person(each, key)]
    return [(next((str(each[name]) for name in _FRAME_KEYS if name in each), None), each) for each in people]


def _frame(person: Mapping[str, Any], key: str, path: Path) -> Frame:
    """The keypoints of a person."""
    value = person[key]
    while isinstance(value, list) and len(value) == 1 and isinstance(value[0], list):
        value = value[0]
    if not isinstance(value, list) or not value:
        raise RecordingError(f"{path}: somebody has no '{key}'", value=value, fix="Export the recording again")
    scores = next((person[name] for name in _SCORES if isinstance(person.get(name), list)), None)
    if isinstance(value[0], list):
        width = len(value[0])
    elif isinstance(value[0], Mapping):
        width = 3
    else:
        width = 3 if scores is not None and len(value) == 3 * len(scores) else 4
    if width not in (3, 4) or (width == 4 and not isinstance(value[0], list) and len(value) % 4):
        message = f"{path}: keypoints are no places in the room, but points in an image"
        fix = "Triangulate them (Pose2Sim, Anipose), and give the 3D points as TRC or plain CSV"
        raise RecordingError(message, allowed="x, y, z and a score each", fix=fix)
    table = numbers(value, width, path, f"'{key}'")
    if width == 4:
        return Frame(float("nan"), table[:, :3], table[:, 3])
    confidence: Array | None = None
    if scores is not None:
        confidence = np.array([number(score) for score in scores])
    return Frame(float("nan"), table, confidence)


def _names(content: object, count: int) -> Sequence[object] | None:
    """Names of the points, where the file says them."""
    for each in objects_with(content, "keypoint_id2name"):
        named = each["keypoint_id2name"]
        if isinstance(named, Mapping) and len(named) == count:
            return [named.get(str(i), "") for i in range(count)]
    for key in _NAMES:
        for each in objects_with(content, key):
            if isinstance(each[key], list) and len(each[key]) == count:
                return list(each[key])
    return None
