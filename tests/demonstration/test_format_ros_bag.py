"""Bags of ROS 1 and ROS 2, written by the library: poses, transforms, arrays and markers come out as bodies."""

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armdesign.demonstration import read_recording, read_take
from armdesign.demonstration.files.body_names import AZURE_KINECT
from armdesign.errors import MissingExtraError, RecordingError

rosbag2 = pytest.importorskip("rosbags.rosbag2")
rosbag1 = pytest.importorskip("rosbags.rosbag1")
typesys = pytest.importorskip("rosbags.typesys")

COUNT, START = 30, 1_700_000_000_000_000_000  # [ns]
TIME = np.arange(COUNT) / 100.0
HAND = np.stack([0.3 + 0.1 * TIME, 0.2 * TIME**2, 1.0 + 0 * TIME], axis=1)
TURNS = Rotation.from_rotvec(np.stack([TIME, 0 * TIME, 0.3 * TIME], axis=1)).as_quat()
STORE = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)


def kind(name: str) -> type:
    return STORE.types[name]


def stamp(nanoseconds: int):
    return kind("builtin_interfaces/msg/Time")(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


def header(nanoseconds: int, frame: str = "world"):
    return kind("std_msgs/msg/Header")(stamp=stamp(nanoseconds), frame_id=frame)


def pose(place, turn=(0.0, 0.0, 0.0, 1.0)):
    point = kind("geometry_msgs/msg/Point")(*map(float, place))
    return kind("geometry_msgs/msg/Pose")(point, kind("geometry_msgs/msg/Quaternion")(*map(float, turn)))


def transform(child, parent, place, turn, at):
    vector = kind("geometry_msgs/msg/Vector3")(*map(float, place))
    inner = kind("geometry_msgs/msg/Transform")(vector, kind("geometry_msgs/msg/Quaternion")(*map(float, turn)))
    return kind("geometry_msgs/msg/TransformStamped")(header(at, parent), child, inner)


def bag(folder: Path, topics: dict[str, tuple[str, list]], mcap: bool = False) -> Path:
    """A bag of ROS 2 with messages at their times [ns]."""
    plugin = rosbag2.StoragePlugin.MCAP if mcap else rosbag2.StoragePlugin.SQLITE3
    with rosbag2.Writer(folder / "bag", version=8, storage_plugin=plugin) as writer:
        for topic, (name, messages) in topics.items():
            connection = writer.add_connection(topic, name, typestore=STORE)
            for at, message in messages:
                writer.write(connection, at, STORE.serialize_cdr(message, name))
    return folder / "bag"


def stamps(offset: int = 0) -> list[int]:
    return [START + offset + round(1e9 * t) for t in TIME]


def poses() -> list:
    posed = kind("geometry_msgs/msg/PoseStamped")
    return [(at, posed(header(at), pose(HAND[i], TURNS[i]))) for i, at in enumerate(stamps())]


@pytest.mark.parametrize("mcap", [False, True])
def test_a_tracked_body_is_called_after_its_topic(tmp_path, mcap):
    folder = bag(tmp_path, {"/vrpn/RightHand/pose": ("geometry_msgs/msg/PoseStamped", poses())}, mcap)
    inside = next(path for path in folder.iterdir() if path.suffix in (".mcap", ".db3"))
    shutil.copy(inside, tmp_path / "take.any")
    for path in (folder, inside, tmp_path / "take.any"):
        take = read_take(path)
        np.testing.assert_allclose(take.points["RightHand"], HAND)
        np.testing.assert_allclose(take.orientations["RightHand"], TURNS, atol=1e-12)
        np.testing.assert_allclose(take.time, TIME, atol=1e-6)
        assert (take.format, take.units) == ("ROS bag", "m")


def test_transforms_are_followed_to_the_outermost_frame(tmp_path):
    turned = Rotation.from_euler("z", 90, degrees=True).as_quat()
    fixed = [(START - 10, kind("tf2_msgs/msg/TFMessage")([transform("room", "map", [1, 2, 3], turned, START - 10)]))]
    moving = [
        (at, kind("tf2_msgs/msg/TFMessage")([transform("hand", "room", HAND[i], TURNS[i], at)]))
        for i, at in enumerate(stamps())
    ]
    topics = {"/tf_static": ("tf2_msgs/msg/TFMessage", fixed), "/tf": ("tf2_msgs/msg/TFMessage", moving)}
    take = read_take(bag(tmp_path, topics))
    np.testing.assert_allclose(take.points["hand"], Rotation.from_quat(turned).apply(HAND) + np.array([1, 2, 3]))
    assert list(take.points) == ["hand"]


def test_bodies_at_other_times_come_between_their_own(tmp_path):
    pointed = kind("geometry_msgs/msg/PointStamped")
    every = enumerate(zip(stamps(4_000_000), TIME.tolist(), strict=True))
    seen = [(at, t) for i, (at, t) in every if not 10 <= i < 14]
    elbow = [(at, pointed(header(at), kind("geometry_msgs/msg/Point")(t, 0.0, 1.0))) for at, t in seen]
    topics = {
        "/hand/pose": ("geometry_msgs/msg/PoseStamped", poses()),
        "/elbow": ("geometry_msgs/msg/PointStamped", elbow),
        "/log": ("std_msgs/msg/String", [(START, kind("std_msgs/msg/String")("hello"))]),
    }
    recording = read_recording(bag(tmp_path, topics), up="z")
    found = recording.points["elbow"][:, 0]
    gone = np.isnan(found)
    assert np.flatnonzero(gone).tolist() == [0, 10, 11, 12, 13, 14]  # before its first, and while it was away
    np.testing.assert_allclose(found[~gone], TIME[~gone] - 0.004, atol=1e-6)
    assert "std_msgs/msg/String" in {step.name: step.sentence for step in recording.about.steps}["topics"]


def test_arrays_and_markers(tmp_path):
    array = kind("geometry_msgs/msg/PoseArray")
    arrays = [(at, array(header(at), [pose(HAND[i]), pose(HAND[i] + 1)])) for i, at in enumerate(stamps())]
    zero, color = kind("geometry_msgs/msg/Vector3")(0.0, 0.0, 0.0), kind("std_msgs/msg/ColorRGBA")(0.0, 0.0, 0.0, 0.0)
    none = np.zeros(0, dtype=np.uint8)
    image = kind("sensor_msgs/msg/CompressedImage")(header(0), "", none)
    mesh = kind("visualization_msgs/msg/MeshFile")("", none)
    never = kind("builtin_interfaces/msg/Duration")(0, 0)

    def marker(i, joint, at):
        where = pose(HAND[i] + np.array([joint, 0, 0]))
        return kind("visualization_msgs/msg/Marker")(
            header(at), "", joint, 0, 0, where, zero, color, never, False, [], [], "", image, [], "", "", mesh, False
        )

    bodies = [(at, kind("visualization_msgs/msg/MarkerArray")([marker(i, k, at) for k in range(32)]))
              for i, at in enumerate(stamps())]  # fmt: skip
    topics = {
        "/arm/poses": ("geometry_msgs/msg/PoseArray", arrays),
        "/body_tracking_data": ("visualization_msgs/msg/MarkerArray", bodies),
    }
    take = read_take(bag(tmp_path, topics))
    np.testing.assert_allclose(take.points["arm 2"], HAND + 1)
    joint = AZURE_KINECT.index("WRIST_RIGHT")
    np.testing.assert_allclose(take.points["WRIST_RIGHT"], HAND + np.array([joint, 0, 0]))


def test_ros_1(tmp_path):
    store = typesys.get_typestore(typesys.Stores.ROS1_NOETIC)
    name = "geometry_msgs/msg/PoseStamped"
    with rosbag1.Writer(tmp_path / "take.bag") as writer:
        connection = writer.add_connection("/hand", name, typestore=store)
        for i, at in enumerate(stamps()):
            head = store.types["std_msgs/msg/Header"](i, stamp(at), "world")
            message = store.types[name](head, pose(HAND[i], TURNS[i]))
            writer.write(connection, at, store.serialize_ros1(message, name))
    np.testing.assert_allclose(read_take(tmp_path / "take.bag").points["hand"], HAND)
    content = (tmp_path / "take.bag").read_bytes()
    for cut in (20, 200, len(content) // 2, len(content) - 5):
        (tmp_path / "cut.bag").write_bytes(content[:cut])
        with pytest.raises(RecordingError, match=r"cut\.bag"):
            read_take(tmp_path / "cut.bag")


def test_without_poses_or_the_library_it_is_refused(tmp_path, monkeypatch):
    text = [(at, kind("std_msgs/msg/String")("hello")) for at in stamps()]
    folder = bag(tmp_path, {"/log": ("std_msgs/msg/String", text)})
    with pytest.raises(RecordingError, match=r"no poses.*std_msgs"):
        read_take(folder)
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(MissingExtraError, match=r"armdesign\[ros\]"):
        read_take(folder)
