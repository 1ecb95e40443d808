import numpy as np
import pytest

from armdesign.demonstration import Recording
from armdesign.demonstration.cleaning.cleaning import (
    clean,
    crop,
    filter_low_pass,
    resample,
    scale_positions,
    unify_quaternions,
)
from armdesign.errors import RecordingError, SettingsError
from armdesign.settings.sections import Task as TaskSettings

TIME = np.arange(401) / 100 + 2.0
LINE = np.outer(TIME, [1.0, -2.0, 0.5])


def turning(time):
    """Constant speed about y."""
    return np.stack([0 * time, np.sin(time), 0 * time, np.cos(time)], axis=1)


def recording(hand=LINE, turn=None, time=TIME):
    return Recording(time, {"hand": hand}, {"hand": turning(time) if turn is None else turn}, "r.csv")


def sentences(steps):
    return tuple(step.sentence for step in steps)


def waves(time, *hertz):
    return np.stack([np.sin(2 * np.pi * f * time) for f in hertz], axis=1)


def test_unify_mentions_norms_and_keeps_positions():
    result, steps = unify_quaternions(recording(turn=2.0 * turning(TIME)))
    np.testing.assert_allclose(result.orientations["hand"], turning(TIME), atol=1e-15)
    np.testing.assert_array_equal(result.points["hand"], LINE)
    assert sentences(steps) == ("Normalised the quaternions of 'hand', whose norms were 2 to 2 instead of 1.",)
    assert unify_quaternions(recording())[1] == ()


@pytest.mark.parametrize("size", [0.0, 1e-9])
def test_zero_quaternion_names_point_and_time(size):
    turn = turning(TIME)
    turn[7] *= size
    with pytest.raises(RecordingError, match=r"r.csv: the quaternion of 'hand' is zero at frame 8, 2.07 s"):
        unify_quaternions(recording(turn=turn))


def test_unify_takes_an_orientation_never_seen():
    assert unify_quaternions(recording(turn=np.full((401, 4), np.nan)))[1] == ()


def test_low_pass_keeps_uniform_motion():
    result, steps = filter_low_pass(recording(), 6.0)
    np.testing.assert_allclose(result.points["hand"], LINE, atol=1e-9)
    assert sentences(steps) == ("Smoothed by a zero-phase Butterworth low-pass at 6 Hz.",)


def test_low_pass_follows_its_formula_without_phase():
    time = np.arange(4001) / 100
    cutoff, hertz = 6.0, np.array([1.0, 6.0, 15.0])
    given = Recording(time, {"hand": waves(time, *hertz)})
    found = filter_low_pass(given, cutoff)[0].points["hand"][1000:3000]
    warped = np.tan(np.pi * hertz / 100) / np.tan(np.pi * cutoff / 100)
    gain = 1.0 / (1.0 + (np.sqrt(2.0) - 1.0) * warped**4)
    assert gain[1] == pytest.approx(1 / np.sqrt(2))
    np.testing.assert_allclose(found, gain * given.points["hand"][1000:3000], atol=1e-9)


def test_low_pass_is_the_same_backwards():
    hand = np.random.default_rng(0).normal(size=(401, 3))
    forwards = filter_low_pass(recording(hand), 6.0)[0].points["hand"]
    backwards = filter_low_pass(recording(hand[::-1]), 6.0)[0].points["hand"][::-1]
    np.testing.assert_allclose(forwards[100:-100], backwards[100:-100], atol=1e-9)


def test_low_pass_of_quaternions_calms_them_and_stays_unit():
    noise = np.random.default_rng(1).normal(size=(401, 4)) * 0.02
    noisy, _ = unify_quaternions(recording(turn=turning(TIME) + noise))
    result = filter_low_pass(noisy, 3.0)[0].orientations["hand"]
    np.testing.assert_allclose(np.linalg.norm(result, axis=1), 1.0, atol=1e-14)
    error = np.linalg.norm(result - turning(TIME), axis=1).mean()
    assert error < 0.5 * np.linalg.norm(noisy.orientations["hand"] - turning(TIME), axis=1).mean()


def test_low_pass_sees_dropped_frames_as_time():
    even = np.arange(2001) / 100
    lost = [500, 501, 900, 1300]
    time = np.delete(even, lost)
    result, _ = filter_low_pass(recording(waves(time, 0.5, 1.0, 20.0), time=time), 6.0)
    whole, _ = filter_low_pass(recording(waves(even, 0.5, 1.0, 20.0), time=even), 6.0)
    wanted = np.delete(whole.points["hand"], lost, axis=0)
    np.testing.assert_array_equal(result.time, time)
    np.testing.assert_allclose(result.points["hand"][:, :2], wanted[:, :2], atol=1e-2)
    far = np.abs(time[:, None] - even[lost]).min(axis=1) > 1.0
    np.testing.assert_allclose(result.points["hand"][far], wanted[far], atol=1e-6)


def test_the_slowest_low_pass_still_keeps_uniform_motion():
    result, _ = filter_low_pass(recording(), 0.01)
    np.testing.assert_allclose(result.points["hand"], LINE, atol=1e-5)


def test_low_pass_takes_very_short_recordings():
    given = recording(LINE[:3], time=TIME[:3])
    np.testing.assert_allclose(filter_low_pass(given, 6.0)[0].points["hand"], LINE[:3], atol=1e-9)


@pytest.mark.parametrize("rate", [25.0, 60.0, 100.0, 333.0])
def test_resampled_uniform_motion_is_uniform(rate):
    result, _ = resample(recording(), rate)
    assert result.time[0] == TIME[0]
    assert TIME[-1] - 1 / rate < result.time[-1] <= TIME[-1]
    np.testing.assert_allclose(np.diff(result.time), 1 / rate, atol=1e-12)
    np.testing.assert_allclose(result.points["hand"], np.outer(result.time, [1.0, -2.0, 0.5]), atol=1e-12)
    np.testing.assert_allclose(result.orientations["hand"], turning(result.time), atol=1e-12)


def test_resampling_at_the_same_rate_changes_nothing():
    hand = np.random.default_rng(2).normal(size=(401, 3))
    result, steps = resample(recording(hand), 100.0)
    np.testing.assert_allclose(result.points["hand"], hand, atol=1e-9)
    assert sentences(steps) == ("Resampled to 100 frames/s: 401 frames.",)


def test_resampling_error_falls_with_the_step():
    def error(rate):
        time = np.arange(0.0, 4.0, 1 / rate)
        given = recording(waves(time, 0.5, 0.7, 1.0), time=time)
        result, _ = resample(given, 1000.0)
        return np.abs(result.points["hand"] - waves(result.time, 0.5, 0.7, 1.0)).max()

    assert error(100.0) < 1e-3
    assert error(200.0) < error(100.0) / 3


def test_scale_touches_positions_only():
    result, steps = scale_positions(recording(), 0.25)
    np.testing.assert_array_equal(result.points["hand"], LINE * 0.25)
    np.testing.assert_array_equal(result.orientations["hand"], turning(TIME))
    assert sentences(steps) == ("Scaled all positions by 0.25.",)


def test_crop_keeps_both_ends_and_the_times():
    result, steps = crop(recording(), 2.5, 3.0)
    np.testing.assert_array_equal(result.time, TIME[50:101])
    np.testing.assert_array_equal(result.points["hand"], LINE[50:101])
    np.testing.assert_array_equal(result.orientations["hand"], turning(TIME)[50:101])
    assert sentences(steps) == ("Cropped to 2.5 s to 3 s.",)


def test_crop_to_everything_is_silent():
    assert crop(recording(), 0.0, 100.0)[1] == ()
    assert crop(recording())[1] == ()


@pytest.mark.parametrize(("start", "stop"), [(3.0, 2.5), (7.0, None), (None, 2.01), (3.0, 3.01), (np.nan, None)])
def test_senseless_crop(start, stop):
    with pytest.raises(SettingsError, match=r"frames, a motion takes at least three; allowed: times from 2 s to 6 s"):
        crop(recording(), start, stop)


SENSELESS = {
    "low_pass": (
        filter_low_pass,
        [0.0, -1.0, 1e-6, 50.1, np.nan],
        "Hz at 100 frames/s; allowed: 0.01 Hz up to, .* 50 Hz",
    ),
    "rate": (resample, [0.0, -5.0, 0.4, 1e9, np.nan], "frames/s; allowed: 0.5 to 10000 frames/s"),
    "scale": (scale_positions, [0.0, -1.0, np.nan, np.inf], "; allowed: a number above 0"),
}


@pytest.mark.parametrize("name", SENSELESS)
def test_senseless_numbers_are_refused_with_the_range(name):
    function, values, allowed = SENSELESS[name]
    for value in values:
        with pytest.raises(SettingsError, match=rf"{name} is .*{allowed}"):
            function(recording(), value)


def test_cleaning_in_the_order_told():
    given = recording(np.random.default_rng(4).normal(size=(401, 3)))
    by_hand, steps = given, ()
    for step in (
        unify_quaternions,
        lambda r: filter_low_pass(r, 5.0),
        lambda r: crop(r, 3.0, 4.0),
        lambda r: resample(r, 50.0),
        lambda r: scale_positions(r, 2.0),
    ):
        by_hand, more = step(by_hand)
        steps += more
    result, said = clean(given, TaskSettings(low_pass=5.0, rate=50.0, scale=2.0, start=3.0, stop=4.0))
    assert sentences(said) == sentences(steps)
    assert result.points["hand"].tobytes() == by_hand.points["hand"].tobytes()
    assert result.orientations["hand"].tobytes() == by_hand.orientations["hand"].tobytes()


def test_cleaning_asked_for_nothing_does_nothing():
    result, steps = clean(recording())
    assert steps == ()
    assert result.points["hand"].tobytes() == LINE.tobytes()


def test_a_senseless_part_is_refused_before_its_gaps():
    hand = LINE.copy()
    hand[100:300] = np.nan
    with pytest.raises(SettingsError, match=r"start \(--from\) is 9"):
        clean(recording(hand), TaskSettings(start=9.0))
