"""Triangles as a shaded picture: a small renderer with a depth buffer, so that what is in front hides what is behind.

Light falls from above, over the viewer's left shoulder; there is no perspective, so that lengths compare.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.image import imsave
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.views.report.kernels.depth_buffer import fill, shade

SIDES = 32
"""Flat sides that a cylinder is drawn with."""
TALLEST = 0.75
"""Largest height of a picture by its width."""
ROOM = 0.4
"""What is shown beside the points that matter, by their extent."""
FINER = 2
"""Samples a pixel in either direction, for smooth edges."""
AMBIENT = 0.6
"""Share of the light that does not depend on where a face looks."""
EDGE, INK = 12.0, 0.5
"""What steps back by so much from a sample to the next has a line about it [mm]; how bright that is."""
LIGHT = np.array([-0.5, 0.75, 1.0]) / np.linalg.norm([-0.5, 0.75, 1.0])
"""Where the light comes from: right, up, towards the viewer."""


class Faces(NamedTuple):
    """Triangles.

    Attributes:
        corners: Shape (K, 3, 3) [mm].
        colours: Red, green, blue from 0 to 1, shape (K, 3).
        marks: A number for each, to ask afterwards what is seen, shape (K,).
    """

    corners: Array
    colours: Array
    marks: NDArray[np.int64]


def painted(corners: Array, colour: str, mark: int = 0) -> Faces:
    """Triangles of one colour.

    Args:
        corners: Shape (K, 3, 3) [mm].
        colour: As ``#rrggbb``.
        mark: Their number.
    """
    rgb = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return Faces(corners, np.tile(rgb, (len(corners), 1)), np.full(len(corners), mark))


def together(parts: list[Faces]) -> Faces:
    """All triangles of some lists."""
    return Faces(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def cylinder_faces(start: Array, end: Array, radius: float, *, sides: int = SIDES) -> Array:
    """A closed cylinder between two points, shape (K, 3, 3); no triangles where they are the same.

    Args:
        start: Middle of one end, shape (3,).
        end: Middle of the other.
        radius: Its radius.
        sides: Flat sides that it is drawn with.
    """
    along = end - start
    length = float(np.linalg.norm(along))
    if length <= 0.0:
        return np.zeros((0, 3, 3))
    z = along / length
    x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    angle = np.linspace(0.0, 2.0 * np.pi, sides + 1)
    ring = radius * (np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * np.cross(z, x))
    low, high = start + ring, end + ring
    middle = np.broadcast_to(start, low[1:].shape), np.broadcast_to(end, low[1:].shape)
    around = [(low[:-1], low[1:], high[1:]), (low[:-1], high[1:], high[:-1])]
    caps = [(middle[0], low[1:], low[:-1]), (middle[1], high[:-1], high[1:])]
    return np.concatenate([np.stack(three, axis=1) for three in (*around, *caps)])


def ball_faces(centre: Array, radius: float, *, sides: int = SIDES) -> Array:
    """A ball, shape (K, 3, 3).

    Args:
        centre: Its centre, shape (3,).
        radius: Its radius.
        sides: Flat sides around its equator.
    """
    around, up = np.linspace(0.0, 2.0 * np.pi, sides + 1), np.linspace(0.0, np.pi, sides // 2 + 1)
    ring = np.stack([np.cos(around), np.sin(around), np.zeros_like(around)], axis=1)
    grid = np.sin(up)[:, None, None] * ring + np.cos(up)[:, None, None] * np.array([0.0, 0.0, 1.0])
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    faces = np.concatenate([np.stack(three, axis=2).reshape(-1, 3, 3) for three in ((a, b, c), (a, c, d))])
    return np.asarray(centre + radius * faces)


def prism_faces(ends: Array) -> Array:
    """A convex polygon drawn out, shape (4 K - 4, 3, 3).

    Args:
        ends: Corners of its lower and of its upper face, shape (2, K, 3).
    """
    low, high = ends
    caps = [np.stack([np.broadcast_to(end[0], end[2:].shape), end[1:-1], end[2:]], axis=1) for end in ends]
    after, above = np.roll(low, -1, axis=0), np.roll(high, -1, axis=0)
    return np.concatenate([*caps, np.stack([low, after, above], axis=1), np.stack([low, above, high], axis=1)])


class Shot(NamedTuple):
    """A picture's place in the scene.

    Attributes:
        turn: Right and up of the viewer, rows of shape (2, 3), at right angles, of length 1.
        middle: What is in its middle, along both, shape (2,) [mm].
        scale: Pixels a millimetre.
        width: Of the picture [pixels].
        height: Of the picture [pixels].
    """

    turn: Array
    middle: Array
    scale: float
    width: int
    height: int

    def at(self, point: Array) -> Array:
        """Where a point of shape (3,) [mm] is, from the left and from above, shape (2,) [pixels]."""
        x, y = self.scale * (self.turn @ point - self.middle)
        return np.array([self.width / 2.0 + x, self.height / 2.0 - y])


def shot_of(faces: Faces, turn: Array, width: int, focus: Array | None = None) -> Shot:
    """A picture that shows triangles, three quarters as high as wide at most.

    Args:
        faces: The triangles.
        turn: Right and up of the viewer, rows of shape (2, 3), at right angles, of length 1.
        width: Width of the picture in pixels; its height follows.
        focus: Points that matter, shape (P, 3) [mm]: what is far from all of them is cut off. By default nothing is.
    """
    seen = faces.corners @ turn.T
    low, high = seen.min(axis=(0, 1)), seen.max(axis=(0, 1))
    if focus is not None:
        near = focus @ turn.T
        beside = ROOM * float(np.ptp(near, axis=0).max())
        low, high = np.maximum(low, near.min(axis=0) - beside), np.minimum(high, near.max(axis=0) + beside)
    size = np.maximum(high - low, 1e-9)
    scale = width * min(1.0 / size[0], TALLEST / size[1])
    return Shot(turn, (low + high) / 2.0, scale, width, max(int(np.ceil(scale * size[1])), 1))


class Drawn(NamedTuple):
    """What is seen of some triangles, in samples, from below.

    Attributes:
        depth: How near it is, shape (FINER H, FINER W) [mm], -inf for nothing.
        chosen: Number of the triangle that is seen, -1 for none, shape (FINER H, FINER W).
        colours: Of the triangles in their light, and white in the last row, shape (K + 1, 3).
        marks: Of the triangles, and -1 in the last row, shape (K + 1,).
    """

    depth: Array
    chosen: NDArray[np.int64]
    colours: Array
    marks: NDArray[np.int64]


def drawn(faces: Faces, shot: Shot, beside: Drawn | None = None) -> Drawn:
    """What is seen of triangles, and of others that are there already.

    Args:
        faces: The triangles.
        shot: What is seen of them, from where.
        beside: The others, in the same shot.
    """
    seen = faces.corners @ np.vstack([shot.turn, np.cross(*shot.turn)]).T
    normal = np.cross(seen[:, 1] - seen[:, 0], seen[:, 2] - seen[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    size, scale = np.array([shot.width, shot.height]), FINER * shot.scale
    seen = (seen - np.r_[shot.middle, 0.0]) * np.r_[scale, scale, 1.0] + FINER * np.r_[size / 2.0, 0.0]
    normal = np.where(normal[:, 2:] < 0.0, -normal, normal) / np.where(length > 0.0, length, 1.0)  # both sides are lit
    light = AMBIENT + (1.0 - AMBIENT) * np.maximum(normal @ LIGHT, 0.0)
    if beside is None:
        depth = np.full((FINER * shot.height, FINER * shot.width), -np.inf)
        beside = Drawn(depth, np.full(depth.shape, -1), np.ones((1, 3)), np.array([-1]))
    depth, chosen, others = beside.depth.copy(), beside.chosen.copy(), beside.colours[:-1]
    fill(depth, chosen, seen, len(others))
    colours = np.vstack([others, faces.colours * light[:, None], beside.colours[-1:]])
    return Drawn(depth, chosen, colours, np.r_[beside.marks[:-1], faces.marks, -1])


def rendered(drawing: Drawn) -> Array:
    """The picture of what is seen: red, green, blue from 0 to 1, shape (H, W, 3), white where nothing is."""
    height, width = (size // FINER for size in drawing.depth.shape)
    picture = np.empty((height, width, 3))
    shade(picture, drawing.depth.copy(), drawing.chosen, drawing.colours, EDGE, INK)
    return picture[::-1]


def see_through(solid: Faces, faint: Sequence[tuple[Faces, float]], shot: Shot, before: int) -> Array:
    """A picture, shape (H, W, 3), of triangles and of others that let some of what is behind them be seen.

    Args:
        solid: The triangles.
        faint: The others, each body for itself, and how much is seen through it, from 0 to 1.
        shot: What is seen of them, from where.
        before: Mark of what no faint body is drawn over, even where it is in front.
    """
    behind = drawn(solid, shot)
    free = (
        (behind.marks[behind.chosen] != before)[::-1]
        .reshape(shot.height, FINER, shot.width, FINER)
        .mean(axis=(1, 3))[..., None]
    )
    picture = plain = rendered(behind)
    for body, through in faint:
        seen = rendered(drawn(body, shot, behind))
        opaque = free * (1.0 - through) * (seen != plain).any(axis=2, keepdims=True)
        picture = picture + opaque * (seen - picture)
    return np.clip(picture, 0.0, 1.0)


def image_svg(picture: Array, marks: str = "") -> str:
    """A picture, shape (H, W, 3), as an ``<svg>`` element that holds it as PNG.

    Args:
        picture: The picture.
        marks: SVG elements over it, in its pixels.
    """
    content = io.BytesIO()
    nothing: dict[str, Any] = {"Software": None}
    imsave(content, np.round(picture * 255.0).astype(np.uint8), format="png", metadata=nothing)
    height, width = picture.shape[:2]
    data = base64.b64encode(content.getvalue()).decode("ascii")
    return (
        f'<svg viewBox="0 0 {width} {height}"><image width="{width}" height="{height}" '
        f'href="data:image/png;base64,{data}"/>{marks}</svg>'
    )
