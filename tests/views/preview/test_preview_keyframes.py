"""Which frames are shown."""

import numpy as np
import pytest

from armdesign.views.preview.keyframes import BUDGET, choose_frames, deviation, most_keyframes


@pytest.mark.parametrize("seed", range(5))
def test_keyframes_are_frames_and_include_both_ends(seed):
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.001, 0.05, 500)) + 7.0
    for most in (2, 3, 50, 499, 10_000):
        chosen = choose_frames(time, most)
        assert chosen[0] == 0
        assert chosen[-1] == 499
        assert (np.diff(chosen) > 0).all()
        assert len(chosen) <= most


def test_slow_recordings_are_shown_whole_and_fast_ones_at_the_rate():
    slow, fast = np.arange(100) / 50.0, np.arange(1001) / 500.0
    assert len(choose_frames(slow, 10_000)) == 100
    assert len(choose_frames(fast, 10_000, rate=50.0)) == 101
    assert len(choose_frames(fast, 21)) <= 21


def test_deviation_is_none_on_a_line_and_that_of_the_left_out_frame_on_a_bend():
    time = np.arange(3.0)
    line = np.outer(time, [1.0, 2.0, 3.0])[:, None]
    ends = np.array([0, 2])
    assert deviation(time, line, ends) == pytest.approx(0.0, abs=1e-15)
    bent = line.copy()
    bent[1, 0] += (0.0, 3.0, 4.0)
    assert deviation(time, bent, ends) == pytest.approx(5.0, rel=1e-12)


def test_more_designs_share_the_budget(any_run):
    run = any_run(0, 3)
    assert most_keyframes([run] * 4) == pytest.approx(most_keyframes([run]) / 4, abs=1)
    assert 2 <= most_keyframes([any_run(0, 10, points=12)] * 12) < BUDGET
