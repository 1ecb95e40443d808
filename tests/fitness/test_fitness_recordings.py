"""On the example recordings and on real ones, f, E and r are what the plain formulas give for the path found."""

from __future__ import annotations

import numpy as np
import plain_reference
import pytest
from scenes import PACKAGING, WELDING, problem_for, recorded, rows_of

from armdesign.fitness.constraints import design_space
from armdesign.fitness.robot import RobotFitness
from armdesign.search.evaluation import evaluate_on
from armdesign.settings.sections import Design

TASKS = {  # recording: joints, weights, w_0, every so many frames
    "packaging": (4, PACKAGING, 0.0, 4),
    "welding": (5, WELDING, 0.2, 4),
    "box_lift": (5, WELDING, 0.2, 9),
    "handover": (4, PACKAGING, 0.0, 12),
}
ORIENTED = ("welding", "box_lift")


def best_of_some(problem, space, count=60):
    """The best of a few random designs: a fair arm for the task."""
    Phi = space.sample(np.random.default_rng(11), count)
    scores, _ = RobotFitness(problem, space).evaluate(Phi)
    assert scores.valid.any()
    best = int(np.argmin(scores.fitness))
    return space.table(Phi[best]), scores.fitness[best]


@pytest.mark.parametrize(
    ("name", "metric"),
    [(name, metric) for name in ORIENTED for metric in ("geodesic", "euler", "axis")]
    + [(name, "geodesic") for name in TASKS if name not in ORIENTED],
)
def test_scores_equal_the_plain_recomputation(name, metric):
    n, weights, w_0, stride = TASKS[name]
    P, R = recorded(name)
    P, R = P[::stride], None if R is None else R[::stride]
    mount = "identity" if name == "welding" and metric == "euler" else "start"
    problem = problem_for(
        P, n, weights, R=R, w_0=w_0, orientation_metric=metric, mount=mount, dt=0.02 * stride, continuity_speed=500.0,
    )  # fmt: skip
    table, fitness = best_of_some(problem, design_space(Design(dof=n)))
    result = evaluate_on(table, problem)
    g, area, sigma, distance, error = plain_reference.path(
        rows_of(table), table.base_yaw, result.path.q, P, weights, w_0=w_0, R=R, mount=result.path.mount,
        metric=metric,
    )  # fmt: skip
    f, E = g.mean(), area.mean()
    assert result.fitness == fitness
    np.testing.assert_allclose(
        [result.path_fitness, result.area, result.fitness], [f, E, 15.0 * f + 5.0 * E], rtol=0.0, atol=1e-9
    )
    np.testing.assert_allclose(result.path.g, g, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(result.path.area, area, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(result.path.sigma, sigma, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(result.path.distance, distance, rtol=0.0, atol=1e-8)
    if w_0 > 0.0:
        np.testing.assert_allclose(result.path.orientation_error, error, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", TASKS)
def test_paths_on_recordings_keep_to_speed_and_limits(name):
    n, weights, w_0, stride = TASKS[name]
    P, R = recorded(name)
    P, R = P[::stride], None if R is None else R[::stride]
    limits = np.deg2rad(np.tile([-170.0, 170.0], (n, 1)))
    problem = problem_for(P, n, weights, R=R, w_0=w_0, limits=limits)
    table, _ = best_of_some(problem, design_space(Design(dof=n)))
    path = evaluate_on(table, problem).path
    assert np.linalg.norm(np.diff(path.q, axis=0), axis=1).max() <= np.deg2rad(10.0) * (1.0 + 1e-9)
    assert (limits[:, 0] <= path.q).all()
    assert (path.q <= limits[:, 1]).all()
    assert path.start_error <= 1e-3
    assert (np.diff(path.sigma, axis=1) >= 0.0).all()
    np.testing.assert_allclose(path.sigma[:, -1], 1.0, atol=1e-15)
