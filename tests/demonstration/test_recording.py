import numpy as np
import pytest

from armdesign.demonstration import Recording
from armdesign.errors import RecordingError

TIME = np.arange(5) / 100


def path(frames=5):
    return np.arange(3.0 * frames).reshape(frames, 3)


def test_arrays_are_read_only_copies():
    values = path()
    recording = Recording(TIME, {"hand": values})
    values[0] = 9.0
    assert recording.points["hand"][0, 0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        recording.points["hand"][0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        recording.time[0] = 1.0


def test_rate_is_the_median_and_ignores_a_hole():
    recording = Recording([0.0, 0.01, 0.02, 0.03, 5.0], {"hand": path()})
    assert recording.rate == pytest.approx(100.0)
    assert recording.frames == 5


def test_partly_missing_means_missing():
    values = path()
    values[2, 1] = np.nan
    assert np.isnan(Recording(TIME, {"hand": values}).points["hand"][2]).all()


@pytest.mark.parametrize(("frames", "words"), [(0, "no frame"), (1, "one frame"), (2, "two frames")])
def test_three_frames_are_needed(frames, words):
    with pytest.raises(RecordingError, match=f"recording has {words}, but a motion takes at least three"):
        Recording(TIME[:frames], {"hand": path(frames)})


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (0.01, "the time does not increase, 0.01 s comes after 0.01 s"),
        (0.005, "the time does not increase, 0.005 s comes after 0.01 s"),
        (np.nan, "the time is missing"),
        (np.inf, "the time is infinite"),
    ],
)
def test_time_has_to_increase(bad, words):
    time = TIME.copy()
    time[2] = bad
    with pytest.raises(RecordingError, match=f"recording, frame 3: {words}"):
        Recording(time, {"hand": path()})


def test_first_time_has_to_be_a_number():
    with pytest.raises(RecordingError, match="frame 1: the time is missing"):
        Recording([np.nan, 0.1, 0.2], {"hand": path(3)})


@pytest.mark.parametrize("values", [np.zeros((5, 4)), np.zeros((4, 3)), np.zeros(5)])
def test_wrong_shape(values):
    with pytest.raises(RecordingError, match=r"point 'hand' has values of shape .*allowed: \(5, 3\)"):
        Recording(TIME, {"hand": values})
    with pytest.raises(RecordingError, match=r"allowed: \(5, 4\)"):
        Recording(TIME, {}, {"hand": path()})


def test_times_in_a_table_are_refused():
    with pytest.raises(RecordingError, match=r"the times have shape \(5, 1\)"):
        Recording(TIME[:, None], {"hand": path()})


def test_infinite_value_names_point_and_frame():
    values = path()
    values[3, 2] = np.inf
    with pytest.raises(RecordingError, match="point 'hand' is infinite in frame 4"):
        Recording(TIME, {"hand": values})


@pytest.mark.parametrize("name", ["", " hand", "ha\nnd", "ha\0nd"])
def test_unusable_names(name):
    with pytest.raises(RecordingError, match="cannot be the name of a point"):
        Recording(TIME, {name: path()})
