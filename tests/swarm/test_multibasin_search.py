"""Laws of the many-basin search: budget, bounds, hints, pruning, resuming, and that it finds what there is to find."""

from __future__ import annotations

import json

import numpy as np
import pytest

from armdesign.errors import SearchError, SettingsError
from armdesign.swarm import Box, MultiBasin, Recipe, Slab

BOX = Box(
    lower=[-1.5, 0.0, 0.3, -1.5, 0.0, 0.0],
    upper=[1.5, 0.5, 0.3, 1.5, 0.5, 0.5],
    angular=[True, False, False, True, False, False],
)
SLAB = Slab(np.array([0.0, 1.0, 1.0, 0.0, 1.0, 1.0]), 0.5, 1.4)
SMALL = Recipe(descents=6, parents=8, candidates_per_start=150)
GOAL = np.array([0.9, 0.1, 0.3, -0.7, 0.0, 0.4])


def bumpy(X):
    """Dozens of basins; the best one is at GOAL, with the value 0."""
    Y = X - GOAL
    return np.sum(Y**2 + 0.15 * (1.0 - np.cos(6.0 * Y)), axis=1) + 0.3 * np.abs(Y[:, 4])


def evaluate(X, hints=None):
    """Values, validity, and as hint the place itself; too short, too long or on one side there is no value."""
    valid = (X @ SLAB.weights > SLAB.low) & (X @ SLAB.weights < SLAB.high) & (X[:, 3] < 1.3)
    return np.where(valid, bumpy(X), np.inf), valid, np.where(valid[:, None], X[:, :2], np.nan)


def build(seed=5, budget=4000, **changes):
    return MultiBasin(BOX, budget, np.random.default_rng(seed), **({"slab": SLAB, "recipe": SMALL} | changes))


def run(search, evaluated=evaluate, batches=10**6):
    """Carry on; everything that was asked."""
    asked = []
    while not search.done and len(asked) < batches:
        X = search.ask()
        asked.append(X)
        search.tell(*evaluated(X, search.hints))
    return asked


def through_json(state):
    return json.loads(json.dumps(state, default=lambda value: value.tolist()))


@pytest.mark.parametrize("seed", range(4))
def test_every_seed_finds_the_best_basin(seed):
    search = build(seed)
    run(search)
    assert search.best_fitness < 0.01
    assert np.abs(search.best_position - GOAL).max() < 0.05


@pytest.mark.parametrize("budget", [1, 7, 100, 333, 1500])
def test_budget_is_never_exceeded_and_nearly_used(budget):
    search = build(budget=budget)
    asked = run(search)
    assert search.evaluations == sum(map(len, asked)) <= budget
    assert search.evaluations >= 0.9 * budget
    assert np.array_equal(np.diff(search.history.evaluations, prepend=0), [len(X) for X in asked])


def test_everything_asked_lies_in_the_box_and_fixed_entries_stay():
    X = np.vstack(run(build()))
    assert np.array_equal(BOX.clip(X), X)
    assert np.all(X[:, 2] == 0.3)


def test_what_is_asked_with_a_hint_lies_in_the_slab():
    hinted = []

    def noting(X, hints):
        if hints is not None:
            hinted.append(X[np.isfinite(hints).all(axis=1)])
        return evaluate(X)

    run(build(), noting)
    total = np.vstack(hinted) @ SLAB.weights
    assert np.all((total > SLAB.low) & (total < SLAB.high))


def test_best_is_the_smallest_of_what_was_asked_without_hint():
    seen = []

    def noting(X, hints):
        values, valid, given = evaluate(X)
        pure = np.ones(len(X), dtype=bool) if hints is None else np.isnan(hints).all(axis=1)
        seen.append(values[pure].min(initial=np.inf))
        return values, valid, given

    search = build()
    run(search, noting)
    assert np.array_equal(search.history.best, np.minimum.accumulate(seen))
    assert search.best_fitness == bumpy(search.best_position[None])[0]


def test_a_flattering_hint_is_not_believed():
    def flattering(X, hints):
        values, valid, given = evaluate(X)
        return (values if hints is None else np.where(np.isnan(hints[:, 0]), values, values - 5.0)), valid, given

    search = build()
    run(search, flattering)
    assert search.best_fitness == bumpy(search.best_position[None])[0]
    assert np.all(search.basins[1] >= 0.0)


def test_hints_come_back_with_places_near_those_they_were_told_for():
    def checking(X, hints):
        if hints is not None:
            known = np.isfinite(hints).all(axis=1)
            assert np.abs(X[known][:, :2] - hints[known])[:, 0].max(initial=0.0) < 3.1 * 0.61
        return evaluate(X)

    run(build(), checking)


def test_without_hints_it_works_as_well():
    search = build()
    run(search, lambda X, hints: evaluate(X)[:2])
    assert search.best_fitness < 0.01
    assert search.hints is None


def test_same_seed_same_run():
    first, again, other = (np.vstack(run(build(seed))) for seed in (5, 5, 6))
    assert np.array_equal(first, again)
    assert not np.array_equal(first[:50], other[:50])


def test_what_is_past_its_cutoff_need_not_be_known():
    pruned, search = build(), build()
    while not search.done:
        X = pruned.ask()
        assert np.array_equal(X, search.ask())
        values, valid, hints = evaluate(X)
        search.tell(values, valid, hints)
        pruned.tell(np.where(values > pruned.cutoff, np.inf, values), valid, hints)
    assert pruned.done
    assert np.array_equal(pruned.history.best, search.history.best)


def beginnings(stall, budget=2500):
    """How often a search with gradients draws a first sample, and the search."""
    drawn = []

    def sample(rng, count):
        drawn.append(count)
        return BOX.lower + rng.random((count, BOX.dimension)) * BOX.width

    recipe = Recipe(descents=6, parents=8, candidates_per_start=150, stall=stall)
    search = build(budget=budget, recipe=recipe, sample=sample)
    with_slopes(search)
    return len(drawn), search


def test_without_gain_it_begins_anew_and_forgets_nothing():
    often, search = beginnings(stall=0.1)
    assert often > 1
    assert beginnings(stall=1.0)[0] == 1
    assert search.basins[1][0] <= search.best_fitness + 1e-12
    assert np.all(np.diff(search.basins[1]) >= 0.0)
    assert search.best_fitness < 0.01


def test_resumed_at_every_batch_equals_uninterrupted():
    whole = build(budget=1500)
    reference = np.vstack(run(whole))
    search, asked = build(budget=1500), []
    while not search.done:
        asked += run(search, batches=1)
        search = MultiBasin.from_state(through_json(search.state()))
    assert np.array_equal(np.vstack(asked), reference)
    assert np.array_equal(search.history.best, whole.history.best)
    assert np.array_equal(search.basins[0], whole.basins[0])


def test_resumed_between_ask_and_tell_equals_uninterrupted():
    search, other = build(budget=1500), build(budget=1500)
    while not search.done:
        X = search.ask()
        search = MultiBasin.from_state(search.state())
        assert np.array_equal(search.ask(), X)
        search.tell(*evaluate(X))
        other.ask()
        other.tell(*evaluate(X))
    assert other.best_fitness == search.best_fitness


def test_ask_repeats_itself_until_told():
    search = build(budget=600)
    while not search.done:
        X = search.ask()
        kept = X.copy()
        X[:] = 9.0
        assert np.array_equal(search.ask(), kept)
        search.tell(*evaluate(kept))


def test_nothing_valid_ends_without_a_best():
    search = build(budget=700)
    run(search, lambda X, hints: (np.full(len(X), np.inf), np.zeros(len(X), dtype=bool)))
    assert search.done
    assert search.best_fitness == np.inf
    assert len(search.basins[1]) == 0
    with pytest.raises(SearchError, match="spent"):
        search.ask()


def test_basins_are_apart_best_first_and_equal_designs_count_once():
    def folded(X):
        Y = X.copy()
        Y[:, 0] = np.abs(Y[:, 0])
        return Y

    def mirrored(X, hints):
        return evaluate(folded(X))

    search = build(canonical=folded)
    run(search, mirrored)
    X, values = search.basins
    assert np.all(np.diff(values) >= 0.0)
    Y = (folded(X) - BOX.lower) / np.where(BOX.width > 0.0, BOX.width, 1.0)
    apart = np.linalg.norm(Y[:, None] - Y[None], axis=-1) + np.eye(len(Y))
    assert apart.min() > 0.15


def test_bad_calls_leave_the_search_as_it_was():
    search = build()
    with pytest.raises(SearchError, match="did not ask"):
        search.tell([0.0], [True])
    X = search.ask()
    for values in (np.full(len(X), np.nan), np.zeros(3)):
        with pytest.raises(SearchError):
            search.tell(values, np.ones(len(values), dtype=bool))
    with pytest.raises(SearchError, match="hints"):
        search.tell(np.zeros(len(X)), np.ones(len(X), dtype=bool), np.zeros((2, 2)))
    assert np.array_equal(search.ask(), X)
    with pytest.raises(SettingsError, match="budget"):
        build(budget=0)


def test_a_damaged_state_is_refused():
    search = build(budget=1500)
    run(search, batches=12)
    state = search.state()
    for name in ("budget", "archive_value", "descents_U", "sample", "history_best"):
        with pytest.raises(SearchError, match=name.removeprefix("descents_") if name == "budget" else name):
            MultiBasin.from_state({key: value for key, value in state.items() if key != name})
    with pytest.raises(SearchError, match="pso"):
        MultiBasin.from_state(state | {"algorithm": "pso"})


def bumpy_slope(X):
    """Gradient of bumpy."""
    Y = X - GOAL
    slope = 2.0 * Y + 0.9 * np.sin(6.0 * Y)
    slope[:, 4] += 0.3 * np.sign(Y[:, 4])
    return slope


def with_slopes(search):
    """Carry on with gradients; everything that was asked."""
    asked = []
    while not search.done:
        X = search.ask()
        asked.append(X)
        values, valid, hints = evaluate(X)
        search.tell(values, valid, hints, bumpy_slope(X) if search.wants_slopes else None)
    return asked


@pytest.mark.parametrize("seed", range(4))
def test_with_gradients_the_best_basin_takes_far_fewer_candidates(seed):
    search = build(seed, budget=1500)
    with_slopes(search)
    assert search.best_fitness < 0.01


def test_with_gradients_nothing_is_probed():
    search, stages = build(budget=1200), set()
    while not search.done:
        X = search.ask()
        stages.add(search.state()["stage"])
        values, valid, hints = evaluate(X)
        search.tell(values, valid, hints, bumpy_slope(X) if search.wants_slopes else None)
    assert {"slope", "step"} <= stages
    assert not {"probe", "retry"} & stages


def test_a_run_with_gradients_goes_on_from_its_state():
    whole, parts = build(budget=1200), build(budget=1200)
    expected = np.vstack(with_slopes(whole))
    asked = []
    while not parts.done:
        X = parts.ask()
        parts = MultiBasin.from_state(through_json(parts.state()))
        asked.append(X)
        values, valid, hints = evaluate(X)
        parts.tell(values, valid, hints, bumpy_slope(X) if parts.wants_slopes else None)
    assert np.array_equal(np.vstack(asked), expected)


def test_slopes_are_only_heeded_where_they_are_wanted():
    plain, told = build(budget=600), build(budget=600)
    while not plain.done:
        X = plain.ask()
        told.ask()
        values, valid, hints = evaluate(X)
        slopes = bumpy_slope(X)
        plain.tell(values, valid, hints, slopes if plain.wants_slopes else None)
        told.tell(values, valid, hints, slopes)
    assert np.array_equal(plain.best_position, told.best_position)
