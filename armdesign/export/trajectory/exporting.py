"""The trajectory of a finished run as a file: smoothed, timed, written, with sentences on what that changed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import RunFolderError, SettingsError, counted
from armdesign.export.trajectory.ros2_bag import write_bag
from armdesign.export.trajectory.scaling import (
    MAX_ACCELERATION,
    MAX_SLIDE_ACCELERATION,
    RAMP,
    SPEED_RANGE,
    Motion,
    Timing,
    fastest_speed,
    sample,
    timing_of,
)
from armdesign.export.trajectory.tool_poses import ToolDeviation, tool_deviation
from armdesign.export.trajectory.trajectory_files import csv_text, npz_bytes, ros_yaml
from armdesign.feasibility.needs import SLIDING, TURNING, joint_needs
from armdesign.files import write_whole
from armdesign.kinematics.motion import CUTOFF, SmoothPath, fit_path
from armdesign.search.result import Result

FILES = {
    "csv": "joint_trajectory.csv",
    "ros": "joint_trajectory.yaml",
    "ros2-bag": "joint_trajectory_bag",
    "npz": "joint_trajectory.npz",
}
"""Kinds of trajectory, and what each is called in a folder; the bag is a folder itself."""


@dataclass(frozen=True)
class TrajectoryOptions:
    """How a demonstrated motion becomes a trajectory for a robot.

    Attributes:
        rate: Samples per second [1/s]; None for the demonstration's frame rate.
        speed: Factor on the demonstrated speed.
        fit_limits: Slow down as far as the two limits below ask for, never speed up.
        max_velocity: Velocity limits, shape (n,) [rad/s; m/s], or one of all joints that turn; by default pi, and 0.5
            of joints that slide.
        max_acceleration: Acceleration limits, likewise [rad/s^2; m/s^2]; by default 10, and 5 of joints that slide.
        cutoff: Frequency of the motion that smoothing keeps by half [Hz].
        ramp: Length of the ramps from and to rest [s of the demonstration]; 0 for none.
    """

    rate: float | None = None
    speed: float = 1.0
    fit_limits: bool = False
    max_velocity: ArrayLike = TURNING
    max_acceleration: ArrayLike = MAX_ACCELERATION
    cutoff: float = CUTOFF
    ramp: float = RAMP


@dataclass(frozen=True, eq=False)
class Trajectory:
    """The trajectory of a run, ready to be written.

    Attributes:
        path: The smooth path.
        timing: When the arm is where on it.
        motion: Its samples.
        deviation: How far smoothing moved the end-effector.
        notes: What smoothing and timing did, one sentence each.
    """

    path: SmoothPath
    timing: Timing
    motion: Motion
    deviation: ToolDeviation
    notes: tuple[str, ...]


def timed_path(run: Result, options: TrajectoryOptions) -> tuple[SmoothPath, Timing, tuple[str, ...]]:
    """The smooth joint path of a run, when the arm is where on it, and what was slowed down.

    Args:
        run: The run.
        options: How it is smoothed and timed.

    Raises:
        SettingsError: A number is out of range.
    """
    path = fit_path(run.problem.task.time, run.evaluation.path.q, run.limits, cutoff=options.cutoff)
    timing = timing_of(path, speed=options.speed, ramp=options.ramp)
    if not options.fit_limits:
        return path, timing, ()
    timing, note = slowed(path, timing, options, run.table.prismatic)
    return path, timing, (note,)


def make_trajectory(run: Result, options: TrajectoryOptions | None = None) -> Trajectory:
    """Smooth the joint path of a run, time it and sample it.

    Args:
        run: The run.
        options: How.

    Raises:
        SettingsError: A number is out of range.
    """
    chosen = options or TrajectoryOptions()
    q, task = run.evaluation.path.q, run.problem.task
    path, timing, slower = timed_path(run, chosen)
    deviation = tool_deviation(run.table, q, path)
    notes = [*pace_notes(run, timing), *smoothing_notes(path, deviation, run.table.prismatic), *slower]
    motion = sample(path, timing, 1.0 / task.dt if chosen.rate is None else chosen.rate)
    return Trajectory(path, timing, motion, deviation, (*notes, *timing_notes(timing, motion, run.table.prismatic)))


def write_trajectory(trajectory: Trajectory, kind: str, place: Path, *, overwrite: bool = False) -> None:
    """Write a trajectory.

    Args:
        trajectory: The trajectory.
        kind: One of ``FILES``.
        place: The file, or the bag's folder.
        overwrite: Replace a bag that is there.

    Raises:
        RunFolderError: It cannot be written to.
        MissingExtraError: A bag was asked for, and rosbags is not installed.
    """
    if kind == "ros2-bag":
        write_bag(place, trajectory.motion, overwrite=overwrite)
    else:
        writers: dict[str, Callable[[Motion], str | bytes]] = {"csv": csv_text, "ros": ros_yaml, "npz": npz_bytes}
        write_whole(place, writers[kind](trajectory.motion))


def place_for(kind: str, folder: Path, *, overwrite: bool = False) -> Path:
    """Where a kind of trajectory goes.

    Raises:
        RunFolderError: There is something already, without ``overwrite``.
    """
    place = folder / FILES[kind]
    if place.exists() and not overwrite:
        fix = "Add --overwrite, or choose another place"
        raise RunFolderError(f"{place} is there already", value=str(place), fix=fix)
    return place


def pace_notes(run: Result, timing: Timing) -> list[str]:
    """That the motion is faster than the arm's joints can move it, if it is.

    Args:
        run: The run; beyond the demonstrated speed, which its verdict is about, speeds alone are looked at.
        timing: When the arm is where on the path.
    """
    most = run.verdict.speed_fraction
    if most == 1.0:
        with np.errstate(divide="ignore"):  # joints that stand still
            most = float((joint_needs(run.problem.settings).actuator_speed / run.verdict.peak_speed).min())
    if timing.speed <= most:
        return []
    share = np.floor(100.0 * most) / 100.0
    kept = f"up to {share:g} times (--speed {share:g})" if share >= SPEED_RANGE[0] else "at no speed"
    return [f"At {timing.speed:.4g} times the demonstrated speed joints pass their limits; they are kept {kept}."]


def smoothing_notes(path: SmoothPath, deviation: ToolDeviation, prismatic: Sequence[bool]) -> list[str]:
    """What the fit changed.

    Args:
        path: The path.
        deviation: How far smoothing moved the end-effector.
        prismatic: Which joints slide, n of them.
    """
    distance = deviation.distance * 1e3
    changes = largest(path.deviation, prismatic, ("{:.2f} deg", "{:.2f} mm"), (np.degrees(1.0), 1e3))
    notes = [
        f"Smoothed at a cutoff of {path.cutoff:g} Hz: {'joints' if any(prismatic) else 'joint angles'} change by up to "
        f"{changes}, the end-effector by up to {distance.max():.2f} mm "
        f"(mean {distance.mean():.2f} mm) and {np.degrees(deviation.angle.max()):.2f} deg."
    ]
    if path.bounded:
        joints = ", ".join(f"joint_{joint + 1}" for joint in path.bounded)
        notes.append(f"The fit was held inside the limits of {joints}.")
    return notes


def largest(values: Array, prismatic: Sequence[bool], words: tuple[str, str], units: tuple[float, float]) -> str:
    """The largest of the joints' values, of those that turn and of those that slide, in words.

    Args:
        values: Shape (n,), none negative.
        prismatic: Which joints slide, n of them.
        words: Format of a value of joints that turn, and of joints that slide.
        units: What each is multiplied by before.
    """
    slides = np.array(prismatic, dtype=bool)
    kinds = [(values[~slides] * units[0], words[0]), (values[slides] * units[1], words[1])]
    return " and ".join(form.format(float(found.max())) for found, form in kinds if len(found))


def timing_notes(timing: Timing, motion: Motion, prismatic: Sequence[bool]) -> list[str]:
    """How long the motion takes, and how fast the joints go.

    Args:
        timing: When the arm is where on the path.
        motion: The motion.
        prismatic: Which joints slide, n of them.
    """
    ramps = f", at rest at both ends by ramps of {timing.ramp / timing.speed:.3g} s" if timing.ramp > 0.0 else ""
    v, a = np.abs(motion.v).max(axis=0), np.abs(motion.a).max(axis=0)
    speed = largest(v, prismatic, ("{:.0f} deg/s", "{:.2f} m/s"), (np.degrees(1.0), 1.0))
    acceleration = largest(a, prismatic, ("{:.1f} rad/s^2", "{:.1f} m/s^2"), (1.0, 1.0))
    duration = f"{timing.total:.3f} s for {timing.duration:.3f} s of demonstration"
    return [
        f"{counted(len(motion.time), 'sample')}: {duration} at {timing.speed:.4g} times the speed{ramps}.",
        f"Peaks: {speed} and {acceleration}.",
    ]


def slowed(
    path: SmoothPath, timing: Timing, options: TrajectoryOptions, prismatic: Sequence[bool]
) -> tuple[Timing, str]:
    """The timing slowed down as far as the joints' limits ask for, and a sentence on what that took.

    Args:
        path: The path.
        timing: When the arm is where on it, as asked for.
        options: The limits.
        prismatic: Which joints slide, n of them.

    Raises:
        SettingsError: The limits would need a speed below the lowest.
    """
    velocity, acceleration = (
        np.where(prismatic, sliding, given) if np.ndim(given) == 0 and any(prismatic) else given
        for given, sliding in (
            (options.max_velocity, SLIDING), (options.max_acceleration, MAX_SLIDE_ACCELERATION)
        )
    )  # fmt: skip
    most, what = fastest_speed(path, ramp=timing.ramp, velocity=velocity, acceleration=acceleration)
    if most >= timing.speed:
        return timing, "The velocity and acceleration limits hold without slowing down."
    if most < SPEED_RANGE[0]:
        raise SettingsError(
            f"the limits would take {most:.2g} times the demonstrated speed", value=most,
            allowed=f"{SPEED_RANGE[0]:g} or more", fix=f"Raise the limit on {what}",
        )  # fmt: skip
    note = f"Slowed down to {most / timing.speed:.4g} of the speed asked for, so that {what} keeps its limit."
    return timing_of(path, speed=most, ramp=timing.ramp), note
