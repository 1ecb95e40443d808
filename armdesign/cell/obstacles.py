"""What stands in the room: solids, half spaces and closed meshes, still or carried by a body of the recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import coal
import numpy as np
import scipy
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.cell.distance_field import DistanceField, mesh_distances, mesh_field, triangle_tree
from armdesign.cell.kernels.distance import (
    BOX,
    CYLINDER,
    MESH,
    PLANE,
    SPHERE,
    WITNESS,
    ObstacleArrays,
    segment_distances,
)
from armdesign.cell.kernels.triangles import TriangleTree
from armdesign.errors import ObstacleError
from armdesign.kinematics.base_pose import BasePose

PLANE_SIZE = 1e6
"""Radius of the sphere about a half space, so that none is ever taken to be far away [m]."""


@dataclass(frozen=True, eq=False)
class Box:
    """A box about the origin of its frame.

    Attributes:
        size: Edges along x, y, z, shape (3,) [m].
    """

    size: Array

    kind = BOX

    @property
    def extents(self) -> Array:
        """Half the edges."""
        return self.size / 2.0

    @property
    def outline(self) -> Array:
        """Its corners, shape (8, 3) [m]."""
        return np.array(list(np.ndindex(2, 2, 2))) * self.size - self.size / 2.0

    def geometry(self) -> Any:  # noqa: ANN401 (a coal shape)
        """It for coal."""
        return coal.Box(*self.size.tolist())


@dataclass(frozen=True)
class Sphere:
    """A sphere about the origin of its frame, of a radius [m]."""

    radius: float

    kind = SPHERE

    @property
    def extents(self) -> Array:
        """Radius, 0, 0."""
        return np.array([self.radius, 0.0, 0.0])

    @property
    def outline(self) -> Array:
        """Points all over it, shape (K, 3) [m]."""
        k = np.arange(200)
        z = 1.0 - (2.0 * k + 1.0) / len(k)
        turn = np.pi * (1.0 + 5.0**0.5) * k  # a Fibonacci sphere
        across = np.sqrt(1.0 - z * z)
        return self.radius * np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1)

    def geometry(self) -> Any:  # noqa: ANN401 (a coal shape)
        """It for coal."""
        return coal.Sphere(self.radius)


@dataclass(frozen=True)
class Cylinder:
    """A cylinder about the z axis of its frame, its centre in the origin; radius and length [m]."""

    radius: float
    length: float

    kind = CYLINDER

    @property
    def extents(self) -> Array:
        """Radius, half the length, 0."""
        return np.array([self.radius, self.length / 2.0, 0.0])

    @property
    def outline(self) -> Array:
        """Points on its rims, shape (K, 3) [m]."""
        turn = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
        rim = self.radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        return np.concatenate([np.c_[rim, np.full(48, side * self.length / 2.0)] for side in (-1.0, 1.0)])

    def geometry(self) -> Any:  # noqa: ANN401 (a coal shape)
        """It for coal."""
        return coal.Cylinder(self.radius, self.length)


@dataclass(frozen=True)
class Plane:
    """The half space z <= 0 of its frame; its normal, z, points to the free side."""

    kind = PLANE

    @property
    def extents(self) -> Array:
        """It has none."""
        return np.zeros(3)

    @property
    def outline(self) -> Array:
        """It has none, shape (0, 3)."""
        return np.zeros((0, 3))

    def geometry(self) -> Any:  # noqa: ANN401 (a coal shape)
        """It for coal."""
        return coal.Halfspace(np.array([0.0, 0.0, 1.0]), 0.0)


@dataclass(frozen=True, eq=False)
class Mesh:
    """A closed mesh.

    Attributes:
        vertices: Its corners in its frame, shape (V, 3) [m].
        faces: The corners of its triangles, counter-clockwise from outside, shape (F, 3).
    """

    vertices: Array
    faces: np.ndarray[Any, np.dtype[np.int64]]

    kind = MESH

    @cached_property
    def tree(self) -> TriangleTree:
        """Its triangles as a tree of boxes."""
        return triangle_tree(self.vertices[self.faces])

    @cached_property
    def field(self) -> DistanceField:
        """Its signed distance at the nodes of a grid; made once."""
        return mesh_field(self.tree)

    @property
    def middle(self) -> Array:
        """Centre of the box about it, shape (3,) [m]."""
        centre: Array = (self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2.0
        return centre

    @property
    def extents(self) -> Array:
        """Half the edges of the box about it."""
        half: Array = np.ptp(self.vertices, axis=0) / 2.0
        return half

    @property
    def outline(self) -> Array:
        """Its corners, shape (V, 3) [m]."""
        return self.vertices

    def geometry(self) -> Any:  # noqa: ANN401 (a coal shape)
        """It for coal."""
        model = coal.BVHModelOBBRSS()
        model.beginModel(len(self.faces), len(self.vertices))
        model.addVertices(self.vertices)
        model.addTriangles(self.faces)
        model.endModel()
        return model


Shape: TypeAlias = Box | Sphere | Cylinder | Plane | Mesh


@dataclass(frozen=True, eq=False)
class Obstacle:
    """Something that stands in the room, or goes through it.

    Attributes:
        name: Its name.
        shape: What it is.
        pose: Pose of its frame in the room, shape (4, 4), or of a moving one at every frame of the demonstration, shape
            (T, 4, 4); until ``Obstacles.carried`` has been called, that of a carried one in its carrier's frame.
        carried_by: Body of the recording that carries it; None where it stands still.
        source: The file it comes from.
    """

    name: str
    shape: Shape
    pose: Array
    carried_by: str | None = None
    source: str = ""

    @property
    def poses(self) -> Array:
        """Its poses, shape (1, 4, 4), or of a moving one (T, 4, 4)."""
        return self.pose if self.pose.ndim == 3 else self.pose[None]

    def distances(self, points: Array) -> Array:
        """Signed distances of points to it, negative inside: exact, of a mesh too.

        Args:
            points: Points in the room, shape (N, 3) [m]; of a moving obstacle one for each frame.

        Returns:
            Shape (N,) [m].
        """
        local = np.einsum("nij,ni->nj", self.poses[:, :3, :3], points - self.poses[:, :3, 3])
        if isinstance(self.shape, Mesh):
            return mesh_distances(self.shape.tree, local)
        arrays = Obstacles((replace(self, pose=np.eye(4)),)).arrays()
        ends = np.ascontiguousarray(np.stack([local, local], axis=1))
        return np.asarray(segment_distances(arrays, 0, BasePose().columns, ends, np.zeros(len(ends), dtype=WITNESS)))


@dataclass(frozen=True, eq=False)
class Obstacles:
    """All that stands in the room.

    Attributes:
        each: The obstacles, of different names.
    """

    each: tuple[Obstacle, ...] = ()

    @property
    def carriers(self) -> tuple[str, ...]:
        """Bodies of the recording that carry obstacles."""
        return tuple(dict.fromkeys(one.carried_by for one in self.each if one.carried_by is not None))

    def carried(self, carriers: Mapping[str, Array]) -> Obstacles:
        """The obstacles with what is carried at its place in every frame.

        Args:
            carriers: Poses of the bodies that carry obstacles in the room, by name, shape (T, 4, 4) each.

        Raises:
            ObstacleError: What carries one is not among them.
        """
        for one in self.each:
            if one.carried_by is not None and one.carried_by not in carriers:
                raise ObstacleError(
                    f"{one.source}: '{one.name}' is carried by '{one.carried_by}', which the recording does not have "
                    "with an orientation", value=one.carried_by, allowed=sorted(carriers) or "none",
                )  # fmt: skip
        moving = (
            replace(one, pose=carriers[one.carried_by] @ one.pose) if one.carried_by else one for one in self.each
        )
        return Obstacles(tuple(moving))

    def thinned(self, frames: NDArray[np.intp]) -> Obstacles:
        """The same obstacles on some of the demonstration's frames, by their numbers."""
        return Obstacles(tuple(replace(one, pose=one.pose[frames]) if one.pose.ndim == 3 else one for one in self.each))

    def moved(self, pose: Array) -> Obstacles:
        """The room turned and moved with everything in it, by a pose of shape (4, 4)."""
        return Obstacles(tuple(replace(one, pose=pose @ one.pose) for one in self.each))

    def arrays(self, origin: Array | None = None) -> ObstacleArrays:
        """The obstacles as the kernels read them, in the frame that has its origin at a point of the room.

        Args:
            origin: The point, shape (3,) [m]; by default the room's origin.
        """
        poses = [one.poses for one in self.each]
        counts = np.array([len(own) for own in poses], dtype=np.int64)
        meshes = [one.shape for one in self.each if isinstance(one.shape, Mesh)]
        extents = np.array([one.shape.extents for one in self.each]).reshape(-1, 3)
        radius = np.linalg.norm(extents, axis=1)
        kinds = np.array([one.shape.kind for one in self.each], dtype=np.int64)
        radius[kinds == PLANE] = PLANE_SIZE
        grids = iter([mesh.field.arrays for mesh in meshes])
        fields = [next(grids) if kind == MESH else None for kind in kinds]
        sizes = np.array([0 if field is None else len(field.values) for field in fields], dtype=np.int64)
        whole = np.concatenate([*poses, np.zeros((0, 4, 4))])
        shifted = whole[:, :3, 3] - (0.0 if origin is None else origin)
        centres = [one.shape.middle if isinstance(one.shape, Mesh) else np.zeros(3) for one in self.each]
        return ObstacleArrays(
            kind=kinds,
            size=extents,
            centre=np.array(centres).reshape(-1, 3),
            radius=radius,
            error=np.array([one.shape.field.bound if isinstance(one.shape, Mesh) else 0.0 for one in self.each]),
            first=np.cumsum(counts) - counts,
            frames=counts,
            poses=np.concatenate([whole[:, :3, :3].transpose(0, 2, 1).reshape(-1, 9), shifted], axis=1),
            turns=np.concatenate([turns_between(own[:, :3, :3]) for own in poses] or [np.zeros((0, 3))]),
            origin=np.array([np.zeros(3) if field is None else field.origin for field in fields]).reshape(-1, 3),
            spacing=np.array([1.0 if field is None else field.spacing for field in fields]),
            shape=np.array([np.zeros(3) if f is None else f.shape for f in fields], dtype=np.int64).reshape(-1, 3),
            offset=np.cumsum(sizes) - sizes,
            values=np.concatenate([field.values for field in fields if field is not None] or [np.zeros(1)]),
        )

    def __len__(self) -> int:
        """How many there are."""
        return len(self.each)


def turns_between(rotations: Array) -> Array:
    """Rotation from each frame to the next in its own axes, shape (T, 3) [rad]; the last one 0.

    Args:
        rotations: Shape (T, 3, 3).
    """
    steps = np.zeros((len(rotations), 3))
    if len(rotations) > 1:
        steps[:-1] = scipy.spatial.transform.Rotation.from_matrix(
            rotations[:-1].transpose(0, 2, 1) @ rotations[1:]
        ).as_rotvec()
    return steps
