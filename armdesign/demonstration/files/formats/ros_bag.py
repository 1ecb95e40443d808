"""Bags of ROS 1 and ROS 2 (``.bag``, ``.db3``, ``.mcap``, or a folder with ``metadata.yaml``), by the extra ``ros``.

Read are the poses of what was tracked: transforms (/tf), poses with or without covariance, odometry, points, arrays of
poses, markers of visualization and of motion capture. A body is called after its frame or topic. The message with the
most stamps gives the frames; others come between two of their own, not too far apart, by interpolation. Lengths are
metres (REP 103); markers of Vicon's driver are millimetres and are converted.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.body_names import AZURE_KINECT
from armdesign.demonstration.files.formats.marker_tables import clean_name, listed
from armdesign.demonstration.files.quaternions import product, rotated, slerp, unit_continuous
from armdesign.demonstration.files.text_files import MAX_NUMBERS
from armdesign.demonstration.recording import Step, Take, median_step
from armdesign.errors import ArmDesignError, MissingExtraError, RecordingError

_ENDINGS = {b"#ROSBAG V2.0": ".bag", b"\x89MCAP0\r\n": ".mcap", b"SQLite format 3\0": ".db3"}
_METADATA = "metadata.yaml"
_LAST_WORDS = ("pose", "transform", "point", "position", "odom", "pose_stamped", "tf", "markers", "poses")
_BRIDGED = 1.5  # steps of its own that a body may be away and still be interpolated
_SAME = 1e-6  # [s]
_MOST_BODIES = 2_000
_FIX = "Record topics of poses: tf, PoseStamped, PoseArray, TransformStamped, MarkerArray"


class _Pose(NamedTuple):
    """Where a body is."""

    time: float  # [s]
    place: tuple[float, float, float]
    turn: tuple[float, float, float, float] | None  # x, y, z, w


Series = dict[str, list[_Pose]]


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes is a bag."""
    return any(head.startswith(magic) for magic in _ENDINGS)


def is_bag_folder(path: Path) -> bool:
    """Whether a folder is a bag of ROS 2."""
    return os.path.isfile(path / _METADATA)  # False for names too long, too


def read(path: Path) -> Take:
    """Read the poses in a bag.

    Raises:
        MissingExtraError: rosbags is not installed.
        RecordingError: The bag is damaged, or holds no poses.
    """
    try:
        series, others = _collected(path)
    except ArmDesignError:
        raise
    except Exception as error:  # of the library, of whatever lies below it, as the bag is damaged
        why = f"{type(error).__name__}: {error}"
        message = f"{path} is a ROS bag that cannot be read: {why}"
        raise RecordingError(message, fix="Check it, or record it again") from error
    series = {name: each for name, poses in series.items() if len(each := _in_order(poses)) > 1}
    if not series:
        there = f"; its topics are of the types {listed(others)}" if others else ""
        raise RecordingError(f"{path} holds no poses of bodies{there}", value=others, fix=_FIX)
    first = max(series, key=lambda name: len(series[name]))
    time = np.array([pose.time for pose in series[first]])
    points, turns = {}, {}
    for name, poses in series.items():
        points[name], turned = _at(time, poses)
        if turned is not None:
            turns[name] = turned
    steps = [Step("topics", f"Other messages were left out: {listed(others)}.", {"types": others})] if others else []
    return Take(
        time=time,
        points=points,
        orientations=turns,
        source=str(path),
        format="ROS bag",
        units="m",
        steps=tuple(steps),
    )


def _collected(path: Path) -> tuple[Series, list[str]]:
    """Poses by the body's name, and the types of messages that hold none."""
    try:
        from rosbags.highlevel import AnyReader  # noqa: PLC0415, an extra
        from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415, an extra
    except ImportError as error:
        message = f"{path} is a ROS bag, which takes rosbags, and that is not installed"
        raise MissingExtraError(message, fix="Run: pip install 'armdesign[ros]'") from error
    frames, series = _Tree(), _Collector(path)
    with ExitStack() as stack:
        named = _with_ending(path, stack)
        types = get_typestore(Stores.ROS1_NOETIC if named.suffix == ".bag" else Stores.ROS2_HUMBLE)
        reader = stack.enter_context(AnyReader([named], default_typestore=types))
        wanted = [each for each in reader.connections if _kind(each.msgtype) in _READERS]
        kinds = {str(each.msgtype) for each in reader.connections}
        others = sorted(kinds - {str(each.msgtype) for each in wanted})
        if wanted:
            for connection, stamp, data in reader.messages(connections=wanted):
                content = reader.deserialize(data, connection.msgtype)
                for name, pose in _READERS[_kind(connection.msgtype)](content, connection.topic, 1e-9 * stamp, frames):
                    series.add(name, pose)
    return series.found, others


class _Collector:
    """Poses by name, within limits."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.found: Series = {}
        self._count = 0

    def add(self, name: str, pose: _Pose) -> None:
        """Add one."""
        self.found.setdefault(clean_name(name) or "body", []).append(pose)
        self._count += 1
        if len(self.found) > _MOST_BODIES or 8 * self._count > MAX_NUMBERS:
            what = f"{_MOST_BODIES:,} bodies" if len(self.found) > _MOST_BODIES else f"{MAX_NUMBERS:,} numbers"
            fix = "Record fewer topics, or for a shorter time"
            raise RecordingError(f"{self.path} holds more than {what}", fix=fix)


def _with_ending(path: Path, stack: ExitStack) -> Path:
    """The bag under a name whose ending tells its kind, as the library goes by that."""
    if path.is_dir():
        return path
    with path.open("rb") as stream:
        head = stream.read(16)
    ending = next((ending for magic, ending in _ENDINGS.items() if head.startswith(magic)), path.suffix)
    if path.suffix == ending:
        return path
    link = Path(stack.enter_context(tempfile.TemporaryDirectory())) / f"bag{ending}"
    link.symlink_to(path.resolve())
    return link


def _kind(msgtype: str) -> str:
    """Name of a message's type without its package."""
    return msgtype.rpartition("/")[2]


def _time(message: Any, stamp: float) -> float:  # noqa: ANN401 (made at run time)
    """When a message counts: its header's stamp, or when it was received [s]."""
    said = getattr(getattr(message, "header", None), "stamp", None)
    if said is None:
        return stamp
    time = said.sec + 1e-9 * said.nanosec
    return float(time) if time > 0 else stamp


def _pose(time: float, position: Any, orientation: Any = None, scale: float = 1.0) -> _Pose:  # noqa: ANN401
    """A pose out of a message's parts; a quaternion of zeros is none."""
    place = (scale * position.x, scale * position.y, scale * position.z)
    if orientation is None:
        return _Pose(time, place, None)
    turn = (orientation.x, orientation.y, orientation.z, orientation.w)
    return _Pose(time, place, turn if any(turn) else None)


def _of_topic(topic: str) -> str:
    """A body's name out of its topic: ``/vrpn_client_node/RightHand/pose`` is ``RightHand``."""
    words = [word for word in topic.split("/") if word]
    while len(words) > 1 and words[-1].lower() in _LAST_WORDS:
        words.pop()
    return words[-1] if words else "body"


class _Tree:
    """Frames of transforms, each in the frame it hangs on."""

    def __init__(self) -> None:
        self._known: dict[str, tuple[str, Array, Array]] = {}

    def take(self, transform: Any) -> str:  # noqa: ANN401 (made at run time)
        """Take a transform; the frame that it places."""
        child = transform.child_frame_id.strip("/")
        v, q = transform.transform.translation, transform.transform.rotation
        place, turn = np.array([v.x, v.y, v.z]), np.array([q.x, q.y, q.z, q.w])
        self._known[child] = (transform.header.frame_id.strip("/"), place, turn)
        return str(child)

    def pose(self, child: str, time: float) -> _Pose | None:
        """Where a frame is in the outermost one; None where it hangs on itself."""
        parent, place, turn = self._known[child]
        seen = {child}
        while parent in self._known:
            if parent in seen:
                return None
            seen.add(parent)
            above, offset, frame = self._known[parent]
            place = offset + rotated(frame[:, None], place[:, None])[:, 0]
            turn = product(frame, turn)
            parent = above
        x, y, z = place.tolist()
        return _Pose(time, (x, y, z), tuple(turn.tolist()) if turn.any() else None)


Found = Iterator[tuple[str, _Pose]]


def _transforms(message: Any, topic: str, stamp: float, frames: _Tree) -> Found:  # noqa: ANN401
    """Transforms of tf."""
    changed = [(frames.take(each), _time(each, stamp)) for each in message.transforms]
    if topic.endswith("static"):  # sent once; what hangs on them moves
        return
    for child, time in changed:
        pose = frames.pose(child, time)
        if pose is not None:
            yield child, pose


def _transform(message: Any, topic: str, stamp: float, frames: _Tree) -> Found:  # noqa: ANN401
    """One transform, as drivers of motion capture send it."""
    part = message.transform
    yield (
        message.child_frame_id.strip("/") or _of_topic(topic),
        _pose(_time(message, stamp), part.translation, part.rotation),
    )


def _single(message: Any, topic: str, stamp: float, frames: _Tree) -> Found:  # noqa: ANN401
    """A pose, with or without covariance, of a body or an odometry."""
    pose = message.pose
    pose = getattr(pose, "pose", pose)
    yield _of_topic(topic), _pose(_time(message, stamp), pose.position, pose.orientation)


def _point(message: Any, topic: str, stamp: float, frames: _Tree) -> Found:  # noqa: ANN401
    """A point."""
    yield _of_topic(topic), _pose(_time(message, stamp), message.point)


def _array(message: Any, topic: str, stamp: float, frames: _Tree) -> Found:  # noqa: ANN401
    """An array of poses, numbered from 1 on."""
    for i, pose in enumerate(message.poses):
        yield f"{_of_topic(topic)} {i + 1}", _pose(_time(message, stamp), pose.position, pose.orientation)


def _markers(message: Any, topic: str, stamp: float, frames: _Tree) -> Found:  # noqa: ANN401
    """Markers of visualization, of a driver of motion capture, or the joints of an Azure Kinect."""
    markers = message.markers
    is_body = bool(markers) and all(hasattr(each, "id") for each in markers) and "body" in topic.lower()
    for marker in markers:
        if hasattr(marker, "translation"):  # vicon_bridge
            if not getattr(marker, "occluded", False):
                name = ":".join(filter(None, (getattr(marker, "subject_name", ""), marker.marker_name)))
                yield name, _pose(_time(message, stamp), marker.translation, scale=1e-3)
        elif not hasattr(marker, "pose"):
            continue
        elif is_body and len(markers) % len(AZURE_KINECT) == 0:  # its driver numbers bodies by hundreds
            body, joint = divmod(marker.id, 100)
            if body == min(each.id for each in markers) // 100 and 0 <= joint < len(AZURE_KINECT):
                pose = _pose(_time(marker, stamp), marker.pose.position, marker.pose.orientation)
                yield AZURE_KINECT[joint], pose
        else:
            name = f"{marker.ns or _of_topic(topic)} {marker.id}"
            yield name, _pose(_time(marker, stamp), marker.pose.position, marker.pose.orientation)


_READERS: Mapping[str, Callable[[Any, str, float, _Tree], Found]] = {
    "TFMessage": _transforms,
    "tfMessage": _transforms,
    "TransformStamped": _transform,
    "PoseStamped": _single,
    "PoseWithCovarianceStamped": _single,
    "Odometry": _single,
    "PointStamped": _point,
    "PoseArray": _array,
    "MarkerArray": _markers,
    "Markers": _markers,
}


def _in_order(poses: list[_Pose]) -> list[_Pose]:
    """Poses by their times, each time once, without what is no number."""
    found: dict[float, _Pose] = {}
    for pose in poses:
        if np.isfinite((pose.time, *pose.place)).all():
            found.setdefault(pose.time, pose)
    return [found[time] for time in sorted(found)]


def _at(time: Array, poses: list[_Pose]) -> tuple[Array, Array | None]:
    """Places (T, 3) and quaternions (T, 4) at other times, NaN where no pose is near; no quaternions without any."""
    own = np.array([pose.time for pose in poses])
    places = np.array([pose.place for pose in poses], dtype=float)
    after = np.clip(np.searchsorted(own, time), 1, len(own) - 1)
    nearest = np.where(np.abs(own[after] - time) < np.abs(own[after - 1] - time), after, after - 1)
    exact = np.abs(own[nearest] - time) <= _SAME
    inside = (time >= own[0]) & (time <= own[-1]) & (own[after] - own[after - 1] <= _BRIDGED * median_step(own))
    found = np.stack([np.interp(time, own, column) for column in places.T], axis=1)
    found[exact] = places[nearest[exact]]
    found[~(exact | inside)] = np.nan
    known = [pose.turn for pose in poses]
    if any(turn is None for turn in known):
        return found, None
    with np.errstate(all="ignore"):  # a damaged bag holds any number
        turns = unit_continuous(np.array(known, dtype=float))
        turned = slerp(own, turns, np.clip(time, own[0], own[-1]))
    turned[exact] = turns[nearest[exact]]
    turned[~(exact | inside)] = np.nan
    return found, turned
