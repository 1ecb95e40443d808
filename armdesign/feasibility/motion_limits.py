"""How far a path asks too much of the joints: speeds, accelerations and torques, with their gradients.

All are those of the smooth motion, which verdict, builds and export use. Its fit is linear in the joint angles, so it
tells its derivatives by the design, too; for joints held inside their limits, that of the free fit stands in.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.bodies.arm_body import arm_body
from armdesign.bodies.loads import GRAVITY, joint_torques
from armdesign.feasibility.needs import JointNeeds
from armdesign.kinematics.dh import DHTable, joint_letters
from armdesign.kinematics.motion import Smoothing
from armdesign.settings import Body

BRIM = 1.0 - 1e-9
"""Share of a limit that may be used, so that rounding does not pass it."""
STEP = 1e-6
"""Step of the differences for the gradient of torques [rad; m]."""


@dataclass(frozen=True, eq=False)
class Load:
    """What moves besides the joints where torques are limited.

    Attributes:
        body: What the arm is built of.
        payload: Point mass at the tool [kg].
        placed: Whether the base stands on a mounting face.
        limits: Joint limits, shape (n, 2) [rad; m of joints that slide].
        prismatic: Which joints slide, n of them.
    """

    body: Body
    payload: float
    placed: bool
    limits: Array
    prismatic: tuple[bool, ...]


@dataclass(frozen=True, eq=False)
class Design:
    """One candidate.

    Attributes:
        rows: DH rows, shape (n + 1, 4).
        base: Pose that row 0 starts from, shape (12,).
        slides: s_j of its joints, shape (n,) [m].
    """

    rows: Array
    base: Array
    slides: Array


def speed_excess(needs: JointNeeds, smooth: Smoothing, path: Array, turns: Array | None) -> tuple[float, Array | None]:
    """Largest share by which a path passes a limit of speed or of acceleration, 0 for none, with its gradient.

    Args:
        needs: The limits.
        smooth: Smoothing of the demonstration.
        path: Joint path, shape (T, n) [rad].
        turns: Its derivatives by all entries, shape (T, n, E), where the gradient is wanted.

    Returns:
        (peak / limit - 1)+, and its gradient, shape (E,).
    """
    worst, slope = 0.0, None if turns is None else np.zeros(turns.shape[2])
    if needs.speed is None and needs.acceleration is None:
        return worst, slope
    motion = smooth.motion(path)
    for order, limit, values in ((1, needs.speed, motion.v), (2, needs.acceleration, motion.a)):
        if limit is None:
            continue
        shares = values / (limit * BRIM)
        t, j = np.unravel_index(np.argmax(np.abs(shares)), shares.shape)
        excess = float(abs(shares[t, j])) - 1.0
        if excess > worst:
            worst = excess
            if turns is not None:
                change = smooth.weights(order, int(t)) @ turns[:, j, :]
                slope = np.sign(shares[t, j]) * change / (limit[j] * BRIM)
    return worst, slope


def torque_excess(needs: JointNeeds, load: Load, smooth: Smoothing, design: Design, path: Array) -> float:
    """Largest share by which the inverse dynamics of a path pass a limit of torque, 0 for none.

    Args:
        needs: The limits.
        load: Body and payload.
        smooth: Smoothing of the demonstration.
        design: The candidate.
        path: Its joint path, shape (T, n) [rad].
    """
    if needs.torque is None:
        return 0.0
    table = DHTable.from_rows(design.rows[:, :3], joints=joint_letters(load.prismatic))
    arm = arm_body(table, load.body, design.slides, load.limits, placed=load.placed, side=None)
    gravity = design.base[:9].reshape(3, 3) @ np.array(GRAVITY)
    torque = joint_torques(arm, smooth.motion(path), load.payload, gravity)
    return max(float((np.abs(torque) / (needs.torque * BRIM)).max()) - 1.0, 0.0)


def torque_slope(
    needs: JointNeeds, load: Load, smooth: Smoothing, design: Design, path: Array, turns: Array
) -> tuple[float, Array]:
    """Torque excess with its gradient by all entries, by forward differences of design and path together.

    Args:
        needs: The limits.
        load: Body and payload.
        smooth: Smoothing of the demonstration.
        design: The candidate.
        path: Its joint path, shape (T, n) [rad].
        turns: The path's derivatives by all entries, shape (T, n, E).
    """
    excess, cells = torque_excess(needs, load, smooth, design, path), 3 * len(design.rows)
    slope = np.zeros(turns.shape[2])
    if excess == 0.0:
        return excess, slope
    for e in range(turns.shape[2]):
        rows = design.rows.copy()
        if e < cells:
            rows[e // 3, e % 3] += STEP
        elif not turns[:, :, e].any():
            continue  # where the base stands does not matter to torques, but through the path
        stepped = Design(rows, design.base, design.slides)
        slope[e] = (torque_excess(needs, load, smooth, stepped, path + STEP * turns[:, :, e]) - excess) / STEP
    return excess, slope


def peak_excess(
    needs: JointNeeds, load: Load, smooth: Smoothing, design: Design, path: Array, turns: Array | None
) -> tuple[float, Array | None]:
    """What a path asks too much of the joints, as the sum of both kinds of excess, with its gradient.

    Args:
        needs: The limits.
        load: Body and payload.
        smooth: Smoothing of the demonstration.
        design: The candidate.
        path: Its joint path, shape (T, n) [rad].
        turns: The path's derivatives by all entries, shape (T, n, E), where the gradient is wanted.
    """
    fast, slope = speed_excess(needs, smooth, path, turns)
    if turns is None or slope is None:
        return fast + torque_excess(needs, load, smooth, design, path), None
    heavy, also = torque_slope(needs, load, smooth, design, path, turns)
    return fast + heavy, slope + also
