"""What a search looks at on the way: the demonstration on some of its frames, with a lighter start."""

import numpy as np
import pytest

from armdesign.cell.obstacles import Obstacle, Obstacles, Sphere
from armdesign.search.backends.backend import InProcess
from armdesign.search.search import Search
from armdesign.search.swarms import parameters

THIN = {"body": {"kind": "thin"}, "design": {"dof": 3}}


def scores(problem, Phi, poses=None):
    return problem.objective().evaluate(Phi, None, poses)[0]


def test_with_all_frames_a_known_start_gives_the_fitness_itself(prepared_for):
    problem = prepared_for(**THIN)
    Phi = problem.space.sample(np.random.default_rng(0), 60)
    full = scores(problem, Phi)
    assert full.valid.sum() > 3
    again = scores(problem.coarse(10**6), Phi[full.valid], full.q0[full.valid])
    assert np.array_equal(again.fitness, scores(problem, Phi[full.valid], full.q0[full.valid]).fitness)


@pytest.mark.parametrize("frames", [2, 7, 40])
def test_frames_run_from_the_first_to_the_last_at_the_same_speed(prepared_for, frames):
    problem = prepared_for(**THIN)
    coarse, whole = problem.coarse(frames), problem.path_problem
    count = max(frames, 3)
    assert coarse.path_problem.frames == count
    assert np.array_equal(coarse.task.P[[0, -1]], problem.task.P[[0, -1]])
    stride = np.ceil((whole.frames - 1) / (count - 1))
    assert coarse.path_problem.record["radius"][0] == pytest.approx(stride * whole.record["radius"][0])


def test_what_looks_good_is_good(prepared_for):
    problem = prepared_for(**THIN)
    Phi = problem.space.sample(np.random.default_rng(1), 200)
    full, looks = scores(problem, Phi), scores(problem.coarse(40), Phi)
    known = full.valid & looks.valid
    assert known.sum() > 10
    ranks = [np.argsort(np.argsort(each.fitness[known])) for each in (full, looks)]
    assert np.corrcoef(*ranks)[0, 1] > 0.9


def test_what_moves_is_where_it_was_in_those_frames():
    poses = np.tile(np.eye(4), (9, 1, 1))
    poses[:, 0, 3] = np.arange(9)
    room = Obstacles((Obstacle("still", Sphere(0.1), np.eye(4)), Obstacle("moving", Sphere(0.1), poses)))
    still, moving = room.thinned(np.array([0, 4, 8])).each
    assert still.pose.shape == (4, 4)
    assert moving.pose[:, 0, 3].tolist() == [0, 4, 8]


def test_what_was_looked_at_coarsely_never_counts(prepared_for):
    problem = prepared_for(**THIN, search={"algorithm": "multibasin", "budget": 900})
    run, best = Search(problem, InProcess(problem)), np.inf
    while run.ended_by() is None:
        X, hints, coarse = run.swarm.ask(), run.swarm.hints, run.swarm.coarse
        run.advance()
        pure = np.ones(len(X), dtype=bool) if hints is None else np.isnan(hints).all(axis=1)
        if not coarse and pure.any():
            best = min(best, scores(problem, X[pure]).fitness.min())
    assert run.swarm.best_fitness == best == run.leader[0]


def test_a_coarse_look_at_a_sample_is_doubted_with_many_joints_and_where_the_base_is_placed(prepared_for):
    placed = {"cell": {"place": ["x=0.2..0.4 y=-0.3..0.1 z=0.9"]}}
    for changes, doubted in (({}, False), ({"design": {"dof": 5}}, True), (placed, True)):
        problem = prepared_for(**THIN | changes).in_room
        assert parameters(problem.settings.search, problem.space)["doubted"] == doubted
