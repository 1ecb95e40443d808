"""Temporal fitness of one frame, eq. 3, with its first and second derivatives.

    g(q) = sqrt(S) / m + w_0 e_R,    S = sum_i w_i |s(sigma_i, q) - p_i|^2,  sigma exact.

Without orientation the solver minimises S / 2, which has the same minimisers and is smooth; with it, g itself. A
point that slides inside its segment, or a pool of points that slides together, has its displacement along the
segment eliminated: the derivatives are those of the minimum over sigma.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.fitness.kernels.association import MAX_POINTS, associate, at_end
from armdesign.fitness.kernels.orientation import compare_orientation, orientation_jacobian
from armdesign.kinematics.compilation import branch, leaf
from armdesign.kinematics.kernels.skeleton import ALONG_Z, MAX_DOF

FRAME = np.dtype(
    [
        ("square", np.float64),  # S [m^2]
        ("root", np.float64),  # sqrt(S) [m]
        ("value", np.float64),  # what the solver minimises: S / 2 without orientation, g with it
        ("g", np.float64),  # eq. 3 with the weights of the evaluation [m]
        ("slope", np.float64, MAX_DOF),  # gradient of the position part of value
        ("newton", np.float64, (MAX_DOF, MAX_DOF)),  # its full second derivative, lower triangle
        ("gauss", np.float64, (MAX_DOF, MAX_DOF)),  # its Gauss-Newton part, positive semidefinite
    ]
)
"""Objective at the last trial and derivatives at the last accepted one; one record an arm."""

MOTION = np.dtype(
    [
        ("column", np.float64, (MAX_POINTS, MAX_DOF, 3)),  # d place_i / d q_j at constant sigma
        ("torque", np.float64, (MAX_DOF, 3)),  # sum of column x force, couples a joint to those before it
        ("slide", np.float64, MAX_DOF),  # how a pool's sliding couples to q
    ]
)
"""Scratch of the differentiation; one record serves a whole block, so that it stays in the fastest cache."""

SMALLEST_ROOT = 1e-12


class Target(NamedTuple):
    """One frame of the demonstration and how it is weighted.

    Attributes:
        points: p_1..p_m, shape (m, 3) [m].
        rotation: R_hand, shape (3, 3).
        weights: w_1..w_m, shape (m,).
        w_0: Orientation weight; 0 for none.
        free: Number of free sigma.
        metric: GEODESIC, EULER or AXIS.
    """

    points: Array
    rotation: Array
    weights: Array
    w_0: float
    free: int
    metric: int


@branch
def evaluate_frame(arm, scratch, target):
    """Write value and g (eq. 3) for the present pose.

    Args:
        arm: Record of type ARM with the chain up to date; frame is written, attitude where w_0 > 0.
        scratch: Record of type SCRATCH; match is written.
        target: Frame to compare the pose with.
    """
    frame, match, weights = arm.frame, scratch.match, target.weights
    associate(match, arm.chain, target.points, weights, target.free)
    m = len(weights)
    frame.square = 0.0
    for i in range(m):
        frame.square += weights[i] * match.distance[i] * match.distance[i]
    frame.root = np.sqrt(frame.square)
    frame.g = frame.root / m  # eq. 3, position part: the 1/m stands outside the root
    if target.w_0 > 0.0:
        compare_orientation(arm.attitude, arm.chain, target.rotation, target.metric)
        frame.g += target.w_0 * arm.attitude.error  # eq. 3, orientation part
        frame.value = frame.g
    else:
        frame.value = 0.5 * frame.square


@leaf
def differentiate_frame(arm, scratch, target, jacobian):
    """Write slope, newton and gauss of the position part, and K of the orientation part.

    Args:
        arm: Record of type ARM, after evaluate_frame; frame and attitude are written.
        scratch: Record of type SCRATCH, after evaluate_frame; motion is written.
        target: Frame that the pose was compared with.
        jacobian: World Jacobian of the arm, shape (n, 6): linear, then angular.
    """
    frame, chain, motion, match, weights = arm.frame, arm.chain, scratch.motion, scratch.match, target.weights
    n = chain.dof
    for i in range(n):
        frame.slope[i] = 0.0
        motion.torque[i, 0] = motion.torque[i, 1] = motion.torque[i, 2] = 0.0
        for j in range(i + 1):
            frame.gauss[i, j] = 0.0
    for p in range(len(weights)):
        if weights[p] > 0.0:
            add_point(frame, motion, match, p, movers_of(chain, match, p), jacobian, weights[p])
    for j in range(n):
        x, y, z = motion.torque[j, 0], motion.torque[j, 1], motion.torque[j, 2]
        for i in range(j + 1):
            turn = jacobian[i, 3] * x + jacobian[i, 4] * y + jacobian[i, 5] * z
            frame.newton[j, i] = frame.gauss[j, i] + turn
    # sigma is eliminated (section 3): a sliding point counts with the part of its motion normal to the segment
    remove_sliding(frame, motion, match, chain, jacobian, weights)
    if target.w_0 > 0.0:
        take_root(frame, n, len(weights))
        orientation_jacobian(arm.attitude, jacobian, n, target.metric)


@leaf
def movers_of(chain, match, p):
    """Number of joints that move the place of point p: those before its segment, and one that slides, at its end."""
    k = match.segment[p]
    row = chain.row[k]
    if chain.slides[row] == 1 and chain.kind[k] == ALONG_Z and match.sliding[p] == 0 and at_end(chain, match, p):
        return row + 1
    return row


@leaf
def add_point(frame, motion, match, p, movers, jacobian, weight):
    """Add w |r|^2 / 2 of one point at constant sigma.

    Columns are v_j + omega_j x place (Pinocchio's world Jacobian); the second derivative of a place by joints
    i <= j is omega_i x column_j.
    """
    x, y, z = match.place[p, 0], match.place[p, 1], match.place[p, 2]
    fx, fy, fz = weight * match.residual[p, 0], weight * match.residual[p, 1], weight * match.residual[p, 2]
    column = motion.column[p]
    for j in range(movers):
        cx = jacobian[j, 0] + jacobian[j, 4] * z - jacobian[j, 5] * y
        cy = jacobian[j, 1] + jacobian[j, 5] * x - jacobian[j, 3] * z
        cz = jacobian[j, 2] + jacobian[j, 3] * y - jacobian[j, 4] * x
        column[j, 0], column[j, 1], column[j, 2] = cx, cy, cz
        frame.slope[j] += cx * fx + cy * fy + cz * fz
        motion.torque[j, 0] += cy * fz - cz * fy
        motion.torque[j, 1] += cz * fx - cx * fz
        motion.torque[j, 2] += cx * fy - cy * fx
        cx, cy, cz = weight * cx, weight * cy, weight * cz
        for i in range(j + 1):
            frame.gauss[j, i] += column[i, 0] * cx + column[i, 1] * cy + column[i, 2] * cz


@leaf
def remove_sliding(frame, motion, match, chain, jacobian, weights):
    """Eliminate the sliding of every pool: subtract b b^T / W, W the pool's weight.

    b_j = sum_i w_i (u . column_ij + r_i . (omega_j x u)) couples the place along the segment's direction u to q_j;
    the Gauss-Newton part leaves out the second term, as its residual does not turn with the segment.
    """
    for p in range(len(weights)):
        if match.pool[p] != p or match.sliding[p] == 0:
            continue
        end, total = p, 0.0
        while end < len(weights) and match.pool[end] == p:
            total += weights[end]
            end += 1
        if not total > 0.0:
            continue
        u, movers = chain.direction[match.segment[p]], chain.row[match.segment[p]]
        for full in range(2):
            for j in range(movers):
                motion.slide[j] = sliding_slope(motion, match, jacobian, j, u, p, end, weights, full)
            for j in range(movers):
                for i in range(j + 1):
                    product = motion.slide[j] * motion.slide[i] / total
                    if full == 0:
                        frame.gauss[j, i] -= product
                    else:
                        frame.newton[j, i] -= product


@leaf
def sliding_slope(motion, match, jacobian, j, u, start, end, weights, full):
    """b_j of one pool, with the turning of the segment (full = 1) or without (full = 0)."""
    total = 0.0
    for i in range(start, end):
        if weights[i] > 0.0:
            column, r = motion.column[i, j], match.residual[i]
            along = u[0] * column[0] + u[1] * column[1] + u[2] * column[2]
            if full == 1:
                along += jacobian[j, 3] * (u[1] * r[2] - u[2] * r[1])
                along += jacobian[j, 4] * (u[2] * r[0] - u[0] * r[2])
                along += jacobian[j, 5] * (u[0] * r[1] - u[1] * r[0])
            total += weights[i] * along
    return total


@branch
def take_root(frame, n, m):
    """Turn the derivatives of S / 2 into those of sqrt(S) / m.

    The Gauss-Newton part keeps the majorizer of the reweighted norm; the full one subtracts the radial direction.
    """
    scale = 1.0 / (m * max(frame.root, SMALLEST_ROOT))
    radial = scale / max(frame.square, SMALLEST_ROOT * SMALLEST_ROOT)
    for i in range(n):
        for j in range(i + 1):
            frame.gauss[i, j] *= scale
            frame.newton[i, j] = scale * frame.newton[i, j] - radial * frame.slope[i] * frame.slope[j]
    for i in range(n):
        frame.slope[i] *= scale
