"""A candidate's scores depend on the candidate alone, to the last bit; pruning changes nothing that counts."""

from __future__ import annotations

import os
import subprocess
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scenes import PACKAGING, ROOT, WELDING, problem_for, recorded

from armdesign.errors import DesignError
from armdesign.fitness.block import BlockEvaluator
from armdesign.fitness.constraints import design_space
from armdesign.fitness.robot import Rejections, RobotFitness
from armdesign.search.evaluation import evaluate_on
from armdesign.settings.sections import Design

COLUMNS = ("fitness", "path_fitness", "area", "valid", "start_error", "steps", "accepted", "frames")
TASKS = {"packaging": (4, PACKAGING, 0.0), "welding": (5, WELDING, 0.2)}
COUNT = 48
every_task = pytest.mark.parametrize("name", TASKS)


@cache
def setting(name):
    """Problem, design space and candidates, a few of them inadmissible."""
    n, weights, w_0 = TASKS[name]
    P, R = recorded(name)
    problem = problem_for(P[::8], n, weights, R=None if R is None else R[::8], w_0=w_0)
    space = design_space(Design(dof=n))
    rng = np.random.default_rng(21)
    Phi = np.vstack([space.sample(rng, COUNT - 6), rng.uniform(*space.bounds, (6, len(space.angular)))])
    return problem, space, Phi


@cache
def full(name):
    """Scores of all candidates, none dropped."""
    problem, space, Phi = setting(name)
    return RobotFitness(problem, space).evaluate(Phi)[0]


def columns_of(scores):
    """The columns of the scores, a row a candidate."""
    return np.stack([getattr(scores, column).astype(float) for column in COLUMNS], axis=1)


def scores_of(name, chosen=slice(None), block=None):
    problem, space, Phi = setting(name)
    return columns_of(RobotFitness(problem, space, block).evaluate(Phi[chosen])[0])


@every_task
@pytest.mark.parametrize("block", [1, 3, 20])
def test_scores_do_not_depend_on_the_block_size(name, block):
    np.testing.assert_array_equal(scores_of(name, block=block), columns_of(full(name)))


@every_task
def test_scores_do_not_depend_on_order_or_company(name):
    all_scores = columns_of(full(name))
    rng = np.random.default_rng(22)
    for chosen in (rng.permutation(COUNT), rng.choice(COUNT, 11, replace=False), np.array([5])):
        np.testing.assert_array_equal(scores_of(name, chosen), all_scores[chosen])


@every_task
def test_scores_do_not_depend_on_what_was_evaluated_before(name):
    problem, space, Phi = setting(name)
    fitness = RobotFitness(problem, space)
    fitness.evaluate(Phi[::-1][:7], np.full(7, 0.5))
    np.testing.assert_array_equal(columns_of(fitness.evaluate(Phi)[0]), columns_of(full(name)))


def test_scores_are_the_same_in_a_fresh_process():
    code = (
        f"import test_fitness_purity as t; [print(t.scores_of(name, block=2).tobytes().hex()) for name in {[*TASKS]}]"
    )
    paths = os.pathsep.join([str(Path(__file__).parent), str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    environment = {**os.environ, "PYTHONPATH": paths}
    output = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert output.stdout.split() == [columns_of(full(name)).tobytes().hex() for name in TASKS]


@every_task
def test_evaluating_one_arm_gives_its_score(name):
    problem, space, Phi = setting(name)
    scores = full(name)
    for k in np.flatnonzero(scores.valid)[:4]:
        result = evaluate_on(space.table(Phi[k]), problem)
        assert (result.fitness, result.path_fitness, result.area) == (
            scores.fitness[k], scores.path_fitness[k], scores.area[k],
        )  # fmt: skip


@every_task
def test_inputs_are_left_as_they_were(name):
    problem, space, Phi = setting(name)
    before = [x.copy() for x in (Phi, problem.P, problem.R, problem.record, problem.starts)]
    RobotFitness(problem, space).evaluate(Phi, np.full(COUNT, 1.0))
    for x, y in zip(before, (Phi, problem.P, problem.R, problem.record, problem.starts), strict=True):
        assert x.tobytes() == y.tobytes()


@every_task
def test_pruning_drops_only_what_is_beyond_its_cutoff(name):
    problem, space, Phi = setting(name)
    fitness = RobotFitness(problem, space)
    whole = full(name)
    rng = np.random.default_rng(23)
    dropped = 0
    for _ in range(3):
        cutoff = np.where(np.isfinite(whole.fitness), whole.fitness, 1.0) * rng.uniform(0.5, 1.5, COUNT)
        scores, removed = fitness.evaluate(Phi, cutoff)
        kept = ~scores.pruned
        for column in COLUMNS:
            np.testing.assert_array_equal(getattr(scores, column)[kept], getattr(whole, column)[kept])
        assert (whole.fitness[scores.pruned] > cutoff[scores.pruned]).all()
        assert scores.valid[scores.pruned].all()
        assert np.isinf(scores.fitness[scores.pruned]).all()
        assert (scores.frames[scores.pruned] < problem.frames).all()
        assert removed.pruned == scores.pruned.sum()
        dropped += removed.pruned
    assert dropped > 10


@every_task
def test_a_candidate_at_its_own_cutoff_survives(name):
    """The search gives each particle its personal best: an equal fitness must come out whole."""
    problem, space, Phi = setting(name)
    scores, _ = RobotFitness(problem, space).evaluate(Phi, full(name).fitness)
    assert not scores.pruned.any()
    np.testing.assert_array_equal(scores.fitness, full(name).fitness)


@every_task
def test_a_cutoff_of_zero_drops_every_valid_candidate_at_once(name):
    problem, space, Phi = setting(name)
    valid = full(name).valid
    scores, _ = RobotFitness(problem, space).evaluate(Phi, np.zeros(COUNT))
    np.testing.assert_array_equal(scores.pruned, valid)
    assert (scores.frames[valid] == 1).all()


@every_task
def test_rejections_add_up(name):
    problem, space, Phi = setting(name)
    scores, removed = RobotFitness(problem, space).evaluate(Phi, np.full(COUNT, 0.8))
    scored = int(np.isfinite(scores.fitness).sum())
    assert removed.constraints + removed.reach + removed.start + removed.pruned + scored == COUNT
    assert removed.constraints == (~space.admissible(Phi)).sum()
    assert scored + removed.pruned == scores.valid.sum()
    total = removed + Rejections(1, 2, 3, 4, 5)
    assert vars(total) == {
        "constraints": removed.constraints + 1, "reach": removed.reach + 2, "start": removed.start + 3,
        "pruned": removed.pruned + 4, "path": removed.path + 5,
    }  # fmt: skip


@pytest.mark.parametrize("far", [0.02, 0.15, 0.5, 0.9, 1.1])
def test_the_reach_shell_removes_no_arm_that_could_start(far):
    """Those left out because the first hand point is out of their links' span are invalid when tried."""
    space = design_space(Design(dof=3, bounds={"d_tool": (0.05, 0.9), "a_1": (0.0, 0.05), "d_1": (0.0, 0.05)}))
    direction = np.array([0.6, 0.0, 0.8])
    P = np.array([[0.3 * far * direction, 0.6 * far * direction, far * direction]])
    problem = problem_for(P, 3, PACKAGING)
    Phi = space.sample(np.random.default_rng(24), 150)
    scores, removed = RobotFitness(problem, space).evaluate(Phi)
    rows, yaw = space.rows(Phi)
    every = BlockEvaluator(problem).evaluate(rows, yaw)
    np.testing.assert_array_equal(scores.valid, every.valid)
    np.testing.assert_array_equal(scores.fitness, every.fitness)
    assert removed.reach + removed.start == (~every.valid).sum()
    assert removed.reach > 0


@pytest.mark.parametrize("hand", [(0.0, 0.3, 0.93), (0.1, 0.0, 0.1)])
def test_the_reach_shell_is_that_of_the_plain_links(hand):
    space = design_space(Design(dof=4, bounds={"d_tool": (0.05, 0.9)}))
    Phi = space.sample(np.random.default_rng(25), 300)
    problem = problem_for(np.array([[[0.0, 0, 0.1], [0.0, 0, 0.2], hand]]), 4, PACKAGING)
    _, removed = RobotFitness(problem, space).evaluate(Phi)
    distance, out = np.linalg.norm(hand), 0
    for design in Phi:
        table = space.table(design)
        links = [np.hypot(a, d) for a, d in zip(table.a, table.d, strict=True)]
        longest = max(links)
        out += not (longest - (sum(links) - longest) - 1e-3 <= distance <= sum(links) + 1e-3)
    assert removed.reach == out > 0


def test_designs_of_another_size_are_refused():
    problem, _, _ = setting("packaging")
    with pytest.raises(DesignError, match="shape"):
        BlockEvaluator(problem, block=1).evaluate(np.zeros((2, 4, 4)), np.zeros(2))
