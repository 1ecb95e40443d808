"""Second derivatives of the orientation error e_R by turns of the arm, in its three metrics.

Coordinate c turns the hand by omega_c; of two, the one nearer to the base turns the other's axis.
"""

from __future__ import annotations

import numpy as np

from armdesign.fitness.kernels.orientation import AXIS, EULER, GEODESIC
from armdesign.fitness.kernels.trial import KINK
from armdesign.fitness.kernels.variations import BASE, YAW, Q, coordinates
from armdesign.kinematics.compilation import branch, leaf

MET = 10.0 * KINK
"""e_R below which the orientation counts as met [rad]: it stays met when the design changes."""


@leaf
def model_turn(hand, turn, metric):
    """How a turn (3,) of the hand (3, 3) moves rho, up to what is normal to it: K of the metric times the turn."""
    x, y, z = turn[0], turn[1], turn[2]
    if metric == EULER:
        cosine = np.sqrt(hand[0, 0] ** 2 + hand[1, 0] ** 2)
        level_x = hand[0, 0] / cosine if cosine > 1e-12 else 1.0
        level_y = hand[1, 0] / cosine if cosine > 1e-12 else 0.0
        forward = level_x * x + level_y * y
        cosine = max(cosine, 1e-12)
        return forward / cosine, level_x * y - level_y * x, z - hand[2, 0] * forward / cosine
    along = hand[0, 2] * x + hand[1, 2] * y + hand[2, 2] * z if metric == AXIS else 0.0
    return x - along * hand[0, 2], y - along * hand[1, 2], z - along * hand[2, 2]


@leaf
def dot(a, b):
    """Scalar product of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@leaf
def triple(a, b, c):
    """The product a . (b x c)."""
    x, y, z = b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]
    return a[0] * x + a[1] * y + a[2] * z


@branch
def second_turn(variation, attitude, target, metric, a, b):
    """Second derivative of e_R by turns a and b (3,), of which a is the one nearer to the base."""
    normal = variation.normal
    if metric == GEODESIC:
        radial = 0.0 if variation.met == 1 else dot(a, normal) * dot(b, normal)
        return variation.curvature * (dot(a, b) - radial) + 0.5 * triple(normal, a, b)
    if metric == AXIS:
        h, t = attitude.hand[:, 2], target[:, 2]
        radial = 0.0 if variation.met == 1 else dot(a, normal) * dot(b, normal)
        cosine = dot(h, t)
        normal_part = cosine * (dot(a, b) - radial) - 0.5 * (dot(a, t) * dot(b, h) + dot(a, h) * dot(b, t))
        return variation.curvature * normal_part + 0.5 * triple(normal, a, b)
    return second_euler(variation, attitude, metric, a, b)


@branch
def second_euler(variation, attitude, metric, a, b):
    """Second derivative of e_R by turns a and b in the metric EULER, whose K changes with yaw and pitch."""
    normal, hand = variation.normal, attitude.hand
    turned = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    Ka = model_turn(attitude.hand, a, metric)
    Kb = model_turn(attitude.hand, b, metric)
    roll, pitch, yaw = model_turn(attitude.hand, turned, metric)
    cosine = max(np.sqrt(hand[0, 0] ** 2 + hand[1, 0] ** 2), 1e-12)
    sine = -hand[2, 0]
    forward = Kb[0] * cosine
    roll += Kb[1] / cosine * Ka[2] + forward * sine / cosine**2 * Ka[1]
    pitch -= forward * Ka[2]
    yaw += sine / cosine * Kb[1] * Ka[2] + forward / cosine**2 * Ka[1]
    radial = 0.0 if variation.met == 1 else dot(Ka, normal) * dot(Kb, normal)
    return variation.curvature * (dot(Ka, Kb) - radial) + dot(normal, (roll, pitch, yaw))


@branch
def bent_apart(variation, hand, target, a, b):
    """Second derivative of e_R by a turn a of the hand and the turn -b of the target in the metric EULER."""
    Ka = model_turn(hand, a, EULER)
    Kb = model_turn(target, b, EULER)
    radial = 0.0 if variation.met == 1 else dot(Ka, variation.normal) * dot(Kb, variation.normal)
    return variation.curvature * (dot(Ka, Kb) - radial)


@branch
def set_normal(variation, attitude, metric, n, w_0):
    """Direction of rho and how e_R bends; where the orientation is met, the pull that balances the positions'.

    Call it with ``variation.slope`` that of the position part.
    """
    error = attitude.error
    variation.met = 1 if error < MET else 0
    if variation.met == 1:
        variation.curvature = 1.0 / KINK
        balance(variation, attitude, metric, n, w_0)
        return
    for r in range(3):
        variation.normal[r] = attitude.rho[r] / error
    variation.curvature = 1.0 / error
    if metric == GEODESIC:
        variation.curvature = 0.5 / np.tan(0.5 * error)
    elif metric == AXIS:
        variation.curvature = 1.0 / np.sin(error)


@branch
def balance(variation, attitude, metric, n, w_0):
    """Least squares of slope_j + w_0 K_j . normal = 0 over the joints that are not at a limit."""
    N, right = variation.normal_matrix, variation.normal_right
    for r in range(3):
        right[r] = N[r, 0] = N[r, 1] = N[r, 2] = 0.0
    for j in range(n):
        q = BASE + 4 * j + Q
        if variation.at_limit[j] == 1:
            continue
        image = model_turn(attitude.hand, variation.axis[q, 3:], metric)
        for r in range(3):
            right[r] -= image[r] * variation.slope[q] / w_0
            for s in range(3):
                N[r, s] += image[r] * image[s]
    for r in range(3):
        N[r, r] += 1e-9  # keeps N regular where fewer than three joints can turn the hand
    determinant = triple(N[0], N[1], N[2])  # Cramer's rule
    for r in range(3):
        variation.normal[r] = triple(right, N[(r + 1) % 3], N[(r + 2) % 3]) / determinant


@branch
def add_orientation(variation, attitude, chain, target, metric, n, w_0):
    """Add w_0 e_R to slope and mixed; where ``variation.follows``, the mount goes with the start's tool.

    A turn of the mount acts behind all joints; in the base frame it is minus the tool's turn at the start.
    The metric EULER counts its angles in the base frame: there a base that turns by its yaw turns the target back,
    which is not the same as to turn the hand.
    """
    set_normal(variation, attitude, metric, n, w_0)
    for c in range(variation.first, coordinates(n)):
        axis = variation.axis[c, 3:]
        joint = c >= BASE and (c - BASE) % 4 == Q
        turns_target = metric == EULER and c == YAW and variation.first == 0
        behind, turn = variation.follows == 1 and not joint, variation.mount_turn[c]
        if behind:
            for r in range(3):
                turn[r] = -dot(chain.tip_rotation[r], variation.tool_turn[c])
        for j in range(n):
            q = BASE + 4 * j + Q
            other = variation.axis[q, 3:]
            if turns_target:
                bent = bent_apart(variation, attitude.hand, target, other, axis)
            elif q <= c:
                bent = second_turn(variation, attitude, target, metric, other, axis)
            else:
                bent = second_turn(variation, attitude, target, metric, axis, other)
            if behind:
                bent += second_turn(variation, attitude, target, metric, other, turn)
            variation.mixed[j, c] += w_0 * bent
        image = model_turn(target if turns_target else attitude.hand, axis, metric)
        if joint:
            j = (c - BASE) // 4
            variation.pull[j] = variation.slope[c] + w_0 * dot(variation.normal, image)
        if variation.met == 0:
            variation.slope[c] += w_0 * dot(variation.normal, image)
            if behind:
                image = model_turn(attitude.hand, turn, metric)
                variation.slope[c] += w_0 * dot(variation.normal, image)
