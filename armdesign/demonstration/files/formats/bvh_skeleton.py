"""The first part of a BVH file: the joints, how they hang together, and which number of a frame moves what.

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
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field

from armdesign.demonstration.files.csv_cells import Place, check_columns
from armdesign.demonstration.files.formats.euler import AXES
from armdesign.demonstration.files.formats.marker_columns import clean_name, unused_name
from armdesign.demonstration.files.lines_ahead import LinesAhead
from armdesign.errors import RecordingError

MAX_JOINTS = 5_000
_CHANNELS = tuple(f"{axis}{kind}" for kind in ("position", "rotation") for axis in AXES)
_FIX = "Export the motion again"


@dataclass
class Joint:
    """A joint, or the end of the last bone of a chain.

    Attributes:
        name: Each once in a skeleton.
        parent: Index of the joint it hangs on; None for a root.
        offset: From the parent's origin, in the parent's axes; empty while it was not told.
        is_end: Whether it is an end without axes of its own.
        positions: Axis, 0 to 2, to column of the numbers.
        rotations: Axis and column of each turn, in the order in which they are made.
    """

    name: str
    parent: int | None
    is_end: bool = False
    offset: tuple[float, ...] = ()
    positions: dict[int, int] = field(default_factory=dict)
    rotations: list[tuple[int, int]] = field(default_factory=list)


@dataclass(frozen=True)
class Skeleton:
    """All joints, each after the one it hangs on.

    Attributes:
        joints: The joints.
        columns: A name for each number of a frame.
    """

    joints: list[Joint]
    columns: list[str]


def read_skeleton(lines: LinesAhead) -> Skeleton:
    """Read up to the line ``MOTION``.

    Args:
        lines: The file, at its beginning.

    Raises:
        RecordingError: Something in the part is wrong; the message names the line.
    """
    reader = _Reader(lines.place)
    while text := lines.readline():
        words = text.replace("{", " { ").replace("}", " } ").split()
        if [word.upper() for word in words] == ["MOTION"]:
            return reader.finished()
        reader.take(words)
        reader.place = lines.place
    raise RecordingError(f"{lines.place.source} ends before the line 'MOTION'", fix=f"The file may be cut off. {_FIX}")


class _Reader:
    """Puts joints together line by line; a list of those still open stands for the nesting."""

    def __init__(self, place: Place) -> None:
        self.place = place
        self._joints: list[Joint] = []
        self._columns: list[str] = []
        self._open: list[int] = []
        self._named: int | None = None  # the joint whose brace is to come
        self._used: set[str] = set()
        self._given: Counter[str] = Counter()
        self._begun = False

    def take(self, words: list[str]) -> None:
        """Take a line's words; a brace may stand behind other words."""
        while words:
            brace = next((i for i, word in enumerate(words) if word in "{}"), len(words))
            if brace == 0:
                self._brace(words[0])
                words = words[1:]
            else:
                self._statement(words[:brace])
                words = words[brace:]

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

    def _brace(self, brace: str) -> None:
        if brace == "{":
            if self._named is None:
                raise self._error("a brace opens that belongs to no joint")
            self._open.append(self._named)
            self._named = None
        elif not self._open or self._named is not None:
            raise self._error("a brace closes that was not opened")
        else:
            self._open.pop()

    def _statement(self, words: list[str]) -> None:
        keyword = words[0].upper()
        if self._named is not None:
            raise self._error(f"'{{' is missing after '{self._joints[self._named].name[:40]}'")
        if not self._begun:
            if keyword != "HIERARCHY":
                raise self._error(f"this is no BVH file ('{' '.join(words)[:40]}')", "'HIERARCHY' in the first line")
            self._begun, words = True, words[1:]
            if words:
                self._statement(words)
        elif keyword in {"ROOT", "JOINT"}:
            self._joint(keyword, " ".join(words[1:]))
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

    def _joint(self, keyword: str, name: str) -> None:
        if (keyword == "ROOT") == bool(self._open):
            raise self._error(f"{keyword} '{name[:40]}' stands {'inside' if self._open else 'outside'} another joint")
        self._add(name or f"joint {len(self._joints) + 1}", False)

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
