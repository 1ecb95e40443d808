"""The best pose of one frame: as good as a long global search, the more starts the better, the same for any block."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from kernel_probe import Probe
from plain_reference import arm, temporal
from scenes import PACKAGING, WELDING, full_turn, random_frames, random_rotation, random_table, rows_of, settings_for
from scipy.optimize import differential_evolution

from armdesign.errors import DesignError, SettingsError, TaskError
from armdesign.fitness.constraints import design_space
from armdesign.fitness.kernels.path import advance
from armdesign.fitness.pose import PoseSolver
from armdesign.settings.sections import Design

NEAR = 1e-5  # 0.01 mm


def best_pose(table, points, rotation, limits, fitness, starts=64):
    return PoseSolver(limits, fitness, starts=starts).solve(table, points, rotation)


CASES = {"packaging": (PACKAGING, 0.0), "welding": (WELDING, 0.2)}


def instance(k):
    """Case k: a design from the search space, an arm-like frame and a hand rotation."""
    rng = np.random.default_rng([7, k])
    n = 3 + k % 4
    space = design_space(Design(dof=n))
    return space.table(space.sample(rng, 1)), random_frames(rng, 1, 3)[0], random_rotation(rng)


def global_minimum(table, points, rotation, weights, w_0, seed):
    """g at the end of a long differential evolution over the joint limits, polished."""
    n = table.dof
    probe = Probe(15, n).load(table)

    def value(X):
        batches = np.array_split(X.T, range(15, X.shape[1], 15)) if X.ndim == 2 else [X[None]]
        found = []
        for batch in batches:
            q = np.zeros((15, n))
            q[: len(batch)] = batch
            probe.pose(q).look(points, weights, target=rotation, w_0=w_0)
            found.append(probe.frames["g"][: len(batch)].copy())
        return np.concatenate(found) if X.ndim == 2 else float(found[0][0])

    result = differential_evolution(
        value, full_turn(n), popsize=15, maxiter=1500, tol=1e-9, mutation=(0.4, 1.0), rng=seed, polish=True,
        vectorized=True, updating="deferred",
    )  # fmt: skip
    return result.fun


def shortfalls(cases):
    """How far 64 starts end above the global search [m], case by case; negative where they end below it."""
    solvers = {}
    gaps = []
    for k in cases:
        weights, w_0 = list(CASES.values())[k % 2]
        table, points, rotation = instance(k)
        key = table.dof, w_0
        if key not in solvers:
            solvers[key] = PoseSolver(full_turn(table.dof), settings_for(weights, w_0), starts=64)
        gaps.append(solvers[key].solve(table, points, rotation).g)
        gaps[-1] -= global_minimum(table, points, rotation, weights, w_0, seed=k)
    return np.array(gaps)


def test_points_that_cannot_be_written_to_are_no_reason_to_compile_anew():
    table, points, rotation = instance(1)
    points.setflags(write=False)
    solver = PoseSolver(full_turn(table.dof), settings_for(*CASES["welding"]), starts=1)
    solver.solve(table, points.copy(), rotation)
    before = list(advance.signatures)
    solver.solve(table, points, rotation)
    assert advance.signatures == before


def test_64_starts_end_where_a_long_global_search_does():
    assert (shortfalls(range(8)) <= NEAR).all()


@pytest.mark.slow
def test_64_starts_end_where_a_long_global_search_does_in_99_of_100_cases():
    gaps = shortfalls(range(200))
    print(
        f"share {np.mean(gaps <= NEAR):.3f}, below by more than 0.01 mm {np.mean(gaps < -NEAR):.3f}, worst {gaps.max()}"
    )
    assert np.mean(gaps <= NEAR) >= 0.99


@pytest.mark.parametrize("case", CASES)
def test_the_pose_has_the_fitness_it_claims(case):
    weights, w_0 = CASES[case]
    for k in range(8):
        table, points, rotation = instance(k)
        pose = best_pose(table, points, rotation, full_turn(table.dof), settings_for(weights, w_0), starts=8)
        vertices, tool = arm(rows_of(table), pose.q)
        g, arcs, distance, error = temporal(vertices, tool, points, np.array(weights), w_0=w_0, target=rotation)
        assert pose.g == pytest.approx(g, abs=1e-12)
        assert pose.orientation_error == pytest.approx(error, abs=1e-9)
        np.testing.assert_allclose(pose.sigma * table.length, arcs, atol=1e-9)
        np.testing.assert_allclose(pose.distance, distance, atol=1e-9)
        assert pose.g == pose.found.min()
        assert len(pose.found) == 8


@pytest.mark.parametrize("case", CASES)
def test_no_small_step_improves_the_pose(case):
    weights, w_0 = CASES[case]
    rng = np.random.default_rng(1)
    for k in range(8):
        table, points, rotation = instance(k)
        n = table.dof
        pose = best_pose(table, points, rotation, full_turn(n), settings_for(weights, w_0))
        probe = Probe(90 // n, n).load(table)
        for size in (1e-3, 1e-2):
            q = np.clip(pose.q + size * rng.normal(size=(90 // n, n)), -np.pi, np.pi)
            probe.pose(q).look(points, weights, target=rotation, w_0=w_0)
            assert probe.frames["g"].min() >= pose.g * (1.0 - 2e-5)  # the solver promises 1e-5


def test_more_starts_never_find_less():
    table, points, rotation = instance(3)
    poses = [
        best_pose(table, points, rotation, full_turn(table.dof), settings_for(PACKAGING), starts=k) for k in (1, 4, 16)
    ]
    assert poses[0].g >= poses[1].g >= poses[2].g
    for few, more in pairwise(poses):
        np.testing.assert_array_equal(more.found[: len(few.found)], few.found)
        assert few.steps < more.steps


@pytest.mark.parametrize("case", CASES)
def test_the_block_size_changes_nothing(case):
    weights, w_0 = CASES[case]
    table, points, rotation = instance(2)
    poses = [
        PoseSolver(full_turn(table.dof), settings_for(weights, w_0), starts=20, block=block).solve(
            table, points, rotation
        )
        for block in (1, 7, 19)
    ]
    for other in poses[1:]:
        np.testing.assert_array_equal(poses[0].found, other.found)
        np.testing.assert_array_equal(poses[0].q, other.q)
        assert poses[0].steps == other.steps


def test_a_solver_remembers_nothing_of_the_frame_before():
    (first, P, _), (second, Q, _) = instance(1), instance(5)
    solver = PoseSolver(full_turn(4), settings_for(PACKAGING), starts=8)
    fresh = solver.solve(first, P)
    solver.solve(second, Q)
    again = solver.solve(first, P)
    np.testing.assert_array_equal(fresh.found, again.found)
    np.testing.assert_array_equal(fresh.q, again.q)


def test_an_arm_s_own_places_are_met():
    rng = np.random.default_rng(2)
    for n in (2, 3, 4, 6):
        table = random_table(rng, n, zeros=False)
        vertices, tool = arm(rows_of(table), rng.uniform(-2, 2, n))
        points = vertices[[1, len(vertices) // 2, -1]]
        pose = best_pose(table, points, tool[:3, :3], full_turn(n), settings_for((0.2, 0.2, 0.3), 0.3))
        assert pose.g < 1e-6


def test_joint_limits_hold():
    rng = np.random.default_rng(3)
    limits = np.array([[-0.5, 0.5], [0.2, 0.4], [-1.0, -0.9], [0.3, 0.3]])
    for _ in range(10):
        pose = best_pose(random_table(rng, 4), random_frames(rng, 1, 3)[0], None, limits, settings_for(PACKAGING))
        assert (limits[:, 0] <= pose.q).all()
        assert (pose.q <= limits[:, 1]).all()


def test_what_does_not_fit_is_refused():
    table, points, _ = instance(0)
    fitness = settings_for(WELDING, 0.2)
    with pytest.raises(SettingsError, match="0 starts"):
        PoseSolver(full_turn(3), fitness, starts=0)
    with pytest.raises(SettingsError, match="no weights"):
        PoseSolver(full_turn(3), settings_for(()))
    solver = PoseSolver(full_turn(3), fitness, starts=2)
    with pytest.raises(TaskError, match="no rotation"):
        solver.solve(table, points)
    with pytest.raises(TaskError, match="rotation has shape"):
        solver.solve(table, points, np.eye(4))
    with pytest.raises(TaskError, match="points have shape"):
        solver.solve(table, points[:2], np.eye(3))
    with pytest.raises(DesignError, match="4 joints"):
        solver.solve(instance(1)[0], points, np.eye(3))
