"""An extra joint of zero length leaves the arm as it is."""

import numpy as np
import pytest

from armdesign.experiments.auto_dof.extra_joint import with_extra_joint
from armdesign.fitness.constraints import design_space
from armdesign.settings.sections import Design


def arms(n, **settings):
    space = design_space(Design(dof=n, **settings))
    return [space.table(Phi) for Phi in space.sample(np.random.default_rng(n), 4)]


@pytest.mark.parametrize("n", [2, 3, 6])
def test_at_rest_every_frame_of_the_arm_is_among_those_of_the_longer_one(n):
    longer = design_space(Design(dof=n + 1))
    rng = np.random.default_rng(0)
    for table in arms(n):
        q = rng.uniform(-np.pi, np.pi, n)
        frames = table.frames(q)
        for Phi in with_extra_joint(table, longer, 1000):
            extended = longer.table(Phi)
            still = [extended.frames(np.insert(q, k, 0.0)) for k in range(n + 1)]
            assert extended.length == pytest.approx(table.length, abs=1e-12)
            # inserted in front of row k: the other frames are the arm's own, the tool's included
            assert any(np.allclose(np.delete(there, k, axis=0), frames, atol=1e-12) for k, there in enumerate(still))


def test_designs_are_admissible_and_every_row_has_one():
    n = 3
    longer = design_space(Design(dof=n + 1))
    for table in arms(n):
        designs = with_extra_joint(table, longer, 1000)
        assert longer.admissible(designs).all()
        where = {np.flatnonzero((rows[:, 1:3] == 0.0).all(axis=1))[-1] for rows in longer.rows(designs)[0]}
        assert where >= {1, 2, 3}


def test_no_more_than_asked():
    assert len(with_extra_joint(arms(3)[0], design_space(Design(dof=4)), 5)) == 5


def test_bounds_without_room_for_zero_length_give_none():
    longer = design_space(Design(dof=4, a=(0.05, 0.5)))
    assert with_extra_joint(arms(3, a=(0.05, 0.5))[0], longer, 100).shape == (0, len(longer.bounds[0]))


def test_fixed_entries_stay_fixed():
    settings = {"bounds": {"alpha_0": [-90.0, -90.0]}, "base_yaw": [-30.0, 30.0]}
    longer = design_space(Design(dof=4, **settings))
    table = arms(3, **settings)[0]
    designs = with_extra_joint(table, longer, 1000)
    assert len(designs)
    for Phi in designs:
        assert longer.table(Phi).alpha[0] == longer.lower[0]
        assert longer.table(Phi).base_yaw == table.base_yaw
