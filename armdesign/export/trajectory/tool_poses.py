"""Where the end-effector is along a joint path, and how far smoothing moves it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
import scipy
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.models import TOOL_FRAME, arm_model
from armdesign.kinematics.motion import SmoothPath


@dataclass(frozen=True, eq=False)
class ToolDeviation:
    """How far smoothing moves the end-effector from where the solved angles put it, frame by frame.

    Attributes:
        distance: Shape (T,) [m].
        angle: Angle between the two orientations, shape (T,) [rad].
    """

    distance: Array
    angle: Array


def tool_poses(table: DHTable, q: ArrayLike) -> Array:
    """Poses of tool0 in the base along a motion, by Pinocchio.

    Args:
        table: The arm, n joints.
        q: Joint angles, shape (T, n) [rad].

    Returns:
        Shape (T, 4, 4).
    """
    model = arm_model(table)
    data, tool = model.createData(), model.getFrameId(TOOL_FRAME)
    angles = np.asarray(q, dtype=float)
    poses = np.empty((len(angles), 4, 4))
    for t, row in enumerate(angles):
        pin.framesForwardKinematics(model, data, row)
        poses[t] = data.oMf[tool].homogeneous
    return poses


def tool_deviation(table: DHTable, q: ArrayLike, path: SmoothPath) -> ToolDeviation:
    """End-effector deviation caused by the fit, at the frames.

    Args:
        table: The arm, n joints.
        q: The angles that were fitted, shape (T, n) [rad].
        path: Their fit.
    """
    solved, fitted = tool_poses(table, q), tool_poses(table, path.at(path.time))
    distance = np.linalg.norm(fitted[:, :3, 3] - solved[:, :3, 3], axis=1)
    turn = scipy.spatial.transform.Rotation.from_matrix(solved[:, :3, :3].transpose(0, 2, 1) @ fitted[:, :3, :3])
    return ToolDeviation(distance, np.asarray(turn.magnitude()))
