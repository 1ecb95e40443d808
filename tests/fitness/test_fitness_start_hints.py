"""Start poses and mounts that are given: the start search is spared, and nothing else changes."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import PACKAGING, WELDING, problem_for, recorded
from scipy.spatial.transform import Rotation

from armdesign.errors import DesignError
from armdesign.fitness.block import BlockEvaluator
from armdesign.fitness.constraints import design_space
from armdesign.fitness.robot import RobotFitness
from armdesign.settings.sections import Design

TASKS = {"packaging": (3, PACKAGING, 0.0, 60), "welding": (4, WELDING, 0.2, 40)}
every_task = pytest.mark.parametrize("name", TASKS)


def setting(name, **others):
    """Fitness, designs and their scores."""
    n, weights, w_0, count = TASKS[name]
    P, R = recorded(name)
    problem = problem_for(P[::8], n, weights, R=None if R is None else R[::8], w_0=w_0, **others)
    space = design_space(Design(dof=n))
    Phi = space.sample(np.random.default_rng(31), count)
    fitness = RobotFitness(problem, space)
    return fitness, Phi, fitness.evaluate(Phi)[0]


def columns(scores, chosen=slice(None)):
    return {name: values[chosen] for name, values in vars(scores).items()}


def equal(one, other, but=()):
    return all(np.array_equal(one[name], other[name], equal_nan=True) for name in one if name not in but)


@every_task
def test_a_design_evaluated_from_its_own_start_has_its_fitness(name):
    fitness, Phi, scores = setting(name)
    valid = scores.valid
    again = fitness.evaluate(Phi[valid], None, scores.q0[valid])[0]
    assert valid.sum() >= 5
    assert again.valid.all()
    np.testing.assert_allclose(again.fitness, scores.fitness[valid], rtol=1e-9)
    np.testing.assert_allclose(again.q0, scores.q0[valid], atol=1e-9)
    assert (again.start_steps < 0.1 * scores.start_steps[valid]).all()


@every_task
def test_hints_that_are_none_change_nothing(name):
    fitness, Phi, scores = setting(name)
    nothing = np.full((len(Phi), fitness.problem.dof), np.nan)
    half = scores.q0.copy()
    half[:, -1] = np.nan
    for poses in (nothing, half):
        assert equal(columns(fitness.evaluate(Phi, None, poses)[0]), columns(scores))


@every_task
def test_hints_concern_their_own_candidates_only(name):
    """Whatever the block and the company, hinted or not."""
    fitness, Phi, scores = setting(name)
    poses = np.where(np.arange(len(Phi))[:, None] % 2 == 0, scores.q0, np.nan)
    mixed = fitness.evaluate(Phi, None, poses)[0]
    plain = np.isnan(poses).any(axis=1)
    assert equal(columns(mixed, plain), columns(scores, plain))
    for block in (1, 7):
        other = RobotFitness(fitness.problem, fitness.space, block).evaluate(Phi, None, poses)[0]
        assert equal(columns(other), columns(mixed))


def test_a_neighbour_from_its_parents_start_is_the_neighbour():
    """A small step away the parent's start leads to the neighbour's own, where that is the same basin."""
    fitness, Phi, scores = setting("packaging")
    lower, upper = fitness.space.bounds
    near = np.clip(Phi[scores.valid] + 1e-5, lower, upper)
    pure = fitness.evaluate(near)[0]
    hinted = fitness.evaluate(near, None, scores.q0[scores.valid])[0]
    same = np.linalg.norm(pure.q0 - hinted.q0, axis=1) < 0.05
    assert same.mean() > 0.8
    np.testing.assert_allclose(hinted.fitness[same], pure.fitness[same], rtol=1e-4)
    assert (pure.path_fitness[same] > 0).all()


def test_a_hint_beyond_the_limits_is_taken_to_them():
    fitness, Phi, scores = setting("packaging")
    valid = scores.valid
    record = fitness.problem.record[0]
    n = fitness.problem.dof
    wild = np.where(np.arange(n) == 0, 10.0, scores.q0[valid])
    clipped = np.clip(wild, record["lower"][:n], record["upper"][:n])
    one, other = (fitness.evaluate(Phi[valid], None, poses)[0] for poses in (wild, clipped))
    assert equal(columns(one), columns(other))


def test_the_start_told_is_the_one_of_the_path():
    fitness, Phi, scores = setting("welding")
    evaluator = BlockEvaluator(fitness.problem, block=1)
    for k in np.flatnonzero(scores.valid)[:4]:
        table = fitness.space.table(Phi[k])
        found, path = evaluator.follow(table)
        np.testing.assert_array_equal(scores.q0[k], path.q[0])
        np.testing.assert_array_equal(scores.mount[k], path.mount)
        assert found.miss_frame[0] == -1
        hinted, again = evaluator.follow(table, pose=path.q[0])
        np.testing.assert_allclose(hinted.fitness, found.fitness, rtol=1e-9)
        np.testing.assert_allclose(again.q, path.q, atol=1e-6)
    assert np.isnan(scores.q0[~scores.valid]).all()
    assert (scores.miss_frame[~scores.valid] == 0).all()
    assert (scores.miss[~scores.valid] >= scores.start_error[~scores.valid]).all()


def test_the_mount_that_fits_identity_is_identity():
    """The identity given as a mount is the setting ``mount = identity``, frame by frame."""
    fitness, Phi, _ = setting("welding")
    identity, _, expected = setting("welding", mount="identity")
    mounts = np.tile(np.eye(3), (len(Phi), 1, 1))
    given = fitness.evaluate(Phi, None, None, mounts)[0]
    assert equal(columns(given), columns(expected))
    k = np.flatnonzero(given.valid)[0]
    table = fitness.space.table(Phi[k])
    _, path = BlockEvaluator(fitness.problem, 1).follow(table, mount=np.eye(3))
    _, wanted = BlockEvaluator(identity.problem, 1).follow(table)
    np.testing.assert_array_equal(path.q, wanted.q)
    np.testing.assert_array_equal(path.mount, np.eye(3))


def test_a_given_mount_is_that_of_the_path():
    fitness, Phi, scores = setting("welding")
    valid = np.flatnonzero(scores.valid)
    turned = np.array([mount @ np.diag([1.0, -1.0, -1.0]) for mount in scores.mount[valid]])
    given = fitness.evaluate(Phi[valid], None, None, turned)[0]
    np.testing.assert_array_equal(given.mount[given.valid], turned[given.valid])
    for k in np.flatnonzero(given.valid)[:4]:
        table = fitness.space.table(Phi[valid[k]])
        found, path = BlockEvaluator(fitness.problem, 1).follow(table, mount=turned[k])
        assert found.fitness[0] == given.fitness[k]
        hand = np.array([table.frames(q)[-1][:3, :3] for q in path.q]) @ turned[k]
        errors = Rotation.from_matrix(hand.transpose(0, 2, 1) @ fitness.problem.R).magnitude()
        np.testing.assert_allclose(path.orientation_error, errors, atol=1e-7)


def test_poses_of_another_shape_are_refused():
    fitness, Phi, scores = setting("packaging")
    for poses in (scores.q0[:-1], scores.q0[:, :-1], scores.q0[0]):
        with pytest.raises(DesignError, match="start poses have shape"):
            fitness.evaluate(Phi, None, poses)
    with pytest.raises(DesignError, match="mounts have shape"):
        fitness.evaluate(Phi, None, None, np.eye(3))
    rows, yaw = fitness.space.rows(Phi)
    for poses in (scores.q0[:-1], scores.q0[0]):
        with pytest.raises(DesignError, match="start poses have shape"):
            BlockEvaluator(fitness.problem, 1).evaluate(rows, yaw, poses=poses)
