"""Convergence and computational effort on hand-made histories."""

from __future__ import annotations

import numpy as np
import pytest

from armdesign.errors import SearchError
from armdesign.swarm import History

INF = np.inf


def effort(best, valid):
    """The effort of a history; its means and counts do not matter."""
    best = np.array(best, dtype=float)
    return History(best, best, np.array(valid, dtype=int), np.arange(len(best))).effort


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
    assert effort(best, np.ones(len(best))).iterations == expected


def test_effort_is_mean_valid_times_iterations():
    assert effort([5.0, 3.0, 1.005, 1.0, 1.0], [10, 20, 60, 400, 400]) == (3, 30.0, 90.0)


def test_iterations_after_convergence_cost_nothing():
    best, valid = [2.0, 1.0, 1.0], [7, 8, 9]
    assert effort(best + 50 * [1.0], valid + 50 * [300]) == effort(best, valid) == (2, 7.5, 15.0)


def test_effort_scales_with_the_fitness_unit():
    best, valid = np.array([9.0, 4.0, 2.01, 2.0]), [1, 2, 3, 4]
    assert effort(1000.0 * best, valid) == effort(best, valid)


def test_a_run_that_found_nothing_spent_all_its_iterations():
    assert effort([INF, INF], [0, 4]) == (2, 2.0, 4.0)


def test_without_an_iteration_there_is_no_effort():
    with pytest.raises(SearchError, match="at least one iteration"):
        effort([], [])
