"""Tables that name a column for each number, and those with a line for each point of each frame."""

import numpy as np
import pytest
from takes import read_as, refused_as, steps

from armdesign.demonstration import Hints, read_take
from armdesign.demonstration.files.formats import (
    long_csv,
    opensim_storage,
    plain_csv,
    qualisys_skeleton,
    rokoko,
    tracker_csv,
)
from armdesign.demonstration.files.named_columns import columns_of

PLACES = [
    "hand_x,hand_y,hand_z",
    "hand.X,hand.Y,hand.Z",
    "hand x (mm),hand y (mm),hand z (mm)",
    "hand_position_x,hand_position_y,hand_position_z",
    "handPosX,handPosY,handPosZ",
    "hand_px,hand_py,hand_pz",
    "hand_x_m,hand_y_m,hand_z_m",
    "x_hand,y_hand,z_hand",
    "hand_x,hand_y,hand_z,hand_rotation_x,hand_rotation_y,hand_rotation_z",
    "hand:Position.X,hand:Position.Y,hand:Position.Z",
]


@pytest.mark.parametrize("header", PLACES)
def test_a_point_goes_by_many_names(header):
    assert columns_of(header.split(",")).points == {"hand": [0, 1, 2]}


@pytest.mark.parametrize(
    ("header", "point", "columns"),
    [
        ("h_qw,h_qx,h_qy,h_qz", "h", [1, 2, 3, 0]),
        ("h_rot_x,h_rot_y,h_rot_z,h_rot_w", "h", [0, 1, 2, 3]),
        ("HandRotX,HandRotY,HandRotZ,HandRotW", "Hand", [0, 1, 2, 3]),
        ("qw,qx,qy,qz", "", [1, 2, 3, 0]),
        ("h_q0,h_q1,h_q2,h_q3", "h", [0, 1, 2, 3]),
    ],
)
def test_quaternions(header, point, columns):
    found = columns_of(header.split(","))
    assert found.turns == {point: columns}
    assert found.unordered == ({"h"} if "q0" in header else set())


def test_what_only_looks_like_a_coordinate_is_none():
    found = columns_of(
        ["index", "thumb_tip_x", "thumb_tip_y", "thumb_tip_z", "hand_r_x", "hand_r_y", "hand_r_z", "apex"]
    )
    assert found.points == {"thumb_tip": [1, 2, 3], "hand_r": [4, 5, 6]}
    assert (found.frame, found.left) == (0, ["apex"])


@pytest.mark.parametrize(
    ("name", "unit"),
    [("Time", None), ("timestamp_ns", "ns"), ("Time (ms)", "ms"), ("time_s", "s"), ("elapsed_time_us", "us")],
)
def test_times_and_their_units(name, unit):
    assert columns_of([name]).times == [(0, unit)]


TRACKER = "timestamp,device,tracker_1_x,tracker_1_y,tracker_1_z,tracker_1_q0,tracker_1_q1,tracker_1_q2,tracker_1_q3"
ROWS = [f"{10.0 * i:g},left hand,{i}.5,2,3,0.5,0.1,0.2,0.3" for i in range(5)]


def test_the_order_of_quaternions_is_asked_for(tmp_path):
    take = read_as(tracker_csv, tmp_path, [TRACKER, *ROWS])
    np.testing.assert_allclose(take.points["tracker_1"][:, 0], np.arange(5) + 0.5)
    assert take.unordered == {"tracker_1"}
    assert "device" in steps(take)["columns"]
    path = tmp_path / "take.any"
    assert read_take(path).orientations == {}
    assert "--quaternions" in steps(read_take(path))["quaternions"]
    turns = read_take(path, Hints(quaternions="wxyz", time_unit="ms")).orientations["tracker_1"]
    np.testing.assert_allclose(turns, np.tile([0.1, 0.2, 0.3, 0.5], (5, 1)))
    np.testing.assert_allclose(read_take(path, Hints(time_unit="ms")).time, 0.01 * np.arange(5))


def test_times_since_1970_count_from_the_first(tmp_path):
    rows = [f"{1_700_000_000 + 0.25 * i},{i},0,1" for i in range(4)]
    read_as(tracker_csv, tmp_path, ["timestamp,hand_x,hand_y,hand_z", *rows])
    take = read_take(tmp_path / "take.any")
    np.testing.assert_array_equal(take.time, 0.25 * np.arange(4))
    assert "1700000000" in steps(take)["start"]


def test_dates_are_times(tmp_path):
    rows = [f"2024-05-01T23:59:59.{i}+02:00,{i},0,1" for i in range(5, 9)]
    read_as(tracker_csv, tmp_path, ["timestamp,hand_x,hand_y,hand_z", *rows])
    np.testing.assert_allclose(read_take(tmp_path / "take.any").time, [0.0, 0.1, 0.2, 0.3], atol=1e-6)
    assert "'noon'" in refused_as(tracker_csv, tmp_path, ["timestamp,hand_x,hand_y,hand_z", *rows, "noon,1,2,3"])


def test_of_a_long_take_only_the_part_that_is_wanted_is_looked_at(tmp_path, monkeypatch):
    rows = [f"{0.5 * i},{i},0,1" for i in range(200)]
    read_as(tracker_csv, tmp_path, ["timestamp,hand_x,hand_y,hand_z", *rows])
    hints = Hints(start=50.0, stop=60.0)
    assert len(read_take(tmp_path / "take.any", hints).time) == 200  # short enough to clean as a whole
    monkeypatch.setattr("armdesign.demonstration.files.hints._LONG", 100)
    take = read_take(tmp_path / "take.any", hints)
    assert (take.time[0], take.time[-1]) == (40.0, 69.5)  # with ten seconds at either end
    np.testing.assert_array_equal(take.points["hand"][:, 0], 2.0 * take.time)
    assert "200 frames" in steps(take)["part"]
    assert len(read_take(tmp_path / "take.any", Hints(start=500.0)).time) == 200  # the crop says what is wrong


def test_an_only_body_has_the_files_name(tmp_path):
    take = read_as(tracker_csv, tmp_path, ["# a logger", "t;px;py;pz", *(f"{i};{i},5;1;2" for i in range(4))])
    np.testing.assert_allclose(take.points["take"][:, 0], np.arange(4) + 0.5)


@pytest.mark.parametrize("header", ["time,a_x,a_y,a_z", "a_x,a_y,a_z", "Time,a_x,a_y,a_z,a_qx,a_qy,a_qz,a_qw"])
def test_what_is_plain_csv_stays_so(tmp_path, header):
    row = ",".join(["{i}", *["1"] * header.count(",")])
    assert read_as(plain_csv, tmp_path, [header, *(row.format(i=i) for i in range(4))]).format == "plain CSV"


def test_frame_numbers_left_out_are_a_hole(tmp_path):
    rows = [f"{i},{i},0,1" for i in (7, 8, 11)]
    take = read_as(tracker_csv, tmp_path, ["Frame,HEAD_X,HEAD_Y,HEAD_Z", *rows])
    np.testing.assert_array_equal(take.time, [0, 1, 4])
    assert "frame number" in refused_as(tracker_csv, tmp_path, ["Frame,HEAD_X,HEAD_Y,HEAD_Z", rows[1], rows[0]])


def test_a_line_for_each_point(tmp_path):
    rows = ["time_ms,joint,x,y,z,qx,qy,qz,qw,confidence"]
    rows += [f"{20 * i},{name},{i},{k},1,0,0,0,1,0.{9 - 8 * (i == k)}" for i in range(4) for k, name in enumerate("ab")]
    take = read_as(long_csv, tmp_path, rows[:-1])  # b is not in the last frame
    assert np.isnan(take.points["a"][:, 0]).tolist() == [True, False, False, False]
    assert np.isnan(take.points["b"][:, 0]).tolist() == [False, True, False, True]
    np.testing.assert_array_equal(take.orientations["a"][0], [0, 0, 0, 1])
    np.testing.assert_allclose(read_take(tmp_path / "take.any").time, 0.02 * np.arange(4))
    assert "twice" in refused_as(long_csv, tmp_path, [*rows, rows[-1]])
    assert "'1.2.3'" in refused_as(long_csv, tmp_path, [*rows, "80,a,1.2.3,0,0,0,0,0,1,1"])
    assert "increase" in refused_as(long_csv, tmp_path, [rows[0], *rows[3:], *rows[1:3]])


def test_rokoko_leaves_joint_angles_out(tmp_path):
    head = [f"{name}_position_{axis}" for name in ("Hips", "RightHand") for axis in "xyz"]
    rows = [",".join(["Timestamp", *head, "RightWrist_flexion"])]
    take = read_as(rokoko, tmp_path, [*rows, *(f"0.{i},0,0.9,0,{i},1,0,12" for i in range(4))])
    assert (list(take.points), take.units, take.solved) == (["Hips", "RightHand"], "m", True)
    assert "RightWrist_flexion" in steps(take)["columns"]


STORAGE = "name\nversion=1\nDataType={}\ninDegrees=no\nendheader\n"


def test_storage_of_one_point_and_of_vectors(tmp_path):
    rows = "".join(f"0.{i}\t{i}\t1\t2\n" for i in range(4))
    take = read_as(opensim_storage, tmp_path, STORAGE.format("double") + "time\tstate_0\tstate_1\tstate_2\n" + rows)
    np.testing.assert_array_equal(take.points["take"][:, 0], np.arange(4))
    rows = "".join(f"0.{i}\t{i},1,2\t3,4,{i}\n" for i in range(4))
    take = read_as(opensim_storage, tmp_path, STORAGE.format("Vec3") + "time\thand\telbow\n" + rows)
    np.testing.assert_array_equal(take.points["elbow"][:, 2], np.arange(4))


@pytest.mark.parametrize(
    ("kind", "names"),
    [("double", "arm_flex_r elbow_flex_r"), ("double", "ground_force_vx ground_force_vy ground_force_vz"),
     ("double", "1_ground_force_x 1_ground_force_y 1_ground_force_z"), ("Quaternion", "hand_imu")],
)  # fmt: skip
def test_storage_of_angles_and_forces_is_refused(tmp_path, kind, names):
    columns = names.split()
    text = STORAGE.format(kind) + "\t".join(["time", *columns]) + "\n" + "\t".join("0" for _ in ["time", *columns])
    assert ".trc" in refused_as(opensim_storage, tmp_path, text)


def test_segments_that_count_from_their_parents_are_refused(tmp_path):
    rows = ["NO_OF_FRAMES\t3", "FREQUENCY\t100", "REFERENCE\tLOCAL", "Frame\tTime\tHips\tX\tY\tZ\tQX\tQY\tQZ\tQW"]
    rows += [f"{i + 1}\t0.0{i}\t\t1\t2\t3\t0\t0\t0\t1" for i in range(3)]
    assert "GLOBAL" in refused_as(qualisys_skeleton, tmp_path, rows)
    take = read_as(qualisys_skeleton, tmp_path, [row.replace("LOCAL", "GLOBAL") for row in rows])
    np.testing.assert_array_equal(take.points["Hips"], [[1, 2, 3]] * 3)
