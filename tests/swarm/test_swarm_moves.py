"""The moves of PSO and RA-PSO against loops written from eq. 7 and eq. 8, and the laws that follow from them."""

from __future__ import annotations

import numpy as np
import pytest

from armdesign.swarm import PSO, RAPSO, Box
from armdesign.swarm.operators import attract, extent, wander

N = 9
BOX = Box([-1.5, 0.0, 0.2, -1.5, 0.0], [1.5, 0.5, 0.2, 1.5, 0.5], [True, False, False, True, False])


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
    swarm = PSO(BOX, N, np.random.default_rng(4))
    assert np.allclose(positions_of(swarm, validity, 40), loop(4, 40, validity), rtol=0, atol=1e-9)


def test_pso_is_eq_7_with_other_factors():
    factors = {"w": 0.3, "c1": 1.7, "c2": 0.9}
    swarm = PSO(BOX, N, np.random.default_rng(8), **factors)
    assert np.allclose(positions_of(swarm, half_valid, 40), loop(8, 40, half_valid, **factors), rtol=0, atol=1e-9)


@pytest.mark.parametrize("validity", [none_valid, half_valid, all_valid])
@pytest.mark.parametrize("interval", [1, 2, 3])
@pytest.mark.parametrize("range_of", ["valid", "box"])
def test_rapso_is_eq_8(validity, interval, range_of):
    swarm = RAPSO(BOX, N, np.random.default_rng(4), range_of=range_of, angle_interval=interval, c_min=-0.4, c_max=0.2)
    expected = loop(4, 30, validity, c=(-0.4, 0.2), interval=interval, of_box=range_of == "box")
    assert np.allclose(positions_of(swarm, validity, 30), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("range_of", ["valid", "box"])
def test_rapso_is_pso_when_all_are_invalid(range_of):
    pso = PSO(BOX, N, np.random.default_rng(2))
    rapso = RAPSO(BOX, N, np.random.default_rng(2), angle_interval=1, range_of=range_of)
    assert np.array_equal(positions_of(pso, none_valid, 50), positions_of(rapso, none_valid, 50))
    assert pso.state()["generator"] == rapso.state()["generator"]


def test_rapso_is_not_pso_once_one_is_valid():
    pso = PSO(BOX, N, np.random.default_rng(2))
    rapso = RAPSO(BOX, N, np.random.default_rng(2), angle_interval=1)
    assert not np.array_equal(positions_of(pso, half_valid, 5), positions_of(rapso, half_valid, 5))


@pytest.mark.parametrize("validity", [none_valid, half_valid, all_valid])
@pytest.mark.parametrize("interval", [2, 3, 5])
def test_angles_move_in_every_dth_iteration_only(validity, interval):
    swarm = RAPSO(BOX, N, np.random.default_rng(1), angle_interval=interval)
    before = None
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


def test_the_published_interval_is_two():
    assert RAPSO(BOX, N, np.random.default_rng(1)).parameters == {
        "w": 0.8,
        "c1": 0.4,
        "c2": 0.6,
        "c_min": -0.5,
        "c_max": 0.5,
        "range_of": "valid",
        "angle_interval": 2,
    }


@pytest.mark.parametrize("range_of", ["valid", "box"])
def test_valid_steps_are_bounded_by_the_range(range_of):
    swarm = RAPSO(BOX, N, np.random.default_rng(3), range_of=range_of, angle_interval=1, c_min=-0.25, c_max=0.5)
    X = swarm.ask()
    swarm.tell(objective(X), half_valid(X))
    swarm.ask()
    step = swarm.state()["velocities"][half_valid(X)]  # the first, from rest
    reach = BOX.width if range_of == "box" else np.ptp(X[half_valid(X)], axis=0)
    assert np.all(step >= -0.25 * reach)
    assert np.all(step <= 0.5 * reach)


def test_the_only_valid_particle_keeps_its_velocity():
    swarm = RAPSO(BOX, N, np.random.default_rng(3), angle_interval=1)
    X = swarm.ask()
    swarm.tell(objective(X), np.arange(N) == 5)
    moved = swarm.ask()
    assert np.array_equal(moved[5], X[5])
    assert not np.array_equal(moved[4], X[4])


def test_validity_of_the_last_tell_decides():
    """A particle that was valid before, but no longer is, moves by eq. 7 again."""
    rapso = RAPSO(BOX, N, np.random.default_rng(6), angle_interval=1)
    positions_of(rapso, half_valid, 3)
    state, twin = rapso.state(), np.random.default_rng(0)
    X = rapso.ask()
    rapso.tell(objective(X), none_valid(X))
    state = rapso.state()
    twin.bit_generator.state = rapso._rng.bit_generator.state
    expected = attract(
        twin, X, state["velocities"], rapso.personal_best_positions, rapso.best_position, w=0.8, c1=0.4, c2=0.6
    )
    assert np.array_equal(rapso.ask(), BOX.clip(X + expected))


def test_positions_are_clipped_and_velocities_kept():
    swarm = PSO(BOX, N, np.random.default_rng(3), w=1.0, c1=4.0, c2=4.0)
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
    """With no inertia and one attractor, a particle moves along the line to it."""
    X = np.random.default_rng(0).normal(size=(6, 4))
    V = attract(np.random.default_rng(1), X, np.ones_like(X), X, np.zeros(4), w=0.0, c1=1.0, c2=1.0)
    share = -V / X
    assert np.allclose(share, share[:, :1])
    assert np.all((share >= 0) & (share < 1))
    assert len(np.unique(share[:, 0].round(9))) == 6


def test_wandering_draws_for_every_entry():
    V = wander(np.random.default_rng(0), np.zeros((5000, 3)), np.array([1.0, 2.0, 0.0]), -0.5, 0.5)
    assert np.allclose(V[:, :2].mean(axis=0), 0.0, atol=0.03)
    assert np.allclose(V[:, :2].std(axis=0), np.array([1.0, 2.0]) / np.sqrt(12), rtol=0.03)
    assert abs(np.corrcoef(V[:, 0], V[:, 1])[0, 1]) < 0.05
    assert np.all(V[:, 2] == 0.0)


def test_extent_looks_at_the_chosen_only():
    X = np.array([[0.0, 5.0], [1.0, 9.0], [7.0, 2.0]])
    assert np.array_equal(extent(X, np.array([True, True, False])), [1.0, 4.0])
    assert np.array_equal(extent(X, np.array([False, False, True])), [0.0, 0.0])


@pytest.mark.parametrize("seed", range(5))
def test_pso_finds_the_bottom_of_a_sphere(seed):
    box = Box([-2.0] * 5, [3.0] * 5, [False] * 5)
    swarm = PSO(box, 40, np.random.default_rng(seed))
    for _ in range(200):
        X = swarm.ask()
        swarm.tell(np.sum((X - 0.7) ** 2, axis=1), np.ones(40, dtype=bool))
    assert swarm.best_fitness < 1e-3
    assert np.allclose(swarm.best_position, 0.7, atol=0.05)
    assert swarm.best_fitness == np.sum((swarm.best_position - 0.7) ** 2)


def test_pso_finds_a_bottom_on_the_wall():
    box = Box([0.0, 0.0], [1.0, 1.0], [False, False])
    swarm = PSO(box, 30, np.random.default_rng(0))
    for _ in range(100):
        X = swarm.ask()
        swarm.tell(np.sum((X + 1.0) ** 2, axis=1), np.ones(30, dtype=bool))
    assert np.array_equal(swarm.best_position, [0.0, 0.0])
