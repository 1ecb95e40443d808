"""Everything a page shows: the designs side by side, each with its demonstrator, on one floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import meshcat
import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.readers import legible_text
from armdesign.export.urdf import result_urdf
from armdesign.search.result import Result
from armdesign.views.preview.arm_shapes import draw_arm
from armdesign.views.preview.colours import GROUND, SKY, Scale, scale_for
from armdesign.views.preview.human import (
    Motion,
    draw_demonstrator,
    draw_errors,
    draw_orientations,
    draw_traces,
    motion_of,
)
from armdesign.views.preview.keyframes import Indices, choose_frames, deviation, most_keyframes
from armdesign.views.preview.recorder import Command, Window, animation
from armdesign.views.preview.shapes import draw_frame, draw_grid
from armdesign.views.preview.surroundings import (
    draw_obstacles,
    draw_sites,
    named_tops,
    thinned_names,
    wall_normals,
)

GAP = 0.25
"""Free space between designs side by side [m]."""
MARGIN = 0.1
"""Floor beyond and below what is shown [m]."""
BELOW = 0.02
"""What reaches no deeper than this below z = 0 still stands on the room's floor [m]."""
MOST_TRACED = 600
"""Points of the traces of all designs; more look no different."""
AXIS, AXIS_RADIUS = 0.15, 0.004
"""Size of the base frames [m]."""


@dataclass(frozen=True, eq=False)
class Shown:
    """One design of the page.

    Attributes:
        name: What the user calls it, without letters that cannot be shown.
        points: Names of the m points.
        times: Keyframe times from the start, shape (K,) [s].
        distance: Distances of the points at the keyframes, shape (K, m) [m].
        pose: Pose of its base, shape (4, 4): where it stands in the recording's room, beside the designs before it.
        bounds: Lowest and highest corner of all it passes through, shape (2, 3) [m].
        frames: Number of frames of the task.
        deviation: How far the end-effector gets from its path by showing only keyframes [m].
        oriented: Whether the hand's orientation is followed.
        joints: Places of the joints at the keyframes, shape (K, n) [rad; m].
        sliding: Which joints slide, n of them.
        walls: Where the free sides of the walls are, shape (W, 3), of length 1.
        surrounded: Whether anything stands in its room.
        regions: Whether there is a choice of places for its base.
        simplified: Names of the obstacles that are drawn as the box about them.
        things: Names of the obstacles that stand still, with the middles of their tops, shape (3,) [m].
    """

    name: str
    points: tuple[str, ...]
    times: Array
    distance: Array
    pose: Array
    bounds: Array
    frames: int
    deviation: float
    oriented: bool
    joints: Array
    sliding: tuple[bool, ...]
    walls: Array
    surrounded: bool = False
    regions: bool = False
    simplified: tuple[str, ...] = ()
    things: tuple[tuple[str, Array], ...] = ()


@dataclass(frozen=True, eq=False)
class Scene:
    """What MeshCat draws, and what the page says beside it.

    Attributes:
        commands: Drawing commands, the animation last.
        designs: What is shown.
        scale: Colours of distances.
        duration: Of the longest task [s].
        floor: z of the floor [m].
    """

    commands: tuple[Command, ...]
    designs: tuple[Shown, ...]
    scale: Scale
    duration: float
    floor: float


def build_scene(runs: Sequence[Result], urdfs: Sequence[str] | None = None) -> Scene:
    """Draw finished runs side by side along y, in the order given.

    Nothing is sent anywhere and no server is started.

    Args:
        runs: One at least.
        urdfs: Their URDFs where these are known.
    """
    texts = urdfs or [result_urdf(run) for run in runs]
    motions = [motion_of(run) for run in runs]
    scale = scale_for(np.concatenate([motion.distance.ravel() for motion in motions]))
    bounds = [bounds_of(run, motion) for run, motion in zip(runs, motions, strict=True)]
    beside = side_by_side(bounds)
    window = Window()
    viewer = meshcat.Visualizer(window=window)
    designs, parts, most = [], [], most_keyframes(runs)
    for k, (run, motion, urdf) in enumerate(zip(runs, motions, texts, strict=True)):
        chosen = choose_frames(run.problem.task.time, most)
        shown = describe(run, motion, chosen, beside[k], bounds[k])
        designs.append(shown)
        node = viewer[f"design_{k + 1}"]
        node.set_transform(shown.pose)
        draw_frame(node["base_frame"], AXIS, AXIS_RADIUS)
        draw_traces(node["traces"], motion, MOST_TRACED // len(runs))
        room = viewer[f"room_{k + 1}"]
        room.set_transform(translated(beside[k]))
        draw_sites(room, run.problem.space.sites)
        tracks = [
            *draw_obstacles(room, run.problem.first.obstacles.each, chosen, bounds[k]),
            *draw_arm(node, urdf, run.evaluation.path.q[chosen]),
            *draw_demonstrator(node["demonstrator"], motion, chosen),
            *draw_errors(node["distances"], motion, chosen, scale),
            *draw_orientations(node["orientations"], run, motion, chosen),
        ]
        parts.append((shown.times, tracks))
    floor = draw_surroundings(viewer, designs, room=all(run.base_pose.frame == "room" for run in runs))
    duration = max(float(shown.times[-1]) for shown in designs)
    return Scene((*window.commands, animation(parts, duration)), tuple(designs), scale, duration, floor)


def translated(shift: Array) -> Array:
    """A pose that is but a shift, shape (4, 4)."""
    pose = np.eye(4)
    pose[:3, 3] = shift
    return pose


def describe(run: Result, motion: Motion, chosen: Indices, beside: Array, bounds: Array) -> Shown:
    """What the page says of a design, moved aside by a vector of shape (3,) [m]."""
    task, pose = run.problem.task, run.base_pose.matrix
    pose[:3, 3] += beside
    return Shown(
        name=legible_text(run.name),
        points=tuple(map(legible_text, task.points)),
        times=task.time[chosen] - task.time[0],
        distance=motion.distance[chosen],
        pose=pose,
        bounds=bounds + beside,
        frames=len(task.time),
        deviation=deviation(task.time, motion.tip[:, None], chosen),
        oriented=task.R is not None,
        joints=run.evaluation.path.q[chosen],
        sliding=run.table.prismatic,
        walls=wall_normals(run.problem.first.obstacles.each),
        surrounded=bool(run.problem.first.obstacles.each),
        regions=any(np.ptp(site.box, axis=0).max() > 0.0 for site in run.problem.space.sites),
        simplified=tuple(map(legible_text, thinned_names(run.problem.first.obstacles.each))),
        things=tuple((legible_text(name), top + beside) for name, top in named_tops(run.problem.first.obstacles.each)),
    )


def bounds_of(run: Result, motion: Motion) -> Array:
    """Lowest and highest corner of what a run passes through in the room, its base and solids included."""
    body, base = run.problem.settings.body, run.base_pose
    corners = run.table.skeleton(run.evaluation.path.q).reshape(-1, 3)
    thick = max(module.diameter for module in body.modules_of(run.table.dof)) / 2.0
    passed = np.concatenate([corners, motion.points.reshape(-1, 3), motion.arm.reshape(-1, 3)])
    plate = np.array([body.base_diameter / 2.0, body.base_diameter / 2.0, body.reach + body.base_height])
    plate[2] = 0.0 if run.problem.first.base is not None else plate[2]  # a placed arm stands on its plate's face
    passed = np.concatenate([passed, [plate, -plate]]) @ base.rotation.T + base.translation
    solid = [one for one in run.problem.first.obstacles.each if len(one.shape.outline)]
    around = [one.shape.outline @ pose[:3, :3].T + pose[:3, 3] for one in solid for pose in one.poses]
    passed = np.concatenate([passed, *around])
    arm = corners @ base.rotation.T + base.translation
    return np.stack([np.minimum(passed.min(axis=0), arm.min(axis=0) - thick),
                     np.maximum(passed.max(axis=0), arm.max(axis=0) + thick)])  # fmt: skip


def side_by_side(bounds: Sequence[Array]) -> Array:
    """How far designs are moved aside so that they do not touch: along y, the first not at all, shape (N, 3) [m].

    Args:
        bounds: Lowest and highest corner of each in the room, shape (2, 3) [m].
    """
    beside = np.zeros((len(bounds), 3))
    for k in range(1, len(bounds)):
        beside[k, 1] = beside[k - 1, 1] + bounds[k - 1][1, 1] + GAP - bounds[k][0, 1]
    return beside


def draw_surroundings(viewer: Any, designs: Sequence[Shown], *, room: bool) -> float:  # noqa: ANN401
    """Draw the floor with a line every 0.1 m, and the background.

    Args:
        viewer: A ``meshcat.Visualizer``.
        designs: What is shown.
        room: Whether all of it is in a room, whose floor is at z = 0 where nothing reaches below.

    Returns:
        z of the floor [m].
    """
    low = np.min([shown.bounds[0] for shown in designs], axis=0) - MARGIN
    high = np.max([shown.bounds[1] for shown in designs], axis=0) + MARGIN
    floor = 0.0 if room and low[2] + MARGIN > -BELOW else float(np.floor(low[2] * 10.0) / 10.0)
    draw_grid(viewer["floor"], np.stack([low[:2], high[:2]]), floor)
    for name in ("/Grid", "/Axes"):
        viewer[name].set_property("visible", False)
    viewer["/Background"].set_property("top_color", list(SKY))
    viewer["/Background"].set_property("bottom_color", list(GROUND))
    return floor
