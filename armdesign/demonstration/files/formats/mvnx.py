"""MVNX files of Xsens MVN: where the segments of a suit's wearer are, and how they are turned, frame by frame.

    <mvnx version="4">
      <subject label="A" frameRate="60" segmentCount="23">
        <segments><segment label="RightUpperArm" id="8"/> ...
        <frames><frame time="0" index="0" type="normal">
          <orientation>w x y z w x y z ...</orientation><position>x y z x y z ...</position>

Lengths are metres with z up, quaternions scalar first, times whole milliseconds since the first frame. A segment's
origin is its joint towards the trunk: ``RightUpperArm`` is the shoulder, ``RightForeArm`` the elbow, ``RightHand`` the
wrist. Frames of another type than ``normal`` (identity, tpose, npose) are poses for calibration and are left out.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element, ParseError, XMLPullParser

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.formats.frame_clock import read_rate
from armdesign.demonstration.files.formats.marker_tables import clean_name, count_steps, once_each
from armdesign.demonstration.files.text_files import MAX_NUMBERS, open_text, text_head
from armdesign.demonstration.recording import Step, Take, first_bad_step
from armdesign.errors import RecordingError

_START = re.compile(r"\A\s*(?:<\?xml[^>]*>\s*)?(?:<!--.*?-->\s*)*<mvnx\b", re.IGNORECASE | re.DOTALL)
_ROUNDED = 2e-3  # [s], and part of the whole; printed times are whole milliseconds
_PIECE = 1 << 20  # characters parsed at a time
_MOST = 1_000  # segments
_FIX = "Export the recording from MVN again, with positions and orientations of the segments"


class _Frame(NamedTuple):
    """The numbers of one frame."""

    number: float  # index in the file; NaN where there is none
    time: float  # printed [s]; NaN where none is
    positions: list[float]
    orientations: list[float]


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes is an MVNX file."""
    return bool(_START.match(text_head(head)))


def read(path: Path) -> Take:
    """Read an MVNX file.

    Returns:
        Origins and orientations of the segments.
    """
    reader = _Reader(path)
    cut = _parse(path, reader)
    if not reader.frames:
        raise RecordingError(f"{path} holds no normal frame with positions", value=0, fix=_FIX)
    time, rate, clock_steps = _clock(reader.frames, reader.rate, path)
    names, steps = once_each(reader.names)
    positions = _table([frame.positions for frame in reader.frames], len(names), 3, path)
    points = {name: positions[:, i] for i, name in enumerate(names)}
    turns: dict[str, Array] = {}
    if all(frame.orientations for frame in reader.frames):
        quaternions = _table([frame.orientations for frame in reader.frames], len(names), 4, path)
        turns = {name: quaternions[:, i, [1, 2, 3, 0]] for i, name in enumerate(names)}
    if cut:
        sentence = f"The file ends in the middle, after {len(reader.frames)} frames: it may have been cut off."
        steps.append(Step("cut", sentence, {"frames": len(reader.frames)}))
    return Take(
        time=time,
        points=points,
        orientations=turns,
        source=str(path),
        format="Xsens MVNX",
        units="m",
        up="z",
        rate=rate,
        solved=True,
        steps=(*steps, *clock_steps, *count_steps("segments", reader.announced, len(names))),
    )


class _Reader:
    """Collects what the elements say as they end."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.names: list[str] = []
        self.frames: list[_Frame] = []
        self.rate: float | None = None
        self.announced: int | None = None
        self._subjects = 0

    def take(self, parser: XMLPullParser[Any]) -> None:
        """Take what the parser has found since."""
        for event, element in parser.read_events():  # type: ignore[misc]
            (self.begin if event == "start" else self.end)(element)  # type: ignore[arg-type]

    def begin(self, element: Element) -> None:
        """Take the attributes of an element that begins."""
        if _tag(element) == "subject":
            self._subjects += 1
            if self._subjects == 1:
                self.rate = read_rate(element.get("frameRate", ""))
                stated = element.get("segmentCount", "")
                self.announced = int(stated) if stated.isdecimal() and len(stated) < 6 else None

    def end(self, element: Element) -> None:
        """Take an element that is complete."""
        tag = _tag(element)
        if self._subjects != 1:  # a file of several has them one after the other
            return
        if tag == "segment":
            self.names.append(clean_name(element.get("label", "")) or f"segment {len(self.names) + 1}")
            if len(self.names) > _MOST:
                raise RecordingError(f"{self.path} holds more than {_MOST} segments", fix=_FIX)
        elif tag == "frame":
            self._frame(element)
            element.clear()

    def _frame(self, element: Element) -> None:
        if element.get("type", "normal").lower() != "normal":
            return
        values: dict[str, list[float]] = {"position": [], "orientation": []}
        for child in element:
            if _tag(child) in values:
                values[_tag(child)] = self._numbers(child, element.get("index", "?"))
        if not values["position"]:
            raise RecordingError(f"{self.path}, frame {element.get('index', '?')[:20]}: no positions", fix=_FIX)
        number, time = (_number(element.get(name, "")) for name in ("index", "time"))
        self.frames.append(_Frame(number, 1e-3 * time, values["position"], values["orientation"]))
        if 7 * len(self.names) * len(self.frames) > MAX_NUMBERS:
            raise RecordingError(f"{self.path} holds more than {MAX_NUMBERS:,} numbers", fix="Export a shorter stretch")

    def _numbers(self, element: Element, index: str) -> list[float]:
        words = (element.text or "").split()
        try:
            numbers = [float(word.replace(",", ".")) for word in words if "_" not in word]
        except ValueError:
            numbers = []
        if len(numbers) != len(words) or not np.isfinite(numbers).all():
            message = f"{self.path}, frame {index[:20]}: not all of <{_tag(element)}> are finite numbers"
            raise RecordingError(message, fix=_FIX)
        return numbers


def _parse(path: Path, reader: _Reader) -> bool:
    """Go through the file; whether it was cut off."""
    parser: XMLPullParser[Any] = XMLPullParser(("start", "end"))
    with open_text(path) as stream:
        try:
            while text := stream.read(_PIECE):
                if "<!DOCTYPE" in text or "<!ENTITY" in text:  # a small file could grow beyond all bounds by these
                    raise RecordingError(f"{path} declares a document type, which MVNX has not", fix=_FIX)
                parser.feed(text)
                reader.take(parser)
            parser.close()
        except ParseError as error:
            if "no element found" in str(error) or "unclosed token" in str(error):
                reader.take(parser)
                return True
            raise RecordingError(f"{path} is damaged: {error}", fix=_FIX) from error
    return False


def _number(text: str) -> float:
    """A number in an attribute; NaN where it is none."""
    try:
        return float(text) if "_" not in text else float("nan")
    except ValueError:
        return float("nan")


def _clock(frames: list[_Frame], rate: float | None, path: Path) -> tuple[Array, float | None, list[Step]]:
    """Times of the frames [s], the rate that is declared, and a step where the printed times tell another one."""
    numbers, printed = (np.array(values) for values in zip(*((each.number, each.time) for each in frames), strict=True))
    if first_bad_step(numbers) is not None:
        numbers = np.arange(float(len(frames)))
    counted = None if rate is None else (numbers - numbers[0]) / rate
    if first_bad_step(printed) is not None:
        if counted is None:
            raise RecordingError(
                f"{path} tells neither times that increase nor a frame rate that makes sense", fix=_FIX
            )
        return counted, rate, []
    if counted is not None and np.abs(counted - (printed - printed[0])).max() <= _ROUNDED * (1.0 + counted[-1]):
        return counted, rate, []
    if rate is None or len(printed) < 2:
        return printed - printed[0], rate, []
    found = (len(printed) - 1) / float(printed[-1] - printed[0])
    sentence = f"The header declares {rate:.6g} frames/s, but the frames' times tell {found:.6g}; the times were taken."
    return printed - printed[0], rate, [Step("rate", sentence, {"declared": rate, "found": found})]


def _tag(element: Element) -> str:
    """Name of an element without its namespace, in small letters."""
    return str(element.tag).rpartition("}")[2].lower()


def _table(rows: list[list[float]], segments: int, width: int, path: Path) -> Array:
    """Numbers of all frames, shape (T, segments, width)."""
    wrong = next((i for i, row in enumerate(rows) if len(row) != segments * width), None)
    if wrong is not None or not segments:
        message = f"{path}, frame {(wrong or 0) + 1}: {len(rows[wrong or 0])} numbers for {segments} segments"
        raise RecordingError(message, value=len(rows[wrong or 0]), allowed=segments * width, fix=_FIX)
    return np.array(rows).reshape(len(rows), segments, width)
