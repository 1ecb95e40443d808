"""The path evaluation written plainly: one arm at a time, Pinocchio's Python calls and NumPy, Gauss-Newton steps.

The method is the package's (position only): exact sigma, damped least squares with joint limits and the eps ball as
part of the step, the same tolerance, the area E. What a careful author writes who does not compile anything.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from armdesign.fitness.problem import Problem
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.models import arm_model

Array = NDArray[np.float64]
FLOOR_WEIGHT = 1e-6


@dataclass
class Followed:
    """A path: f and E [m], evaluations spent, frames solved."""

    f: float
    E: float
    steps: int
    frames: int


@dataclass
class Pose:
    """Where the points are on the arm at one pose, and what that costs."""

    q: Array
    arcs: Array
    segment: NDArray[np.int64]
    sliding: NDArray[np.bool_]
    places: Array
    residual: Array
    value: float
    g: float


class PlainArm:
    """One arm on one problem."""

    def __init__(self, table: DHTable, problem: Problem) -> None:
        """Build the Pinocchio model and what of the skeleton does not depend on q."""
        record, self.n, self.m = problem.record[0], problem.dof, problem.points
        self.problem, self.weights = problem, record["weights"][: self.m].copy()
        self.lower, self.upper = record["lower"][: self.n].copy(), record["upper"][: self.n].copy()
        self.radius, self.delta = float(record["radius"]), float(record["delta"])
        self.tolerance, self.floor = float(record["tolerance"]), float(record["floor"])
        self.max_steps = int(record["max_steps"])
        self.model = arm_model(table)
        self.data = self.model.createData()
        self.tool = table.placements()[self.n][:3, :3]
        self.base_x = np.array([np.cos(table.base_yaw), np.sin(table.base_yaw), 0.0])
        signed = np.stack([table.a, table.d], axis=1).ravel()
        self.kept = signed != 0.0
        self.signed, self.extent = signed[self.kept], np.abs(signed[self.kept])
        self.rows = np.repeat(np.arange(self.n + 1), 2)[self.kept]  # joints that move each segment
        self.arc = np.r_[0.0, np.cumsum(self.extent)]
        self.moves = np.arange(self.n)[None, :] < self.rows[:, None]

    def follow(self, q: Array) -> Followed:
        """Follow the task from a start pose, shape (n,)."""
        poses, steps = [self.pose(q, self.problem.P[0])], 0
        for points in self.problem.P[1:]:
            pose, spent = self.solve(points, poses[-1].q)
            poses.append(pose)
            steps += spent
        area = [self.area(pose, points) for pose, points in zip(poses, self.problem.P, strict=True)]
        return Followed(float(np.mean([pose.g for pose in poses])), float(np.mean(area)), steps, len(poses))

    def pose(self, q: Array, points: Array) -> Pose:
        """Evaluate one pose; Pinocchio's data is left at it."""
        pin.computeJointJacobians(self.model, self.data, q)
        starts, directions, tip = self.skeleton()
        arcs, segment = self.associate(starts, directions, points)
        along = arcs - self.arc[segment]
        places = starts[segment] + along[:, None] * directions[segment]
        sliding = (along > 0.0) & (along < self.extent[segment])
        places, sliding = np.vstack([places, tip]), np.r_[sliding, False]
        arcs, segment = np.r_[arcs, self.arc[-1]], np.r_[segment, len(self.extent) - 1]
        residual = places - points
        square = float(self.weights @ (residual * residual).sum(axis=1))
        return Pose(q, arcs, segment, sliding, places, residual, 0.5 * square, np.sqrt(square) / self.m)

    def skeleton(self) -> tuple[Array, Array, Array]:
        """First point and direction of every segment, and the end-effector."""
        frames = [self.data.oMi[i + 1] for i in range(self.n)]
        rotations = [frame.rotation for frame in frames]
        x_axes = [self.base_x, *(rotation[:, 0] for rotation in rotations)]
        z_axes = [*(rotation[:, 2] for rotation in rotations), rotations[-1] @ self.tool[:, 2]]
        axes = np.stack([x_axes, z_axes], axis=1).reshape(-1, 3)[self.kept]
        corners = np.vstack([np.zeros(3), np.cumsum(axes * self.signed[:, None], axis=0)])
        return corners[:-1], axes * np.sign(self.signed)[:, None], corners[-1]

    def associate(self, starts: Array, directions: Array, points: Array) -> tuple[Array, NDArray[np.int64]]:
        """Arc lengths and segments of all points but the hand: their closest places if those are in order."""
        away = points[:-1, None] - starts[None]
        feet = (away * directions).sum(axis=2)
        clamped = np.clip(feet, 0.0, self.extent)
        square = (away * away).sum(axis=2) + clamped * (clamped - 2.0 * feet)
        segment = square.argmin(axis=1)
        arcs = self.arc[segment] + clamped[np.arange(len(segment)), segment]
        if (np.diff(arcs) >= 0.0).all():
            return arcs, segment
        arcs = self.in_order(feet, starts, directions, points)
        return arcs, np.clip(np.searchsorted(self.arc, arcs, "right") - 1, 0, len(self.extent) - 1)

    def in_order(self, feet: Array, starts: Array, directions: Array, points: Array) -> Array:
        """The best arc lengths that do not decrease, by a dynamic programme over all places a pool may have."""
        w, count = np.maximum(self.weights, FLOOR_WEIGHT), len(points) - 1
        pools = [(first, end) for first in range(count) for end in range(first + 1, count + 1)]
        common = np.stack([np.average(feet[a:b], axis=0, weights=w[a:b]) for a, b in pools])
        arcs = np.sort((self.arc[:-1] + np.clip(common, 0.0, self.extent)).ravel())
        segment = np.clip(np.searchsorted(self.arc, arcs, "right") - 1, 0, len(self.extent) - 1)
        places = starts[segment] + (arcs - self.arc[segment])[:, None] * directions[segment]
        total, back = np.zeros(len(arcs)), []
        for i in range(count):
            least = np.minimum.accumulate(total)
            back.append(np.maximum.accumulate(np.where(total == least, np.arange(len(arcs)), 0)))
            total = least + w[i] * ((places - points[i]) ** 2).sum(axis=1)
        chosen = [int(total.argmin())]
        for where in reversed(back[1:]):
            chosen.append(int(where[chosen[-1]]))
        return arcs[chosen[::-1]]

    def derivatives(self, pose: Pose) -> tuple[Array, Array]:
        """Gradient of S / 2 and its Gauss-Newton matrix; sliding points count normal to their segment only."""
        J, (_, directions, _) = self.data.J, self.skeleton()
        columns = J[None, :3] - skew(pose.places) @ J[3:]  # v + omega x place, shape (m, 3, n)
        columns = columns * self.moves[pose.segment][:, None, :]
        gradient = np.einsum("i,ic,icj->j", self.weights, pose.residual, columns)
        u = directions[pose.segment] * pose.sliding[:, None]
        columns = columns - u[:, :, None] * np.einsum("ic,icj->ij", u, columns)[:, None, :]
        return gradient, np.einsum("i,icj,ick->jk", self.weights, columns, columns)

    def solve(self, points: Array, previous: Array) -> tuple[Pose, int]:
        """Solve one frame from the pose before; returns the pose and the evaluations spent."""
        pose, steps, damping = self.pose(previous, points), 1, 1e-9
        gradient, H = self.derivatives(pose)
        while steps < self.max_steps:
            mu = damping * (np.trace(H) / self.n + 1e-12)
            move = self.bounded_step(H + mu * np.eye(self.n), gradient, pose.q, previous)
            predicted = -float(gradient @ move + 0.5 * move @ H @ move)
            gain = pose.g - np.sqrt(max(2.0 * (pose.value - predicted), 0.0)) / self.m
            if not gain > max(self.tolerance * pose.g, self.floor):
                break
            trial = self.pose(np.clip(pose.q + move, self.lower, self.upper), points)
            steps += 1
            if not trial.value < pose.value:
                damping = max(10.0 * damping, 1e-3)
                continue
            ratio = (pose.value - trial.value) / predicted
            damping = max(0.1 * damping, 1e-9) if ratio > 0.5 else max(4.0 * damping, 1e-4) if ratio < 0.1 else damping
            pose = trial
            gradient, H = self.derivatives(pose)
        return pose, steps

    def bounded_step(self, H: Array, gradient: Array, q: Array, centre: Array) -> Array:
        """Minimise the model inside limits and ball; a joint that would leave its limits is held there."""
        move, p = np.zeros(self.n), q - centre
        held = (q <= self.lower) & (gradient > 0.0) | (q >= self.upper) & (gradient < 0.0)
        while not held.all():
            free = ~held
            pull = gradient[free] + H[np.ix_(free, held)] @ move[held]
            left = np.sqrt(max(self.radius**2 - ((p + move)[held] ** 2).sum(), 0.0))
            move[free] = step_in_ball(H[np.ix_(free, free)], pull, p[free], left)
            outside = free & ((q + move < self.lower) | (q + move > self.upper))
            if not outside.any():
                break
            move[outside] = (np.clip(q + move, self.lower, self.upper) - q)[outside]
            held |= outside
        return move

    def area(self, pose: Pose, points: Array) -> float:
        """E_t of a pose (method section 5)."""
        pin.forwardKinematics(self.model, self.data, pose.q)
        starts, directions, _ = self.skeleton()
        total, begin, joints = 0.0, 0.0, np.vstack([np.zeros(3), points])
        for first, last, end in zip(joints[:-1], joints[1:], pose.arcs, strict=True):
            pieces = int(np.ceil((end - begin) / self.delta - 1e-9))
            if pieces > 0:
                arcs = begin + (np.arange(pieces) + 0.5) * (end - begin) / pieces
                segment = np.clip(np.searchsorted(self.arc, arcs, "right") - 1, 0, len(self.extent) - 1)
                middle = starts[segment] + (arcs - self.arc[segment])[:, None] * directions[segment]
                axis = last - first
                share = np.clip((middle - first) @ axis / max(axis @ axis, 1e-300), 0.0, 1.0)
                total += np.linalg.norm(middle - first - share[:, None] * axis, axis=1).mean() * (end - begin)
            begin = end
        return total / self.arc[-1]


def step_in_ball(H: Array, gradient: Array, p: Array, radius: float) -> Array:
    """Minimise the model over x with |p + x| <= radius, by the ball's multiplier."""
    x = np.linalg.solve(H, -gradient)
    if np.linalg.norm(p + x) <= radius:
        return x
    values, V = np.linalg.eigh(H)
    slope, offset = V.T @ gradient, V.T @ p
    low, high = 0.0, 1e3 * (np.linalg.norm(slope) + values[-1]) / max(radius, 1e-12)
    for _ in range(60):
        nu = 0.5 * (low + high)
        inside = np.linalg.norm(offset - (slope + nu * offset) / (values + nu)) <= radius
        low, high = (low, nu) if inside else (nu, high)
    return -V @ ((slope + high * offset) / (values + high))


def skew(v: Array) -> Array:
    """Cross product matrices of vectors, shape (m, 3) -> (m, 3, 3)."""
    S = np.zeros((len(v), 3, 3))
    S[:, 0, 1], S[:, 0, 2], S[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    S[:, 1, 0], S[:, 2, 0], S[:, 2, 1] = v[:, 2], -v[:, 1], v[:, 0]
    return S
