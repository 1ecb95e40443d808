from __future__ import annotations

import codecs
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from motive_files import Item, arm, markers, motive_text
from scipy.spatial.transform import Rotation
from takes import read_as, refused_as, steps

from armdesign.demonstration.files.formats import motive_csv

read = partial(read_as, motive_csv)
refused = partial(refused_as, motive_csv)

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "recordings"
VERSIONS = ("1.21", "1.22", "1.23", "1.24", "1.25")
ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")


def same_turns(a, b, tolerance=1e-5):
    return np.abs((Rotation.from_quat(a) * Rotation.from_quat(b).inv()).magnitude()).max() < tolerance


@pytest.mark.parametrize("version", VERSIONS)
def test_every_version_gives_what_was_exported(tmp_path, version):
    bodies = arm()
    take = read(tmp_path, motive_text(bodies + markers(bodies), version, rate=100.0))
    assert take.format == f"OptiTrack Motive CSV {version}"
    assert (take.units, take.up, take.rate, take.captured) == ("m", None, 100.0, True)
    np.testing.assert_array_equal(take.time, np.arange(40) / 100.0)
    assert list(take.points) == [item.name for item in bodies + markers(bodies)]
    assert list(take.orientations) == ["Shoulder", "Forearm", "Hand"]
    for item in bodies + markers(bodies):
        np.testing.assert_allclose(take.points[item.name], item.positions, atol=6e-7)
    for body in bodies:
        np.testing.assert_allclose(take.orientations[body.name], body.quaternions, atol=6e-7)
    assert take.bodies["Hand"] == ("Hand:Marker1", "Hand:Marker2", "Hand:Marker3")
    assert take.steps == ()


@pytest.mark.parametrize("order", ORDERS)
def test_euler_angles_are_intrinsic_in_degrees(tmp_path, order):
    bodies = arm()
    take = read(tmp_path, motive_text(bodies, rotation=order))
    assert all(same_turns(take.orientations[body.name], body.quaternions) for body in bodies)
    assert order in steps(take)["angles"]
    assert "intrinsic" in steps(take)["angles"]


@pytest.mark.parametrize(("word", "unit"), [("Meters", "m"), ("Millimeters", "mm"), ("Centimeters", "cm")])
def test_units_are_those_of_the_file(tmp_path, word, unit):
    assert read(tmp_path, motive_text(arm(), units=word)).units == unit


def test_a_missing_unit_is_left_open_and_an_unknown_one_refused(tmp_path):
    assert read(tmp_path, motive_text(arm(), facts={"Length Units": None})).units is None
    assert "'Furlongs' is none of length" in refused(tmp_path, motive_text(arm(), units="Furlongs"))


def test_take_names_may_hold_blanks_commas_and_quotation_marks(tmp_path):
    for name in ("my take", "left, then right", 'a ""quoted"", name'):
        assert read(tmp_path, motive_text(arm(), take=name)).steps == ()
    unquoted = motive_text(arm(), rate=70.0).replace("Take Name,Take 1", "Take Name,left, right")
    assert read(tmp_path, unquoted).rate == 70.0


def test_notes_may_run_over_lines(tmp_path):
    take = read(tmp_path, motive_text(arm(), rate=70.0, facts={"Take Notes": '"first\nsecond, third"'}))
    assert take.rate == 70.0


@pytest.mark.parametrize("encoding", ["utf-16", "gbk"])
def test_chinese_start_times_in_any_encoding(tmp_path, encoding):
    text = motive_text(arm(), facts={"Capture Start Time": "2019-09-18 04.30.02.695 下午"})
    take = read(tmp_path, text.encode(encoding))
    np.testing.assert_allclose(take.points["Hand"], arm()[2].positions, atol=6e-7)


def test_line_ends_mark_and_padded_blank_line_change_nothing(tmp_path):
    plain = read(tmp_path, motive_text(arm(), "1.25"))
    for text in (
        codecs.BOM_UTF8 + motive_text(arm(), "1.25", end="\r\n", blank="," * 30).encode(),
        motive_text(arm(), "1.25", facts={"Export Frame Rate": "120", "Capture Frame Rate": "120"}).encode(),
        motive_text(arm(), "1.25").replace("\n\n", "\n").encode(),
    ):
        take = read(tmp_path, text)
        np.testing.assert_array_equal(take.time, plain.time)
        assert all((take.points[name] == plain.points[name]).all() for name in plain.points)
        assert take.steps == ()


def test_a_spreadsheet_may_pad_all_lines_or_write_semicolons(tmp_path):
    text = motive_text(arm())
    padded = "\n".join(line + ",,," for line in text.splitlines()) + "\n"
    semicolons = text.replace(",", ";").replace(".", ",").replace("1,23", "1.23")
    for changed in (padded, semicolons, text.replace(",", "\t")):
        take = read(tmp_path, changed)
        np.testing.assert_allclose(take.points["Hand"], arm()[2].positions, atol=6e-7)
        assert take.rate == 120.0


def test_a_column_of_time_codes_is_passed_over(tmp_path):
    bodies = arm()
    take = read(tmp_path, motive_text(bodies + markers(bodies), "1.24", timecode=True))
    np.testing.assert_allclose(take.points["Hand:Marker2"], markers(bodies)[7].positions, atol=6e-7)
    assert take.steps == ()


def test_hidden_things_are_missing_and_only_there(tmp_path):
    bodies = arm()
    hidden = {("Hand", 3), ("Hand", 4), ("Forearm:Marker1", 39)}
    take = read(tmp_path, motive_text(bodies + markers(bodies), hidden=hidden))
    for name, values in take.points.items():
        missing = {(name, int(frame)) for frame in np.flatnonzero(np.isnan(values).any(axis=1))}
        assert missing == {entry for entry in hidden if entry[0] == name}
    assert np.flatnonzero(np.isnan(take.orientations["Hand"][:, 0])).tolist() == [3, 4]


def test_solved_markers_stand_beside_the_measured_ones(tmp_path):
    bodies = arm()
    solved, measured = markers(bodies, "Rigid Body Marker"), markers(bodies, spread=0.06)
    for version in ("1.21", "1.23"):
        take = read(tmp_path, motive_text(bodies + solved + measured, version, hidden={("Hand:Marker1", 5)}))
        np.testing.assert_allclose(take.points["Shoulder:Marker1"], measured[0].positions, atol=6e-7)
        np.testing.assert_allclose(take.points["Shoulder:Marker1 (solved)"], solved[0].positions, atol=6e-7)
        assert take.bodies["Hand"] == ("Hand:Marker1", "Hand:Marker2", "Hand:Marker3")
        assert "Shoulder:Marker1 (solved)" in steps(take)["solved"]


def test_solved_markers_alone_have_the_plain_name(tmp_path):
    bodies = arm()
    take = read(tmp_path, motive_text(bodies + markers(bodies, "Bone Marker")))
    assert "Hand:Marker1" in take.points
    assert "not in the file" in steps(take)["solved"]


def test_one_name_for_several_things_is_told_apart(tmp_path):
    frames = np.arange(12.0).reshape(4, 3)
    items = [
        Item("Rigid Body", "Hand", frames, np.tile([0.0, 0.0, 0.0, 1.0], (4, 1))),
        Item("Marker", "Hand", frames + 1),
        Item("Marker", "Unlabeled", frames + 2, id="A"),
        Item("Marker", "Unlabeled", frames + 3, id="B"),
        Item("Marker", "Unlabeled", frames + 4, id="B"),
        Item("Marker", "", frames + 5),
    ]
    take = read(tmp_path, motive_text(items))
    first = {name: values[0, 0] for name, values in take.points.items()}
    assert list(first.values()) == [0, 1, 2, 3, 4, 5]
    assert list(first)[:5] == ["Hand", "Hand (marker)", "Unlabeled", "Unlabeled (2)", "Unlabeled (3)"]
    assert "Unlabeled (2)" in steps(take)["names"]


def test_a_take_may_start_anywhere_and_have_holes(tmp_path):
    frames = np.r_[72210:72220, 75720:75750]
    take = read(tmp_path, motive_text(arm(), rate=100.0, frames=frames))
    np.testing.assert_array_equal(take.time, frames / 100.0)
    assert "722.190 s to 757.200 s" in steps(take)["holes"]


def test_frames_numbered_at_the_capture_rate_are_noticed(tmp_path):
    text = motive_text(arm(), frames=np.arange(0, 80, 2), facts={"Export Frame Rate": "60.000000"})
    take = read(tmp_path, text)
    np.testing.assert_allclose(take.time, np.arange(40) / 60.0)
    assert take.rate == 60.0
    assert "capture frame rate" in steps(take)["times"]


def test_printed_times_that_contradict_the_rate_are_reported(tmp_path):
    text = motive_text(arm(), facts={"Export Frame Rate": "60", "Capture Frame Rate": "60"})
    take = read(tmp_path, text)
    np.testing.assert_allclose(take.time, np.arange(40) / 60.0)
    assert "do not fit" in steps(take)["times"]


def test_without_a_rate_the_printed_times_are_taken(tmp_path):
    take = read(tmp_path, motive_text(arm(), facts={"Export Frame Rate": None, "Capture Frame Rate": None}))
    np.testing.assert_allclose(take.time, np.arange(40) / 120.0, atol=6e-7)
    assert take.rate is None
    assert "printed times" in steps(take)["times"]


@pytest.mark.parametrize("rate", ["0", "fast", "1e9"])
def test_senseless_rates_are_refused(tmp_path, rate):
    message = refused(tmp_path, motive_text(arm(), facts={"Export Frame Rate": rate}))
    assert f"line 1: the export frame rate is '{rate}'" in message


def test_frame_numbers_that_do_not_increase_name_their_line(tmp_path):
    for frames, text in (
        (np.r_[0:20, 18:38], "line 28: the frame number does not increase, 18 comes after 19"),
        (np.r_[0:20, 19:39], "line 28: the frame number does not increase, 19 comes after 19"),
        (["x"] * 40, "line 8, column 'Frame': 'x' is not a number"),
    ):
        whole = motive_text(arm(), "1.23", frames=np.arange(40))
        lines = whole.splitlines()
        rows = [f"{frame},{line.partition(',')[2]}" for frame, line in zip(frames, lines[7:], strict=True)]
        assert text in refused(tmp_path, "\n".join(lines[:7] + rows) + "\n")


def test_missing_frame_numbers_and_wild_ones_name_their_line(tmp_path):
    lines = motive_text(arm()).splitlines()
    for cell, text in (("", "is missing"), ("1e300", "is 1e+300")):
        changed = [*lines[:9], f"{cell},{lines[9].partition(',')[2]}", *lines[10:]]
        assert f"line 10: the frame number {text}" in refused(tmp_path, "\n".join(changed))


def test_wrong_counts_cut_ends_and_short_lines_are_reported(tmp_path):
    announced = read(tmp_path, motive_text(arm(), facts={"Total Exported Frames": "99"}))
    assert "announces 99 frames" in steps(announced)["count"]
    text = motive_text(arm())
    take = read(tmp_path, text[: text.rindex(",", 0, -60)])
    assert len(take.time) == 39
    assert "line 47" in steps(take)["cut"]
    lines = text.splitlines()
    lines[20] = ",".join(lines[20].split(",")[:10])
    assert "stop early: 1" in steps(read(tmp_path, "\n".join(lines) + "\n"))["short"]


def test_local_coordinates_are_refused(tmp_path):
    message = refused(tmp_path, motive_text(arm(), space="Local"))
    assert "line 1: the coordinate space is Local" in message
    assert "Global" in message


def test_a_file_without_its_header_is_recognised_and_refused(tmp_path):
    lines = motive_text(arm()).splitlines()
    for start in (2, 6):
        assert "has no header" in refused(tmp_path, "\n".join(lines[start:]))


def test_files_cut_off_in_the_header_are_refused(tmp_path):
    lines = motive_text(arm(), "1.25").splitlines()
    for count in range(1, 7):
        assert "'Frame'" in refused(tmp_path, "\n".join(lines[:count]))
    assert "holds no frame" in refused(tmp_path, "\n".join(lines[:8]))
    assert "rows with types, names" in refused(tmp_path, "\n".join([lines[0], *lines[6:]]))


def test_rotations_without_an_order_and_half_positions_are_refused(tmp_path):
    text = motive_text(arm(), rotation="XYZ")
    assert "has three angles" in refused(tmp_path, text.replace("Rotation Type,XYZ", "Rotation Type,Quaternion"))
    lines = motive_text(arm()[:1]).splitlines()
    cut = [",".join(line.split(",")[:8]) if number > 1 else line for number, line in enumerate(lines)]
    assert "'Shoulder' has no position along Z" in refused(tmp_path, "\n".join(cut))
    empty = [",".join(line.split(",")[:2]) if number > 1 else line for number, line in enumerate(lines)]
    assert "no rigid body, bone or marker" in refused(tmp_path, "\n".join(empty))


def test_later_versions_are_read_with_a_word_about_it(tmp_path):
    assert "1.31" in steps(read(tmp_path, motive_text(arm(), "1.31")))["version"]


@pytest.mark.skipif(not FOLDER.exists(), reason="the shared recordings are not at hand")
def test_real_bones_are_those_of_the_kth_files():
    take = motive_csv.read(FOLDER / "motive_layout" / "motive125_bones_from_kth_giver.csv")
    assert (take.units, take.rate, len(take.time)) == ("mm", 120.0, 801)
    for bone in ("RShoulder", "RUArm", "RFArm", "RHand"):
        table = np.loadtxt(FOLDER / "kth_handover" / f"giver_{bone}_pose_saved.csv", delimiter=",", skiprows=1)
        np.testing.assert_allclose(take.points[f"giver:{bone}"], 1000.0 * table[:, :3], atol=6e-7)
        assert same_turns(take.orientations[f"giver:{bone}"], table[:, 3:])


@pytest.mark.skipif(not FOLDER.exists(), reason="the shared recordings are not at hand")
def test_real_bodies_carry_their_markers_rigidly():
    take = motive_csv.read(FOLDER / "motive_layout" / "motive123_rigidbodies_from_ktk_racing.csv")
    assert list(take.orientations) == ["Shoulder", "UpperArm", "Forearm", "Hand"]
    assert (take.units, take.rate, len(take.time)) == ("m", 70.0, 700)
    for body, names in take.bodies.items():
        assert len(names) == 3
        seen = ~np.isnan(take.orientations[body][:, 0])
        turns = Rotation.from_quat(take.orientations[body][seen])
        for name in names:
            local = turns.inv().apply(take.points[name][seen] - take.points[body][seen])
            assert np.nanstd(local, axis=0).max() < 0.01
