"""File formats of motion recordings, recognised by their content.

A new format is one module here with a test of the first bytes and a reader, and one entry in ``FORMATS``; or such a
module in another package that names it as an entry point, see ``armdesign.plugins``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from armdesign import plugins
from armdesign.demonstration.files import plain_csv
from armdesign.demonstration.files.formats import (
    body_json,
    bone_csv,
    bvh,
    c3d,
    coco_json,
    freemocap,
    long_csv,
    mediapipe,
    motive_csv,
    mvnx,
    npz,
    openpose,
    opensim_storage,
    qualisys_skeleton,
    qualisys_tsv,
    rokoko,
    ros_bag,
    tracker_csv,
    trc,
    vicon_csv,
)
from armdesign.demonstration.points.standard import AXES
from armdesign.demonstration.recording import TIME_UNITS, Take


class Format(NamedTuple):
    """One format.

    Attributes:
        name: What the format is called in messages.
        matches: Whether a file beginning with these bytes (``HEAD_SIZE`` of them at most) has the format.
        read: Reads such a file; what is wrong in it is a RecordingError that says what and where.
        holds: Which versions or contents are read, in words; empty where the name says it.
    """

    name: str
    matches: Callable[[bytes], bool]
    read: Callable[[Path], Take]
    holds: str = ""


FORMATS: tuple[Format, ...] = (
    Format("C3D", c3d.matches, c3d.read),
    Format("OptiTrack Motive CSV", motive_csv.matches, motive_csv.read, "1.21 to 1.25"),
    Format("BVH", bvh.matches, bvh.read),
    Format("Xsens MVNX", mvnx.matches, mvnx.read),
    Format("TRC", trc.matches, trc.read, "OpenSim, Cortex, Pose2Sim, Sports2D"),
    Format("Vicon", vicon_csv.matches, vicon_csv.read, "CSV: trajectories and segments of Nexus, objects of Tracker"),
    Format("Qualisys skeleton TSV", qualisys_skeleton.matches, qualisys_skeleton.read),
    Format("Qualisys TSV", qualisys_tsv.matches, qualisys_tsv.read, "3D, 6D"),
    Format("OpenSim storage", opensim_storage.matches, opensim_storage.read, "STO, MOT of places"),
    Format("NumPy NPZ", npz.matches, npz.read, "positions (T, J, 3), NPY"),
    Format("ROS bag", ros_bag.matches, ros_bag.read, "ROS 1 and 2, MCAP; poses, tf, markers"),
    Format("MediaPipe landmarks", mediapipe.matches, mediapipe.read, "CSV, JSON; in metres"),
    Format("OpenPose JSON", openpose.matches, openpose.read, "3D, a file a frame"),
    Format("body tracking JSON", body_json.matches, body_json.read, "ZED, Azure Kinect"),
    Format("COCO keypoints JSON", coco_json.matches, coco_json.read, "Halpe, MMPose; 3D"),
    Format("FreeMoCap CSV", freemocap.matches, freemocap.read),
    Format("Rokoko CSV", rokoko.matches, rokoko.read),
    Format("bone CSV", bone_csv.matches, bone_csv.read, "a file per bone"),
    Format("long CSV", long_csv.matches, long_csv.read, "a line per frame and point"),
    Format("tracker CSV", tracker_csv.matches, tracker_csv.read, "Vive, Unity, Nuitrack: a column per number"),
    Format("plain CSV", plain_csv.matches, plain_csv.read),
)
"""Asked in this order; one entry a line."""


def known_formats() -> tuple[Format, ...]:
    """The formats of plug-ins, and behind them those of this package.

    Raises:
        PluginError: A plug-in cannot be loaded.
    """
    return (*(_format_of(plugin) for plugin in plugins.installed(plugins.FORMATS).values()), *FORMATS)


def _format_of(plugin: plugins.Plugin) -> Format:
    """A plug-in as a format: whatever goes wrong in it names its package."""
    matcher, reader = plugin.load(lambda thing: (thing.matches, thing.read))
    return Format(
        plugin.name,
        lambda head: plugin.call(lambda: bool(matcher(head))),
        lambda path: plugin.call(lambda: _checked(reader(path))),
    )


def _checked(take: object) -> Take:
    """What a plug-in has read, with the arrays that a Take has to have.

    Raises:
        TypeError: It is no Take.
        ValueError: Something in it is of another shape or kind than it has to be.
    """
    if not isinstance(take, Take):
        raise TypeError(f"read gives {type(take).__name__}, not armdesign.demonstration.recording.Take")
    for name, allowed in (("up", (None, *AXES)), ("time_unit", (*TIME_UNITS,))):
        if (value := getattr(take, name)) not in allowed:
            raise ValueError(f"read gives {name} = {value!r}; allowed: {', '.join(map(str, allowed))}")
    arrays: dict[str, Any] = {"time": np.asarray(take.time, dtype=float)}
    for name, width in (("points", (3,)), ("orientations", (4,)), ("confidence", ())):
        arrays[name] = {key: np.asarray(value, dtype=float) for key, value in getattr(take, name).items()}
        for key, array in arrays[name].items():
            if array.shape != (shape := (len(arrays["time"]), *width)):
                raise ValueError(f"read gives {name} of {key!r} of shape {array.shape}; allowed: {shape}")
    return replace(take, **arrays)


def listed_formats() -> str:
    """All formats as the README lists them."""
    return ", ".join(f"**{form.name}**{f' ({form.holds})' if form.holds else ''}" for form in FORMATS)
