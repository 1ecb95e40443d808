"""Numbers of a C3D file as the processors of its time store them.

Integers are in either byte order, floats in either or in that of a VAX. A point is four numbers: x, y, z and a residual
that is negative where the point was not seen. A rotation is a 4 x 4 matrix, column by column, and a residual.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array

INTEL, DEC, MIPS = 84, 85, 86
ORDERS = {INTEL: "<", DEC: "<", MIPS: ">"}
ROTATION_NUMBERS = 17
_PIECE = 1 << 24  # [bytes] read at a time, so that no copy of the whole file stands beside the result


def floats_of(raw: bytes, processor: int) -> NDArray[np.float32]:
    """Floats of 32 bits out of any number of bytes divisible by four.

    Args:
        raw: The bytes.
        processor: ``INTEL``, ``DEC`` or ``MIPS``.
    """
    if processor != DEC:
        return np.frombuffer(raw, f"{ORDERS[processor]}f4").astype("<f4")
    # a VAX swaps the halves, and its exponent is two higher for the same number
    swapped = np.frombuffer(raw, "<u2").reshape(-1, 2)[:, ::-1].copy().view("<f4")[:, 0]
    with np.errstate(all="ignore"):
        quarter: NDArray[np.float32] = np.ldexp(swapped, -2)
    return quarter


def read_positions(stream: BinaryIO, start: int, shape: tuple[int, int, int], processor: int, scale: float) -> Array:
    """Positions of all points, shape (T, n, 3) [file's units]; NaN = not seen.

    Args:
        stream: The file.
        start: Where the data begin [bytes].
        shape: Frames T, points n, and analog samples that stand behind the points of each frame.
        processor: ``INTEL``, ``DEC`` or ``MIPS``.
        scale: Factor of integers; negative where the data are floats.

    Raises:
        EOFError: The file is shorter than that.
    """
    frames, points, analog = shape
    result = np.empty((frames, points, 3))
    width = 4 if scale < 0 else 2
    for rows, raw in _pieces(stream, start, frames, (4 * points + analog) * width):
        values = floats_of(raw, processor) if scale < 0 else np.frombuffer(raw, f"{ORDERS[processor]}i2")
        numbers = values.reshape(-1, 4 * points + analog)[:, : 4 * points].reshape(-1, points, 4)
        with np.errstate(invalid="ignore"):  # signalling NaNs of damaged files
            result[rows] = numbers[..., :3] if scale < 0 else numbers[..., :3] * scale
            result[rows][numbers[..., 3] < 0] = np.nan
    return result


def read_poses(stream: BinaryIO, start: int, shape: tuple[int, int, int], processor: int) -> Array:
    """The first of each frame's sets of matrices, shape (T, k, 4, 4).

    Args:
        stream: The file.
        start: Where the matrices begin [bytes].
        shape: Frames T, matrices k in a set, and sets in a frame.
        processor: ``INTEL``, ``DEC`` or ``MIPS``.

    Raises:
        EOFError: The file is shorter than that.
    """
    frames, matrices, sets = shape
    result = np.empty((frames, matrices, 4, 4))
    for rows, raw in _pieces(stream, start, frames, 4 * ROTATION_NUMBERS * matrices * sets):
        numbers = floats_of(raw, processor).reshape(-1, sets, matrices, ROTATION_NUMBERS)[:, 0, :, :16]
        with np.errstate(invalid="ignore"):
            result[rows] = numbers.reshape(-1, matrices, 4, 4).transpose(0, 1, 3, 2)
    return result


def _pieces(stream: BinaryIO, start: int, frames: int, size: int) -> Iterator[tuple[slice, bytes]]:
    """Frames and their bytes, many frames at a time, each of ``size`` bytes; nothing where that is 0."""
    stream.seek(start)
    each = max(1, _PIECE // size) if size else 1
    for first in range(0, frames if size else 0, each):
        rows = slice(first, min(first + each, frames))
        raw = stream.read((rows.stop - first) * size)
        if len(raw) < (rows.stop - first) * size:
            raise EOFError("the file became shorter while it was read")
        yield rows, raw
