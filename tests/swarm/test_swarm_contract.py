"""Laws that every swarm obeys, whatever its moves."""

from __future__ import annotations

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from armdesign.errors import SearchError
from armdesign.swarm import ALGORITHMS, Box, make_swarm, swarm_from_state

ROOT = Path(__file__).resolve().parents[2]
N = 12
BOX = Box(
    lower=[-1.5, 0.0, 0.3, -1.5, 0.0, -0.2],
    upper=[1.5, 0.5, 0.3, 1.5, 0.5, 4.0],
    angular=[True, False, False, True, False, False],
)
GENERATORS = ["PCG64", "PCG64DXSM", "MT19937", "Philox", "SFC64"]

every_algorithm = pytest.mark.parametrize("name", sorted(ALGORITHMS))


def evaluate(X):
    """A bumpy objective; particles that lean to one side are invalid, and most of those without a fitness."""
    fitness = np.sum((X - 0.1) ** 2 + 0.1 * np.sin(9 * X), axis=1)
    valid = X[:, 0] < 0.8
    return np.where(valid | (X[:, 1] < 0.1), fitness, np.inf), valid


def build(name, seed=5, **parameters):
    return make_swarm(name, BOX, N, np.random.default_rng(seed), **parameters)


def advance(swarm, iterations):
    positions = []
    for _ in range(iterations):
        X = swarm.ask()
        positions.append(X)
        swarm.tell(*evaluate(X))
    return np.array(positions)


def digest(swarm, positions):
    parts = [positions, swarm.personal_best_positions, swarm.personal_best_fitness, swarm.history.best]
    return hashlib.sha256(b"".join(np.ascontiguousarray(part).tobytes() for part in parts)).hexdigest()


def through_json(state):
    """Arrays to nested lists and through JSON text, as a program without NumPy files would keep them."""
    return json.loads(json.dumps(state, default=lambda value: value.tolist()))


@every_algorithm
def test_positions_stay_in_the_box(name):
    positions = advance(build(name), 60)
    assert np.all(positions >= BOX.lower)
    assert np.all(positions <= BOX.upper)


@every_algorithm
def test_particles_move_at_all(name):
    positions = advance(build(name), 4)
    free = BOX.width > 0
    assert np.all(np.ptp(positions[:, :, free], axis=0).max(axis=0) > 0)


@every_algorithm
def test_fixed_entries_stay_fixed(name):
    assert np.all(advance(build(name), 30)[:, :, 2] == 0.3)


@every_algorithm
def test_same_seed_same_run(name):
    assert np.array_equal(advance(build(name), 30), advance(build(name), 30))
    assert not np.array_equal(advance(build(name, seed=6), 2), advance(build(name), 2))


@every_algorithm
def test_fresh_process_same_run(name):
    script = (
        "import sys; sys.path[:0] = sys.argv[1:3]; import test_swarm_contract as c; "
        "s = c.build(sys.argv[3]); print(c.digest(s, c.advance(s, 40)))"
    )
    command = [sys.executable, "-c", script, str(ROOT), str(Path(__file__).parent), name]
    environment = {**os.environ, "PYTHONHASHSEED": "77"}
    printed = subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout.strip()
    swarm = build(name)
    assert printed == digest(swarm, advance(swarm, 40))


@every_algorithm
def test_ask_repeats_itself_until_told(name):
    swarm = build(name)
    for _ in range(3):
        first = swarm.ask()
        kept = first.copy()
        first[:] = 9.0  # what the caller does to the answer is his own business
        assert np.array_equal(swarm.ask(), kept)
        swarm.tell(*evaluate(kept))
        assert not np.array_equal(swarm.ask(), kept)


@every_algorithm
def test_inputs_are_left_alone_and_not_kept(name):
    plain, meddled = build(name), build(name)
    for _ in range(10):
        plain.tell(*evaluate(plain.ask()))
        fitness, valid = evaluate(meddled.ask())
        copies = fitness.copy(), valid.copy()
        meddled.tell(fitness, valid)
        assert np.array_equal(fitness, copies[0])
        assert np.array_equal(valid, copies[1])
        fitness[:] = 0.0
        valid[:] = ~valid
        meddled.personal_best_positions[:] = 0.0
        meddled.best_position[:] = 0.0
        meddled.state()["velocities"][:] = 1.0
    assert np.array_equal(plain.ask(), meddled.ask())


@every_algorithm
def test_first_positions_are_the_sampled_ones(name):
    drawn = BOX.lower + 0.25 * BOX.width + np.zeros((N, 6))
    swarm = build(name, sample=lambda rng, count: drawn[:count])
    assert np.array_equal(swarm.ask(), drawn)
    swarm.tell(*evaluate(drawn))
    assert np.array_equal(swarm.personal_best_positions, drawn)


@every_algorithm
def test_default_start_fills_the_box(name):
    X = make_swarm(name, BOX, 4000, np.random.default_rng(0)).ask()
    free = BOX.width > 0
    share = (X - BOX.lower)[:, free] / BOX.width[free]
    assert np.allclose(share.mean(axis=0), 0.5, atol=0.03)
    assert np.allclose(share.std(axis=0), np.sqrt(1 / 12), atol=0.02)


@every_algorithm
@pytest.mark.parametrize("asked", [False, True])
def test_resumed_equals_uninterrupted(name, asked):
    whole, first = build(name), build(name)
    expected = advance(whole, 25)
    positions = advance(first, 11)
    if asked:
        first.ask()
    second = swarm_from_state(through_json(first.state()))
    assert type(second) is type(first)
    assert second.iteration == 11
    positions = np.concatenate([positions, advance(second, 14)])
    assert np.array_equal(positions, expected)
    for key, value in whole.state().items():
        assert np.array_equal(value, second.state()[key]), key


@every_algorithm
def test_a_state_taken_before_the_first_ask_resumes(name):
    resumed = swarm_from_state(through_json(build(name).state()))
    assert np.array_equal(advance(resumed, 8), advance(build(name), 8))


@every_algorithm
def test_taking_the_state_changes_nothing(name):
    watched, plain = build(name), build(name)
    for _ in range(10):
        watched.state()
        watched.tell(*evaluate(watched.ask()))
    advance(plain, 10)
    assert np.array_equal(watched.ask(), plain.ask())


@every_algorithm
def test_a_longer_run_begins_with_the_shorter_one(name):
    stopped = build(name)
    head = advance(stopped, 10)
    tail = advance(stopped, 10)
    assert np.array_equal(np.concatenate([head, tail]), advance(build(name), 20))


@every_algorithm
def test_state_is_arrays_and_plain_values(name):
    swarm = build(name)
    advance(swarm, 3)
    plain = {key: value for key, value in swarm.state().items() if not isinstance(value, np.ndarray)}
    assert json.loads(json.dumps(plain, allow_nan=False)) == plain
    assert all(value.dtype != object for value in swarm.state().values() if isinstance(value, np.ndarray))


@pytest.mark.parametrize("bits", GENERATORS)
def test_every_numpy_generator_resumes(bits):
    swarm, twin = (make_swarm("pso", BOX, N, np.random.Generator(getattr(np.random, bits)(3))) for _ in range(2))
    advance(swarm, 5)
    resumed = swarm_from_state(through_json(swarm.state()))
    advance(twin, 5)
    assert np.array_equal(advance(resumed, 30), advance(twin, 30))


@every_algorithm
def test_parameters_survive_the_state(name):
    swarm = build(name, w=0.5, c1=1.25)
    resumed = swarm_from_state(through_json(swarm.state()))
    assert resumed.parameters == swarm.parameters
    assert resumed.parameters["w"] == 0.5


@every_algorithm
def test_personal_best_gives_way_only_to_a_smaller_fitness(name):
    swarm = build(name)
    told = [np.arange(N, dtype=float), np.arange(N, dtype=float), np.arange(N) - np.where(np.arange(N) == 7, 9.0, 0.0)]
    asked = []
    for fitness in told:
        asked.append(swarm.ask())
        swarm.tell(fitness, np.ones(N, dtype=bool))
    others = np.arange(N) != 7
    assert np.array_equal(swarm.personal_best_positions[others], asked[0][others])
    assert np.array_equal(swarm.personal_best_positions[7], asked[2][7])
    assert np.array_equal(swarm.best_position, asked[2][7])
    assert swarm.best_fitness == -2.0


@every_algorithm
def test_the_lowest_index_wins_a_tie(name):
    swarm = build(name)
    X = swarm.ask()
    fitness = np.full(N, 3.0)
    fitness[[4, 9]] = 1.0
    swarm.tell(fitness, np.ones(N, dtype=bool))
    assert np.array_equal(swarm.best_position, X[4])


@every_algorithm
def test_without_a_finite_fitness_particle_0_leads(name):
    swarm = build(name)
    first = swarm.ask()
    for _ in range(5):
        swarm.ask()
        swarm.tell(np.full(N, np.inf), np.zeros(N, dtype=bool))
    assert np.array_equal(swarm.best_position, first[0])
    assert np.array_equal(swarm.personal_best_positions, first)
    assert swarm.best_fitness == np.inf
    assert np.all(np.isinf(swarm.history.best))
    assert np.all(np.isinf(swarm.history.mean))


@every_algorithm
def test_giving_up_at_the_personal_best_changes_nothing(name):
    full, pruned = build(name), build(name)
    for _ in range(40):
        full.tell(*evaluate(full.ask()))
        fitness, valid = evaluate(pruned.ask())
        pruned.tell(np.where(fitness >= pruned.personal_best_fitness, np.inf, fitness), valid)
    assert np.array_equal(full.ask(), pruned.ask())
    assert np.array_equal(full.history.best, pruned.history.best)


@every_algorithm
def test_history_counts_and_never_worsens(name):
    swarm = build(name)
    counts, means = [], []
    for _ in range(30):
        fitness, valid = evaluate(swarm.ask())
        swarm.tell(fitness, valid)
        counts.append(valid.sum())
        finite = swarm.personal_best_fitness[np.isfinite(swarm.personal_best_fitness)]
        means.append(finite.mean())
    history = swarm.history
    assert np.all(np.diff(history.best) <= 0)
    assert history.best[-1] == swarm.best_fitness
    assert np.array_equal(history.mean, means)
    assert np.array_equal(history.valid, counts)
    assert np.array_equal(history.evaluations, N * np.arange(1, 31))
    assert swarm.iteration == 30


@every_algorithm
def test_a_refused_tell_leaves_the_swarm_as_it_was(name):
    swarm, twin = build(name), build(name)
    for each in (swarm, twin):
        each.tell(*evaluate(each.ask()))
        each.ask()
    fitness = np.zeros(N)
    fitness[3] = np.nan
    with pytest.raises(SearchError, match="fitness of particle 3 is nan"):
        swarm.tell(fitness, np.ones(N, dtype=bool))
    with pytest.raises(SearchError, match="shape"):
        swarm.tell(np.zeros(N), np.ones(N - 1, dtype=bool))
    assert swarm.iteration == 1
    assert np.array_equal(advance(swarm, 5), advance(twin, 5))


@every_algorithm
def test_one_particle_in_one_dimension_is_enough(name):
    swarm = make_swarm(name, Box([0.0], [1.0], [False]), 1, np.random.default_rng(0))
    for _ in range(5):
        X = swarm.ask()
        swarm.tell(X[:, 0], np.array([True]))
    assert swarm.ask().shape == (1, 1)
