"""Convergence and computational effort on hand-made histories."""

from __future__ import annotations

import numpy as np
import pytest

from armdesign.errors import SearchError
from armdesign.swarm import Effort, computational_effort, converged_at, measure_effort

INF = np.inf


@pytest.mark.parametrize(
    ("best", "expected"),
    [
        ([5.0, 3.0, 1.009, 1.001, 1.0], 3),
        ([5.0, 3.0, 1.011, 1.009, 1.0], 4),
        ([101.0, 100.0], 1),  # 1 % is within 1 %
        ([2.0, 2.0, 2.0], 1),
        ([INF, INF, 4.0, 4.0], 3),
        ([INF, INF, INF], 3),
        ([INF], 1),
        ([1.0], 1),
        ([1.0, 0.5, 0.0, 0.0], 3),
        ([0.0, -98.9, -99.5, -100.0], 3),
    ],
)
def test_converged_at_the_first_within_one_percent(best, expected):
    assert converged_at(best) == expected


def test_effort_is_mean_valid_times_iterations():
    best, valid = [5.0, 3.0, 1.005, 1.0, 1.0], [10, 20, 60, 400, 400]
    assert computational_effort(best, valid) == 90.0
    assert measure_effort(best, valid) == Effort(iterations=3, mean_valid=30.0, computational_effort=90.0, found=True)


def test_iterations_after_convergence_cost_nothing():
    best, valid = np.array([2.0, 1.0, 1.0]), np.array([7, 8, 9])
    longer = np.r_[best, np.full(50, 1.0)], np.r_[valid, np.full(50, 300)]
    assert computational_effort(*longer) == computational_effort(best, valid) == 15.0


def test_effort_scales_with_the_fitness_unit():
    best, valid = np.array([9.0, 4.0, 2.01, 2.0]), np.array([1, 2, 3, 4])
    assert measure_effort(1000.0 * best, valid) == measure_effort(best, valid)


def test_a_run_that_found_nothing_spent_all_its_iterations():
    assert measure_effort([INF, INF], [0, 4]) == Effort(2, 2.0, 4.0, found=False)


@pytest.mark.parametrize(
    ("best", "valid", "words"),
    [
        ([], [], "empty"),
        ([1.0, np.nan], [1, 1], "iteration 2 is nan"),
        ([1.0, -INF], [1, 1], "iteration 2 is -inf"),
        ([1.0, 1.0], [1], "counts of valid particles"),
        ([1.0, 1.0], [1, -2], "iteration 2 is -2"),
        ([[1.0]], [1], "best fitness"),
        ([[1.0], [1.0, 2.0]], [1], "should be numbers"),
    ],
)
def test_effort_refuses_what_is_no_history(best, valid, words):
    with pytest.raises(SearchError, match=words):
        computational_effort(best, valid)
