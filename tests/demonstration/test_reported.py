"""What people report about their files: each kind on a small input, and the files themselves where they are at hand."""

from pathlib import Path

import numpy as np
import pytest
from takes import read_as, steps

from armdesign.demonstration import Hints, read_recording, read_recordings
from armdesign.demonstration.files.foreign import FOREIGN, foreign_format
from armdesign.demonstration.files.formats import FORMATS, listed_formats, mvnx, vicon_csv
from armdesign.demonstration.files.quaternions import rotation_vector_quaternions
from armdesign.demonstration.points.time_sanity import time_steps
from armdesign.demonstration.points.units_and_up import find_up
from armdesign.demonstration.recording import Recording, Take
from armdesign.demonstration.summary import summarise
from armdesign.errors import RecordingError, SettingsError

REPORTED = Path(__file__).resolve().parents[3] / "shared" / "recordings" / "reported"
reported = pytest.mark.skipif(not REPORTED.is_dir(), reason="the reported files are not at hand")
BEGINNINGS = {  # of files that are known and not read
    "JSON": '{"version": 1.3, "content": []}',
    "DeepLabCut": "scorer,DLC,DLC\nbodyparts,hand,hand\n",
    "kineticstoolkit": "Time,Hand[0],Hand[1],Hand[2]\n0,1,2,3\n",
    "Tracking Tools": "comment,all\nrighthanded\ninfo,framecount,3\n",
    "XML": '<?xml version="1.0"?><opensim/>',
    "settings": "# mine\n[task]\nfile_rate = 100\n",
    "FBX": "; FBX 7.4.0 project file\n",
}


def test_the_readme_names_every_format():
    readme = (Path(__file__).resolve().parents[2] / "README.md").read_text(encoding="utf-8")
    assert listed_formats() in " ".join(readme.split())


def of(time, points=None):
    return Take(np.asarray(time, dtype=float), points or {}, {}, "take", "TRC")


@pytest.mark.parametrize(("name", "text"), BEGINNINGS.items(), ids=BEGINNINGS)
def test_a_format_that_is_not_read_is_named_with_a_way_out(tmp_path, name, text):
    (tmp_path / "take.any").write_text(text)
    with pytest.raises(RecordingError, match=name) as caught:
        read_recording(tmp_path / "take.any")
    assert all(form.name in str(caught.value) for form in FORMATS)
    assert any(each.way in str(caught.value) for each in FOREIGN)


@pytest.mark.parametrize(
    "text", ["time,a_x,a_y,a_z\n0,1,2,3\n", "x,y,z,q0,q1,q2,q3\n", "HIERARCHY\n", "Trajectories\n"]
)
def test_what_is_read_is_not_taken_for_a_foreign_format(text):
    assert foreign_format(text.encode()) is None


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds")])
def test_times_in_other_units_are_named_with_the_factor(factor, unit):
    (step,) = time_steps(of(factor * np.arange(60) / 100.0))
    assert step.details["unit"] == unit
    assert step.details["factor"] == pytest.approx(1.0 / factor)
    assert "100 frames/s over 0.59 s" in step.sentence


def test_times_that_no_unit_explains_are_doubted_and_usual_ones_are_not():
    (step,) = time_steps(of(np.arange(60) / 10_000.0))
    assert "unit" not in step.details
    assert time_steps(of(np.arange(60) / 100.0)) == ()
    assert time_steps(of(np.arange(60) / 5.0)) == ()
    assert len(time_steps(of(np.arange(50_000) / 10.0))) == 1  # more than an hour


def test_the_unit_of_time_and_the_rate_of_a_file_without_times_are_said(tmp_path):
    path = tmp_path / "take.csv"
    path.write_text("time,a_x,a_y,a_z\n" + "".join(f"{10 * i},{i},0,1\n" for i in range(9)))
    recording = read_recording(path, hints=Hints(time_unit="ms"))
    np.testing.assert_allclose(recording.time, np.arange(9) / 100.0)
    assert {step.name for step in recording.about.steps} == {"time-unit"}
    path.write_text("a_x,a_y,a_z\n0,0,1\n,,\n2,0,1\n")
    with pytest.raises(RecordingError, match=r"take\.csv .*no times.*--rate"):
        read_recording(path)
    recording = read_recording(path, hints=Hints(rate=50.0))
    np.testing.assert_allclose(recording.time, [0.0, 0.02, 0.04])  # an empty line is a frame, too
    for wrong in ({"rate": 0.0}, {"time_unit": "h"}, {"quaternions": "zyxw"}, {"confidence": 1.5}):
        with pytest.raises(SettingsError, match=str(next(iter(wrong.values())))):
            Hints(**wrong)


@pytest.mark.parametrize("up", ["y", "x"])
def test_left_and_right_tell_that_the_usual_axis_is_level(up):
    along = np.eye(3)["xyz".index(up)]
    shoulder = np.tile(1.4 * along, (9, 1))
    points = {
        f"{name}{side}": shoulder - drop * along + where * np.array([0.0, 0.0, 1.0])
        for side, where in (("R", 0.2), ("L", -0.2))
        for name, drop in (("Acromion", 0.0), ("LateralEpicondyle", 0.3), ("RadialStyloid", 0.5))
    }
    assert find_up(of(np.arange(9) / 100.0, points), 1.0, "z").axis == up
    level = {name: values[:, [2, 1, 0]] for name, values in points.items()} if up == "y" else {}
    assert find_up(of(np.arange(9) / 100.0, level), 1.0, "z").axis is None  # left and right lie along x: habit holds


def test_objects_of_vicon_are_bodies(tmp_path):
    rows = ["Objects", "100", ",,A:A,,,,,", "Frame,Sub Frame,RX,RY,RZ,TX,TY,TZ", ",,rad,rad,rad,mm,mm,mm"]
    rows += [f"{i},0,0.1,0.2,{0.01 * i:g},{i},20,30" for i in range(1, 5)] + ["5,0,0,0,0,0,0,0"]
    take = read_as(vicon_csv, tmp_path, rows)
    np.testing.assert_allclose(take.points["A:A"][:4], [[i, 20, 30] for i in range(1, 5)])
    vectors = np.array([[0.1, 0.2, 0.01 * i] for i in range(1, 5)])
    np.testing.assert_allclose(take.orientations["A:A"][:4], rotation_vector_quaternions(vectors), atol=1e-12)
    assert np.isnan(take.points["A:A"][4]).all()
    assert np.isnan(take.orientations["A:A"][4]).all()
    assert take.units == "mm"


def test_older_vicon_files_and_velocities(tmp_path):
    rows = ["Title", "Date:", "TRAJECTORIES", "100,Hz", ",RSHO,,,,,,RELB,,,,,", "Field #,X,Y,Z,X',Y',Z',X,Y,Z,X',Y',Z'"]
    rows += [f"{i},{i},2,3,9,9,9,4,5,{i},9,9,9" for i in range(1, 6)]
    take = read_as(vicon_csv, tmp_path, rows)
    assert take.rate == 100.0
    np.testing.assert_allclose(take.points["RSHO"][:, 0], np.arange(1, 6))
    np.testing.assert_allclose(take.points["RELB"][:, 2], np.arange(1, 6))


def mvnx_text(rate, times, more=""):
    head = f'<?xml version="1.0" encoding="UTF-8"?>\n<mvnx version="4"><subject frameRate="{rate}" segmentCount="1">'
    head += '<segments><segment label="RightHand" id="1"/></segments><frames>' + more
    frames = [
        f'<frame time="{time}" index="{i}" type="normal"><orientation>0.8 0.6 0 0</orientation>'
        f"<position>{i} 2 3</position></frame>\n"
        for i, time in enumerate(times)
    ]
    return head + "".join(frames) + "</frames></subject></mvnx>"


def test_mvnx(tmp_path):
    pose = '<frame type="tpose"><orientation>1 0 0 0</orientation><position>9 9 9</position></frame>'
    text = mvnx_text(60, [0, 17, 33, 50, 67], pose)
    take = read_as(mvnx, tmp_path, text)
    np.testing.assert_allclose(take.time, np.arange(5) / 60.0)
    np.testing.assert_allclose(take.points["RightHand"], [[i, 2, 3] for i in range(5)])
    np.testing.assert_allclose(take.orientations["RightHand"], np.tile([0.6, 0, 0, 0.8], (5, 1)))
    assert (take.units, take.up, take.steps) == ("m", "z", ())
    cut = read_as(mvnx, tmp_path, text[: text.index('index="4"') + 30])
    assert len(cut.time) == 4
    assert "cut" in steps(cut)
    contradicted = read_as(mvnx, tmp_path, mvnx_text(60, [0, 10, 20, 30, 40]))
    np.testing.assert_allclose(contradicted.time, np.arange(5) / 100.0)
    assert "60 frames/s" in steps(contradicted)["rate"]


@pytest.mark.parametrize(
    "text",
    [
        mvnx_text(60, []),
        mvnx_text(0, ["", "", ""]),
        mvnx_text(60, [0, 1, 2]).replace("2 3<", "2 3 4<"),
        mvnx_text(60, [0, 1, 2]).replace("2 3<", "2 inf<"),
        mvnx_text(60, [0, 1, 2]).replace("<mvnx", "<!DOCTYPE a [<!ENTITY b 'c'>]><mvnx"),
        mvnx_text(60, [0, 1, 2]).replace("</frames>", "</other>"),
    ],
)
def test_damaged_mvnx_is_refused_in_a_sentence(tmp_path, text):
    (tmp_path / "take.mvnx").write_text(text)
    with pytest.raises(RecordingError, match="mvnx") as caught:
        read_recording(tmp_path / "take.mvnx")
    assert str(caught.value).isprintable()


def test_no_garbled_letter_of_a_file_is_in_a_message(tmp_path):
    (tmp_path / "take.csv").write_bytes(b"zeit\xfc\xff,a\x81_x\n1,2\n")
    with pytest.raises(RecordingError) as caught:
        read_recording(tmp_path / "take.csv")
    assert "\N{REPLACEMENT CHARACTER}" not in str(caught.value)


def chosen(recording: Recording):
    return next(arm for arm in summarise(recording).arms if arm.chosen)


def found(file: str) -> tuple[Recording, dict]:
    recording = read_recording(REPORTED / file)
    return recording, {step.name: step for step in recording.about.steps}


@reported
def test_reported_gaps():
    recording, done = found("trc_zeros_gap.trc")
    assert np.isnan(recording.points["RWrist"][:, 0]).sum() == done["zeros"].details["count"] == 30
    assert done["up"].details["axis"] == "y"
    recording, done = found("trc_held_marker.trc")
    assert np.isnan(recording.points["RWrist"][:, 0]).sum() == done["held"].details["count"] == 29


@reported
def test_reported_skeletons_and_axes():
    recording, _ = found("bvh_hips_replaced.bvh")
    assert np.median(recording.points["Hips"][:, 2]) == pytest.approx(0.93, abs=0.01)
    assert chosen(found("bvh_hand_on_wrist.bvh")[0]).points[-1] == "hand=RFingers"
    assert found("y_up_leftright.c3d")[1]["up"].details["axis"] == "y"
    assert list(found("sgi_last_offset.c3d")[0].points) == ["HAND"]


@reported
def test_reported_times():
    for file, unit in (("time_in_ms.csv", "milliseconds"), ("time_in_ns.csv", "nanoseconds")):
        assert found(file)[1]["time"].details["unit"] == unit


@reported
def test_reported_arms():
    files = {name: REPORTED / f"{name}.csv" for name in ("shoulder", "elbow", "hand")}
    assert chosen(read_recordings(files, rate=100.0)).points == ("elbow", "hand")
    assert chosen(found("vicon_one_wrist_marker.csv")[0]).points[1] == "wrist=Sub:RWRA"
    assert len(chosen(found("vicon_field.csv")[0]).points) == 2
    assert set(found("vicon_tracker_objects.csv")[0].orientations) == {"Upper:Upper", "Hand:Hand"}
    assert len(chosen(found("xsens.mvnx")[0]).points) == 2
    with pytest.raises(RecordingError, match="OpenSim"):
        found("ik.mot")
