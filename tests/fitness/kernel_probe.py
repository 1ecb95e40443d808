"""A window into the compiled kernels: hang arms, pose them, and look at every record one evaluation leaves behind."""

from __future__ import annotations

import numpy as np

from armdesign.fitness.block import as_rows
from armdesign.fitness.kernels.area import frame_area
from armdesign.fitness.kernels.association import MATCH
from armdesign.fitness.kernels.orientation import ATTITUDE, METRICS
from armdesign.fitness.kernels.temporal import FRAME, MOTION, differentiate_frame, evaluate_frame
from armdesign.kinematics.compilation import entry
from armdesign.kinematics.kernels.skeleton import CHAIN, load_arm, update_skeleton
from armdesign.kinematics.models import ArmBlock


@entry
def hang_all(chains, placements, rows, yaws):
    """Hang one arm per chain."""
    for b in range(len(chains)):
        load_arm(chains[b], placements[b * (rows.shape[1] - 1) :], rows[b], yaws[b])


@entry
def pose_all(chains, poses):
    """Bring every skeleton up to date."""
    for b in range(len(chains)):
        update_skeleton(chains[b], poses[b * chains[b].dof :])


@entry
def look_all(
    chains, frames, matches, attitudes, motions, areas, jacobian, points, targets, weights, free, w_0, metric, delta,
    differentiate,
):  # fmt: skip
    """Evaluate, and where asked differentiate, one frame per arm."""
    for b in range(len(chains)):
        evaluate_frame(
            frames[b], matches[b], attitudes[b], chains[b], points[b], targets[b], weights, free, w_0, metric
        )
        areas[b] = frame_area(chains[b], matches[b], points[b], delta)
        if differentiate:
            differentiate_frame(
                frames[b], motions[b], matches[b], attitudes[b], chains[b], jacobian[b * chains[b].dof :], weights, w_0,
                metric,
            )  # fmt: skip


class Probe:
    """B arms of n joints, each with its own design, pose and frame; all records can be read afterwards."""

    def __init__(self, size, dof):
        self.size, self.dof = size, dof
        self.block = ArmBlock(size, dof)
        self.chains, self.frames = np.zeros(size, CHAIN), np.zeros(size, FRAME)
        self.matches, self.attitudes = np.zeros(size, MATCH), np.zeros(size, ATTITUDE)
        self.motions, self.areas = np.zeros(size, MOTION), np.zeros(size)
        self.attitudes["mount"] = np.eye(3)

    def hang(self, tables):
        """Put one table in every place; a single one is put in all."""
        rows, yaw = as_rows(tables if isinstance(tables, list) else [tables] * self.size)
        hang_all(self.chains, self.block.placements, rows, yaw)
        return self

    def pose(self, q):
        """Set the joint angles, shape (B, n) or (n,)."""
        self.block.q[:] = np.broadcast_to(q, (self.size, self.dof)).ravel()
        self.block.update()
        pose_all(self.chains, self.block.poses)
        return self

    def look(
        self, points, weights, *, target=None, w_0=0.0, metric="geodesic", mount=None, free=None, delta=0.01,
        differentiate=False,
    ):  # fmt: skip
        """Evaluate one frame per arm: points (B, m, 3) or (m, 3), target (B, 3, 3) or (3, 3)."""
        points = np.asarray(points, dtype=float)
        m = points.shape[-2]
        points = np.array(np.broadcast_to(points, (self.size, m, 3)), order="C")  # writable: one signature for all
        targets = np.array(np.broadcast_to(np.eye(3) if target is None else target, (self.size, 3, 3)), order="C")
        self.attitudes["mount"] = np.eye(3) if mount is None else mount
        look_all(
            self.chains, self.frames, self.matches, self.attitudes, self.motions, self.areas, self.block.jacobian,
            points, targets, np.array(weights, dtype=float), m - 1 if free is None else free,
            float(w_0), METRICS.index(metric), float(delta), differentiate,
        )  # fmt: skip
        return self

    def polylines(self, vertices):
        """Put plain polylines, shape (B, k, 3), in place of arms; for the association and the area alone."""
        vertices = np.asarray(vertices, dtype=float)
        pieces = np.diff(vertices, axis=1)
        extent, count = np.linalg.norm(pieces, axis=2), pieces.shape[1]
        self.chains["dof"], self.chains["segments"] = self.dof, count
        self.chains["extent"][:, :count], self.chains["start"][:, :count] = extent, vertices[:, :-1]
        self.chains["direction"][:, :count] = pieces / extent[:, :, None]
        self.chains["arc"][:, 1 : count + 1] = np.cumsum(extent, axis=1)
        self.chains["length"], self.chains["tip"] = extent.sum(axis=1), vertices[:, -1]
        return self

    def arcs(self, m):
        """Arc length of every point's place, shape (B, m) [m]."""
        segment = self.matches["segment"][:, :m]
        return np.take_along_axis(self.chains["arc"], segment, axis=1) + self.matches["along"][:, :m]
