"""Clearance of an arm's exact bodies over a whole motion, between the frames too, by coal.

With c_0, c_1 the signed distances of two bodies at both ends of an interval and mu a bound on how far any of their
points can move against each other in between, no distance in the interval is below (c_0 + c_1 - mu) / 2: a signed
distance changes by no more than the bodies move. Intervals whose bound may still be the least are halved, the worst
first, until the least distance of the motion is known to ``TOLERANCE``.
"""

from __future__ import annotations

import heapq
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.bodies.arm_body import SIDES, ArmBody, arm_body
from armdesign.bodies.swept import displacements, joint_radii, segment_distance
from armdesign.errors import DesignError
from armdesign.kinematics.models import arm_model

TOLERANCE = 5e-5
"""How far a reported clearance may be below the least distance of the motion [m]."""
SAMPLES = 30
"""Frames of a motion at which pairs have one distance that are said always to have it."""
ON_THE_SURFACE = 2e-3
"""A base so near to an obstacle's surface stands on it [m]."""
ACCURACY, ITERATIONS = 1e-10, 1000
"""Of coal's GJK: distances are right to 1e-9 m. Its EPA, which finds depths, keeps 1e-6 m: asked for more it errs."""


class ExactObstacle(NamedTuple):
    """An obstacle for the exact check.

    Attributes:
        name: Its name.
        geometry: Its shape, one of coal's: Box, Sphere, Cylinder, Halfspace, Convex, or a BVHModel for a closed mesh.
        poses: Where it is in the room, shape (4, 4), or at every frame of the motion, shape (T, 4, 4).
    """

    name: str
    geometry: Any
    poses: Array

    def pose_at(self, t: int) -> Array:
        """Where it is in the room in a frame of the motion, shape (4, 4).

        Args:
            t: Number of the frame.
        """
        return self.poses if self.poses.ndim == 2 else self.poses[t]


def carries_base(obstacle: ExactObstacle, pose: Array) -> bool:
    """Whether the base stands on an obstacle: is near its surface, and farther away above it.

    So it does not stand on the lower face of what stands on the same floor.

    Args:
        obstacle: The obstacle.
        pose: Where it is in base_link's frame, shape (4, 4).
    """
    room, point = coal.Transform3s(pose[:3, :3], pose[:3, 3]), coal.Sphere(1e-9)
    away, above = (
        coal.distance(
            point, coal.Transform3s(np.eye(3), np.array([0.0, 0.0, height])), obstacle.geometry, room,
            coal.DistanceRequest(), coal.DistanceResult(),
        )
        for height in (0.0, 2.0 * ON_THE_SURFACE)
    )  # fmt: skip
    return bool(abs(away) <= ON_THE_SURFACE and above > 0.0)


def carriers(obstacles: Sequence[ExactObstacle], base: Array, frame: int = 0) -> list[bool]:
    """Which of some obstacles a base stands on.

    Args:
        obstacles: The obstacles.
        base: Pose of the base in their room, shape (4, 4).
        frame: Frame in which they are looked at.
    """
    into_base = np.linalg.inv(base)
    return [carries_base(one, into_base @ one.pose_at(frame)) for one in obstacles]


@dataclass(frozen=True, eq=False)
class Clearance:
    """The clearance of some bodies over a motion.

    Attributes:
        value: The least over the whole motion, between frames too; a lower bound, at most ``TOLERANCE`` below it [m].
            Negative where bodies are inside one another: how deep.
        frame: The frame next to where it is.
        bodies: What comes so near to what.
        each: The least at every frame, shape (T,) [m].
    """

    value: float
    frame: int
    bodies: tuple[str, str]
    each: Array


class ExactScene:
    """The solids of an arm among obstacles.

    A base that stands on an obstacle's surface, within ``ON_THE_SURFACE``, may touch it: link 0 does not count against
    it. Inside a mesh, coal knows how deep only near its surface; a body that starts inside one counts as that far in as
    its surface is away.
    """

    def __init__(
        self,
        arm: ArmBody,
        obstacles: Sequence[ExactObstacle] = (),
        base: ArrayLike | None = None,
        skip: Collection[tuple[int, int]] = (),
    ) -> None:
        """Build the scene.

        Args:
            arm: The arm and its solids.
            obstacles: What stands around it.
            base: Pose of base_link in the room of the obstacles, shape (4, 4); the identity by default.
            skip: Pairs that do not count, as ``constant_pairs`` gives them.
        """
        self._arm, self._obstacles = arm, tuple(obstacles)
        self._into_base = np.linalg.inv(np.eye(4) if base is None else np.asarray(base, dtype=float))
        self._model, self._shapes = arm_model(arm.table), pin.GeometryModel()
        self._turning = np.array([joint.shortname() != "JointModelPZ" for joint in list(self._model.joints)[1:]])
        for k, part in enumerate(arm.shapes):
            shape = coal.Cylinder(part.solid.radius, part.solid.length)
            self._shapes.addGeometryObject(
                pin.GeometryObject(f"{k} {part.name}", part.link, pin.SE3(part.solid.pose), shape)
            )
        for k, obstacle in enumerate(self._obstacles, start=len(arm.shapes)):
            obstacle.geometry.computeLocalAABB()
            placement = pin.SE3(self._in_base(obstacle, 0))
            self._shapes.addGeometryObject(pin.GeometryObject(f"{k} {obstacle.name}", 0, placement, obstacle.geometry))
        against = [
            (i, len(arm.shapes) + k)
            for k, obstacle in enumerate(self._obstacles)
            for i, part in enumerate(arm.parts)
            if part.link > 0 or not carries_base(obstacle, self._in_base(obstacle, 0))
        ]
        against = [pair for pair in against if pair not in skip]
        kept = [tuple(pair) not in skip for pair in arm.pairs.tolist()]
        self._self_pairs = arm.pairs[np.array(kept, dtype=bool)]
        self._obstacle_pairs = np.array(against, dtype=np.int64).reshape(-1, 2)
        for i, j in [*self._self_pairs.tolist(), *self._obstacle_pairs.tolist()]:
            self._shapes.addCollisionPair(pin.CollisionPair(i, j))
        self._data, self._room = self._model.createData(), pin.GeometryData(self._shapes)
        for request in self._room.distanceRequests:
            request.gjk_tolerance, request.gjk_max_iterations = ACCURACY, ITERATIONS

    def self_clearance(self, q: ArrayLike) -> Clearance | None:
        """Clearance of the arm's bodies from one another, of the pairs that count (``armdesign.bodies.arm_body``).

        Args:
            q: Joint angles along the motion, shape (T, n) [rad; m of prismatic joints].

        Returns:
            None where no pair counts, as with a single joint.
        """
        motion = self._motion(q)
        first, second = self._self_pairs.T
        moved = np.min(motion.moved[first] + motion.moved[second], axis=1, initial=np.inf)
        ends, thickness = motion.ends, motion.thickness
        bound = segment_distance(ends[first], ends[second]) - (thickness[first] + thickness[second])[:, None]
        return self._least(motion, 0, bound, moved) if len(self._self_pairs) else None

    def obstacle_clearance(self, q: ArrayLike | _Motion) -> Clearance | None:
        """Clearance of the arm's bodies from the obstacles.

        Args:
            q: Joint angles along the motion, shape (T, n) [rad; m of prismatic joints], or a motion of the same arm.

        Returns:
            None where there is no obstacle, or nothing of the arm that may not touch it.

        Raises:
            DesignError: A moving obstacle has another number of poses than the motion has frames.
        """
        if not len(self._obstacle_pairs):
            return None
        motion = q if isinstance(q, _Motion) else self._motion(q)
        first, second = self._obstacle_pairs.T
        frames = len(motion.q)
        own = np.stack([self._obstacle_steps(obstacle, frames) for obstacle in self._obstacles])
        moved = motion.moved[first, 0] + own[second - len(self._arm.shapes)]
        bound = np.full((len(first), frames), -np.inf)
        return self._least(motion, len(self._self_pairs), bound, moved)

    def constant_pairs(self, q: ArrayLike) -> dict[tuple[int, int], tuple[str, str]]:
        """Pairs whose distance is the same on the whole motion, with their names.

        So are a module and what belongs to the link before it, and what turns about an axis square to a table and that
        table.

        Args:
            q: Joint angles along the motion, shape (T, n) [rad; m of prismatic joints].
        """
        motion, found = self._motion(q), {}
        pairs = [*self._self_pairs.tolist(), *self._obstacle_pairs.tolist()]
        frames = np.unique(np.linspace(0, len(motion.q) - 1, SAMPLES).astype(int))
        apart = np.zeros((len(frames), len(pairs)))
        for row, t in zip(apart, frames.tolist(), strict=True):
            self._place(motion, t, 0.0)
            row[:] = [pin.computeDistance(self._shapes, self._room, k).min_distance for k in range(len(pairs))]
        for k in np.flatnonzero(np.ptp(apart, axis=0) < TOLERANCE).tolist():
            found[tuple(pairs[k])] = self._names(k)
        return found

    def _motion(self, q: ArrayLike) -> _Motion:
        """A motion, with where the ends of all shapes are and how far they can move against every link."""
        angles = np.asarray(q, dtype=float)
        table, shapes = self._arm.table, self._arm.shapes
        if angles.ndim != 2 or angles.shape[1] != table.dof or not len(angles):
            raise DesignError(f"a motion of shape {angles.shape}", allowed=f"(T, {table.dof})")
        poses = np.tile(np.eye(4), (len(angles), table.dof + 1, 1, 1))
        for t, pose in enumerate(angles):
            pin.forwardKinematics(self._model, self._data, pose)
            for k in range(1, table.dof + 1):
                poses[t, k] = self._data.oMi[k].homogeneous
        links = np.array([part.link for part in shapes])
        thickness = np.array([part.solid.radius for part in shapes])
        own = np.stack([part.solid.ends for part in shapes])
        placed = poses[:, links]
        ends = np.einsum("tsij,sej->stei", placed[..., :3, :3], own) + placed[..., :3, 3].swapaxes(0, 1)[:, :, None]
        steps = np.abs(np.diff(angles, axis=0))
        radii = joint_radii(poses, own, links, steps, self._turning)
        return _Motion(angles, ends, thickness, displacements(radii, thickness, links, steps, self._turning))

    def _least(self, motion: _Motion, offset: int, bound: Array, moved: Array) -> Clearance:
        """The least distance of some pairs.

        Args:
            motion: The motion, T frames.
            offset: Number of the first of these pairs in the scene.
            bound: What the distance of each is at least at every frame, shape (K, T) [m]; overwritten.
            moved: How far each pair can move against each other between two frames, shape (K, T - 1) [m].
        """
        signs = self._signs(motion, offset, len(bound))
        pairs = _Pairs(offset, signs, bound, np.zeros(bound.shape, dtype=bool), moved)
        each, nearest = self._at_frames(motion, pairs)
        frame = int(np.argmin(each))
        at_frame = _Spot(float(each[frame]), frame, int(nearest[frame]))
        value, spot = self._between_frames(motion, pairs, at_frame)
        return Clearance(value, spot.frame, self._names(offset + spot.pair), each)

    def _at_frames(self, motion: _Motion, pairs: _Pairs) -> tuple[Array, NDArray[np.int64]]:
        """The least distance at every frame and the pair that has it, shape (T,) each; the bounds get better by it."""
        bound, known, moved = pairs.bound, pairs.known, pairs.moved
        frames = bound.shape[1]
        each, nearest = np.full(frames, np.inf), np.zeros(frames, dtype=np.int64)
        for t in range(frames):
            if t:  # what was far away a frame ago is still nearly as far
                np.maximum(bound[:, t], bound[:, t - 1] - moved[:, t - 1], out=bound[:, t])
            self._place(motion, t, 0.0)
            for k in np.argsort(bound[:, t]).tolist():
                if bound[k, t] >= each[t]:
                    break
                bound[k, t], known[k, t] = self._distance(pairs, k), True
                if bound[k, t] < each[t]:
                    each[t], nearest[t] = bound[k, t], k
        for t in range(frames - 2, -1, -1):
            np.maximum(bound[:, t], bound[:, t + 1] - moved[:, t], out=bound[:, t], where=~known[:, t])
        return each, nearest

    def _between_frames(self, motion: _Motion, pairs: _Pairs, least: _Spot) -> tuple[float, _Spot]:
        """What the distance is at least over the whole motion [m], and where the least was found.

        Args:
            motion: The motion.
            pairs: The pairs with their bounds at the frames.
            least: Where the least distance at a frame is.
        """
        bound, known, moved = pairs.bound, pairs.known, pairs.moved
        between = (bound[:, :-1] + bound[:, 1:] - moved) / 2.0
        suspects = between < least.value - TOLERANCE
        rest = float(np.min(between, where=~suspects, initial=np.inf))
        queue = [_Interval(float(between[k, t]), k, t, 0.0, 1.0, 0.0, 0.0) for k, t in np.argwhere(suspects).tolist()]
        heapq.heapify(queue)
        while queue and queue[0].bound < least.value - TOLERANCE:
            _, k, t, start, end, low, high = heapq.heappop(queue)
            middle = (start + end) / 2.0
            values = {start: low, end: high}
            for share in (start, middle, end):
                at, at_frame = t + int(share), share in (0.0, 1.0)
                if share == middle or (at_frame and not known[k, at]):
                    self._place(motion, at, share - int(share))
                    values[share] = self._distance(pairs, k)
                    if values[share] < least.value:
                        least = _Spot(values[share], t + round(share), k)
                    if at_frame:
                        bound[k, at], known[k, at] = values[share], True
                if at_frame:
                    values[share] = float(bound[k, at])
            mu = float(moved[k, t]) * (end - start) / 2.0
            for one, other in ((start, middle), (middle, end)):
                lowest = (values[one] + values[other] - mu) / 2.0
                heapq.heappush(queue, _Interval(lowest, k, t, one, other, values[one], values[other]))
        return min(least.value, rest, queue[0].bound if queue else np.inf), least

    def _distance(self, pairs: _Pairs, k: int) -> float:
        """Signed distance of one of the pairs where everything was placed last [m]."""
        found = pin.computeDistance(self._shapes, self._room, pairs.offset + k)
        return float(pairs.signs[k] * found.min_distance)

    def _place(self, motion: _Motion, t: int, share: float) -> None:
        """Put everything where it is at a share of the way from frame t to the next."""
        q = motion.q[t] if share == 0.0 else motion.q[t] + share * (motion.q[t + 1] - motion.q[t])
        for k, obstacle in enumerate(self._obstacles, start=len(self._arm.shapes)):
            if obstacle.poses.ndim == 3:
                pose = pin.SE3(self._in_base(obstacle, t))
                if share > 0.0:
                    pose = pin.SE3.Interpolate(pose, pin.SE3(self._in_base(obstacle, t + 1)), share)
                self._shapes.geometryObjects[k].placement = pose
        pin.updateGeometryPlacements(self._model, self._data, self._shapes, self._room, q)

    def _names(self, pair: int) -> tuple[str, str]:
        """What a pair is called."""
        two = self._shapes.collisionPairs[pair]
        first, second = (self._shapes.geometryObjects[k].name.split(" ", 1)[1] for k in (two.first, two.second))
        return first, second

    def _in_base(self, obstacle: ExactObstacle, t: int) -> Array:
        """Pose of an obstacle at a frame in the base frame, shape (4, 4)."""
        pose: Array = self._into_base @ obstacle.pose_at(t)
        return pose

    def _obstacle_steps(self, obstacle: ExactObstacle, frames: int) -> Array:
        """How far any point of an obstacle moves from frame to frame at most, shape (T - 1,) [m]."""
        if obstacle.poses.ndim == 2:
            return np.zeros(frames - 1)
        if len(obstacle.poses) != frames:
            raise DesignError(
                f"the moving obstacle '{obstacle.name}' has {len(obstacle.poses)} poses",
                allowed=f"{frames}, one a frame",
            )
        centre, radius = obstacle.geometry.aabb_center, obstacle.geometry.aabb_radius
        poses = [pin.SE3(pose) for pose in obstacle.poses]
        twists = np.array([pin.log6(one.actInv(other)).vector for one, other in pairwise(poses)])
        linear = twists[:, :3] + np.cross(twists[:, 3:], centre)
        steps: Array = np.linalg.norm(linear, axis=1) + np.linalg.norm(twists[:, 3:], axis=1) * radius
        return steps

    def _signs(self, motion: _Motion, offset: int, count: int) -> Array:
        """-1 for pairs of which one is inside a mesh in the first frame, else 1, shape (count,)."""
        signs = np.ones(count)
        for k in range(count):
            two = self._shapes.collisionPairs[offset + k]
            mesh = two.second - len(self._arm.shapes)
            if mesh >= 0 and isinstance(self._obstacles[mesh].geometry, coal.BVHModelBase):
                pose = np.linalg.inv(self._in_base(self._obstacles[mesh], 0))
                point = pose[:3, :3] @ motion.ends[two.first, 0].mean(axis=0) + pose[:3, 3]
                signs[k] = -1.0 if inside_mesh(self._obstacles[mesh].geometry, point) else 1.0
        return signs


class _Motion(NamedTuple):
    """A motion: angles (T, n), ends of the shapes (S, T, 2, 3), their radii (S,), displacements (S, n + 1, T - 1)."""

    q: Array
    ends: Array
    thickness: Array
    moved: Array


class _Pairs(NamedTuple):
    """K pairs: number of the first in the scene, signs (K,), least distances at frames (K, T), exact or not, moves."""

    offset: int
    signs: Array
    bound: Array
    known: NDArray[np.bool_]
    moved: Array


class _Spot(NamedTuple):
    """Where a distance was found: how much [m], the frame next to it, the pair."""

    value: float
    frame: int
    pair: int


class _Interval(NamedTuple):
    """A part of the way from a frame to the next: least distance, pair, frame, shares of the way, distances there."""

    bound: float
    pair: int
    frame: int
    start: float
    end: float
    low: float
    high: float


def free_side(arm: ArmBody, q: ArrayLike) -> str:
    """The side of the base that an arm has its plate on which is not placed.

    It is below, or where that is in the way of the motion, the side that leaves most room.

    Args:
        arm: The arm; whether it has a plate does not matter.
        q: Joint angles along the motion, shape (T, n) [rad; m of prismatic joints].

    Returns:
        One of ``SIDES``.
    """
    table, options = arm.table, arm.options
    room, bare = {}, arm_body(table, options, arm.slides, arm.limits, side=None)
    motion = ExactScene(bare)._motion(q)
    for side in SIDES:
        base = arm_body(table, options, arm.slides, arm.limits, side=side).parts[0].solid
        plate = ExactObstacle("base plate", coal.Cylinder(base.radius, base.length), base.pose)
        found = ExactScene(bare, [plate]).obstacle_clearance(motion)
        room[side] = np.inf if found is None else found.value
        if room[side] >= options.clearance and side == SIDES[0]:
            return side
    return max(room, key=lambda side: room[side])


def inside_mesh(mesh: Any, point: Array) -> bool:  # noqa: ANN401 (a coal.BVHModelBase)
    """Whether a point is inside a closed mesh: the solid angles of its triangles add up to 4 pi, outside to 0.

    Args:
        mesh: A ``coal.BVHModel``.
        point: In the mesh's frame, shape (3,) [m].
    """
    corners = np.asarray(mesh.vertices())
    faces = np.array([[mesh.tri_indices(i)[k] for k in range(3)] for i in range(mesh.num_tris)])
    a, b, c = (corners[faces[:, k]] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(x, axis=1) for x in (a, b, c))
    volume = np.sum(a * np.cross(b, c), axis=1)
    base = la * lb * lc + np.sum(a * b, axis=1) * lc + np.sum(b * c, axis=1) * la + np.sum(c * a, axis=1) * lb
    return bool(abs(np.arctan2(volume, base).sum()) > np.pi)
