"""Real recordings, in the laboratories' own formats and converted to plain CSV, where they are at hand."""

from pathlib import Path

import numpy as np
import pytest
from tasks import task_of

from armdesign.demonstration import (
    read_recording,
    read_recordings,
    resolve,
    task_from_recording,
    task_recording,
    write_plain_csv,
)
from armdesign.demonstration.files.quaternions import rotation_matrices
from armdesign.demonstration.picture import draw_recording
from armdesign.demonstration.summary import summarise, summary_text
from armdesign.errors import TaskError

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "recordings"
BOX = (FOLDER / "pyomeca" / "box_lift_vicon.csv", FOLDER / "pyomeca" / "box_lift.c3d")
BONES = {"shoulder": "RUArm", "elbow": "RFArm", "hand": "RHand"}
SEGMENTS = {  # [mm], published where a spread stands
    "pyomeca/box_lift_vicon.csv": [(308, 12), (261, 7), (53, 3)],
    "pyomeca/box_lift.c3d": [(308, 12), (261, 7), (53, 3)],
    "pyomeca/box_lift_start.trc": [(327, 2), (258, 1), (54, 0)],
    "opensim/markers_walk.trc": [(368, 1), (272, 1)],
    "opensim/dataWithNaNsWithSpaces.trc": [(359, 4), (258, 2)],
    "motive_layout/motive125_bones_from_kth_giver.csv": [(252, 0), (235, 14)],
    "motive_layout/motive123_rigidbodies_from_ktk_racing.csv": [(263, 38), (275, 21), (181, 10)],
}
UPRIGHT = {  # which axis points up in the file
    "pyomeca/box_lift_start.trc": "z",
    "opensim/markers_walk.trc": "y",
    "opensim/dataWithNaNsWithSpaces.trc": "y",
    "opensim/std_walking2_markers.trc": "z",
    "motive_layout/motive125_bones_from_kth_giver.csv": "z",
    "motive_layout/motive123_rigidbodies_from_ktk_racing.csv": "y",
}

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the shared recordings are not at hand")


@pytest.mark.parametrize("file", SEGMENTS)
def test_the_guessed_arm_has_its_size(file):
    summary = summarise(read_recording(FOLDER / file))
    (arm,) = [arm for arm in summary.arms if arm.chosen]
    found = [(1e3 * segment.mean, 1e3 * segment.spread) for segment in arm.segments]
    np.testing.assert_allclose(found, SEGMENTS[file], atol=0.6)
    assert arm.what in summary_text(summary)


@pytest.mark.parametrize("file", UPRIGHT)
def test_the_up_axis_is_found(file):
    steps = {step.name: step.details for step in read_recording(FOLDER / file).about.steps}
    assert steps["up"]["axis"] == UPRIGHT[file]


def test_the_same_trial_from_vicon_and_c3d_is_the_same_task():
    one, other = (task_of(read_recording(file), orientation="hand") for file in BOX)
    assert one.points == other.points == ("elbow", "wrist", "hand")
    np.testing.assert_allclose(one.P, other.P, atol=1e-5)
    np.testing.assert_allclose(one.R, other.R, atol=1e-3)


@pytest.mark.parametrize("file", BOX, ids=lambda file: file.name)
def test_points_and_hand_are_those_published(file):
    published = read_recording(FOLDER / "converted" / "box_lift.csv")
    points = ("elbow=EPICl+EPICm", "wrist=STYLr+STYLu", "hand=INDEX+LASTC+MEDH+LATH")
    chosen = resolve(read_recording(file), "shoulder=ACRO_tip", points, "hand")
    for name, values in published.points.items():
        np.testing.assert_allclose(chosen.recording.points[name], values, atol=1e-5)
    ours, theirs = chosen.recording.orientations["hand"], published.orientations["hand"]
    both = ~np.isnan(ours[:, 0]) & ~np.isnan(theirs[:, 0])
    assert both.sum() == 570
    R, Q = rotation_matrices(ours[both]), rotation_matrices(theirs[both])
    apart = (R @ R[0].T) @ (Q @ Q[0].T).transpose(0, 2, 1)
    angle = np.rad2deg(np.arccos(np.clip((np.trace(apart, axis1=1, axis2=2) - 1) / 2, -1, 1)))
    assert angle.max() < 0.1


def test_one_file_per_bone_is_the_published_handover():
    published = read_recording(FOLDER / "converted" / "handover_giver.csv")
    files = {name: FOLDER / "kth_handover" / f"giver_{bone}_pose_saved.csv" for name, bone in BONES.items()}
    joined = read_recordings(files, rate=120.0)
    for name in BONES:
        np.testing.assert_allclose(joined.points[name], published.points[name], atol=1e-6)
    np.testing.assert_allclose(joined.orientations["hand"], published.orientations["hand"], atol=1e-6)
    np.testing.assert_allclose(joined.time, published.time, atol=1e-4)
    motive = read_recording(FOLDER / "motive_layout" / "motive125_bones_from_kth_giver.csv")
    np.testing.assert_allclose(motive.points["giver:RUArm"], joined.points["shoulder"], atol=1e-5)


def test_walking_without_an_arm_lists_the_names():
    with pytest.raises(TaskError, match="no arm is known by the names of the points; its points are RTH1, RFHD"):
        resolve(read_recording(FOLDER / "opensim" / "std_walking2_markers.trc"), None, (), None)


@pytest.mark.slow
@pytest.mark.parametrize("file", [*SEGMENTS, "opensim/std_walking2_markers.trc", "converted/box_lift.csv"])
def test_every_file_can_be_drawn(file):
    assert draw_recording(read_recording(FOLDER / file)).startswith(b"\x89PNG")


@pytest.fixture(params=["box_lift.csv", "handover_giver.csv"])
def recording(request):
    return read_recording(FOLDER / "converted" / request.param)


@pytest.mark.parametrize("orientation", [None, "hand"])
@pytest.mark.parametrize("mode", ["shoulder", "fixed"])
def test_every_frame_becomes_part_of_the_task(recording, tmp_path, orientation, mode):
    task = task_of(recording, orientation=orientation, base_mode=mode)
    np.testing.assert_array_equal(task.time, recording.time)
    assert task.P.shape == (recording.frames, 3, 3)
    assert any("moves up to" in note for note in task.notes)
    assert orientation is None or np.linalg.det(task.R) == pytest.approx(np.ones(recording.frames))
    write_plain_csv(tmp_path / "task.csv", task_recording(task))
    again = task_from_recording(read_recording(tmp_path / "task.csv"))
    assert again.P.tobytes() == task.P.tobytes()
    assert orientation is None or again.R.tobytes() == task.R.tobytes()


def test_gaps_of_the_box_lift_are_bridged_smoothly():
    recording = read_recording(FOLDER / "converted" / "box_lift.csv")
    task = task_of(recording, orientation="hand")
    assert any("Filled 11 gaps" in note and "0.15 s, point 'wrist'" in note for note in task.notes)
    steps = np.linalg.norm(np.diff(task.P, axis=0), axis=2)
    assert steps[:, 1:].max() < 0.05  # 5 m/s at 100 Hz


def test_cleaning_stays_near_the_recording(recording):
    plain = task_of(recording, orientation="hand")
    smooth = task_of(recording, orientation="hand", low_pass=6.0)
    assert np.linalg.norm(smooth.P - plain.P, axis=2).mean() < 0.005
    half = task_of(recording, rate=50.0)
    assert half.dt == pytest.approx(0.02)
    assert np.linalg.norm(half.P[0] - plain.P[0]) == pytest.approx(0.0, abs=1e-12)
