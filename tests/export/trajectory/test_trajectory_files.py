"""What is written reads back as the same numbers, under the names that readers look for."""

import io

import numpy as np
import pytest
import yaml

from armdesign.export.trajectory.exporting import TrajectoryOptions, make_trajectory
from armdesign.export.trajectory.scaling import Motion
from armdesign.export.trajectory.trajectory_files import csv_text, npz_bytes, ros_yaml, seconds_nanoseconds


@pytest.fixture
def motion(run):
    return make_trajectory(run, TrajectoryOptions(rate=120.0, speed=0.9)).motion


def tiny():
    """Numbers that YAML readers take for words when written carelessly."""
    values = np.array([[1e-5, -2e-17], [1e22, 0.1 + 0.2], [-1.5e-300, 0.0]])
    return Motion(np.array([0.0, 1.0, 1.75]), np.zeros(3), values, -values, 2 * values)


def test_csv_reads_back_exactly(motion):
    text = csv_text(motion)
    n = motion.q.shape[1]
    head = text.splitlines()[0].split(",")
    assert head == ["time", *(f"{w}_{i}" for w in ("joint", "velocity", "acceleration") for i in range(1, n + 1))]
    values = np.loadtxt(io.StringIO(text), delimiter=",", skiprows=1)
    np.testing.assert_array_equal(values, np.column_stack([motion.time, motion.q, motion.v, motion.a]))


def test_yaml_is_a_joint_trajectory_message(motion):
    message = yaml.safe_load(ros_yaml(motion))
    assert set(message) == {"header", "joint_names", "points"}
    assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "base_link"}
    assert message["joint_names"] == [f"joint_{i + 1}" for i in range(motion.q.shape[1])]
    fields = {"positions", "velocities", "accelerations", "effort", "time_from_start"}
    assert all(set(point) == fields and point["effort"] == [] for point in message["points"])
    assert message["points"][-1]["velocities"] == [0.0] * motion.q.shape[1]


def test_yaml_reads_back_exactly(motion):
    points = yaml.safe_load(ros_yaml(motion))["points"]
    for field, values in (("positions", motion.q), ("velocities", motion.v), ("accelerations", motion.a)):
        np.testing.assert_array_equal([point[field] for point in points], values)
    times = [point["time_from_start"] for point in points]
    nanoseconds = [t["sec"] * 10**9 + t["nanosec"] for t in times]
    np.testing.assert_allclose(nanoseconds, motion.time * 1e9, atol=0.5)
    assert all(0 <= t["nanosec"] < 10**9 for t in times)


def test_every_number_in_the_yaml_is_a_float_to_any_reader():
    points = yaml.safe_load(ros_yaml(tiny()))["points"]
    assert all(isinstance(x, float) for point in points for name in ("positions", "velocities") for x in point[name])
    np.testing.assert_array_equal([point["positions"] for point in points], tiny().q)


def test_npz_reads_back_exactly_without_pickle(motion):
    content = np.load(io.BytesIO(npz_bytes(motion)), allow_pickle=False)
    assert set(content) == {"time", "demonstrated", "q", "v", "a", "joint_names"}
    for name in ("time", "demonstrated", "q", "v", "a"):
        np.testing.assert_array_equal(content[name], getattr(motion, name))
    assert content["joint_names"].tolist() == [f"joint_{i + 1}" for i in range(motion.q.shape[1])]


@pytest.mark.parametrize(
    ("time", "parts"), [(0.0, (0, 0)), (1.5, (1, 500_000_000)), (2.9999999999, (3, 0)), (0.004, (0, 4_000_000))]
)
def test_times_split_into_seconds_and_nanoseconds(time, parts):
    assert seconds_nanoseconds(time) == parts
