"""Temporal fitness of one arm at one frame, eq. 3, as solvers from elsewhere need it: one compiled call per pose."""

from __future__ import annotations

import numpy as np

from armdesign.fitness.kernels.temporal import differentiate_frame, evaluate_frame
from armdesign.kinematics.compilation import entry
from armdesign.kinematics.kernels.skeleton import load_arm, update_skeleton


@entry
def load(arms, placements, rows, yaw):
    """Write a design into the one arm of a block; see ``load_arm``."""
    load_arm(arms[0].chain, placements, rows, yaw)


@entry
def pose_fitness(arms, scratch, poses, target):
    """Temporal fitness of the present pose with the best sigma, eq. 3 [m].

    Args:
        arms: One ARM record, shape (1,).
        scratch: One SCRATCH record, shape (1,).
        poses: Joint poses of the arm, shape (n, 12).
        target: Frame to compare the pose with.
    """
    update_skeleton(arms[0].chain, poses)
    evaluate_frame(arms[0], scratch[0], target)
    return arms[0].frame.g


@entry
def pose_gradient(arms, scratch, block, target, gradient):
    """Temporal fitness of the present pose with the best sigma, eq. 3 [m], and its gradient.

    Args:
        arms: One ARM record, shape (1,).
        scratch: One SCRATCH record, shape (1,).
        block: Poses and Jacobian of the arm in Pinocchio's memory.
        target: Frame to compare the pose with.
        gradient: Shape (n,) [m/rad], written.
    """
    arm, w_0 = arms[0], target.w_0
    frame, attitude = arm.frame, arm.attitude
    update_skeleton(arm.chain, block.poses)
    evaluate_frame(arm, scratch[0], target)
    differentiate_frame(arm, scratch[0], target, block.jacobian)
    scale = 1.0 / (len(target.points) * max(frame.root, 1e-12)) if w_0 == 0.0 else 1.0
    for j in range(arm.chain.dof):
        gradient[j] = scale * frame.slope[j]
        if w_0 > 0.0 and attitude.error > 0.0:
            along = 0.0
            for c in range(3):
                along += attitude.K[j, c] * attitude.rho[c]
            gradient[j] += w_0 * along / attitude.error
    return frame.g


@entry
def loose_fitness(arms, scratch, poses, target, sigma):
    """Temporal fitness of the present pose with given sigma, eq. 3 [m].

    Args:
        arms: One ARM record, shape (1,).
        scratch: One SCRATCH record, shape (1,).
        poses: Joint poses of the arm, shape (n, 12).
        target: Frame to compare the pose with.
        sigma: Places of the first points on the arm, shape (free,); the others are at 1.
    """
    arm, chain, points = arms[0], arms[0].chain, target.points
    update_skeleton(chain, poses)
    evaluate_frame(arm, scratch[0], target)
    total = 0.0
    for i in range(len(points)):
        arc = (sigma[i] if i < len(sigma) else 1.0) * chain.length
        k = 0
        while k < chain.segments - 1 and arc > chain.arc[k + 1]:
            k += 1
        for c in range(3):
            place = chain.start[k, c] + (arc - chain.arc[k]) * chain.direction[k, c]
            total += target.weights[i] * (place - points[i, c]) ** 2
    return arm.frame.g - arm.frame.root / len(points) + np.sqrt(total) / len(points)
