import numpy as np
import pytest

from armdesign.demonstration import About, Recording
from armdesign.demonstration.cleaning.outliers import FLOOR, find_outliers, take_out_outliers
from armdesign.demonstration.files.quaternions import rotation_matrices

RATES = (50.0, 100.0, 200.0)


def motion(time, hertz=0.7, size=0.25):
    """A hand that moves to and fro on each axis."""
    phases = np.array([0.0, 1.0, 2.0])
    return size * np.sin(2 * np.pi * hertz * time[:, None] * [1.0, 1.3, 0.6] + phases)


def clock(rate, seconds=10.0):
    return np.arange(round(rate * seconds)) / rate


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("hertz", [0.0, 0.2, 1.0, 3.0])
def test_smooth_motion_is_untouched_to_the_bit(rate, hertz):
    time = clock(rate)
    given = Recording(time, {"hand": motion(time, hertz)}, source="r.c3d", about=About(captured=True))
    result, steps = take_out_outliers(given)
    assert steps == ()
    assert result.points["hand"].tobytes() == given.points["hand"].tobytes()


@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("first", [0, 1, 100, 217, -3, -1])
def test_a_spike_is_found_wherever_it_is(rate, first):
    time = clock(rate)
    hand = motion(time, 0.3)
    hand[first] += [0.0, 0.06, -0.05]
    found = np.flatnonzero(find_outliers(time, hand))
    assert found.tolist() == [first % len(time)]


@pytest.mark.parametrize("length", [2, 3, 4])
def test_several_bad_frames_in_a_row_are_found(length):
    time = clock(100.0)
    hand = motion(time, 0.3)
    hand[300 : 300 + length] += [0.1, 0.0, 0.1]
    assert np.flatnonzero(find_outliers(time, hand)).tolist() == list(range(300, 300 + length))


def test_outliers_become_gaps_and_all_else_stays():
    time = clock(100.0)
    hand, elbow = motion(time, 0.3), motion(time, 0.2)
    hand[[300, 700]] += 0.3
    turn = np.tile([0.0, 0.0, 0.0, 1.0], (len(time), 1))
    given = Recording(time, {"elbow": elbow, "hand": hand}, {"hand": turn}, "r.c3d")
    result, (step,) = take_out_outliers(given)
    assert np.flatnonzero(np.isnan(result.points["hand"][:, 0])).tolist() == [300, 700]
    kept = np.delete(np.arange(len(time)), [300, 700])
    assert result.points["hand"][kept].tobytes() == hand[kept].tobytes()
    assert result.points["elbow"].tobytes() == elbow.tobytes()
    assert result.orientations["hand"].tobytes() == turn.tobytes()
    assert step.sentence == "Took out 2 outliers (2 of 'hand'), the first of 'hand' at 3 s."
    assert step.details["times"] == {"hand": [3.0, 7.0]}


def test_what_is_found_does_not_hang_on_the_axes():
    time = clock(100.0)
    rng = np.random.default_rng(0)
    hand = motion(time, 0.5) + rng.normal(size=(1000, 3)) * 0.003
    hand[rng.choice(1000, 40, replace=False)] += rng.normal(size=(40, 3)) * 0.05
    R = rotation_matrices(np.array([[0.3, -0.2, 0.5, 0.7]]))[0]
    here, there = find_outliers(time, hand), find_outliers(time + 5.0, hand @ R.T + [1.0, -2.0, 3.0])
    assert here.sum() > 20
    np.testing.assert_array_equal(here, there)


def test_what_is_found_is_the_same_backwards():
    time = clock(100.0)
    hand = motion(time, 0.5) + np.random.default_rng(1).normal(size=(1000, 3)) * 0.004
    hand[::97] += 0.08
    np.testing.assert_array_equal(find_outliers(time, hand)[::-1], find_outliers(-time[::-1], hand[::-1]))


def test_small_steps_of_a_still_hand_stay():
    """Noise-free data stands still to the bit, so that any movement would be an outlier without the floor."""
    time = clock(100.0)
    hand = np.zeros((1000, 3))
    hand[400:403, 0] = 0.99 * FLOOR
    assert not find_outliers(time, hand).any()
    hand[400:403, 0] = 1.01 * FLOOR
    assert find_outliers(time, hand).sum() == 3


@pytest.mark.parametrize("rate", RATES)
def test_noise_is_not_an_outlier(rate):
    time = clock(rate, 20.0)
    noisy = motion(time, 0.5) + np.random.default_rng(2).normal(size=(len(time), 3)) * 0.005
    assert find_outliers(time, noisy).mean() < 1e-3


def test_uniform_motion_with_lost_frames_has_no_outliers():
    time = np.delete(clock(100.0), [100, 101, 102, 103, 300, 500, 501, 990])
    hand = np.outer(time, [2.0, -1.0, 0.5])
    hand[200:215] = np.nan
    assert not find_outliers(time, hand).any()


@pytest.mark.parametrize("seen", [0, 1, 3, 6])
def test_next_to_nothing_seen_is_left_alone(seen):
    time = clock(100.0)
    hand = np.full((1000, 3), np.nan)
    hand[:seen] = np.arange(seen)[:, None] ** 3
    assert not find_outliers(time, hand).any()


def test_stale_frames_are_no_witnesses():
    """Every other frame repeats the one before; the hand moves on in between."""
    time = clock(100.0)
    hand = np.repeat(motion(time, 1.0, 1.0)[::2], 2, axis=0)
    stale = np.arange(1000) % 2 == 1
    given = Recording(time, {"hand": hand})
    assert take_out_outliers(given, stale)[1] == ()
