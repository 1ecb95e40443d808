"""Pinocchio models from DH tables: one arm, or a block of arms side by side in one model."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import DesignError
from armdesign.kinematics.dh import DHTable

TOOL_FRAME = "tool0"


def arm_model(table: DHTable, limits: ArrayLike | None = None) -> pin.Model:
    """Build the Pinocchio model of one arm: joints joint_1..joint_n, frame tool0.

    Args:
        table: The DH table.
        limits: Joint limits, shape (n, 2) [rad; m of joints that slide]; +-pi, or +-1 m, by default.

    Returns:
        The model, without masses; nq = nv = n.
    """
    n = table.dof
    bounds = default_limits(table.prismatic) if limits is None else np.asarray(limits, dtype=float)
    if bounds.shape != (n, 2):
        raise DesignError(f"joint limits have shape {bounds.shape}", allowed=f"({n}, 2)")
    placements = table.placements()
    model = pin.Model()
    model.name = "arm"
    joint = 0
    for i in range(n):
        joint = model.addJoint(joint, joint_of(table.prismatic[i]), pin.SE3(placements[i]), f"joint_{i + 1}")
        model.addJointFrame(joint)
    model.lowerPositionLimit, model.upperPositionLimit = bounds[:, 0].copy(), bounds[:, 1].copy()
    tool = pin.Frame(TOOL_FRAME, joint, model.nframes - 1, pin.SE3(placements[n]), pin.FrameType.OP_FRAME)
    model.addFrame(tool)
    return model


def default_limits(prismatic: Sequence[bool]) -> Array:
    """Limits of n joints where none are known, +-pi, or +-1 m of those that slide, shape (n, 2) [rad; m]."""
    ends = np.where(prismatic, 1.0, np.pi)
    return np.stack([-ends, ends], axis=1)


def joint_of(prismatic: bool) -> Any:  # noqa: ANN401 (a Pinocchio joint)
    """Pinocchio's joint about or along z."""
    return pin.JointModelPZ() if prismatic else pin.JointModelRZ()


class BlockViews(NamedTuple):
    """Arrays of a block of B arms of n joints in Pinocchio's memory, for compiled kernels.

    Attributes:
        placements: Joint placements in the parent, shape (B n, 12): axes x, y, z, origin.
        poses: World pose of every joint, shape (B n, 12).
        jacobian: World Jacobian, shape (B n, 6): linear, angular per joint.
        q: Joint angles of all arms, shape (B n,) [rad].
    """

    placements: NDArray[np.float64]
    poses: NDArray[np.float64]
    jacobian: NDArray[np.float64]
    q: NDArray[np.float64]


class ArmBlock:
    """B arms of n joints as one Pinocchio model, side by side at the base of the world.

    One ``computeJointJacobians`` serves all of them; compiled kernels read the results and write new arms in place.
    The views into Pinocchio's memory are checked against its own accessors on construction.

    Attributes:
        poses: World pose of every joint, shape (B n, 12): axes x, y, z, origin; a view of ``data.oMi``.
        jacobian: World Jacobian, shape (B n, 6): linear, angular per joint; a view of ``data.J``.
        placements: Joint placements in the parent, shape (B n, 12); a view of ``model.jointPlacements``.
        q: Joint angles of all arms, shape (B n,) [rad]; write here, then call ``update``.
        views: These four as the kernels take them.
    """

    def __init__(self, size: int, dof: int, prismatic: Sequence[bool] = ()) -> None:
        """Allocate the model.

        Args:
            size: Number of arms B; keep B n below about 100, createData grows with its cube.
            dof: Joints per arm n.
            prismatic: Which of an arm's joints slide; none by default.
        """
        kinds = tuple(prismatic) or (False,) * dof
        self.size, self.dof = size, dof
        self.model = pin.Model()
        for arm in range(size):
            parent = 0
            for i in range(dof):
                parent = self.model.addJoint(parent, joint_of(kinds[i]), pin.SE3.Identity(), f"arm_{arm}_joint_{i}")
        self.data = self.model.createData()
        self.q: NDArray[np.float64] = np.zeros(self.model.nq)
        self.poses = se3_view(self.data.oMi)
        self.placements = se3_view(self.model.jointPlacements)
        self.jacobian: NDArray[np.float64] = self.data.J.T.reshape(-1, 6)  # a single joint's is a vector
        self.views = BlockViews(self.placements, self.poses, self.jacobian, self.q)
        self._check_views()

    def update(self) -> None:
        """Bring ``poses`` and ``jacobian`` up to date with ``q``."""
        pin.computeJointJacobians(self.model, self.data, self.q)

    def _check_views(self) -> None:
        """Compare every view with Pinocchio's accessors at a random-looking configuration.

        Raises:
            RuntimeError: The memory layout of this Pinocchio is not the one the kernels read.
        """
        for k in range(self.model.nq):
            turn = pin.exp3(np.array([0.3, 0.5 + k, 0.7]))
            self.placements[k] = np.r_[turn.T.ravel(), 0.1 * k, 0.2, 0.3]
        self.q[:] = np.linspace(-3.0, 3.0, self.model.nq)
        self.update()
        for k in range(self.model.nq):
            for view, exact in ((self.poses, self.data.oMi), (self.placements, self.model.jointPlacements)):
                pose = exact[k + 1]
                if not np.array_equal(view[k], np.r_[pose.rotation.T.ravel(), pose.translation]):
                    raise RuntimeError("Pinocchio stores SE3 in another layout than armdesign's kernels read")
        if not np.array_equal(self.jacobian, self.data.J.T.reshape(-1, 6)) or not self.jacobian.flags.c_contiguous:
            raise RuntimeError("Pinocchio stores the Jacobian in another layout than armdesign's kernels read")


def se3_view(vector: Any) -> NDArray[np.float64]:  # noqa: ANN401 (a Pinocchio StdVec_SE3)
    """View a vector of SE3 as (length - 1, 12) doubles in place; the universe at index 0 is left out."""
    first, second = vector[1], vector[2] if len(vector) > 2 else None
    rotation = first.rotation
    stride = 96 if second is None else second.rotation.ctypes.data - rotation.ctypes.data
    if rotation.strides != (8, 24) or first.translation.ctypes.data - rotation.ctypes.data != 72 or stride % 8:
        raise RuntimeError("Pinocchio stores SE3 in another layout than armdesign's kernels read")
    flat = np.lib.stride_tricks.as_strided(rotation.T, shape=(len(vector) - 1, 12), strides=(stride, 8))
    return flat
