"""Temporal fitness of one arm at one frame, eq. 3, as solvers from elsewhere need it: one compiled call per pose."""

from __future__ import annotations

import numpy as np

from armdesign.fitness.kernels.temporal import differentiate_frame, evaluate_frame
from armdesign.kinematics.compilation import entry
from armdesign.kinematics.kernels.skeleton import load_arm, update_skeleton


@entry
def hang(chains, placements, rows, yaw):
    """Write a design into the one arm of a block; see ``load_arm``."""
    load_arm(chains[0], placements, rows, yaw)


@entry
def pose_fitness(chains, frames, matches, attitudes, poses, points, target, weights, free, w_0, metric):
    """G of the present pose with the best sigma (eq. 3) [m]; for the arguments see ``evaluate_frame``."""
    update_skeleton(chains[0], poses)
    evaluate_frame(
        frames[0], matches[0], attitudes[0], chains[0], points, target, weights, free, w_0, metric
    )  # fmt: skip
    return frames[0].g


@entry
def pose_gradient(
    chains, frames, motions, matches, attitudes, poses, jacobian, points, target, weights, free, w_0, metric, gradient
):
    """The same with its gradient, shape (n,) [m/rad], which is written."""
    chain, frame, attitude = chains[0], frames[0], attitudes[0]
    update_skeleton(chain, poses)
    evaluate_frame(frame, matches[0], attitude, chain, points, target, weights, free, w_0, metric)
    differentiate_frame(frame, motions[0], matches[0], attitude, chain, jacobian, weights, w_0, metric)
    scale = 1.0 / (len(points) * max(frame.root, 1e-12)) if w_0 == 0.0 else 1.0
    for j in range(chain.dof):
        gradient[j] = scale * frame.slope[j]
        if w_0 > 0.0 and attitude.error > 0.0:
            along = 0.0
            for c in range(3):
                along += attitude.K[j, c] * attitude.rho[c]
            gradient[j] += w_0 * along / attitude.error
    return frame.g


@entry
def loose_fitness(chains, frames, matches, attitudes, poses, points, target, weights, sigma, w_0, metric):
    """G of the present pose with given sigma, those of the first points, shape (free,); the others are 1 [m]."""
    chain = chains[0]
    free = len(sigma)
    update_skeleton(chain, poses)
    evaluate_frame(frames[0], matches[0], attitudes[0], chain, points, target, weights, free, w_0, metric)
    total = 0.0
    for i in range(len(points)):
        arc = (sigma[i] if i < free else 1.0) * chain.length
        k = 0
        while k < chain.segments - 1 and arc > chain.arc[k + 1]:
            k += 1
        for c in range(3):
            place = chain.start[k, c] + (arc - chain.arc[k]) * chain.direction[k, c]
            total += weights[i] * (place - points[i, c]) ** 2
    return frames[0].g - frames[0].root / len(points) + np.sqrt(total) / len(points)
