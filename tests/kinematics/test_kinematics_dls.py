"""A damped step is the minimiser of its model inside limits and ball, checked against SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from kinematics_kernels import damped_steps
from scipy.optimize import brentq, lsq_linear, minimize

SIZES = (1, 2, 4, 7)
COUNT = 20
TURN = np.deg2rad(10.0)


def random_models(rng, n, *, limited, balled):
    """A batch of convex models at points inside their limits and ball."""
    roots = rng.normal(size=(COUNT, n, n)) * 10.0 ** rng.uniform(-2, 0, (COUNT, 1, n))
    matrices = roots @ roots.transpose(0, 2, 1)
    gradients = rng.normal(size=(COUNT, n)) * 10.0 ** rng.uniform(-2, 0.5, (COUNT, 1))
    q = rng.uniform(-1, 1, (COUNT, n))
    room = 10.0 ** rng.uniform(-3, 0, (2, COUNT, n))
    room[rng.random((2, COUNT, n)) < 0.15] = 0.0  # now and then a joint stands at its limit
    if not limited:
        room[:] = np.inf
    away = rng.normal(size=(COUNT, n))
    away *= TURN * rng.uniform(0.0, 0.999, (COUNT, 1)) / np.linalg.norm(away, axis=1, keepdims=True)
    radius = np.full(COUNT, TURN if balled else np.inf)
    return {
        "gradients": gradients, "matrices": matrices, "q": q, "previous": q + away, "radius": radius,
        "lower": q - room[0], "upper": q + room[1], "mu": 10.0 ** rng.uniform(-6, -1, COUNT),
    }  # fmt: skip


def objective(problem, b, x):
    """The damped model, g.x + x.(H + mu I) x / 2."""
    H = problem["matrices"][b] + problem["mu"][b] * np.eye(len(x))
    return problem["gradients"][b] @ x + 0.5 * x @ H @ x


def boxed_minimum(H, g, lower, upper):
    """Minimiser of g.x + x.H x / 2 in a box: a bounded least squares problem on the root of H."""
    fixed = upper - lower <= 0.0
    x = np.where(fixed, lower, 0.0)
    if not fixed.all():
        free = ~fixed
        g = g + H @ x
        L = np.linalg.cholesky(H[np.ix_(free, free)])
        result = lsq_linear(L.T, -np.linalg.solve(L, g[free]), (lower[free], upper[free]), method="bvls", tol=1e-15)
        x[free] = np.clip(result.x, lower[free], upper[free])
    return x


def reference(problem, b):
    """The constrained minimiser; the ball enters by its multiplier, found by bracketing."""
    n = problem["q"].shape[1]
    H, g = problem["matrices"][b] + problem["mu"][b] * np.eye(n), problem["gradients"][b]
    lower, upper = problem["lower"][b] - problem["q"][b], problem["upper"][b] - problem["q"][b]
    centre, radius = problem["previous"][b] - problem["q"][b], problem["radius"][b]

    def at(nu):
        return boxed_minimum(H + nu * np.eye(n), g - nu * centre, lower, upper)

    def excess(nu):
        return np.linalg.norm(at(nu) - centre) - radius

    if excess(0.0) <= 0.0:
        return at(0.0)
    high = 1.0
    while excess(high) > 0.0:
        high *= 10.0
        if high > 1e13:
            return None  # the box touches the ball in a point
    return at(brentq(excess, 0.0, high, xtol=1e-14, rtol=1e-15))


KINDS = {
    "free": {"limited": False, "balled": False},
    "limits": {"limited": True, "balled": False},
    "ball": {"limited": False, "balled": True},
    "both": {"limited": True, "balled": True},
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("n", SIZES)
def test_step_stays_inside_and_nothing_inside_is_better(n, kind):
    rng = np.random.default_rng([1, n, list(KINDS).index(kind)])
    problem = random_models(rng, n, **KINDS[kind])
    moves, done = damped_steps(**problem)
    assert done.all()
    q = problem["q"] + moves
    assert (q >= problem["lower"] - 1e-15).all()
    assert (q <= problem["upper"] + 1e-15).all()
    assert (np.linalg.norm(q - problem["previous"], axis=1) <= problem["radius"] * (1.0 + 1e-12)).all()
    for b in range(COUNT):
        best = reference(problem, b)
        if best is not None:
            assert objective(problem, b, moves[b]) <= objective(problem, b, best) + 1e-8 + 1e-9 * abs(
                objective(problem, b, best)
            )


@pytest.mark.parametrize("n", [2, 4, 6])
def test_no_general_solver_finds_a_better_step(n):
    rng = np.random.default_rng([2, n])
    problem = random_models(rng, n, limited=True, balled=True)
    moves, _ = damped_steps(**problem)
    for b in range(0, COUNT, 2):
        centre, radius = problem["previous"][b] - problem["q"][b], problem["radius"][b]
        bounds = np.c_[problem["lower"][b] - problem["q"][b], problem["upper"][b] - problem["q"][b]]
        result = minimize(
            lambda x, b=b: objective(problem, b, x),
            np.zeros(n),
            bounds=bounds,
            constraints={"type": "ineq", "fun": lambda x, c=centre, r=radius: r * r - (x - c) @ (x - c)},
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 500},
        )
        assert objective(problem, b, moves[b]) <= result.fun + 1e-6


@pytest.mark.parametrize("n", SIZES)
def test_free_step_solves_the_damped_equations(n):
    problem = random_models(np.random.default_rng([3, n]), n, limited=False, balled=False)
    moves, done = damped_steps(**problem)
    damped = problem["matrices"] + problem["mu"][:, None, None] * np.eye(n)
    residual = np.einsum("bij,bj->bi", damped, moves) + problem["gradients"]
    assert done.all()
    scale = 1.0 + np.linalg.norm(damped, axis=(1, 2)) * np.linalg.norm(moves, axis=1)
    assert (np.abs(residual).max(axis=1) <= 1e-11 * scale).all()


@pytest.mark.parametrize("n", SIZES)
def test_a_model_that_is_not_convex_has_no_step(n):
    rng = np.random.default_rng([4, n])
    problem = random_models(rng, n, limited=False, balled=True)
    axes = np.linalg.qr(rng.normal(size=(COUNT, n, n)))[0]
    values = rng.uniform(0.1, 1.0, (COUNT, n))
    values[:, 0] = -problem["mu"] * rng.uniform(1.001, 100.0, COUNT) - 1e-9
    problem["matrices"] = np.einsum("bij,bj,bkj->bik", axes, values, axes)
    assert not damped_steps(**problem)[1].any()


@pytest.mark.parametrize("n", [2, 5])
def test_a_negative_direction_may_be_held_by_a_limit(n):
    """With the joint that bends downwards fixed, the rest is convex."""
    problem = random_models(np.random.default_rng([5, n]), n, limited=False, balled=False)
    problem["matrices"][:, 0, 0] = -1.0
    problem["matrices"][:, 0, 1:] = problem["matrices"][:, 1:, 0] = 0.0
    problem["lower"][:, 0] = problem["upper"][:, 0] = problem["q"][:, 0]
    moves, done = damped_steps(**problem)
    assert done.all()
    assert (moves[:, 0] == 0.0).all()


def test_fixed_joints_never_move():
    problem = random_models(np.random.default_rng(6), 5, limited=True, balled=True)
    problem["lower"][:, 2] = problem["upper"][:, 2] = problem["q"][:, 2]
    moves, done = damped_steps(**problem)
    assert done.all()
    assert (moves[:, 2] == 0.0).all()


def test_other_joints_make_up_for_one_at_its_limit():
    """Two joints that do the same: with one at its limit, the other does it all; a clip afterwards would stall."""
    row = np.array([[1.0, 1.0]])
    problem = {
        "gradients": -0.1 * row, "matrices": (row.T @ row)[None], "q": np.zeros((1, 2)), "previous": np.zeros((1, 2)),
        "radius": np.array([np.inf]), "lower": np.array([[-1.0, -1.0]]), "upper": np.array([[0.01, 1.0]]),
        "mu": np.array([1e-9]),
    }  # fmt: skip
    moves, _ = damped_steps(**problem)
    np.testing.assert_allclose(moves[0], [0.01, 0.09], atol=1e-8)


def test_damping_shortens_the_free_step():
    problem = random_models(np.random.default_rng(7), 4, limited=False, balled=False)
    lengths = []
    for mu in (1e-6, 1e-2, 1.0, 100.0):
        problem["mu"][:] = mu
        lengths.append(np.linalg.norm(damped_steps(**problem)[0], axis=1))
    assert (np.diff(lengths, axis=0) < 0.0).all()
