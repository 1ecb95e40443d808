"""What is said and drawn of a recording."""

import json

import numpy as np
import pytest

from armdesign.demonstration import Recording
from armdesign.demonstration.picture import check_kind, draw_recording
from armdesign.demonstration.recording import About, Step
from armdesign.demonstration.summary import summarise, summary_text
from armdesign.errors import SettingsError

FRAMES = 21


def recording(names=("RSHO", "RELB", "RWRA", "RWRB", "box"), turns=("box",), captured=True):
    t = np.linspace(0, 2, FRAMES)
    points = {}
    for i, name in enumerate(names):
        points[name] = np.stack([np.cos(t), np.sin(t), -0.3 * np.full(FRAMES, i)], axis=1)
    about = About("C3D", captured, 10.0, {"box": ("a", "b", "c")}, (Step("odd", "Something was odd."),))
    orientations = {name: np.tile([0.0, 0, 0, 1], (FRAMES, 1)) for name in turns}
    return Recording(t, points, orientations, "folder/here.c3d", about)


def with_gaps(source, name, frames):
    points = {key: values.copy() for key, values in source.points.items()}
    points[name][frames] = np.nan
    return Recording(source.time, points, source.orientations, source.source, source.about)


def test_the_figures_are_those_of_the_recording():
    summary = summarise(with_gaps(recording(), "box", [0, 5, 6, 7, 12]))
    assert (summary.frames, summary.duration, summary.rate_declared) == (FRAMES, 2.0, 10.0)
    assert summary.rate_measured == pytest.approx(10.0)
    box = {seen.name: seen for seen in summary.points}["box"]
    assert (box.share, box.gaps) == (1 - 5 / FRAMES, 3)
    assert (box.longest, box.at) == (pytest.approx(0.4), pytest.approx(0.4))
    assert [seen.name for seen in summary.orientations] == ["box"]


def test_the_arm_has_its_segments():
    (arm,) = summarise(recording()).arms
    assert arm.chosen
    assert arm.base == "shoulder=RSHO"
    assert arm.points == ("elbow=RELB", "wrist=RWRA+RWRB")
    assert [segment.name for segment in arm.segments] == ["shoulder to elbow", "elbow to wrist"]
    np.testing.assert_allclose([s.mean for s in arm.segments], [0.3, 0.45])
    np.testing.assert_allclose([s.spread for s in arm.segments], 0.0, atol=1e-12)


def test_repeated_frames_are_counted():
    source = recording()
    points = {name: values.copy() for name, values in source.points.items()}
    for values in points.values():
        values[4] = values[3]
        values[5] = values[3]
    assert summarise(Recording(source.time, points, source.orientations)).repeated == 2


def test_the_text_says_it_all_in_lines_of_bearable_length():
    text = summary_text(summarise(with_gaps(recording(), "box", [5, 6])))
    for part in ("folder/here.c3d", "C3D, 21 frames over 2 s", "10 frames/s declared", "Something was odd.",
                 "5 points, 4 of them always seen", "box", "90.5 %", "box: a, b, c", "* the right arm (Plug-in Gait)",
                 "shoulder to elbow", "--base shoulder=RSHO --points elbow=RELB,wrist=RWRA+RWRB"):  # fmt: skip
        assert part in text
    assert max(map(len, text.splitlines())) < 120


def test_a_hole_in_time_is_told():
    source = recording()
    time = source.time + np.where(np.arange(FRAMES) > 9, 1.0, 0.0)
    text = summary_text(summarise(Recording(time, source.points, source.orientations, "here")))
    assert "longest time from one frame to the next: 1.1 s" in text


def test_a_finished_recording_is_taken_in_its_order():
    text = " ".join(summary_text(summarise(recording(captured=False))).split())
    assert "a search takes the base RSHO and follows RELB, RWRA, RWRB, box" in text


def test_points_of_unknown_names_are_said_how_to_be_named():
    said = " ".join(summary_text(summarise(recording(names=("m1", "m2", "m3")))).split())
    assert "No arm is known by the names of the points. Name those of the arm to a search, as in --base" in said


def test_a_recording_of_orientations_alone():
    summary = summarise(recording(names=()))
    assert summary.points == ()
    assert "1 orientation" in summary_text(summary)


def test_it_is_plain_json():
    summary = summarise(with_gaps(recording(), "box", [3]))
    again = json.loads(json.dumps(summary.to_dict(), allow_nan=False))
    assert again["points"][0] == {"name": "RSHO", "share": 1.0, "gaps": 0, "longest": 0.0, "at": None}


DRAWN = {
    "an arm": recording(),
    "gaps": with_gaps(recording(), "RELB", [4, 5]),
    "never seen": with_gaps(recording(), "box", slice(None)),
    "few, no arm": recording(("a", "b", "c")),
    "many": recording(tuple(f"point{i}" for i in range(150))),
    "odd names": recording(("$x_1$", "a" * 200, "肩", "_y")),
    "nothing": recording(()),
}


@pytest.mark.parametrize("kind", ["png", "svg", "pdf"])
def test_pictures_are_of_their_kind_and_the_same_each_time(kind):
    content = draw_recording(DRAWN["odd names"], kind)
    assert {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}[kind] == content[: 5 if kind == "svg" else 4]
    assert draw_recording(DRAWN["odd names"], kind) == content


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("source", DRAWN.values(), ids=DRAWN.keys())
def test_everything_can_be_drawn(source):
    assert len(draw_recording(source)) > 1000


def test_another_kind_is_refused():
    with pytest.raises(SettingsError, match=r"a picture cannot be written as '.gif'; allowed: .png, .svg, .pdf"):
        check_kind("gif")


def test_points_that_were_never_seen_are_listed_in_a_line():
    values = np.tile([0.0, 0.0, 1.0], (9, 1))
    points = {"a": values, "b": np.full((9, 3), np.nan), "c": np.full((9, 3), np.nan)}
    text = summary_text(summarise(Recording(np.arange(9) / 10.0, points)))
    assert "never seen: b, c" in text
    assert "with gaps" not in text
