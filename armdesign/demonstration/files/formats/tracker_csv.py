"""Tables of trackers, headsets and cameras that name a column for each number in one of the usual ways.

    timestamp,tracker_1_x,tracker_1_y,tracker_1_z,tracker_1_qw,tracker_1_qx,tracker_1_qy,tracker_1_qz
    Frame,HEAD_X,HEAD_Y,HEAD_Z,LSHO_X,...
    Time (ms);RightHand.Position.X;...

Vive and Unity loggers, Nuitrack, Kinect and many scripts write such files. Where but one body is there, it has the
file's name. Quaternions whose columns are numbered (q0, q1, q2, q3) wait for ``--quaternions``.
"""

from __future__ import annotations

import re
from pathlib import Path

from armdesign.demonstration.files.named_columns import header_of, read_columns
from armdesign.demonstration.recording import Take

_PLAIN = re.compile(r"time|.+_(?:x|y|z|qx|qy|qz|qw)", re.IGNORECASE)


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes has the columns of a point that are not those of plain CSV."""
    columns = header_of(head)
    left = [name for name in columns.names if name not in columns.left]
    in_plain = [name for name in left if not _PLAIN.fullmatch(name)]
    is_plain = "," in head.decode("latin-1").partition("\n")[0] and not in_plain
    return bool(columns.points) and not is_plain


def read(path: Path) -> Take:
    """Read a table with a column for each number."""
    return read_columns(path, "tracker CSV")
