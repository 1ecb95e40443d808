"""Penalties: valid designs keep their fitness, invalid ones are worse the farther they are from being valid."""

from pathlib import Path

import numpy as np
import pytest

from armdesign import Settings, prepare, read_recording
from armdesign.experiments.studies.penalised import MISSED, OUT_OF_BOUNDS, OUT_OF_REACH, WIDTH, PenalisedFitness

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


@pytest.fixture(scope="module")
def fitness():
    study = Settings().replace({"design": {"dof": 3}})
    return PenalisedFitness(prepare(read_recording(EXAMPLES / "packaging.csv"), study))


@pytest.fixture(scope="module")
def Phi(fitness):
    rng = np.random.default_rng(0)
    return np.vstack([fitness.space.sample(rng, 60), rng.uniform(fitness.lower, fitness.upper, (60, 8))])


def test_positions_and_designs_map_onto_each_other(fitness, Phi):
    X = fitness.positions(Phi)
    assert ((X >= 0.0) & (X <= WIDTH)).all()
    np.testing.assert_allclose(fitness.phi(X), Phi, atol=1e-12)
    angular = fitness.space.angular
    np.testing.assert_allclose(np.diff(X, axis=0)[:, angular], np.diff(Phi, axis=0)[:, angular], atol=1e-12)


def test_every_design_gets_a_finite_number_and_valid_ones_their_fitness(fitness, Phi):
    X = fitness.positions(Phi)
    values, (scores, _) = fitness.many(X), fitness.objective.evaluate(fitness.phi(X))
    assert np.isfinite(values).all()
    assert scores.valid.any()
    assert np.array_equal(values[scores.valid], scores.fitness[scores.valid])
    assert (values[scores.valid] < MISSED).all()
    assert (values[~scores.valid] >= MISSED).all()


def test_one_at_a_time_gives_the_same(fitness, Phi):
    X = fitness.positions(Phi)[::12]
    assert [fitness(x) for x in X] == list(fitness.many(X))


def test_tests_rank_in_their_order_and_grow_with_the_distance(fitness, Phi):
    X = fitness.positions(Phi)
    values, (scores, _) = fitness.many(X), fitness.objective.evaluate(fitness.phi(X))
    outside = ~fitness.space.admissible(fitness.phi(X))
    started = ~scores.valid & np.isfinite(scores.start_error)
    unreached = ~scores.valid & ~started & ~outside
    assert (values[outside] >= OUT_OF_BOUNDS).all()
    assert ((values[unreached] >= OUT_OF_REACH) & (values[unreached] < OUT_OF_BOUNDS)).all()
    assert ((values[started] >= MISSED) & (values[started] < OUT_OF_REACH)).all()
    assert np.array_equal(np.argsort(values[started]), np.argsort(scores.start_error[started]))
    excess = fitness.excess(fitness.phi(X)[outside])
    assert (np.diff(values[outside][np.argsort(excess)]) >= -1e-9).all()
