"""CSV files of FreeMoCap: body, hands and face as MediaPipe names them, a column for each coordinate, mostly no times.

    nose_x,nose_y,nose_z,left_eye_inner_x,left_eye_inner_y,left_eye_inner_z,...

Newer ones have ``body_``, ``left_hand_`` and so on before the names, and a column ``timestamp``. Lengths are those of
the calibration board, millimetres if its size was given so. A camera's frame rate is not in the older files.
"""

from __future__ import annotations

from pathlib import Path

from armdesign.demonstration.files.named_columns import header_of, read_columns
from armdesign.demonstration.recording import Take

_NEEDED = {f"{side}_{part}" for side in ("left", "right") for part in ("shoulder", "elbow", "wrist")} | {"nose"}


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes has FreeMoCap's names, and no confidence beside them."""
    columns = header_of(head)
    if "time" in (name.lower() for name in columns.names) or columns.confidence:
        return False
    return {name.lower().removeprefix("body_") for name in columns.points} >= _NEEDED


def read(path: Path) -> Take:
    """Read a FreeMoCap CSV."""
    return read_columns(path, "FreeMoCap CSV", lambda name: name.removeprefix("body_"))
