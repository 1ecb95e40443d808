"""Designs as a search algorithm sees them: which are the same arm, how far arms are apart, and their length."""

from __future__ import annotations

import numpy as np
import pytest

from armdesign.fitness.constraints import design_space
from armdesign.kinematics.dh import DHTable
from armdesign.search.arm_symmetry import arm_distances, canonical_form, different_arms, length_slab
from armdesign.settings.sections import Design


def test_no_design_is_in_canonical_form():
    space = design_space(Design(dof=4))
    assert canonical_form(space)(np.zeros((0, 11))).shape == (0, 11)


def axes_and_corners(table, q):
    """Joint axes and the corners of the skeleton at joint angles q, by the matrices of eq. 2."""
    T, axes, corners = np.eye(4), [], [np.zeros(3)]
    for i in range(table.dof + 1):
        c, s = np.cos(table.alpha[i]), np.sin(table.alpha[i])
        T = T @ np.array([[1, 0, 0, table.a[i]], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])
        corners.append(T[:3, 3])
        T = T @ np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, table.d[i]], [0, 0, 0, 1.0]])
        corners.append(T[:3, 3])
        if i < table.dof:
            axes.append(T[:3, 2])
            c, s = np.cos(q[i]), np.sin(q[i])
            T = T @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    return np.array(axes), np.array(corners)


def test_canonical_form_is_the_same_arm():
    rng, space = np.random.default_rng(0), design_space(Design(dof=5))
    Phi = space.sample(rng, 40)
    a = np.flatnonzero([name.startswith("a_") for name in np.array(space.names)[space.free]])
    Phi[:, a] += 0.002  # none nearly meet
    for design in Phi:
        design[rng.permutation(a)[:2]] = 0.0
    for before, after in zip(space.full(Phi), space.full(canonical_form(space)(Phi)), strict=True):
        one, other = (DHTable.from_rows(entries[:-1].reshape(6, 3)) for entries in (before, after))
        turned = np.sign(before[:-1].reshape(6, 3)[:, 0]) != np.sign(after[:-1].reshape(6, 3)[:, 0])
        q = rng.uniform(-3, 3, 5)
        moved = q.copy()
        for i in np.flatnonzero(turned):  # half a turn before the row, and one behind it
            moved[i - 1] += np.pi
            if i < 5:
                moved[i] += np.pi
        for seen, again in zip(axes_and_corners(one, q), axes_and_corners(other, moved), strict=True):
            assert np.allclose(seen, again, atol=1e-12)


def test_canonical_form_of_a_canonical_form_is_itself():
    space = design_space(Design(dof=4))
    Phi = space.sample(np.random.default_rng(1), 50)
    once = canonical_form(space)(Phi)
    assert np.array_equal(canonical_form(space)(once), once)
    assert np.allclose(space.lengths(once), space.lengths(Phi))


def written_otherwise(table, turned, behind, q):
    """The same arm with some axes turned round and some rows told from behind, and its joint angles."""
    rows, angles = np.c_[table.alpha, table.a, table.d], q.copy()
    for i in np.flatnonzero(turned):
        rows[i] += [np.pi, 0.0, -2.0 * rows[i, 2]]
        rows[i + 1, 0] -= np.pi
        angles[i] *= -1.0
    for i in np.flatnonzero(behind):  # half a turn before the row, and one behind it
        rows[i, :2] *= -1.0
        angles[i - 1] += np.pi
        if i < len(q):
            angles[i] -= np.pi
    return rows, angles


def test_the_same_arm_written_otherwise_is_no_other_arm():
    rng, space = np.random.default_rng(4), design_space(Design(dof=4))
    for phi, other in zip(space.sample(rng, 30), space.sample(rng, 30), strict=True):
        table, q = space.table(phi), rng.uniform(-3, 3, 4)
        rows, angles = written_otherwise(table, rng.random(4) < 0.5, np.r_[False, rng.random(4) < 0.5], q)
        again = DHTable.from_rows(rows)
        _, corners = axes_and_corners(table, q)
        assert np.allclose(axes_and_corners(again, angles)[1], corners, atol=1e-12)
        twin = np.r_[rows.reshape(-1), 0.0][space.free]
        assert arm_distances(space, phi, twin[None])[0] < 1e-6
        apart = arm_distances(space, phi, np.vstack([other, phi]))
        assert apart[0] == pytest.approx(arm_distances(space, twin, other[None])[0], abs=1e-6)
        assert apart[0] == pytest.approx(arm_distances(space, other, phi[None])[0], abs=1e-9)
        assert apart[0] > 0.01
        assert apart[1] == 0.0


def test_slab_is_the_length():
    space = design_space(Design(dof=4, bounds={"a_1": (0.1, 0.1)}))
    Phi, slab = space.sample(np.random.default_rng(2), 50), length_slab(space)
    assert np.allclose(Phi @ slab.weights - slab.low, space.lengths(Phi) - space.length[0])
    assert np.allclose(slab.high - slab.low, space.length[1] - space.length[0])


def test_twins_count_once():
    space = design_space(Design(dof=4))
    Phi = space.sample(np.random.default_rng(3), 1)
    twin = Phi.copy()
    twin[0, -1] *= -1.0  # the tool's twist, whose a is 0
    assert different_arms(np.vstack([Phi, twin]), space, 0.01, 9) == [0]
