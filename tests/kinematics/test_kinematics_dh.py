"""DH tables: products of elementary motions, exact conversion between the conventions, errors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from armdesign.errors import DesignError
from armdesign.kinematics.dh import DHTable, rot_x, rot_z, translation

SIZES = range(1, 11)


def elementary(axis=None, angle=0.0, at=(0.0, 0.0, 0.0)):
    pose = np.eye(4)
    pose[:3, 3] = at
    if axis:
        pose[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
    return pose


def modified_product(rows, q, yaw):
    """Eq. 2: Rz(yaw) then Rx(alpha) Tx(a) Tz(d) Rz(theta + q) row by row."""
    pose, frames = elementary("z", yaw), []
    for (alpha, a, d, theta), angle in zip(rows, [*q, 0.0], strict=True):
        pose = pose @ elementary("x", alpha) @ elementary(at=(a, 0, 0)) @ elementary(at=(0, 0, d))
        pose = pose @ elementary("z", theta + angle)
        frames.append(pose)
    return np.array(frames)


def classic_product(rows, q):
    """Distal DH: Rz(theta + q) Tz(d) Tx(a) Rx(alpha) row by row."""
    pose = np.eye(4)
    for (alpha, a, d, theta), angle in zip(rows, q, strict=True):
        pose = pose @ elementary("z", theta + angle) @ elementary(at=(0, 0, d))
        pose = pose @ elementary(at=(a, 0, 0)) @ elementary("x", alpha)
    return pose


def random_rows(rng, count):
    return np.c_[rng.uniform(-3, 3, count), rng.uniform(-1, 1, (count, 2)), rng.uniform(-3, 3, count)]


def test_elementary_motions_equal_scipy_rotations():
    rng = np.random.default_rng(0)
    for angle in rng.uniform(-7, 7, 20):
        np.testing.assert_allclose(rot_x(angle), elementary("x", angle), atol=1e-15)
        np.testing.assert_allclose(rot_z(angle), elementary("z", angle), atol=1e-15)
    np.testing.assert_array_equal(translation(1.0, 2.0, 3.0), elementary(at=(1, 2, 3)))


@pytest.mark.parametrize("n", SIZES)
def test_frames_are_the_product_of_the_rows(n):
    rng = np.random.default_rng([1, n])
    for _ in range(20):
        rows, q, yaw = random_rows(rng, n + 1), rng.uniform(-4, 4, n), rng.uniform(-4, 4)
        frames = DHTable.from_rows(rows, yaw).frames(q)
        np.testing.assert_allclose(frames, modified_product(rows, q, yaw), atol=1e-13)


@pytest.mark.parametrize("n", SIZES)
def test_placements_chain_to_the_frames(n):
    rng = np.random.default_rng([2, n])
    rows, q, yaw = random_rows(rng, n + 1), rng.uniform(-4, 4, n), rng.uniform(-4, 4)
    table = DHTable.from_rows(rows, yaw)
    pose = np.eye(4)
    for placement, angle, frame in zip(table.placements(), [*q, 0.0], table.frames(q), strict=True):
        pose = pose @ placement @ elementary("z", angle)
        np.testing.assert_allclose(pose, frame, atol=1e-13)
    np.testing.assert_array_equal(table.base(), rot_z(yaw))


@pytest.mark.parametrize("n", SIZES)
def test_classic_tables_convert_without_a_change(n):
    rng = np.random.default_rng([3, n])
    for _ in range(20):
        rows, q = random_rows(rng, n), rng.uniform(-4, 4, n)
        table = DHTable.from_classic(rows)
        assert table.dof == n
        np.testing.assert_allclose(table.frames(q)[-1], classic_product(rows, q), atol=1e-13)
        without_theta = DHTable.from_classic(rows[:, :3])
        np.testing.assert_allclose(without_theta.frames(q + rows[:, 3])[-1], classic_product(rows, q), atol=1e-13)


@pytest.mark.parametrize("n", SIZES)
def test_classic_form_of_a_table_is_the_same_arm(n):
    rng = np.random.default_rng([4, n])
    for _ in range(20):
        table = DHTable.from_rows(random_rows(rng, n + 1), rng.uniform(-4, 4))
        classic, q = table.to_classic(), rng.uniform(-4, 4, n)
        np.testing.assert_allclose(classic.pose(q), table.frames(q)[-1], atol=1e-13)
        np.testing.assert_allclose(classic.base @ classic_product(classic.rows, q) @ classic.tool, classic.pose(q))


def test_conversion_there_and_back_keeps_every_number():
    rng = np.random.default_rng(5)
    for n in SIZES:
        rows = random_rows(rng, n)
        classic = DHTable.from_classic(rows).to_classic()
        np.testing.assert_array_equal(classic.rows, rows)
        np.testing.assert_array_equal(classic.base, np.eye(4))
        np.testing.assert_array_equal(classic.tool, np.eye(4))


def test_length_is_the_sum_of_all_pieces():
    table = DHTable([0.1, 0.2, 0.3], [0.0, -0.4, 0.1], [0.2, 0.0, -0.1])
    assert table.length == pytest.approx(0.8, abs=1e-15)


def test_tables_are_read_only_and_unlinked():
    alpha = np.zeros(2)
    table = DHTable(alpha, [0.0, 0.1], [0.0, 0.1])
    alpha[0] = 1.0
    assert table.alpha[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        table.alpha[0] = 1.0
    np.testing.assert_array_equal(table.theta, np.zeros(2))


def test_a_turned_base_turns_every_frame():
    rng = np.random.default_rng(6)
    rows, q = random_rows(rng, 5), rng.uniform(-4, 4, 4)
    np.testing.assert_allclose(
        DHTable.from_rows(rows, 0.7).frames(q), rot_z(0.7) @ DHTable.from_rows(rows).frames(q), atol=1e-14
    )


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        (([0.0], [0.0], [0.0]), "tool row"),
        (([0.0, 0.0], [0.0], [0.0, 0.0]), "column 'a'"),
        (([0.0, np.nan], [0.0, 0.0], [0.0, 0.0]), "not finite"),
        (([0.0, 0.0], [0.0, np.inf], [0.0, 0.0]), "not finite"),
        (([0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0, 0.0]), "column 'theta'"),
        (([[0.0, 0.0]], [0.0], [0.0]), "column"),
        (([0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0], np.nan), "base_yaw"),
    ],
)
def test_tables_that_make_no_sense_are_refused(columns, message):
    with pytest.raises(DesignError, match=message):
        DHTable(*columns)


@pytest.mark.parametrize("rows", [np.zeros((3, 2)), np.zeros(3), np.zeros((2, 5)), np.zeros((2, 2, 3))])
def test_rows_of_another_shape_are_refused(rows):
    with pytest.raises(DesignError, match="shape"):
        DHTable.from_rows(rows)
    with pytest.raises(DesignError, match="shape"):
        DHTable.from_classic(rows)


def test_angles_of_another_number_are_refused():
    table = DHTable.from_rows(np.zeros((3, 3)))
    for q in (np.zeros(1), np.zeros(3), np.zeros((1, 2))):
        with pytest.raises(DesignError, match="2 joints"):
            table.frames(q)
