"""The search for a base pose: never worse than the plain pose, in its box, the same every time."""

from __future__ import annotations

import numpy as np
import pytest
from compare_arms import evaluator, example_problem

from armdesign.errors import SettingsError
from armdesign.experiments.compare.base_pose import PLAIN, BaseSearch, Region, mount_arm, spread_poses
from armdesign.experiments.compare.polyline_arm import PolylineEvaluator, arm_problem
from armdesign.experiments.compare.ready_made import open_ready_made
from armdesign.kinematics.base_pose import placed_base
from armdesign.settings.place import Site
from armdesign.settings.sections import Solver

FEW = Solver(starts=64, descents=12, finalists=3)


def mounted(name, how, on_progress=None):
    start = example_problem()
    return mount_arm(open_ready_made(name), start.task, start.settings.fitness, FEW, how, on_progress)


def plain(name):
    """r with the base at the shoulder."""
    start, arm = example_problem(), open_ready_made(name)
    problem = arm_problem(arm, start.task.P, None, start.task.dt, start.settings.fitness, FEW)
    return PolylineEvaluator(problem, arm).follow_from(np.zeros(4))[0].fitness[0]


@pytest.mark.parametrize(("name", "evaluations"), [("ur3", 1), ("ur5", 60)])
def test_it_is_never_worse_than_the_plain_pose(name, evaluations):
    assert mounted(name, BaseSearch(evaluations)).scores.fitness[0] <= plain(name)


def test_a_box_of_no_width_leaves_only_the_turn():
    base = mounted("ur3", BaseSearch(40, half_width=0.0)).base
    np.testing.assert_array_equal(base[:3], 0.0)
    assert -np.pi < base[3] <= np.pi


def test_it_is_the_same_every_time_and_another_with_another_seed():
    how = BaseSearch(60, seed=3)
    first, second = mounted("ur3", how), mounted("ur3", how)
    np.testing.assert_array_equal(first.base, second.base)
    assert first.scores.fitness[0] == second.scores.fitness[0]
    assert not np.array_equal(first.base, mounted("ur3", BaseSearch(60, seed=4)).base)


def test_the_fitness_seen_is_that_of_the_base_seen():
    found = mounted("ur3", BaseSearch(60, half_width=0.2))
    start = example_problem()
    assert (np.abs(found.base[:3]) <= 0.2).all()
    arm = open_ready_made("ur3")
    again, _ = evaluator(arm, start.task.P, fitness=start.settings.fitness, **vars(FEW)).follow_from(found.base)
    assert again.fitness[0] == found.scores.fitness[0]
    assert found.path.q.shape == (len(start.task.P), 6)


def test_progress_grows_to_the_total_and_r_falls():
    seen = []
    found = mounted("ur3", BaseSearch(100), seen.append)
    assert [p.evaluations for p in seen] == sorted(p.evaluations for p in seen)
    assert seen[-1].evaluations == seen[-1].total == 100
    assert abs(found.evaluations - 100) <= 24
    swarm = [p.fitness for p in seen if p.evaluations > 50]
    assert swarm == sorted(swarm, reverse=True)
    assert found.scores.fitness[0] <= swarm[-1] * (1 + 1e-9)


def test_the_first_poses_fill_the_box():
    half = np.array([0.4, 0.4, 0.4, np.pi])
    poses = spread_poses(Region(-half, half, PLAIN), BaseSearch(2048), np.random.default_rng(0))
    np.testing.assert_array_equal(poses[0], 0.0)
    scaled = poses[1:] / [0.4, 0.4, 0.4, np.pi]
    assert np.abs(scaled).max() <= 1.0
    for column in scaled.T:  # evenly: every tenth of the range holds about a tenth of the poses
        counts = np.histogram(column, bins=10, range=(-1, 1))[0]
        assert counts.min() > 90
        assert counts.max() < 115


def test_a_base_is_sought_in_the_sites_alone_and_seen_from_there():
    start, arm = example_problem(), open_ready_made("ur3")
    places = [
        Site("wall", (-0.3, -0.3), (-0.2, 0.2), (-0.1, 0.3), (-0.5, 0.5)),
        Site("floor", (0.1, 0.3), (0.0, 0.0), (-0.5, -0.2)),
    ]
    found = mount_arm(arm, start.task, start.settings.fitness, FEW, BaseSearch(80), sites=places)
    site = next(place for place in places if place.mounted == found.mounted)
    assert (np.clip(found.base[:3], *site.box) == found.base[:3]).all()
    # the fitness is that of the task seen from the base, with the arm at the origin
    base = placed_base(found.base[:3], found.base[3], found.mounted)
    P = base.inside(start.task.P)
    again, _ = evaluator(arm, P, fitness=start.settings.fitness, **vars(FEW)).follow_from(PLAIN)
    np.testing.assert_allclose(again.fitness, found.scores.fitness, rtol=1e-6)


def test_an_arm_out_of_reach_has_no_path_but_the_nearest_base():
    found = mounted("so100", BaseSearch(20, half_width=0.0))
    assert not found.scores.valid[0]
    assert found.scores.start_error[0] > 0.001
    assert len(found.path.q) == 0


@pytest.mark.parametrize("wrong", [{"evaluations": 0}, {"half_width": -1.0}, {"half_width": np.nan}, {"seed": -1}])
def test_settings_out_of_range_are_refused(wrong):
    with pytest.raises(SettingsError, match="allowed"):
        BaseSearch(**wrong)
