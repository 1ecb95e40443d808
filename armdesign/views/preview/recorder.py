"""MeshCat without its server: the drawing commands and the poses of an animation are kept instead of sent.

MeshCat's own server listens on every interface. Here a ``meshcat.Visualizer`` gets a window that only keeps its
commands, and the page plays them back.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import umsgpack

from armdesign._types import Array
from armdesign.demonstration.files.quaternions import from_matrices, unit_continuous

Command = dict[str, Any]
FLOAT32 = 0x17
"""Code of a Float32Array in MeshCat's messages."""
STILL = 1e-12
"""A pose that changes by less than this does not move."""


class Window:
    """What a ``meshcat.Visualizer`` sends its commands to.

    Attributes:
        commands: All of them so far, as MeshCat lays them out.
    """

    def __init__(self) -> None:
        """Nothing drawn yet."""
        self.commands: list[Command] = []

    def send(self, command: Any) -> None:  # noqa: ANN401 (any of meshcat.commands)
        """Keep a command."""
        self.commands.append(command.lower())


@dataclass(frozen=True, eq=False)
class Track:
    """A property of a node over the keyframes.

    Attributes:
        path: The node.
        name: The property as three.js calls it, such as ``.position``.
        kind: Its type: vector3, quaternion or color.
        values: Shape (K, 3), or (K, 4) for quaternions x, y, z, w.
    """

    path: str
    name: str
    kind: str
    values: Array


def pose_tracks(path: str, poses: Array) -> list[Track]:
    """Position and rotation of a node over the keyframes; none for a node that does not move.

    Args:
        path: The node.
        poses: Shape (K, 4, 4), rigid.
    """
    if np.ptp(poses, axis=0).max() < STILL:
        return []
    turns = Track(path, ".quaternion", "quaternion", unit_continuous(from_matrices(poses[:, :3, :3])))
    return [position_track(path, poses[:, :3, 3]), turns]


def position_track(path: str, points: Array) -> Track:
    """Where a node is over the keyframes, points of shape (K, 3) [m]."""
    return Track(path, ".position", "vector3", points)


def animation(parts: Sequence[tuple[Array, Sequence[Track]]], duration: float) -> Command:
    """MeshCat's command that loads an animation; it is played again and again once started.

    Args:
        parts: Keyframe times, shape (K,) [s], with the tracks that have these keyframes.
        duration: How long all of it lasts [s]; what ends sooner waits for the end.
    """
    clips = []
    for times, tracks in parts:
        stamps = packed(times)
        by_node: dict[str, list[Command]] = defaultdict(list)
        for track in tracks:
            entry = {"name": track.name, "type": track.kind, "times": stamps, "values": packed(track.values)}
            by_node[track.path].append(entry)
        for path, entries in by_node.items():
            clips.append({"path": path, "clip": {"fps": 1, "name": "task", "duration": duration, "tracks": entries}})
    options = {"play": False, "repetitions": float("inf")}
    return {"type": "set_animation", "animations": clips, "options": options, "path": ""}


def packed(values: Array) -> Any:  # noqa: ANN401 (a umsgpack.Ext)
    """Numbers as a Float32Array, row by row."""
    return umsgpack.Ext(FLOAT32, np.ascontiguousarray(values, dtype="<f4").tobytes())
