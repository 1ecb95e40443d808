import numpy as np
import pytest

from armdesign.demonstration import About, Recording
from armdesign.demonstration.cleaning.cleaning import clean
from armdesign.demonstration.cleaning.gaps import find_repeats, refill_repeats, stale_frames
from armdesign.settings.sections import Task as TaskSettings

TIME = np.arange(201) / 100
LINE = np.outer(TIME, [1.0, -2.0, 0.5]) + 0.3
TURN = np.stack([0 * TIME, np.sin(TIME), 0 * TIME, np.cos(TIME)], axis=1)


def repeated(values, *stretches):
    result = values.copy()
    for first, stop in stretches:
        result[first:stop] = values[first - 1]
    return result


def recording(*stretches, captured=True, time=TIME):
    hand, turn = repeated(LINE, *stretches), repeated(TURN, *stretches)
    points = {"elbow": 0.5 * hand, "hand": hand}
    return Recording(time, points, {"hand": turn}, "r.c3d", About(captured=captured))


def test_repetitions_in_uniform_motion_are_undone():
    result, (step,) = refill_repeats(recording((10, 11), (50, 55), (100, 101)))
    np.testing.assert_allclose(result.points["hand"], LINE, atol=1e-14)
    np.testing.assert_allclose(result.orientations["hand"], TURN, atol=1e-14)
    assert step.sentence == (
        "Interpolated 7 frames that repeat the one before, as not recorded; the longest stretch: 0.06 s from 0.49 s "
        "to 0.55 s."
    )


def test_other_frames_keep_their_bits():
    given = recording((10, 11), (50, 55))
    result, _ = refill_repeats(given)
    kept = np.delete(np.arange(201), [10, *range(50, 55)])
    assert result.points["hand"][kept].tobytes() == given.points["hand"][kept].tobytes()


@pytest.mark.parametrize(("last", "short"), [(29, True), (30, False)])
def test_long_stretches_stand_still(last, short):
    result, (step,) = refill_repeats(recording((10, last)), 0.2)
    assert (result.points["hand"][15] != LINE[9]).any() == short
    assert step.sentence.startswith("Interpolated 19 frames" if short else "Left 1 stretch of repeated frames as")


def test_repetitions_up_to_the_end_stay():
    given = recording((196, 201))
    result, (step,) = refill_repeats(given)
    assert result.points["hand"].tobytes() == given.points["hand"].tobytes()
    assert "as standing still, the longest from 1.95 s to 2 s" in step.sentence


def test_one_point_that_stands_still_is_no_repetition():
    hand = repeated(LINE, (10, 11))
    given = Recording(TIME, {"elbow": 0.5 * LINE, "hand": hand})
    assert find_repeats(given) == []
    assert refill_repeats(given)[1] == ()


def test_what_is_missing_in_both_frames_counts_as_equal():
    given = recording((10, 11))
    hand = given.points["hand"].copy()
    hand[8:14] = np.nan
    both = Recording(TIME, {"elbow": given.points["elbow"], "hand": hand})
    assert [(gap.first, gap.stop) for gap in find_repeats(both)] == [(10, 11)]
    none = Recording(TIME, {"elbow": hand, "hand": hand})
    assert find_repeats(none) == []


def test_the_chain_undoes_repetitions_beside_gaps_and_cut_ends():
    given = recording((4, 5), (50, 52), (150, 151))
    hand = given.points["hand"].copy()
    hand[:3] = np.nan  # cut off
    hand[49:58] = np.nan  # around a repetition
    both = Recording(TIME, {**given.points, "hand": hand}, given.orientations, "r.c3d", About(captured=True))
    result, steps = clean(both, TaskSettings(low_pass="off"))
    np.testing.assert_allclose(result.time, TIME[3:])
    np.testing.assert_allclose(result.points["hand"], LINE[3:], atol=1e-14)
    assert [step.name for step in steps] == ["gaps", "ends", "repeats"]
    assert steps[-1].details["frames"] == 4


def test_stale_frames_are_those_that_are_refilled():
    given = recording((10, 12), (50, 90), (196, 201))
    assert np.flatnonzero(stale_frames(given, 0.2)).tolist() == [10, 11]


def test_finished_recordings_keep_theirs_unless_asked():
    given = recording((10, 12), captured=False)
    assert clean(given)[1] == ()
    assert [step.name for step in clean(given, TaskSettings(repeats=True))[1]] == ["repeats"]
    assert clean(recording((10, 12)), TaskSettings(outliers=False, repeats=False, low_pass="off"))[1] == ()
