"""How near the parts of an arm come to one another and to obstacles on its motion: brackets and flanges included."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any, NamedTuple

import coal
import numpy as np

from armdesign._types import Array
from armdesign.bodies.cylinder import along
from armdesign.bodies.exact import carriers
from armdesign.building.parts import Assembly, Placed, Prism, Rod
from armdesign.feasibility.verdict import exact_obstacles
from armdesign.feasibility.violations import figure
from armdesign.feasibility.words import sentence
from armdesign.kinematics.dh import DHTable
from armdesign.search.result import Result

FRAMES = 200
"""About so many frames of each demonstration are looked at."""
NEAR = 0.02
"""Gaps larger than this are not measured [m]."""
APART = 1e-3
"""What parts keep between them, since they are made to some tenths and the motion goes on between frames [m]."""
ROUNDING = 1e-7
"""What a distance by coal may be off [m]."""
FACE = "mounting face"
"""What an arm without a modelled place stands on, z = 0 of its base."""


class PartsGap(NamedTuple):
    """Where a part comes nearest to another, or to an obstacle.

    Attributes:
        value: How near [m]; 0 where they overlap.
        parts: The part's mark, and the other's mark or the obstacle's name; ``FACE`` for that of the base.
        q: The arm's pose there, shape (n,) [rad].
        joint: Number of the joint between both; None where they are not on links that follow each other.
    """

    value: float
    parts: tuple[str, str]
    q: Array
    joint: int | None = None

    @property
    def met(self) -> bool:
        """Whether they come nearer than ``APART``, by more than rounding: brackets are often just so far apart."""
        return self.value < APART - ROUNDING

    @property
    def words(self) -> str:
        """Which parts, how near, and at which joint, in a clause."""
        first, second = self.parts
        joint = "" if self.joint is None else f", at joint {self.joint}"
        if self.value == 0.0:
            return f"on the motion {first} meets {second}{joint}"
        near = figure(1e3 * self.value, 1e3 * APART if self.met else None)
        return f"on the motion {first} comes within {near} mm of {second}{joint}"

    @property
    def required(self) -> float:
        """What they have to keep [m]."""
        return APART

    @property
    def rule(self) -> str:
        """What they have to keep, in a clause."""
        return f"parts of a build have to keep {APART * 1e3:g} mm apart"

    @property
    def ruling(self) -> str:
        """How near they come and what they have to keep, in a sentence."""
        return f"{sentence(self.words)}; {self.rule}."


class Piece(NamedTuple):
    """A convex piece of a part.

    Attributes:
        part: The part.
        form: It for coal.
        pose: Its frame in the link's, shape (4, 4).
        radius: Of the sphere about its frame's origin that it is in [m].
        corners: Points whose hull, a disc about z at each where it is round, it is, shape (K, 3) [m].
        disc: Radius of those discs; 0 where it has corners [m].
    """

    part: Placed
    form: Any
    pose: Array
    radius: float
    corners: Array
    disc: float


def pieces_of(placed: Placed) -> list[Piece]:
    """The convex pieces of a part, its holes filled."""
    found = []
    for solid in placed.part.solids:
        if isinstance(solid, Rod):
            length = float(np.linalg.norm(solid.end - solid.start))
            form, pose, radius = coal.Cylinder(solid.radius, length), along(solid.start, solid.end), solid.radius
            found.append(Piece(placed, form, placed.pose @ pose, float(np.hypot(radius, length / 2.0)),
                               np.array([[0.0, 0.0, -length / 2.0], [0.0, 0.0, length / 2.0]]), radius))  # fmt: skip
        elif isinstance(solid, Prism):
            middle = np.array([*solid.polygon.mean(axis=0), 0.0])
            points = solid.ends.reshape(-1, 3) - middle
            pose = np.eye(4)
            pose[:3, 3] = middle
            corners = coal.StdVec_Vec3s()
            corners.extend(list(points))
            hull = coal.Convex.convexHull(corners, False, "")
            found.append(
                Piece(placed, hull, placed.pose @ pose, float(np.linalg.norm(points, axis=1).max()), points, 0.0)
            )
    return found


def parts_gap(assembly: Assembly, result: Result) -> PartsGap | None:
    """The nearest that parts of different links come to each other and to obstacles; None where none within ``NEAR``.

    An actuator and the bracket on its output touch, and stay as they are; they are left out, and so is what does not
    move against the obstacle that it stands on. Where no obstacle is what the base stands on, the mounting face z = 0
    of a placed arm is. Ends with the first two that overlap.

    Args:
        assembly: The parts.
        result: The arm and its motion.
    """
    pieces = [piece for each in assembly.placed for piece in pieces_of(each)]
    pairs = [(i, j) for (i, a), (j, b) in combinations(enumerate(pieces), 2) if counted(a.part, b.part)]
    first, second = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
    reach = np.array([piece.radius for piece in pieces])
    into_base = np.linalg.inv(result.base_pose.matrix)
    best: PartsGap | None = None
    for shown, scored in zip(result.problem.demonstrations, result.evaluation.demonstrations, strict=True):
        around = exact_obstacles(shown.obstacles)
        above = [i for i, piece in enumerate(pieces) if piece.part.mark != "B"]
        stands_on = carriers(around, result.base_pose.matrix)
        above = above if result.placed and not any(stands_on) else []
        for t in range(0, len(scored.path.q), max(1, len(scored.path.q) // FRAMES)):
            q = scored.path.q[t]
            world = placed_at(result.table, pieces, q)
            found = [
                PartsGap(max(0.0, lowest(pieces[i], world[i])), (pieces[i].part.mark, FACE), q) for i in above
            ]  # fmt: skip
            least = np.linalg.norm(world[first, :3, 3] - world[second, :3, 3], axis=1) - reach[first] - reach[second]
            limit = NEAR if best is None else best.value
            for k in np.flatnonzero(least < limit):
                i, j = pairs[k]
                gap = distance(pieces[i].form, world[i], pieces[j].form, world[j])
                links = sorted((pieces[i].part.link, pieces[j].part.link))
                joint = links[1] if links[1] - links[0] == 1 else None
                found.append(PartsGap(gap, (pieces[i].part.mark, pieces[j].part.mark), q, joint))
            for carries, each in zip(stands_on, around, strict=True):
                there = into_base @ each.pose_at(t)
                found += [PartsGap(gap, (pieces[i].part.mark, each.name), q)
                          for i, gap in near_to(each.geometry, there, pieces, world, limit)
                          if pieces[i].part.link or not carries]  # fmt: skip
            best = min((gap for gap in (best, *found) if gap is not None and gap.value < NEAR),
                       key=lambda gap: gap.value, default=None)  # fmt: skip
            if best is not None and best.value == 0.0:
                return best
    return best


def near_to(
    form: Any, pose: Array, pieces: Sequence[Piece], world: Array, limit: float,  # noqa: ANN401
) -> list[tuple[int, float]]:  # fmt: skip
    """The pieces that come within a limit of the box about a form, and how near they come to it itself [m].

    Args:
        form: An obstacle, or what else is convex, for coal.
        pose: Where it is in the base's frame, shape (4, 4).
        pieces: The pieces, K of them.
        world: Where they are in the base's frame, shape (K, 4, 4).
        limit: What is farther away does not count [m].
    """
    form.computeLocalAABB()
    box = form.aabb_local
    middles = (world[:, :3, 3] - pose[:3, 3]) @ pose[:3, :3]
    away = np.linalg.norm(np.maximum(np.maximum(box.min_ - middles, middles - box.max_), 0.0), axis=1)
    near = np.flatnonzero(away - [piece.radius for piece in pieces] < limit).tolist()
    return [(i, distance(pieces[i].form, world[i], form, pose)) for i in near]


def lowest(piece: Piece, pose: Array) -> float:
    """The least z of a piece at a pose, shape (4, 4) [m]."""
    up = pose[2, :3]
    return float((piece.corners @ up).min() + pose[2, 3] - piece.disc * np.sqrt(max(0.0, 1.0 - up[2] ** 2)))


def counted(first: Placed, second: Placed) -> bool:
    """Whether two parts move against each other, and are not an actuator and what is on its output."""
    if first.link == second.link:
        return False
    ends = {first.mark, second.mark}
    return not any(mark.startswith("J") and f"{mark}-L{int(mark[1:]) - 1}" in ends for mark in ends if "-" not in mark)


def placed_at(table: DHTable, pieces: list[Piece], q: Array) -> Array:
    """Poses of K pieces in the base's frame, where an arm's joints are at q, shape (n,) [rad]; shape (K, 4, 4)."""
    frames = np.concatenate([np.eye(4)[None], table.frames(q)])
    return np.stack([frames[piece.part.link] @ piece.pose for piece in pieces])


def distance(first: Any, pose: Array, second: Any, other: Array) -> float:  # noqa: ANN401
    """Distance of two convex forms at their poses; 0 where they overlap [m]."""
    ways = [coal.Transform3s(each[:3, :3], each[:3, 3]) for each in (pose, other)]
    return max(
        0.0, float(coal.distance(first, ways[0], second, ways[1], coal.DistanceRequest(), coal.DistanceResult()))
    )
