"""A window into the compiled kernels: load arms, pose them, and look at every record one evaluation leaves behind."""

from __future__ import annotations

import numpy as np

from armdesign.fitness.block import as_rows
from armdesign.fitness.kernels.area import frame_area
from armdesign.fitness.kernels.orientation import METRICS
from armdesign.fitness.kernels.solver_state import ARM, SCRATCH
from armdesign.fitness.kernels.temporal import Target, differentiate_frame, evaluate_frame
from armdesign.kinematics.compilation import entry
from armdesign.kinematics.kernels.skeleton import load_arm, update_skeleton
from armdesign.kinematics.models import ArmBlock


@entry
def load_all(arms, placements, rows, yaws):
    """Load one design per arm."""
    for b in range(len(arms)):
        load_arm(arms[b].chain, placements[b * (rows.shape[1] - 1) :], rows[b], yaws[b])


@entry
def pose_all(arms, poses):
    """Bring every skeleton up to date."""
    for b in range(len(arms)):
        update_skeleton(arms[b].chain, poses[b * arms[b].chain.dof :])


@entry
def look_all(arms, scratch, areas, jacobian, points, targets, frame, delta, differentiate):
    """Evaluate, and where asked differentiate, one frame per arm; ``frame`` holds what the frames have in common."""
    for b in range(len(arms)):
        target = Target(points[b], targets[b], frame.weights, frame.w_0, frame.free, frame.metric)
        evaluate_frame(arms[b], scratch[b], target)
        areas[b] = frame_area(arms[b].chain, scratch[b].match, points[b], delta)
        if differentiate:
            differentiate_frame(arms[b], scratch[b], target, jacobian[b * arms[b].chain.dof :])


class Probe:
    """B arms of n joints, each with its own design, pose and frame; all records can be read afterwards."""

    def __init__(self, size, dof, prismatic=()):
        self.size, self.dof = size, dof
        self.block = ArmBlock(size, dof, prismatic)
        self.arms, self.scratch, self.areas = np.zeros(size, ARM), np.zeros(size, SCRATCH), np.zeros(size)
        self.chains, self.frames, self.attitudes = (self.arms[name] for name in ("chain", "frame", "attitude"))
        self.matches = self.scratch["match"]
        if any(prismatic):
            self.chains["slides"][:, :dof], self.chains["sliding"] = prismatic, 1
        self.attitudes["mount"] = np.eye(3)

    def load(self, tables):
        """Put one table in every place; a single one is put in all."""
        rows, yaw = as_rows(tables if isinstance(tables, list) else [tables] * self.size)
        load_all(self.arms, self.block.placements, rows, yaw)
        return self

    def pose(self, q):
        """Set the joint angles, shape (B, n) or (n,)."""
        self.block.q[:] = np.broadcast_to(q, (self.size, self.dof)).ravel()
        self.block.update()
        pose_all(self.arms, self.block.poses)
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
        free = m - 1 if free is None else free
        frame = Target(points[0], targets[0], np.array(weights, dtype=float), float(w_0), free, METRICS.index(metric))
        look_all(
            self.arms, self.scratch, self.areas, self.block.jacobian, points, targets, frame, float(delta),
            differentiate,
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
