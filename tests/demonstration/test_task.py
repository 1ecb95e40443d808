import pickle

import numpy as np
import pytest
from tasks import task_of

from armdesign.demonstration import (
    Recording,
    Task,
    read_recording,
    task_from_recording,
    task_recording,
    write_plain_csv,
)
from armdesign.demonstration.files.quaternions import rotation_matrices
from armdesign.demonstration.findings import arm_length
from armdesign.errors import TaskError

FRAMES = 60


def arm(seed=0, sway=0.0, unit=1.0):
    """An arm of 0.3 + 0.25 + 0.1 m moving about a shoulder that sways by that much."""
    rng = np.random.default_rng(seed)
    time = np.arange(FRAMES) / 60 + 5.0
    phase = time[:, None] * 2.0 + rng.uniform(0, 6, (3, 1, 1))
    links = np.concatenate([np.cos(phase), np.sin(phase) * 0.6, np.sin(phase) * 0.8], axis=2)
    shoulder = np.array([1.0, 2.0, 1.4]) + sway * np.c_[np.sin(time * 3), 0 * time, 0 * time]
    elbow = shoulder + 0.3 * links[0]
    wrist = elbow + 0.25 * links[1]
    hand = wrist + 0.1 * links[2]
    turn = np.cumsum(rng.normal(size=(FRAMES, 4)) * 0.05, axis=0) + np.array([0, 0, 0, 1.0])
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    points = {"shoulder": shoulder, "elbow": elbow, "wrist": wrist, "hand": hand}
    return Recording(time, {n: v * unit for n, v in points.items()}, {"hand": turn, "elbow": turn[::-1]}, "r.csv")


def with_point(recording, name, values):
    return Recording(recording.time, {**recording.points, name: values}, recording.orientations, recording.source)


def test_defaults_take_everything_from_the_first_point():
    recording = arm()
    task = task_of(recording)
    assert (task.base, task.points, task.orientation) == ("shoulder", ("elbow", "wrist", "hand"), None)
    assert task.R is None
    assert task.quaternions is None
    assert task.dt == pytest.approx(1 / 60)
    np.testing.assert_array_equal(task.time, recording.time)
    for i, name in enumerate(task.points):
        np.testing.assert_array_equal(task.P[:, i], recording.points[name] - recording.points["shoulder"])


def test_arm_length_is_the_sum_of_the_links():
    assert arm_length(task_of(arm(sway=0.3)).P) == pytest.approx(0.65, rel=0.3)
    assert arm_length(np.tile([[0.3, 0, 0], [0.3, 0.2, 0]], (4, 1, 1))) == pytest.approx(0.5)


def test_points_and_base_by_name():
    recording = arm()
    task = task_of(recording, base="elbow", points=["hand"], orientation="elbow")
    np.testing.assert_array_equal(task.P[:, 0], recording.points["hand"] - recording.points["elbow"])
    np.testing.assert_allclose(task.R, rotation_matrices(recording.orientations["elbow"]), atol=1e-15)


def test_shoulder_mode_ignores_where_the_whole_body_is():
    recording = arm(sway=0.05)
    moved = {name: values + np.array([3.0, -1.0, 0.5]) for name, values in recording.points.items()}
    other = task_of(Recording(recording.time, moved))
    np.testing.assert_allclose(other.P, task_of(recording).P, atol=1e-12)


def test_fixed_mode_keeps_places_in_the_room():
    recording = arm(sway=0.05)
    task = task_of(recording, base_mode="fixed")
    origin = recording.points["shoulder"].mean(axis=0)
    np.testing.assert_allclose(task.P[:, 2] + origin, recording.points["hand"], atol=1e-12)


def test_both_modes_agree_for_a_base_that_stands():
    recording = arm()
    np.testing.assert_allclose(task_of(recording, base_mode="fixed").P, task_of(recording).P, atol=1e-12)


def test_scaling_and_turning_the_scene():
    recording, turn = arm(sway=0.1), rotation_matrices(np.array([[0.1, 0.5, -0.3, 0.8]]))[0]
    scaled = task_of(recording, scale=1.5)
    np.testing.assert_allclose(scaled.P, 1.5 * task_of(recording).P, atol=1e-12)
    turned = Recording(recording.time, {name: values @ turn.T for name, values in recording.points.items()})
    np.testing.assert_allclose(task_of(turned).P, task_of(recording).P @ turn.T, atol=1e-12)


@pytest.mark.parametrize("mode", ["shoulder", "fixed"])
def test_a_moving_base_is_noted(mode):
    notes = task_of(arm(sway=0.05), base_mode=mode).notes
    (note,) = [note for note in notes if "moves up to" in note]
    assert note.startswith("The base shoulder moves up to ")
    assert f"base_mode '{mode}'" in note


def test_a_standing_base_is_not_noted():
    assert not any("moves up to" in note for note in task_of(arm(sway=0.004)).notes)


def test_notes_tell_what_was_found_and_done():
    hand = arm().points["hand"].copy()
    hand[20:23] = np.nan
    notes = task_of(with_point(arm(), "hand", hand), low_pass=6.0, rate=30.0, start=5.1, stop=5.9).notes
    assert notes[0] == "The recording has 60 frames over 0.9833 s, about 60 frames/s."
    assert notes[1] == "Base shoulder; points from there to the hand: elbow, wrist, hand; no orientation."
    assert notes[2].startswith("Filled 1 gap by interpolation (1 of point 'hand'); the longest: 0.0667 s")
    assert notes[3].startswith("Smoothed")
    assert notes[4].startswith("Cropped to 5.1")
    assert notes[5].startswith("Resampled to 30")
    assert notes[6].startswith("Distances: shoulder to elbow 300 +- 0")
    assert notes[7].startswith("hand travels ")
    assert "the demonstrator's arm measures" in notes[-1]


def test_only_used_points_are_looked_at():
    broken = with_point(arm(), "stray", np.full((FRAMES, 3), np.nan))
    task = task_of(broken, points=["elbow", "wrist", "hand"])
    np.testing.assert_array_equal(task.P, task_of(arm()).P)
    with pytest.raises(TaskError, match=r"r.csv: point 'stray' was not seen in any frame"):
        task_of(broken)


@pytest.mark.parametrize("orientation", [None, "hand", "elbow", "shoulder"])
@pytest.mark.parametrize("mode", ["shoulder", "fixed"])
def test_round_trip_through_csv_to_the_last_bit(tmp_path, orientation, mode):
    recording = arm(seed=3, sway=0.05)
    turns = {**recording.orientations, "shoulder": recording.orientations["hand"]}
    given = Recording(recording.time, recording.points, turns)
    task = task_of(given, orientation=orientation, base_mode=mode, low_pass=8.0, rate=37.0)
    write_plain_csv(tmp_path / "task.csv", task_recording(task))
    again = task_from_recording(read_recording(tmp_path / "task.csv"), base=task.base)
    assert (again.points, again.base, again.orientation) == (task.points, task.base, orientation)
    assert again.time.tobytes() == task.time.tobytes()
    assert again.P.tobytes() == task.P.tobytes()
    if orientation is None:
        assert again.R is None
    else:
        assert again.quaternions.tobytes() == task.quaternions.tobytes()
        assert again.R.tobytes() == task.R.tobytes()
    write_plain_csv(tmp_path / "again.csv", task_recording(again))
    assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "task.csv").read_bytes()


def test_a_task_survives_being_sent_to_a_worker():
    task = task_of(arm(), orientation="hand")
    again = pickle.loads(pickle.dumps(task))  # noqa: S301
    assert again.P.tobytes() == task.P.tobytes()
    assert again.notes == task.notes


def test_task_from_recording_refuses_what_is_no_task():
    recording = arm()
    hand = recording.points["hand"].copy()
    hand[4] = np.nan
    with pytest.raises(TaskError, match="one orientation at most, here are 2"):
        task_from_recording(recording)
    with pytest.raises(TaskError, match="'hand' is missing in frame 5"):
        task_from_recording(Recording(recording.time, {"hand": hand}))
    with pytest.raises(TaskError, match="orientations only"):
        task_from_recording(Recording(recording.time, {}, {"hand": recording.orientations["hand"]}))
    with pytest.raises(TaskError, match="not of unit length"):
        task_from_recording(Recording(recording.time, recording.points, {"hand": 2 * recording.orientations["hand"]}))


UNITS = {
    "millimetres": (
        1000.0,
        1.0,
        r"measures \d+\.?\d* m; allowed: 0.1 to 2 m. This looks like millimetres: read it with --units mm",
    ),
    "centimetres": (100.0, 1.0, "This looks like centimetres: read it with --units cm"),
    "too long": (10.0, 1.0, "Choose --base and --points along one arm"),
    "too short": (0.05, 1.0, "Choose --base at the shoulder"),
    "scaled for nothing": (1.0, 0.001, "after scaling by 0.001; .*metres already: leave out --scale"),
    "scaled by too little": (1000.0, 0.5, "millimetres: read it with --units mm"),
}


@pytest.mark.parametrize(("unit", "scale", "message"), UNITS.values(), ids=UNITS.keys())
def test_wrong_units(unit, scale, message):
    with pytest.raises(TaskError, match=message):
        task_of(arm(unit=unit), scale=scale)


def test_the_advised_unit_works(tmp_path):
    write_plain_csv(tmp_path / "mm.csv", arm(unit=1000.0))
    given = read_recording(tmp_path / "mm.csv", units="mm")
    np.testing.assert_allclose(task_of(given).P, task_of(arm()).P, atol=1e-12)


def test_the_arm_is_measured_from_the_moving_base():
    walking = arm(sway=5.0)
    assert task_of(walking, base_mode="fixed").notes[-1] == task_of(walking).notes[-1]


TIME3, P3 = np.arange(3.0), np.ones((3, 1, 3))
QUATERNIONS3 = np.tile([0.0, 0, 0, 1], (3, 1))
BAD_TASKS = {
    "shape": (
        (TIME3, np.ones((3, 2, 3)), None, None, ("hand",), "b"),
        r"P has shape \(3, 2, 3\); allowed: \(3, 1, 3\)",
    ),
    "missing": ((TIME3, P3 * np.nan, None, None, ("hand",), "b"), "missing or infinite value in frame 1"),
    "two frames": ((TIME3[:2], P3[:2], None, None, ("hand",), "b"), "three or more frames"),
    "time back": ((TIME3[::-1], P3, None, None, ("hand",), "b"), "increasing times"),
    "no points": ((TIME3, np.ones((3, 0, 3)), None, None, (), "b"), "needs points, each of another name"),
    "same name": ((TIME3, np.ones((3, 2, 3)), None, None, ("hand", "hand"), "b"), "each of another name"),
    "R alone": ((TIME3, P3, np.tile(np.eye(3), (3, 1, 1)), None, ("hand",), "b"), "needs its quaternions"),
    "R unlike": ((TIME3, P3, np.tile(-np.eye(3), (3, 1, 1)), QUATERNIONS3, ("hand",), "b"), "not the same rotations"),
    "not unit": ((TIME3, P3, None, 2 * QUATERNIONS3, ("hand",), "b"), "not of unit length"),
}


@pytest.mark.parametrize(("fields", "message"), BAD_TASKS.values(), ids=BAD_TASKS.keys())
def test_task_checks_itself(fields, message):
    with pytest.raises(TaskError, match=message):
        Task(*fields)


def test_task_computes_R_and_is_read_only():
    task = Task(TIME3, P3, None, QUATERNIONS3, ("hand",), "base")
    assert task.orientation == "hand"
    np.testing.assert_array_equal(task.R, np.tile(np.eye(3), (3, 1, 1)))
    with pytest.raises(ValueError, match="read-only"):
        task.P[0] = 0.0
