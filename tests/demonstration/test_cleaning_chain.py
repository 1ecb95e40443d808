"""The cleaning as a whole, from the recording to the task."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tasks import task_of

from armdesign import Settings
from armdesign.demonstration import About, Recording, read_recording, read_recordings
from armdesign.demonstration.cleaning.cleaning import clean
from armdesign.demonstration.convert import convert, write_conversion
from armdesign.demonstration.files.quaternions import product, rotation_matrices
from armdesign.errors import RecordingError
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Task as TaskSettings

SHARED = Path(__file__).resolve().parents[3] / "shared" / "recordings"
CAPTURED = About(format="C3D", captured=True)
FULL = {"max_gap": 0.3, "low_pass": 5.0, "outliers": True, "repeats": True, "start": 5.4, "stop": 8.6, "rate": 60.0}


def arm(about=CAPTURED, seed=0, bad=True):
    """A noisy arm of 0.3 + 0.25 + 0.1 m with everything that wants cleaning."""
    rng = np.random.default_rng(seed)
    time = np.arange(400) / 100 + 5.0
    phase = time[:, None] * 2.0 + rng.uniform(0, 6, (3, 1, 1))
    links = np.concatenate([np.cos(phase), np.sin(phase) * 0.6, np.sin(phase) * 0.8], axis=2)
    places = np.array([1.0, 2.0, 1.4]) + np.cumsum(
        np.concatenate([0 * links[:1], links * [[[0.3]], [[0.25]], [[0.1]]]]), 0
    )
    places += rng.normal(size=places.shape) * 3e-4
    turn = np.cumsum(rng.normal(size=(400, 4)) * 0.02, axis=0) + np.array([0, 0, 0, 1.0])
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    if bad:
        places[3, 50] += 0.2
        places[2, 100:112] = np.nan
        places[:, [200, 201, 300]], turn[[200, 201, 300]] = places[:, [199, 199, 299]], turn[[199, 199, 299]]
    points = dict(zip(("shoulder", "elbow", "wrist", "hand"), places, strict=True))
    return Recording(time, points, {"hand": turn}, "r.c3d", about)


def turned(recording, quaternion, shift):
    """The whole scene turned and moved."""
    R = rotation_matrices(quaternion[None])[0]
    return recording.changed(recording.time, lambda p: p @ R.T + shift, lambda q: product(quaternion, q))


def test_what_is_captured_is_cleaned_and_what_is_finished_is_not():
    names = [step.name for step in clean(arm())[1]]
    assert names == ["outliers", "gaps", "repeats", "low_pass"]
    assert [step.name for step in clean(arm(About()))[1]] == ["gaps"]
    how = TaskSettings(outliers=False, repeats=False, low_pass="off")
    assert [step.name for step in clean(arm(), how)[1]] == ["gaps"]
    how = TaskSettings(outliers=True, repeats=True, low_pass=5.0)
    assert [step.name for step in clean(arm(About()), how)[1]] == names


def test_the_order_is_the_one_told():
    steps = clean(arm(), TaskSettings(start=5.4, stop=8.6, rate=60.0, scale=2.0))[1]
    assert [step.name for step in steps] == ["outliers", "gaps", "repeats", "low_pass", "crop", "resample", "scale"]
    assert all(step.sentence.endswith(".") for step in steps)


def test_slow_captures_are_not_smoothed_unless_asked():
    given = arm(bad=False)
    slow = Recording(np.arange(400) / 10.0, given.points, given.orientations, "r.c3d", CAPTURED)
    assert "low_pass" not in [step.name for step in clean(slow, TaskSettings(outliers=False))[1]]
    assert "low_pass" in [step.name for step in clean(slow, TaskSettings(outliers=False, low_pass=2.0))[1]]


def test_a_finished_recording_gives_the_task_recording_minus_base_to_the_last_bit():
    given = arm(About(), bad=False)
    task = task_of(given)
    for i, name in enumerate(task.points):
        assert task.P[:, i].tobytes() == (given.points[name] - given.points["shoulder"]).tobytes()


@pytest.mark.parametrize("axes", ["xyz", "yzx", "zxy"])
def test_cleaning_commutes_with_quarter_turns_of_the_scene(axes):
    quarter = {"xyz": [0, 0, 0, 1.0], "yzx": [0.5, 0.5, 0.5, 0.5], "zxy": [-0.5, -0.5, -0.5, 0.5]}[axes]
    q, shift = np.array(quarter), np.array([3.0, -1.0, 0.5])
    first, _ = clean(turned(arm(), q, shift), TaskSettings(**FULL))
    second = turned(clean(arm(), TaskSettings(**FULL))[0], q, shift)
    for name, places in first.points.items():
        np.testing.assert_allclose(places, second.points[name], atol=1e-12)
    R, S = (rotation_matrices(r.orientations["hand"]) for r in (first, second))
    np.testing.assert_allclose(R, S, atol=1e-12)


def test_cleaning_commutes_with_any_turn_where_nothing_is_interpolated():
    """Cubic interpolation that does not overshoot works axis by axis; all else is free of axes."""
    q = np.array([0.1, 0.5, -0.3, 0.8]) / np.linalg.norm([0.1, 0.5, -0.3, 0.8])
    how, shift = TaskSettings(start=5.4), np.array([3.0, -1.0, 0.5])
    first, steps = clean(turned(arm(bad=False), q, shift), how)
    assert [step.name for step in steps] == ["low_pass", "crop"]
    second = turned(clean(arm(bad=False), how)[0], q, shift)
    for name, places in first.points.items():
        np.testing.assert_allclose(places, second.points[name], atol=1e-12)


@pytest.mark.parametrize("factor", [0.8, 2.5])
def test_scale_multiplies_the_task_and_nothing_else(factor):
    one, other = task_of(arm(), **FULL), task_of(arm(), **FULL, scale=factor)
    np.testing.assert_allclose(other.P, factor * one.P, atol=1e-13)
    assert other.time.tobytes() == one.time.tobytes()


def test_the_filter_goes_before_the_crop():
    whole, _ = clean(arm(bad=False))
    part, _ = clean(arm(bad=False), TaskSettings(start=6.0, stop=7.0))
    np.testing.assert_array_equal(part.points["hand"], whole.points["hand"][100:201])


def test_a_gap_that_outliers_made_too_long_is_refused_with_the_times():
    given = arm(bad=False)
    hand = given.points["hand"].copy()
    hand[100:118] = np.nan
    hand[118:121] += 0.3
    worse = Recording(given.time, {**given.points, "hand": hand}, given.orientations, "r.c3d", CAPTURED)
    with pytest.raises(RecordingError, match=r"point 'hand' is not seen from 5.99 s to 6.21 s.*--no-outliers"):
        clean(worse)
    clean(worse, TaskSettings(max_gap=0.25))


def test_all_gaps_that_are_too_long_are_told():
    given = arm(bad=False)
    hand = given.points["hand"].copy()
    hand[100:140] = hand[200:230] = np.nan
    worse = Recording(given.time, {**given.points, "hand": hand}, source="r.c3d", about=CAPTURED)
    with pytest.raises(RecordingError, match=r"from 5.99 s to 6.4 s, longer .* also point 'hand' from 6.99 s to 7.3 s"):
        clean(worse)


CHANGES = {"nothing": {}, "everything": FULL | {"scale": 1.1, "base_mode": "fixed"}, "cut": {"cut": ((6.0, 6.5),)}}


@pytest.mark.parametrize("changes", CHANGES.values(), ids=CHANGES.keys())
def test_searching_what_was_converted_is_searching_the_recording(tmp_path, changes):
    given = still() if "cut" in changes else arm()
    settings = Settings().replace({"task": changes, "fitness": {"weights": (0.1, 0.2, 0.4), "orientation_weight": 0.3}})
    straight = prepare(given, settings)
    converted = convert(given, settings, oriented=True)
    csv, told = write_conversion(tmp_path / "out.csv", converted)
    assert told == tmp_path / "out.task.json"
    finished = replace(settings, task=TaskSettings(base_mode=changes.get("base_mode", "shoulder")))
    again = prepare(read_recording(csv), finished)
    assert again.task.time.tobytes() == straight.task.time.tobytes()
    np.testing.assert_allclose(again.task.P, straight.task.P, rtol=0, atol=1e-12)
    np.testing.assert_allclose(again.task.R, straight.task.R, rtol=0, atol=1e-12)


def still():
    """An arm that stands."""
    given = arm(bad=False)
    return given.changed(given.time, lambda p: p[:1] + 0 * p, lambda q: q[:1] + 0 * q)


def box_lift(name):
    return read_recording(SHARED / "pyomeca" / name)


BOX = {
    "base": "ACRO_tip",
    "points": ("elbow=EPICl+EPICm", "wrist=STYLr+STYLu", "hand=INDEX+LASTC+MEDH+LATH"),
    "orientation": "hand",
}


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared recordings are not at hand")
class TestRealRecordings:
    def test_the_handover_has_its_repeated_frames_refilled(self):
        folder = SHARED / "kth_handover"
        bones = ("RUArm", "RFArm", "RHand")
        files = {name: folder / f"giver_{name}_pose_saved.csv" for name in bones}
        task = task_of(read_recordings(files, rate=120.0), base="RUArm", points=("elbow=RFArm", "wrist=RHand"))
        steps = {step.name: step for step in task.steps}
        assert steps["repeats"].details["frames"] == 76
        (slides,) = [step for step in task.steps if step.name == "warning"]
        assert "the distance from 'elbow' to 'wrist' is not steady, 235 +- 14 mm" in slides.sentence

    def test_converting_a_capture_and_searching_it_is_the_same_task(self, tmp_path):
        settings = Settings().replace({"task": BOX, "fitness": {"scenario": "welding"}})
        given = box_lift("box_lift.c3d")
        straight = prepare(given, settings)
        csv, _ = write_conversion(tmp_path / "out.csv", convert(given, settings))
        again = prepare(read_recording(csv), Settings().replace({"fitness": {"scenario": "welding"}}))
        np.testing.assert_allclose(again.task.P, straight.task.P, rtol=0, atol=1e-12)
        np.testing.assert_allclose(again.task.R, straight.task.R, rtol=0, atol=1e-12)

    def test_what_was_settled_prepares_the_same_again(self):
        given = box_lift("box_lift.c3d")
        first = prepare(given, Settings().replace({"fitness": {"scenario": "welding"}}))
        second = prepare(given, first.settings)
        assert second.settings == first.settings
        assert second.task.P.tobytes() == first.task.P.tobytes()
        assert second.task.R.tobytes() == first.task.R.tobytes()

    def test_a_capture_with_long_gaps_is_refused_or_bridged(self):
        given = read_recording(SHARED / "motive_layout" / "motive123_rigidbodies_from_ktk_racing.csv")
        with pytest.raises(RecordingError, match=r"point 'Shoulder' is not seen from .* --max-gap"):
            task_of(given)
        assert np.isfinite(task_of(given, max_gap=0.5).P).all()
