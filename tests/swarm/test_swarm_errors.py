"""What the swarms refuse, and what they say then."""

from __future__ import annotations

import numpy as np
import pytest

from armdesign.errors import ArmDesignError, SearchError, SettingsError
from armdesign.swarm import ALGORITHMS, PSO, RAPSO, Box, make_swarm, swarm_from_state

BOX = Box([0.0, -1.0], [1.0, 1.0], [False, True])


def build(name="rapso", particles=4, box=BOX, **parameters):
    return make_swarm(name, box, particles, np.random.default_rng(0), **parameters)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (([0, 2], [1, 1], [False, False]), "entry 1 has lower bound 2 above upper bound 1"),
        (([0, np.nan], [1, 1], [False, False]), "entry 1 has 'lower' bound nan"),
        (([0, 0], [1, np.inf], [False, False]), "entry 1 has 'upper' bound inf"),
        (([0, 0], [1], [False, False]), "2, 1 and 2 entries"),
        (([0], [1], [1]), "'angular' does not hold flags"),
        (([0], [1], [[True], [False, True]]), "'angular' does not hold flags"),
        (([], [], []), "shape"),
        (([[0]], [1], [False]), "shape"),
        ((["low"], [1], [False]), "'lower' does not hold numbers"),
    ],
)
def test_box_names_the_bad_entry(columns, words):
    with pytest.raises(SettingsError, match=words):
        Box(*columns)


@pytest.mark.parametrize("name", ["cma", "PSO", "", None, 3, ["pso"]])
def test_an_unknown_algorithm_lists_the_known_ones(name):
    with pytest.raises(SettingsError) as caught:
        build(name)
    assert all(known in str(caught.value) for known in ALGORITHMS)
    assert repr(name) in str(caught.value)


def test_an_unknown_setting_lists_the_known_ones():
    with pytest.raises(SettingsError, match="'pso' has no setting 'inertia'; allowed: w, c1, c2"):
        build("pso", inertia=0.5)
    with pytest.raises(SettingsError, match="'pso' has no setting 'angle_interval'"):
        build("pso", angle_interval=2)


@pytest.mark.parametrize(
    ("name", "parameters", "words"),
    [
        ("pso", {"w": -0.1}, r"'w' is -0\.1; allowed: a finite number in \[0, 1\]"),
        ("pso", {"w": 1.5}, "'w'"),
        ("pso", {"c1": np.nan}, "'c1' is nan"),
        ("pso", {"c2": "0.6"}, "'c2' is '0.6', not a number"),
        ("pso", {"w": True}, "not a number"),
        ("rapso", {"c_min": 0.6}, r"'c_min' is 0\.6, above 'c_max' = 0\.5"),
        ("rapso", {"c_max": np.inf}, "'c_max'"),
        ("rapso", {"angle_interval": 0}, "'angle_interval' is 0; allowed: a whole number >= 1"),
        ("rapso", {"angle_interval": 1.5}, "'angle_interval'"),
        ("rapso", {"range_of": "all"}, "'range_of' is 'all'; allowed: valid, box"),
        ("rapso", {"particles": 0}, "'particles' is 0"),
        ("rapso", {"particles": 2.5}, "'particles'"),
    ],
)
def test_a_setting_out_of_range_is_named(name, parameters, words):
    with pytest.raises(SettingsError, match=words):
        build(name, **parameters)


def test_a_seed_is_no_generator():
    with pytest.raises(SettingsError, match="default_rng"):
        PSO(BOX, 4, 7)


@pytest.mark.parametrize(
    ("drawn", "words"),
    [
        (np.zeros((3, 2)), r"\(3, 2\)"),
        (np.array([[0.5, 0], [0.5, 0], [0.5, 7], [0.5, 0]]), r"particle 2 has entry 1 = 7; allowed: \[-1, 1\]"),
        (np.full((4, 2), np.nan), "particle 0 has entry 0 = nan"),
        ([[0.5], [1, 2]], "should be numbers"),
    ],
)
def test_initial_positions_must_lie_in_the_box(drawn, words):
    with pytest.raises(SearchError, match=words):
        build(sample=lambda rng, count: drawn)


def test_rounding_at_a_bound_is_forgiven():
    swarm = build(sample=lambda rng, count: np.full((count, 2), np.nextafter(1.0, 2.0)))
    assert np.all(swarm.ask() == 1.0)


def test_tell_needs_an_ask():
    swarm = build()
    told = np.zeros(4), np.ones(4, dtype=bool)
    with pytest.raises(SearchError, match="did not ask"):
        swarm.tell(*told)
    swarm.ask()
    swarm.tell(*told)
    with pytest.raises(SearchError, match=r"Call ask\(\)"):
        swarm.tell(*told)


@pytest.mark.parametrize(
    ("fitness", "valid", "words"),
    [
        ([0, 1, np.nan, 3], [True] * 4, "particle 2 is nan"),
        ([0, -np.inf, 2, 3], [True] * 4, "particle 1 is -inf"),
        ([0, 1, 2], [True] * 4, "fitness"),
        ([[0, 1, 2, 3]], [True] * 4, "fitness"),
        ([0, 1, 2, "bad"], [True] * 4, "should be numbers"),
        ([0, 1, 2, 3], [True] * 3, "validity"),
        ([0, 1, 2, 3], [1.0] * 4, "number 0 is 1.0"),
        ([0, 1, 2, 3], None, "validity"),
    ],
)
def test_tell_refuses_what_is_no_fitness_or_validity(fitness, valid, words):
    swarm = build()
    swarm.ask()
    with pytest.raises(SearchError, match=words):
        swarm.tell(fitness, valid)


def test_a_state_belongs_to_its_algorithm():
    state = build("pso").state()
    with pytest.raises(SearchError, match="used 'pso', not 'rapso'"):
        RAPSO.from_state(state)
    with pytest.raises(SettingsError, match="no swarm algorithm 'gone'"):
        swarm_from_state({**state, "algorithm": "gone"})


@pytest.mark.parametrize("key", sorted(build().state()))
def test_a_missing_entry_of_the_state_is_named(key):
    state = build().state()
    del state[key]
    with pytest.raises(SearchError, match=f"no entry '{key}'"):
        swarm_from_state(state)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("velocities", np.zeros((3, 2))),
        ("velocities", np.full((4, 2), np.inf)),
        ("positions", np.full((4, 2), 9.0)),
        ("positions", "nothing"),
        ("positions", [[0.0], [0.0, 0.0]]),
        ("positions", np.zeros((0, 2))),
        ("valid", [0, 1, 0, 1]),
        ("personal_best_fitness", [0.0, np.nan, 0.0, 0.0]),
        ("history_mean", [1.0]),
        ("parameters", [0.8, 0.4, 0.6]),
        ("parameters", {"inertia": 1.0}),
        ("generator", "no JSON"),
        ("generator", '{"bit_generator": "PCG64", "state": {}}'),
        ("generator", '{"bit_generator": "default_rng"}'),
        ("generator", "[]"),
        ("lower", [2.0, 2.0]),
    ],
)
def test_a_damaged_state_is_refused(key, value):
    with pytest.raises(ArmDesignError):
        swarm_from_state({**build().state(), key: value})
