"""Designs that the first generation begins with."""

import numpy as np
import pytest

from armdesign.errors import SettingsError
from armdesign.runs.reading import read_problem
from armdesign.runs.resumable import start_run
from armdesign.search.backends.backend import InProcess
from armdesign.search.backends.parallel import WorkerPool
from armdesign.search.search import Search, search
from armdesign.search.swarms import new_swarm
from armdesign.settings.sections import Settings


@pytest.fixture
def some(problem_for):
    """Settings with three designs to begin with, and these."""
    space = problem_for(3).space
    designs = space.sample(np.random.default_rng(9), 3)
    return problem_for(3, first=[[float(x) for x in Phi] for Phi in designs]), designs


def test_first_generation_begins_with_them_and_the_rest_is_as_without(some, problem_for):
    problem, designs = some
    with_them = new_swarm(problem.settings.search, problem.space).ask()
    without = new_swarm(problem_for(3).settings.search, problem.space).ask()
    assert np.array_equal(with_them[:3], designs)
    assert np.array_equal(with_them[3:], without[3:])


def test_they_survive_the_run_folder_to_the_last_bit(some, tmp_path):
    problem, designs = some
    start_run(tmp_path, problem)
    assert np.array_equal(read_problem(tmp_path).settings.search.first, designs)


def test_settings_without_them_do_not_mention_them():
    assert "first" not in Settings().to_toml()
    assert "auto_dof" not in Settings().to_toml()


def test_same_on_any_workers_and_after_a_resume(some):
    problem, _ = some
    whole = search(problem)
    with WorkerPool(problem, 2) as pool:
        assert search(problem, backend=pool).history.best.tolist() == whole.history.best.tolist()
    run = Search(problem, InProcess(problem))
    run.advance()
    other = Search(problem, InProcess(problem))
    other.restore(run.state())
    while other.ended_by() is None:
        other.advance()
    assert other.swarm.history.best.tolist() == whole.history.best.tolist()


def test_best_of_them_is_the_least_that_is_found(some):
    problem, designs = some
    scores, _ = InProcess(problem).evaluate(designs, np.full(3, np.inf))
    if np.isfinite(scores.fitness).any():
        assert search(problem).evaluation.fitness <= scores.fitness.min()


@pytest.mark.parametrize(
    ("first", "sentence"),
    [
        ([[0.1] * 5], "search.first\\[0\\] has 5 numbers; allowed: 8: alpha_0, alpha_1, a_1"),
        ([[0.1] * 8, [9.0] + [0.1] * 7], "search.first\\[1\\] has alpha_0 = 9"),
        ([[0.1] * 8] * 17, "17 designs for a first generation of 16 candidates; allowed: up to 16"),
    ],
)
def test_designs_that_do_not_fit_are_refused(problem_for, first, sentence):
    problem = problem_for(3, first=first)
    with pytest.raises(SettingsError, match=sentence):
        new_swarm(problem.settings.search, problem.space).ask()
