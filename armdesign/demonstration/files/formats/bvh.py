"""BVH: a skeleton, and per frame the angles of its joints; places and turns follow by forward kinematics.

    HIERARCHY
    ROOT Hips
    {
        OFFSET 0.0 0.0 0.0
        CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation
        JOINT Spine
        {
            OFFSET 0.0 5.2 0.1
            CHANNELS 3 Zrotation Yrotation Xrotation
            End Site
            {
                OFFSET 0.0 9.8 0.0
            }
        }
    }
    MOTION
    Frames: 238
    Frame Time: 0.01
    0.0 94.2 0.0 ...

A joint's turns are made in the order of its channels in the file, each about an axis as the turns before
have left it (intrinsic), in degrees. Its origin is the parent's, plus the OFFSET in the parent's axes. Points
are the origins of all joints (``RightArm`` is the shoulder, ``RightForeArm`` the elbow, ``RightHand`` the wrist) and
the ends of the last bones, called ``NAME (end)``. The file has no field for the unit of length or the axis that points
up.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import MISSING, Dialect, Rows, read_rows
from armdesign.demonstration.files.formats.frame_clock import check_frames
from armdesign.demonstration.files.formats.marker_tables import clean_name, count, listed, row_steps, unused_name
from armdesign.demonstration.files.quaternions import AXES, identity, rotated, turned
from armdesign.demonstration.files.text_files import MAX_NUMBERS, LinesAhead, Place, check_columns, open_text, text_head
from armdesign.demonstration.recording import Step, Take, median_seen
from armdesign.errors import RecordingError

_START = re.compile(r"(?:\s*(?:#|//|;)[^\n]*\n)*\s*HIERARCHY\b", re.IGNORECASE)  # below comments
_FRAMES = re.compile(r"\s*Frames\s*:?\s*(\S*)\s*$", re.IGNORECASE)
_FRAME_TIME = re.compile(r"\s*Frame\s*Time\s*:?\s*(\S*)\s*$", re.IGNORECASE)
_STEPS = (1e-5, 100.0)  # [s] from frame to frame
_STILL = 0.01  # [deg] angles of a T-pose
_JUMP = 5.0  # [deg] from there to the first frame of the motion
_NEAR = 0.25  # of the offset's length
_FIX = "Export the motion again"
MAX_JOINTS = 5_000
_CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in AXES)


class _Motion(NamedTuple):
    """The lines above the numbers of the frames."""

    frames: int | None  # announced
    step: float  # from frame to frame [s]
    decimal: str  # point or comma


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes is a BVH file."""
    return bool(_START.match(text_head(head)))


def read(path: Path) -> Take:
    """Read a BVH file.

    Returns:
        Points: origins of the joints and ends of the last bones. Orientations: those of the joints.
    """
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        skeleton = read_skeleton(lines)
        motion = _read_motion(lines)
        lines.change = lambda text: " ".join(text.split()) + "\n" * text.endswith("\n")  # one blank between numbers
        rows = read_rows(lines, skeleton.columns, lines.place, Dialect(" ", MISSING, motion.decimal, may_be_cut=True))
    check_frames(rows, "'Frame Time'")
    if 7 * len(skeleton.joints) * len(rows.values) > MAX_NUMBERS:  # a place and a quaternion each
        message = f"{rows.source} holds {len(rows.values):,} frames of {len(skeleton.joints):,} joints"
        allowed = f"at most {MAX_NUMBERS // 7:,} of both together"
        raise RecordingError(message, allowed=allowed, fix="Export a shorter stretch, or fewer joints")
    table = rows.values
    first = 1 if _starts_in_t_pose(table, skeleton) else 0
    points, orientations, replaced = _poses(table[first:], skeleton)
    return Take(
        time=np.arange(first, len(table), dtype=float) * motion.step,
        points=points,
        orientations=orientations,
        source=str(path),
        format="BVH",
        rate=1.0 / motion.step,
        solved=True,
        steps=tuple(_steps(rows, motion, first, replaced)),
    )


def _read_motion(lines: LinesAhead) -> _Motion:
    """Read the lines ``Frames`` and ``Frame Time``."""
    announced: int | None = None
    while text := lines.peek():
        place = lines.place
        if found := _FRAME_TIME.match(text):
            lines.readline()
            return _Motion(announced, _step(found[1], place), "," if "," in found[1] else ".")
        if found := _FRAMES.match(text):
            announced = count(found[1])
        elif text.strip():
            break
        lines.readline()
    message = f"{lines.place}: the line 'Frame Time' is missing below 'MOTION'"
    raise RecordingError(message, fix=f"The file may be cut off. {_FIX}")


def _step(text: str, place: Place) -> float:
    """The time from frame to frame [s]."""
    try:
        step = float(text.replace(",", "."))
    except ValueError:
        step = math.nan
    if not _STEPS[0] <= step <= _STEPS[1]:
        message = f"{place}: the frame time is '{text[:40]}'"
        allowed = f"{_STEPS[0]:g} to {_STEPS[1]:g} seconds"
        raise RecordingError(message, value=text, allowed=allowed, fix=f"Correct it, or {_FIX.lower()}")
    return step


def _starts_in_t_pose(table: Array, skeleton: Skeleton) -> bool:
    """Whether the first frame is no part of the motion: all angles zero, and the next frame far from it."""
    # The BVH conversions of the CMU library begin so, as MotionBuilder needs a T-pose to know a skeleton.
    columns = [column for joint in skeleton.joints for _, column in joint.rotations]
    if len(table) < 2 or not columns:
        return False
    angles = np.abs(table[:2, columns])
    return bool((angles[0] <= _STILL).all() and (angles[1] > _JUMP).any())


def _poses(table: Array, skeleton: Skeleton) -> tuple[dict[str, Array], dict[str, Array], list[str]]:
    """Forward kinematics: p = p_parent + R_parent offset, R = R_parent R_1 R_2 R_3, for all frames at once.

    Args:
        table: Channels, shape (T, columns).
        skeleton: The joints.

    Returns:
        Positions, each of shape (T, 3); quaternions x, y, z, w, each of shape (T, 4); names of the joints whose
        position channels hold the offset.
    """
    places: list[Array] = []
    turns: list[Array] = []
    replaced = _replaced(skeleton, table)
    with np.errstate(over="ignore", invalid="ignore"):
        for joint in skeleton.joints:
            local = _local(joint, table, bool(replaced))
            if joint.parent is None:
                places.append(local + np.zeros((3, len(table))))
                turns.append(_turned(identity(len(table)), joint, table))
            else:
                places.append(places[joint.parent] + rotated(turns[joint.parent], local))
                turns.append(_turned(turns[joint.parent], joint, table))
    named = list(zip(skeleton.joints, places, turns, strict=True))
    points = {joint.name: place.T for joint, place, _ in named if not joint.is_end or any(joint.offset)}
    return points, {joint.name: turn.T for joint, _, turn in named if not joint.is_end}, replaced


def _turned(quaternions: Array, joint: Joint, table: Array) -> Array:
    """The axes of a joint whose parent has these, shape (4, T)."""
    for axis, column in joint.rotations:
        quaternions = turned(quaternions, axis, np.radians(table[:, column]))
    return quaternions


def _replaced(skeleton: Skeleton, table: Array) -> list[str]:
    """Names of the joints with position channels, if these hold the whole place instead of what is added to OFFSET.

    The format adds. A program that writes whole places does so for all joints, so that the bones' channels stay near
    the offsets, and adding would make them twice as long: most of the bones decide for the file.
    """
    near, moving = 0, [joint for joint in skeleton.joints if joint.positions]
    bones = [joint for joint in moving if joint.parent is not None and any(joint.offset)]
    for joint in bones:
        offset = np.array(joint.offset)[list(joint.positions)]
        middle = np.array([median_seen(table[:, column]) for column in joint.positions.values()])
        near += bool(np.linalg.norm(middle - offset) < _NEAR * np.linalg.norm(offset))
    return [joint.name for joint in moving if any(joint.offset)] if 2 * near > len(bones) else []


def _local(joint: Joint, table: Array, holds_offset: bool) -> Array:
    """A joint's place in its parent's axes, shape (3, 1) or (3, T); its channels may hold the offset already."""
    place = np.array(joint.offset)[:, None]
    if joint.positions:
        place = np.repeat(place, len(table), axis=1)
        axes, columns = list(joint.positions), list(joint.positions.values())
        place[axes] = table[:, columns].T + (0.0 if holds_offset else place[axes])
    return place


def _steps(rows: Rows, motion: _Motion, first: int, replaced: list[str]) -> list[Step]:
    """What was odd about the file."""
    steps = row_steps(rows, motion.frames)
    if first:
        sentence = "The first frame is the T-pose, all angles being zero, far from the second frame: it was left out."
        steps.append(Step("t-pose", sentence))
    if replaced:
        sentence = "Position channels near the OFFSET were taken in its place instead of being added to it"
        steps.append(Step("offsets", f"{sentence}: {listed(replaced)}.", {"joints": replaced}))
    return steps


@dataclass
class Joint:
    """A joint, or the end of the last bone of a chain."""

    name: str  # each once in a skeleton
    parent: int | None  # index of the joint it hangs on; None for a root
    is_end: bool = False  # whether it is an end without axes of its own
    offset: tuple[float, ...] = ()  # from the parent's origin, in the parent's axes; empty until it was read
    positions: dict[int, int] = field(default_factory=dict)  # axis, 0 to 2, to column of the numbers
    # axis and column of each turn, in the order in which they are made
    rotations: list[tuple[int, int]] = field(default_factory=list)


@dataclass(frozen=True)
class Skeleton:
    """All joints, each after the one it hangs on."""

    joints: list[Joint]
    columns: list[str]  # a name for each number of a frame


def read_skeleton(lines: LinesAhead) -> Skeleton:
    """The joints, up to the line ``MOTION``."""
    reader = _Reader(lines.place)
    while text := lines.readline():
        words = text.replace("{", " { ").replace("}", " } ").split()
        if not reader.begun and words and words[0].startswith(("#", "//", ";")):
            words = []
        if [word.upper() for word in words] == ["MOTION"]:
            return reader.finished()
        reader.take(words)
        reader.place = lines.place
    raise RecordingError(f"{lines.place.source} ends before the line 'MOTION'", fix=f"The file may be cut off. {_FIX}")


class _Reader:
    """Puts joints together line by line; a list of those still open is the nesting."""

    def __init__(self, place: Place) -> None:
        self.place = place
        self._joints: list[Joint] = []
        self._columns: list[str] = []
        self._open: list[int] = []
        self._named: int | None = None  # the joint whose brace is to come
        self._used: set[str] = set()
        self._given: Counter[str] = Counter()
        self.begun = False

    def take(self, words: list[str]) -> None:
        """Take a line's words; a brace may follow other words."""
        while words:
            brace = next((i for i, word in enumerate(words) if word in "{}"), len(words))
            if brace > 0:
                self._statement(words[:brace])
            elif words[0] == "{":
                if self._named is None:
                    raise self._error("a brace opens that belongs to no joint")
                self._open.append(self._named)
                self._named = None
            elif not self._open or self._named is not None:
                raise self._error("a brace closes that was not opened")
            else:
                self._open.pop()
            words = words[max(brace, 1) :]

    def finished(self) -> Skeleton:
        """The skeleton, once its part is over."""
        if self._open or self._named is not None:
            joint = self._joints[self._open[-1] if self._open else -1]
            raise self._error(f"the braces of '{joint.name[:40]}' are not closed")
        if not self._joints:
            raise self._error("there is no ROOT above")
        missing = [joint.name for joint in self._joints if not joint.offset]
        if missing:
            raise self._error(f"'{missing[0][:40]}' has no OFFSET")
        if not self._columns:
            raise self._error("no joint has CHANNELS, nothing moves")
        return Skeleton(self._joints, self._columns)

    def _statement(self, words: list[str]) -> None:
        keyword = words[0].upper()
        if self._named is not None:
            raise self._error(f"'{{' is missing after '{self._joints[self._named].name[:40]}'")
        if not self.begun:
            if keyword != "HIERARCHY":
                raise self._error(f"this is no BVH file ('{' '.join(words)[:40]}')", "'HIERARCHY' in the first line")
            self.begun, words = True, words[1:]
            if words:
                self._statement(words)
        elif keyword in {"ROOT", "JOINT"}:
            name = " ".join(words[1:])
            if (keyword == "ROOT") == bool(self._open):
                where = "inside" if self._open else "outside"
                raise self._error(f"{keyword} '{name[:40]}' stands {where} another joint")
            self._add(name, False)
        elif keyword == "END":
            if not self._open:
                raise self._error("an End Site stands outside a joint")
            self._add(f"{self._joints[self._open[-1]].name} (end)", True)
        elif keyword == "OFFSET":
            self._offset(words[1:])
        elif keyword == "CHANNELS":
            self._channels(words[1:])
        else:
            allowed = "ROOT, JOINT, End Site, OFFSET, CHANNELS, braces and then MOTION"
            raise self._error(f"'{words[0][:40]}' is unknown", allowed)

    def _add(self, name: str, is_end: bool) -> None:
        if self._open and self._joints[self._open[-1]].is_end:
            raise self._error("an End Site holds another joint")
        if len(self._joints) >= MAX_JOINTS:
            raise self._error(f"there are more than {MAX_JOINTS:,} joints")
        name = unused_name(clean_name(name) or f"joint {len(self._joints) + 1}", self._used, self._given)
        self._used.add(name)
        self._named = len(self._joints)
        self._joints.append(Joint(name, self._open[-1] if self._open else None, is_end))

    def _current(self, word: str) -> Joint:
        if not self._open:
            raise self._error(f"{word} stands outside a joint")
        return self._joints[self._open[-1]]

    def _offset(self, words: list[str]) -> None:
        joint = self._current("OFFSET")
        try:
            joint.offset = tuple(float(word.replace(",", ".")) for word in words)
        except ValueError:
            joint.offset = ()
        if len(joint.offset) != 3 or not all(math.isfinite(value) for value in joint.offset):
            raise self._error(f"the OFFSET of '{joint.name[:40]}' is '{' '.join(words)[:60]}'", "three numbers")

    def _channels(self, words: list[str]) -> None:
        joint = self._current("CHANNELS")
        if joint.positions or joint.rotations or joint.is_end:
            raise self._error(f"'{joint.name[:40]}' has CHANNELS {'at an end' if joint.is_end else 'twice'}")
        if not words or words[0] != str(len(words) - 1):
            found = f"'{words[0][:20]}', and {len(words) - 1} names follow" if words else "nothing"
            raise self._error(f"the CHANNELS of '{joint.name[:40]}' are {found}", "their number, then as many names")
        for word in words[1:]:
            self._channel(joint, word)
        check_columns(len(self._columns), self.place)

    def _channel(self, joint: Joint, word: str) -> None:
        axis, kind = AXES.find(word[:1].upper()), word[1:].lower()
        if axis < 0 or kind not in ("position", "rotation"):
            raise self._error(f"'{joint.name[:40]}' has a channel '{word[:40]}'", ", ".join(_CHANNELS))
        column = len(self._columns)
        if kind == "rotation" and len(joint.rotations) < 3:
            joint.rotations.append((axis, column))
        elif kind == "position" and axis not in joint.positions:
            joint.positions[axis] = column
        else:
            raise self._error(f"'{joint.name[:40]}' has a channel '{word}' too many")
        self._columns.append(f"{joint.name} {word}")

    def _error(self, message: str, allowed: str | None = None) -> RecordingError:
        return RecordingError(f"{self.place}: {message}", allowed=allowed, fix=f"Correct the line, or {_FIX.lower()}")
