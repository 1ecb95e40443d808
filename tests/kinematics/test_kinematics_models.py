"""Pinocchio models and blocks of arms give the poses of the DH table; the views are Pinocchio's own memory."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from kinematics_kernels import load, pose

from armdesign.errors import DesignError
from armdesign.kinematics import models
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.models import TOOL_FRAME, ArmBlock, arm_model

SIZES = range(1, 11)


def random_table(rng, n, joints=""):
    """Any arm: twists all around, negative lengths, joint offsets, a turned base."""
    lengths = rng.uniform(-0.5, 0.5, (2, n + 1)) * (rng.random((2, n + 1)) < 0.8)
    return DHTable(rng.uniform(-3, 3, n + 1), *lengths, rng.uniform(-3, 3, n + 1), rng.uniform(-3, 3), joints)


def random_block(rng, n, size):
    joints = "".join(rng.choice(["R", "R", "P"], n))
    tables = [random_table(rng, n, joints) for _ in range(size)]
    q = rng.uniform(-4, 4, (size, n))
    block, chains = load(tables)
    pose(block, chains, q)
    return tables, q, block, chains


def homogeneous(row):
    """A row of the block's poses, axes x, y, z and origin, as a matrix."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = row[:9].reshape(3, 3).T, row[9:]
    return matrix


@pytest.mark.parametrize("n", SIZES)
def test_arm_model_moves_as_the_table_says(n):
    rng = np.random.default_rng([1, n])
    for _ in range(10):
        table, q = random_table(rng, n, "".join(rng.choice(["R", "R", "P"], n))), rng.uniform(-4, 4, n)
        model = arm_model(table)
        data = model.createData()
        pin.framesForwardKinematics(model, data, q)
        frames = table.frames(q)
        for i in range(n):
            np.testing.assert_allclose(data.oMi[i + 1].homogeneous, frames[i], atol=1e-12)
        np.testing.assert_allclose(data.oMf[model.getFrameId(TOOL_FRAME)].homogeneous, frames[-1], atol=1e-12)


def test_arm_model_has_a_joint_per_row_and_the_limits_given():
    table, limits = random_table(np.random.default_rng(2), 4), np.c_[-np.arange(1.0, 5), np.arange(2.0, 6)]
    model = arm_model(table, limits)
    assert model.nq == model.nv == 4
    assert list(model.names)[1:] == ["joint_1", "joint_2", "joint_3", "joint_4"]
    np.testing.assert_array_equal(np.c_[model.lowerPositionLimit, model.upperPositionLimit], limits)
    np.testing.assert_allclose(arm_model(table).upperPositionLimit, np.pi)


@pytest.mark.parametrize("limits", [np.zeros((3, 2)), np.zeros(8), np.zeros((4, 3))])
def test_limits_of_another_shape_are_refused(limits):
    with pytest.raises(DesignError, match="joint limits"):
        arm_model(random_table(np.random.default_rng(3), 4), limits)


@pytest.mark.parametrize("size", [1, 2, 7])
@pytest.mark.parametrize("n", SIZES)
def test_every_arm_of_a_block_moves_as_its_table_says(n, size):
    rng = np.random.default_rng([4, n, size])
    tables, q, block, chains = random_block(rng, n, size)
    for b, table in enumerate(tables):
        frames = table.frames(q[b])
        for i in range(n):
            np.testing.assert_allclose(homogeneous(block.poses[b * n + i]), frames[i], atol=1e-12)
        np.testing.assert_allclose(chains[b]["tip"], frames[-1][:3, 3], atol=1e-12)
        np.testing.assert_allclose(chains[b]["tip_rotation"], frames[-1][:3, :3], atol=1e-12)


@pytest.mark.parametrize("n", SIZES)
def test_world_jacobian_equals_central_differences(n):
    rng = np.random.default_rng([5, n])
    size, h = 3, 1e-6
    tables, q, block, _ = random_block(rng, n, size)
    for b, table in enumerate(tables):
        for j in range(n):
            step = h * np.eye(n)[j]
            before, after = table.frames(q[b] - step), table.frames(q[b] + step)
            linear, angular = block.jacobian[b * n + j, :3], block.jacobian[b * n + j, 3:]
            for i in range(j, n + 1):  # every frame behind joint j moves with its twist v + omega x p
                frame = table.frames(q[b])[i]
                difference = (after[i] - before[i]) / (2 * h)
                np.testing.assert_allclose(linear + np.cross(angular, frame[:3, 3]), difference[:3, 3], atol=1e-8)
                np.testing.assert_allclose(pin.skew(angular) @ frame[:3, :3], difference[:3, :3], atol=1e-8)


def test_arms_of_a_block_do_not_feel_each_other():
    rng = np.random.default_rng(6)
    tables, q, block, chains = random_block(rng, 4, 5)
    alone, chain = load(tables[2:3])
    pose(alone, chain, q[2:3])
    np.testing.assert_array_equal(block.poses[8:12], alone.poses)
    np.testing.assert_array_equal(block.jacobian[8:12], alone.jacobian)
    assert chains[2]["tip"].tobytes() == chain[0]["tip"].tobytes()


@pytest.mark.parametrize(("size", "n"), [(1, 1), (1, 2), (1, 6), (2, 1), (3, 4), (9, 10)])
def test_views_are_pinocchios_own_memory(size, n):
    block = ArmBlock(size, n)
    joints = size * n
    for view, width in ((block.poses, 12), (block.placements, 12), (block.jacobian, 6)):
        assert view.shape == (joints, width)
        assert view.strides[1] == 8
    assert np.shares_memory(block.jacobian, block.data.J)
    for k in range(joints):
        assert np.shares_memory(block.poses[k], block.data.oMi[k + 1].rotation)
        block.placements[k] = np.r_[np.eye(3).ravel(), 1.0 + k, 2.0, 3.0]
        assert block.model.jointPlacements[k + 1].translation.tolist() == [1.0 + k, 2.0, 3.0]
    block.q[:] = 0.3
    block.update()
    np.testing.assert_array_equal(block.poses[0, 9:], block.data.oMi[1].translation)
    np.testing.assert_array_equal(block.jacobian.ravel(), np.asarray(block.data.J).T.ravel())


def test_another_memory_layout_of_poses_is_noticed(monkeypatch):
    monkeypatch.setattr(models, "se3_view", lambda vector: np.zeros((len(vector) - 1, 12)))
    with pytest.raises(RuntimeError, match="another layout"):
        ArmBlock(2, 3)


def test_another_order_of_the_axes_is_noticed(monkeypatch):
    honest = models.se3_view

    def turned(vector):
        view = honest(vector)
        return np.concatenate([view[:, :9].reshape(-1, 3, 3).transpose(0, 2, 1).reshape(-1, 9), view[:, 9:]], axis=1)

    monkeypatch.setattr(models, "se3_view", turned)
    with pytest.raises(RuntimeError, match="another layout"):
        ArmBlock(2, 3)


def test_another_layout_of_one_pose_is_noticed():
    class Row:
        """An SE3 whose rotation is stored row by row."""

        rotation = np.zeros((3, 3))
        translation = np.zeros(3)

    with pytest.raises(RuntimeError, match="another layout"):
        models.se3_view([Row(), Row(), Row()])
