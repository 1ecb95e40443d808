"""Opytimizer's algorithms: the budget holds, seeds tell all, nothing outside is touched."""
# ruff: noqa: NPY002 (the global generator is what these tests are about)

import logging

import numpy as np
import pytest

from armdesign.errors import MissingExtraError, SettingsError
from armdesign.experiments.studies import opytimizer_swarms
from armdesign.experiments.studies.opytimizer_swarms import ALGORITHMS, check_opytimizer, minimise

LOWER, UPPER = np.array([-3.0, -3.0, -3.0]), np.array([3.0, 3.0, 3.0])
CENTRE = np.array([0.7, -1.1, 2.0])


def bowl(x):
    return float(((x - CENTRE) ** 2).sum())


def run(name, objective=bowl, budget=777, agents=20, seed=4, **options):
    return minimise(name, objective, LOWER, UPPER, budget=budget, agents=agents, seed=seed, temperature=1.0, **options)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_budget_is_spent_to_the_last_evaluation(name):
    evaluated = []

    def noted(x):
        evaluated.append(x)
        return bowl(x)

    found = run(name, noted)
    assert found.evaluations == len(evaluated) == 777
    assert found.value == min(map(bowl, evaluated)) == bowl(found.x)
    assert (np.array(evaluated) >= LOWER).all()
    assert (np.array(evaluated) <= UPPER).all()


@pytest.mark.parametrize("name", ALGORITHMS)
def test_same_seed_same_run_another_seed_another(name):
    first, again, other = run(name), run(name), run(name, seed=5)
    assert np.array_equal(first.x, again.x)
    assert not np.array_equal(first.x, other.x)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_fetching_values_in_advance_changes_nothing(name):
    batches = []

    def many(X):
        batches.append(len(X))
        return np.array([bowl(x) for x in X])

    alone, fetched = run(name), run(name, prefetch=many)
    assert np.array_equal(alone.x, fetched.x)
    assert alone.value == fetched.value
    assert sum(batches) > 300


@pytest.mark.parametrize("name", [name for name in ALGORITHMS if name != "sa-default"])
def test_algorithm_comes_nearer_than_its_first_generation(name):
    first = np.random.default_rng(0).uniform(LOWER, UPPER, (20, 3))
    assert run(name, first=first).value < 0.5 * min(map(bowl, first))


def test_first_generation_is_the_one_given():
    evaluated = []
    first = np.random.default_rng(0).uniform(LOWER, UPPER, (20, 3))
    run("pso", lambda x: (evaluated.append(x), bowl(x))[1], first=first)
    assert np.array_equal(evaluated[:20], first)


def test_annealing_that_cools_beats_the_random_walk_of_the_defaults():
    pairs = [(run("sa", seed=seed).value, run("sa-default", seed=seed).value) for seed in range(8)]
    assert np.mean([a for a, _ in pairs]) < np.mean([b for _, b in pairs])


def test_global_generator_logging_and_folder_stay_as_they_were(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    np.random.seed(11)
    expected = np.random.random(3)
    np.random.seed(11)
    logger_class = logging.getLoggerClass()
    run("ga")
    assert np.array_equal(np.random.random(3), expected)
    assert logging.getLoggerClass() is logger_class
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


def test_generator_is_put_back_after_an_error_too():
    np.random.seed(11)
    expected = np.random.random()
    np.random.seed(11)

    def stop(spent, best):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run("pso", on_evaluation=stop)
    assert np.random.random() == expected


def test_budget_below_an_iteration_is_refused():
    with pytest.raises(SettingsError, match="too small for one iteration of 20 agents; allowed: 80 or more"):
        run("abc", budget=79)


def test_versions_with_a_still_counter_are_refused(monkeypatch):
    monkeypatch.setattr(opytimizer_swarms, "version", lambda name: "5.0.1")
    with pytest.raises(MissingExtraError, match=r"opytimizer 5\.0\.1 .* pip install 'armdesign\[bench\]'"):
        check_opytimizer()
