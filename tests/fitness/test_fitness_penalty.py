"""A penalty on the robot fitness: what it is given, where it counts, and its gradient."""

import numpy as np
import pytest
from scenes import PACKAGING, problem_for, recorded

from armdesign.fitness.constraints import design_space
from armdesign.fitness.objective import Demonstrations
from armdesign.fitness.robot import RobotFitness
from armdesign.settings.place import Site
from armdesign.settings.sections import Design, Solver

H = 1e-4


class Bent:
    """Mean square of the joint angles over all demonstrations beyond a bound, and the base's height above another."""

    def __init__(self, space, bound=0.0):
        self.space, self.bound, self.calls = space, bound, []

    def __call__(self, rows, bases, paths, turns):
        self.calls.append((rows, bases, paths, turns))
        excess = np.zeros(len(rows))
        gradient = None if turns is None else np.zeros((len(rows), len(self.space.names)))
        for k, q in enumerate(paths):
            assert np.isfinite(q).all()
            excess += np.maximum((q**2).mean(axis=(1, 2)) - self.bound, 0.0)
            if gradient is not None:
                part = 2.0 * np.einsum("ntj,ntje->ne", q, turns[k]) / q[0].size
                gradient += part * ((q**2).mean(axis=(1, 2)) > self.bound)[:, None]
        excess += bases[:, 11] ** 2
        if gradient is not None and "base_z" in self.space.names:
            gradient[:, self.space.names.index("base_z")] += 2.0 * bases[:, 11]
        return excess, gradient


def scene(placed, several, bound=0.0):
    P, _ = recorded("packaging")
    sites = [Site("floor", (-0.2, 0.2), (-0.2, 0.2), (-0.2, 0.2), (-2.0, 2.0))] if placed else ()
    space = design_space(Design(dof=3), sites)
    exact = Solver(tolerance=1e-14, floor=0.0, max_steps=400)
    how = {"solver": exact, "delta": 0.001, "continuity": 100.0}
    problems = [problem_for(part, 3, PACKAGING, **how) for part in (P[::10], P[3::10])]
    plain, penalty = RobotFitness(problems[0], space), Bent(space, bound)
    if several:
        return Demonstrations(problems, space), Demonstrations(problems, space, penalty=penalty), penalty, space
    return plain, RobotFitness(problems[0], space, penalty=penalty), penalty, space


@pytest.mark.parametrize("several", [False, True])
@pytest.mark.parametrize("placed", [False, True])
def test_excess_is_added_and_differentiated(placed, several):
    plain, fitness, penalty, space = scene(placed, several)
    designs = space.sample(np.random.default_rng(1), 250)
    before, after = plain.evaluate(designs)[0], fitness.evaluate(designs)[0]
    scored = np.isfinite(before.fitness)
    np.testing.assert_array_equal(after.valid, before.valid)
    np.testing.assert_array_equal(after.path_fitness, before.path_fitness)
    np.testing.assert_array_equal(after.fitness[scored], (before.fitness + after.excess)[scored])
    assert (after.excess[scored] > 0.0).all()
    assert (after.excess[~scored] == 0.0).all()
    rows, bases, paths, turns = penalty.calls[0]
    assert rows.shape == (scored.sum(), 4, 4)
    assert bases.shape == (scored.sum(), 12)
    assert len(paths) == (2 if several else 1)
    assert turns is None
    good = 0
    for k in np.flatnonzero(scored)[:4]:
        design, pose = designs[k : k + 1], after.q0[k : k + 1]
        slopes = fitness.evaluate(design, None, pose, slopes=True)[0].slopes[0]
        moved = np.vstack([design + h * np.eye(len(slopes)) for h in (H, -H)])
        values = fitness.evaluate(moved, None, np.tile(pose, (len(moved), 1)))[0].fitness.reshape(2, -1)
        differences = (values[0] - values[1]) / (2.0 * H)
        good += np.abs(slopes - differences).max() < 5e-3 * np.abs(differences).max()
    assert good >= 3  # now and then a difference meets a kink


@pytest.mark.parametrize("several", [False, True])
def test_without_an_excess_nothing_changes_to_the_last_bit(several):
    plain, fitness, _, space = scene(False, several, bound=1e9)
    designs = space.sample(np.random.default_rng(1), 60)
    before, after = plain.evaluate(designs, slopes=True)[0], fitness.evaluate(designs, slopes=True)[0]
    for name, values in vars(before).items():
        np.testing.assert_array_equal(getattr(after, name), values, err_msg=name)


def test_what_is_pruned_stays_pruned():
    plain, fitness, penalty, space = scene(False, False)
    designs = space.sample(np.random.default_rng(1), 60)
    whole = plain.evaluate(designs)[0].fitness
    cutoff = np.full(len(designs), np.median(whole[np.isfinite(whole)]))
    before, after = plain.evaluate(designs, cutoff)[0], fitness.evaluate(designs, cutoff)[0]
    np.testing.assert_array_equal(after.pruned, before.pruned)
    assert after.pruned.any()
    assert len(penalty.calls[0][0]) == np.isfinite(after.fitness).sum()
