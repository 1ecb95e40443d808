"""Published DH tables of real robots are the same arms as their URDFs, up to constant frames at both ends."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from armdesign.kinematics.dh import DHTable

HALF = np.pi / 2
ROBOTS = Path(pin.__file__).parents[4] / "share/example-robot-data/robots"

# Classic rows (alpha, a, d) as published by Universal Robots; "base" to "tool0" of the URDF.
UR5 = [(HALF, 0, 0.089159), (0, -0.425, 0), (0, -0.39225, 0), (HALF, 0, 0.10915), (-HALF, 0, 0.09465), (0, 0, 0.0823)]
UR10 = [(HALF, 0, 0.1273), (0, -0.612, 0), (0, -0.5723, 0), (HALF, 0, 0.163941), (-HALF, 0, 0.1157), (0, 0, 0.0922)]
UR3 = [
    (HALF, 0, 0.1519), (0, -0.24365, 0), (0, -0.21325, 0), (HALF, 0, 0.11235), (-HALF, 0, 0.08535), (0, 0, 0.0819),
]  # fmt: skip
# Modified (Craig) rows, as published by Franka Emika, flange last, and by UFACTORY.
PANDA = [
    (0, 0, 0.333), (-HALF, 0, 0), (HALF, 0, 0.316), (HALF, 0.0825, 0), (-HALF, -0.0825, 0.384), (HALF, 0, 0),
    (HALF, 0.088, 0), (0, 0, 0.107),
]  # fmt: skip
XARM7 = [
    (0, 0, 0.267), (-HALF, 0, 0), (HALF, 0, 0.293), (HALF, 0.0525, 0), (HALF, 0.0775, 0.3425), (HALF, 0, 0),
    (-HALF, 0.076, 0.097), (0, 0, 0),
]  # fmt: skip
# Classic rows as published by Kinova for the 6-joint arm with the spherical wrist: D1, D2, D3 + D4, D5 + D6 and e2;
# the arm's joints count from other zeros than the table's.
JACO = [
    (HALF, 0, 0.2755), (np.pi, 0.41, 0), (HALF, 0, -0.0098), (HALF, 0, -0.31105), (HALF, 0, 0), (np.pi, 0, -0.26375),
]  # fmt: skip
JACO_ZEROS = np.array([0, HALF, HALF, 0, 0, 0])

CASES = {
    "ur5": ("ur_description/urdf/ur5_robot.urdf", DHTable.from_classic(UR5), "base", "tool0"),
    "ur10": ("ur_description/urdf/ur10_robot.urdf", DHTable.from_classic(UR10), "base", "tool0"),
    "ur3": ("ur_description/urdf/ur3_robot.urdf", DHTable.from_classic(UR3), "base", "tool0"),
    "panda": ("panda_description/urdf/panda.urdf", DHTable.from_rows(PANDA), "panda_link0", "panda_link8"),
    "xarm7": ("xarm_description/urdf/xarm7.urdf", DHTable.from_rows(XARM7), "link_base", "link_eef"),
    "jaco": ("kinova_description/robots/kinova.urdf", DHTable.from_classic(JACO), "j2s6s200_link_base",
             "j2s6s200_end_effector"),
}  # fmt: skip


class UrdfArm:
    """The first n revolute joints of a URDF, between two of its frames."""

    def __init__(self, path, base, tool):
        self.model = pin.buildModelFromUrdf(str(path))
        self.data = self.model.createData()
        self.base, self.tool = self.model.getFrameId(base), self.model.getFrameId(tool)

    def pose(self, angles):
        """Tool in the base for joint angles, shape (4, 4)."""
        q = pin.neutral(self.model)
        for joint, angle in zip(self.model.joints[1:], angles, strict=False):
            q[joint.idx_q : joint.idx_q + joint.nq] = angle if joint.nq == 1 else (np.cos(angle), np.sin(angle))
        pin.framesForwardKinematics(self.model, self.data, q)
        return (self.data.oMf[self.base].inverse() * self.data.oMf[self.tool]).homogeneous


def load(name):
    path, table, base, tool = CASES[name]
    return UrdfArm(ROBOTS / path, base, tool), table


def constant_frames(X, Y):
    """A, B with A X_k B = Y_k: from A (X_k X_0^-1) A^-1 = Y_k Y_0^-1, its rotation first, then its translation."""
    moves = [X[1:] @ np.linalg.inv(X[0]), Y[1:] @ np.linalg.inv(Y[0])]
    logs = [Rotation.from_matrix(M[:, :3, :3]).as_rotvec() for M in moves]
    A = np.eye(4)
    A[:3, :3] = Rotation.align_vectors(logs[1], logs[0])[0].as_matrix()
    left = (moves[1][:, :3, :3] - np.eye(3)).reshape(-1, 3)
    right = (moves[0][:, :3, 3] @ A[:3, :3].T - moves[1][:, :3, 3]).ravel()
    A[:3, 3] = np.linalg.lstsq(left, right, rcond=None)[0]
    return A, np.linalg.inv(A @ X[0]) @ Y[0]


@pytest.mark.parametrize("name", ["ur5", "ur10", "ur3", "panda", "xarm7"])
def test_published_tables_equal_the_urdf_as_they_are(name):
    arm, table = load(name)
    rng = np.random.default_rng(0)
    for q in rng.uniform(-np.pi, np.pi, (50, table.dof)):
        np.testing.assert_allclose(table.frames(q)[-1], arm.pose(q), atol=2e-5)  # the URDF's own rounding


@pytest.mark.parametrize("name", ["ur5", "panda", "jaco"])
def test_published_tables_equal_the_urdf_between_constant_frames(name):
    arm, table = load(name)
    zeros = JACO_ZEROS if name == "jaco" else np.zeros(table.dof)
    q = np.random.default_rng(1).uniform(-2.0, 2.0, (40, table.dof))
    X, Y = np.stack([table.frames(x + zeros)[-1] for x in q]), np.stack([arm.pose(x) for x in q])
    A, B = constant_frames(X, Y)
    np.testing.assert_allclose(A @ X @ B, Y, atol=1e-6)


def test_a_wrong_table_has_no_constant_frames():
    arm, table = load("ur5")
    wrong = DHTable(table.alpha, table.a * 1.01, table.d)
    q = np.random.default_rng(2).uniform(-2.0, 2.0, (40, 6))
    X, Y = np.stack([wrong.frames(x)[-1] for x in q]), np.stack([arm.pose(x) for x in q])
    A, B = constant_frames(X, Y)
    assert np.abs(A @ X @ B - Y).max() > 1e-3
