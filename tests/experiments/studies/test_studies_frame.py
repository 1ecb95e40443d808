"""One frame as other solvers see it: the same g as our own, exact gradients, and sigma that are never beaten."""

from pathlib import Path

import numpy as np
import pytest

from armdesign import Settings, prepare, read_recording
from armdesign.experiments.studies.frame_fitness import FrameFitness
from armdesign.experiments.studies.frame_solvers import SOLVERS, FrameSolvers
from armdesign.experiments.studies.opytimizer_swarms import ALGORITHMS
from armdesign.fitness.constraints import joint_limits
from armdesign.fitness.pose import PoseSolver

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
FRAME = 37


@pytest.fixture(scope="module", params=[("packaging", 3), ("packaging", 6), ("welding", 5)], ids=str)
def case(request):
    """Task and settings, and a random arm."""
    scenario, n = request.param
    study = Settings().replace({"design": {"dof": n}, "fitness": {"scenario": scenario}})
    prepared = prepare(read_recording(EXAMPLES / f"{scenario}.csv"), study)
    Phi = prepared.space.sample(np.random.default_rng(n), 1)[0]
    return prepared, prepared.space.table(Phi)


@pytest.fixture
def fitness(case):
    prepared, table = case
    return FrameFitness(table, prepared.path_problem, FRAME)


def poses(fitness, count=5):
    return np.random.default_rng(1).uniform(*fitness.limits.T, size=(count, fitness.dof))


def test_fitness_is_that_of_our_own_solver(case, fitness):
    prepared, table = case
    solver = PoseSolver(joint_limits(prepared.settings.design), prepared.settings.fitness, starts=4)
    R = None if prepared.task.R is None else prepared.task.R[FRAME]
    pose = solver.solve(table, prepared.task.P[FRAME], R)
    assert fitness(pose.q) == pytest.approx(pose.g, rel=1e-12)
    assert fitness.with_sigma(np.r_[pose.q, pose.sigma[: fitness.free]]) == pytest.approx(pose.g, rel=1e-9)


def test_gradient_is_that_of_finite_differences(fitness):
    for q in poses(fitness):
        g, gradient = fitness.with_gradient(q)
        assert g == fitness(q)
        h = 1e-6
        differences = [(fitness(q + h * e) - fitness(q - h * e)) / (2 * h) for e in np.eye(fitness.dof)]
        np.testing.assert_allclose(gradient, differences, atol=2e-7)


def test_no_ordered_sigma_beats_the_exact_ones(fitness):
    rng = np.random.default_rng(2)
    for q in poses(fitness):
        for _ in range(50):
            sigma = np.sort(rng.random(fitness.free))
            assert fitness.with_sigma(np.r_[q, sigma]) >= fitness(q) - 1e-12


def test_every_solver_ends_within_the_limits_at_the_value_it_tells(case):
    prepared, table = case
    solvers = FrameSolvers(prepared)
    for name in (name for name in SOLVERS if name not in ALGORITHMS):
        found = solvers.solve(name, table, FRAME, 400, seed=3)
        fitness = FrameFitness(table, prepared.path_problem, FRAME)
        assert (found.q >= fitness.limits[:, 0] - 1e-9).all()
        assert (found.q <= fitness.limits[:, 1] + 1e-9).all()
        assert found.evaluations > 0
        if name == "slsqp-paper":
            assert found.g >= fitness(found.q) - 1e-12
        else:
            assert found.g == pytest.approx(fitness(found.q), rel=1e-9)


def test_more_starts_never_find_less(case):
    prepared, table = case
    solvers = FrameSolvers(prepared)
    found = [solvers.solve(f"dls-{starts}", table, FRAME, 0, 0).g for starts in (1, 16, 64)]
    assert found == sorted(found, reverse=True)
