"""The parts a descent is made of: projection, steps, curvature, descents, evolution."""

from __future__ import annotations

import numpy as np
import pytest

from armdesign.errors import SettingsError
from armdesign.swarm import Box, SearchSpace, Slab
from armdesign.swarm import descents as descents_module
from armdesign.swarm.checks import SavedState
from armdesign.swarm.descents import (
    Descents,
    Models,
    Patience,
    active_set_steps,
    best_steps,
    projected_steps,
    updated,
)
from armdesign.swarm.evolution import Evolution
from armdesign.swarm.space import Region, project

K = 5
PATIENT = Patience(halve_at=1000, window=1000, rounds=200)


def region(low=-1.0, high=1.5):
    weights = np.array([0.0, 1.0, 0.5, 0.0, 1.0])
    return Region(
        SearchSpace(Box(np.zeros(K), np.ones(K), [True, False, False, True, False]), slab=Slab(weights, low, high))
    )


def bowl(rng):
    """A convex quadratic: its curvature and its unconstrained minimum."""
    A = rng.normal(size=(K, K))
    return A @ A.T + 0.3 * np.eye(K), rng.random(K)


def best_feasible(H, centre, space, starts=4):
    """The constrained minimum by SciPy."""
    optimize = pytest.importorskip("scipy.optimize")
    slab = [
        {"type": "ineq", "fun": lambda u: space.high - space.weights @ u},
        {"type": "ineq", "fun": lambda u: space.weights @ u - space.low},
    ]
    found = [
        optimize.minimize(
            lambda u: 0.5 * (u - centre) @ H @ (u - centre),
            np.full(K, start),
            jac=lambda u: H @ (u - centre),
            bounds=[(0.0, 1.0)] * K,
            constraints=slab,
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 500},
        )
        for start in np.linspace(0.1, 0.4, starts)
    ]
    return min(found, key=lambda each: each.fun)


def test_projection_is_the_nearest_point():
    rng, space = np.random.default_rng(0), region(low=0.4)
    V = rng.normal(0.5, 1.0, (200, K))
    zero, one = np.zeros_like(V), np.ones_like(V)
    P = project(V, zero, one, space.weights, np.full(200, space.low), np.full(200, space.high))
    total = P @ space.weights
    assert np.all((P >= 0.0) & (P <= 1.0))
    assert np.all((total >= space.low - 1e-9) & (total <= space.high + 1e-9))
    others = space.pulled_in(rng.random((500, K)), 0.0)
    for v, p in zip(V, P, strict=True):  # the angle to every other feasible point is obtuse
        assert np.all((others - p) @ (v - p) <= 1e-8)


def test_step_minimises_the_model_in_box_slab_and_reach():
    rng, space = np.random.default_rng(1), region()
    U = space.pulled_in(rng.random((20, K)), 0.01)
    for u in U:
        H, centre = bowl(rng)
        gradient = H @ (u - centre)
        step = best_steps(space, u[None], gradient[None], H[None], np.array([0.2]), 0.0)[0]
        assert np.abs(step).max() <= 0.2 + 1e-12
        model = gradient @ step + 0.5 * step @ H @ step
        for _ in range(200):
            other = np.clip(u + rng.uniform(-0.2, 0.2, K), 0.0, 1.0)
            if space.low <= space.weights @ other <= space.high:
                move = other - u
                assert model <= gradient @ move + 0.5 * move @ H @ move + 1e-9


def models(rng, count, *, stiff):
    """Models of every kind: at the bounds or not, the slab met or not, curvatures from round to flat."""
    width = rng.uniform(0.01, 0.3, (count, 1))
    U = rng.random((count, K)) * (rng.random((count, K)) < 0.8)
    turn = np.linalg.qr(rng.normal(size=(count, K, K)))[0]
    curvature = 10.0 ** rng.uniform(-stiff, 0.0, (count, K))
    weights = rng.random(K) * (rng.random(K) < 0.7)
    total = U @ weights
    return Models(
        rng.normal(size=(count, K)) * 10.0 ** rng.uniform(-3.0, 1.0, (count, 1)),
        np.einsum("nij,nj,nkj->nik", turn, curvature, turn),
        np.maximum(-U, -width), np.minimum(1.0 - U, width),
        -rng.uniform(0.0, 0.2, count), rng.uniform(0.0, 0.2, count) + 0.0 * total,
    ), weights  # fmt: skip


def value(model, P):
    return np.sum(model.gradient * P, axis=1) + 0.5 * np.einsum("ni,nij,nj->n", P, model.B, P)


@pytest.mark.parametrize("stiff", [0.0, 1.0, 4.0])
def test_active_sets_give_the_minimum_that_gradients_creep_to(stiff, monkeypatch):
    model, weights = models(np.random.default_rng(5), 300, stiff=stiff)
    steps, settled = active_set_steps(model, weights)
    assert settled.mean() > 0.95
    assert (steps >= model.lower).all()
    assert (steps <= model.upper).all()
    total = steps @ weights
    assert (total[settled] <= model.high[settled] + 1e-9).all()
    assert (total[settled] >= model.low[settled] - 1e-9).all()
    monkeypatch.setattr(descents_module, "ROUNDS", 3000)
    crept = projected_steps(model, weights)
    assert (value(model, steps) <= value(model, crept) + 1e-8)[settled].all()


def test_a_box_beside_the_slab_is_left_to_the_projection():
    model, weights = models(np.random.default_rng(6), 20, stiff=1.0)
    beside = model._replace(low=model.high + 100.0, high=model.high + 101.0)
    _, settled = active_set_steps(beside, weights)
    assert not settled.any()


def test_a_model_without_curvature_along_a_wall_is_left_to_the_projection():
    model, weights = models(np.random.default_rng(7), 20, stiff=1.0)
    wide = model._replace(lower=model.lower - 1.0, upper=model.upper + 1.0)  # nothing is held
    wall = np.outer(np.arange(1.0, K + 1), np.arange(1.0, K + 1))  # of rank one
    B = np.where(np.arange(20)[:, None, None] == 3, wall, wide.B)
    steps, settled = active_set_steps(wide._replace(B=B), weights)
    others = np.arange(20) != 3
    alone, found = active_set_steps(wide.part(np.flatnonzero(others)), weights)
    assert not settled[3]
    assert np.array_equal(settled[others], found)
    np.testing.assert_allclose(steps[others], alone, atol=1e-12)


def test_curvature_meets_the_last_change_and_stays_definite():
    rng = np.random.default_rng(2)
    H, _ = bowl(rng)
    B = np.eye(K)
    for k in range(3 * K):
        step = rng.normal(size=K)
        B = updated(B, step, H @ step, first=k == 0)
        assert np.linalg.eigvalsh(B)[0] > 0.0
    assert np.allclose(B @ step, H @ step)
    bent = updated(B, step, -step, first=False)  # a change that no convex function makes
    assert np.linalg.eigvalsh(bent)[0] > 0.0


def begun(space, objective, U, patience=PATIENT, **options):
    """Descents at places U, without hints."""
    return Descents(space, U, objective(U), np.zeros((len(U), 0)), patience, **options)


def descend(space, objective, U, gradient=None):
    """Descents to their end, with gradients or probes."""
    descents = begun(space, objective, U, sloped=gradient is not None)
    while descents.live.any():
        asked, hints = descents.ask()
        descents.tell(asked, objective(asked), hints, None if gradient is None else gradient(asked))
    return descents


def test_descents_end_at_the_constrained_minimum():
    rng = np.random.default_rng(3)
    for low, high in ((-1.0, 1.5), (-1.0, 0.3), (1.2, 3.0)):
        space = region(low, high)
        H, centre = bowl(rng)

        def objective(U, H=H, centre=centre):
            return 0.5 * np.einsum("ij,jk,ik->i", U - centre, H, U - centre)

        descents = descend(space, objective, space.pulled_in(rng.random((6, K)), 0.05))
        exact = best_feasible(H, centre, space)
        assert np.all(descents.value <= exact.fun + 2e-3 * max(exact.fun, 0.1))
        assert np.all(descents.U @ space.weights <= high)
        assert np.all(descents.U @ space.weights >= low)


def along_a_kink(starts, *, learn: bool):
    """Where descents end on the curved floor of a sharp valley, with or without the gradients of failed steps."""
    space = Region(SearchSpace(Box(np.zeros(2), np.ones(2), np.zeros(2, dtype=bool))))

    def objective(U):
        return 2.0 * np.abs(U[:, 1] - 0.3 - 0.5 * U[:, 0] ** 2) + 0.5 * (1.0 - U[:, 0])

    def gradient(U):
        side = np.sign(U[:, 1] - 0.3 - 0.5 * U[:, 0] ** 2)
        return np.stack([-2.0 * side * U[:, 0] - 0.5, 2.0 * side], axis=1)

    descents = begun(space, objective, starts, sloped=True)
    while descents.live.any():
        asked, hints = descents.ask()
        values, slopes = objective(asked), gradient(asked)
        failed = (values >= descents.value[descents.live]) & (descents.phase == "step")
        descents.tell(asked, values, hints, slopes if learn else np.where(failed[:, None], np.nan, slopes))
    return descents.value


def test_failed_steps_lead_along_a_kink():
    starts = [0.05, 0.35] + [0.2, 0.5] * np.random.default_rng(0).random((48, 2))
    stuck = [np.count_nonzero(along_a_kink(starts, learn=learn) > 0.1) for learn in (True, False)]
    assert 2 * stuck[0] < stuck[1], stuck


def test_probes_never_leave_box_and_slab():
    rng, space = np.random.default_rng(4), region(0.5, 0.9)
    seen = []

    def objective(U):
        seen.append(U.copy())
        return U @ np.array([1.0, -2.0, 0.5, -1.0, 0.3])

    descend(space, objective, space.pulled_in(rng.random((5, K)), 0.01))
    U = np.vstack(seen[1:])
    total = U @ space.weights
    assert np.all((U >= 0.0) & (U <= 1.0) & (total > 0.5)[:, None] & (total < 0.9)[:, None])


def test_descents_do_not_depend_on_their_neighbours():
    rng, space = np.random.default_rng(5), region()
    H, centre = bowl(rng)

    def objective(U):
        return 0.5 * np.einsum("ij,jk,ik->i", U - centre, H, U - centre) + 0.01 * np.sin(20 * U).sum(axis=1)

    U = space.pulled_in(rng.random((4, K)), 0.05)
    together = descend(space, objective, U)
    for k in range(4):
        alone = descend(space, objective, U[k : k + 1])
        assert np.allclose(alone.U[0], together.U[k], atol=1e-6)


def test_a_probe_without_value_is_taken_from_the_other_side():
    space = region()

    def objective(U):
        return np.where(U[:, 0] > 0.4, np.inf, (U[:, 0] - 0.1) ** 2 + U[:, 1])

    descents = begun(space, objective, np.array([[0.4, 0.2, 0.2, 0.5, 0.2]]))
    first, hints = descents.ask()
    assert np.allclose(first - descents.U, 3e-4 * np.eye(K))  # forward in every entry
    descents.tell(first, objective(first), hints)
    again, hints = descents.ask()
    assert np.allclose(again - descents.U, [[-3e-4, 0.0, 0.0, 0.0, 0.0]])  # backward where there was no value
    descents.tell(again, objective(again), hints)
    assert descents.gradient[0] == pytest.approx([0.6, 1.0, 0.0, 0.0, 0.0], abs=1e-3)


@pytest.mark.parametrize("slopes", [True, False])
def test_descents_go_on_from_their_state(slopes):
    """Every phase of descents with kinks, jumps and walls, put down and taken up after each answer."""
    space, rng = region(), np.random.default_rng(9)

    def objective(U):
        return np.where(U[:, 0] > 0.7, np.inf, np.abs(U - 0.5).sum(axis=1) + (U[:, 1] - 0.2) ** 2)

    def gradient(U):
        return np.sign(U - 0.5) + 2.0 * (U - 0.2) * (np.arange(K) == 1)

    U = space.pulled_in(rng.random((5, K)) * [0.69, 1.0, 1.0, 1.0, 1.0], 0.01)
    U[0, 0] = 0.6999  # just before the jump
    whole, parts = (begun(space, objective, U, Patience(), sloped=slopes) for _ in range(2))
    phases = set()
    while whole.live.any():
        phases.add(whole.phase)
        parts = Descents.from_state(SavedState(parts.state()), space, sloped=parts.sloped)
        for each in (whole, parts):
            asked, hints = each.ask()
            each.tell(asked, objective(asked), hints, gradient(asked) if slopes else None)
        assert np.array_equal(whole.U, parts.U)
        assert np.array_equal(whole.B, parts.B)
    assert phases == ({"slope", "step"} if slopes else {"probe", "retry", "step"})


@pytest.mark.parametrize("corner", [False, True])
def test_evolution_finds_a_kinked_minimum(corner):
    rng = np.random.default_rng(6)
    centre = np.where(np.arange(K) % 2 == 0, 0.0, 0.7) if corner else np.full(K, 0.6)
    weights = np.array([1.0, 30.0, 1.0, 5.0, 2.0])
    evolution = Evolution(np.full(K, 0.4), 0.1)
    for _ in range(250):
        U = evolution.ask(rng)
        assert np.all((U >= 0.0) & (U <= 1.0))
        evolution.tell(U, np.abs(U - centre) @ weights)
    assert np.abs(np.clip(evolution.mean, 0, 1) - centre) @ weights < 0.02


def test_evolution_ranks_only():
    rng = [np.random.default_rng(7) for _ in range(2)]
    plain, bent = Evolution(np.full(K, 0.4), 0.1), Evolution(np.full(K, 0.4), 0.1)
    for _ in range(20):
        U, V = plain.ask(rng[0]), bent.ask(rng[1])
        assert np.array_equal(U, V)
        value = (U**2).sum(axis=1)
        plain.tell(U, value)
        bent.tell(V, np.exp(9.0 * value))


def test_slab_is_checked():
    for weights, low, high in (([1.0, -1.0], 0.0, 1.0), ([1.0, 1.0], 1.0, 1.0), ([np.nan, 1.0], 0.0, 1.0)):
        with pytest.raises(SettingsError, match="slab"):
            Slab(np.array(weights), low, high)
    with pytest.raises(SettingsError, match="3 weights"):
        Region(SearchSpace(Box([0.0], [1.0], [False]), slab=Slab(np.ones(3), 0.0, 1.0)))
    with pytest.raises(SettingsError, match="fixed"):
        Region(SearchSpace(Box([0.0], [0.0], [False])))


def test_units_and_positions_are_inverse():
    box = Box([-1.5, 0.2, 0.0], [1.5, 0.2, 0.5], [True, False, False])
    space, rng = Region(SearchSpace(box, slab=Slab(np.array([0.0, 1.0, 1.0]), 0.3, 0.6))), np.random.default_rng(8)
    U = rng.random((50, 2))
    X = space.positions(U)
    assert np.allclose(space.units(X), U)
    assert np.all(X[:, 1] == 0.2)
    inside = (X @ np.array([0.0, 1.0, 1.0]) > 0.3) & (X @ np.array([0.0, 1.0, 1.0]) < 0.6)
    assert np.array_equal(inside, (U @ space.weights > space.low) & (U @ space.weights < space.high))
