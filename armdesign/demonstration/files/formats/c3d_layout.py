"""Where everything stands in a C3D file, read from its header and parameter section, and checked against its size.

A C3D file is made of blocks of 512 bytes: a header, a section of named parameters in groups, and the data. Whole
numbers may be stored in either byte order and floats in that of a VAX. Every count and pointer is compared with what
the file holds, so that whoever reads the data need not trust the file.
"""

from __future__ import annotations

import math
import os
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.formats.c3d_numbers import MIPS, ORDERS, ROTATION_NUMBERS, floats_of
from armdesign.demonstration.files.formats.frame_clock import MAX_RATE, MIN_RATE
from armdesign.demonstration.files.sniff import unreadable
from armdesign.errors import RecordingError

BLOCK = 512
MAX_POINTS = 10_000
MAGIC = 0x50
_SIZES = {-1: 1, 1: 1, 2: 2, 4: 4}  # parameter types: text, byte, 16 bit integer, float
_MAX_DIMENSIONS = 7
_UNKNOWN = 65535  # frames: "more than fit into 16 bits"
_EXPORT = "Export the recording again"


class C3DParameter(NamedTuple):
    """One parameter as it stands in the file.

    Attributes:
        kind: -1 text, 1 byte, 2 16 bit integer, 4 float.
        dimensions: Extents, the fastest first; of a text, the first is the length of each string.
        raw: The bytes of its values.
        processor: 84 Intel, 85 DEC, 86 MIPS.
    """

    kind: int
    dimensions: tuple[int, ...]
    raw: bytes
    processor: int

    def texts(self) -> list[str]:
        """The strings, without the blanks and zeros that fill them up; none where it is not a text."""
        if self.kind != -1 or not self.raw:
            return []
        width = self.dimensions[0] if self.dimensions else 1
        return [_decode(self.raw[start : start + width]) for start in range(0, len(self.raw), width)]

    def numbers(self) -> Array:
        """The values as floats, integers taken as unsigned; none where it is a text."""
        if self.kind == 4:
            return floats_of(self.raw, self.processor).astype(float)
        if self.kind == -1:
            return np.zeros(0)
        return np.frombuffer(self.raw, "u1" if self.kind == 1 else f"{ORDERS[self.processor]}u2").astype(float)


@dataclass(frozen=True)
class C3DLayout:
    """Counts and places, all within the file.

    Attributes:
        processor: 84 Intel, 85 DEC, 86 MIPS.
        rate: Frames per second [1/s].
        scale: Factor of integer data; negative where the data are floats.
        points: Number of points in each frame.
        frames: Number of frames.
        analog: Number of analog samples in each frame, which stand behind its points.
        start: Where the data begin [bytes].
        rotations: Number of 4 x 4 matrices in each set.
        ratio: Sets of matrices per frame.
        rotation_start: Where the matrices begin [bytes].
        parameters: Group to name to parameter, names in capitals.
        notes: What was contradictory and what was believed.
    """

    processor: int
    rate: float
    scale: float
    points: int
    frames: int
    analog: int
    start: int
    rotations: int
    ratio: int
    rotation_start: int
    parameters: Mapping[str, Mapping[str, C3DParameter]]
    notes: tuple[str, ...] = ()

    def texts(self, group: str, name: str) -> list[str]:
        """The strings of a parameter and of its continuations (``LABELS``, ``LABELS2``, ...); none if it is absent.

        Args:
            group: The group, such as ``POINT``.
            name: The parameter, such as ``LABELS``.
        """
        parameters = self.parameters.get(group, {})
        found: list[str] = []
        part, number = name, 1
        while part in parameters:
            found += parameters[part].texts()
            number += 1
            part = f"{name}{number}"
        return found


class _Header(NamedTuple):
    points: int
    analog: int
    first: int
    last: int
    scale: float
    start: int
    samples: int
    rate: float


def read_layout(path: Path) -> C3DLayout:
    """Read and check header and parameters.

    Raises:
        RecordingError: The file cannot be read, ends too early, or a count or pointer in it cannot be right.
    """
    try:
        with path.open("rb") as stream:
            size = os.fstat(stream.fileno()).st_size
            head = stream.read(BLOCK)
            section = _section(path, head, size)
            stream.seek(section)
            raw = stream.read(_BLOCKS_OF_PARAMETERS * BLOCK)
    except (OSError, ValueError) as error:
        raise unreadable(path, error) from error
    processor = raw[3] if len(raw) > 3 else 0
    if processor not in ORDERS:
        raise _wrong(path, f"its processor type is {processor}", allowed="84 (Intel), 85 (DEC), 86 (MIPS)")
    header = _header(head, processor)
    parameters = _parameters(path, raw, processor)
    return _layout(path, size, section, header, parameters, processor)


_BLOCKS_OF_PARAMETERS = 8192  # 4 MiB; real ones have up to a few hundred


def _section(path: Path, head: bytes, size: int) -> int:
    """Where the parameters begin [bytes]."""
    if len(head) < BLOCK:
        raise _wrong(path, f"it ends within its header, after {size} bytes")
    if head[1] != MAGIC:
        raise _wrong(path, f"its second byte is {head[1]} and not {MAGIC}")
    section = (head[0] - 1) * BLOCK
    if not BLOCK <= section < size:
        blocks = -(-size // BLOCK)
        raise _wrong(path, f"its header puts the parameters into block {head[0]}, but the file has {blocks} blocks")
    return section


def _header(head: bytes, processor: int) -> _Header:
    order = ORDERS[processor]
    points, analog, first, last = struct.unpack_from(f"{order}4H", head, 2)
    start, samples = struct.unpack_from(f"{order}2H", head, 16)
    scale, rate = floats_of(head[12:16] + head[20:24], processor).tolist()
    return _Header(points, analog, first, last, scale, start, samples, rate)


def _parameters(path: Path, raw: bytes, processor: int) -> dict[str, dict[str, C3DParameter]]:
    """Every parameter by group and name."""
    groups: dict[int, str] = {}
    found: dict[int, dict[str, C3DParameter]] = {}
    for number, name, at, end in _records(path, raw, processor):
        if number < 0:
            groups[-number] = name
        else:
            found.setdefault(number, {})[name] = _parameter(path, raw[at:end], name, processor)
    named: dict[str, dict[str, C3DParameter]] = {}
    for number, group in groups.items():
        named.setdefault(group, {}).update(found.get(number, {}))
    return named


def _records(path: Path, raw: bytes, processor: int) -> Iterator[tuple[int, str, int, int]]:
    """Group number (negative: a group, positive: a parameter), name, and where the content begins and ends."""
    at = 4
    while at + 2 <= len(raw) and raw[at]:
        length, number = struct.unpack_from("bb", raw, at)  # a negative length means "locked"
        begin = at + 2 + abs(length)
        if begin + 2 > len(raw):
            raise _wrong(path, "its parameter section ends within a name")
        name = _decode(raw[at + 2 : begin]).upper()
        offset = _offset(raw, begin, number, processor)
        end = begin + offset if offset else len(raw)
        if end > len(raw) or (offset and offset < 2):
            raise _wrong(path, f"parameter '{name[:40]}' points {offset} bytes on, which is not a parameter")
        yield number, name, begin + 2, end
        at = end


def _offset(raw: bytes, begin: int, number: int, processor: int) -> int:
    """How far on the next record begins [bytes]; 0 where this is the last.

    Some big-endian files of SGI have the last offset in little-endian order. A record tells its own length, and only
    where it contradicts the offset as the processor writes it, and agrees with the other order, is that one believed.
    """
    (offset,) = struct.unpack_from(f"{ORDERS[processor]}H", raw, begin)
    (swapped,) = struct.unpack_from("<H", raw, begin)
    if processor != MIPS or offset == swapped:
        return int(offset)
    at, end = begin + 2, begin + swapped
    if number > 0 and at + 2 <= len(raw):  # a parameter: kind, number of dimensions, these, values
        extents = raw[at + 2 : at + 2 + raw[at + 1]]
        at += 2 + len(extents) + math.prod(extents) * abs(struct.unpack_from("b", raw, at)[0])
    described = raw[at] if at < len(raw) else 0
    return int(swapped) if at + 1 + described == end else int(offset)


def _parameter(path: Path, raw: bytes, name: str, processor: int) -> C3DParameter:
    kind = struct.unpack_from("b", raw)[0] if len(raw) >= 2 else 0
    if kind not in _SIZES or raw[1] > _MAX_DIMENSIONS or len(raw) < 2 + raw[1]:
        raise _wrong(path, f"parameter '{name[:40]}' is of no known type")
    dimensions = tuple(raw[2 : 2 + raw[1]])
    size = _SIZES[kind]
    for extent in dimensions:
        size *= extent
    begin = 2 + raw[1]
    if begin + size > len(raw):
        raise _wrong(path, f"parameter '{name[:40]}' claims {size} bytes, but has {len(raw) - begin}")
    return C3DParameter(kind, dimensions, raw[begin : begin + size], processor)


def _layout(
    path: Path,
    size: int,
    section: int,
    header: _Header,
    parameters: Mapping[str, Mapping[str, C3DParameter]],
    processor: int,
) -> C3DLayout:
    """Choose among what header and parameters say, and hold it against the file's size."""
    point = parameters.get("POINT", {})
    points = int(_number(point, "USED", header.points))
    scale = _number(point, "SCALE", header.scale) or header.scale
    if not np.isfinite(scale) or scale == 0:
        raise _wrong(path, f"its scale is {scale:g}", allowed="a factor, or a negative number for floats")
    if not 0 <= points <= MAX_POINTS:
        raise _wrong(path, f"it claims {points} points", allowed=f"up to {MAX_POINTS}")
    rate = _rate(path, header, point)
    used, ratio, rotation_start = _rotations(path, parameters.get("ROTATION", {}), rate)
    if not points and not used:
        nothing = "it holds analog channels only, no points" if header.analog else "it holds no points"
        raise _wrong(path, nothing, fix="Export the markers' trajectories too")
    start = _data_start(path, size, section, header, point)
    room = (rotation_start if used and rotation_start > start else size) - start
    width = 4 if scale < 0 else 2
    analog, frames, notes = _fit(path, header, parameters, room, points, width)
    end = rotation_start + 4 * ROTATION_NUMBERS * used * ratio * frames
    if used and (rotation_start < start or end > size):
        raise _wrong(path, f"its {used} rotations in {frames} frames end beyond the file")
    return C3DLayout(
        processor, rate, scale, points, frames, analog, start, used, ratio, rotation_start, parameters, notes
    )


def _rate(path: Path, header: _Header, point: Mapping[str, C3DParameter]) -> float:
    """Frames per second: what the parameter says, and the header where it says nothing [1/s]."""
    stated = _number(point, "RATE", 0.0)
    rate = stated if stated != 0 else header.rate
    if not MIN_RATE <= rate <= MAX_RATE:
        raise _wrong(path, f"its frame rate is {rate:g} per second", allowed=f"{MIN_RATE:g} to {MAX_RATE:g}")
    return rate


def _rotations(path: Path, group: Mapping[str, C3DParameter], rate: float) -> tuple[int, int, int]:
    """Number of matrices, sets of them per frame, and where they begin [bytes]; zeros where there are none."""
    used = int(_number(group, "USED", 0))
    if not used:
        return 0, 1, 0
    ratio = _number(group, "RATIO", 0) or _number(group, "RATE", rate) / rate
    whole = round(ratio) if np.isfinite(ratio) else 0
    if not 1 <= whole <= 1000 or abs(ratio - whole) > 1e-3 * whole:
        raise _wrong(path, f"its rotations come {ratio:g} times a frame", allowed="a whole number of times")
    start = int(_number(group, "DATA_START", 0)) - 1
    if not 0 < used <= MAX_POINTS or start < 1:
        raise _wrong(path, f"it claims {used} rotations from block {start + 1} on")
    return used, whole, start * BLOCK


def _data_start(path: Path, size: int, section: int, header: _Header, point: Mapping[str, C3DParameter]) -> int:
    """Where the data begin [bytes]: what the header says, or else the parameter."""
    stated = (header.start, int(_number(point, "DATA_START", 0)))
    for block in stated:
        if section < (block - 1) * BLOCK < size:
            return (block - 1) * BLOCK
    blocks = -(-size // BLOCK)
    raise _wrong(path, f"it puts the data into block {stated[0]}, but has {blocks} blocks, the first ones taken")


def _fit(
    path: Path,
    header: _Header,
    parameters: Mapping[str, Mapping[str, C3DParameter]],
    room: int,
    points: int,
    width: int,
) -> tuple[int, int, tuple[str, ...]]:
    """Analog samples per frame, frames, and a note, such that they fill the data.

    Where header and parameters contradict each other, the first combination that fills the last block is believed.
    There are ``room`` bytes of data, ``width`` in each number.
    """
    frames = _frame_counts(header, parameters)
    analogs = _analog_counts(header, parameters)
    if not frames:
        raise _wrong(path, "it holds no frames")
    needs = {(analog, count): (4 * points + analog) * count * width for analog, count in product(analogs, frames)}
    first = (analogs[0], frames[0])
    exact = next((pair for pair, need in needs.items() if 0 <= room - need < BLOCK), None)
    analog, count = exact or first
    size = (4 * points + analog) * width  # bytes of a frame
    if exact is None and frames == [_UNKNOWN] and size:
        return analog, room // size, ()
    if count * size > room:
        raise _wrong(path, f"it is cut off after {room // size} of {count} frames of {points} points")
    if (analog, count) == first:
        return analog, count, ()
    said = f"{first[1]} frames with {first[0]} analog samples"
    return analog, count, (f"Header and parameters say {said}, but the data hold {count} with {analog}.",)


def _frame_counts(header: _Header, parameters: Mapping[str, Mapping[str, C3DParameter]]) -> list[int]:
    """What the file says about its number of frames, the most trustworthy first, each once."""
    point, trial = parameters.get("POINT", {}), parameters.get("TRIAL", {})
    ends = [_long(trial, f"ACTUAL_{end}_FIELD") for end in ("START", "END")]
    counts = [_number(point, "FRAMES", 0), _number(point, "LONG_FRAMES", 0)]
    counts += [ends[1] - ends[0] + 1 if ends[1] else 0, header.last - header.first + 1 if header.last else 0]
    known = list(dict.fromkeys(int(count) for count in counts if 0 < count < 2**31))
    return sorted(known, key=lambda count: count == _UNKNOWN)


def _analog_counts(header: _Header, parameters: Mapping[str, Mapping[str, C3DParameter]]) -> list[int]:
    """What the file says about its number of analog samples in a frame, the most trustworthy first, each once."""
    analog = parameters.get("ANALOG", {})
    channels = int(_number(analog, "USED", 0))
    ratio = _number(analog, "RATE", 0) / (_number(parameters.get("POINT", {}), "RATE", 0) or np.inf)
    by_rate = round(ratio) if 0 <= ratio <= 65535 else 0
    counts = [header.analog, channels * header.samples, channels * by_rate]
    return list(dict.fromkeys(counts))


def _long(group: Mapping[str, C3DParameter], name: str) -> float:
    """A number of 32 bits stored as two of 16, the low one first; 0 where it is absent."""
    parts = group[name].numbers() if name in group else np.zeros(0)
    return float(parts[0] + 65536.0 * parts[1]) if len(parts) == 2 else float(parts[0]) if len(parts) else 0.0


def _number(group: Mapping[str, C3DParameter], name: str, otherwise: float) -> float:
    """The first value of a parameter, and ``otherwise`` where it is absent, empty or not a number."""
    values = group[name].numbers() if name in group else np.zeros(0)
    return float(values[0]) if len(values) and np.isfinite(values[0]) else otherwise


def _decode(raw: bytes) -> str:
    """A string up to its first zero, without blanks around it and with no control characters."""
    raw = raw.split(b"\0")[0]
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return "".join(letter if letter.isprintable() else "?" for letter in text.strip()).strip()


def _wrong(path: Path, what: str, allowed: str | None = None, fix: str = _EXPORT) -> RecordingError:
    return RecordingError(f"cannot read the C3D file {path}: {what}", allowed=allowed, fix=fix)
