"""What only the many-basin search promises: it finds the best basin, hints and gradients help, and it begins anew."""

from __future__ import annotations

import numpy as np
import pytest
from swarm_problem import BOX, GOAL, SLAB, build, bumpy, bumpy_slope, evaluate, run

from armdesign.swarm import SearchSpace


def run_noting(search, note, answers=evaluate):
    """Carry on without gradients; `note` sees each batch, its hints and what is told."""
    while not search.done:
        X, hints = search.ask(), search.hints
        told = answers(X) if answers is evaluate else answers(X, hints)
        note(X, np.full((len(X), 2), np.nan) if hints is None else hints, told)
        search.tell(*told)
    return search


def nothing(*_):
    """Note nothing."""


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("budget", "slopes"), [(4000, False), (1500, True)])
def test_every_seed_finds_the_best_basin_and_gradients_take_far_fewer_candidates(seed, budget, slopes):
    search = build("multibasin", seed, budget=budget)
    run(search, slopes=slopes)
    assert search.best_fitness < 0.01
    assert np.abs(search.best_position - GOAL).max() < 0.05


def test_what_is_asked_with_a_hint_lies_in_the_slab_near_the_place_of_the_hint():
    def note(X, hints, told):
        known = np.isfinite(hints).all(axis=1)
        total = X[known] @ SLAB.weights
        assert np.all((total > SLAB.low) & (total < SLAB.high))
        assert np.abs(X[known][:, 0] - hints[known][:, 0]).max(initial=0.0) < 0.61 * BOX.width[0]

    run_noting(build("multibasin"), note)


def test_best_is_the_smallest_of_what_was_asked_in_full_without_hint():
    seen = []
    search = build("multibasin")
    while not search.done:
        X, hints = search.ask(), search.hints
        told = evaluate(X)
        pure = ~np.isfinite(np.full((len(X), 2), np.nan) if hints is None else hints).any(axis=1) & (search.coarse == 0)
        seen.append(told[0][pure].min(initial=np.inf))
        search.tell(*told)
    assert np.array_equal(search.history.best, np.minimum.accumulate(seen))


def test_a_flattering_hint_is_not_believed():
    def flattering(X, hints):
        values, valid, given = evaluate(X)
        return (values if hints is None else np.where(np.isnan(hints[:, 0]), values, values - 5.0)), valid, given

    search = run_noting(build("multibasin", budget=4000), nothing, flattering)
    assert search.best_fitness == bumpy(search.best_position[None])[0]
    assert np.all(search.basins[1] >= 0.0)


def beginnings(stall):
    """How often a search with gradients draws from each sampler, and the search."""
    drawn = {"sample": 0, "anew": 0}

    def counting(name):
        def sample(rng, count):
            drawn[name] += 1
            return BOX.uniform(rng, count)

        return sample

    space = SearchSpace(BOX, counting("sample"), counting("anew"), SLAB)
    search = build("multibasin", space=space, budget=2500, stall=stall)
    run(search)
    return drawn, search


def test_without_gain_it_begins_anew_and_forgets_nothing():
    drawn, search = beginnings(stall=3.0)
    assert drawn["sample"] == 1
    assert drawn["anew"] > beginnings(stall=1e6)[0]["anew"]
    assert search.basins[1][0] <= search.best_fitness + 1e-12
    assert search.best_fitness < 0.01


def test_basins_are_apart_and_equal_designs_count_once():
    def folded(X):
        Y = X.copy()
        Y[:, 0] = np.abs(Y[:, 0])
        return Y

    search = build("multibasin", space=SearchSpace(BOX, slab=SLAB, canonical=folded), budget=4000)
    run_noting(search, nothing, lambda X, hints: evaluate(folded(X)))
    X, values = search.basins
    assert np.all(np.diff(values) >= 0.0)
    Y = (folded(X) - BOX.lower) / np.where(BOX.width > 0.0, BOX.width, 1.0)
    apart = np.linalg.norm(Y[:, None] - Y[None], axis=-1) + np.eye(len(Y))
    assert apart.min() > 0.15


@pytest.mark.parametrize("slopes", [True, False])
def test_gradients_or_probes_never_both(slopes):
    search, stages = build("multibasin"), []
    while not search.done:
        X = search.ask()
        stages.append(search.state().get("part_0_descents_phase"))
        search.tell(*evaluate(X), bumpy_slope(X) if slopes and search.wants_slopes else None)
    assert ("probe" in stages) != slopes
    assert (stages.count("slope") > 1) == slopes
