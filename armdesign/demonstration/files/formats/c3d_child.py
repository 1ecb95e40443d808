"""Read the numbers of a C3D file through ezc3d, as a process of its own.

ezc3d is compiled code without bounds checks: an odd file makes it crash, or ask for memory without end. So it works in
this process, which may fail without harm, and on copies of the data in a form that it reads without mistake: pieces
of some thousand frames, in which nothing stands but points and rotations. (Given analog samples, ezc3d derives their
number from a ratio of two rates cut down to an integer, and a rate such as 33.3333 shifts every point after them.)

Run as a script, not as part of the package, so that it starts quickly; it imports NumPy and ezc3d only. The one
argument is a :class:`Job` as JSON.
"""

from __future__ import annotations

import json
import os
import struct
import sys
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

if __name__ == "__main__":  # the folder of this script holds no module for others
    sys.path[:] = [
        entry for entry in sys.path if os.path.realpath(entry) != os.path.dirname(os.path.realpath(__file__))
    ]

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

INTEL, DEC, MIPS = 84, 85, 86
ROTATION_NUMBERS = 17  # a 4 x 4 matrix and a residual
_BLOCK = 512
_PIECE = 60_000  # points and rotations in a piece; ezc3d needs some 200 bytes for each
_MOST_FRAMES = 65_000  # in one piece, as frames are counted with 16 bits


class Job(NamedTuple):
    """What to read and where to put it. Places in bytes, all within the file.

    Attributes:
        path: The C3D file.
        folder: Empty folder for the pieces and the results, ``points`` with shape (frames, points, 3) and ``rotations``
            with shape (frames, rotations, 4, 4), both as plain native doubles; NaN = missing.
        processor: 84 Intel, 85 DEC, 86 MIPS.
        scale: Factor of integer data; negative where the data are floats.
        frames: Number of frames.
        points: Number of points in each frame.
        analog: Number of samples behind the points of each frame.
        start: Where the data begin.
        rotations: Number of matrices in each set.
        ratio: Sets of matrices per frame, of which the first is read.
        rotation_start: Where the matrices begin.
        memory: Most bytes of address space that this process may take.
        seconds: Most seconds of computing time that it may take.
    """

    path: str
    folder: str
    processor: int
    scale: float
    frames: int
    points: int
    analog: int
    start: int
    rotations: int
    ratio: int
    rotation_start: int
    memory: int
    seconds: int


def floats_of(raw: bytes, processor: int) -> NDArray[np.float32]:
    """Floats of 32 bits in a processor's order, out of any number of bytes divisible by four."""
    if processor == DEC:  # the two halves swapped, and an exponent that is two higher
        swapped = np.frombuffer(raw, "<u2").reshape(-1, 2)[:, ::-1].copy().view("<f4")[:, 0]
        with np.errstate(all="ignore"):
            quarter: NDArray[np.float32] = np.ldexp(swapped, -2)
        return quarter
    return np.frombuffer(raw, ">f4" if processor == MIPS else "<f4").astype("<f4")


def integers_of(raw: bytes, processor: int) -> NDArray[np.int16]:
    """Signed integers of 16 bits in a processor's order."""
    return np.frombuffer(raw, ">i2" if processor == MIPS else "<i2").astype("<i2")


def piece_of(scale: float, points: NDArray[np.generic], rotations: NDArray[np.generic]) -> bytes:
    """A C3D file of nothing but these points and rotations, as Intel processors write it.

    Args:
        scale: Factor of integer data; negative where the data are floats.
        points: Numbers of the points, shape (T, 4 n).
        rotations: Numbers of the matrices, shape (T, 17 k).
    """
    frames, words = points.shape
    numbers = _padded(points.tobytes())
    matrices = rotations.shape[1] // ROTATION_NUMBERS
    start = 2 + _PARAMETER_BLOCKS
    group = _group(1, "POINT") + _integer(1, "USED", words // 4) + _integer(1, "FRAMES", frames)
    group += _float(1, "SCALE", scale) + _float(1, "RATE", 100.0) + _integer(1, "DATA_START", start)
    if matrices:
        group += _group(2, "ROTATION") + _integer(2, "USED", matrices) + _integer(2, "RATIO", 1)
        group += _integer(2, "DATA_START", start + len(numbers) // _BLOCK)
    header = struct.pack("<2B5Hf2Hf", 2, 0x50, words // 4, 0, 1, frames, 0, scale, start, 0, 100.0)
    section = bytes([1, 0x50, _PARAMETER_BLOCKS, INTEL]) + group + b"\0\0"
    return _padded(header) + section.ljust(_PARAMETER_BLOCKS * _BLOCK, b"\0") + numbers + rotations.tobytes()


_PARAMETER_BLOCKS = 1


def _padded(raw: bytes) -> bytes:
    return raw + bytes(-len(raw) % _BLOCK)


def _group(number: int, name: str) -> bytes:
    return struct.pack("<2b", len(name), -number) + name.encode() + struct.pack("<HB", 3, 0)


def _integer(number: int, name: str, value: int) -> bytes:
    return struct.pack("<2b", len(name), number) + name.encode() + struct.pack("<HbBHB", 7, 2, 0, value, 0)


def _float(number: int, name: str, value: float) -> bytes:
    return struct.pack("<2b", len(name), number) + name.encode() + struct.pack("<HbBfB", 9, 4, 0, value, 0)


def convert(job: Job) -> None:
    """Read a file piece by piece into ``points`` and ``rotations``."""
    folder = Path(job.folder)
    each = max(1, min(_MOST_FRAMES, _PIECE // max(1, job.points + job.rotations)))
    with (
        open(job.path, "rb") as source,
        open(folder / "points", "wb") as points,
        open(folder / "rotations", "wb") as turns,
    ):
        for first in range(0, job.frames, each):
            frames = min(each, job.frames - first)
            piece = folder / "piece.c3d"
            piece.write_bytes(
                piece_of(job.scale, _points(source, job, first, frames), _turns(source, job, first, frames))
            )
            xyz, matrices = _read(str(piece), frames, job.points, job.rotations)
            points.write(xyz.tobytes())
            turns.write(matrices.tobytes())


def _points(source: BinaryIO, job: Job, first: int, frames: int) -> NDArray[np.generic]:
    """The numbers of the points in some frames, shape (frames, 4 points)."""
    numbers = 4 * job.points + job.analog
    width = 4 if job.scale < 0 else 2
    source.seek(job.start + first * numbers * width)
    raw = source.read(frames * numbers * width)
    values = floats_of(raw, job.processor) if width == 4 else integers_of(raw, job.processor)
    return values.reshape(frames, numbers)[:, : 4 * job.points]


def _turns(source: BinaryIO, job: Job, first: int, frames: int) -> NDArray[np.generic]:
    """The numbers of each frame's first set of matrices, shape (frames, 17 rotations)."""
    numbers = ROTATION_NUMBERS * job.rotations
    source.seek(job.rotation_start + first * job.ratio * numbers * 4)
    raw = source.read(frames * job.ratio * numbers * 4)
    return floats_of(raw, job.processor).reshape(frames, job.ratio * numbers)[:, :numbers]


def _read(path: str, frames: int, points: int, rotations: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions, shape (frames, points, 3), and matrices, shape (frames, rotations, 4, 4), as ezc3d reads them."""
    import ezc3d.ezc3d as library  # noqa: PLC0415 (this module is imported without it too)

    content = library.c3d(path)
    xyz = np.full((frames, points, 3), np.nan)
    matrices = np.full((frames, rotations, 4, 4), np.nan)
    if points:
        found = content.get_points()[:3].transpose(2, 1, 0)  # may lack frames at the end in which nothing is seen
        xyz[: len(found)] = found
    if rotations:
        turned = content.get_rotations().transpose(3, 2, 0, 1)
        matrices[: len(turned)] = turned
    return xyz, matrices


def _limit(memory: int, seconds: int) -> None:
    """Let the system end this process when it takes too much, where the system can do that."""
    try:
        import resource  # noqa: PLC0415 (not on every system)
    except ImportError:
        return
    for what, most in ((resource.RLIMIT_AS, memory), (resource.RLIMIT_CPU, seconds), (resource.RLIMIT_CORE, 0)):
        hard = resource.getrlimit(what)[1]
        limit = most if hard == resource.RLIM_INFINITY else min(most, hard)
        try:
            resource.setrlimit(what, (limit, hard))
        except (ValueError, OSError):  # such as on macOS, which knows no limit on memory
            continue


def main() -> int:
    """Carry out the job in the first argument; the reason goes to the error stream where it fails."""
    try:
        job = Job(**json.loads(sys.argv[1]))
        _limit(job.memory, job.seconds)
        convert(job)
    except MemoryError:
        return _failed("it takes too much memory")
    except Exception as error:  # whatever ezc3d throws
        return _failed(" ".join(f"{type(error).__name__}: {error}".split()))
    return 0


def _failed(reason: str) -> int:
    print(reason[:300], file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())
