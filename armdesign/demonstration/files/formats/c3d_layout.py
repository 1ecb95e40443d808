"""Where everything is in a C3D file, read from its header and parameter section, and checked against its size.

A C3D file is made of blocks of 512 bytes: a header, a section of named parameters in groups, and the data. Integers
may be stored in either byte order and floats in that of a VAX. Every count and pointer is compared with what the file
holds, so that whoever reads the data need not trust the file.
"""

from __future__ import annotations

import math
import os
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.demonstration.files.formats.frame_clock import MAX_RATE, MIN_RATE
from armdesign.demonstration.files.text_files import unreadable
from armdesign.errors import RecordingError

INTEL, DEC, MIPS = 84, 85, 86
ORDERS = {INTEL: "<", DEC: "<", MIPS: ">"}
ROTATION_NUMBERS = 17
BLOCK = 512
MAGIC = 0x50
MAX_POINTS = 10_000
_PARAMETER_BLOCKS = 8192  # 4 MiB; real ones have up to a few hundred
_UNKNOWN = 65535  # frames: "more than fit into 16 bits"
_SIZES = {-1: 1, 1: 1, 2: 2, 4: 4}  # kinds of values: text, byte, 16 bit integer, float
_MAX_DIMENSIONS = 7


@dataclass(frozen=True)
class C3DLayout:
    """Counts and places, all within the file."""

    processor: int  # 84 Intel, 85 DEC, 86 MIPS
    rate: float  # frames per second [1/s]
    scale: float  # factor of integer data; negative where the data are floats
    points: int  # number of points in each frame
    frames: int
    analog: int  # number of analog samples in each frame, which follow its points
    start: int  # where the data begin [bytes]
    rotations: int  # number of 4 x 4 matrices in each set
    ratio: int  # sets of matrices per frame
    rotation_start: int  # where the matrices begin [bytes]
    parameters: C3DParameters  # what the file says of its content
    notes: tuple[str, ...] = ()  # what was contradictory and what was believed


class _Header(NamedTuple):
    """The fields of the first block that are used."""

    points: int
    analog: int
    first: int
    last: int
    scale: float
    start: int
    samples: int
    rate: float


def read_layout(path: Path) -> C3DLayout:
    """Read and check header and parameters."""
    try:
        with path.open("rb") as stream:
            size = os.fstat(stream.fileno()).st_size
            head = stream.read(BLOCK)
            section = _section(head, size)
            stream.seek(section)
            raw = stream.read(_PARAMETER_BLOCKS * BLOCK)
        processor = raw[3] if len(raw) > 3 else 0
        if processor not in ORDERS:
            raise C3DDamage(f"its processor type is {processor}", allowed="84 (Intel), 85 (DEC), 86 (MIPS)")
        header, parameters = _header(head, processor), C3DParameters(raw, processor)
        layout = _layout(size, section, header, parameters, processor)
        is_counted = _frame_counts(header, parameters) != [_UNKNOWN]
        return layout if is_counted else _without_padding(path, layout)
    except C3DDamage as damage:
        message = f"cannot read the C3D file {path}: {damage}"
        raise RecordingError(message, allowed=damage.allowed, fix=damage.fix) from damage
    except (OSError, ValueError) as error:
        raise unreadable(path, error) from error


def _without_padding(path: Path, layout: C3DLayout) -> C3DLayout:
    """A layout whose number of frames was taken from the data, without the zeros that fill up the last block."""
    size = (4 * layout.points + layout.analog) * (4 if layout.scale < 0 else 2)
    most = min((BLOCK - 1) // size, layout.frames - 1) if size else 0
    with path.open("rb") as stream:
        stream.seek(layout.start + (layout.frames - most) * size)
        last = stream.read(most * size)
    used = -(-len(last.rstrip(b"\0")) // size) if size else 0
    return replace(layout, frames=layout.frames - most + used)


def _section(head: bytes, size: int) -> int:
    """Where the parameters begin [bytes]."""
    if len(head) < BLOCK:
        raise C3DDamage(f"it ends within its header, after {size} bytes")
    if head[1] != MAGIC:
        raise C3DDamage(f"its second byte is {head[1]} and not {MAGIC}")
    section = (head[0] - 1) * BLOCK
    if not BLOCK <= section < size:
        blocks = -(-size // BLOCK)
        raise C3DDamage(f"its header puts the parameters into block {head[0]}, but the file has {blocks} blocks")
    return section


def _header(head: bytes, processor: int) -> _Header:
    """The first block."""
    order = ORDERS[processor]
    points, analog, first, last = struct.unpack_from(f"{order}4H", head, 2)
    start, samples = struct.unpack_from(f"{order}2H", head, 16)
    scale, rate = floats_of(head[12:16] + head[20:24], processor).tolist()
    return _Header(points, analog, first, last, scale, start, samples, rate)


def _layout(size: int, section: int, header: _Header, parameters: C3DParameters, processor: int) -> C3DLayout:
    """Choose among what header and parameters say, and hold it against the file's size."""
    points = int(parameters.number("POINT", "USED", header.points))
    scale = parameters.number("POINT", "SCALE", header.scale) or header.scale
    if not np.isfinite(scale) or scale == 0:
        raise C3DDamage(f"its scale is {scale:g}", allowed="a factor, or a negative number for floats")
    if not 0 <= points <= MAX_POINTS:
        raise C3DDamage(f"it claims {points} points", allowed=f"up to {MAX_POINTS}")
    rate = parameters.number("POINT", "RATE") or header.rate
    if not MIN_RATE <= rate <= MAX_RATE:
        raise C3DDamage(f"its frame rate is {rate:g} per second", allowed=f"{MIN_RATE:g} to {MAX_RATE:g}")
    used, ratio, rotation_start = _rotations(parameters, rate)
    if not points and not used:
        nothing = "it holds analog channels only, no points" if header.analog else "it holds no points"
        raise C3DDamage(nothing, fix="Export the markers' trajectories too")
    start = _data_start(size, section, header, parameters)
    room = (rotation_start if used and rotation_start > start else size) - start
    analog, frames, notes = _fit(header, parameters, room, points, 4 if scale < 0 else 2)
    end = rotation_start + 4 * ROTATION_NUMBERS * used * ratio * frames
    if used and (rotation_start < start or end > size):
        raise C3DDamage(f"its {used} rotations in {frames} frames end beyond the file")
    return C3DLayout(
        processor, rate, scale, points, frames, analog, start, used, ratio, rotation_start, parameters, notes
    )


def _rotations(parameters: C3DParameters, rate: float) -> tuple[int, int, int]:
    """Number of matrices, sets of them per frame, and where they begin [bytes]; zeros where there are none."""
    used = int(parameters.number("ROTATION", "USED"))
    if not used:
        return 0, 1, 0
    ratio = parameters.number("ROTATION", "RATIO") or parameters.number("ROTATION", "RATE", rate) / rate
    whole = round(ratio) if np.isfinite(ratio) else 0
    if not 1 <= whole <= 1000 or abs(ratio - whole) > 1e-3 * whole:
        raise C3DDamage(f"its rotations come {ratio:g} times a frame", allowed="a whole number of times")
    start = int(parameters.number("ROTATION", "DATA_START")) - 1
    if not 0 < used <= MAX_POINTS or start < 1:
        raise C3DDamage(f"it claims {used} rotations from block {start + 1} on")
    return used, whole, start * BLOCK


def _data_start(size: int, section: int, header: _Header, parameters: C3DParameters) -> int:
    """Where the data begin [bytes]: what the header says, or else the parameter."""
    stated = (header.start, int(parameters.number("POINT", "DATA_START")))
    for block in stated:
        if section < (block - 1) * BLOCK < size:
            return (block - 1) * BLOCK
    blocks = -(-size // BLOCK)
    raise C3DDamage(f"it puts the data into block {stated[0]}, but has {blocks} blocks, the first ones taken")


def _fit(
    header: _Header, parameters: C3DParameters, room: int, points: int, width: int
) -> tuple[int, int, tuple[str, ...]]:
    """Analog samples per frame, frames, and a note, such that they fill the data.

    Where header and parameters contradict each other, the first combination that fills the last block is believed.
    There are ``room`` bytes of data, ``width`` in each number.
    """
    frames = _frame_counts(header, parameters)
    channels = int(parameters.number("ANALOG", "USED"))
    ratio = parameters.number("ANALOG", "RATE") / (parameters.number("POINT", "RATE") or np.inf)
    by_rate = round(ratio) if 0 <= ratio <= 65535 else 0
    analogs = list(dict.fromkeys([header.analog, channels * header.samples, channels * by_rate]))  # the surest first
    if not frames:
        raise C3DDamage("it holds no frames")
    needs = {(analog, count): (4 * points + analog) * count * width for analog, count in product(analogs, frames)}
    first = (analogs[0], frames[0])
    exact = next((pair for pair, need in needs.items() if 0 <= room - need < BLOCK), None)
    analog, count = exact or first
    size = (4 * points + analog) * width  # bytes of a frame
    if exact is None and frames == [_UNKNOWN] and size:
        return analog, room // size, ()
    if count * size > room:
        raise C3DDamage(f"it is cut off after {room // size} of {count} frames of {points} points")
    if (analog, count) == first:
        return analog, count, ()
    said = f"{first[1]} frames with {first[0]} analog samples"
    return analog, count, (f"Header and parameters say {said}, but the data hold {count} with {analog}.",)


def _frame_counts(header: _Header, parameters: C3DParameters) -> list[int]:
    """What the file says about its number of frames, the most trustworthy first, each once."""
    # The header and POINT:FRAMES have 16 bits. Longer takes are counted in POINT:LONG_FRAMES, a float, or by Vicon in
    # TRIAL:ACTUAL_START_FIELD and ACTUAL_END_FIELD; POINT:FRAMES is a float then, or says 65535.
    start, end = (parameters.long("TRIAL", f"ACTUAL_{which}_FIELD") for which in ("START", "END"))
    counts = [parameters.number("POINT", "FRAMES"), parameters.number("POINT", "LONG_FRAMES")]
    counts += [end - start + 1 if end else 0, header.last - header.first + 1 if header.last else 0]
    known = list(dict.fromkeys(int(count) for count in counts if 0 < count < 2**31))
    return sorted(known, key=lambda count: count == _UNKNOWN)


class C3DDamage(Exception):  # noqa: N818 (never leaves the reader of C3D files)
    """Something in a C3D file cannot be right.

    Attributes:
        allowed: What it could be instead; None where that is unknown.
        fix: What to do about it.
    """

    def __init__(self, what: str, allowed: str | None = None, fix: str = "Export the recording again") -> None:
        super().__init__(what)
        self.allowed, self.fix = allowed, fix


class C3DParameter(NamedTuple):
    """One parameter of the file."""

    kind: int  # -1 text, 1 byte, 2 16 bit integer, 4 float
    width: int  # length of each string of a text
    raw: bytes  # of its values


class C3DParameters:
    """All parameters of a file, by group and name in capitals, such as ``POINT`` and ``RATE``."""

    def __init__(self, raw: bytes, processor: int) -> None:
        self._processor = processor
        groups: dict[int, str] = {}
        members: dict[int, dict[str, C3DParameter]] = {}
        for number, name, content in _records(raw, processor):
            if number < 0:
                groups[-number] = name
            else:
                members.setdefault(number, {})[name] = _parameter(content, name)
        self._groups: dict[str, Mapping[str, C3DParameter]] = {}
        for number, group in groups.items():
            self._groups[group] = {**self._groups.get(group, {}), **members.get(number, {})}

    def number(self, group: str, name: str, otherwise: float = 0.0) -> float:
        """The first value of a parameter; ``otherwise`` where it is absent, empty, a text or not finite."""
        values = self._numbers(group, name)
        return float(values[0]) if len(values) and np.isfinite(values[0]) else otherwise

    def long(self, group: str, name: str) -> float:
        """A number of 32 bits stored as two of 16, the low one first; 0 where it is absent."""
        parts = self._numbers(group, name)
        return float(parts[0] + 65536.0 * parts[1]) if len(parts) == 2 else float(parts[0]) if len(parts) else 0.0

    def texts(self, group: str, name: str) -> list[str]:
        """The strings of a parameter and of its continuations (``LABELS``, ``LABELS2``, ...); none if it is absent."""
        # An extent is one byte, so that a parameter holds 255 strings at most and further ones are in the next.
        parameters = self._groups.get(group, {})
        found: list[str] = []
        part, number = name, 1
        while part in parameters:
            kind, width, raw = parameters[part]
            found += [_text(raw[at : at + width]) for at in range(0, len(raw), width)] if kind == -1 and raw else []
            number += 1
            part = f"{name}{number}"
        return found

    def _numbers(self, group: str, name: str) -> Array:
        """Values as floats, integers taken as unsigned; none where the parameter is absent or a text."""
        parameter = self._groups.get(group, {}).get(name)
        if parameter is None or parameter.kind == -1:
            return np.zeros(0)
        if parameter.kind == 4:
            return floats_of(parameter.raw, self._processor).astype(float)
        order = "u1" if parameter.kind == 1 else f"{ORDERS[self._processor]}u2"
        return np.frombuffer(parameter.raw, order).astype(float)


def _records(raw: bytes, processor: int) -> Iterator[tuple[int, str, bytes]]:
    """Group number (negative: a group, positive: a parameter of it), name and content of every record."""
    at = 4
    while at + 2 <= len(raw) and raw[at]:
        length, number = struct.unpack_from("bb", raw, at)  # a negative length means "locked"
        begin = at + 2 + abs(length)
        if begin + 2 > len(raw):
            raise C3DDamage("its parameter section ends within a name")
        name = _text(raw[at + 2 : begin]).upper()
        offset = _offset(raw, begin, number, processor)
        end = begin + offset if offset else len(raw)
        if end > len(raw) or (offset and offset < 2):
            raise C3DDamage(f"parameter '{name[:40]}' points {offset} bytes on, which is not a parameter")
        yield number, name, raw[begin + 2 : end]
        at = end


def _offset(raw: bytes, begin: int, number: int, processor: int) -> int:
    """How far on the next record begins [bytes]; 0 where this is the last.

    Some big-endian files of SGI have the last offset in little-endian order. A record has its own length, and only
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
    described = raw[at] if at < len(raw) else 0  # length of the description, which is the end of a record
    return int(swapped) if at + 1 + described == end else int(offset)


def _parameter(raw: bytes, name: str) -> C3DParameter:
    """A parameter out of the content of its record."""
    kind = struct.unpack_from("b", raw)[0] if len(raw) >= 2 else 0
    if kind not in _SIZES or raw[1] > _MAX_DIMENSIONS or len(raw) < 2 + raw[1]:
        raise C3DDamage(f"parameter '{name[:40]}' is of no known type")
    begin = 2 + raw[1]
    extents = raw[2:begin]  # the fastest first
    size = _SIZES[kind] * math.prod(extents)
    if begin + size > len(raw):
        raise C3DDamage(f"parameter '{name[:40]}' claims {size} bytes, but has {len(raw) - begin}")
    return C3DParameter(kind, extents[0] if extents else 1, raw[begin : begin + size])


def _text(raw: bytes) -> str:
    """A string up to its first zero, without blanks around it and with no control characters."""
    raw = raw.split(b"\0")[0]
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return "".join(letter if letter.isprintable() else "?" for letter in text.strip()).strip()


def floats_of(raw: bytes, processor: int) -> NDArray[np.float32]:
    """Floats of 32 bits out of any number of bytes divisible by four, as ``processor`` stores them."""
    if processor != DEC:
        return np.frombuffer(raw, f"{ORDERS[processor]}f4").astype("<f4")
    # F_floating of the VAX (DEC): the halves are swapped, and the exponent is two higher for the same number.
    swapped = np.frombuffer(raw, "<u2").reshape(-1, 2)[:, ::-1].copy().view("<f4")[:, 0]
    with np.errstate(all="ignore"):
        quarter: NDArray[np.float32] = np.ldexp(swapped, -2)
    return quarter
