"""The arm in its cell as a shaded picture: its bodies at three instants, the person, what stands around, the floor."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from armdesign._types import Array
from armdesign.bodies.arm_body import arm_body
from armdesign.cell.obstacles import Mesh, Plane
from armdesign.search.result import Result
from armdesign.settings import Body
from armdesign.views.report.answers import Worst
from armdesign.views.report.drawing import HUMAN, Picture
from armdesign.views.report.rendering import Faces, ball_faces, cylinder_faces, image_svg, painted, rendered, together
from armdesign.views.report.report_scene import SHADES, view

INSTANTS, PATH_POINTS = 3, 120
ARM, AROUND, PERSON, FLOOR, GAP = 1, 2, 3, 4, 5
"""Marks of what is drawn."""
OBSTACLE, GROUND, LINES, PLATE = "#c9b79c", "#f1f1ee", "#d9d9d4", "#3d3d42"
RAISED = 1e4
"""How far marks are brought before what may hide them [mm]; without perspective that does not move them."""
BETWEEN, TIP = "#b00020", "#56b4e9"
MODULES = ("#8d9aa5", "#5f6e7a", "#22303b")
"""Colours of the joint modules, the first instant to the last."""
WIDTH, LOOK = 900, 60
"""Width of the picture, and of those that only show how much of the arm an azimuth lets see [pixels]."""
AZIMUTHS = np.deg2rad(np.arange(-75.0, 270.0, 30.0))
CLOSE = 60.0
"""Half the width of what a close view shows at least [mm]."""
TILE = 250.0
"""Width of the floor's tiles [mm]."""
MOST_TRIANGLES = 20_000
"""Larger meshes are drawn as their convex hull."""


def cell_rendering(run: Result) -> Picture:
    """The arm in its cell, from where most of it is seen."""
    problem, q = run.problem.in_room, run.evaluation.path.q
    chosen = np.unique(np.linspace(0, len(q) - 1, INSTANTS).astype(int))
    parts = moving_faces(run, 0, chosen)
    focus = together(parts).corners.reshape(-1, 3)
    faces = together([*parts, *around_faces(run, parts, 0, int(chosen[-1]))])

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


def worst_rendering(run: Result, worst: Worst) -> Picture:
    """The tool beside the hand where it is furthest from it, seen across the gap.

    Args:
        run: The run.
        worst: Where that is.
    """
    k, t = worst.demonstration, worst.frame
    parts = moving_faces(run, k, np.array([t]))
    task, base, q = run.problem.in_room.demonstrations[k].task, run.base_pose.matrix, done_path(run, k)
    hand = 1e3 * (task.P[t, -1] + run.problem.in_room.shift)
    tip = 1e3 * (base @ run.table.frames(q[t])[-1])[:3, 3]
    gap = float(np.linalg.norm(hand - tip))
    marks = [painted(cylinder_faces(hand, tip, 2.0, sides=8), BETWEEN, GAP)]
    marks += [painted(ball_faces(at, 5.0), colour, GAP) for at, colour in ((hand, HUMAN), (tip, TIP))]
    solids = together([*parts, *around_faces(run, parts, k, t)])
    near = max(CLOSE, 2.0 * gap) * np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
    focus = (hand + tip) / 2.0 + near

    def seen(azimuth: float) -> float:
        """How much of the arm nothing hides, and how long the gap is across the picture."""
        turn = view(azimuth)
        shares = [float((rendered(each, turn, LOOK, focus)[1] == ARM).mean()) for each in (solids, together(parts))]
        return shares[0] / max(shares[1], 1e-9) + 2.0 * float(np.linalg.norm(turn @ (hand - tip))) / max(gap, 1e-9)

    turn = view(max(AZIMUTHS.tolist(), key=seen))
    top = together(marks)
    raised = top._replace(corners=top.corners + RAISED * np.cross(*turn))  # nothing hides it; seen in its place
    picture, _ = rendered(together([solids, raised]), turn, WIDTH // 2, focus)
    words = f"Where the error is largest, {worst.at}: the tool (light blue dot) is {1e3 * worst.error:.1f} mm from "
    words += "the hand (orange dot)."
    return Picture("worst", image_svg(picture), f"Close view of the arm's end. {words}", words)


def done_path(run: Result, demonstration: int) -> Array:
    """Joint angles of a demonstration, shape (T, n)."""
    return run.evaluation.demonstrations[demonstration].path.q


def moving_faces(run: Result, demonstration: int, frames: NDArray[np.intp]) -> list[Faces]:
    """The arm at some frames, the demonstrator's arm at the last of them, and the path of the hand.

    Args:
        run: The run.
        demonstration: Of which demonstration, from 0.
        frames: The frames.
    """
    problem = run.problem.in_room
    task, origin = problem.demonstrations[demonstration].task, problem.shift
    parts = arm_faces(run, done_path(run, demonstration)[frames], run.base_pose.matrix)
    person = 1e3 * (task.arm[frames[-1]] + origin)
    hand = 1e3 * (task.P[:: max(1, len(task.P) // PATH_POINTS), -1] + origin)
    parts += [painted(cylinder_faces(a, b, 14.0), HUMAN, PERSON) for a, b in pairwise(person)]
    return parts + [painted(cylinder_faces(a, b, 4.0, sides=6), HUMAN, PERSON) for a, b in pairwise(hand)]


def around_faces(run: Result, parts: list[Faces], demonstration: int, frame: int) -> list[Faces]:
    """What stands around at a frame of a demonstration, and the floor under it all.

    Args:
        run: The run.
        parts: What is drawn beside it.
        demonstration: Which demonstration, from 0.
        frame: Its frame.
    """
    around, ground = obstacle_faces(run, demonstration, frame)
    solids = together([*parts, *around]).corners.reshape(-1, 3)
    return [*around, *(floor_faces(solids, level) for level in ground)]


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


def obstacle_faces(run: Result, demonstration: int, frame: int) -> tuple[list[Faces], list[float]]:
    """What stands around at a frame of a demonstration, and the heights of level half spaces [mm]."""
    found, levels = [], []
    for one in run.problem.demonstrations[demonstration].obstacles.each:
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
