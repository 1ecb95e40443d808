"""Laws of the path fitness: what must not change it, what it must obey, and what it must reach."""

from __future__ import annotations

from itertools import islice

import numpy as np
import pytest
from kernel_probe import Probe
from scenes import PACKAGING, WELDING, full_turn, problem_for, random_table, reach_task, recorded
from scipy.spatial.transform import Rotation

from armdesign.errors import SearchError
from armdesign.fitness.block import BlockEvaluator
from armdesign.fitness.constraints import design_space
from armdesign.kinematics.dh import DHTable
from armdesign.search.evaluation import evaluate_on
from armdesign.settings.sections import Design, Solver

METRICS = ("geodesic", "euler", "axis")
EXACT = Solver(tolerance=1e-10, floor=1e-13, max_steps=500)  # so that rounding ends no frame a step sooner
THOROUGH = Solver(descents=64, max_steps=500)  # finds the start an arm's own motion has


def tables(n, count, seed=0):
    """Designs of the default search space."""
    space = design_space(Design(dof=n))
    return [space.table(Phi) for Phi in space.sample(np.random.default_rng(seed), count)]


def follow(table, problem):
    return BlockEvaluator(problem, block=2).follow(table)


def valid_paths(problem, count, seed=0):
    """Followed paths of random designs that reach the start."""
    for table in tables(problem.dof, count, seed):
        scores, path = follow(table, problem)
        if scores.valid[0]:
            yield table, scores, path


def fitness_of(table, problem):
    scores, _ = follow(table, problem)
    assert scores.valid[0]
    return np.array([scores.fitness[0], scores.path_fitness[0], scores.area[0]])


def turned_ratios(metric, mount, solver):
    """Robot fitness of random designs in a turned scene with a turned base, relative to that in the scene itself."""
    P, R = (values[::8] for values in recorded("welding"))
    turn = Rotation.from_euler("z", 1.234).as_matrix()
    options = {"w_0": 0.2, "orientation_metric": metric, "mount": mount, "solver": solver}
    still = problem_for(P, 5, WELDING, R=R, **options)
    turned = problem_for(P @ turn.T, 5, WELDING, R=turn @ R, **options)
    ratios = []
    for table, scores, _ in valid_paths(still, 12):
        other, _ = follow(DHTable(table.alpha, table.a, table.d, table.theta, 1.234), turned)
        assert other.valid[0]
        values = [(x.fitness[0], x.path_fitness[0], x.area[0]) for x in (other, scores)]
        ratios.append(np.divide(*values))
    assert len(ratios) >= 3
    return np.array(ratios)


@pytest.mark.parametrize("metric", METRICS)
def test_turning_the_scene_with_the_base_changes_nothing(metric):
    np.testing.assert_allclose(turned_ratios(metric, "identity", EXACT), 1.0, rtol=1e-5)


@pytest.mark.parametrize("metric", METRICS)
def test_turning_the_scene_changes_nothing_either_where_the_start_sets_the_mount(metric):
    """Starts that place the points equally well, the tool turned, are told apart by rounding: so for most arms."""
    ratios = turned_ratios(metric, "start", Solver())
    assert np.median(np.abs(ratios - 1.0)) < 1e-4
    assert (np.abs(ratios - 1.0).max(axis=1) < 1e-2).mean() >= 0.7


@pytest.mark.parametrize(("scale", "tolerance"), [(0.5, 1e-9), (4.0, 1e-9), (0.1, 1e-4), (3.0, 1e-4)])
def test_scaling_everything_scales_the_fitness(scale, tolerance):
    """To the last digits for powers of two; else rounding may end a frame a step sooner, within the solver's 1e-5."""
    P = recorded("packaging")[0][::4]
    plain = problem_for(P, 4, PACKAGING)
    scaled = problem_for(
        scale * P, 4, PACKAGING, delta=0.01 * scale, reach_tolerance=0.001 * scale,
        solver=Solver(floor=1e-9 * scale),
    )  # fmt: skip
    taken = 0
    for table, scores, path in valid_paths(plain, 12):
        other, again = follow(DHTable(table.alpha, scale * table.a, scale * table.d), scaled)
        np.testing.assert_allclose(again.q, path.q, atol=300.0 * tolerance)
        for name in ("fitness", "path_fitness", "area"):
            np.testing.assert_allclose(getattr(other, name), scale * getattr(scores, name), rtol=tolerance)
        taken += 1
    assert taken >= 3


@pytest.mark.parametrize("oriented", [False, True])
def test_showing_every_frame_twice_changes_nothing(oriented):
    """Up to the solver's tolerance: at its second showing a frame may be improved by 1e-5 of its fitness."""
    P, R = (values[:30] if values is not None else None for values in recorded("welding" if oriented else "packaging"))
    weights, w_0 = (WELDING, 0.2) if oriented else (PACKAGING, 0.0)
    options = {"w_0": w_0, "continuity": 60.0}  # the ball must not bind, or a frame shown twice allows twice the move
    once = problem_for(P, 4, weights, R=R, **options)
    twice = problem_for(np.repeat(P, 2, axis=0), 4, weights, R=np.repeat(R, 2, axis=0) if oriented else None, **options)
    ratios = []
    for table, _, path in valid_paths(once, 16, seed=1):
        moves = np.linalg.norm(np.diff(path.q, axis=0), axis=1)
        if moves.max() < np.deg2rad(30.0):
            # frame 0 holds the hand; at its second showing the hand is free, so compare from then on
            _, other = follow(table, twice)
            np.testing.assert_array_equal(other.q[0], path.q[0])
            ratios.append([other.g[3::2].mean() / path.g[1:].mean(), other.area[3::2].mean() / path.area[1:].mean()])
    assert len(ratios) >= 3
    assert np.abs(np.array(ratios) - 1.0).max() < 1e-3


@pytest.mark.parametrize(
    ("n", "mount"), [(2, "start"), (3, "start"), (2, "identity"), (3, "identity"), (4, "identity")]
)
def test_an_arm_follows_its_own_motion(n, mount):
    rng = np.random.default_rng([1, n])
    for _ in range(3):
        P, R, table, _ = reach_task(rng, n)
        problem = problem_for(P, n, (0.2, 0.2, 0.4), R=R, w_0=0.2, mount=mount, solver=THOROUGH)
        scores, path = follow(table, problem)
        assert scores.valid[0]
        assert path.orientation_error.max() < 1e-4
        assert scores.path_fitness[0] < 1e-6
        assert path.distance.max() < 1e-5


@pytest.mark.parametrize("n", [2, 3, 4, 5])
def test_own_positions_alone_are_followed_too(n):
    rng = np.random.default_rng([2, n])
    for _ in range(3):
        P, _, table, _ = reach_task(rng, n)
        scores, path = follow(table, problem_for(P, n, PACKAGING, solver=THOROUGH))
        assert scores.valid[0]
        assert scores.path_fitness[0] < 1e-6
        np.testing.assert_allclose(path.distance, 0.0, atol=1e-5)


@pytest.mark.parametrize("weights", [(0.0, 0.0, 1.0), (0.0, 0.3, 0.7), (0.5, 0.0, 0.5)])
def test_weightless_points_do_not_count(weights):
    P = recorded("packaging")[0][::4]
    rng = np.random.default_rng(3)
    nudged = P + rng.normal(0.0, 1e-6, P.shape) * (np.array(weights) == 0.0)[:, None]
    taken = 0
    for table, scores, path in valid_paths(problem_for(P, 4, weights), 8):
        expected = np.sqrt((path.distance**2 * weights).sum(axis=1)) / 3
        np.testing.assert_allclose(path.g, expected, atol=1e-15)
        other, _ = follow(table, problem_for(nudged, 4, weights))
        assert other.path_fitness[0] == pytest.approx(scores.path_fitness[0], rel=1e-3)
        taken += 1
    assert taken >= 2


LIMITS = {"wide": 180.0, "tight": 60.0}


@pytest.mark.parametrize("oriented", [False, True])
@pytest.mark.parametrize("span", LIMITS)
@pytest.mark.parametrize("eps", [10.0, 0.5])
def test_continuity_and_joint_limits_hold_in_every_frame(eps, span, oriented):
    P, R = (values[::6] for values in recorded("welding"))
    weights, w_0 = (WELDING, 0.2) if oriented else (PACKAGING, 0.0)
    bound, radius = np.deg2rad(LIMITS[span]), np.deg2rad(eps)
    problem = problem_for(P, 6, weights, R=R, w_0=w_0, limits=np.tile([-bound, bound], (6, 1)), continuity=eps)
    moved, at_limit, taken = 0, 0, 0
    for _, _, path in islice(valid_paths(problem, 40), 5):
        steps = np.linalg.norm(np.diff(path.q, axis=0), axis=1)
        assert steps.max() <= radius * (1.0 + 1e-9)
        assert np.abs(path.q).max() <= bound
        moved += (steps > 0.999 * radius).sum()
        at_limit += (np.abs(path.q) == bound).sum()
        taken += 1
    assert taken == 5
    assert eps > 1.0 or moved > 0  # both must have bound for this to mean anything
    assert span == "wide" or at_limit > 0


@pytest.mark.parametrize("eps", [20.0, 1000.0])
def test_a_speed_is_a_continuity_times_the_time_between_frames(eps):
    P = recorded("packaging")[0]
    by_frame = problem_for(P, 4, PACKAGING, continuity=eps * 0.02)
    by_speed = problem_for(P, 4, PACKAGING, continuity_speed=eps, dt=0.02)
    for table in tables(4, 8):
        first, second = follow(table, by_frame)[0], follow(table, by_speed)[0]
        assert first.fitness[0] == pytest.approx(second.fitness[0], rel=1e-12) or not first.valid[0]


@pytest.mark.parametrize("oriented", [False, True])
def test_a_frame_ends_where_no_allowed_small_step_improves_it(oriented):
    P, R = (values[::5] for values in recorded("welding"))
    weights, w_0 = (WELDING, 0.2) if oriented else (PACKAGING, 0.0)
    n, radius, bound = 5, np.deg2rad(10.0), np.deg2rad(120.0)
    problem = problem_for(P, n, weights, R=R, w_0=w_0, limits=np.tile([-bound, bound], (n, 1)))
    rng, probe, improved, total = np.random.default_rng(4), Probe(19, n), 0, 0
    for table, _, path in valid_paths(problem, 10):
        probe.load(table)
        for t in range(1, len(P)):
            q = np.clip(path.q[t] + 10.0 ** rng.uniform(-5, -2, (19, 1)) * rng.normal(size=(19, n)), -bound, bound)
            away = q - path.q[t - 1]
            q = path.q[t - 1] + away * np.minimum(1.0, radius / np.linalg.norm(away, axis=1))[:, None]
            probe.pose(q).look(P[t], weights, target=R[t] if oriented else None, w_0=w_0, mount=path.mount)
            improved += probe.frames["g"].min() < path.g[t] * (1.0 - 1e-4) - 1e-8
            total += 1
    assert total > 50
    assert improved <= 0.01 * total


def test_a_valid_start_is_within_its_tolerance_and_others_are_invalid():
    P = recorded("packaging")[0][:5]
    for tolerance in (1e-3, 1e-4):
        problem = problem_for(P, 3, PACKAGING, reach_tolerance=tolerance)
        kinds = set()
        for table in tables(3, 40):
            scores, path = follow(table, problem)
            kinds.add(bool(scores.valid[0]))
            if scores.valid[0]:
                tip = table.frames(path.q[0])[-1][:3, 3]
                assert np.linalg.norm(tip - P[0, -1]) <= tolerance + 1e-12
                assert scores.start_error[0] == pytest.approx(np.linalg.norm(tip - P[0, -1]), abs=1e-12)
                assert len(path.q) == len(P)
            else:
                assert scores.start_error[0] > tolerance
                assert np.isinf([scores.fitness[0], scores.path_fitness[0], scores.area[0]]).all()
                assert len(path.q) == 0
        assert kinds == {True, False}


def test_what_no_arm_reaches_is_invalid_and_says_how_far_it_is():
    P = recorded("packaging")[0][:5] * 5.0
    problem = problem_for(P, 3, PACKAGING)
    for table in tables(3, 10):
        scores, _ = follow(table, problem)
        short = np.linalg.norm(P[0, -1]) - table.length
        assert not scores.valid[0]
        assert scores.start_error[0] >= short
        with pytest.raises(SearchError, match="does not reach the first frame"):
            evaluate_on(table, problem)


def test_a_straight_arm_out_of_reach_stops_stretched():
    """An arm with crossing axes can point anywhere: it ends exactly its length short of a far point."""
    table = DHTable([0.0, np.pi / 2, np.pi / 2], [0.0, 0.0, 0.0], [0.0, 0.0, 0.8])
    far = np.array([[[0.3, 0.0, 0.2], [1.5, 0.4, 0.9]]])
    scores, _ = follow(table, problem_for(far, 2, (0.5, 0.5)))
    assert scores.start_error[0] == pytest.approx(np.linalg.norm(far[0, -1]) - 0.8, abs=1e-4)


@pytest.mark.parametrize("metric", METRICS)
def test_the_mount_takes_the_first_error_or_is_the_identity(metric):
    P, R = (values[::5] for values in recorded("welding"))
    free = problem_for(P, 5, WELDING, R=R, w_0=0.2, orientation_metric=metric, mount="start")
    fixed = problem_for(P, 5, WELDING, R=R, w_0=0.2, orientation_metric=metric, mount="identity")
    for table, _, path in valid_paths(free, 6):
        assert path.orientation_error[0] < 1e-7
        tool = table.frames(path.q[0])[-1][:3, :3]
        np.testing.assert_allclose(tool @ path.mount, R[0], atol=1e-12)
        np.testing.assert_allclose(path.mount @ path.mount.T, np.eye(3), atol=1e-12)
        _, other = follow(table, fixed)
        np.testing.assert_array_equal(other.mount, np.eye(3))


@pytest.mark.parametrize("name", ["packaging", "welding"])
def test_replaying_a_followed_path_gives_the_same_numbers(name):
    P, R = (None if values is None else values[::4] for values in recorded(name))
    weights, w_0 = (WELDING, 0.2) if name == "welding" else (PACKAGING, 0.0)
    problem = problem_for(P, 5, weights, R=R, w_0=w_0)
    evaluator = BlockEvaluator(problem, block=3)
    taken = 0
    for table in tables(5, 6):
        scores, path = evaluator.follow(table)
        if scores.valid[0]:
            again = evaluator.replay(table, path.q, path.mount)
            for field in ("q", "g", "area", "sigma", "distance", "orientation_error"):
                np.testing.assert_allclose(getattr(again, field), getattr(path, field), rtol=0.0, atol=1e-15)
            np.testing.assert_allclose(path.g.mean(), scores.path_fitness[0], rtol=1e-14)
            np.testing.assert_allclose(path.area.mean(), scores.area[0], rtol=1e-14)
            assert scores.fitness[0] == pytest.approx(15 * scores.path_fitness[0] + 5 * scores.area[0], rel=1e-15)
            taken += 1
    assert taken >= 2


def test_lambdas_weigh_the_two_means():
    P = recorded("packaging")[0][::5]
    problem = problem_for(P, 4, PACKAGING, lambda_f=2.0, lambda_E=0.5)
    for _, scores, path in valid_paths(problem, 6):
        assert scores.fitness[0] == pytest.approx(2.0 * path.g.mean() + 0.5 * path.area.mean(), rel=1e-13)


def test_a_finer_cut_of_the_arm_changes_the_area_little():
    P = recorded("packaging")[0][::5]
    table = next(valid_paths(problem_for(P, 4, PACKAGING), 10))[0]
    areas = [follow(table, problem_for(P, 4, PACKAGING, delta=delta))[0].area[0] for delta in (0.02, 0.01, 1e-3, 1e-4)]
    errors = np.abs(np.array(areas[:3]) - areas[3])
    assert errors[2] < 1e-5
    assert errors[1] < 5e-4


@pytest.mark.parametrize("n", [1, 2, 10])
def test_the_smallest_and_the_largest_arms_can_be_evaluated(n):
    rng = np.random.default_rng([5, n])
    P, _, table, _ = reach_task(rng, n, frames=40)
    result = evaluate_on(table, problem_for(P, n, PACKAGING, limits=full_turn(n)))
    assert result.path.q.shape == (40, n)
    assert result.path_fitness < (1e-6 if n < 3 else 0.02)


def test_negative_lengths_and_joint_offsets_are_followed():
    rng = np.random.default_rng(6)
    for _ in range(4):
        table = random_table(rng, 4, theta=True, negative=True, yaw=True, zeros=False)
        P, _, _, _ = reach_task(rng, 4, table=table)
        assert fitness_of(table, problem_for(P, 4, PACKAGING, solver=THOROUGH))[1] < 1e-6
