import numpy as np
import pytest

from armdesign.demonstration import Recording, read_plain_csv, write_plain_csv
from armdesign.demonstration.files import plain_csv as plain_csv_module
from armdesign.errors import RecordingError

HEADER = "time,elbow_x,elbow_y,elbow_z,left_hand_x,left_hand_y,left_hand_z"
ROWS = ["0.00,1,2,3,4,5,6", "0.01,1.5,2.5,3.5,4.5,5.5,6.5", "0.02,2,3,4,5,6,7"]


def read(tmp_path, text, encoding="utf-8"):
    file = tmp_path / "recording.csv"
    file.write_bytes(text.encode(encoding))
    return read_plain_csv(file)


def table(*rows, header=HEADER):
    return "\n".join([header, *rows]) + "\n"


def same(one, other):
    assert one.time.tobytes() == other.time.tobytes()
    for kind in ("points", "orientations"):
        assert list(getattr(one, kind)) == list(getattr(other, kind))
        for name, values in getattr(one, kind).items():
            np.testing.assert_array_equal(values, getattr(other, kind)[name])


def test_reads_times_and_points_in_header_order(tmp_path):
    recording = read(tmp_path, table(*ROWS))
    assert list(recording.points) == ["elbow", "left_hand"]
    np.testing.assert_array_equal(recording.time, [0.0, 0.01, 0.02])
    np.testing.assert_array_equal(recording.points["left_hand"], [[4, 5, 6], [4.5, 5.5, 6.5], [5, 6, 7]])
    assert recording.source.endswith("recording.csv")


DECORATED = {
    "no line end at the end": table(*ROWS).rstrip("\n"),
    "blanks around cells": table(*ROWS).replace(",", " ,\t "),
    "blanks at the line ends": table(*ROWS).replace("\n", "  \n  "),
    "blank lines": "\n" + table(*ROWS).replace("\n", "\n\n") + "\n  \n",
    "rows of commas below": table(*ROWS) + ",,,,,,\n , ,,,,,\n",
    "quoted": '"' + table(*ROWS).strip().replace(",", '","').replace("\n", '"\n"') + '"\n',
    "capitals": table(*ROWS, header=HEADER.replace("time", "Time").replace("_x", "_X")),
    "exponents": table("0e0,1e0,2E0,+3,4.,5,6", *ROWS[1:]),
}


@pytest.mark.parametrize("text", DECORATED.values(), ids=DECORATED.keys())
def test_decoration_changes_nothing(tmp_path, text):
    same(read(tmp_path, text), read(tmp_path, table(*ROWS)))


def test_columns_may_stand_in_any_order(tmp_path):
    shuffled = ["3,time,1,2", "3,0.00,1,2", "3.5,0.01,1.5,2.5", "4,0.02,2,3"]
    header = "elbow_z,time,elbow_x,elbow_y"
    recording = read(tmp_path, table(*shuffled[1:], header=header))
    np.testing.assert_array_equal(recording.points["elbow"], [[1, 2, 3], [1.5, 2.5, 3.5], [2, 3, 4]])


@pytest.mark.parametrize("row", ["0.01,,,,1,2,3", "0.01, , ,\t,1,2,3", "0.01,nan,NaN, NAN ,1,2,3", '0.01,"",,,1,2,3'])
def test_empty_cells_and_nan_are_missing(tmp_path, row):
    recording = read(tmp_path, table(ROWS[0], row, ROWS[2]))
    assert np.isnan(recording.points["elbow"][1]).all()
    np.testing.assert_array_equal(recording.points["left_hand"][1], [1, 2, 3])


def test_missing_at_the_line_end(tmp_path):
    recording = read(tmp_path, table(ROWS[0], "0.01,1,2,3,,,", "0.02,1,2,3,,,").rstrip("\n"))
    assert np.isnan(recording.points["left_hand"]).all(axis=1).tolist() == [False, True, True]


def test_orientation_without_a_position(tmp_path):
    text = table("0,1,2,3,0,0,0,1", "1,1,2,3,0,0,0,1", "2,1,2,3,0,0,0,1", header="time,a_x,a_y,a_z,b_qx,b_qy,b_qz,b_qw")
    recording = read(tmp_path, text)
    assert (list(recording.points), list(recording.orientations)) == (["a"], ["b"])


def awkward_recording(rng, frames=50):
    """Numbers of all sizes, signed zeros, missing values, names with underscores, blanks, colons and Chinese."""
    names = ["left_hand_x", "a_q", "Body 1:Marker2", "手"]
    spread = 10.0 ** rng.integers(-300, 300, size=(len(names), frames, 3))
    points = dict(zip(names, rng.normal(size=spread.shape) * spread, strict=True))
    points["a_q"][0] = [0.0, -0.0, 5e-324]
    points["手"][7:9] = np.nan
    turns = {name: rng.normal(size=(frames, 4)) for name in ("a_q", "turn_only")}
    turns["a_q"][-1] = np.nan
    return Recording(np.cumsum(rng.uniform(0.001, 0.1, frames)), points, turns)


@pytest.mark.parametrize("seed", range(5))
def test_round_trip_to_the_last_bit(tmp_path, seed):
    recording = awkward_recording(np.random.default_rng(seed))
    write_plain_csv(tmp_path / "copy.csv", recording)
    again = read_plain_csv(tmp_path / "copy.csv")
    same(again, recording)
    assert np.signbit(again.points["a_q"][0]).tolist() == [False, True, False]


def test_name_with_a_comma_is_not_written(tmp_path):
    with pytest.raises(RecordingError, match="'a,b' has a comma or a quotation mark"):
        write_plain_csv(tmp_path / "x.csv", Recording([0, 1, 2], {"a,b": np.zeros((3, 3))}))
    assert not list(tmp_path.iterdir())


BAD_HEADERS = {
    "no header": ("0.0,1,2,3\n0.1,1,2,3\n", "line 1: there is no header, the first line holds numbers"),
    "no time": ("frame,a_x,a_y,a_z\n", "line 1: .* it has no column 'time'"),
    "another format": ("Trajectories\n100\n", r"no column 'time' \('Trajectories'\)"),
    "semicolons": ("time;a_x;a_y;a_z\n0,5;1;2;3\n", "looks separated by semicolons, not commas .*Save it with commas"),
    "tabs": ("time\ta_x\ta_y\ta_z\n", "looks separated by tabs"),
    "part of a position": ("time,a_x,a_z\n", "there is 'a_x', 'a_z', but no 'a_y'"),
    "part of a quaternion": ("time,a_x,a_y,a_z,a_qx,a_qw\n", "there is 'a_qx', 'a_qw', but no 'a_qy' and no 'a_qz'"),
    "twice": ("time,a_x,a_y,a_z,a_y\n", "the name 'a_y' stands twice, in columns 3 and 5"),
    "twice in other letters": ("time,a_x,a_y,a_z,a_Y\n", "'a_y' stands twice"),
    "time twice": ("time,a_x,a_y,a_z,Time\n", "'time' stands twice, in columns 1 and 5"),
    "no name": ("time,a_x,a_y,a_z,\n", "column 5 has no name"),
    "strange name": ("time,a_x,a_y,a_z,speed\n", "column 5, 'speed', is neither the time nor part of a point"),
    "component alone": ("time,_x,_y,_z\n", "column 2, '_x', is neither"),
    "time alone": ("time\n0\n1\n2\n", "no points beside the time"),
    "below a blank line": ("\n\ntime,a_x\n", "line 3: there is 'a_x', but no 'a_y' and no 'a_z'"),
}


@pytest.mark.parametrize(("text", "message"), BAD_HEADERS.values(), ids=BAD_HEADERS.keys())
def test_bad_header(tmp_path, text, message):
    with pytest.raises(RecordingError, match=message):
        read(tmp_path, text)


BAD_ROWS = {
    "two numbers": ("0.01,1,2,3 4,4,5,6", "line 3, column 'elbow_z': '3 4' is not a number"),
    "decimal comma": ('0.01,"1,5",2,3,4,5,6', "line 3, column 'elbow_x': '1,5' is not a number"),
    "too few": ("0.01,1,2,3,4,5", "line 3: too few cells, 6 where the header has 7 columns"),
    "time missing": (",1,2,3,4,5,6", "line 3, column 'time': the time is missing"),
    "time nan": ("nan,1,2,3,4,5,6", "line 3, column 'time': the time is missing"),
    "time again": ("0.00,1,2,3,4,5,6", "line 3, column 'time': the time does not increase, 0 s comes after 0 s"),
    "time back": ("-0.5,1,2,3,4,5,6", "line 3, column 'time': .*-0.5 s comes after 0 s"),
}


@pytest.mark.parametrize(("row", "message"), BAD_ROWS.values(), ids=BAD_ROWS.keys())
def test_bad_row(tmp_path, row, message):
    with pytest.raises(RecordingError, match=message):
        read(tmp_path, table(ROWS[0], row, ROWS[2]))


def test_blank_lines_count_in_line_numbers(tmp_path):
    with pytest.raises(RecordingError, match="line 6, column 'time'"):
        read(tmp_path, table(ROWS[0], "", ROWS[1], ",,,,,,", ROWS[1]))
    with pytest.raises(RecordingError, match="line 4, column 'time'"):
        read(tmp_path, table(ROWS[0], "", ROWS[0], ROWS[1]))


def test_all_rows_too_short(tmp_path):
    with pytest.raises(RecordingError, match="line 2: too few cells"):
        read(tmp_path, table("0,1,2,3", "1,1,2,3", "2,1,2,3"))


def test_as_a_take_it_is_finished_in_metres_with_z_up(tmp_path):
    recording = read(tmp_path, table(*ROWS))
    take = plain_csv_module.read(tmp_path / "recording.csv")
    assert (take.format, take.units, take.up, take.captured, take.rate) == ("plain CSV", "m", "z", False, None)
    same(take, recording)
