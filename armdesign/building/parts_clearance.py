"""How near the parts of an arm come to one another on its motion: their own shapes, brackets and flanges included."""

from __future__ import annotations

from itertools import combinations
from typing import Any, NamedTuple

import coal
import numpy as np

from armdesign._types import Array
from armdesign.bodies.cylinder import along
from armdesign.building.build import Build
from armdesign.building.parts import Placed, Prism, Rod
from armdesign.kinematics.dh import DHTable
from armdesign.search.evaluation import motions

FRAMES = 200
"""About so many frames of the motion are looked at."""
NEAR = 0.02
"""Gaps larger than this are not measured [m]."""


class PartsGap(NamedTuple):
    """Where two parts come nearest.

    Attributes:
        value: How near [m]; 0 where they overlap.
        parts: Their marks; ``mounting face`` for that of the base.
        q: The arm's pose there, shape (n,) [rad].
    """

    value: float
    parts: tuple[str, str]
    q: Array


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


def parts_gap(build: Build) -> PartsGap | None:
    """The nearest that parts of different links come on the motion; None where none come within ``NEAR``.

    An actuator and the bracket on its output touch, and stay as they are; they are left out, and so is the base's plate
    against the mounting face, z = 0, of an arm that stands on one.

    Args:
        build: The build.
    """
    if build.assembly is None:
        return None
    pieces = [piece for each in build.assembly.placed for piece in pieces_of(each)]
    pairs = [(i, j) for (i, a), (j, b) in combinations(enumerate(pieces), 2) if counted(a.part, b.part)]
    poses = np.concatenate([q for _, q in motions(build.result.evaluation, build.result.problem)])
    best: PartsGap | None = None
    first, second = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
    reach = np.array([piece.radius for piece in pieces])
    above = [i for i, piece in enumerate(pieces) if build.result.placed and piece.part.mark != "B"]
    for q in poses[:: max(1, len(poses) // FRAMES)]:
        world = placed_at(build.result.table, pieces, q)
        for i in above:
            gap = max(0.0, lowest(pieces[i], world[i]))
            if gap < (NEAR if best is None else best.value):
                best = PartsGap(gap, (pieces[i].part.mark, "mounting face"), q)
        apart = np.linalg.norm(world[first, :3, 3] - world[second, :3, 3], axis=1) - reach[first] - reach[second]
        limit = NEAR if best is None else best.value
        for k in np.flatnonzero(apart < limit):
            i, j = pairs[k]
            gap = distance(pieces[i].form, world[i], pieces[j].form, world[j])
            if gap < (NEAR if best is None else best.value):
                best = PartsGap(gap, (pieces[i].part.mark, pieces[j].part.mark), q)
    return best


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
    """Poses of pieces in the base's frame, shape (K, 4, 4).

    Args:
        table: The arm.
        pieces: The pieces, K of them.
        q: Its pose, shape (n,) [rad].
    """
    frames = np.concatenate([np.eye(4)[None], table.frames(q)])
    return np.stack([frames[piece.part.link] @ piece.pose for piece in pieces])


def distance(first: Any, pose: Array, second: Any, other: Array) -> float:  # noqa: ANN401
    """Distance of two convex forms at their poses; 0 where they overlap [m]."""
    ways = [coal.Transform3s(each[:3, :3], each[:3, 3]) for each in (pose, other)]
    return max(
        0.0, float(coal.distance(first, ways[0], second, ways[1], coal.DistanceRequest(), coal.DistanceResult()))
    )
