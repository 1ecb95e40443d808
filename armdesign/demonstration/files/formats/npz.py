"""NumPy files of positions: an NPZ with arrays by name, or an NPY with one array.

    positions   (T, J, 3)    names  (J,)      time  (T,) [s], or  rate  [1/s]
    units "m"   up "z"       confidence (T, J)    quaternions (T, J, 4) x, y, z, w

The way out for AMASS, FreeMoCap, MediaPipe and every script: ``np.savez("take.npz", positions=p, names=n, rate=100)``.
Other usual names are understood (joints, markers, keypoints_3d; joint_names; fps, mocap_framerate). Points without
names are known by their number: 33 of MediaPipe, 22, 24, 52 or 55 of SMPL. Files of SMPL parameters alone (poses,
betas, trans, as AMASS has them) hold no places: these come from the licensed body model.
"""

from __future__ import annotations

import io
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.formats.frame_clock import MAX_RATE, MIN_RATE
from armdesign.demonstration.files.formats.marker_tables import UNITS
from armdesign.demonstration.files.keypoints import Seen, take_of_arrays
from armdesign.demonstration.files.text_files import MAX_NUMBERS
from armdesign.demonstration.recording import Take
from armdesign.errors import RecordingError

Arrays = dict[str, np.ndarray]

_PLACES = (
    *("positions", "position", "joints", "joints_3d", "joint_positions", "joints3d", "jtr", "markers", "points"),
    *("keypoints_3d", "keypoints3d", "poses_3d", "positions_3d", "landmarks", "world_landmarks", "xyz", "arr_0"),
)
_NAMES = ("names", "joint_names", "joints_names", "marker_names", "labels", "point_names", "keypoint_names")
_TIMES = ("time", "times", "timestamps", "timestamp", "t")
_RATES = ("rate", "fps", "frame_rate", "framerate", "mocap_frame_rate", "mocap_framerate", "frequency")
_TURNS = ("quaternions", "orientations", "quats", "rotations")
_CONFIDENCE = ("confidence", "confidences", "visibility", "scores")
_PARAMETERS = {"poses", "pose_body", "betas", "trans", "root_orient", "body_pose", "transl", "global_orient"}
_MAGIC, _ZIP = b"\x93NUMPY", b"PK\x03\x04"
_MOST_FILES = 100
_FIX = "Save positions (T, J, 3), names, and rate or time: np.savez('take.npz', positions=p, names=n, rate=100)"


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes is an NPY, or a ZIP that begins with one."""
    return head.startswith(_MAGIC) or (head.startswith(_ZIP) and b".npy" in head[30:300])


def read(path: Path) -> Take:
    """Read positions of points."""
    arrays = _arrays(path)
    places = _first(arrays, _PLACES, lambda a: a.ndim == 3 and a.shape[2] == 3 and a.dtype.kind in "fiu")
    if places is None:
        shaped = [a for a in arrays.values() if a.ndim == 3 and a.shape[2] == 3 and a.dtype.kind in "fiu"]
        places = shaped[0] if len(shaped) == 1 else None
    if places is None:
        raise _without_places(path, arrays)
    frames, count = places.shape[:2]
    names = _first(arrays, _NAMES, lambda a: a.shape == (count,) and a.dtype.kind in "US")
    time = _first(arrays, _TIMES, lambda a: a.shape == (frames,) and a.dtype.kind in "fiu")
    rate = _first(arrays, _RATES, lambda a: a.size == 1 and a.dtype.kind in "fiu")
    turns = _first(arrays, _TURNS, lambda a: a.shape == (frames, count, 4) and a.dtype.kind in "fiu")
    confidence = _first(arrays, _CONFIDENCE, lambda a: a.shape == (frames, count) and a.dtype.kind in "fiu")
    times = np.full(frames, np.nan) if time is None else np.asarray(time, dtype=float)
    if time is not None and np.isnan(times).any():
        raise RecordingError(f"{path}: times are missing", fix=_FIX)
    form = "NumPy NPZ" if len(arrays) > 1 or "arr" not in arrays else "NumPy NPY"
    seen = Seen(times, _numbers(places), *(None if a is None else _numbers(a) for a in (confidence, turns)))
    take = take_of_arrays(path, form, seen, None if names is None else [_text(name) for name in names])
    unit, up = (_word(arrays, key).lower() for key in ("units", "up"))
    declared = None if rate is None else float(rate.reshape(-1)[0])
    if declared is not None and not MIN_RATE <= declared <= MAX_RATE:
        allowed = f"{MIN_RATE:g} to {MAX_RATE:,.0f} frames per second"
        raise RecordingError(f"{path}: the rate is {declared:g}", value=declared, allowed=allowed, fix=_FIX)
    if declared is not None and not take.timed:
        take = replace(take, time=take.time / declared, timed=True)
    return replace(take, units=UNITS.get(unit), up=up if up.lstrip("-") in ("x", "y", "z") else None, rate=declared)


def _arrays(path: Path) -> Arrays:
    """All arrays of a file by their names; none of objects, as these would be pickled."""
    fix = "Save it again with np.savez; names as an array of text, not of objects"
    try:
        with path.open("rb") as stream:
            if stream.read(len(_MAGIC)) == _MAGIC:
                return {"arr": _array(path.read_bytes(), path)}
        with zipfile.ZipFile(path) as archive:
            files = [each for each in archive.infolist() if each.filename.endswith(".npy")]
            if len(files) > _MOST_FILES or sum(each.file_size for each in files) > 8 * MAX_NUMBERS:
                allowed = f"at most {_MOST_FILES} arrays, 1 GiB in all"
                raise RecordingError(f"{path} holds more than any recording", allowed=allowed, fix="Save less")
            contents = {each.filename.removesuffix(".npy"): archive.read(each) for each in files}
    except (OSError, ValueError, zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError) as error:
        raise RecordingError(f"{path} is damaged or cut off: {error}", fix=fix) from error
    return {name: array for name, content in contents.items() if (array := _array(content, path)) is not None}


def _array(content: bytes, path: Path) -> np.ndarray:
    """The array in the bytes of an NPY file."""
    try:
        stream = io.BytesIO(content)
        version = np.lib.format.read_magic(stream)
        read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, in_columns, kind = read(stream)
        if kind.hasobject:
            return np.empty(0)
        size = int(np.prod(shape, dtype=object)) if shape else 1
        if size * kind.itemsize > len(content) - stream.tell():
            raise ValueError(f"{size} numbers are announced, the file is too short for them")
        flat = np.frombuffer(content, dtype=kind, count=size, offset=stream.tell())
        return flat.reshape(shape[::-1]).T if in_columns else flat.reshape(shape)
    except (ValueError, TypeError, SyntaxError, EOFError, OverflowError, MemoryError) as error:
        raise RecordingError(f"{path} is damaged or cut off: {error}", fix="Save it again with np.savez") from error


def _first(arrays: Arrays, names: tuple[str, ...], fits: object) -> np.ndarray | None:
    """The first array of one of these names, in any letters, that fits."""
    lower: Mapping[str, np.ndarray] = {name.lower(): array for name, array in arrays.items()}
    return next((lower[name] for name in names if name in lower and fits(lower[name])), None)  # type: ignore[operator]


def _word(arrays: Arrays, name: str) -> str:
    """A text in an array; empty where there is none."""
    array = arrays.get(name)
    return _text(array.reshape(-1)[0]) if array is not None and array.size == 1 and array.dtype.kind in "US" else ""


def _numbers(array: np.ndarray) -> Array:
    """An array of any kind of numbers, in any order of its bytes."""
    return np.asarray(array, dtype=float)


def _text(value: object) -> str:
    """A name in an array of text or bytes."""
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)


def _without_places(path: Path, arrays: Arrays) -> RecordingError:
    """What a file holds in place of positions, and what to export."""
    shapes = {name: array.shape for name, array in list(arrays.items())[:12]}
    if _PARAMETERS & {name.lower() for name in arrays}:
        message = f"{path} holds parameters of SMPL (as AMASS has them), no places of joints"
        fix = f"Run the body model on them, and save its joints. {_FIX}"
        return RecordingError(message, value=shapes, allowed="joints of shape (T, J, 3)", fix=fix)
    listed = ", ".join(f"{name} {shape}" for name, shape in shapes.items()) or "nothing"
    return RecordingError(f"{path} holds no positions, but {listed}", value=shapes, fix=_FIX)
