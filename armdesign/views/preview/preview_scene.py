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
from armdesign.settings import Body
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

GAP = 0.25
"""Free space between designs side by side [m]."""
MARGIN = 0.1
"""Floor beyond and below what is shown [m]."""
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
        origin: Place of its base, shape (3,) [m].
        bounds: Lowest and highest corner of all it passes through, shape (2, 3) [m].
        frames: Number of frames of the task.
        deviation: How far the end-effector gets from its path by showing only keyframes [m].
        oriented: Whether the hand's orientation is followed.
    """

    name: str
    points: tuple[str, ...]
    times: Array
    distance: Array
    origin: Array
    bounds: Array
    frames: int
    deviation: float
    oriented: bool


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
    origins = side_by_side(bounds)
    window = Window()
    viewer = meshcat.Visualizer(window=window)
    designs, parts, most = [], [], most_keyframes(runs)
    for k, (run, motion, urdf) in enumerate(zip(runs, motions, texts, strict=True)):
        chosen = choose_frames(run.problem.task.time, most)
        shown = describe(run, motion, chosen, origins[k], bounds[k])
        designs.append(shown)
        node, pose = viewer[f"design_{k + 1}"], np.eye(4)
        pose[:3, 3] = shown.origin
        node.set_transform(pose)
        draw_frame(node["base_frame"], AXIS, AXIS_RADIUS)
        draw_traces(node["traces"], motion, MOST_TRACED // len(runs))
        tracks = [
            *draw_arm(node, urdf, run.evaluation.path.q[chosen]),
            *draw_demonstrator(node["demonstrator"], motion, chosen),
            *draw_errors(node["distances"], motion, chosen, scale),
            *draw_orientations(node["orientations"], run, motion, chosen),
        ]
        parts.append((shown.times, tracks))
    floor = draw_surroundings(viewer, designs)
    duration = max(float(shown.times[-1]) for shown in designs)
    return Scene((*window.commands, animation(parts, duration)), tuple(designs), scale, duration, floor)


def describe(run: Result, motion: Motion, chosen: Indices, origin: Array, bounds: Array) -> Shown:
    """What the page says of a design."""
    task = run.problem.task
    return Shown(
        name=legible_text(run.name),
        points=tuple(map(legible_text, task.points)),
        times=task.time[chosen] - task.time[0],
        distance=motion.distance[chosen],
        origin=origin,
        bounds=bounds + origin,
        frames=len(task.time),
        deviation=deviation(task.time, motion.tip[:, None], chosen),
        oriented=task.R is not None,
    )


def bounds_of(run: Result, motion: Motion) -> Array:
    """Lowest and highest corner of what a run passes through in its base frame, its base and solids included."""
    body = Body()
    corners = run.table.skeleton(run.evaluation.path.q).reshape(-1, 3)
    thick = body.joint_diameter / 2.0
    passed = np.concatenate([corners - thick, corners + thick, motion.points.reshape(-1, 3)])
    base = np.array([body.base_diameter / 2.0, body.base_diameter / 2.0, body.reach + body.base_height])
    return np.stack([np.minimum(passed.min(axis=0), -base), np.maximum(passed.max(axis=0), base)])


def side_by_side(bounds: Sequence[Array]) -> Array:
    """Where the bases stand so that designs do not touch: in a row along y, the first at the origin, shape (N, 3) [m].

    Args:
        bounds: Lowest and highest corner of each in its base frame, shape (2, 3) [m].
    """
    origins = np.zeros((len(bounds), 3))
    for k in range(1, len(bounds)):
        origins[k, 1] = origins[k - 1, 1] + bounds[k - 1][1, 1] + GAP - bounds[k][0, 1]
    return origins


def draw_surroundings(viewer: Any, designs: Sequence[Shown]) -> float:  # noqa: ANN401 (a meshcat.Visualizer)
    """Draw the floor with a line every 0.1 m, and the background.

    Returns:
        z of the floor [m].
    """
    low = np.min([shown.bounds[0] for shown in designs], axis=0) - MARGIN
    high = np.max([shown.bounds[1] for shown in designs], axis=0) + MARGIN
    floor = float(np.floor(low[2] * 10.0) / 10.0)
    draw_grid(viewer["floor"], np.stack([low[:2], high[:2]]), floor)
    for name in ("/Grid", "/Axes"):
        viewer[name].set_property("visible", False)
    viewer["/Background"].set_property("top_color", list(SKY))
    viewer["/Background"].set_property("bottom_color", list(GROUND))
    return floor
