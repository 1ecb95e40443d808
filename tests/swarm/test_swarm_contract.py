"""The contract of the search algorithms: laws that each of the registry obeys, whatever it does in between."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np
import pytest
from swarm_problem import BOX, GOAL, SLAB, SMALL, SPACE, answer, build, bumpy, bumpy_slope, evaluate, run, through_json

from armdesign.errors import ArmDesignError, SearchError, SettingsError
from armdesign.settings.sections import ALGORITHM_SETTINGS, SIZES, Search
from armdesign.swarm import ALGORITHMS, Box, SearchSpace, algorithm_from_state, make_algorithm

ROOT = Path(__file__).resolve().parents[2]

every_algorithm = pytest.mark.parametrize("name", ALGORITHMS)
with_and_without_slopes = pytest.mark.parametrize("slopes", [True, False])


def digest(search):
    """A run, what was asked and what was found, as one number."""
    parts = [*run(search), *vars(search.history).values(), *search.basins]
    return hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in parts)).hexdigest()


def assert_same_state(one, other):
    state, again = one.state(), other.state()
    assert state.keys() == again.keys()
    for key, value in state.items():
        numeric = isinstance(value, np.ndarray) and value.dtype.kind == "f"
        assert np.array_equal(value, again[key], equal_nan=numeric), key


@every_algorithm
def test_settings_of_an_algorithm_are_its_parameters_with_the_same_defaults(name):
    parameters = asdict(ALGORITHMS[name].Parameters())
    assert set(ALGORITHM_SETTINGS[name]) == set(parameters) & {field.name for field in fields(Search)}
    for setting in ALGORITHM_SETTINGS[name]:
        assert getattr(Search(), setting) in (parameters[setting], None)  # None: by the number of joints
    assert ALGORITHMS[name].length in ALGORITHM_SETTINGS[name]
    assert ALGORITHMS.keys() == ALGORITHM_SETTINGS.keys()
    assert Search(algorithm=name).candidates == np.prod([parameters[size] for size in SIZES if size in parameters])


@every_algorithm
def test_everything_asked_lies_in_the_box_fixed_entries_stay_and_the_others_move(name):
    X = np.vstack(run(build(name)))
    assert np.array_equal(BOX.clip(X), X)
    assert np.all(X[:, 2] == 0.3)
    assert np.all(np.ptp(X[:, BOX.width > 0.0], axis=0) > 0.1)


@every_algorithm
def test_same_seed_same_run_in_a_fresh_process_too(name):
    expected = digest(build(name))
    assert digest(build(name, seed=6)) != expected
    script = (
        "import sys; sys.path[:0] = sys.argv[1:3]; import test_swarm_contract as c; "
        "print(c.digest(c.build(sys.argv[3])))"
    )
    command = [sys.executable, "-c", script, str(ROOT), str(Path(__file__).parent), name]
    environment = {**os.environ, "PYTHONHASHSEED": "77"}
    printed = subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout
    assert printed.strip() == expected


@every_algorithm
def test_ask_repeats_itself_until_told(name):
    search = build(name)
    while not search.done:
        X = search.ask()
        kept = X.copy()
        X[:] = 9.0  # what the caller does to the answer is his own business
        assert np.array_equal(search.ask(), kept)
        answer(search, kept)


@every_algorithm
def test_inputs_are_left_alone_and_not_kept(name):
    plain, meddled = build(name), build(name)
    while not plain.done:
        X = plain.ask()
        assert np.array_equal(meddled.ask(), X)
        told = evaluate(X)
        copies = [each.copy() for each in told]
        answer(plain, X)
        meddled.tell(*told, np.zeros_like(X) if not meddled.wants_slopes else bumpy_slope(X))
        assert all(np.array_equal(each, kept, equal_nan=True) for each, kept in zip(told, copies, strict=True))
        told[0][:] = 0.0
        told[1][:] = ~told[1]
        told[2][:] = 7.0
        outputs = [*meddled.state().values(), meddled.best_position, meddled.cutoff, meddled.hints, *meddled.basins]
        for output in outputs:
            if isinstance(output, np.ndarray):
                output[...] = 0
    assert_same_state(plain, meddled)


@every_algorithm
def test_slopes_are_only_heeded_where_they_are_wanted(name):
    plain, told = build(name), build(name)
    while not plain.done:
        X = plain.ask()
        told.ask()
        answer(plain, X)
        told.tell(*evaluate(X), bumpy_slope(X))
    assert_same_state(plain, told)


@every_algorithm
def test_first_positions_are_the_sampled_ones(name):
    rows = BOX.lower + np.linspace(0.2, 0.4, 500)[:, None] * BOX.width
    search = build(name, space=SearchSpace(BOX, sample=lambda rng, count: rows[:count]))
    X = search.ask()
    assert np.array_equal(X, rows[: len(X)])


@every_algorithm
def test_default_start_fills_the_box(name):
    X = build(name, particles=1500, budget=25_000, coarse=0).ask()
    free = BOX.width > 0.0
    share = (X - BOX.lower)[:, free] / BOX.width[free]
    assert np.allclose(share.mean(axis=0), 0.5, atol=0.06)
    assert np.allclose(share.std(axis=0), np.sqrt(1.0 / 12.0), atol=0.03)


@every_algorithm
@with_and_without_slopes
@pytest.mark.parametrize("asked", [False, True])
def test_resumed_after_every_batch_equals_uninterrupted(name, slopes, asked):
    whole, parts = build(name), build(name)
    while not parts.done:
        if asked:
            parts.ask()
        parts = algorithm_from_state(through_json(parts.state()), SPACE)
        X = whole.ask()
        assert np.array_equal(parts.ask(), X)
        answer(whole, X, slopes=slopes)
        answer(parts, X, slopes=slopes)
    assert type(parts) is type(whole)
    assert parts.parameters == whole.parameters
    assert_same_state(whole, parts)


@every_algorithm
@pytest.mark.parametrize("part", [0.4, 0.97, 1.0])
def test_a_search_made_longer_goes_on_from_what_it_has(name, part):
    search = build(name)
    while not search.done and search.progress[0] < part * search.progress[1]:
        run(search, 1)
    search.done or search.ask()
    longer = algorithm_from_state(through_json(search.state()), SPACE, 2 * SMALL[search.length])
    assert not longer.done
    assert longer.best_fitness == search.best_fitness
    before = search.iteration
    run(longer)
    assert longer.progress[1] == 2 * SMALL[search.length]
    assert longer.progress[0] > 1.8 * SMALL[search.length]
    assert np.array_equal(longer.history.best[:before], search.history.best)
    assert longer.best_fitness <= search.best_fitness


@every_algorithm
def test_a_search_that_found_nothing_can_be_made_longer(name):
    search = build(name)
    for factor in (1, 2):
        search = algorithm_from_state(search.state(), SPACE, factor * SMALL[search.length])
        while not search.done:
            X = search.ask()
            values, valid, hints = evaluate(X)
            search.tell(values if factor == 2 else np.full(len(X), np.inf), valid, hints)
    assert np.isfinite(search.best_fitness)


@every_algorithm
def test_taking_the_state_changes_nothing_and_it_is_arrays_and_plain_values(name):
    watched, plain = build(name), build(name)
    while not plain.done:
        state = watched.state()
        values = {key: value for key, value in state.items() if not isinstance(value, np.ndarray)}
        assert json.loads(json.dumps(values, allow_nan=False)) == values
        assert all(value.dtype != object for value in state.values() if isinstance(value, np.ndarray))
        run(watched, 1)
        run(plain, 1)
    assert_same_state(plain, watched)


@every_algorithm
def test_history_counts_and_progress_ends_with_the_search(name):
    search, counts, sizes = build(name), [], []
    while not search.done:
        assert search.progress[0] < search.progress[1]
        X = search.ask()
        answer(search, X)
        counts.append(evaluate(X)[1].sum())
        sizes.append(len(X))
    history = search.history
    assert np.all(np.diff(history.best) <= 0.0)
    assert history.best[-1] == search.best_fitness
    assert np.array_equal(history.valid, counts)
    assert np.array_equal(history.evaluations, np.cumsum(sizes))
    assert search.iteration == len(sizes)
    assert search.evaluations == sum(sizes)
    done, planned = search.progress
    assert planned == SMALL[search.length]
    assert 0.9 * planned <= done <= planned
    assert search.units_done(search.evaluations, SMALL) == done
    with pytest.raises(SearchError, match=f"{done} of {planned} {search.unit}s"):
        search.ask()


@every_algorithm
@pytest.mark.parametrize("length", [1, 7, 100, 333])
def test_planned_length_is_never_exceeded_and_nearly_used(name, length):
    search = build(name, **{ALGORITHMS[name].length: length})
    run(search)
    assert 0.9 * length <= search.progress[0] <= length


@every_algorithm
@with_and_without_slopes
def test_what_is_past_its_cutoff_need_not_be_known(name, slopes):
    full, pruned = build(name), build(name)
    while not full.done:
        X = full.ask()
        assert np.array_equal(pruned.ask(), X)
        answer(full, X, slopes=slopes)
        values, valid, hints = evaluate(X)
        values = np.where(values > pruned.cutoff, np.inf, values)
        pruned.tell(values, valid, hints, bumpy_slope(X) if slopes and pruned.wants_slopes else None)
    assert_same_state(full, pruned)


@every_algorithm
def test_the_best_and_the_basins_are_what_was_asked(name):
    search = build(name)
    run(search)
    X, values = search.basins
    assert np.array_equal(values, bumpy(X))
    assert np.all(np.diff(values) >= 0.0)
    assert len(np.unique(X, axis=0)) == len(X)
    assert search.best_fitness == bumpy(search.best_position[None])[0] == values[0]
    assert np.all((X @ SLAB.weights > SLAB.low) & (X @ SLAB.weights < SLAB.high))


@every_algorithm
def test_nothing_valid_ends_without_a_best(name):
    search = build(name)
    while not search.done:
        X = search.ask()
        search.tell(np.full(len(X), np.inf), np.zeros(len(X), dtype=bool))
    assert search.best_fitness == np.inf
    assert [len(part) for part in search.basins] == [0, 0]
    assert np.all(np.isinf(search.history.best))
    assert np.all(np.isinf(search.history.mean))
    assert search.progress[0] == search.progress[1]


@every_algorithm
def test_hints_and_slopes_are_optional(name):
    search = build(name)
    while not search.done:
        X = search.ask()
        search.tell(*evaluate(X)[:2])
    assert search.hints is None
    assert search.best_fitness < bumpy(np.vstack([GOAL + 0.5, GOAL - 0.5])).min()


@every_algorithm
def test_one_free_entry_is_enough(name):
    search = build(name, space=SearchSpace(Box([0.0], [1.0], [False])), particles=1)
    for _ in range(3):
        X = search.ask()
        search.tell(X[:, 0], np.ones(len(X), dtype=bool))
    assert search.ask().shape[1] == 1


# ------------------------------------------------------------------ what is refused


@every_algorithm
@pytest.mark.parametrize(
    "change",
    [
        {0: lambda v: np.r_[np.nan, v[1:]]},
        {0: lambda v: np.r_[v[:2], -np.inf, v[3:]]},
        {0: lambda v: v[1:]},
        {0: lambda v: v[None]},
        {0: lambda v: ["bad", *v[1:]]},
        {1: lambda v: v[1:]},
        {1: lambda v: v.astype(float)},
        {1: lambda v: None},
        {2: lambda v: v[1:]},
        {3: lambda v: v[:, 1:]},
    ],
)
def test_a_wrong_tell_is_refused_and_leaves_the_search_as_it_was(name, change):
    search, twin = build(name), build(name)
    run(search, 1)
    run(twin, 1)
    X = search.ask()
    twin.ask()
    told = [*evaluate(X), bumpy_slope(X)]
    for place, spoil in change.items():
        told[place] = spoil(told[place])
    with pytest.raises(SearchError):
        search.tell(*told)
    assert_same_state(search, twin)


@every_algorithm
def test_tell_needs_an_ask(name):
    search = build(name)
    for _ in range(2):
        with pytest.raises(SearchError, match=r"Call ask\(\)"):
            search.tell([0.0], [True])
        run(search, 1)


@every_algorithm
def test_a_missing_or_damaged_entry_of_the_state_is_named(name):
    search = build(name)
    run(search, 12, slopes=False)
    state = search.state()
    for key in state:
        with pytest.raises(SearchError, match=f"no entry '{key}'"):
            algorithm_from_state({other: value for other, value in state.items() if other != key}, SPACE)
    arrays = [key for key, value in state.items() if isinstance(value, np.ndarray)]
    wrong = {key: np.zeros((3, 2, 1)) for key in arrays} | dict.fromkeys(("generator", "parameters"), "[]")
    wrong |= {"positions": np.full_like(state["positions"], 9.0)}
    for key, value in wrong.items():
        with pytest.raises(ArmDesignError):
            algorithm_from_state(state | {key: value}, SPACE)


@every_algorithm
def test_a_state_belongs_to_its_algorithm_and_its_parameters(name):
    state = build(name).state()
    for kind in ALGORITHMS.values():
        if kind.name != name:
            with pytest.raises(SearchError, match=f"'{name}', not '{kind.name}'"):
                kind.from_state(state, SPACE)
    with pytest.raises(SettingsError, match="gone"):
        algorithm_from_state(state | {"algorithm": "gone"}, SPACE)
    with pytest.raises(SettingsError, match="'gone'"):
        algorithm_from_state(state | {"parameters": {"gone": 1}}, SPACE)


@every_algorithm
def test_a_length_out_of_range_is_named(name):
    for value in (0, 2.5, True, "7"):
        with pytest.raises(SettingsError, match=f"'{ALGORITHMS[name].length}'.*whole number >= 1"):
            build(name, **{ALGORITHMS[name].length: value})


@every_algorithm
def test_a_seed_is_no_generator(name):
    with pytest.raises(SettingsError, match="default_rng"):
        ALGORITHMS[name](SPACE, 7)


@every_algorithm
@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda X: X[1:], "shape"),
        (lambda X: X + np.array([0, 0, 0, 0, 0, 7]), "entry 5 = 7"),
        (lambda X: X * np.nan, "entry 0 = nan"),
        (lambda X: [[0.5], [1.0, 2.0]], "should be numbers"),
    ],
)
def test_sampled_positions_must_lie_in_the_box(name, spoil, words):
    space = SearchSpace(BOX, sample=lambda rng, count: spoil(np.tile(BOX.lower, (count, 1))))
    with pytest.raises(SearchError, match=words):
        build(name, space=space).ask()


@pytest.mark.parametrize("name", ["cma", "PSO", "", None, 3, ["pso"]])
def test_an_unknown_algorithm_lists_the_known_ones(name):
    with pytest.raises(SettingsError) as caught:
        make_algorithm(name, SPACE, np.random.default_rng(0))
    assert all(known in str(caught.value) for known in (*ALGORITHMS, repr(name)))


def test_rounding_at_a_bound_is_forgiven():
    space = SearchSpace(BOX, sample=lambda rng, count: np.nextafter(np.tile(BOX.upper, (count, 1)), 9.0))
    assert np.all(build("pso", space=space).ask() == BOX.upper)


@pytest.mark.parametrize("bits", ["PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64"])
def test_every_numpy_generator_resumes(bits):
    search, twin = (
        make_algorithm("rapso", SPACE, np.random.Generator(getattr(np.random, bits)(3)), SMALL) for _ in range(2)
    )
    run(search, 5)
    resumed = algorithm_from_state(through_json(search.state()), SPACE)
    run(resumed)
    run(twin)
    assert_same_state(resumed, twin)


@pytest.mark.parametrize(
    "text", ["no JSON", '{"bit_generator": "PCG64", "state": {}}', '{"bit_generator": "default_rng"}', "[]"]
)
def test_a_damaged_generator_is_refused(text):
    with pytest.raises(SearchError, match="generator"):
        algorithm_from_state(build("pso").state() | {"generator": text}, SPACE)
