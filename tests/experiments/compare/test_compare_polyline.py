"""A ready-made arm has the same fitness as a DH arm: the same values at the same pose, the same path."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from compare_arms import bent_table, evaluator, example_problem, exported, frames_at, settings, task_for
from scipy.spatial.transform import Rotation

from armdesign.experiments.compare.ready_made import open_ready_made
from armdesign.fitness.block import BlockEvaluator
from armdesign.fitness.problem import make_problem
from armdesign.kinematics.dh import DHTable
from armdesign.settings.sections import Solver

sys.path.append(str(Path(__file__).resolve().parents[2] / "fitness"))
import plain_reference

TIGHT = {"tolerance": 1e-12, "floor": 1e-15, "max_steps": 200}
FEW = {"starts": 64, "descents": 16, "finalists": 3}


def random_limits(rng, n):
    return np.stack([-rng.uniform(1.0, 3.0, n), rng.uniform(1.0, 3.0, n)], axis=1)


@pytest.mark.parametrize("w_0", [0.0, 0.2])
@pytest.mark.parametrize("n", [3, 4, 5, 6])
def test_the_urdf_of_a_design_has_the_fitness_of_the_design(n, w_0, tmp_path):
    rng = np.random.default_rng(n)
    table, limits = bent_table(rng, n), random_limits(rng, n)
    P, R = task_for(rng, table, limits)
    problem = make_problem(P, R, 0.02, limits, settings(w_0), Solver(**TIGHT))
    scores, path = BlockEvaluator(problem, block=1).follow(table)
    arm = exported(table, tmp_path, limits)
    found, other = evaluator(arm, P, R, settings(w_0), block=1, **TIGHT).follow_from(np.zeros(4))
    assert scores.valid[0]
    for name in ("fitness", "path_fitness", "area", "start_error"):
        np.testing.assert_allclose(getattr(found, name), getattr(scores, name), rtol=0.0, atol=1e-9, err_msg=name)
    for name in ("q", "g", "area", "sigma", "distance", "orientation_error"):
        np.testing.assert_allclose(getattr(other, name), getattr(path, name), rtol=0.0, atol=1e-7, err_msg=name)


@pytest.mark.parametrize("n", [3, 5])
def test_so_it_has_where_the_first_joint_stands_away_from_the_base(n, tmp_path):
    rng = np.random.default_rng(n)
    table, limits = bent_table(rng, n, first=True), random_limits(rng, n)
    P, _ = task_for(rng, table, limits)
    problem = make_problem(P, None, 0.02, limits, settings(), Solver(**TIGHT))
    scores, _ = BlockEvaluator(problem, block=1).follow(table)
    found, path = evaluator(exported(table, tmp_path, limits), P, **TIGHT).follow_from(np.zeros(4))
    assert path.q.shape == (len(P), n)
    np.testing.assert_allclose(found.fitness, scores.fitness, rtol=0.0, atol=1e-9)


def test_the_turn_of_the_base_is_a_designs_base_yaw(tmp_path):
    rng = np.random.default_rng(1)
    plain, limits = bent_table(rng, 4), random_limits(rng, 4)
    turned = DHTable(plain.alpha, plain.a, plain.d, plain.theta, 0.7)
    P, _ = task_for(rng, turned, limits)
    scores, _ = BlockEvaluator(make_problem(P, None, 0.02, limits, settings(), Solver()), 1).follow(turned)
    found, _ = evaluator(exported(plain, tmp_path, limits), P).follow_from([0.0, 0.0, 0.0, 0.7])
    np.testing.assert_allclose(found.fitness, scores.fitness, rtol=0.0, atol=1e-9)


def corners(arm, q, base):
    """Corners of the skeleton, pieces of no length left out, and the tool's frame."""
    mount = np.eye(4)
    mount[:3, :3], mount[:3, 3] = Rotation.from_euler("z", base[3]).as_matrix(), base[:3]
    frames = mount @ frames_at(arm, q)
    points = np.vstack([base[:3], frames[:, :3, 3]])
    kept = np.r_[True, np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-9]
    return points[kept], frames[-1]


@pytest.mark.parametrize(
    ("name", "metric"), [("panda", None), ("kinova", "geodesic"), ("z1", "euler"), ("so100", "axis")]
)
def test_along_its_path_an_arm_has_the_values_of_plain_numpy(name, metric):
    arm, base = open_ready_made(name), np.array([0.05, -0.1, -0.15, 0.9])
    task = example_problem("packaging" if metric is None else "welding").task
    P, R = task.P[::6], None if metric is None else task.R[::6]
    if name == "so100":
        P = 0.6 * P
    w_0 = 0.0 if metric is None else 0.2
    fitness = settings(w_0, continuity=60.0, reach_tolerance=1.0, orientation_metric=metric or "geodesic")
    scores, path = evaluator(arm, P, R, fitness, **FEW).follow_from(base)
    weights = np.array(fitness.weights)
    assert ((path.q >= arm.limits[:, 0]) & (path.q <= arm.limits[:, 1])).all()
    assert np.linalg.norm(np.diff(path.q, axis=0), axis=1).max() <= np.deg2rad(60.0) + 1e-9
    total = 0.0
    for t, q in enumerate(path.q):
        vertices, tool = corners(arm, q, base)
        g, arcs, distance, error = plain_reference.temporal(
            vertices, tool, P[t], weights, w_0=w_0, target=None if R is None else R[t], mount=path.mount,
            metric=metric or "geodesic",
        )  # fmt: skip
        E = plain_reference.area(vertices, arcs, P[t])
        np.testing.assert_allclose(path.distance[t], distance, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(
            [path.g[t], path.area[t], path.orientation_error[t]], [g, E, error], rtol=0.0, atol=1e-9
        )
        total += 15.0 * g + 5.0 * E
    assert scores.fitness[0] == pytest.approx(total / len(P), abs=1e-9)
    assert path.start_error == pytest.approx(np.linalg.norm(corners(arm, path.q[0], base)[0][-1] - P[0, -1]), abs=1e-9)


def test_the_scene_turned_with_the_base_changes_nothing():
    arm, task = open_ready_made("ur5"), example_problem("welding").task
    base, angle = np.array([0.1, -0.2, -0.1, 0.4]), 1.1
    turn = Rotation.from_euler("z", angle).as_matrix()
    moved = np.r_[turn @ base[:3], base[3] + angle]
    P, R = task.P[::6], task.R[::6]
    options = {"fitness": settings(0.2, continuity=60.0), **FEW, **TIGHT}
    here, _ = evaluator(arm, P, R, **options).follow_from(base)
    there, _ = evaluator(arm, P @ turn.T, turn @ R, **options).follow_from(moved)
    assert here.valid[0]
    np.testing.assert_allclose(there.fitness, here.fitness, rtol=0.0, atol=1e-7)


def test_a_base_pose_has_the_same_fitness_in_any_company():
    arm, P = open_ready_made("xarm7"), example_problem().task.P[::4]
    bases = np.random.default_rng(0).uniform(-0.3, 0.3, (7, 4))
    together = evaluator(arm, P, block=3, **FEW).scores(bases)
    alone = evaluator(arm, P, block=1, **FEW)
    for i in range(7):
        np.testing.assert_array_equal(alone.scores(bases[i : i + 1]).fitness, together.fitness[i : i + 1])
        np.testing.assert_array_equal(alone.follow_from(bases[i])[0].fitness, together.fitness[i : i + 1])


def test_pruning_drops_only_what_is_past_its_cutoff():
    arm, P = open_ready_made("ur3"), example_problem().task.P[::4]
    bases = np.random.default_rng(1).uniform(-0.3, 0.3, (6, 4))
    whole = evaluator(arm, P, **FEW).scores(bases)
    cutoff = np.where(np.arange(6) % 2, 0.9, 1.1) * np.where(np.isfinite(whole.fitness), whole.fitness, 1.0)
    pruned = evaluator(arm, P, **FEW).scores(bases, cutoff)
    kept = whole.fitness <= cutoff
    np.testing.assert_array_equal(pruned.fitness[kept], whole.fitness[kept])
    assert np.isinf(pruned.fitness[~kept]).all()


def test_an_arm_that_misses_the_start_says_by_how_much():
    arm, P = open_ready_made("so100"), example_problem().task.P[::10]
    scores, path = evaluator(arm, P, **FEW).follow_from([-0.5, 0.0, 0.0, 0.0])
    hand = np.linalg.norm(P[0, -1] - [-0.5, 0.0, 0.0])
    assert not scores.valid[0]
    assert np.isinf(scores.fitness[0])
    assert len(path.q) == 0
    assert hand - arm.length - 1e-9 <= scores.start_error[0] <= hand
