"""The task that a robot arm has to do: paths of points on a human arm from the base on, and the hand's turns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.demonstration.cleaning.cleaning import clean, crop
from armdesign.demonstration.files.quaternions import rotation_matrices
from armdesign.demonstration.findings import (
    base_steps,
    check_arm_length,
    points_step,
    recording_step,
    sanity_steps,
    side_steps,
    task_step,
)
from armdesign.demonstration.points.selection import CARRIER, ORIGIN, Selection, resolve
from armdesign.demonstration.points.standard import is_mirrored
from armdesign.demonstration.recording import MIN_FRAMES, Recording, Step, first_bad_step, median_step, path_lines
from armdesign.errors import TaskError
from armdesign.kinematics.line_drawing import Line, drawing, shown
from armdesign.settings.sections import Task as TaskSettings

_UNIT = 1e-3  # norms of quaternions may differ from 1 by a few printed digits


@dataclass(frozen=True, eq=False, repr=False)
class Task:
    """Paths of m points on an arm, from the shoulder to the hand, in a frame at the base.

    Attributes:
        time: Frame times, shape (T,) [s].
        P: Positions relative to the base, shape (T, m, 3) [m]; the last point is the hand.
        R: Orientation of the hand or tool, shape (T, 3, 3), or None; always that of ``quaternions``.
        quaternions: The same as unit quaternions x, y, z, w, shape (T, 4), or None.
        points: Names of the m points.
        base: Name of the base point.
        steps: What was found and done on the way here.
        orientation: Name of the point that gave the orientation, by default the last; None without quaternions.
        origin: Where the frame's origin is in the room, whose axes it has, shape (3,) [m]; None for a frame that moves
            with the base point.
        shoulder: The base point's own path in the frame, shape (T, 3) [m], where it is not always the origin and is
            of interest.
        bodies: Poses in the room of recorded bodies that carry something, by name, shape (T, 4, 4) each [m].
    """

    time: Array
    P: Array
    R: Array | None
    quaternions: Array | None
    points: tuple[str, ...]
    base: str
    steps: tuple[Step, ...] = ()
    orientation: str | None = None
    origin: Array | None = None
    shoulder: Array | None = None
    bodies: Mapping[str, Array] = field(default_factory=dict)

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
        if self.shoulder is not None:
            self._freeze("shoulder", self.shoulder, (3,))
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

    def __repr__(self) -> str:
        turn = f", orientation of {self.orientation}" if self.orientation else ""
        size = f"{len(self.time)} frames, {1.0 / self.dt:.4g} Hz"
        return f"Task: {size}, {', '.join(self.points)} from {self.base}{turn}"

    def _repr_html_(self) -> str:
        return shown(repr(self), drawing(task_lines(self)))

    @property
    def arm(self) -> Array:
        """The demonstrator's arm from the base point to the hand, shape (T, m + 1, 3) [m].

        Without a base point its points alone, shape (T, m, 3).
        """
        if self.shoulder is not None:
            return np.concatenate([self.shoulder[:, None], self.P], axis=1)
        return self.P if self.base == ORIGIN else np.pad(self.P, ((0, 0), (1, 0), (0, 0)))

    @property
    def notes(self) -> tuple[str, ...]:
        """The sentences of the steps."""
        return tuple(step.sentence for step in self.steps)

    @property
    def dt(self) -> float:
        """Median time from frame to frame [s]."""
        return median_step(self.time)

    def thinned(self, frames: NDArray[np.intp]) -> Task:
        """The same task on some of its frames, by their numbers."""
        R, quaternions, shoulder = (
            None if rows is None else rows[frames] for rows in (self.R, self.quaternions, self.shoulder)
        )
        bodies = {name: poses[frames] for name, poses in self.bodies.items()}
        return replace(
            self, time=self.time[frames], P=self.P[frames], R=R, quaternions=quaternions, shoulder=shoulder,
            bodies=bodies,
        )  # fmt: skip

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


def build_task(recording: Recording, settings: TaskSettings | None = None) -> Task:
    """Make a task of a recording: choose the points, clean them, then subtract the base.

    Only the points that the task uses are looked at. The frames keep the recording's times. Captured recordings are
    cleaned by default, finished ones are taken as they are.

    Args:
        recording: The recording, z up.
        settings: Which points, and how to clean them; files, units and up axis are those of the recording already.

    Returns:
        The task; its steps say what was found and done.

    Raises:
        TaskError: A name is unknown, a point is used twice or never seen, or the arm has no human size.
        RecordingError: A gap is too long, or a quaternion is zero.
        SettingsError: A number is out of range.
    """
    how = settings or TaskSettings()
    return task_of_selection(resolve(recording, how.base, how.points, how.orientation), how)


def task_of_selection(
    selection: Selection, settings: TaskSettings, *, in_room: bool = False, keep_base: bool = False
) -> Task:
    """Make a task of points selected from a recording.

    Args:
        selection: The points, from ``resolve``.
        settings: How to clean them, and ``base_mode``: each frame minus the base in that frame, or minus its mean.
        in_room: Whether the task stays in the room, and nothing is subtracted, since the base has a place of its own.
        keep_base: Whether the base point's own path is kept with ``base_mode`` fixed, too.
    """
    base, names = selection.base, selection.points
    cleaned, steps = cleaned_points(selection, settings)
    bodies = {name: np.tile(np.eye(4), (len(cleaned.time), 1, 1)) for name in selection.carriers}
    for name, poses in bodies.items():
        poses[:, :3, :3] = rotation_matrices(cleaned.orientations[CARRIER + name])
        poses[:, :3, 3] = cleaned.points[CARRIER + name]
    places = np.stack([cleaned.points[name] for name in names], axis=1)
    turn = selection.orientation
    quaternions = None if turn is None else cleaned.orientations[turn]
    path = cleaned.points.get(base)
    if path is None:  # no base point: the points are where they are
        steps = (*steps, task_step(cleaned))
        return Task(cleaned.time, places, None, quaternions, names, base, steps, turn, np.zeros(3), bodies=bodies)
    origin = path if settings.base_mode == "shoulder" else path.mean(axis=0, keepdims=True)
    length = check_arm_length(places - path[:, None], cleaned.source, settings.scale)
    if in_room:
        steps = (*steps, task_step(cleaned, length))
        return Task(cleaned.time, places, None, quaternions, names, base, steps, turn, np.zeros(3), path, bodies)
    steps = (*steps, *base_steps(path, base, settings.base_mode), task_step(cleaned, length))
    fixed = origin[0] if settings.base_mode == "fixed" else None
    own = path - origin if keep_base and fixed is not None else None
    seen = places - origin[:, None]
    return Task(cleaned.time, seen, None, quaternions, names, base, steps, turn, fixed, own, bodies)


def cleaned_points(selection: Selection, settings: TaskSettings) -> tuple[Recording, tuple[Step, ...]]:
    """The points selected from a recording, cleaned but still in the room, with everything found and done so far.

    Args:
        selection: The points, from ``resolve``.
        settings: How to clean them.
    """
    recording, base, names = selection.recording, selection.base, selection.points
    # First of all the size: one that no arm has mostly means another unit, and cleaning would fail for other reasons.
    part, _ = crop(recording, settings.start, settings.stop)
    scale, chain = settings.scale, [base, *names] if base in recording.points else [*names]
    places = np.stack([part.points[name] for name in chain], axis=1)
    if len(chain) > 1:
        check_arm_length(scale * (places[:, 1:] - places[:, :1]), recording.source, scale)
    cleaned, done = clean(recording, settings)
    steps = (
        recording_step(recording),
        *recording.about.steps,
        *selection.steps,
        points_step(base, names, selection.orientation, selection.expressions),
        *side_steps(selection.expressions.values(), is_mirrored(recording)),
        *done,
        *(sanity_steps(cleaned, chain[0], chain[1:]) if len(chain) > 1 else ()),
    )
    return cleaned, steps


def task_lines(task: Task) -> list[Line]:
    """The paths of a task as lines to draw."""
    return path_lines({name: task.P[:, i] for i, name in enumerate(task.points)})


def task_recording(task: Task) -> Recording:
    """The task in the form of a recording: each point relative to the base, and the orientation where there is one.

    A base point that is not the origin comes first. ``task_from_recording`` gives time, P, quaternions and R back to
    the last bit, also through a plain CSV file.
    """
    points = {} if task.shoulder is None else {task.base: task.shoulder}
    points |= {name: task.P[:, i] for i, name in enumerate(task.points)}
    turns = {task.orientation: task.quaternions} if task.orientation and task.quaternions is not None else {}
    return Recording(task.time, points, turns, "task")


def task_from_recording(
    recording: Recording, base: str = "base", *, origin: ArrayLike | None = None, shoulder: bool = False
) -> Task:
    """Take a recording as a task, all its points being relative to the base already.

    Args:
        recording: Without gaps; with one orientation at most, of unit quaternions.
        base: What to call the base.
        origin: Where the points count from in the room, shape (3,) [m]; None where that moves.
        shoulder: Whether the first point is the base's own path.

    Raises:
        TaskError: There is no point, a value is missing, or there is more than one orientation.
    """
    if not recording.points:
        raise TaskError(f"{recording.source}: a task needs a point, but there are orientations only")
    names = list(recording.orientations)
    if len(names) > 1:
        message = f"{recording.source}: a task has one orientation at most, here are {len(names)}"
        raise TaskError(message, value=names, fix=f"Keep one of {', '.join(names)}")
    for name, values in (*recording.points.items(), *recording.orientations.items()):
        missing = np.flatnonzero(np.isnan(values[:, 0]))
        if len(missing):
            message = f"{recording.source}: '{name}' is missing in frame {missing[0] + 1}"
            raise TaskError(message, value=name, fix="A task has no gaps; build it from the recording again")
    series = list(recording.points.values())
    first = 1 if shoulder else 0
    P, points = np.stack(series[first:], axis=1), tuple(recording.points)[first:]
    orientation = names[0] if names else None
    quaternions = recording.orientations[orientation] if orientation else None
    where = None if origin is None else np.array(origin, dtype=float)
    path = series[0] if shoulder else None
    return Task(recording.time, P, None, quaternions, points, base, (), orientation, where, path)
