"""A bag reads back as the motion, through the library's own reader."""

import sys

import numpy as np
import pytest

from armdesign.errors import MissingExtraError, RunFolderError
from armdesign.export.trajectory.exporting import TrajectoryOptions, make_trajectory
from armdesign.export.trajectory.ros2_bag import (
    STATES,
    STATES_TOPIC,
    TRAJECTORY,
    TRAJECTORY_TOPIC,
    typestore,
    write_bag,
)

rosbag2 = pytest.importorskip("rosbags.rosbag2")


@pytest.fixture
def motion(run):
    return make_trajectory(run, TrajectoryOptions(rate=50.0)).motion


def messages(folder):
    """All messages by topic: (type, stamp [ns], message)."""
    store, found = typestore(), {}
    with rosbag2.Reader(folder) as reader:
        for connection, stamp, data in reader.messages():
            message = store.deserialize_cdr(data, connection.msgtype)
            found.setdefault(connection.topic, []).append((connection.msgtype, stamp, message))
    return found


def test_joint_states_read_back_exactly(tmp_path, motion):
    write_bag(tmp_path / "bag", motion)
    states = messages(tmp_path / "bag")[STATES_TOPIC]
    assert {kind for kind, _, _ in states} == {STATES}
    np.testing.assert_array_equal([state.position for _, _, state in states], motion.q)
    np.testing.assert_array_equal([state.velocity for _, _, state in states], motion.v)
    stamps = np.array([stamp for _, stamp, _ in states])
    np.testing.assert_allclose(stamps - stamps[0], motion.time * 1e9, atol=1)
    for _, stamp, state in states:
        assert state.header.stamp.sec * 10**9 + state.header.stamp.nanosec == stamp
        assert state.name == [f"joint_{i + 1}" for i in range(motion.q.shape[1])]
        assert len(state.effort) == 0


def test_the_trajectory_message_reads_back_exactly(tmp_path, motion):
    write_bag(tmp_path / "bag", motion)
    ((kind, _, message),) = messages(tmp_path / "bag")[TRAJECTORY_TOPIC]
    assert kind == TRAJECTORY
    assert message.joint_names == [f"joint_{i + 1}" for i in range(motion.q.shape[1])]
    for field, values in (("positions", motion.q), ("velocities", motion.v), ("accelerations", motion.a)):
        np.testing.assert_array_equal([getattr(point, field) for point in message.points], values)
    times = [point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec for point in message.points]
    np.testing.assert_allclose(times, motion.time, atol=1e-9)


def test_the_bag_stands_in_a_folder_of_any_name_and_leaves_nothing_beside_it(tmp_path, motion):
    place = tmp_path / "run #1, 50%? done"
    place.mkdir()
    write_bag(place / "bag", motion)
    assert [path.name for path in place.iterdir()] == ["bag"]
    assert [path.name for path in tmp_path.iterdir()] == [place.name]
    place.rename(tmp_path / "plain")
    assert len(messages(tmp_path / "plain" / "bag")[STATES_TOPIC]) == len(motion.time)


def test_a_bag_is_replaced_only_when_asked(tmp_path, runs):
    long, short = (make_trajectory(runs["packaging"], TrajectoryOptions(rate=rate)).motion for rate in (100.0, 20.0))
    write_bag(tmp_path / "bag", long)
    with pytest.raises(RunFolderError, match=r"there is a bag .* already"):
        write_bag(tmp_path / "bag", short)
    assert len(messages(tmp_path / "bag")[STATES_TOPIC]) == len(long.time)
    write_bag(tmp_path / "bag", short, overwrite=True)
    assert len(messages(tmp_path / "bag")[STATES_TOPIC]) == len(short.time)
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]


def test_what_is_no_bag_is_never_replaced(tmp_path, motion):
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "thesis.txt").write_text("years of work")
    with pytest.raises(RunFolderError, match="is no ROS 2 bag"):
        write_bag(tmp_path / "bag", motion, overwrite=True)
    assert (tmp_path / "bag" / "thesis.txt").read_text() == "years of work"


def test_a_place_that_cannot_be_is_refused(tmp_path, motion):
    (tmp_path / "file").write_text("")
    with pytest.raises(RunFolderError, match="cannot write"):
        write_bag(tmp_path / "file" / "bag", motion)


def test_without_the_library_the_pip_line_is_told(tmp_path, motion, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.typesys", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'armdesign\[ros\]'"):
        write_bag(tmp_path / "bag", motion)
    assert not list(tmp_path.iterdir())
