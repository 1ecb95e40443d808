"""The design space: names, bounds, Omega_l by plain loops, and uniform samples of it."""

from __future__ import annotations

import numpy as np
import pytest

from armdesign.errors import DesignError, SettingsError
from armdesign.fitness.constraints import design_space, joint_limits
from armdesign.kinematics.dh import DHTable
from armdesign.search.arm_symmetry import length_slab
from armdesign.settings.sections import Design

SIZES = range(1, 11)


def plain_admissible(space, Phi):
    """Omega_l of method section 6, entry by entry."""
    entries = dict(zip(space.names, space.lower, strict=True))
    free = [name for name, low, high in zip(space.names, space.lower, space.upper, strict=True) if low < high]
    for name, value in zip(free, Phi, strict=True):
        index = space.names.index(name)
        if not space.lower[index] <= value <= space.upper[index]:
            return False
        entries[name] = value
    length = sum(abs(value) for name, value in entries.items() if name.startswith(("a_", "d_")))
    if not space.length[0] < length < space.length[1]:
        return False
    for i in range(1, space.dof):
        if abs(entries[f"alpha_{i}"]) < np.deg2rad(1.0) and abs(entries[f"a_{i}"]) < 1e-3:
            return False
    return True


@pytest.mark.parametrize("n", SIZES)
def test_default_freedom_has_3n_minus_1_entries(n):
    space = design_space(Design(dof=n))
    free = [name for name, chosen in zip(space.names, space.free, strict=True) if chosen]
    expected = ["alpha_0"]
    for i in range(1, n):
        expected += [f"alpha_{i}", f"a_{i}", f"d_{i}"]
    assert free == [*expected, "alpha_tool"]
    assert len(free) == 3 * n - 1
    lower, upper = space.bounds
    assert space.angular.tolist() == [name.startswith("alpha") for name in free]
    np.testing.assert_allclose(lower, np.where(space.angular, -np.pi / 2, 0.0))
    np.testing.assert_allclose(upper, np.where(space.angular, np.pi / 2, 0.5))


def test_table_and_phi_are_inverse():
    rng = np.random.default_rng(1)
    for n in SIZES:
        space = design_space(Design(dof=n, base_yaw=(-90.0, 90.0)))
        Phi = rng.uniform(*space.bounds)
        table = space.table(Phi)
        np.testing.assert_array_equal(space.phi(table), Phi)
        assert table.d[-1] == 0.1
        assert table.base_yaw == Phi[-1]
        rows, yaw = space.rows(Phi)
        np.testing.assert_array_equal(rows[0], np.stack([table.alpha, table.a, table.d, table.theta], axis=1))
        assert yaw[0] == table.base_yaw


def test_a_table_that_does_not_fit_is_refused():
    space = design_space(Design(dof=2))
    with pytest.raises(DesignError, match="3 joints"):
        space.phi(DHTable(np.zeros(4), np.zeros(4), np.zeros(4)))
    with pytest.raises(DesignError, match=r"d_0, a_tool"):
        space.phi(DHTable([0.1, 0.2, 0.3], [0.0, 0.1, 0.2], [0.3, 0.1, 0.1]))


@pytest.mark.parametrize("n", SIZES)
def test_lengths_and_omega_l_equal_plain_loops(n):
    rng = np.random.default_rng([2, n])
    space = design_space(Design(dof=n, a=(0.0, 0.3), d=(0.0, 0.3), length=(0.3, 1.0)))
    lower, upper = space.bounds
    Phi = lower + rng.uniform(-0.05, 1.05, (400, len(lower))) ** 2 * (upper - lower)
    for row in Phi[::3]:  # joints on one axis, or nearly
        for i in range(1, n):
            if rng.random() < 0.3:
                k = 1 + 3 * (i - 1)
                row[k], row[k + 1] = np.deg2rad(rng.uniform(-1.5, 1.5)), rng.uniform(0.0, 1.5e-3)
    expected = np.array([plain_admissible(space, row) for row in Phi])
    np.testing.assert_array_equal(space.admissible(Phi), expected)
    for row, length in zip(Phi[:50], space.lengths(Phi[:50]), strict=True):
        assert length == pytest.approx(space.table(row).length, abs=1e-15)


def test_the_ends_of_omega_l_are_open_and_the_bounds_closed():
    space = design_space(Design(dof=2, length=(0.5, 0.875), tool_length=0.125))
    Phi = np.array([[0.1, 0.5, 0.25, 0.25, 0.2]] * 8)
    Phi[1, 2:4] = 0.125, 0.25  # L = L_min
    Phi[2, 2:4] = 0.375, 0.375  # L = L_max
    Phi[3, 1:4] = np.deg2rad(1.0), 0.0, 0.45  # not below 1 deg: not on one axis
    Phi[4, 1:4] = np.deg2rad(0.99), 0.0, 0.45
    Phi[5, 1:4] = 0.0, 0.001, 0.45  # not below 1 mm
    Phi[6, 0] = np.pi / 2
    Phi[7, 0] = np.nextafter(np.pi / 2, 2.0)
    assert space.admissible(Phi).tolist() == [True, False, False, True, False, True, True, False]


@pytest.mark.parametrize("n", SIZES)
def test_samples_lie_in_omega_l(n):
    space = design_space(Design(dof=n, length=(0.3, 1.2) if n > 1 else (0.05, 1.2)))
    Phi = space.sample(np.random.default_rng(n), 500)
    assert Phi.shape == (500, 3 * n - 1)
    assert all(plain_admissible(space, row) for row in Phi)
    np.testing.assert_array_equal(Phi, space.sample(np.random.default_rng(n), 500))


@pytest.mark.parametrize(
    ("n", "settings"),
    [
        (2, {"length": (0.3, 1.0)}), (3, {"length": (0.6, 1.2)}), (4, {"length": (0.2, 0.9)}),
        (4, {"length": (0.6, 1.2)}), (3, {"length": (0.2, 0.7), "a": (-0.5, 0.5), "d": (-0.5, -0.1)}),
        (3, {"length": (0.3, 0.9), "a": (-0.2, 0.5), "d": (0.1, 0.5)}),
    ],
)  # fmt: skip
def test_samples_are_uniform(n, settings):
    """Means, spreads and quantiles are those of plain rejection from the box."""
    space, count = design_space(Design(dof=n, **settings)), 20000
    lower, upper = space.bounds
    rng, plain = np.random.default_rng(3), []
    while sum(map(len, plain)) < count:
        batch = rng.uniform(lower, upper, (200000, len(lower)))
        plain.append(batch[space.admissible(batch)])
    plain, drawn = np.concatenate(plain)[:count], space.sample(rng, count)
    scale = (upper - lower) / np.sqrt(count)
    assert (np.abs(drawn.mean(axis=0) - plain.mean(axis=0)) < 2.5 * scale).all()
    assert (np.abs(drawn.std(axis=0) - plain.std(axis=0)) < 2.0 * scale).all()
    lengths = [np.quantile(space.lengths(x), [0.1, 0.3, 0.5, 0.7, 0.9]) for x in (drawn, plain)]
    np.testing.assert_allclose(lengths[0], lengths[1], atol=0.01)
    products = [np.mean(x[:, 1] * x[:, 2]) for x in (drawn, plain)]
    assert products[0] == pytest.approx(products[1], abs=0.02)


def test_samples_respect_lower_bounds_of_lengths():
    bounds = {"a_1": (0.1, 0.5), "d_2": (0.2, 0.3), "d_tool": (0.05, 0.2), "alpha_1": (30.0, 60.0), "a_2": (0.25, 0.25)}
    space = design_space(Design(dof=5, bounds=bounds))
    Phi = space.sample(np.random.default_rng(4), 2000)
    assert all(plain_admissible(space, row) for row in Phi)
    tables = [space.table(row) for row in Phi[:200]]
    assert all(t.a[2] == 0.25 and 0.2 <= t.d[2] <= 0.3 and t.a[1] >= 0.1 for t in tables)


def test_lengths_of_either_sign_count_by_their_size():
    space = design_space(Design(dof=3, a=(-0.5, 0.5), bounds={"d_1": (-0.3, -0.1)}))
    assert space.reachable_lengths == pytest.approx((0.1 + 0.1, 0.1 + 0.5 + 0.5 + 0.3 + 0.5))
    Phi = space.sample(np.random.default_rng(4), 500)
    assert all(plain_admissible(space, row) for row in Phi)
    assert ((Phi < 0.0).any(axis=0) & (Phi > 0.0).any(axis=0)).sum() == 6  # four twists, two lengths
    slab = length_slab(space)  # every design of Omega_l lies in it
    assert ((Phi @ slab.weights > slab.low) & (Phi @ slab.weights < slab.high)).all()


def test_an_empty_space_is_an_error_with_a_way_out():
    with pytest.raises(SettingsError, match=r"length between 3 and 4 m.*Widen"):
        design_space(Design(dof=2, length=(3.0, 4.0))).sample(np.random.default_rng(5), 1)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"bounds": {"a_9": (0.0, 0.1)}}, "unknown entry 'design.bounds.a_9'"),
        ({"length": (1.2, 1.2)}, "L_min below L_max"),
        ({"alpha": (0.0, 0.0), "a": (0.1, 0.1), "d": (0.1, 0.1)}, "every entry of the design is fixed"),
    ],
)
def test_spaces_that_make_no_sense_are_refused(settings, message):
    with pytest.raises(SettingsError, match=message):
        design_space(Design(dof=3, **settings))


def test_bounds_of_single_entries_go_over_the_others():
    space = design_space(Design(dof=2, bounds={"alpha_1": (-30.0, 45.0), "a_0": (0.0, 0.2)}))
    named = dict(zip(space.names, zip(space.lower, space.upper, strict=True), strict=True))
    assert named["alpha_1"] == pytest.approx((np.deg2rad(-30.0), np.deg2rad(45.0)))
    assert named["a_0"] == (0.0, 0.2)
    assert named["base_yaw"] == (0.0, 0.0)


def test_joint_limits_are_one_pair_for_all_or_one_each():
    np.testing.assert_allclose(joint_limits(Design(dof=3)), np.tile([-np.pi, np.pi], (3, 1)))
    pairs = ((-90.0, 90.0), (0.0, 45.0))
    np.testing.assert_allclose(joint_limits(Design(dof=2, joint_limits=pairs)), np.deg2rad(pairs))
    with pytest.raises(SettingsError, match="2 pairs for 3 joints"):
        joint_limits(Design(dof=3, joint_limits=pairs))


PACKAGING_ARM = [(0.515, 0, 0), (-1.57, 0.11, 0), (-0.27, 0.5, 0), (-1.57, 0, 0.1)]
WELDING_ARM = [(-1.66, 0, 0), (-0.1, 0.09, 0.31), (0.86, 0, 0), (-0.2, 0.28, 0), (0.66, 0, 0), (-0.2, 0, 0.1)]


def test_the_published_arms_stand_in_omega_l_up_to_the_one_twist_beyond_its_bound():
    """Method section 8: alpha_0 = -1.66 of the second arm lies outside the published bounds of 90 deg."""
    for rows, length, inside in ((PACKAGING_ARM, 0.71, True), (WELDING_ARM, 0.78, False)):
        table = DHTable.from_rows(np.array(rows, dtype=float))
        assert table.length == pytest.approx(length, abs=1e-12)
        space = design_space(Design(dof=table.dof))
        assert space.admissible(space.phi(table)).tolist() == [inside]
        wider = design_space(Design(dof=table.dof, alpha=(-96.0, 96.0)))
        assert wider.admissible(wider.phi(table)).tolist() == [True]
