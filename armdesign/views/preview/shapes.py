"""The shapes of the preview that are not the arm's own: tubes, rods, balls, frames and the grid on the floor."""

from __future__ import annotations

from typing import Any

import meshcat.geometry as mg
import numpy as np

from armdesign._types import Array
from armdesign.views.preview.colours import AXES, GRID, GRID_BOLD, components, number
from armdesign.views.preview.recorder import Track

SIDES = 6
"""Faces around a tube."""
THINNEST = 1e-6
"""Length that a rod of no length is drawn with [m], so that its scale can be inverted."""


def material(colour: str, opacity: float = 1.0, *, on_top: bool = False) -> Any:  # noqa: ANN401 (a meshcat material)
    """How a shape is painted; ``on_top`` of everything else, or hidden by what is in front of it."""
    if on_top:
        return mg.MeshBasicMaterial(color=number(colour), transparent=True, opacity=opacity, depthTest=False)
    return mg.MeshLambertMaterial(color=number(colour), opacity=opacity)


class OnTop(mg.Mesh):  # type: ignore[misc]
    """A shape that is drawn after all others, so that nothing hides it where its material is ``on_top``."""

    def lower(self) -> dict[str, Any]:
        """What MeshCat sends, with the order that it has no word for."""
        data: dict[str, Any] = super().lower()
        data["object"]["renderOrder"] = 1
        return data


def rod(radius: float) -> Any:  # noqa: ANN401 (a meshcat geometry)
    """A cylinder of length 1 along y about the origin, to be stretched by ``rod_tracks``."""
    return mg.Cylinder(1.0, radius)


def rod_tracks(path: str, start: Array, end: Array) -> list[Track]:
    """What stretches a rod between two points that move.

    Args:
        path: The rod's node.
        start: Shape (K, 3) [m].
        end: Shape (K, 3) [m].
    """
    middle, turn, length = rod_places(start, end)
    stretch = np.stack([np.ones_like(length), length, np.ones_like(length)], axis=1)
    return [
        Track(path, ".position", "vector3", middle),
        Track(path, ".quaternion", "quaternion", turn),
        Track(path, ".scale", "vector3", stretch),
    ]


def rod_places(start: Array, end: Array) -> tuple[Array, Array, Array]:
    """Where rods of length 1 along y have to be to lie between points.

    Args:
        start: Shape (K, 3) [m].
        end: Shape (K, 3) [m].

    Returns:
        Their middles, shape (K, 3) [m], quaternions x, y, z, w, shape (K, 4), and lengths, shape (K,) [m].
    """
    length = np.maximum(np.linalg.norm(end - start, axis=1), THINNEST)
    return (start + end) / 2.0, turns_from_y((end - start) / length[:, None]), length


def turns_from_y(directions: Array) -> Array:
    """The shortest turns that take y to unit vectors, as quaternions x, y, z, w with continuous signs, shape (K, 4).

    q = (y x v, 1 + y.v) normalised; half a turn about x for v = -y, none for a vector of no length.
    """
    x, y, z = directions.T
    turns = np.stack([z, np.zeros_like(x), -x, 1.0 + y], axis=1)
    norm = np.linalg.norm(turns, axis=1)
    turns[norm < THINNEST] = (1.0, 0.0, 0.0, 0.0)
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    flips = np.where(np.sum(turns[1:] * turns[:-1], axis=1) < 0.0, -1.0, 1.0)
    return np.asarray(turns * np.concatenate([[1.0], np.cumprod(flips)])[:, None])


def segment_pose(start: Array, end: Array) -> Array:
    """The pose and stretch of a rod that stands still between two points, shape (4, 4)."""
    along = end - start
    length = max(float(np.linalg.norm(along)), THINNEST)
    y = along / length
    aside = np.cross(y, (1.0, 0.0, 0.0) if abs(y[0]) < 0.9 else (0.0, 1.0, 0.0))
    x = aside / np.linalg.norm(aside)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = x, along, np.cross(x, y), (start + end) / 2.0
    return pose


def trace(path: Array, radius: float) -> Any | None:  # noqa: ANN401 (a meshcat geometry)
    """A thin tube along a path, shape (K, 3) [m]; nothing where the path never moves.

    The ring at a point stands across the path's direction there; each is turned as little as possible from the last.
    """
    moved = np.r_[True, np.linalg.norm(np.diff(path, axis=0), axis=1) > THINNEST]
    points = path[moved]
    if len(points) < 2:
        return None
    along = np.gradient(points, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), THINNEST)
    angles = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
    side = segment_pose(np.zeros(3), along[0])[:3, 0]
    rings = []
    for point, direction in zip(points, along, strict=True):
        across = side - direction * (side @ direction)
        if np.linalg.norm(across) > 1e-3:  # else the path turns back on the spot: the last ring serves
            side = across / np.linalg.norm(across)
        other = np.cross(direction, side)
        rings.append(point + radius * (np.cos(angles)[:, None] * side + np.sin(angles)[:, None] * other))
    return mg.TriangularMeshGeometry(np.concatenate(rings), _sleeve(len(rings)))


def _sleeve(rings: int) -> Array:
    """The triangles between neighbouring rings, shape (2 SIDES (rings - 1), 3)."""
    k = np.arange((rings - 1) * SIDES)
    beside = k - k % SIDES + (k + 1) % SIDES
    lower = np.stack([k, k + SIDES, beside], axis=1)
    upper = np.stack([beside, k + SIDES, beside + SIDES], axis=1)
    return np.concatenate([lower, upper])


def draw_frame(node: Any, length: float, radius: float, *, on_top: bool = False) -> None:  # noqa: ANN401
    """Draw the axes of a frame as rods, x red, y green, z blue.

    Args:
        node: A ``meshcat.Visualizer``; the frame is its own.
        length: Of the axes [m].
        radius: Of the rods [m].
        on_top: Never hidden by what is in front.
    """
    for axis, direction, colour in zip("xyz", np.eye(3), AXES, strict=True):
        kind = OnTop if on_top else mg.Mesh
        node[axis].set_object(kind(rod(radius), material(colour, on_top=on_top)))
        node[axis].set_transform(segment_pose(np.zeros(3), length * direction))


def draw_grid(node: Any, corners: Array, height: float) -> None:  # noqa: ANN401 (a meshcat.Visualizer)
    """Draw lines every 0.1 m on the floor, every fifth darker.

    Args:
        node: Where.
        corners: Lowest and highest x and y that it must reach, shape (2, 2) [m].
        height: z of the floor [m].
    """
    (x0, y0), (x1, y1) = np.floor(corners[0] * 10.0 - 1e-9), np.ceil(corners[1] * 10.0 + 1e-9)
    lines, colours = [], []
    for axis, first, last, low, high in ((0, x0, x1, y0, y1), (1, y0, y1, x0, x1)):
        for k in np.arange(first, last + 1):
            for end in (low, high):
                lines.append((k, end) if axis == 0 else (end, k))
            colours += [components(GRID_BOLD if k % 5 == 0 else GRID)] * 2
    points = np.c_[np.array(lines) / 10.0, np.full(len(lines), height)]
    geometry = mg.PointsGeometry(points.T.astype(np.float32), np.array(colours).T.astype(np.float32))
    node.set_object(mg.LineSegments(geometry, mg.LineBasicMaterial(vertexColors=True)))
