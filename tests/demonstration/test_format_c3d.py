"""C3D: what stands in a file is read, whatever wrote it; what cannot be right is refused in a sentence."""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path

import ezc3d
import numpy as np
import pytest
from c3d_bytes import DEC, INTEL, MIPS, c3d_bytes
from takes import read_as, refused_as

from armdesign.demonstration.files.formats import c3d
from armdesign.demonstration.files.formats.c3d_layout import read_layout
from armdesign.demonstration.files.quaternions import rotation_matrices
from armdesign.demonstration.files.readers import read_recording
from armdesign.errors import RecordingError

read = partial(read_as, c3d)
refusal = partial(refused_as, c3d)

REAL = Path(__file__).resolve().parents[3] / "shared" / "recordings" / "pyomeca"
P = np.random.default_rng(5).uniform(-300, 300, (40, 4, 3))


def _hidden(seed: int = 1) -> np.ndarray:
    return np.where(np.random.default_rng(seed).random(P.shape[:2]) < 0.2, -1.0, 0.5)


YARDSTICKS = {  # what ezc3d reads: floats of Intel and VAX; of integers, those without analog samples behind them
    "floats": lambda: c3d_bytes(P, residual=_hidden()),
    "floats of a VAX": lambda: c3d_bytes(P, residual=_hidden(), processor=DEC),
    "integers": lambda: c3d_bytes(P, residual=_hidden(), scale=0.037),
    "analog samples": lambda: c3d_bytes(P, residual=_hidden(), analog=np.ones((40, 5, 3))),
    "zeros": lambda: c3d_bytes(np.where(_hidden()[..., None] < 0, 0.0, P)),
    "unseen at the end": lambda: c3d_bytes(
        P, residual=np.where(np.arange(40)[:, None] > 30, -1.0, 0.0) + 0 * P[..., 0]
    ),
    "rotations": lambda: c3d_bytes(P, residual=_hidden(), rotations=poses(40, 1, 2)),
}


def positions(take) -> np.ndarray:
    return np.stack(list(take.points.values()), axis=1)


def sentences(take) -> str:
    return " ".join(step.sentence for step in take.steps)


def poses(frames: int, ratio: int, segments: int) -> np.ndarray:
    """Random poses, shape (frames, ratio, segments, 4, 4)."""
    rng = np.random.default_rng(3)
    pose = np.zeros((frames, ratio, segments, 4, 4))
    turns = rotation_matrices(rng.normal(size=(frames * ratio * segments, 4)))
    pose[..., :3, :3] = turns.reshape(frames, ratio, segments, 3, 3)
    pose[..., :3, 3] = rng.uniform(-500, 500, (frames, ratio, segments, 3))
    pose[..., 3, 3] = 1.0
    return pose


@pytest.mark.skipif(not REAL.is_dir(), reason="the shared recordings are not at hand")
def test_a_real_recording_reads_as_by_ezc3d_bit_for_bit():
    given = ezc3d.c3d(str(REAL / "box_lift.c3d"))["data"]["points"][:3].transpose(2, 1, 0)
    np.testing.assert_array_equal(given, positions(c3d.read(REAL / "box_lift.c3d")))


@pytest.mark.parametrize("processor", [INTEL, DEC, MIPS])
@pytest.mark.parametrize("scale", [-0.1, 0.01])
def test_every_processor_and_both_kinds_of_numbers(tmp_path, processor, scale):
    residual = _hidden()
    analog = np.random.default_rng(2).integers(-99, 99, (40, 5, 3))
    take = read(tmp_path, c3d_bytes(P, residual=residual, analog=analog, scale=scale, processor=processor))
    expected = np.where(residual[..., None] < 0, np.nan, P)
    np.testing.assert_allclose(positions(take), expected, atol=0.006, equal_nan=True)
    assert (take.rate, take.units, take.steps) == (100.0, "mm", ())


@pytest.mark.parametrize("rate", [69.9926, 179.82, 1 / 0.007])
@pytest.mark.parametrize("samples", [1, 20])
def test_analog_samples_shift_nothing_at_odd_rates(tmp_path, rate, samples):
    take = read(tmp_path, c3d_bytes(P, analog=np.full((40, samples, 3), 7.0), rate=rate))
    np.testing.assert_allclose(positions(take), P, rtol=1e-6)
    assert take.rate == pytest.approx(rate, rel=1e-6)
    np.testing.assert_allclose(np.diff(take.time), 1 / rate, rtol=1e-6)


@pytest.mark.parametrize("missing", [["RATE"], ["SCALE", "OFFSET"], ["USED", "RATE", "SCALE", "OFFSET"]])
def test_analog_parameters_may_be_absent(tmp_path, missing):
    groups = {"ANALOG": dict.fromkeys(missing)}
    take = read(tmp_path, c3d_bytes(P, analog=np.full((40, 10, 3), 7.0), groups=groups))
    np.testing.assert_allclose(positions(take), P, rtol=1e-6)


@pytest.mark.parametrize("make", YARDSTICKS)
def test_values_are_those_of_ezc3d_bit_for_bit(tmp_path, make):
    take = read(tmp_path, YARDSTICKS[make]())
    data = ezc3d.c3d(str(tmp_path / "take.any"))["data"]
    given = data["points"][:3].transpose(2, 1, 0)
    given[(given == 0).all(axis=2)] = np.nan  # what stands at exactly zero was not seen
    markers = given.shape[1]
    np.testing.assert_array_equal(given, positions(take)[: len(given), :markers])
    assert np.isnan(positions(take)[len(given) :, :markers]).all()  # ezc3d leaves out what is unseen at the end
    origins = positions(take)[:, markers:]
    if origins.size:
        np.testing.assert_array_equal(data["rotations"][:3, 3].transpose(2, 1, 0), origins)


def test_a_file_of_the_librarys_own(tmp_path):
    content = ezc3d.c3d()
    content["parameters"]["POINT"]["RATE"]["value"] = [69.9926]
    content["parameters"]["POINT"]["UNITS"]["value"] = ["m"]
    content["parameters"]["POINT"]["LABELS"]["value"] = [f"Subject:M{i}" for i in range(300)]  # LABELS2 from 256 on
    numbers = np.ones((4, 300, 6))
    numbers[:3] = np.random.default_rng(0).normal(size=(3, 300, 6))
    numbers[:3, 7, 2] = np.nan
    content["data"]["points"] = numbers
    content.write(str(tmp_path / "own.c3d"))
    take = c3d.read(tmp_path / "own.c3d")
    assert list(take.points) == [f"Subject:M{i}" for i in range(300)]
    np.testing.assert_allclose(positions(take), numbers[:3].transpose(2, 1, 0), rtol=1e-6, equal_nan=True)
    assert (take.units, take.up) == ("m", None)


@pytest.mark.parametrize(
    ("stated", "units", "said"),
    [
        ("mm", "mm", False),
        ("m", "m", False),
        ("CM ", "cm", False),
        ("meters", "m", False),
        ("", None, False),
        ("deg", None, True),
    ],
)
def test_units_are_those_stated(tmp_path, stated, units, said):
    take = read(tmp_path, c3d_bytes(P, groups={"POINT": {"UNITS": stated}}))
    assert take.units == units
    assert bool(take.steps) == said


@pytest.mark.parametrize(("screen", "up"), [("+Z", "z"), ("+Y", "y"), ("X", "x"), ("-Z", None), (None, None)])
def test_up_is_up_on_the_screen(tmp_path, screen, up):
    take = read(tmp_path, c3d_bytes(P, groups={"POINT": {"X_SCREEN": "+X", "Y_SCREEN": screen}}))
    assert take.up == up
    assert bool(take.steps) == (screen == "-Z")


def test_same_labels_are_numbered(tmp_path):
    take = read(tmp_path, c3d_bytes(P, groups={"POINT": {"LABELS": ["a", "a", "a#2", "a"]}}))
    assert list(take.points) == ["a", "a#3", "a#2", "a#4"]
    assert "a#3, a#4" in sentences(take)
    np.testing.assert_allclose(take.points["a"], P[:, 0], rtol=1e-6)


def test_points_without_label_are_kept(tmp_path):
    take = read(tmp_path, c3d_bytes(P, groups={"POINT": {"LABELS": ["a", " ", "b"]}}))
    assert list(take.points) == ["a", "unlabeled 2", "b", "unlabeled 4"]
    assert "2 of 4 points have no label" in sentences(take)


def test_labels_in_any_encoding(tmp_path):
    raw = "Ellbögen".encode("latin-1").ljust(12, b"\0") + "手腕\tx".encode().ljust(12)
    names = list(read(tmp_path, c3d_bytes(P, groups={"POINT": {"LABELS": (-1, [12, 2], raw)}})).points)
    assert names[:2] == ["Ellbögen", "手腕?x"]


def test_model_outputs_are_left_out(tmp_path):
    groups = {
        "POINT": {"LABELS": ["a", "LElbowAngles", "b", "LPower"], "ANGLES": ["LElbowAngles"], "POWERS": ["LPower"]}
    }
    take = read(tmp_path, c3d_bytes(P, groups=groups))
    assert list(take.points) == ["a", "b"]
    assert "LElbowAngles, LPower" in sentences(take)
    alone = c3d_bytes(P, groups={"POINT": {"ANGLES": [f"M{i}" for i in range(4)]}})
    assert "model outputs only" in refusal(tmp_path, alone)


@pytest.mark.parametrize("long", ["TRIAL", "LONG_FRAMES", "FRAMES"])
def test_more_frames_than_sixteen_bits_count(tmp_path, long):
    points = np.ones((70_000, 1, 3)) * np.arange(1, 70_001)[:, None, None]
    fields = {"ACTUAL_START_FIELD": [1, 0], "ACTUAL_END_FIELD": [70_000 % 65536, 1]}
    groups = {"TRIAL": fields} if long == "TRIAL" else {"POINT": {long: 70_000.0}}
    take = read(tmp_path, c3d_bytes(points, groups=groups))
    np.testing.assert_allclose(take.points["M0"][:, 0], np.arange(1, 70_001))


def test_the_zeros_that_fill_the_last_block_are_no_frames(tmp_path):
    points = np.ones((70_001, 1, 3)) * np.arange(1, 70_002)[:, None, None]  # 16 bytes a frame, 31 of them in a block
    content = c3d_bytes(points, groups={"POINT": {"FRAMES": 65535.0}}, header={"first": 1, "last": 65535})
    assert len(read(tmp_path, content).time) == 70_001


@pytest.mark.parametrize(
    ("header", "groups"), [({"last": 7}, {}), ({"points": 9}, {}), ({}, {"POINT": {"FRAMES": 39}})]
)
def test_the_data_tell_who_is_right(tmp_path, header, groups):
    take = read(tmp_path, c3d_bytes(np.tile(P, (1, 9, 1)), header=header, groups=groups))
    assert positions(take).shape == (40, 36, 3)
    assert bool(take.steps) == bool(groups)


def test_a_wrong_analog_count_is_seen_through(tmp_path):
    take = read(tmp_path, c3d_bytes(P, analog=np.ones((40, 10, 6)), header={"analog": 7}))
    np.testing.assert_allclose(positions(take), P, rtol=1e-6)
    assert "60" in sentences(take)


def test_what_is_absent_is_made_up_for(tmp_path):
    assert read(tmp_path, c3d_bytes(P, rate=50.0, groups={"POINT": {"RATE": None}})).rate == 50.0
    assert read(tmp_path, c3d_bytes(P, groups={"POINT": {"UNITS": None}})).units is None
    assert read(tmp_path, c3d_bytes(P, first=185)).time[0] == 0.0  # there are no times in a C3D file


def test_segments_have_pose_and_place(tmp_path):
    pose = poses(40, 1, 2)
    pose[5:8, 0, 1] = np.nan
    groups = {"ROTATION": {"LABELS": ["M2_4X4", "r_hand_4X4"]}}
    take = read(tmp_path, c3d_bytes(P, rotations=pose, groups=groups))
    assert list(take.points) == ["M0", "M1", "M2", "M3", "r_hand"]
    np.testing.assert_allclose(take.points["M2"], P[:, 2], rtol=1e-6)  # the marker, not the segment
    for index, name in enumerate(("M2", "r_hand")):
        turned = rotation_matrices(take.orientations[name])
        np.testing.assert_allclose(turned, pose[:, 0, index, :3, :3], atol=1e-6, equal_nan=True)
    np.testing.assert_allclose(take.points["r_hand"], pose[:, 0, 1, :3, 3], rtol=1e-6, equal_nan=True)
    assert np.isnan(take.orientations["r_hand"]).all(axis=1).nonzero()[0].tolist() == [5, 6, 7]


@pytest.mark.parametrize("processor", [INTEL, DEC, MIPS])
def test_segments_alone_make_a_recording(tmp_path, processor):
    pose = poses(12, 1, 3)
    take = read(tmp_path, c3d_bytes(np.zeros((12, 0, 3)), rotations=pose, processor=processor))
    assert list(take.orientations) == ["s0", "s1", "s2"]
    np.testing.assert_allclose(positions(take), pose[:, 0, :, :3, 3], rtol=1e-6)


def test_rotations_at_a_multiple_of_the_rate(tmp_path):
    pose = poses(40, 3, 1)
    groups = {"ROTATION": {"RATIO": None, "RATE": 300.0}}
    take = read(tmp_path, c3d_bytes(P, rotations=pose, groups=groups))
    np.testing.assert_allclose(take.points["s0"], pose[:, 0, 0, :3, 3], rtol=1e-6)
    assert "3 times a frame" in sentences(take)
    text = refusal(tmp_path, c3d_bytes(P, rotations=pose, groups={"ROTATION": {"RATIO": None, "RATE": 250.0}}))
    assert "2.5 times a frame" in text


def test_what_is_no_rotation_is_missing(tmp_path):
    pose = poses(40, 1, 1)
    pose[4, ..., :3, :3] *= 2.0
    take = read(tmp_path, c3d_bytes(P, rotations=pose))
    assert np.isnan(take.orientations["s0"]).any(axis=1).nonzero()[0].tolist() == [4]
    assert "1 poses of segment 's0' are no rotation" in sentences(take)


def test_parameters_the_library_would_crash_on_do_no_harm(tmp_path):
    for odd in ((-1, [], b"x"), (-1, [0], b""), (2, [255, 255, 255, 0], b""), (4, [0], b"")):
        np.testing.assert_allclose(
            positions(read(tmp_path, c3d_bytes(P, groups={"POINT": {"ODD": odd}}))), P, rtol=1e-6
        )


@pytest.mark.parametrize(
    ("header", "groups", "said"),
    [
        ({"points": 0}, {"POINT": {"USED": 0}}, "no points"),
        ({"points": 0, "analog": 30}, {"POINT": {"USED": 0}}, "analog channels only"),
        ({"first": 0, "last": 0}, {"POINT": {"FRAMES": 0}}, "no frames"),
        ({}, {"POINT": {"USED": 65535}}, "65535 points"),
        ({}, {"POINT": {"USED": 9999}}, "cut off after 0 of 40 frames"),
        ({"last": 60_000}, {"POINT": {"FRAMES": 60_000}}, "cut off after"),
        ({}, {"POINT": {"LONG_FRAMES": 2e9, "FRAMES": None}, "header": {"last": 0}}, "cut off after"),
        ({"start": 60_000}, {"POINT": {"DATA_START": 60_000}}, "block 60000"),
        ({"start": 1}, {"POINT": {"DATA_START": 1}}, "block 1"),
        ({"scale": 0.0}, {"POINT": {"SCALE": 0.0}}, "scale is 0"),
        ({"rate": 0.0}, {"POINT": {"RATE": 0.0}}, "rate is 0"),
        ({}, {"POINT": {"RATE": -5.0}}, "rate is -5"),
        ({}, {"POINT": {"ODD": (3, [], b"abc")}}, "no known type"),
        ({}, {"POINT": {"ODD": (2, [255, 255, 255], b"abc")}}, "claims 33162750 bytes"),
        ({}, {"ROTATION": {"USED": 2, "RATIO": 1, "DATA_START": 4000}}, "end beyond the file"),
        ({}, {"ROTATION": {"USED": 2, "RATIO": 1}}, "2 rotations from block 0"),
    ],
)
def test_what_cannot_be_is_refused(tmp_path, header, groups, said):
    groups = {name: values for name, values in groups.items() if name != "header"}
    header = {"first": 0, "last": 0} if "LONG_FRAMES" in groups.get("POINT", {}) else header
    assert said in refusal(tmp_path, c3d_bytes(P, header=header, groups=groups))


def test_infinite_positions_are_refused(tmp_path):
    points = P.copy()
    points[7, 2, 1] = np.inf
    assert "'M2' is infinite in frame 8" in refusal(tmp_path, c3d_bytes(points))


def test_places_where_nothing_can_be_are_refused(tmp_path):
    points = P.copy()
    points[7, 2, 1] = -3e30
    (tmp_path / "take.c3d").write_bytes(c3d_bytes(points))
    with pytest.raises(RecordingError, match=r"take.c3d: point 'M2' lies at -3e\+30 in frame 8"):
        read_recording(tmp_path / "take.c3d")


@pytest.mark.parametrize(
    ("at", "value", "said"),
    [
        (0, 200, "block 200"),
        (0, 1, "block 1"),
        (515, 99, "type is 99"),
        (516, 127, "which is not"),
        (524, 255, "which is"),
    ],
)
def test_pointers_that_lead_nowhere_are_refused(tmp_path, at, value, said):
    content = bytearray(c3d_bytes(P))
    content[at] = value
    assert said in refusal(tmp_path, bytes(content))


def test_other_files_are_not_taken_for_c3d(tmp_path):
    for head in (b"XP,YP\n1,2\n", "\ufeffXP,1".encode("utf-16")):
        assert not c3d.matches(head)
    (tmp_path / "text.c3d").write_text("a P text\n" * 99)
    for path in (tmp_path / "text.c3d", tmp_path / "missing.c3d", tmp_path):
        with pytest.raises(RecordingError, match=str(path.name)):
            c3d.read(path)


def test_a_file_that_shrinks_while_it_is_read_is_a_sentence(tmp_path, monkeypatch):
    content = c3d_bytes(P)

    def truncated_behind(path):
        layout = read_layout(path)
        path.write_bytes(content[:-600])
        return layout

    monkeypatch.setattr(c3d, "read_layout", truncated_behind)
    assert "shorter while it was read" in refusal(tmp_path, content)


def test_pieces_make_one_recording(tmp_path, monkeypatch):
    content = c3d_bytes(P, analog=np.ones((40, 3, 2)), rotations=poses(40, 2, 2))
    whole = read(tmp_path, content)
    monkeypatch.setattr(c3d, "_PIECE", 1000)  # a few frames
    pieces = read(tmp_path, content)
    np.testing.assert_array_equal(positions(pieces), positions(whole))
    np.testing.assert_array_equal(pieces.orientations["s1"], whole.orientations["s1"])


def test_a_big_endian_file_may_have_a_little_endian_last_offset(tmp_path):
    """Some files of SGI machines end their parameters so."""
    content = c3d_bytes(P, processor=MIPS, groups={"ZZ": {"LAST": ["a", "b"]}})
    at = content.index(b"LAST") + 4
    swapped = content[:at] + content[at : at + 2][::-1] + content[at + 2 :]
    assert swapped != content
    np.testing.assert_array_equal(positions(read(tmp_path, swapped)), positions(read(tmp_path, content)))


def test_a_minute_and_a_half_of_sixty_markers_in_a_tenth_of_a_second(tmp_path):
    frames = 20_000
    points = np.random.default_rng(0).normal(size=(frames, 60, 3)).astype(np.float32)
    fields = {"ACTUAL_START_FIELD": [1, 0], "ACTUAL_END_FIELD": [frames % 65536, 0]}
    content = c3d_bytes(points, rate=200.0, groups={"TRIAL": fields})
    before = time.process_time()
    take = read(tmp_path, content)
    assert time.process_time() - before < 2.0  # 0.06 s
    np.testing.assert_array_equal(take.points["M59"], points[:, 59])
