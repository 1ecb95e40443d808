"""BVH: a skeleton, and per frame the angles of its joints; places and turns follow by forward kinematics.

A joint's turns are made in the order in which its channels stand in the file, each about an axis as the turns before
have left it (intrinsic), in degrees. Its origin stands at the parent's, plus the OFFSET in the parent's axes. Points
are the origins of all joints (``RightArm`` is the shoulder, ``RightForeArm`` the elbow, ``RightHand`` the wrist) and
the ends of the last bones, called ``NAME (end)``.

The file has no field for the unit of length or the axis that points up.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.csv_cells import MAX_NUMBERS, MISSING, Dialect, Place, Rows, read_rows
from armdesign.demonstration.files.formats.bvh_skeleton import Joint, Skeleton, read_skeleton
from armdesign.demonstration.files.formats.euler import identity, rotated, turned
from armdesign.demonstration.files.formats.frame_clock import check_frames
from armdesign.demonstration.files.formats.marker_columns import listed
from armdesign.demonstration.files.formats.row_steps import count, row_steps
from armdesign.demonstration.files.lines_ahead import LinesAhead
from armdesign.demonstration.files.sniff import open_text, text_head
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError

_START = re.compile(r"\s*HIERARCHY\b", re.IGNORECASE)
_FRAMES = re.compile(r"\s*Frames\s*:?\s*(\S*)\s*$", re.IGNORECASE)
_FRAME_TIME = re.compile(r"\s*Frame\s*Time\s*:?\s*(\S*)\s*$", re.IGNORECASE)
_STEPS = (1e-5, 100.0)  # [s]
_STILL = 0.01  # [deg] angles of a T-pose
_JUMP = 5.0  # [deg] from there to the first frame of the motion
_NEAR = 0.25  # of the offset's length
_FIX = "Export the motion again"


class _Motion(NamedTuple):
    """What stands above the numbers of the frames.

    Attributes:
        frames: Number of frames announced; None where none is.
        step: From frame to frame [s].
        decimal: Stands between whole and broken part of a number.
    """

    frames: int | None
    step: float
    decimal: str


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes is a BVH file."""
    return bool(_START.match(text_head(head)))


def read(path: Path) -> Take:
    """Read a BVH file.

    Args:
        path: The file.

    Returns:
        Points: origins of the joints and ends of the last bones. Orientations: those of the joints.

    Raises:
        RecordingError: The file cannot be read, or something in it is wrong; the message says what and where.
    """
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        skeleton = read_skeleton(lines)
        motion = _read_motion(lines)
        lines.change = _squeezed
        rows = read_rows(lines, skeleton.columns, lines.place, Dialect(" ", MISSING, motion.decimal, may_be_cut=True))
    _check_size(rows, skeleton)
    table = rows.values
    first = 1 if _starts_in_t_pose(table, skeleton) else 0
    points, orientations, replaced = _poses(table[first:], skeleton)
    time = np.arange(first, len(table), dtype=float) * motion.step
    return Take(
        time=time,
        points=points,
        orientations=orientations,
        source=str(path),
        format="BVH",
        rate=1.0 / motion.step,
        steps=tuple(_steps(rows, motion, first, replaced)),
    )


def _squeezed(text: str) -> str:
    """A line with one blank between its numbers and none around them."""
    end = "\n" if text.endswith("\n") else ""
    text = text.replace("\t", " ").strip()
    while "  " in text:
        text = text.replace("  ", " ")
    return text + end


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


def _check_size(rows: Rows, skeleton: Skeleton) -> None:
    """Turn away what has no frames, or so many joints that their places would not fit into memory."""
    check_frames(rows, "'Frame Time'")
    if 7 * len(skeleton.joints) * len(rows.values) > MAX_NUMBERS:
        message = f"{rows.source} holds {len(rows.values):,} frames of {len(skeleton.joints):,} joints"
        allowed = f"at most {MAX_NUMBERS // 7:,} of both together"
        raise RecordingError(message, allowed=allowed, fix="Export a shorter stretch, or fewer joints")


def _starts_in_t_pose(table: Array, skeleton: Skeleton) -> bool:
    """Whether the first frame is no part of the motion: all angles zero, and the next frame far from it."""
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
    replaced: list[str] = []
    with np.errstate(over="ignore", invalid="ignore"):
        for joint in skeleton.joints:
            local, holds_offset = _local(joint, table)
            replaced += [joint.name] if holds_offset else []
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


def _local(joint: Joint, table: Array) -> tuple[Array, bool]:
    """A joint's place in its parent's axes, shape (3, 1) or (3, T), and whether its position channels hold the offset.

    By its origin, the format adds the channels to the offset. Some programs write the whole place instead, so that a
    bone's channels stay near the offset; adding would make the bone twice as long.
    """
    offset = np.array(joint.offset)[:, None]
    if not joint.positions:
        return offset, False
    axes, columns = list(joint.positions), list(joint.positions.values())
    moved = np.zeros((3, len(table)))
    moved[axes] = table[:, columns].T
    away = np.array([_median(values) for values in moved[axes]]) - offset[axes, 0]
    if joint.parent is None or not np.linalg.norm(away) < _NEAR * np.linalg.norm(offset[axes]):
        return offset + moved, False
    others = [axis for axis in range(3) if axis not in axes]
    moved[others] = offset[others]
    return moved, True


def _median(values: Array) -> float:
    """Median of the values that are there; NaN if there are none."""
    values = values[np.isfinite(values)]
    return float(np.median(values)) if len(values) else math.nan


def _steps(rows: Rows, motion: _Motion, first: int, replaced: list[str]) -> list[Step]:
    """What was odd about the file."""
    steps = row_steps(rows, motion.frames)
    if first:
        sentence = "The first frame is the T-pose, all angles being zero, far from the second frame: it was left out."
        steps.append(Step("t-pose", sentence))
    if replaced:
        shown = listed(replaced)
        sentence = f"Position channels near the OFFSET were taken in its place instead of being added to it: {shown}."
        steps.append(Step("offsets", sentence, {"joints": replaced}))
    return steps
