"""Files that people have from motion capture and that are not read: what they are, and what to export instead."""

from __future__ import annotations

import re
from typing import NamedTuple

from armdesign.demonstration.files.text_files import text_head


class Foreign(NamedTuple):
    """A format that is not read."""

    name: str  # what it is called in messages
    pattern: re.Pattern[str]  # how its text begins
    way: str  # what to do instead


def _begins(pattern: str) -> re.Pattern[str]:
    """A pattern of the beginning of a text."""
    return re.compile(rf"\A\s*(?:{pattern})", re.IGNORECASE | re.DOTALL)


FOREIGN = (
    Foreign("Xsens MVN (binary)", _begins(r"XMVN|MVNB"), "Export it from MVN Analyze as MVNX or C3D"),
    Foreign("XML", _begins(r"<\?xml|<[a-z]"), "Export the recording as C3D, TRC, BVH or plain CSV"),
    Foreign(
        "JSON",
        _begins(r"[\[{]\s*[\"\[{\d-]"),
        "Write its points as plain CSV: a column 'time', then NAME_x, NAME_y, NAME_z for each",
    ),
    Foreign(
        "DeepLabCut CSV",
        _begins(r"scorer,"),
        "These are pixels: triangulate them (Anipose, Pose2Sim), and give the 3D points as TRC or plain CSV",
    ),
    Foreign(
        "kineticstoolkit CSV",
        _begins(r"[^\n]*,[^\n,]*\[0\][^\n]*\[1\]"),
        "Save the TimeSeries as C3D (ktk.write_c3d), or rename its columns NAME[0] to NAME_x and so on",
    ),
    Foreign("APDM", _begins(r"Format=\d|[^\n]*APDM"), "It holds turns of sensors, no places: record positions, too"),
    Foreign(
        "OptiTrack Tracking Tools CSV (before Motive)",
        _begins(r"comment,|righthanded|lefthanded|info,"),
        "Open the take in Motive and export it as CSV 1.2x or C3D",
    ),
    Foreign("a file of settings", _begins(r"(?:#[^\n]*\n\s*)*\[task\]"), "Give it with --config"),
    Foreign("FBX", _begins(r"Kaydara FBX|; FBX"), "Export the skeleton as BVH"),
)
"""Asked in this order."""


def foreign_format(head: bytes) -> Foreign | None:
    """The format that a file beginning with these bytes has, of those that are known and not read."""
    text = text_head(head) or head[:64].decode("latin-1")
    return next((each for each in FOREIGN if each.pattern.match(text)), None)
