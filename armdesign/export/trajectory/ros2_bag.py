"""A joint trajectory as a ROS 2 bag, without ROS: a stream of joint states, and the whole trajectory as one message.

Everything here needs the extra ``ros``. The bag is an SQLite one in the form of ROS 2 Iron, which newer ROS reads too.
"""

from __future__ import annotations

import secrets
import shutil
import sqlite3
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from armdesign.errors import MissingExtraError, RunFolderError
from armdesign.export.trajectory.scaling import Motion
from armdesign.export.trajectory.trajectory_files import CONTROLLER, FRAME_ID, joint_names, seconds_nanoseconds

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

NAME = "joint_trajectory_bag"
"""Name of the bag's storage."""
STATES_TOPIC = "/joint_states"
STATES = "sensor_msgs/msg/JointState"
TRAJECTORY_TOPIC = f"/{CONTROLLER}/joint_trajectory"
TRAJECTORY = "trajectory_msgs/msg/JointTrajectory"
START = 1.0
"""Stamp of the first message [s]; in ROS a stamp of 0 means the latest time."""


def write_bag(folder: Path, motion: Motion, *, overwrite: bool = False) -> None:
    """Write a motion as a bag: its folder is there whole or not at all.

    Args:
        folder: The bag, which is a folder.
        motion: The motion.
        overwrite: Replace a bag that is there.

    Raises:
        MissingExtraError: rosbags is not installed.
        RunFolderError: The bag cannot be written, or something is there already.
    """
    store = typestore()
    _check_place(folder, overwrite)
    aside = folder.with_name(f".{secrets.token_hex(8)}.tmp")
    try:
        with tempfile.TemporaryDirectory() as elsewhere:  # rosbags cannot write where a path holds #, ? or %
            _write_messages(Path(elsewhere) / NAME, motion, store)
            shutil.copytree(Path(elsewhere) / NAME, aside / "new")
        if folder.exists():
            folder.rename(aside / "old")
        (aside / "new").rename(folder)
    except _storage_errors() as error:
        why = getattr(error, "strerror", None) or str(error)
        raise RunFolderError(f"cannot write {folder}: {why}", value=str(folder), fix="Choose another place") from error
    finally:
        if (aside / "old").exists() and not folder.exists():
            (aside / "old").rename(folder)
        shutil.rmtree(aside, ignore_errors=True)


def typestore() -> Typestore:
    """The message types of ROS 2 Humble; those used here are the same in every later one.

    Raises:
        MissingExtraError: rosbags is not installed.
    """
    try:
        from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415, an extra
    except ImportError as error:
        raise MissingExtraError(
            "a ROS 2 bag needs rosbags, which is not installed", fix="Run: pip install 'armdesign[ros]'"
        ) from error
    return get_typestore(Stores.ROS2_HUMBLE)


def _storage_errors() -> tuple[type[Exception], ...]:
    """What a full disk and the like raise: rosbags writes by one of two SQLite libraries."""
    try:
        import apsw  # noqa: PLC0415, comes with newer rosbags
    except ImportError:
        return (OSError, sqlite3.Error)
    return (OSError, sqlite3.Error, apsw.Error)


def _check_place(folder: Path, overwrite: bool) -> None:
    """Refuse to replace what is not a bag, or a bag without being asked to."""
    is_bag = (folder / "metadata.yaml").is_file()
    if folder.exists() and not is_bag:
        raise RunFolderError(f"{folder} is there and is no ROS 2 bag", value=str(folder), fix="Choose another place")
    if is_bag and not overwrite:
        fix = "Add --overwrite, or choose another place"
        raise RunFolderError(f"there is a bag {folder} already", value=str(folder), fix=fix)


def _write_messages(folder: Path, motion: Motion, store: Typestore) -> None:
    """Write the bag of a motion."""
    from rosbags.rosbag2 import Writer  # noqa: PLC0415, an extra

    with Writer(folder, version=8) as writer:
        states = writer.add_connection(STATES_TOPIC, STATES, typestore=store)
        whole = writer.add_connection(TRAJECTORY_TOPIC, TRAJECTORY, typestore=store)
        message = trajectory_message(motion, store)
        writer.write(whole, _stamp(0.0), store.serialize_cdr(message, TRAJECTORY))
        for k, t in enumerate(motion.time.tolist()):
            state = state_message(motion, k, store)
            writer.write(states, _stamp(t), store.serialize_cdr(state, STATES))


def state_message(motion: Motion, k: int, store: Typestore) -> Any:  # noqa: ANN401 (made at run time)
    """The ``sensor_msgs/msg/JointState`` of sample k, without efforts."""
    names = list(joint_names(motion.q.shape[1]))
    header = _header(START + float(motion.time[k]), store)
    return store.types[STATES](header=header, name=names, position=motion.q[k], velocity=motion.v[k], effort=_NONE)


def trajectory_message(motion: Motion, store: Typestore) -> Any:  # noqa: ANN401 (made at run time)
    """The ``trajectory_msgs/msg/JointTrajectory`` of a motion, stamped 0: to begin at once."""
    point, duration = store.types[f"{TRAJECTORY}Point"], store.types["builtin_interfaces/msg/Duration"]
    points = []
    for t, q, v, a in zip(motion.time.tolist(), motion.q, motion.v, motion.a, strict=True):
        sec, nanosec = seconds_nanoseconds(t)
        after = duration(sec=sec, nanosec=nanosec)
        points.append(point(positions=q, velocities=v, accelerations=a, effort=_NONE, time_from_start=after))
    names = list(joint_names(motion.q.shape[1]))
    return store.types[TRAJECTORY](header=_header(0.0, store), joint_names=names, points=points)


_NONE = np.zeros(0)


def _header(time: float, store: Typestore) -> Any:  # noqa: ANN401 (made at run time)
    """A header stamped with a time [s]."""
    sec, nanosec = seconds_nanoseconds(time)
    stamp = store.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
    return store.types["std_msgs/msg/Header"](stamp=stamp, frame_id=FRAME_ID)


def _stamp(time: float) -> int:
    """The stamp of a message at a time of the motion [ns]."""
    sec, nanosec = seconds_nanoseconds(START + time)
    return sec * 1_000_000_000 + nanosec
