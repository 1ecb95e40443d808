"""What stands in the room, drawn around an arm: obstacles, also those that move, and where the base might stand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import meshcat.geometry as mg
import numpy as np

from armdesign._types import Array
from armdesign.cell.obstacles import Box, Cylinder, Mesh, Obstacle, Plane, Sphere
from armdesign.settings.place import Site
from armdesign.views.preview.keyframes import Indices
from armdesign.views.preview.recorder import Track, pose_tracks
from armdesign.views.preview.shapes import material

OBSTACLE, REGION = "#8a7f72", "#aa3377"
OPACITY, REGION_OPACITY, SLAB_OPACITY = 0.8, 0.35, 0.5
GROUND = "#d9dce0"
SLAB, BESIDE, LEVEL = 0.02, 0.1, 0.5
"""Thickness of floors and walls, how far they reach beyond what is shown [m]; what looks down more is a ceiling."""
THINNEST = 2e-3
"""Height that a flat region is drawn with [m]."""
MOST_TRIANGLES = 20_000
"""Larger meshes are drawn as the box about them, so that the page stays small; the note says which."""
UPRIGHT = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""Turns MeshCat's cylinders, which run along y, so that they run along z, shape (4, 4)."""


def draw_obstacles(
    node: Any,  # noqa: ANN401 (a meshcat.Visualizer)
    obstacles: Sequence[Obstacle],
    chosen: Indices,
    bounds: Array,
) -> list[Track]:
    """Draw what stands in the room.

    Args:
        node: A ``meshcat.Visualizer`` whose frame is the room.
        obstacles: What there is; of half spaces that look up or aside a slab is drawn, a ceiling is left out.
        chosen: The keyframes.
        bounds: Lowest and highest corner of what is shown, shape (2, 3) [m].

    Returns:
        How what moves does so over the keyframes.
    """
    tracks: list[Track] = []
    for k, one in enumerate(obstacles):
        place = node[f"obstacle_{k + 1}"]
        if isinstance(one.shape, Plane):
            if len(one.poses) == 1 and one.poses[0, 2, 2] > -LEVEL:
                draw_slab(place, one.poses[0], bounds)
            continue
        shape, own = drawn(one)
        place.set_object(shape, material(OBSTACLE, OPACITY))
        poses = one.poses @ own
        place.set_transform(poses[0])
        if len(poses) > 1:
            tracks += pose_tracks(place.path.lower(), poses[chosen])
    return tracks


def draw_slab(node: Any, pose: Array, bounds: Array) -> None:  # noqa: ANN401 (a meshcat.Visualizer)
    """Draw the surface of a half space as a slab behind it, as far as what is shown reaches.

    Args:
        node: Where.
        pose: Its frame, z its normal, shape (4, 4).
        bounds: Lowest and highest corner, shape (2, 3) [m].
    """
    corners = np.stack(np.meshgrid(*bounds.T, indexing="ij"), axis=-1).reshape(-1, 3)
    own = (corners - pose[:3, 3]) @ pose[:3, :3]
    low, high = own[:, :2].min(axis=0) - BESIDE, own[:, :2].max(axis=0) + BESIDE
    middle = np.eye(4)
    middle[:3, 3] = [*((low + high) / 2.0), -SLAB / 2.0 - THINNEST]
    node.set_object(mg.Box([*(high - low).tolist(), SLAB]), material(GROUND, SLAB_OPACITY))
    node.set_transform(pose @ middle)


def drawn(one: Obstacle) -> tuple[Any, Array]:
    """An obstacle's shape for MeshCat, and the pose of that in the obstacle's frame, shape (4, 4)."""
    match one.shape:
        case Sphere():
            return mg.Sphere(one.shape.radius), np.eye(4)
        case Cylinder():
            return mg.Cylinder(one.shape.length, one.shape.radius), UPRIGHT
        case Mesh() if len(one.shape.faces) <= MOST_TRIANGLES:
            return mg.TriangularMeshGeometry(one.shape.vertices, one.shape.faces), np.eye(4)
        case Box():
            return mg.Box(one.shape.size.tolist()), np.eye(4)
    about = np.eye(4)
    about[:3, 3] = one.shape.middle if isinstance(one.shape, Mesh) else 0.0
    return mg.Box((2.0 * one.shape.extents).tolist()), about


def wall_normals(obstacles: Sequence[Obstacle]) -> Array:
    """Where the free sides of the walls that are drawn are, shape (W, 3)."""
    normals = [one.poses[0, :3, 2] for one in obstacles if isinstance(one.shape, Plane) and len(one.poses) == 1]
    return np.array([normal for normal in normals if abs(normal[2]) < LEVEL]).reshape(-1, 3)


def named_tops(obstacles: Sequence[Obstacle]) -> list[tuple[str, Array]]:
    """Names of what stands still in the room, each with the middle of its top, shape (3,) [m]."""
    still = [one for one in obstacles if len(one.poses) == 1 and len(one.shape.outline)]
    tops = [one.shape.outline @ one.poses[0, :3, :3].T + one.poses[0, :3, 3] for one in still]
    return [
        (one.name, np.array([*(top.min(axis=0) + top.max(axis=0))[:2] / 2.0, top[:, 2].max()]))
        for one, top in zip(still, tops, strict=True)
    ]


def thinned_names(obstacles: Sequence[Obstacle]) -> list[str]:
    """Names of the obstacles that are drawn as the box about them."""
    return [one.name for one in obstacles if isinstance(one.shape, Mesh) and len(one.shape.faces) > MOST_TRIANGLES]


def draw_sites(node: Any, sites: Sequence[Site]) -> None:  # noqa: ANN401 (a meshcat.Visualizer)
    """Draw where the base might stand; points are not drawn, the base is there.

    Args:
        node: A ``meshcat.Visualizer`` whose frame is the room.
        sites: The regions.
    """
    for k, site in enumerate(sites):
        low, high = site.box
        if np.ptp(site.box, axis=0).max() <= THINNEST:
            continue
        pose = np.eye(4)
        pose[:3, 3] = (low + high) / 2.0
        node[f"site_{k + 1}"].set_object(
            mg.Box(np.maximum(high - low, THINNEST).tolist()), material(REGION, REGION_OPACITY)
        )
        node[f"site_{k + 1}"].set_transform(pose)
