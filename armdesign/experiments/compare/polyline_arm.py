"""The fitness of a ready-made arm: its skeleton is the polyline through its joint origins.

The kernels that evaluate DH arms read an arm as joint frames and a chain of straight pieces, each along the x or z
axis of a frame. Any serial arm can be put that way: the frame of a joint may be turned at will as long as the joint's
axis, then no longer its z, is turned with it. Here every joint's frame is turned so that its x axis runs along the
piece behind the joint. The piece from the base to the first joint starts off the task's origin, which the kernels
know only of pieces behind a joint; it hangs on a mount, a joint at the base that is held at 0.

Without a place for the base the demonstration stays where it is: p_0 of the area E is the demonstrator's shoulder
wherever the base is. At a site of the room the demonstration is seen from the base, as that of a design is, and p_0 is
the base.
"""

from __future__ import annotations

from copy import copy
from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import DesignError
from armdesign.experiments.compare.serial_arm import SUPPORTED, SerialArm
from armdesign.fitness.batch import Batch, CandidateQueue
from armdesign.fitness.block import BlockEvaluator, PathResult, Scores
from armdesign.fitness.constraints import turned_bases
from armdesign.fitness.kernels.solver_state import SAMPLE
from armdesign.fitness.problem import Problem, make_problem, start_poses
from armdesign.fitness.slots import Slots
from armdesign.kinematics.base_pose import MOUNTINGS
from armdesign.kinematics.dh import rot_z
from armdesign.kinematics.kernels.skeleton import ALONG_X, CHAIN, MAX_DOF
from armdesign.kinematics.models import ArmBlock, BlockViews, se3_view
from armdesign.settings.place import Site
from armdesign.settings.sections import Fitness, Solver

FULL_TURN = np.pi
"""Where a continuous joint's start poses end, either way [rad]."""


class PolylineChain:
    """A ready-made arm in the form that the kernels take, with N joints, one more than it has where it is mounted."""

    def __init__(self, arm: SerialArm) -> None:
        """Turn the frames so that each has the piece behind it along its x axis.

        Raises:
            DesignError: With the mount there are more joints than the kernels take.
        """
        self.arm = arm
        self.mounted = int(arm.pieces[0] > 0.0)  # 1 where a mount comes before the arm's joints
        if arm.dof + self.mounted > MAX_DOF:
            raise DesignError(
                f"{arm.source}: the arm has {arm.dof} joints, the first of them away from the base",
                value=arm.dof, allowed=f"{SUPPORTED}, {MAX_DOF - 1} where the first stands away from the base",
            )  # fmt: skip
        poses, axes, pieces = list(arm.placements), list(arm.axes), list(arm.pieces)
        if self.mounted:
            poses.insert(0, np.eye(4))
            axes.insert(0, np.array([0.0, 0.0, 1.0]))
        else:
            pieces.pop(0)
        turns = [turn_to(pose[:3, 3] if length > 0.0 else None) for pose, length in zip(poses[1:], pieces, strict=True)]
        before = [np.eye(3), *turns]
        # joint axes in the turned frames (N, 3); turned frame of each joint in the one before, first in the base
        self.axes = np.array([turn.T @ axis for turn, axis in zip(turns, axes, strict=True)])
        self.placements = np.array([framed(a, p, b) for a, p, b in zip(before, poses, turns, strict=False)])
        self.chain = chain_record(len(turns), np.array(pieces), turns[-1].T @ poses[-1][:3, :3])

    def first_placement(self, base: Array) -> Array:
        """Placement of the first joint for a base pose (x, y, z, yaw), shape (4, 4) [m, rad]."""
        pose = rot_z(float(base[3]))
        pose[:3, 3] = base[:3]
        return np.asarray(pose @ self.placements[0])


def turn_to(piece: Array | None) -> Array:
    """A rotation whose x axis runs along a piece; identity where there is none."""
    if piece is None:
        return np.eye(3)
    x = piece / np.linalg.norm(piece)
    aside = np.eye(3)[int(np.argmin(np.abs(x)))]
    y = np.cross(aside, x)
    y /= np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def framed(before: Array, placement: Array, behind: Array) -> Array:
    """A placement between frames turned by ``before`` and ``behind``, shape (4, 4)."""
    pose = np.eye(4)
    pose[:3, :3] = before.T @ placement[:3, :3] @ behind
    pose[:3, 3] = before.T @ placement[:3, 3]
    return pose


def chain_record(joints: int, pieces: Array, tool: Array) -> NDArray[np.void]:
    """The constant part of a chain, the piece behind each joint along its frame's x axis; shape (1,)."""
    record = np.zeros(1, dtype=CHAIN)
    chain = record[0]
    kept = np.flatnonzero(pieces > 0.0)
    count = len(kept)
    arcs = np.r_[0.0, np.cumsum(pieces[kept])]
    chain["dof"], chain["length"], chain["segments"], chain["tool"] = joints, arcs[-1], count, tool
    chain["row"][:count], chain["kind"][:count], chain["sign"][:count] = kept + 1, ALONG_X, 1.0
    chain["extent"][:count], chain["arc"][: count + 1] = pieces[kept], arcs
    return record


class AxisBlock(ArmBlock):
    """B copies of an arm whose joints turn about any axis, as one Pinocchio model; see ArmBlock."""

    def __init__(self, size: int, axes: Array) -> None:
        """Allocate the model.

        Args:
            size: Number of copies B.
            axes: Joint axes, shape (N, 3).
        """
        self.size, self.dof = size, len(axes)
        self.model = pin.Model()
        for k in range(size):
            parent = 0
            for i, axis in enumerate(axes):
                joint = pin.JointModelRevoluteUnaligned(axis)
                parent = self.model.addJoint(parent, joint, pin.SE3.Identity(), f"arm_{k}_joint_{i}")
        self.data = self.model.createData()
        self.q = np.zeros(self.model.nq)
        self.poses = se3_view(self.data.oMi)
        self.placements = se3_view(self.model.jointPlacements)
        self.jacobian = self.data.J.T.reshape(-1, 6)
        self.views = BlockViews(self.placements, self.poses, self.jacobian, self.q)
        self._check_views()


class PolylineEvaluator(BlockEvaluator):
    """Scores one ready-made arm on one problem at any base poses (x, y, z, yaw) in the task's frame [m, rad].

    A pure function of the base pose, whatever the block size and whatever was evaluated before.
    """

    def __init__(self, problem: Problem, arm: SerialArm, block: int | None = None) -> None:
        """Allocate a block.

        Args:
            problem: What to evaluate on, see ``arm_problem``.
            arm: The arm.
            block: Number of base poses side by side.
        """
        self.arm_chain = PolylineChain(arm)
        self.mounting: Array | None = None
        super().__init__(problem, block)
        for slots in self.slots:
            slots.arms = AxisBlock(len(slots), self.arm_chain.axes)

    def on(self, problem: Problem) -> PolylineEvaluator:
        """This arm on another problem; the two share their block and must not run at the same time."""
        other = copy(self)
        other.problem = problem
        return other

    def at(self, site: Site) -> PolylineEvaluator:
        """This arm with its base mounted as at a site of the room; base poses then are those in the room."""
        other = copy(self)
        other.mounting = MOUNTINGS[site.mounted]
        return other

    def scores(self, bases: ArrayLike, cutoff: Array | None = None) -> Scores:
        """Fitness at many base poses.

        Args:
            bases: Base poses (x, y, z, yaw), shape (N, 4) [m, rad].
            cutoff: Fitness beyond which one may be dropped, shape (N,); none by default.
        """
        batch = self._batch(bases, cutoff)
        return self._scores(self._run(batch))

    def follow_from(self, base: ArrayLike) -> tuple[Scores, PathResult]:
        """Fitness at one base pose, with the path of the arm's n joints; the path is empty if the start is missed."""
        scores, path = self._traced(self._batch(base, None))
        return scores, replace(path, q=path.q[:, self.arm_chain.mounted :].copy())

    def _batch(self, bases: ArrayLike, cutoff: Array | None) -> Batch:
        """Base poses in the place of the first DH row, or at a site those of the batch; the other rows stay empty."""
        poses = np.asarray(bases, dtype=float).reshape(-1, 4)
        rows = np.zeros((len(poses), self.problem.dof + 1, 4))
        limits = np.full(len(poses), np.inf) if cutoff is None else np.asarray(cutoff, dtype=float)
        batch = Batch(rows, np.zeros(len(poses)), limits)
        if self.mounting is not None:
            mountings = np.broadcast_to(self.mounting, (len(poses), 3, 3))
            return batch._replace(bases=turned_bases(poses[:, 3], poses[:, :3], mountings))
        rows[:, 0] = poses
        return batch

    def _exchange(self, slots: Slots, queue: CandidateQueue) -> None:
        """Load what is next, and put the arm in the place of the DH arms that were made of the rows."""
        super()._exchange(slots, queue)
        n, arm = self.problem.dof, self.arm_chain
        for b in np.flatnonzero((slots.states["phase"] == SAMPLE) & (slots.states["steps"] == 0)):
            slots.chains[b] = arm.chain[0]
            poses = arm.placements.copy()
            poses[0] = arm.first_placement(queue.batch.rows[slots.states[b]["candidate"], 0])
            turns = poses[:, :3, :3].transpose(0, 2, 1).reshape(n, 9)
            slots.arms.placements[b * n : (b + 1) * n] = np.concatenate([turns, poses[:, :3, 3]], axis=1)


def arm_problem(arm: SerialArm, P: Array, R: Array | None, dt: float, fitness: Fitness, solver: Solver) -> Problem:
    """The problem for a ready-made arm, with its own joint limits; a mount's limits are 0.

    Args:
        arm: The arm.
        P: Points in a frame at the demonstrator's shoulder, z up, shape (T, m, 3) [m].
        R: Hand rotations, shape (T, 3, 3), or None.
        dt: Time between frames [s].
        fitness: Settings of the fitness with resolved weights.
        solver: Settings of the solver.
    """
    starting = np.clip(arm.limits, -FULL_TURN, FULL_TURN)
    starting = np.where(np.isfinite(arm.limits), arm.limits, starting)
    problem = make_problem(P, R, dt, starting, fitness, solver)
    n, mounted = arm.dof, PolylineChain(arm).mounted
    record = problem.record[0]
    for side, name in enumerate(("lower", "upper")):
        record[name][:mounted] = 0.0
        record[name][mounted : mounted + n] = arm.limits[:, side]
    starts = start_poses(len(problem.starts), starting)
    return replace(problem, starts=np.ascontiguousarray(np.hstack([np.zeros((len(starts), mounted)), starts])))
