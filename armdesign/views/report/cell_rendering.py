"""The arm in its cell as a shaded picture: its bodies at three instants, the person, what stands around, the floor."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from armdesign._types import Array
from armdesign.bodies.arm_body import arm_body
from armdesign.cell.obstacles import Mesh, Plane
from armdesign.search.result import Result
from armdesign.settings import Body
from armdesign.views.report.drawing import HUMAN, Picture
from armdesign.views.report.rendering import Faces, cylinder_faces, image_svg, painted, rendered, together
from armdesign.views.report.report_scene import SHADES, view

INSTANTS, PATH_POINTS = 3, 120
ARM, AROUND, PERSON, FLOOR = 1, 2, 3, 4
"""Marks of what is drawn."""
OBSTACLE, GROUND, LINES, PLATE = "#c9b79c", "#f1f1ee", "#d9d9d4", "#3d3d42"
MODULES = ("#8d9aa5", "#5f6e7a", "#22303b")
"""Colours of the joint modules, the first instant to the last."""
WIDTH, LOOK = 900, 60
"""Width of the picture, and of those that only show how much of the arm an azimuth lets see [pixels]."""
AZIMUTHS = np.deg2rad(np.arange(-75.0, 270.0, 30.0))
TILE = 250.0
"""Width of the floor's tiles [mm]."""
MOST_TRIANGLES = 20_000
"""Larger meshes are drawn as their convex hull."""


def cell_rendering(run: Result) -> Picture:
    """The arm in its cell, from where most of it is seen."""
    problem, q, base = run.problem.in_room, run.evaluation.path.q, run.base_pose
    origin = np.zeros(3) if problem.origin is None else problem.origin
    chosen = np.unique(np.linspace(0, len(q) - 1, INSTANTS).astype(int))
    parts = arm_faces(run, q[chosen], base.matrix)
    person = 1e3 * (problem.task.arm[chosen[-1]] + origin)
    hand = 1e3 * (problem.task.P[:: max(1, len(q) // PATH_POINTS), -1] + origin)
    parts += [painted(cylinder_faces(a, b, 14.0), HUMAN, PERSON) for a, b in pairwise(person)]
    parts += [painted(cylinder_faces(a, b, 4.0, sides=6), HUMAN, PERSON) for a, b in pairwise(hand)]
    focus = together(parts).corners.reshape(-1, 3)
    around, ground = obstacle_faces(run, int(chosen[-1]))
    solids = together([*parts, *around])
    floors = [floor_faces(solids.corners.reshape(-1, 3), level) for level in ground]
    faces = together([solids, *floors])

    def seen(azimuth: float) -> float:
        """The share of the arm that nothing hides, by how far it spreads across the picture."""
        turn = view(azimuth)
        shares = [float((rendered(each, turn, LOOK, focus)[1] == ARM).mean()) for each in (faces, together(parts))]
        return shares[0] / max(shares[1], 1e-9) * float(np.std(focus @ turn[0]))

    turn = view(max(AZIMUTHS.tolist(), key=seen))
    picture, _ = rendered(faces, turn, WIDTH, focus)
    when = ", ".join(f"{t - problem.task.time[0]:.2f}" for t in problem.task.time[chosen])
    names = ", ".join(dict.fromkeys(one.name for one in run.problem.first.obstacles.each))
    alt = f"The arm of {run.table.dof} joints in its cell at {len(chosen)} instants; around it: {names or 'nothing'}."
    caption = (
        f"The arm at {when} s, from light to dark. Orange: the demonstrator's arm at the last of these, and the hand's "
        "path."
    )
    return Picture("rendering", image_svg(picture), alt, caption)


def arm_faces(run: Result, q: Array, base: Array) -> list[Faces]:
    """The arm's solids at some poses of its joints; a thin arm, which has none, as a slim one.

    Args:
        run: The run.
        q: Joint angles, shape (k, n).
        base: Pose of the base in the room, shape (4, 4).
    """
    arm = run.body
    if run.problem.settings.body.kind == "thin":
        size = float(np.clip(0.03 * run.table.length, 0.004, 0.03))
        slim = Body(
            tube_diameter=size, tube_wall=size / 8.0, joint_diameter=1.6 * size, joint_length=1.2 * size,
            base_diameter=3.0 * size, base_height=size / 2.0,
        )  # fmt: skip
        arm = arm_body(run.table, slim, None, run.limits)
    found = []
    for k, angles in enumerate(q):
        frames = [base, *(base @ frame for frame in run.table.frames(angles))]
        for part in arm.parts:
            if part.link == 0 and k < len(q) - 1:
                continue  # it stands where it stands
            pose = frames[part.link]
            start, end = 1e3 * (part.solid.ends @ pose[:3, :3].T + pose[:3, 3])
            colour = (MODULES if part.module else SHADES[1:])[-len(q) :][k]
            colour = PLATE if part.solid.material == "base" else colour
            found.append(painted(cylinder_faces(start, end, 1e3 * part.solid.radius), colour, ARM))
    return found


def obstacle_faces(run: Result, frame: int) -> tuple[list[Faces], list[float]]:
    """What stands around at a frame, and the heights of level half spaces [mm]."""
    found, levels = [], []
    for one in run.problem.first.obstacles.each:
        pose = one.poses[0 if len(one.poses) == 1 else frame]
        if isinstance(one.shape, Plane):
            levels += [1e3 * float(pose[2, 3])] if pose[2, 2] > 1.0 - 1e-6 else []
            continue
        if isinstance(one.shape, Mesh) and len(one.shape.faces) <= MOST_TRIANGLES:
            points, faces = one.shape.vertices, one.shape.faces
        else:
            points = one.shape.outline
            try:
                faces = ConvexHull(points).simplices
            except QhullError:  # a sheet
                continue
        corners = 1e3 * (points @ pose[:3, :3].T + pose[:3, 3])[faces]
        found.append(painted(corners, OBSTACLE, AROUND))
    return found, levels


def floor_faces(points: Array, height: float) -> Faces:
    """A tiled floor under everything, for the eye to rest on.

    Args:
        points: All that stands on it, shape (P, 3) [mm].
        height: Its height [mm].
    """
    low = np.floor(points[:, :2].min(axis=0) / TILE - 0.2) * TILE
    high = np.ceil(points[:, :2].max(axis=0) / TILE + 0.2) * TILE
    x, y = (np.arange(low[k], high[k], TILE) for k in range(2))
    corner = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    square = np.array([(0, 0), (1, 0), (1, 1), (0, 0), (1, 1), (0, 1)]) * TILE
    flat = (corner[:, None] + square).reshape(-1, 3, 2)
    corners = np.concatenate([flat, np.full((*flat.shape[:2], 1), height)], axis=2)
    dark = np.repeat((corner / TILE).round().sum(axis=1) % 2 == 0, 2)
    light, other = painted(corners[~dark], GROUND, FLOOR), painted(corners[dark], LINES, FLOOR)
    return together([light, other])
