"""The outcomes of the descents that are solved to the end: the best that differ, best first."""

from __future__ import annotations

import numpy as np
import pytest

from armdesign.fitness.kernels.solver_state import STATE
from armdesign.fitness.kernels.starts import SAME_POSE, keep_finalist


@pytest.fixture
def keep():
    """Offer outcomes (q_1, value) to an empty solver state; returns those kept."""

    def offer(outcomes, limit):
        state = np.zeros(1, dtype=STATE).view(np.recarray)[0]
        for q, value in outcomes:
            state["q"][0], state["value"] = q, value
            keep_finalist.py_func(state, 2, limit)
        count = int(state["final_count"])
        return list(zip(state["final_q"][:count, 0].tolist(), state["final_value"][:count].tolist(), strict=True))

    return offer


def test_the_best_few_are_kept_best_first(keep):
    rng = np.random.default_rng(1)
    for limit in (1, 3, 8, 16):
        outcomes = list(zip(np.arange(12.0).tolist(), rng.permutation(np.arange(12.0)).tolist(), strict=True))
        expected = sorted(outcomes, key=lambda outcome: outcome[1])[:limit]
        assert keep(outcomes, limit) == expected


def test_of_outcomes_at_one_pose_the_best_is_kept(keep):
    near = 0.1 * SAME_POSE
    assert keep([(0.0, 10.0), (near, 5.0), (2 * near, 8.0)], 4) == [(near, 5.0)]
    assert keep([(0.0, 10.0), (1.0, 7.0), (near, 5.0)], 4) == [(near, 5.0), (1.0, 7.0)]


def test_a_pose_told_twice_takes_one_place(keep):
    assert len(keep([(0.0, 3.0), (0.5 * SAME_POSE, 2.0), (2.0, 1.0)], 4)) == 2
    assert len(keep([(0.0, 3.0), (2.0 * SAME_POSE, 2.0), (2.0, 1.0)], 4)) == 3
