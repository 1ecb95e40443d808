import numpy as np
import pytest

from armdesign.demonstration import Recording
from armdesign.demonstration.cleaning.cleaning import clean, cut_out, moved_up
from armdesign.errors import RecordingError, SettingsError
from armdesign.settings.sections import Task as TaskSettings

TIME = np.arange(601) / 100 + 1.0


def resting(drift=0.0):
    """A hand that moves, rests from 2 to 5 s (drifting by that much), and moves on."""
    way = np.clip(TIME - 2.0, None, 0.0) + np.clip(TIME - 5.0, 0.0, None)
    rest = np.clip((TIME - 2.0) / 3.0, 0.0, 1.0) * drift
    return np.outer(way, [0.3, 0.1, 0.0]) + np.outer(rest, [0.0, 0.0, 1.0]) + 0.5


def recording(hand=None, **more):
    points = {"shoulder": np.zeros((601, 3)), "hand": resting() if hand is None else hand}
    turn = np.tile([0.0, 0.0, 0.0, 1.0], (601, 1))
    return Recording(TIME, points, {"hand": more.get("turn", turn)}, "r.csv")


def test_a_stretch_is_taken_out_and_later_times_move_up():
    hand = resting()
    hand[200:300] = np.nan  # 3 to 4 s: gaps in it do not matter
    result, (step,) = cut_out(recording(hand), [(2.5, 4.5)])
    assert result.frames == 601 - 199
    np.testing.assert_allclose(np.diff(result.time), 0.01, atol=1e-12)
    np.testing.assert_array_equal(result.points["hand"][:151], hand[:151])
    np.testing.assert_array_equal(result.points["hand"][151:], hand[350:])
    assert step.sentence == (
        "Cut out 199 frames between 2.5 s and 4.5 s, over which no point moves more than 0 mm; later times move up by "
        "1.99 s."
    )


def test_the_chain_cuts_before_anything_else():
    hand = resting()
    hand[200:300] = np.nan
    turn = np.tile([0.0, 0.0, 0.0, 1.0], (601, 1))
    turn[250] = 0.0  # would be refused
    result, steps = clean(recording(hand, turn=turn), TaskSettings(cut=((2.5, 4.5),)))
    assert [step.name for step in steps] == ["cut"]
    assert np.isfinite(result.points["hand"]).all()


def test_crop_times_are_those_of_the_recording():
    result, _ = clean(recording(), TaskSettings(cut=((2.5, 4.5),), start=1.5, stop=6.0))
    assert result.time[0] == pytest.approx(1.5)
    assert result.time[-1] == pytest.approx(6.0 - 1.99)
    np.testing.assert_array_equal(result.points["hand"][-1], resting()[500])


def test_two_stretches_are_taken_out_in_any_order():
    one, _ = cut_out(recording(), [(2.5, 3.0), (4.0, 4.5)])
    other, steps = cut_out(recording(), [(4.0, 4.5), (2.5, 3.0)])
    assert one.time.tobytes() == other.time.tobytes()
    assert [step.details["from"] for step in steps] == [2.5, 4.0]
    np.testing.assert_allclose(np.diff(one.time), 0.01, atol=1e-12)
    given = recording()
    assert moved_up(given, [(2.5, 3.0), (4.0, 4.5)], 3.5) == pytest.approx(3.5 - 0.49)
    assert moved_up(given, [(2.5, 3.0), (4.0, 4.5)], 6.0) == pytest.approx(6.0 - 0.98)
    assert moved_up(given, [(2.5, 3.0)], 2.7) == pytest.approx(2.5)
    assert moved_up(given, [(2.5, 3.0)], 2.0) == 2.0
    assert moved_up(given, [(2.5, 3.0)], None) is None


def test_an_arm_that_moves_meanwhile_is_refused_with_the_distance():
    with pytest.raises(RecordingError, match=r"from 2.5 s to 4.5 s .* 'hand' moves by 20 mm; allowed: at most 5 mm"):
        cut_out(recording(resting(0.03)), [(2.5, 4.5)])
    cut_out(recording(resting(0.006)), [(2.5, 4.5)])
    points = {"elbow": resting(0.06), "hand": resting()}
    with pytest.raises(RecordingError, match="'elbow' moves by 40 mm"):
        cut_out(Recording(TIME, points), [(2.5, 4.5)])


def test_a_hand_that_turns_meanwhile_is_refused():
    angle = np.clip(TIME - 2.0, 0.0, 3.0) * 0.1
    turn = np.stack([np.sin(angle / 2), 0 * angle, 0 * angle, np.cos(angle / 2)], axis=1)
    with pytest.raises(RecordingError, match=r"'hand' turns by 11 deg; allowed: at most 3 deg"):
        cut_out(recording(turn=turn), [(2.5, 4.5)])


def test_a_hand_that_passes_the_same_place_twice_does_not_stand_still():
    circle = 0.2 * np.stack([np.cos(np.pi * TIME), np.sin(np.pi * TIME), 0 * TIME], axis=1)
    with pytest.raises(RecordingError, match=r"'hand' still moves before it, by 63 mm in 0.1 s"):
        cut_out(recording(circle), [(2.0, 4.0)])


@pytest.mark.parametrize(
    ("stretches", "message"),
    [
        ([(0.5, 3.0)], r"cut 0.5:3 reaches an end of the recording.*--from and --to"),
        ([(3.0, 9.0)], r"cut 3:9 reaches an end of the recording"),
        ([(3.0, 3.005)], "cut 3:3.005 holds no frame"),
        ([(2.5, 3.5), (3.0, 4.0)], "cut 3:4 overlaps another cut"),
    ],
)
def test_senseless_stretches(stretches, message):
    with pytest.raises(SettingsError, match=message):
        cut_out(recording(), stretches)


def test_no_stretch_changes_nothing():
    given = recording()
    assert cut_out(given, ()) == (given, ())
