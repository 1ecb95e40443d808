"""Obstacles and arms for the tests of clearance, laid out by hand."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from armdesign.cell.kernels.distance import BOX, CYLINDER, MESH, PLANE, SPHERE, ObstacleArrays

KINDS = {"box": BOX, "sphere": SPHERE, "cylinder": CYLINDER, "plane": PLANE, "mesh": MESH}


def obstacle_arrays(*entries):
    """Obstacles given as (kind, size, poses (S, 4, 4)), S = 1 for one that stands still."""
    count = len(entries)
    poses, first, frames, turns = [], [], [], []
    for _, _, own in entries:
        first.append(sum(map(len, poses)))
        frames.append(len(own))
        poses.append(np.concatenate([own[:, :3, :3].transpose(0, 2, 1).reshape(-1, 9), own[:, :3, 3]], axis=1))
        steps = Rotation.from_matrix(own[:-1, :3, :3].transpose(0, 2, 1) @ own[1:, :3, :3]).as_rotvec()
        turns.append(np.concatenate([steps.reshape(-1, 3), np.zeros((1, 3))]))
    sizes = np.array([size for _, size, _ in entries], dtype=float).reshape(count, 3)
    return ObstacleArrays(
        kind=np.array([KINDS[kind] for kind, _, _ in entries], dtype=np.int64), size=sizes,
        centre=np.zeros((count, 3)), radius=np.linalg.norm(sizes, axis=1), error=np.zeros(count),
        first=np.array(first, dtype=np.int64), frames=np.array(frames, dtype=np.int64),
        poses=np.concatenate(poses), turns=np.concatenate(turns), origin=np.zeros((count, 3)),
        spacing=np.zeros(count), shape=np.zeros((count, 3), dtype=np.int64), offset=np.zeros(count, dtype=np.int64),
        values=np.zeros(1),
    )  # fmt: skip


def at(x, y, z, rotvec=(0.0, 0.0, 0.0)):
    """One pose, shape (1, 4, 4)."""
    pose = np.eye(4)[None].copy()
    pose[0, :3, :3], pose[0, :3, 3] = Rotation.from_rotvec(rotvec).as_matrix(), (x, y, z)
    return pose


def columns(rotvec, origin):
    """A base pose, shape (12,)."""
    return np.r_[Rotation.from_rotvec(rotvec).as_matrix().T.ravel(), origin]


def random_arms(rng, count, n, frames, sweep=1.0):
    """Rows (N, n + 1, 4), bases (N, 12) and smooth paths (N, T, n)."""
    rows = np.zeros((count, n + 1, 4))
    rows[:, :, 0] = rng.uniform(-3.0, 3.0, (count, n + 1))
    rows[:, 1:n, 1:3] = rng.uniform(0.0, 0.4, (count, n - 1, 2))
    rows[:, 0, 2], rows[:, n, 2] = 0.2, 0.1
    bases = np.stack([columns(rng.uniform(-1.0, 1.0, 3), rng.uniform(-0.3, 0.3, 3)) for _ in range(count)])
    t = np.linspace(0.0, 1.0, frames)[None, :, None]
    middle, swing, phase = rng.uniform(-1.0, 1.0, (3, count, 1, n))
    return rows, bases, 2.0 * middle + sweep * swing * np.sin(3.0 * t + 3.0 * phase)
