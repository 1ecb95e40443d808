"""Parallel projection of cylinders: front, top and side view in third angle, and a view at an angle."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody
from armdesign.bodies.cylinder import Cylinder
from armdesign.building.sheet import Sheet, circle

SHADES = {"joint": "#d9d9d9", "base": "#eeeeee", "tube": "white"}
EDGE_ON = 1e-6


class View(NamedTuple):
    """A direction to look in.

    Attributes:
        name: Of the view.
        right: What points to the right, shape (3,).
        up: What points up, shape (3,).
    """

    name: str
    right: tuple[float, float, float]
    up: tuple[float, float, float]

    @property
    def axes(self) -> Array:
        """Unit vectors to the right and up, shape (2, 3)."""
        return np.array([self.right, self.up])

    @property
    def towards(self) -> Array:
        """Unit vector to who looks, shape (3,)."""
        return np.cross(self.right, self.up)

    def flat(self, points: ArrayLike) -> Array:
        """Where points are seen.

        Args:
            points: Shape (..., 3).

        Returns:
            Shape (..., 2), in the same unit.
        """
        seen: Array = np.asarray(points, dtype=float) @ self.axes.T
        return seen


FRONT = View("front view", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
TOP = View("top view", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
SIDE = View("right side view", (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
VIEWS = (FRONT, TOP, SIDE)
"""In third angle the top view stands above the front view, the right side view to its right."""


def slanted(azimuth: float = 40.0, elevation: float = 25.0) -> View:
    """A view from the front right and above.

    Args:
        azimuth: About z, from the front view's direction on [deg].
        elevation: Above the horizon [deg].
    """
    s, c = np.sin(np.deg2rad([azimuth, elevation])), np.cos(np.deg2rad([azimuth, elevation]))
    right = (float(c[0]), float(s[0]), 0.0)
    up = (float(-s[0] * s[1]), float(c[0] * s[1]), float(c[1]))
    return View("at an angle", right, up)


class Solid(NamedTuple):
    """A cylinder to draw.

    Attributes:
        shape: The cylinder, in the room [m].
        link: The link that it belongs to.
        name: What to call it.
        fill: Colour.
        pen: Of its edges.
    """

    shape: Cylinder
    link: int
    name: str
    fill: str
    pen: str = "outline"


def posed(arm: ArmBody, q: Array, turn: Array) -> list[Solid]:
    """The solids of an arm in a pose.

    Args:
        arm: The arm.
        q: Its joints, shape (n,) [rad; m of joints that slide].
        turn: Axes of its base in the room as columns, shape (3, 3).
    """
    room = np.eye(4)
    room[:3, :3] = turn
    frames = [room, *(room @ frame for frame in arm.table.frames(q))]
    return [
        Solid(
            replace(part.solid, pose=frames[part.link] @ part.solid.pose),
            part.link,
            part.name,
            SHADES.get(part.solid.material, "white"),
        )
        for part in arm.parts
    ]


def rims(shape: Cylinder) -> Array:
    """Points of both rims of a cylinder, shape (2, k, 3) [m]."""
    around = circle((0.0, 0.0), shape.radius) @ shape.pose[:3, :2].T
    return shape.ends[:, None, :] + around


def silhouette(shape: Cylinder, view: View) -> Array:
    """Outline of a cylinder as it is seen, convex, shape (k, 2) [m]."""
    seen = view.flat(rims(shape).reshape(-1, 3))
    outline: Array = seen[ConvexHull(seen, qhull_options="QJ Pp").vertices]
    return outline


def draw_solids(sheet: Sheet, solids: Iterable[Solid], view: View, scale: float) -> list[Array]:
    """Draw solids, the nearer over the farther ones.

    Args:
        sheet: What is drawn on, the origin of the room in its origin.
        solids: The solids.
        view: How they are looked at.
        scale: Millimetres on paper per metre.

    Returns:
        Their outlines, shape (k, 2) each [mm].
    """

    def nearness(solid: Solid) -> float:
        """Of two side by side the module lies over the tube that ends in it."""
        return float(solid.shape.pose[:3, 3] @ view.towards) + (0.2 * solid.shape.radius)

    outlines = []
    for solid in sorted(solids, key=nearness):
        outline = scale * silhouette(solid.shape, view)
        sheet.area(outline, solid.pen, solid.fill)
        outlines.append(np.vstack([outline, outline[:1]]))
        leaning = float(solid.shape.pose[:3, 2] @ view.towards)
        if abs(leaning) > EDGE_ON:
            near = 1 if leaning > 0.0 else 0
            sheet.area(scale * view.flat(rims(solid.shape)[near]), "thin", "none")
    return outlines


def end_on(direction: Array, view: View) -> bool:
    """Whether a direction, shape (3,), is looked at along itself."""
    return float(np.linalg.norm(view.flat(direction))) < 0.05


def least_shortened(direction: Array, views: Sequence[View] = VIEWS) -> int:
    """Which view shows a length along a direction the longest; of front, top and side at least 82 % of it.

    Args:
        direction: Shape (3,).
        views: The views.
    """
    return int(np.argmax([round(float(np.linalg.norm(view.flat(direction))), 9) for view in views]))
