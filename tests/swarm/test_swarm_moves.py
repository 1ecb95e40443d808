"""The moves of PSO and RA-PSO against loops written from eq. 7 and eq. 8, and the laws that follow from them."""

from __future__ import annotations

import numpy as np
import pytest

from armdesign.errors import SettingsError
from armdesign.swarm import PSO, RAPSO, Box, SearchSpace

N = 9
BOX = Box([-1.5, 0.0, 0.2, -1.5, 0.0], [1.5, 0.5, 0.2, 1.5, 0.5], [True, False, False, True, False])


def make(kind, seed=4, box=BOX, sample=None, **parameters):
    sizes = {"particles": N, "iterations": 1000}
    return kind(SearchSpace(box, sample), np.random.default_rng(seed), kind.Parameters(**(sizes | parameters)))


def objective(X):
    return np.sum(np.abs(X - 0.3), axis=1)


def half_valid(X):
    return X[:, 1] < 0.25


def none_valid(X):
    return np.zeros(len(X), dtype=bool)


def all_valid(X):
    return np.ones(len(X), dtype=bool)


def positions_of(swarm, validity, iterations):
    positions = []
    for _ in range(iterations):
        X = swarm.ask()
        positions.append(X)
        swarm.tell(objective(X), validity(X))
    return np.array(positions)


def loop(seed, iterations, validity, *, w=0.8, c1=0.4, c2=0.6, c=None, interval=1, of_box=False):
    """Eq. 7, and with factors c also eq. 8, one particle, one entry and one draw at a time."""
    rng = np.random.default_rng(seed)
    D = BOX.dimension
    x = [[BOX.lower[k] + rng.random() * BOX.width[k] for k in range(D)] for _ in range(N)]
    v = [[0.0] * D for _ in range(N)]
    bp, r_bp, gb, r_gb = [list(row) for row in x], [np.inf] * N, None, np.inf
    positions = []
    for k in range(1, iterations + 1):
        positions.append([list(row) for row in x])
        r, inside = objective(np.array(x)), validity(np.array(x))
        for j in range(N):
            if r[j] < r_bp[j]:
                bp[j], r_bp[j] = list(x[j]), r[j]
            if r[j] < r_gb:
                gb, r_gb = list(x[j]), r[j]
        members = [j for j in range(N) if inside[j]]
        beta1 = [rng.random() for _ in range(N)]
        beta2 = [rng.random() for _ in range(N)]
        draws = {j: [c[0] + (c[1] - c[0]) * rng.random() for _ in range(D)] for j in members} if c else {}
        spread = [np.ptp([x[j][i] for j in members]) if members else None for i in range(D)]
        reach = BOX.width if of_box else spread
        for j in range(N):
            for i in range(D):
                if BOX.angular[i] and k % interval != 0:
                    continue
                if j in draws:
                    v[j][i] = v[j][i] + draws[j][i] * reach[i]
                else:
                    pull = beta1[j] * c1 * (bp[j][i] - x[j][i]) + beta2[j] * c2 * (gb[i] - x[j][i])
                    v[j][i] = w * v[j][i] + pull
                x[j][i] = min(max(x[j][i] + v[j][i], BOX.lower[i]), BOX.upper[i])
    return np.array(positions)


@pytest.mark.parametrize("validity", [none_valid, half_valid, all_valid])
def test_pso_is_eq_7(validity):
    swarm = make(PSO)
    assert np.allclose(positions_of(swarm, validity, 40), loop(4, 40, validity), rtol=0, atol=1e-9)


def test_pso_is_eq_7_with_other_factors():
    swarm = make(PSO, 8, inertia=0.3, c1=1.7, c2=0.9)
    expected = loop(8, 40, half_valid, w=0.3, c1=1.7, c2=0.9)
    assert np.allclose(positions_of(swarm, half_valid, 40), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("validity", [none_valid, half_valid, all_valid])
@pytest.mark.parametrize("interval", [1, 2, 3])
@pytest.mark.parametrize("range_of", ["valid", "box"])
def test_rapso_is_eq_8(validity, interval, range_of):
    swarm = make(RAPSO, range=range_of, angle_interval=interval, c_range=(-0.4, 0.2))
    expected = loop(4, 30, validity, c=(-0.4, 0.2), interval=interval, of_box=range_of == "box")
    assert np.allclose(positions_of(swarm, validity, 30), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("range_of", ["valid", "box"])
def test_rapso_is_pso_when_all_are_invalid(range_of):
    pso = make(PSO)
    rapso = make(RAPSO, angle_interval=1, range=range_of)
    assert np.array_equal(positions_of(pso, none_valid, 50), positions_of(rapso, none_valid, 50))
    assert pso.state()["generator"] == rapso.state()["generator"]


def test_rapso_is_not_pso_once_one_is_valid():
    pso = make(PSO)
    rapso = make(RAPSO, angle_interval=1)
    assert not np.array_equal(positions_of(pso, half_valid, 5), positions_of(rapso, half_valid, 5))


@pytest.mark.parametrize("validity", [none_valid, half_valid, all_valid])
@pytest.mark.parametrize("interval", [2, 3, 5])
def test_angles_move_in_every_dth_iteration_only(validity, interval):
    swarm = make(RAPSO, seed=1, angle_interval=interval)
    for k in range(1, 21):
        X = swarm.ask()
        swarm.tell(objective(X), validity(X))
        before = swarm.state()
        swarm.ask()
        after = swarm.state()
        same_x = np.array_equal(after["positions"][:, BOX.angular], before["positions"][:, BOX.angular])
        same_v = np.array_equal(after["velocities"][:, BOX.angular], before["velocities"][:, BOX.angular])
        assert same_x == same_v == (k % interval != 0)
        assert not np.array_equal(after["positions"][:, ~BOX.angular], before["positions"][:, ~BOX.angular])


@pytest.mark.parametrize("range_of", ["valid", "box"])
def test_valid_steps_are_bounded_by_the_range(range_of):
    swarm = make(RAPSO, range=range_of, angle_interval=1, c_range=(-0.25, 0.5))
    X = swarm.ask()
    swarm.tell(objective(X), half_valid(X))
    swarm.ask()
    step = swarm.state()["velocities"][half_valid(X)]  # the first, from rest
    reach = BOX.width if range_of == "box" else np.ptp(X[half_valid(X)], axis=0)
    assert np.all(step >= -0.25 * reach)
    assert np.all(step <= 0.5 * reach)


def test_the_only_valid_particle_keeps_its_velocity():
    swarm = make(RAPSO, angle_interval=1)
    X = swarm.ask()
    swarm.tell(objective(X), np.arange(N) == 5)
    moved = swarm.ask()
    assert np.array_equal(moved[5], X[5])
    assert not np.array_equal(moved[4], X[4])


def test_validity_of_the_last_tell_decides():
    """Particles that were valid before, but are so no longer, move by eq. 7 again."""
    pso, rapso = make(PSO), make(RAPSO, angle_interval=1)
    positions_of(rapso, half_valid, 3)
    positions_of(rapso, none_valid, 1)
    positions_of(pso, none_valid, 1)
    state = rapso.state()
    parameters = {"parameters": pso.state()["parameters"], "algorithm": "pso"}
    twin = PSO.from_state(state | parameters, SearchSpace(BOX))
    assert np.array_equal(rapso.ask(), twin.ask())


def test_positions_are_clipped_and_velocities_kept():
    swarm = make(PSO, inertia=1.0, c1=4.0, c2=4.0)
    kept = False
    for _ in range(20):
        X = swarm.ask()
        swarm.tell(objective(X), none_valid(X))
        before = swarm.state()["positions"]
        swarm.ask()
        state = swarm.state()
        unclipped = before + state["velocities"]
        assert np.array_equal(state["positions"], np.clip(unclipped, BOX.lower, BOX.upper))
        kept |= bool(np.any(unclipped != state["positions"]))
    assert kept


def test_pull_has_one_factor_per_particle():
    """With the global best alone attracting, a particle moves along the line to it, by less than c2 of the way."""
    swarm = make(PSO, c1=0.0, c2=1.0)
    X = swarm.ask()
    swarm.tell(objective(X), none_valid(X))
    way, step = (swarm.best_position - X)[:, BOX.width > 0.0], (swarm.ask() - X)[:, BOX.width > 0.0]
    others = np.flatnonzero(np.any(way != 0.0, axis=1))
    share = step[others] / way[others]
    assert np.allclose(share, share[:, :1])
    assert np.all((share >= 0.0) & (share < 1.0))
    assert len(np.unique(share[:, 0].round(9))) == len(others) == N - 1


def test_wandering_draws_for_every_entry():
    """Of 5000 valid particles at rest, the velocities are uniform in c_min..c_max times the range, and uncorrelated."""
    swarm = make(RAPSO, particles=5000, angle_interval=1)
    X = swarm.ask()
    swarm.tell(objective(X), all_valid(X))
    swarm.ask()
    V, reach = swarm.state()["velocities"], np.ptp(X, axis=0)
    assert np.allclose(V.mean(axis=0), 0.0, atol=0.03 * reach)
    assert np.allclose(V.std(axis=0), reach / np.sqrt(12.0), rtol=0.03)
    assert abs(np.corrcoef(V[:, 0], V[:, 1])[0, 1]) < 0.05
    assert np.all(V[:, 2] == 0.0)


@pytest.mark.parametrize("kind", [PSO, RAPSO])
def test_personal_bests_give_way_only_to_a_smaller_fitness_and_the_lowest_index_wins_a_tie(kind):
    swarm, ranks, asked = make(kind), np.arange(N, dtype=float), []
    for fitness in (np.full(N, np.inf), np.maximum(ranks, 4.0), ranks + 4.0, np.where(ranks == 7.0, 4.0, ranks + 9.0)):
        asked.append(swarm.ask())
        swarm.tell(fitness, np.ones(N, dtype=bool))
        if len(asked) == 1:
            assert np.array_equal(swarm.best_position, asked[0][0])  # without a finite fitness particle 0 leads
    bests = swarm.state()["personal_best_positions"]
    assert np.array_equal(bests[:7], asked[1][:7])
    assert np.array_equal(bests[7], asked[3][7])
    assert np.array_equal(bests[8:], asked[1][8:])
    assert np.array_equal(swarm.best_position, asked[1][0])
    assert swarm.best_fitness == 4.0
    assert np.array_equal(swarm.history.mean[1:3], np.full(2, np.maximum(ranks, 4.0).mean()))


@pytest.mark.parametrize(
    ("kind", "parameters", "words"),
    [
        (PSO, {"inertia": -0.1}, r"'inertia' is -0\.1; allowed: a finite number in \[0, 1\]"),
        (PSO, {"inertia": True}, "'inertia'"),
        (PSO, {"c1": np.nan}, "'c1' is nan"),
        (PSO, {"c2": "0.6"}, "'c2' is '0.6'"),
        (PSO, {"particles": 0}, "'particles' is 0"),
        (RAPSO, {"c_range": (0.6, 0.5)}, r"c_min = 0\.6 above c_max = 0\.5"),
        (RAPSO, {"c_range": (0.0, np.inf)}, "'c_range'"),
        (RAPSO, {"angle_interval": 0}, "'angle_interval' is 0; allowed: a whole number >= 1"),
        (RAPSO, {"range": "all"}, "'range' is 'all'; allowed: valid, box"),
    ],
)
def test_a_parameter_out_of_range_is_named(kind, parameters, words):
    with pytest.raises(SettingsError, match=words):
        kind.Parameters(**parameters)


@pytest.mark.parametrize("seed", range(5))
def test_pso_finds_the_bottom_of_a_sphere(seed):
    swarm = make(PSO, seed, Box([-2.0] * 5, [3.0] * 5, [False] * 5), particles=40)
    for _ in range(200):
        X = swarm.ask()
        swarm.tell(np.sum((X - 0.7) ** 2, axis=1), all_valid(X))
    assert swarm.best_fitness < 1e-3
    assert np.allclose(swarm.best_position, 0.7, atol=0.05)


def test_pso_finds_a_bottom_on_the_wall():
    swarm = make(PSO, 0, Box([0.0, 0.0], [1.0, 1.0], [False, False]), particles=30)
    for _ in range(100):
        X = swarm.ask()
        swarm.tell(np.sum((X + 1.0) ** 2, axis=1), all_valid(X))
    assert np.array_equal(swarm.best_position, [0.0, 0.0])
