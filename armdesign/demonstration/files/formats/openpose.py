"""JSON files of OpenPose with 3D keypoints: a file a frame, all of one take side by side in a folder.

    take_000000000000_keypoints.json
    {"version": 1.3, "people": [{"person_id": [-1], "pose_keypoints_3d": [x, y, z, score, x, y, z, score, ...]}]}

Naming any of them reads all: those of the same name but for its number. Frames follow at the camera's rate, which is
not in the files. Of several people the first is taken. Keypoints in the image alone are refused.
"""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.json_text import json_head, numbers, objects_with, read_json
from armdesign.demonstration.files.keypoints import Frame, take_of_frames
from armdesign.demonstration.files.text_files import unreadable
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError

_NAME = re.compile(r"(?P<before>.*?)(?P<number>\d+)(?P<after>\D*)")
_KEY = "pose_keypoints_3d"
_ENDING = "_keypoints.json"
_MOST_FILES = 200_000


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes holds people as OpenPose writes them."""
    return json_head(head, "people")


def read(path: Path) -> Take:
    """Read all frames of a take, of which one is named."""
    files = _files(path)
    if len(files) > 1:  # with one frame each
        found = [next(iter(_people_in(read_json(file), file)), []) for file in files]
    else:
        found = _people_in(read_json(path), path)
    if not any(len(people) for people in found):
        message = f"{path} holds no '{_KEY}': these are keypoints in an image, or nobody was seen"
        fix = "Triangulate them (Pose2Sim, Anipose), and give the 3D points as TRC or plain CSV"
        raise RecordingError(message, allowed=_KEY, fix=fix)
    count = next(len(people[0]) for people in found if people)
    empty = np.full((count, 4), np.nan)
    tables = [people[0] if people else empty for people in found]
    frames = [Frame(float("nan"), table[:, :3], table[:, 3]) for table in tables]
    take = take_of_frames(path, "OpenPose JSON", frames, None)
    most = max(len(people) for people in found)
    if most < 2:
        return take
    sentence = f"Up to {most} people are in a frame; the first was taken."
    return replace(take, steps=(*take.steps, Step("people", sentence, {"people": most})))


def file_in_folder(path: Path) -> Path:
    """A file of the take that a folder of OpenPose holds; any other path as it is."""
    if not os.path.isdir(path):  # False for names too long, too
        return path
    return min((file for file in _listed(path) if file.name.endswith(_ENDING)), default=path)


def first_of_each_take(files: Sequence[Path]) -> list[Path]:
    """Files of which those that OpenPose wrote for one take are named by the first."""
    found: dict[tuple[Path, str, str], Path] = {}
    for file in files:
        parts = _parts(file.name) if file.name.endswith(_ENDING) else None
        found.setdefault((file.parent, *(parts or (file.name, ""))), file)
    return list(found.values())


def _listed(folder: Path) -> list[Path]:
    """The files in a folder."""
    try:
        return list(folder.iterdir())
    except OSError as error:
        raise unreadable(folder, error) from error


def _parts(name: str) -> tuple[str, str] | None:
    """What stands before and behind the last number in a name; None where there is none."""
    match = _NAME.fullmatch(name[::-1])  # from behind, so that the last number is found
    return None if match is None else (match["after"][::-1], match["before"][::-1])


def _files(path: Path) -> list[Path]:
    """All files of the take, in their order: those of the same name but for its last number."""
    parts = _parts(path.name)
    if parts is None:
        return [path]
    before, after = parts
    numbered: list[tuple[int, Path]] = []
    for file in _listed(path.parent):
        middle = file.name[len(before) : len(file.name) - len(after)]
        alike = file.name.startswith(before) and file.name.endswith(after)
        if alike and middle.isascii() and middle.isdecimal() and len(middle) < 16:
            numbered.append((int(middle), file))
    if len(numbered) > _MOST_FILES:
        message = f"{path.parent} holds {len(numbered):,} files of one take"
        raise RecordingError(message, allowed=f"at most {_MOST_FILES:,}", fix="Copy fewer of them into a folder")
    return [file for _, file in sorted(numbered)]


def _people_in(content: object, path: Path) -> list[list[Array]]:
    """The people in each frame that a file holds: K points with x, y, z and score each."""
    frames = []
    for each in objects_with(content, "people"):
        people = each["people"] if isinstance(each["people"], list) else []
        tables = [person.get(_KEY) for person in people if isinstance(person, dict)]
        frames.append([numbers(table, 4, path, f"'{_KEY}'") for table in tables if table])
    return frames
