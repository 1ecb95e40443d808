"""Where everything stands in a C3D file, read from its header and parameter section, and checked against its size.

A C3D file is made of blocks of 512 bytes: a header, a section of named parameters in groups, and the data. Whole
numbers may be stored in either byte order and floats in that of a VAX. Every count and pointer is compared with what
the file holds, so that whoever reads the data need not trust the file.
"""

from __future__ import annotations

import os
import struct
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np

from armdesign.demonstration.files.formats.c3d_numbers import ORDERS, ROTATION_NUMBERS, floats_of
from armdesign.demonstration.files.formats.c3d_parameters import C3DDamage, C3DParameters
from armdesign.demonstration.files.formats.frame_clock import MAX_RATE, MIN_RATE
from armdesign.demonstration.files.sniff import unreadable
from armdesign.errors import RecordingError

BLOCK = 512
MAGIC = 0x50
MAX_POINTS = 10_000
_PARAMETER_BLOCKS = 8192  # 4 MiB; real ones have up to a few hundred
_UNKNOWN = 65535  # frames: "more than fit into 16 bits"


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
        parameters: What the file says of its content.
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
    parameters: C3DParameters
    notes: tuple[str, ...] = ()


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
    """Read and check header and parameters.

    Args:
        path: The file.

    Raises:
        RecordingError: The file cannot be read, ends too early, or a count or pointer in it cannot be right.
    """
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
        return _layout(size, section, _header(head, processor), C3DParameters(raw, processor), processor)
    except C3DDamage as damage:
        message = f"cannot read the C3D file {path}: {damage}"
        raise RecordingError(message, allowed=damage.allowed, fix=damage.fix) from damage
    except (OSError, ValueError) as error:
        raise unreadable(path, error) from error


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
    frames, analogs = _frame_counts(header, parameters), _analog_counts(header, parameters)
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
    start, end = (parameters.long("TRIAL", f"ACTUAL_{which}_FIELD") for which in ("START", "END"))
    counts = [parameters.number("POINT", "FRAMES"), parameters.number("POINT", "LONG_FRAMES")]
    counts += [end - start + 1 if end else 0, header.last - header.first + 1 if header.last else 0]
    known = list(dict.fromkeys(int(count) for count in counts if 0 < count < 2**31))
    return sorted(known, key=lambda count: count == _UNKNOWN)


def _analog_counts(header: _Header, parameters: C3DParameters) -> list[int]:
    """What the file says about its number of analog samples in a frame, the most trustworthy first, each once."""
    channels = int(parameters.number("ANALOG", "USED"))
    ratio = parameters.number("ANALOG", "RATE") / (parameters.number("POINT", "RATE") or np.inf)
    by_rate = round(ratio) if 0 <= ratio <= 65535 else 0
    return list(dict.fromkeys([header.analog, channels * header.samples, channels * by_rate]))
