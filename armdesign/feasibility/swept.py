"""How far an arm's exact bodies leave the volume that the demonstrator's arm has swept."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody
from armdesign.cell.distance_field import swept_triangles, triangle_tree
from armdesign.cell.kernels.triangles import point_distances
from armdesign.kinematics.models import arm_model

PRECISION = 1e-4
"""How far the result may be above what it is [m]."""
LOOKED = 200
"""Frames that are looked at first."""


def envelope_excess(arm: ArmBody, pose: Array, q: Array, shown: Array) -> float:
    """How far the bodies, but for link 0, are from the swept surface at most, in any frame [m].

    A point at the distance D(x) of a cylinder's axis is no farther away than D(x) + r on its surface. D changes by no
    more than x moves, so that a piece of an axis with D_m in its middle stays below D_m + half its length: pieces that
    may hold the largest are halved until it is known to ``PRECISION``.

    Args:
        arm: The arm with its body.
        pose: Where its base stands in the frame of the demonstration, shape (4, 4).
        q: Its joint path, shape (T, n) [rad; m of prismatic joints].
        shown: The demonstrator's arm from the base to the hand, shape (T, m + 1, 3) [m].
    """
    tree = triangle_tree(swept_triangles(shown))
    ends, radius = axis_ends(arm, pose, q)
    # first some frames: what has hardly moved since one of them needs no look of its own
    middle, half = ends.mean(axis=2), np.linalg.norm(ends[:, :, 1] - ends[:, :, 0], axis=2) / 2.0
    looked = np.unique(np.linspace(0, len(q) - 1, LOOKED).astype(int))
    near = looked[np.abs(np.arange(len(q))[:, None] - looked).argmin(axis=1)]
    away = point_distances(tree, middle[looked].reshape(-1, 3)).reshape(len(looked), -1)
    worst = float((away + radius).max(initial=0.0))
    moved = np.linalg.norm(middle - middle[near], axis=2)
    left = away[np.searchsorted(looked, near)] + moved + radius + half > worst + PRECISION
    ends, radius = ends[left], np.broadcast_to(radius, left.shape)[left]
    while len(ends):
        middle, half = ends.mean(axis=1), np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2.0
        away = point_distances(tree, np.ascontiguousarray(middle)) + radius
        worst = max(worst, float(away.max()))
        left = away + half > worst + PRECISION
        middle, ends, radius = middle[left], ends[left], np.tile(radius[left], 2)
        ends = np.concatenate([np.stack([ends[:, 0], middle], axis=1), np.stack([middle, ends[:, 1]], axis=1)])
    return worst + PRECISION


def axis_ends(arm: ArmBody, pose: Array, q: Array) -> tuple[Array, Array]:
    """Ends of the axes of S cylinders in every frame, shape (T, S, 2, 3) [m], and their radii, shape (S,) [m].

    Args:
        arm: The arm with its body; link 0 is left out.
        pose: Where its base stands, shape (4, 4).
        q: Its joint path, shape (T, n) [rad; m of prismatic joints].
    """
    model = arm_model(arm.table)
    data, moving = model.createData(), [part for part in arm.parts if part.link > 0]
    links, ends = [part.link for part in moving], np.stack([part.solid.ends for part in moving])
    placed = []
    for angles in q:
        pin.forwardKinematics(model, data, angles)
        frames = pose @ np.stack([data.oMi[link].homogeneous for link in links])
        placed.append(np.einsum("sij,sej->sei", frames[:, :3, :3], ends) + frames[:, None, :3, 3])
    return np.stack(placed), np.array([part.solid.radius for part in moving])
