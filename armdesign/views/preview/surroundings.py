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

OBSTACLE, REGION = "#8a7f72", "#3b6ea5"
OPACITY, REGION_OPACITY = 0.55, 0.15
THINNEST = 2e-3
"""Height that a flat region is drawn with [m]."""
MOST_TRIANGLES = 20_000
"""Larger meshes are drawn as the box about them, so that the page stays small; the note says which."""
UPRIGHT = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""Turns MeshCat's cylinders, which run along y, so that they run along z, shape (4, 4)."""


def draw_obstacles(node: Any, obstacles: Sequence[Obstacle], chosen: Indices) -> list[Track]:  # noqa: ANN401
    """Draw what stands in the room.

    Args:
        node: A ``meshcat.Visualizer`` whose frame is the room.
        obstacles: What there is; half spaces are left to the floor's grid.
        chosen: The keyframes.

    Returns:
        How what moves does so over the keyframes.
    """
    tracks: list[Track] = []
    for k, one in enumerate(obstacles):
        if isinstance(one.shape, Plane):
            continue
        place = node[f"obstacle_{k + 1}"]
        shape, own = drawn(one)
        place.set_object(shape, material(OBSTACLE, OPACITY))
        poses = one.poses @ own
        place.set_transform(poses[0])
        if len(poses) > 1:
            tracks += pose_tracks(place.path.lower(), poses[chosen])
    return tracks


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
