"""The task that a robot arm has to do: paths of points on a human arm from the base on, and the hand's turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.cleaning.cleaning import Cleaning, Off, clean, crop
from armdesign.demonstration.cleaning.cuts import Stretch
from armdesign.demonstration.files.quaternions import rotation_matrices
from armdesign.demonstration.findings import base_steps, check_arm_length, points_step, recording_step, task_step
from armdesign.demonstration.points.selection import Chosen, resolve
from armdesign.demonstration.points.standard import is_mirrored
from armdesign.demonstration.recording import MIN_FRAMES, Recording, Step, first_bad_step, median_step
from armdesign.demonstration.sanity import sanity_steps, side_steps
from armdesign.errors import TaskError

_UNIT = 1e-3  # norms of quaternions may differ from 1 by a few printed digits
BASE_MODES = ("shoulder", "fixed")


@dataclass(frozen=True, eq=False)
class Task:
    """Paths of m points on an arm, from the shoulder to the hand, in a frame that stands at the base.

    Attributes:
        time: Frame times, shape (T,) [s].
        P: Positions relative to the base, shape (T, m, 3) [m]; the last point is the hand.
        R: Orientation of the hand or tool, shape (T, 3, 3), or None; always that of ``quaternions``.
        quaternions: The same as unit quaternions x, y, z, w, shape (T, 4), or None.
        points: Names of the m points.
        base: Name of the base point.
        steps: What was found and done on the way here.
        orientation: Name of the point that gave the orientation, by default the last; None without quaternions.
    """

    time: Array
    P: Array
    R: Array | None
    quaternions: Array | None
    points: tuple[str, ...]
    base: str
    steps: tuple[Step, ...] = ()
    orientation: str | None = None

    def __post_init__(self) -> None:
        """Normalise to read-only arrays, compute R where it is not given, and check everything.

        Raises:
            TaskError: Shapes that do not fit, times that do not increase, missing values, R without quaternions or
                unlike them.
        """
        object.__setattr__(self, "points", tuple(self.points))
        object.__setattr__(self, "steps", tuple(self.steps))
        if not self.points or len(set(self.points)) < len(self.points):
            raise TaskError("a task needs points, each of another name", value=self.points)
        self._freeze("time", self.time, ())
        self._freeze("P", self.P, (len(self.points), 3))
        if len(self.time) < MIN_FRAMES or first_bad_step(self.time) is not None:
            raise TaskError("a task needs three or more frames with increasing times")
        self._settle_orientation()

    def _settle_orientation(self) -> None:
        """Check the quaternions and compute R from them, or see to it that there is nothing of either."""
        if self.quaternions is None:
            if self.R is not None or self.orientation is not None:
                raise TaskError("an orientation needs its quaternions", value=self.orientation)
            return
        self._freeze("quaternions", self.quaternions, (4,))
        if np.abs(np.linalg.norm(self.quaternions, axis=1) - 1.0).max() > _UNIT:
            raise TaskError("the quaternions are not of unit length", fix="Normalise them")
        R = rotation_matrices(self.quaternions)
        if self.R is not None and (np.shape(self.R) != R.shape or np.abs(self.R - R).max() > _UNIT):
            raise TaskError("R and the quaternions are not the same rotations", fix="Give R=None to have it computed")
        self._freeze("R", R, (3, 3))
        object.__setattr__(self, "orientation", self.orientation or self.points[-1])

    @property
    def notes(self) -> tuple[str, ...]:
        """The sentences of the steps."""
        return tuple(step.sentence for step in self.steps)

    @property
    def dt(self) -> float:
        """Median time from frame to frame [s]."""
        return median_step(self.time)

    def _freeze(self, name: str, values: Array, shape: tuple[int, ...]) -> None:
        """Store a read-only copy of shape (T, *shape) without missing values."""
        array = np.array(values, dtype=float, order="C")
        if array.ndim != len(shape) + 1 or array.shape != (np.size(self.time), *shape):
            raise TaskError(f"{name} has shape {array.shape}", allowed=str((np.size(self.time), *shape)))
        if not np.isfinite(array).all():
            frame = int(np.argmin(np.isfinite(array.reshape(len(array), -1)).all(axis=1)))
            raise TaskError(f"{name} holds a missing or infinite value in frame {frame + 1}", value=array[frame])
        array.setflags(write=False)
        object.__setattr__(self, name, array)


def build_task(
    recording: Recording,
    *,
    base: str | None = None,
    points: Sequence[str] = (),
    orientation: str | None = None,
    base_mode: str = "shoulder",
    outliers: bool | None = None,
    max_gap: float = 0.2,
    repeats: bool | None = None,
    low_pass: float | Off | None = None,
    cut: tuple[Stretch, ...] = (),
    start: float | None = None,
    stop: float | None = None,
    rate: float | None = None,
    scale: float = 1.0,
) -> Task:
    """Make a task of a recording: choose the points, clean them, then subtract the base.

    Only the points that the task uses are looked at. The frames keep the recording's times. For the cleaning see
    ``Cleaning``: captured recordings are cleaned by default, finished ones are taken as they are.

    Args:
        recording: The recording, z up.
        base: Point at which the robot stands, the shoulder; see ``resolve``.
        points: Points along the arm from the base to the hand; see ``resolve``.
        orientation: Oriented point whose turns the tool has to follow; None for none.
        base_mode: ``shoulder``: each frame minus the base in that frame; ``fixed``: minus the base's mean.
        outliers: Whether to take out outliers; None: by the recording.
        max_gap: Longest gap to be filled [s].
        repeats: Whether to interpolate repeated frames; None: by the recording.
        low_pass: Cutoff of a zero-phase low-pass [Hz], or ``off``; None: by the recording.
        cut: Stretches to cut out where the hand stands still, as pairs of times [s].
        start: First time wanted [s]; None for the recording's first.
        stop: Last time wanted [s]; None for the recording's last.
        rate: Frames per second to resample to [1/s]; None to keep the frames.
        scale: Factor on all positions.

    Returns:
        The task; its steps say what was found and done.

    Raises:
        TaskError: A name or mode is unknown, a point is used twice or never seen, or the arm has no human size.
        RecordingError: A gap is too long, or a quaternion is zero.
        SettingsError: A number is out of range.
    """
    how = Cleaning(outliers, max_gap, repeats, low_pass, cut, start, stop, rate, scale)
    return task_of_chosen(resolve(recording, base, points, orientation), how, base_mode)


def task_of_chosen(chosen: Chosen, how: Cleaning, base_mode: str = "shoulder") -> Task:
    """Make a task of the points chosen from a recording.

    Args:
        chosen: The points, from ``resolve``.
        how: How to clean them.
        base_mode: ``shoulder``: each frame minus the base in that frame; ``fixed``: minus the base's mean.

    Raises:
        TaskError: The mode is unknown, or the arm has no human size.
        RecordingError: A gap is too long, or a quaternion is zero.
        SettingsError: A number is out of range.
    """
    if base_mode not in BASE_MODES:
        raise TaskError(f"base_mode '{base_mode}' is unknown", value=base_mode, allowed=BASE_MODES)
    base, names = chosen.base, chosen.points
    cleaned, steps = cleaned_points(chosen, how)
    path = cleaned.points[base]
    origin = path if base_mode == "shoulder" else path.mean(axis=0, keepdims=True)
    places = np.stack([cleaned.points[name] for name in names], axis=1)
    length = check_arm_length(places - path[:, None], cleaned.source, how.scale)
    steps = (*steps, *base_steps(path, base, base_mode), task_step(cleaned, length))
    quaternions = None if chosen.orientation is None else cleaned.orientations[chosen.orientation]
    return Task(cleaned.time, places - origin[:, None], None, quaternions, names, base, steps, chosen.orientation)


def cleaned_points(chosen: Chosen, how: Cleaning) -> tuple[Recording, tuple[Step, ...]]:
    """The points chosen from a recording, cleaned but still in the room, with everything found and done so far.

    Raises:
        TaskError: The arm has no human size.
        RecordingError: A gap is too long, or a quaternion is zero.
        SettingsError: A number is out of range.
    """
    recording, base, names = chosen.recording, chosen.base, chosen.points
    part, _ = crop(recording, how.start, how.stop)
    places = np.stack([part.points[name] for name in names], axis=1)
    check_arm_length(how.scale * (places - part.points[base][:, None]), recording.source, how.scale)
    cleaned, done = clean(recording, how)
    steps = (
        recording_step(recording),
        *recording.about.steps,
        *chosen.steps,
        points_step(base, names, chosen.orientation, chosen.expressions),
        *side_steps(chosen.expressions.values(), is_mirrored(recording)),
        *done,
        *sanity_steps(cleaned, base, names),
    )
    return cleaned, steps


def task_recording(task: Task) -> Recording:
    """The task in the form of a recording: each point relative to the base, and the orientation where there is one.

    ``task_from_recording`` gives time, P, quaternions and R back to the last bit, also through a plain CSV file.
    """
    points = {name: task.P[:, i] for i, name in enumerate(task.points)}
    turns = {task.orientation: task.quaternions} if task.orientation and task.quaternions is not None else {}
    return Recording(task.time, points, turns, "task")


def task_from_recording(recording: Recording, base: str = "base") -> Task:
    """Take a recording as a task, all its points being relative to the base already.

    Args:
        recording: Without gaps; with one orientation at most, of unit quaternions.
        base: What to call the base.

    Raises:
        TaskError: There is no point, a value is missing, or there is more than one orientation.
    """
    if not recording.points:
        raise TaskError(f"{recording.source}: a task needs a point, but there are orientations only")
    names = list(recording.orientations)
    if len(names) > 1:
        message = f"{recording.source}: a task has one orientation at most, here are {len(names)}"
        raise TaskError(message, value=names, fix=f"Keep one of {', '.join(names)}")
    for name, series in (*recording.points.items(), *recording.orientations.items()):
        missing = np.flatnonzero(np.isnan(series[:, 0]))
        if len(missing):
            message = f"{recording.source}: '{name}' is missing in frame {missing[0] + 1}"
            raise TaskError(message, value=name, fix="A task has no gaps; build it from the recording again")
    P = np.stack(list(recording.points.values()), axis=1)
    orientation = names[0] if names else None
    quaternions = recording.orientations[orientation] if orientation else None
    return Task(recording.time, P, None, quaternions, tuple(recording.points), base, (), orientation)
