"""The demonstrator beside the arm: points and segments, traces, and how far each point is from its place on the arm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import meshcat.geometry as mg
import numpy as np

from armdesign._types import Array
from armdesign.export.trajectory.tool_poses import tool_poses
from armdesign.search.result import Result
from armdesign.views.preview.colours import ARM, DEMONSTRATOR, VIRIDIS, Scale
from armdesign.views.preview.keyframes import Indices
from armdesign.views.preview.recorder import Track, pose_tracks, position_track
from armdesign.views.preview.shapes import OnTop, draw_frame, material, rod, rod_tracks, trace
from armdesign.views.skeleton import places

POINT, PLACE, ERROR, TRACE = 0.014, 0.009, 0.0045, 0.003
"""Radii [m]."""
LIMBS = (0.045, 0.025)
"""Radii of the demonstrator's arm at its first and last segment, about those of a slender adult [m]."""
FLESH = 0.3
"""Opacity of it, so that the arm, points and errors inside are seen."""


@dataclass(frozen=True, eq=False)
class Motion:
    """What is shown of a run beside its arm, in the base frame.

    Attributes:
        points: The demonstrator's, shape (T, m, 3) [m].
        arm: The demonstrator's arm from the base point, where the recording has one, to the hand, shape (T, k, 3) [m].
        places: Those of the arm that belong to them, shape (T, m, 3) [m].
        tip: The end-effector, shape (T, 3) [m].
        distance: From points to places, shape (T, m) [m].
    """

    points: Array
    arm: Array
    places: Array
    tip: Array
    distance: Array


def motion_of(run: Result) -> Motion:
    """The points of a run and their places on the arm."""
    path = run.evaluation.path
    on_arm = places(run.table, path.q, np.c_[path.sigma, np.ones(len(path.q))])
    return Motion(run.problem.task.P, run.problem.task.arm, on_arm[:, :-1], on_arm[:, -1], path.distance)


def limb_radii(count: int) -> Array:
    """Radii of the segments of a person's arm from the shoulder on, shape (count,) [m]."""
    return np.linspace(*LIMBS, count)


def draw_demonstrator(node: Any, motion: Motion, chosen: Indices) -> list[Track]:  # noqa: ANN401
    """Draw the points as balls, and the demonstrator's arm as limbs from point to point, rounded where they meet.

    Args:
        node: A ``meshcat.Visualizer``; the base frame is that of the node.
        motion: All frames.
        chosen: The keyframes.

    Returns:
        How they move over the keyframes.
    """
    points, ends = motion.points[chosen], motion.arm[chosen]
    tracks: list[Track] = []
    for i in range(points.shape[1]):
        ball = node[f"point_{i + 1}"]
        ball.set_object(mg.Sphere(POINT), material(DEMONSTRATOR))
        tracks.append(position_track(ball.path.lower(), points[:, i]))
    radii = limb_radii(ends.shape[1] - 1).tolist()
    for i in range(len(radii)):
        segment = node[f"segment_{i + 1}"]
        segment.set_object(rod(radii[i]), material(DEMONSTRATOR, FLESH))
        tracks += rod_tracks(segment.path.lower(), ends[:, i], ends[:, i + 1])
        bend = node[f"bend_{i + 1}"]
        bend.set_object(mg.Sphere(radii[i]), material(DEMONSTRATOR, FLESH))
        tracks.append(position_track(bend.path.lower(), ends[:, i]))
    return tracks


def draw_errors(node: Any, motion: Motion, chosen: Indices, scale: Scale) -> list[Track]:  # noqa: ANN401
    """Draw a ball at each point's place on the arm and a rod to it, coloured by their distance, on top of the arm.

    Args:
        node: A ``meshcat.Visualizer``.
        motion: All frames.
        chosen: The keyframes.
        scale: Colours of distances.

    Returns:
        How they move and change colour over the keyframes.
    """
    tracks: list[Track] = []
    for i in range(motion.points.shape[1]):
        point, place = motion.points[chosen, i], motion.places[chosen, i]
        colours = scale.rgb(motion.distance[chosen, i])
        ball, bar = node[f"place_{i + 1}"], node[f"distance_{i + 1}"]
        for part, shape in ((ball, mg.Sphere(PLACE)), (bar, rod(ERROR))):
            part.set_object(OnTop(shape, material(VIRIDIS[0], on_top=True)))
            tracks.append(Track(f"{part.path.lower()}/<object>", ".material.color", "color", colours))
        tracks.append(position_track(ball.path.lower(), place))
        tracks += rod_tracks(bar.path.lower(), point, place)
    return tracks


def draw_traces(node: Any, motion: Motion, most: int) -> None:  # noqa: ANN401 (a meshcat.Visualizer)
    """Draw where the hand and the end-effector go, by ``most`` points each at the most."""
    every = np.unique(np.linspace(0, len(motion.points) - 1, most).astype(int))
    for name, path, colour in (("hand", motion.points[:, -1], DEMONSTRATOR), ("end_effector", motion.tip, ARM)):
        shape = trace(path[every], TRACE)
        if shape is not None:
            node[name].set_object(shape, material(colour))


def draw_orientations(node: Any, run: Result, motion: Motion, chosen: Indices) -> list[Track]:  # noqa: ANN401
    """Draw the frames of the hand and, at the end-effector, of the mount that follows it; none without orientation.

    Returns:
        How they turn over the keyframes.
    """
    R = run.problem.task.R
    if R is None:
        return []
    path = run.evaluation.path
    tools = tool_poses(run.table, path.q[chosen])[:, :3, :3] @ path.mount
    tracks: list[Track] = []
    for name, turns, points, size in (
        ("hand_frame", R[chosen], motion.points[:, -1], 0.07),
        ("tool_frame", tools, motion.tip, 0.05),
    ):
        pose = np.tile(np.eye(4), (len(chosen), 1, 1))
        pose[:, :3, :3], pose[:, :3, 3] = turns, points[chosen]
        draw_frame(node[name], size, size / 25.0, on_top=True)
        tracks += pose_tracks(node[name].path.lower(), pose)
    return tracks
