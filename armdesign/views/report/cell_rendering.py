"""The arm in its cell as a shaded picture: its bodies or parts, the person, what stands around, the floor."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from armdesign._types import Array
from armdesign.bodies.arm_body import arm_body
from armdesign.bodies.exact import carriers
from armdesign.building.build import Build
from armdesign.building.parts import Rod
from armdesign.cell.obstacles import Mesh, Plane
from armdesign.feasibility.verdict import exact_obstacles
from armdesign.search.result import Result
from armdesign.settings import Body
from armdesign.views.report.answers import Worst
from armdesign.views.report.drawing import HUMAN, Picture
from armdesign.views.report.rendering import (
    Faces,
    Shot,
    ball_faces,
    cylinder_faces,
    drawn,
    image_svg,
    painted,
    prism_faces,
    rendered,
    see_through,
    shot_of,
    together,
)
from armdesign.views.report.report_scene import view

PATH_POINTS = 120
ARM, AROUND, PERSON, FLOOR = 1, 2, 3, 4
"""Marks of what is drawn."""
OBSTACLE, GROUND, LINES, PLATE = "#eadfcb", "#f6f6f3", "#e6e6e1", "#9aa0a6"
TUBE, MODULE, BRACKET = "#c3ced6", "#3c93d2", "#e6eaed"
BETWEEN, TIP = "#b00020", "#56b4e9"
THROUGH_ARM, THROUGH_PERSON = 0.7, 0.35
"""How much is seen through the arm at the start and through the person's: so that they differ in grey, too."""
PATCH, THICK = 300.0, 16.0
"""Half the side of the piece of a wall that is drawn behind a base, and how thick it is [mm]."""
LIMB = (46.0, 28.0)
"""How thick a person's arm is drawn, at the shoulder and at the hand: its radius [mm]."""
WIDTH, LOOK = 900, 60
"""Width of the picture, and of those that only show how much of the arm an azimuth lets see [pixels]."""
INSET, LETTERS = 360, 24
"""Width and height of the close view, and height of what is written on it [pixels]."""
AZIMUTHS = np.deg2rad(np.arange(-75.0, 270.0, 30.0))
CLOSE = 12.0
"""Half the width of what a close view shows at least [mm]."""
TILE = 250.0
"""Width of the floor's tiles [mm]."""
MOST_TRIANGLES = 20_000
"""Larger meshes are drawn as their convex hull."""


def cell_rendering(run: Result, made: Build | None = None) -> Picture:
    """The arm in its cell, from where most of it is seen.

    Args:
        run: The run.
        made: Its parts, where it is a build.
    """
    problem, q, last = run.problem.in_room, run.evaluation.path.q, len(run.evaluation.path.q) - 1
    arm, first = (together(arm_faces(run, q[k], made)) for k in (last, 0))
    body, path = person_faces(run, 0, last)
    faces = together([arm, path, *around_faces(run, [arm, first, path], 0, last)])
    focus = together([arm, first, path]).corners.reshape(-1, 3)
    every = together([faces, first, body])
    shot = shot_of(every, best_view(every, arm, focus), WIDTH, focus)
    picture = see_through(faces, [(first, THROUGH_ARM), (body, THROUGH_PERSON)], shot, ARM)
    start, end = (f"{problem.task.time[k] - problem.task.time[0]:.2f}" for k in (0, last))
    names = ", ".join(dict.fromkeys(one.name for one in run.problem.first.obstacles.each))
    alt = f"The arm of {run.table.dof} joints in its cell at the end of its motion; around it: {names or 'nothing'}."
    caption = (
        f"The arm at the end, {end} s, and faintly at the start, {start} s. Orange, darker in grey: the person's "
        "arm at the end, and the hand's path."
    )
    on = {
        "floor": "The square under its plate stands for what it is bolted to",
        "wall": "The square behind its plate is a piece of the wall",
        "ceiling": "The square over its plate is a piece of the ceiling",
    }
    caption += f" {on[run.base_pose.mounted]}." if mount_faces(run, 0, last) else ""
    caption += " Its parts are as they are built." if made and made.assembly else ""
    return Picture("rendering", image_svg(picture), alt, caption)


def best_view(faces: Faces, arm: Faces, focus: Array, along: Array | None = None) -> Array:
    """Right and up of a viewer who sees most of an arm, and it spread out most, shape (2, 3).

    Args:
        faces: All that is there.
        arm: The arm alone.
        focus: What has to be seen, shape (P, 3) [mm].
        along: A way that should be seen at its full length, shape (3,); by default the arm's extent.
    """

    def seen(azimuth: float) -> float:
        turn = view(azimuth)
        pictures = [drawn(each, shot_of(each, turn, LOOK, focus)) for each in (faces, arm)]
        shares = [float((each.marks[each.chosen] == ARM).mean()) for each in pictures]
        spread = float(np.std(focus @ turn[0])) if along is None else float(np.linalg.norm(turn @ along))
        return shares[0] / max(shares[1], 1e-9) * spread

    return view(max(AZIMUTHS.tolist(), key=seen))


def worst_rendering(run: Result, worst: Worst, made: Build | None = None) -> Picture:
    """The arm where the tool is furthest from the hand, and beside it tool and hand from near, seen across the gap.

    Args:
        run: The run.
        worst: Where that is.
        made: Its parts, where it is a build.
    """
    k, t = worst.demonstration, worst.frame
    q = run.evaluation.demonstrations[k].path.q[t]
    arm, (body, _) = together(arm_faces(run, q, made)), person_faces(run, k, t)
    task, base = run.problem.in_room.demonstrations[k].task, run.base_pose.matrix
    hand = 1e3 * (task.P[t, -1] + run.problem.in_room.shift)
    tip = 1e3 * (base @ run.table.frames(q)[-1])[:3, 3]
    faces = together([arm, *around_faces(run, [arm, body], k, t)])
    focus = together([arm, body]).corners.reshape(-1, 3)
    turn = best_view(faces, arm, focus, hand - tip)
    shot = shot_of(together([faces, body]), turn, WIDTH - INSET, focus)
    half = max(CLOSE, 2.5 * float(np.linalg.norm(hand - tip)))
    close = Shot(turn, turn @ (hand + tip) / 2.0, INSET / (2.0 * half), INSET, INSET)
    whole = see_through(faces, [(body, THROUGH_PERSON)], shot, ARM)
    near = (1.0 + rendered(drawn(arm, close))) / 2.0  # pale, under its marks
    picture = np.ones((max(shot.height, INSET), WIDTH, 3))
    picture[: shot.height, : shot.width], picture[:INSET, shot.width :] = whole, near
    marks = gap_marks(shot, close, hand, tip, f"{1e3 * worst.error:.1f} mm")
    words = f"Where the error is largest, {worst.at}: the tool (blue dot) is {1e3 * worst.error:.1f} mm from the hand "
    words += "(orange dot). Right: the small square of the left, from near, the arm pale."
    return Picture("worst", image_svg(picture, marks), f"The arm, and its end from near. {words}", words)


def gap_marks(shot: Shot, close: Shot, hand: Array, tip: Array, size: str) -> str:
    """Marks over a picture of the arm and a close view to the right of it, as SVG.

    Args:
        shot: The picture.
        close: The close view.
        hand: Where the hand is, shape (3,) [mm].
        tip: Where the tool is.
        size: How far they are apart, in words.
    """
    (x, y), side = shot.at((hand + tip) / 2.0), max(16.0, close.width / close.scale * shot.scale)
    ends = [close.at(point) + np.array([shot.width, 0.0]) for point in (hand, tip)]
    line = '<path fill="none" stroke="{}" stroke-width="{}" d="M{:.1f} {:.1f}L{:.1f} {:.1f}"/>'
    box = '<rect fill="none" stroke="#1a1a1a" stroke-width="2" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"/>'
    text = '<text font-family="sans-serif" font-size="{}" text-anchor="{}" x="{:.1f}" y="{:.1f}">{}</text>'
    found = [
        box.format(x - side / 2.0, y - side / 2.0, side, side),
        box.format(shot.width, 1, close.width - 1, INSET - 2),
    ]
    found += [line.format("#1a1a1a", 1, x + side / 2.0, y - side / 2.0, shot.width, 1),
              line.format("#1a1a1a", 1, x + side / 2.0, y + side / 2.0, shot.width, INSET - 1),
              line.format(BETWEEN, 4, *ends[0], *ends[1])]  # fmt: skip
    for (px, py), other, colour, name in zip(ends, ends[::-1], (HUMAN, TIP), ("hand", "tool"), strict=True):
        found.append(f'<circle cx="{px:.1f}" cy="{py:.1f}" r="8" fill="{colour}" stroke="#fff" stroke-width="2"/>')
        right, below = px >= other[0], py > other[1]
        spot = px + (14.0 if right else -14.0), py + (LETTERS if below else -6.0)
        found.append(text.format(LETTERS, "start" if right else "end", *spot, name))
    found.append(text.format(LETTERS, "middle", shot.width + close.width / 2.0, INSET - 14, f"{size} apart"))
    return "".join(found)


def person_faces(run: Result, demonstration: int, frame: int) -> tuple[Faces, Faces]:
    """The person's arm in a frame, as a body, and the path of the hand.

    Args:
        run: The run.
        demonstration: Of which demonstration, from 0.
        frame: The frame.
    """
    problem = run.problem.in_room
    task, origin = problem.demonstrations[demonstration].task, problem.shift
    person = 1e3 * (task.arm[frame] + origin)
    hand = 1e3 * (task.P[:: max(1, len(task.P) // PATH_POINTS), -1] + origin)
    radii = np.linspace(*LIMB, len(person))
    limbs = [ball_faces(point, radius) for point, radius in zip(person, radii, strict=True)]
    limbs += [cylinder_faces(a, b, r) for (a, b), r in zip(pairwise(person), radii[1:], strict=True)]
    path = [cylinder_faces(a, b, 4.0, sides=6) for a, b in pairwise(hand)]
    return painted(np.concatenate(limbs), HUMAN, PERSON), painted(np.concatenate(path), HUMAN, PERSON)


def around_faces(run: Result, parts: list[Faces], demonstration: int, frame: int) -> list[Faces]:
    """What stands around at a frame of a demonstration, and the floor under it all.

    Args:
        run: The run.
        parts: What is drawn beside it.
        demonstration: Which demonstration, from 0.
        frame: Its frame.
    """
    around, ground = obstacle_faces(run, demonstration, frame)
    around += mount_faces(run, demonstration, frame)
    solids = together([*parts, *around]).corners.reshape(-1, 3)
    return [*around, *(floor_faces(solids, level) for level in ground)]


def mount_faces(run: Result, demonstration: int, frame: int) -> list[Faces]:
    """A piece of what the base is mounted on, where nothing else that is drawn is that face; none otherwise.

    Args:
        run: The run.
        demonstration: Which demonstration, from 0.
        frame: Its frame.
    """
    base, obstacles = run.base_pose, run.problem.demonstrations[demonstration].obstacles
    plate = next((part.solid for part in run.body.parts if part.solid.material == "base"), None)
    if not run.placed and (obstacles.each or plate is None):
        return []
    if run.placed:
        level = base.mounted == "floor"  # of planes only a floor is drawn
        if any(
            carries
            for carries, drawn in zip(
                carriers(exact_obstacles(obstacles), base.matrix, frame), obstacles.each, strict=True
            )
            if level or not isinstance(drawn.shape, Plane)
        ):
            return []
    ends = [np.zeros(3), np.array([0.0, 0.0, 1.0])] if plate is None else list(plate.ends)
    ends = sorted(ends, key=lambda end: float(np.linalg.norm(end)), reverse=not run.placed)
    face, inner = (1e3 * (base.rotation @ end + base.translation) for end in ends)  # an arm that hangs is in its plate
    outwards = (face - inner) / np.linalg.norm(face - inner)
    half = PATCH if base.mounted == "wall" and run.placed else 1.84e3 * (0.05 if plate is None else plate.radius)
    x, y = half * base.rotation[:, 0], half * base.rotation[:, 1]
    square = face + np.array([x + y, y - x, -x - y, x - y])
    return [painted(prism_faces(np.stack([square, square + THICK * outwards])), LINES, FLOOR)]


def arm_faces(run: Result, q: Array, made: Build | None = None) -> list[Faces]:
    """The arm's solids in a pose of its joints; a thin arm, which has none, as a slim one.

    Args:
        run: The run.
        q: Joint angles, shape (n,).
        made: Its parts, where it is a build: these are drawn, without their holes.
    """
    arm, base = run.body, run.base_pose.matrix
    if made is not None and made.assembly is not None:
        found = []
        for each, pose in made.assembly.posed(run.table, q):
            turn, at = base[:3, :3] @ pose[:3, :3], base[:3, :3] @ pose[:3, 3] + base[:3, 3]
            colour = {"actuator": MODULE, "base plate": PLATE, "tube": TUBE}.get(each.part.kind, BRACKET)
            for solid in each.part.solids:
                points = [solid.start, solid.end] if isinstance(solid, Rod) else solid.ends
                placed = 1e3 * (np.array(points) @ turn.T + at)
                if isinstance(solid, Rod):
                    corners = cylinder_faces(placed[0], placed[1], 1e3 * solid.radius)
                else:
                    corners = prism_faces(placed)
                found.append(painted(corners, colour, ARM))
        return found
    if run.problem.settings.body.kind == "thin":
        size = float(np.clip(0.03 * run.table.length, 0.004, 0.03))
        slim = Body(
            tube_diameter=size, tube_wall=size / 8.0, joint_diameter=1.6 * size, joint_length=1.2 * size,
            base_diameter=3.0 * size, base_height=size / 2.0,
        )  # fmt: skip
        arm = arm_body(run.table, slim, None, run.limits)
    frames = [base, *(base @ frame for frame in run.table.frames(q))]
    colours = {"base": PLATE, "joint": MODULE}
    found = []
    for part in arm.parts:
        pose = frames[part.link]
        start, end = 1e3 * (part.solid.ends @ pose[:3, :3].T + pose[:3, 3])
        colour = colours.get(part.solid.material, TUBE)
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
