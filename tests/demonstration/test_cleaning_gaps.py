import numpy as np
import pytest

from armdesign.demonstration import Recording
from armdesign.demonstration.cleaning.cleaning import fill_gaps
from armdesign.demonstration.cleaning.gaps import seconds
from armdesign.errors import RecordingError, SettingsError

TIME = np.arange(101) / 100
LINE = np.outer(TIME, [1.0, -2.0, 0.5]) + np.array([0.1, 0.2, 0.3])
TURN = np.stack([0 * TIME, np.sin(TIME), 0 * TIME, np.cos(TIME)], axis=1)  # constant speed about y


def holed(values, *spans):
    result = values.copy()
    for first, stop in spans:
        result[first:stop] = np.nan
    return result


def recording(hand=LINE, turn=TURN, time=TIME):
    return Recording(time, {"hand": hand}, {"hand": turn}, "r.csv")


def test_without_gaps_nothing_changes():
    result, steps = fill_gaps(recording())
    assert steps == ()
    assert result.points["hand"].tobytes() == LINE.tobytes()
    assert result.orientations["hand"].tobytes() == TURN.tobytes()


def test_uniform_motion_is_restored_exactly():
    given = recording(holed(LINE, (10, 29), (40, 41), (42, 50)), holed(TURN, (60, 79)))
    result, steps = fill_gaps(given)
    notes = tuple(step.sentence for step in steps)
    np.testing.assert_allclose(result.points["hand"], LINE, atol=1e-15)
    np.testing.assert_allclose(result.orientations["hand"], TURN, atol=1e-15)
    assert notes == (
        "Filled 4 gaps by interpolation (3 of point 'hand', 1 of the orientation of 'hand'); "
        "the longest: 0.2 s, point 'hand' from 0.09 s to 0.29 s.",
    )


def test_seen_frames_keep_their_bits_and_input_is_untouched():
    hand = np.sin(np.outer(TIME, [3.0, 5.0, 7.0]))
    given = recording(holed(hand, (20, 30)))
    result, _ = fill_gaps(given)
    seen = ~np.isnan(given.points["hand"][:, 0])
    assert seen.sum() == 91
    assert result.points["hand"][seen].tobytes() == hand[seen].tobytes()


def test_filled_positions_do_not_overshoot():
    hand = np.random.default_rng(0).normal(size=(101, 3))
    result, _ = fill_gaps(recording(holed(hand, (20, 30), (31, 33))))
    for first, stop in ((19, 30), (30, 33)):
        low, high = np.minimum(hand[first], hand[stop]), np.maximum(hand[first], hand[stop])
        filled = result.points["hand"][first + 1 : stop]
        assert ((low - 1e-15 <= filled) & (filled <= high + 1e-15)).all()


def test_filling_turns_and_moves_with_the_scene():
    """PCHIP works on each axis by itself, so mirroring, scaling and swapping axes commute with filling."""
    hand = np.random.default_rng(1).normal(size=(101, 3))
    swap = np.array([[0, -2.0, 0], [0, 0, 2.0], [2.0, 0, 0]])
    one, _ = fill_gaps(recording(holed(hand, (50, 60))))
    other, _ = fill_gaps(recording(holed(hand @ swap.T + 3.0, (50, 60))))
    np.testing.assert_allclose(other.points["hand"], one.points["hand"] @ swap.T + 3.0, atol=1e-12)


@pytest.mark.parametrize(("last", "fits"), [(29, True), (30, False)])
def test_the_longest_gap_allowed(last, fits):
    given = recording(holed(LINE, (10, last)))
    if fits:
        fill_gaps(given, 0.2)
    else:
        with pytest.raises(RecordingError, match=r"'hand' is not seen from 0.09 s to 0.3 s, longer than the 0.2 s"):
            fill_gaps(given, 0.2)
        fill_gaps(given, 0.21)


def test_a_long_gap_says_what_to_do():
    with pytest.raises(RecordingError, match=r"orientation of 'hand'.*--to 0.19 or less, or --from 0.6 or more") as e:
        fill_gaps(recording(turn=holed(TURN, (20, 60))))
    assert e.value.value == pytest.approx(0.41)


def test_max_gap_zero_fills_nothing():
    with pytest.raises(RecordingError, match=r"is not seen from 0.09 s to 0.11 s"):
        fill_gaps(recording(holed(LINE, (10, 11))), 0.0)


def test_short_gaps_at_the_ends_are_cut_off():
    result, steps = fill_gaps(recording(holed(LINE, (0, 5), (90, 101)), holed(TURN, (0, 3), (3, 8))))
    notes = tuple(step.sentence for step in steps)
    assert (result.time[0], result.time[-1]) == (0.08, 0.89)
    np.testing.assert_array_equal(result.points["hand"], LINE[8:90])
    assert notes == (
        "Left out the frames before 0.08 s, because the orientation of 'hand' is not seen from 0 s to 0.08 s.",
        "Left out the frames after 0.89 s, because point 'hand' is not seen from 0.89 s to 1 s.",
    )


def test_long_gaps_at_the_ends_are_refused():
    with pytest.raises(RecordingError, match=r"from 0 s to 0.3 s.*Crop the recording \(--from 0.3 or more\)"):
        fill_gaps(recording(holed(LINE, (0, 30))))
    with pytest.raises(RecordingError, match=r"from 0.69 s to 1 s.*Crop the recording \(--to 0.69 or less\)"):
        fill_gaps(recording(holed(LINE, (70, 101))))


def test_long_gaps_outside_the_wanted_part_do_no_harm():
    given = recording(holed(LINE, (0, 30), (31, 33), (40, 42), (70, 101)))
    result, steps = fill_gaps(given, start=0.3, stop=0.69)
    np.testing.assert_array_equal(result.time, TIME[30:70])
    np.testing.assert_allclose(result.points["hand"], LINE[30:70], atol=1e-15)
    assert steps[0].sentence.startswith("Filled 2 gaps")
    with pytest.raises(RecordingError, match=r"--from 0.3 or more"):
        fill_gaps(given, start=0.29, stop=0.69)
    with pytest.raises(RecordingError, match=r"--to 0.69 or less"):
        fill_gaps(given, start=0.3, stop=0.7)


def test_the_advice_in_the_message_works():
    given = recording(holed(LINE, (20, 60)), time=TIME * 1.0333333)
    with pytest.raises(RecordingError) as e:
        fill_gaps(given)
    words = str(e.value).split("--from ")[1].split(" or more")[0]
    result, _ = fill_gaps(given, start=float(words))
    assert result.frames == 41


def test_a_hole_in_time_is_a_gap_of_every_point():
    time = np.r_[TIME[:50], TIME[50:] + 35.0]
    given = recording(time=time)
    with pytest.raises(RecordingError, match=r"no frame was recorded from 0.49 s to 35.5 s"):
        fill_gaps(given)
    assert fill_gaps(given, stop=0.49)[0].frames == 50
    assert fill_gaps(given, start=35.5)[0].frames == 51


def test_slow_recordings_have_no_holes():
    assert fill_gaps(recording(time=TIME * 50))[1] == ()


def test_too_little_left():
    with pytest.raises(RecordingError, match="fewer than three frames are left"):
        fill_gaps(recording(holed(LINE, (0, 50)), holed(TURN, (51, 101))), 1.0)


@pytest.mark.parametrize("max_gap", [-0.1, np.nan, np.inf])
def test_senseless_max_gap(max_gap):
    with pytest.raises(SettingsError, match=r"max_gap is .*allowed: 0 s or more"):
        fill_gaps(recording(), max_gap)


@pytest.mark.parametrize(
    ("time", "words"),
    [(0.0, "0 s"), (1.0, "1 s"), (0.00831, "0.0083 s"), (722.1, "722.1 s"), (86400.0, "86400 s"), (1e-9, "0 s")],
)
def test_times_in_words(time, words):
    assert seconds(time) == words
