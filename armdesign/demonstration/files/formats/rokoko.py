"""CSV files of Rokoko Studio: per segment its place, perhaps its turn, and angles of the joints, which are left out.

    Timestamp,Hips_position_x,Hips_position_y,Hips_position_z,Hips_rotation_x,...,RightElbow_flexion,...

Lengths are metres with y up. A segment's origin is its joint towards the trunk: ``RightUpperArm`` is the shoulder.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from armdesign.demonstration.files.named_columns import header_of, read_columns
from armdesign.demonstration.recording import Take

_SEGMENTS = {"RightUpperArm", "RightForeArm", "RightHand", "LeftUpperArm", "LeftForeArm", "LeftHand", "Hips"}


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes has the places of Rokoko's segments."""
    columns = header_of(head)
    named = any(name.lower().endswith("_position_x") for name in columns.names)
    return named and len(_SEGMENTS & columns.points.keys()) > 1


def read(path: Path) -> Take:
    """Read a Rokoko CSV."""
    take = read_columns(path, "Rokoko CSV")
    return replace(take, units=take.units or "m", solved=True)
