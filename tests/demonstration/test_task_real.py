"""Real motion capture, where it is at hand: a box lifted with gaps at wrist and hand, and a handover."""

from pathlib import Path

import numpy as np
import pytest
from tasks import task_of

from armdesign.demonstration import read_recording, task_from_recording, task_recording, write_plain_csv

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "recordings" / "converted"
FILES = ("box_lift.csv", "handover_giver.csv")
ARMS = {"box_lift.csv": (0.308, 0.261), "handover_giver.csv": (0.252, 0.235)}  # upper arm, forearm [m], published

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the shared recordings are not at hand")


@pytest.fixture(params=FILES)
def recording(request):
    return read_recording(FOLDER / request.param)


def test_the_arm_has_its_published_size(recording):
    task = task_of(recording, base="shoulder", points=["elbow", "wrist", "hand"])
    links = np.linalg.norm(np.diff(task.P, axis=1, prepend=0.0), axis=2).mean(axis=0)
    np.testing.assert_allclose(links[:2], ARMS[Path(recording.source).name], atol=0.003)


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
    recording = read_recording(FOLDER / "box_lift.csv")
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
