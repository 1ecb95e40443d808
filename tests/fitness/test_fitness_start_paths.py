"""Several starts carried along the whole path, the best path counts; and the hand reached in every frame."""

from __future__ import annotations

import numpy as np
import pytest
from scenes import PACKAGING, RECORDINGS, WELDING, problem_for, recorded

from armdesign.demonstration import read_recording
from armdesign.errors import SearchError
from armdesign.fitness.block import BlockEvaluator
from armdesign.fitness.constraints import design_space
from armdesign.fitness.kernels.solver_state import STATE
from armdesign.fitness.kernels.starts import SAME_POSE, TIE, keep_reaching
from armdesign.fitness.problem import start_effort
from armdesign.fitness.robot import RobotFitness
from armdesign.search.evaluation import evaluate_on
from armdesign.search.prepare import prepare
from armdesign.search.search import search
from armdesign.settings.sections import Design, Settings, Solver

TASKS = {"packaging": (3, PACKAGING, 0.0, 60), "welding": (4, WELDING, 0.2, 40)}
every_task = pytest.mark.parametrize("name", TASKS)
TOLERANCE = 0.15  # wide enough for some random designs to keep within it
FINALISTS = 8  # the same for any number of paths, so that they have the same starts to choose from


def setting(name, paths=1, **others):
    """Fitness and designs."""
    n, weights, w_0, count = TASKS[name]
    P, R = recorded(name)
    solver = Solver(start_paths=paths, finalists=FINALISTS)
    R = None if R is None else R[::8]
    problem = problem_for(P[::8], n, weights, R=R, w_0=w_0, solver=solver, **others)
    space = design_space(Design(dof=n))
    return RobotFitness(problem, space), space.sample(np.random.default_rng(32), count)


def scored(name, paths=1, **others):
    fitness, Phi = setting(name, paths, **others)
    return fitness.evaluate(Phi)[0]


@every_task
def test_more_paths_never_make_a_design_worse(name):
    one, two, eight = (scored(name, paths) for paths in (1, 2, 8))
    for fewer, more in ((one, two), (two, eight)):
        np.testing.assert_array_equal(more.valid, fewer.valid)
        assert (more.fitness[fewer.valid] <= fewer.fitness[fewer.valid]).all()
        same = (more.q0 == fewer.q0).all(axis=1)
        np.testing.assert_array_equal(more.fitness[same], fewer.fitness[same])
    assert (eight.fitness[one.valid] < one.fitness[one.valid]).any()
    assert (eight.frames >= one.frames).all()


@every_task
def test_the_best_path_is_that_of_its_own_start(name):
    """Walked alone from the start it tells, a design has the fitness it had as the best of eight."""
    fitness, Phi = setting(name, 8)
    scores = fitness.evaluate(Phi)[0]
    alone, _ = setting(name, 1)
    again = alone.evaluate(Phi[scores.valid], None, scores.q0[scores.valid])[0]
    close = np.abs(again.fitness / scores.fitness[scores.valid] - 1.0) < 1e-9
    assert close.mean() >= 0.9


@every_task
def test_pruning_among_several_paths_is_exact(name):
    fitness, Phi = setting(name, 8)
    full = fitness.evaluate(Phi)[0]
    rng = np.random.default_rng(33)
    dropped = 0
    for _ in range(3):
        cutoff = np.where(full.valid, full.fitness, 1.0) * rng.uniform(0.5, 1.5, len(Phi))
        scores = fitness.evaluate(Phi, cutoff)[0]
        kept = ~scores.pruned
        for column in ("fitness", "path_fitness", "area", "q0", "mount", "start_error"):
            np.testing.assert_array_equal(getattr(scores, column)[kept], getattr(full, column)[kept])
        np.testing.assert_array_equal(scores.valid, full.valid)
        assert (full.fitness[scores.pruned] > cutoff[scores.pruned]).all()
        dropped += scores.pruned.sum()
    assert dropped >= 3
    assert not fitness.evaluate(Phi, full.fitness)[0].pruned.any()
    np.testing.assert_array_equal(fitness.evaluate(Phi, np.full(len(Phi), -np.inf))[0].pruned, full.valid)


@every_task
def test_the_best_of_several_paths_does_not_depend_on_the_block(name):
    fitness, Phi = setting(name, 4)
    expected = vars(fitness.evaluate(Phi)[0])
    for block in (1, 5):
        scores = RobotFitness(fitness.problem, fitness.space, block).evaluate(Phi[::-1])[0]
        for column, values in expected.items():
            np.testing.assert_array_equal(getattr(scores, column)[::-1], values)


@every_task
def test_the_followed_path_is_the_best_one(name):
    fitness, Phi = setting(name, 8)
    scores, one = fitness.evaluate(Phi)[0], scored(name, 1)
    other = np.flatnonzero(scores.valid & (scores.q0 != one.q0).any(axis=1))
    assert len(other) > 0
    evaluator = BlockEvaluator(fitness.problem, block=1)
    for k in [*other[:3], *np.flatnonzero(scores.valid)[:3]]:
        found, path = evaluator.follow(fitness.space.table(Phi[k]))
        assert found.fitness[0] == scores.fitness[k]
        np.testing.assert_array_equal(path.q[0], scores.q0[k])
        np.testing.assert_array_equal(path.mount, scores.mount[k])
        assert path.start_error == scores.start_error[k]
        again = evaluator.replay(fitness.space.table(Phi[k]), path.q, path.mount)
        np.testing.assert_allclose(again.g.mean(), scores.path_fitness[k], rtol=1e-12)
        np.testing.assert_allclose(again.area.mean(), scores.area[k], rtol=1e-12)


def test_as_many_starts_are_solved_as_paths_are_wanted():
    for dof in (3, 6):
        for paths in (1, 4, 16):
            effort = start_effort(Solver(start_paths=paths), dof)
            assert effort.finalists == max(start_effort(Solver(), dof).finalists, paths)
            assert start_effort(Solver(start_paths=paths, finalists=3), dof).finalists == 3


@pytest.fixture
def keep():
    """Offer solved starts (q_1, g) to an empty solver state; returns those kept."""

    def offer(starts, limit):
        state = np.zeros(1, dtype=STATE).view(np.recarray)[0]
        for q, g in starts:
            state["q"][0] = q
            keep_reaching.py_func(state, 2, g, 0.0, limit)
        count = int(state["start_count"])
        return list(zip(state["start_q"][:count, 0].tolist(), state["start_g"][:count].tolist(), strict=True))

    return offer


def test_the_best_starts_are_kept_best_first_and_each_pose_once(keep):
    rng = np.random.default_rng(1)
    for limit in (1, 3, 8, 16):
        starts = list(zip(np.arange(12.0).tolist(), rng.permutation(np.arange(1.0, 13.0)).tolist(), strict=True))
        assert keep(starts, limit) == sorted(starts, key=lambda start: start[1])[:limit]
    near = 0.1 * SAME_POSE
    assert keep([(0.0, 10.0), (near, 5.0), (2 * near, 8.0)], 4) == [(near, 5.0)]
    assert keep([(0.0, 10.0), (1.0, 7.0), (near, 5.0)], 4) == [(near, 5.0), (1.0, 7.0)]
    assert keep([(0.0, np.nan), (1.0, np.inf)], 4) == []


def test_the_first_of_several_starts_is_the_only_one_of_one(keep):
    """Also among starts that are equal but for the last bits."""
    rng = np.random.default_rng(2)
    for _ in range(300):
        g = 1.0 + rng.choice([0.0, 0.3, 0.7, 1.2, 2.5], 8) * (1.0 - TIE)
        starts = list(zip((rng.integers(0, 5, 8) * 0.6 * SAME_POSE).tolist(), g.tolist(), strict=True))
        assert keep(starts, 1)[0] == keep(starts, 3)[0] == keep(starts, 8)[0]


@every_task
@pytest.mark.parametrize("paths", [1, 4])
def test_with_every_frame_to_be_reached_valid_are_those_that_stay_near(name, paths):
    """A design is valid at all frames with a tolerance exactly if its path at the start alone keeps within it."""
    fitness, Phi = setting(name, paths, reach_tolerance=TOLERANCE, reach_frames="all")
    strict, removed = fitness.evaluate(Phi)
    only, _ = setting(name, 1, reach_tolerance=TOLERANCE)
    evaluator = BlockEvaluator(only.problem, block=1)
    both = set()
    for k in np.flatnonzero(only.evaluate(Phi)[0].valid):
        scores, path = evaluator.follow(only.space.table(Phi[k]))
        miss = path.distance[:, -1]
        near = bool((miss <= TOLERANCE).all())
        both.add(near)
        if near and paths == 1:
            assert strict.valid[k]
            assert strict.fitness[k] == scores.fitness[0]
        if paths == 1 and not near:
            frame = int(np.argmax(miss > TOLERANCE))
            assert not strict.valid[k]
            assert strict.miss_frame[k] == frame
            assert strict.miss[k] == pytest.approx(miss[frame], abs=1e-12)
            assert np.isinf(strict.fitness[k])
        assert not near or strict.valid[k]
    assert both == {True, False}
    assert removed.path == (strict.miss_frame > 0).sum() > 0
    assert removed.constraints + removed.reach + removed.start + removed.path + strict.valid.sum() == len(Phi)


@every_task
def test_the_end_effector_counts_even_where_the_hand_is_not_tied_to_it(name):
    fitness, Phi = setting(name, 1, reach_tolerance=TOLERANCE, reach_frames="all", tie_hand=False)
    scores = fitness.evaluate(Phi)[0]
    assert scores.valid.any()
    for k in np.flatnonzero(scores.valid)[:4]:
        table = fitness.space.table(Phi[k])
        _, path = BlockEvaluator(fitness.problem, 1).follow(table)
        tips = np.array([table.frames(q)[-1][:3, 3] for q in path.q])
        assert np.linalg.norm(tips - fitness.problem.P[:, -1], axis=1).max() <= TOLERANCE + 1e-12


@every_task
def test_a_free_hand_leaves_the_valid_designs_what_they_are(name):
    """It is the end-effector that has to reach the start, whichever place of the arm the hand may take later."""
    tied, free = (scored(name, 1, tie_hand=tie) for tie in (True, False))
    np.testing.assert_array_equal(free.valid, tied.valid)
    fitness, Phi = setting(name, 1, tie_hand=False)
    loose, taken = BlockEvaluator(fitness.problem, 1), 0
    for k in np.flatnonzero(free.valid)[:12]:
        scores, path = loose.follow(fitness.space.table(Phi[k]))
        assert scores.fitness[0] == free.fitness[k]
        last = path.sigma[:, -1]
        assert (path.sigma[:, -2] <= last).all()
        fixed = BlockEvaluator(setting(name)[0].problem, 1).replay(fitness.space.table(Phi[k]), path.q, path.mount)
        assert (path.distance[:, -1] <= fixed.distance[:, -1] + 1e-12).all()  # the nearest place is no farther
        taken += int((last < 1.0).any())
    assert taken > 0


@every_task
@pytest.mark.parametrize("paths", [1, 4])
def test_no_cutoff_hides_that_a_frame_is_not_reached(name, paths):
    """Validity moves the swarm, so a candidate must not be dropped before it is known."""
    fitness, Phi = setting(name, paths, reach_tolerance=TOLERANCE, reach_frames="all")
    full = fitness.evaluate(Phi)[0]
    for cutoff in (-np.inf, 0.0, 0.5):
        scores = fitness.evaluate(Phi, np.full(len(Phi), cutoff))[0]
        np.testing.assert_array_equal(scores.valid, full.valid)
        np.testing.assert_array_equal(scores.fitness, full.fitness)


def test_a_search_in_which_every_arm_loses_the_hand_says_so():
    changes = {
        "task": {"stop": 0.6},
        "fitness": {"reach_frames": "all", "reach_tolerance": 0.002},
        "search": {"particles": 30, "iterations": 1},
    }
    prepared = prepare(read_recording(RECORDINGS["packaging"]), Settings().replace(changes))
    with pytest.raises(SearchError, match=r"within 2 mm of the hand in every frame, though some reach it at the start"):
        search(prepared)


def test_an_arm_that_loses_the_hand_is_told_where():
    fitness, Phi = setting("packaging", reach_tolerance=0.01, reach_frames="all")
    scores = fitness.evaluate(Phi)[0]
    k = int(np.argmax(scores.miss_frame))
    frame, miss = int(scores.miss_frame[k]), float(scores.miss[k])
    assert frame > 0
    with pytest.raises(SearchError, match=rf"frame {frame + 1}: .* {1e3 * miss:.2f} mm from the hand"):
        evaluate_on(fitness.space.table(Phi[k]), fitness.problem)
    _, path = BlockEvaluator(fitness.problem, 1).follow(fitness.space.table(Phi[k]))
    assert len(path.q) == frame
