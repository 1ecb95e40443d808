"""File formats of motion recordings, recognised by their content.

A new format is one module here with a test of the first bytes and a reader, and one entry in ``FORMATS``.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from armdesign.demonstration.files import plain_csv
from armdesign.demonstration.files.formats import bone_csv, bvh, c3d, motive_csv, mvnx, qualisys_tsv, trc, vicon_csv
from armdesign.demonstration.recording import Take


class Format(NamedTuple):
    """One format.

    Attributes:
        name: What the format is called in messages.
        matches: Whether a file beginning with these bytes (``HEAD_SIZE`` of them at most) has the format.
        read: Reads such a file; what is wrong in it is a RecordingError that says what and where.
    """

    name: str
    matches: Callable[[bytes], bool]
    read: Callable[[Path], Take]


FORMATS: tuple[Format, ...] = (
    Format("C3D", c3d.matches, c3d.read),
    Format("OptiTrack Motive CSV", motive_csv.matches, motive_csv.read),
    Format("BVH", bvh.matches, bvh.read),
    Format("Xsens MVNX", mvnx.matches, mvnx.read),
    Format("TRC", trc.matches, trc.read),
    Format("Vicon", vicon_csv.matches, vicon_csv.read),
    Format("Qualisys TSV", qualisys_tsv.matches, qualisys_tsv.read),
    Format("bone CSV", bone_csv.matches, bone_csv.read),
    Format("plain CSV", plain_csv.matches, plain_csv.read),
)
"""Asked in this order; one entry a line."""
