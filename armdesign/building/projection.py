"""Parallel projection of solids: front, top and side view in third angle, and a view at an angle."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody
from armdesign.bodies.cylinder import along
from armdesign.building.parts import Part, Rod
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
        """Where points, shape (..., 3), are seen, shape (..., 2), in the same unit."""
        seen: Array = np.asarray(points, dtype=float) @ self.axes.T
        return seen


FRONT = View("front view", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
TOP = View("top view", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
SIDE = View("right side view", (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
VIEWS = (FRONT, TOP, SIDE)
"""In third angle the top view stands above the front view, the right side view to its right."""


def slanted(azimuth: float = 40.0, elevation: float = 25.0) -> View:
    """A view from the front right, turned about z by an azimuth, and above the horizon by an elevation [deg]."""
    s, c = np.sin(np.deg2rad([azimuth, elevation])), np.cos(np.deg2rad([azimuth, elevation]))
    right = (float(c[0]), float(s[0]), 0.0)
    up = (float(-s[0] * s[1]), float(c[0] * s[1]), float(c[1]))
    return View("at an angle", right, up)


class Solid(NamedTuple):
    """A convex solid to draw, in the room [m].

    Attributes:
        middle: Shape (3,).
        corners: What it is the convex hull of, shape (k, 3).
        faces: Outlines of its flat faces, counterclockwise from outside, shape (k, 3) each.
        link: The link that it belongs to.
        name: What to call it.
        fill: Colour.
        pen: Of its outline.
        half: From its middle to the end of its axis, shape (3,), of round ones.
        radius: Of round ones.
    """

    middle: Array
    corners: Array
    faces: tuple[Array, ...]
    link: int
    name: str
    fill: str = "white"
    pen: str = "outline"
    half: Array = np.zeros(3)
    radius: float = 0.0


def round_solid(ends: Array, radius: float, link: int, name: str, fill: str = "white") -> Solid:
    """A cylinder.

    Args:
        ends: Middles of its faces, shape (2, 3) [m].
        radius: [m].
        link: The link it belongs to.
        name: What to call it.
        fill: Its colour.
    """
    half = (ends[1] - ends[0]) / 2.0
    around = circle((0.0, 0.0), radius) @ along(*ends)[:3, :2].T
    if half[2] < 0.0:  # the frame of a line points upwards
        around = around[::-1]
    rims = ends[:, None, :] + around
    middle = ends.mean(axis=0)
    return Solid(middle, rims.reshape(-1, 3), (rims[0, ::-1], rims[1]), link, name, fill, "outline", half, radius)


def solids_of(part: Part, pose: Array, link: int = 0, fill: str = "white") -> list[Solid]:
    """The solids that a part consists of.

    Args:
        part: The part.
        pose: Its frame in the room, shape (4, 4).
        link: The link it belongs to.
        fill: Its colour.
    """
    found = []
    for form in part.solids:
        if isinstance(form, Rod):
            ends = np.stack([form.start, form.end]) @ pose[:3, :3].T + pose[:3, 3]
            found.append(round_solid(ends, form.radius, link, part.kind, fill))
            continue
        low, high = form.ends
        after = np.roll(np.arange(len(low)), -1)
        sides = [np.stack([low[i], low[j], high[j], high[i]]) for i, j in enumerate(after)]
        faces = [face @ pose[:3, :3].T + pose[:3, 3] for face in (low[::-1], high, *sides)]
        corners = np.concatenate(faces[:2])
        found.append(Solid(corners.mean(axis=0), corners, tuple(faces), link, part.kind, fill))
    return found


def posed(arm: ArmBody, q: Array, turn: Array) -> list[Solid]:
    """The solids of an arm's body in a pose.

    Args:
        arm: The arm.
        q: Its joints, shape (n,) [rad; m of joints that slide].
        turn: Axes of its base in the room as columns, shape (3, 3).
    """
    frames = [frame[:3] for frame in (np.eye(4), *arm.table.frames(q))]
    found = []
    for part in arm.parts:
        frame = turn @ frames[part.link]
        shade = SHADES.get(part.solid.material, "white")
        ends = part.solid.ends @ frame[:, :3].T + frame[:, 3]
        found.append(round_solid(ends, part.solid.radius, part.link, part.name, shade))
    return found


def silhouette(solid: Solid, view: View) -> Array:
    """Outline of a solid as it is seen, convex, shape (k, 2) [m]."""
    seen = view.flat(solid.corners)
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
        return float(solid.middle @ view.towards) + 0.2 * solid.radius

    outlines = []
    for solid in sorted(solids, key=nearness):
        outline = scale * silhouette(solid, view)
        sheet.area(outline, solid.pen, solid.fill)
        outlines.append(np.vstack([outline, outline[:1]]))
        for face in solid.faces:
            normal = np.cross(face[1] - face[0], face[2] - face[1])
            if normal @ view.towards > EDGE_ON * np.linalg.norm(normal):
                sheet.area(scale * view.flat(face), "thin", "none")
    return outlines


def end_on(direction: Array, view: View) -> bool:
    """Whether a direction, shape (3,), is looked at along itself."""
    return float(np.linalg.norm(view.flat(direction))) < 0.05


def least_shortened(direction: Array) -> int:
    """Which view shows a length along a direction, shape (3,), the longest; of ``VIEWS`` at least 82 % of it."""
    return int(np.argmax([round(float(np.linalg.norm(view.flat(direction))), 9) for view in VIEWS]))
