"""Orientation error e_R between the end-effector and the hand, in three metrics (method section 3).

Each metric gives a residual rho (3,) with e_R = |rho| and a Jacobian K (n, 3) with d(e_R^2 / 2)/dq_j = K_j . rho.
"""

from __future__ import annotations

import numpy as np

from armdesign.kinematics.compilation import branch
from armdesign.kinematics.kernels.skeleton import MAX_DOF

GEODESIC, EULER, AXIS = 0, 1, 2
METRICS = ("geodesic", "euler", "axis")

ATTITUDE = np.dtype(
    [
        ("mount", np.float64, (3, 3)),  # hand frame in the end-effector's frame
        ("hand", np.float64, (3, 3)),  # end-effector rotation times mount
        ("turn", np.float64, (3, 3)),  # target times hand transposed
        ("error", np.float64),  # e_R [rad]
        ("rho", np.float64, 3),  # residual, |rho| = e_R
        # the linear model, kept while trials are judged
        ("base_error", np.float64),
        ("base_rho", np.float64, 3),
        ("K", np.float64, (MAX_DOF, 3)),  # derivative of rho by q_j, up to terms normal to rho
    ]
)
"""Orientation part of one evaluation; one record an arm."""


@branch
def compare_orientation(attitude, chain, target, metric):
    """Write hand, rho and e_R for the present pose.

    Args:
        attitude: Record of type ATTITUDE with the mount set.
        chain: Record of type CHAIN, up to date.
        target: Demonstrated rotation R_hand, shape (3, 3).
        metric: GEODESIC, EULER or AXIS.
    """
    for i in range(3):
        for j in range(3):
            total = 0.0
            for k in range(3):
                total += chain.tip_rotation[i, k] * attitude.mount[k, j]
            attitude.hand[i, j] = total
    # section 3: three metrics of e_R, each as the norm of a residual rho
    if metric == GEODESIC:
        rotation_between(attitude.hand, target, attitude.turn, attitude.rho)
    elif metric == EULER:
        roll_pitch_yaw_difference(attitude.hand, target, attitude.rho)
    else:
        axis_turn(attitude.hand, target, attitude.rho)
    rho = attitude.rho
    attitude.error = np.sqrt(rho[0] ** 2 + rho[1] ** 2 + rho[2] ** 2)


@branch
def rotation_between(hand, target, D, rho):
    """Rho = -log(target hand^T), the rotation vector from target to hand in the base frame; D is scratch (3, 3)."""
    for i in range(3):
        for j in range(3):
            D[i, j] = target[i, 0] * hand[j, 0] + target[i, 1] * hand[j, 1] + target[i, 2] * hand[j, 2]
    x, y, z = 0.5 * (D[2, 1] - D[1, 2]), 0.5 * (D[0, 2] - D[2, 0]), 0.5 * (D[1, 0] - D[0, 1])
    sine = np.sqrt(x * x + y * y + z * z)
    cosine = 0.5 * (D[0, 0] + D[1, 1] + D[2, 2] - 1.0)
    angle = np.arctan2(sine, cosine)
    # near half a turn the antisymmetric part vanishes and no longer gives the axis
    if sine > 1e-6 or cosine > 0.0:
        scale = angle / sine if sine > 1e-12 else 1.0
        rho[0], rho[1], rho[2] = -scale * x, -scale * y, -scale * z
        return
    best = 0  # half a turn: the axis is a column of D + I
    for i in range(1, 3):
        if D[i, i] > D[best, best]:
            best = i
    norm = 0.0
    for i in range(3):
        rho[i] = D[i, best] + (1.0 if i == best else 0.0)
        norm += rho[i] * rho[i]
    sign = -1.0 if rho[0] * x + rho[1] * y + rho[2] * z >= 0.0 else 1.0
    for i in range(3):
        rho[i] *= sign * angle / np.sqrt(norm)


@branch
def roll_pitch_yaw_difference(hand, target, rho):
    """Rho = roll, pitch, yaw of hand minus those of target, each wrapped to (-pi, pi]."""
    rho[0] = np.arctan2(hand[2, 1], hand[2, 2]) - np.arctan2(target[2, 1], target[2, 2])
    # pitch of R = Rz(yaw) Ry(pitch) Rx(roll)
    rho[1] = np.arctan2(-hand[2, 0], np.sqrt(hand[0, 0] ** 2 + hand[1, 0] ** 2))
    rho[1] -= np.arctan2(-target[2, 0], np.sqrt(target[0, 0] ** 2 + target[1, 0] ** 2))
    rho[2] = np.arctan2(hand[1, 0], hand[0, 0]) - np.arctan2(target[1, 0], target[0, 0])
    for i in range(3):
        if rho[i] > np.pi:
            rho[i] -= 2.0 * np.pi
        elif rho[i] <= -np.pi:
            rho[i] += 2.0 * np.pi


@branch
def axis_turn(hand, target, rho):
    """Rho = the smallest rotation vector that takes the target's z axis to the hand's."""
    rho[0] = target[1, 2] * hand[2, 2] - target[2, 2] * hand[1, 2]
    rho[1] = target[2, 2] * hand[0, 2] - target[0, 2] * hand[2, 2]
    rho[2] = target[0, 2] * hand[1, 2] - target[1, 2] * hand[0, 2]
    sine = np.sqrt(rho[0] ** 2 + rho[1] ** 2 + rho[2] ** 2)
    cosine = target[0, 2] * hand[0, 2] + target[1, 2] * hand[1, 2] + target[2, 2] * hand[2, 2]
    if sine > 1e-12:
        scale = np.arctan2(sine, cosine) / sine
        rho[0], rho[1], rho[2] = scale * rho[0], scale * rho[1], scale * rho[2]
    elif cosine < 0.0:  # opposite: any axis normal to z will do
        rho[0], rho[1], rho[2] = np.pi * hand[0, 0], np.pi * hand[1, 0], np.pi * hand[2, 0]


@branch
def orientation_jacobian(attitude, jacobian, n, metric):
    """Write the linear model rho + K x at the present pose, from the angular part of Pinocchio's world Jacobian.

    Args:
        attitude: Record of type ATTITUDE, after compare_orientation.
        jacobian: World Jacobian of the arm, shape (n, 6): linear, then angular.
        n: Number of joints.
        metric: GEODESIC, EULER or AXIS.
    """
    hand, K = attitude.hand, attitude.K
    attitude.base_error = attitude.error
    for i in range(3):
        attitude.base_rho[i] = attitude.rho[i]
    cosine = np.sqrt(hand[0, 0] ** 2 + hand[1, 0] ** 2)
    level_x, level_y = 1.0, 0.0
    if cosine > 1e-12:
        level_x, level_y = hand[0, 0] / cosine, hand[1, 0] / cosine
    for j in range(n):
        x, y, z = jacobian[j, 3], jacobian[j, 4], jacobian[j, 5]
        if metric == EULER:
            forward = level_x * x + level_y * y  # angular velocity in the frame turned by the yaw alone
            K[j, 0] = forward / max(cosine, 1e-12)
            K[j, 1] = level_x * y - level_y * x
            K[j, 2] = z - hand[2, 0] * forward / max(cosine, 1e-12)
        else:
            along = hand[0, 2] * x + hand[1, 2] * y + hand[2, 2] * z if metric == AXIS else 0.0
            K[j, 0], K[j, 1], K[j, 2] = x - along * hand[0, 2], y - along * hand[1, 2], z - along * hand[2, 2]
