"""The arm as every robot file tells it: solids, limits and tags, put together once."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.export.fit import fit_body
from armdesign.export.joint_load import TrajectoryLimits, trajectory_limits
from armdesign.export.joints import JointLimits, joint_limits, narrowed
from armdesign.export.options import AUTO, RobotOptions
from armdesign.export.solids import BodyFit, LinkBody, link_bodies
from armdesign.export.xml_text import safe_name, safe_names
from armdesign.kinematics.dh import DHTable
from armdesign.search.evaluation import motions
from armdesign.search.result import Result


@dataclass(frozen=True, eq=False)
class Robot:
    """An arm ready to be written down.

    Attributes:
        name: Robot name, safe.
        table: The arm, n joints.
        limits: Limits of its joints.
        bodies: Solids of base_link, link_1, ..., link_n.
        options: What was assumed.
        start: First pose of the demonstrated motion, shape (n,) [rad]; zeros without one.
        paths: Demonstrated points by safe name, relative to the base, shape (T, 3) each [m].
        notes: What a user should know.
    """

    name: str
    table: DHTable
    limits: JointLimits
    bodies: tuple[LinkBody, ...]
    options: RobotOptions
    start: Array
    paths: dict[str, Array]
    notes: tuple[str, ...] = ()


def make_robot(
    table: DHTable,
    limits: JointLimits,
    options: RobotOptions | None = None,
    fit: BodyFit | None = None,
    start: ArrayLike | None = None,
) -> Robot:
    """An arm of its own, without a demonstration.

    Args:
        table: The arm, n joints.
        limits: Limits of its joints.
        options: What is assumed.
        fit: The room its body makes for a motion.
        start: Pose to start from, shape (n,) [rad]; zeros by default.
    """
    chosen = options or RobotOptions()
    side = chosen.tags.base_side
    made = fit or BodyFit("below" if side == AUTO else side)
    pose = np.zeros(table.dof) if start is None else np.asarray(start, dtype=float)
    bodies = link_bodies(table, chosen.body, made)
    return Robot(safe_name(chosen.tags.name), table, limits, bodies, chosen, pose, {})


def finished_robot(result: Result, options: RobotOptions | None = None) -> Robot:
    """The arm of a finished search or evaluation, with limits and a body that its own motions ask for.

    Args:
        result: The arm with its paths.
        options: What is assumed.

    Raises:
        SettingsError: An option is out of range.
    """
    chosen = options or RobotOptions()
    table, task, q_0 = result.table, result.problem.task, result.evaluation.path.q[0]
    moved = motions(result.evaluation, result.problem)
    q = np.concatenate([angles for _, angles in moved])
    loads = motion_limits(table, moved, chosen)
    position = result.limits
    notes: tuple[str, ...] = ()
    if chosen.limits.narrow_limits is not None:
        position = narrowed(position, q, np.deg2rad(chosen.limits.narrow_limits))
        notes += _widened_notes(position, q)
    fitted = fit_body(table, q, chosen.body, chosen.tags.base_side)
    robot = make_robot(table, joint_limits(table.dof, position, loads.velocity, loads.effort), chosen, fitted.fit, q_0)
    names = safe_names(list(task.points), "point")
    paths = {name: task.P[:, i] for i, name in enumerate(names)}
    return dataclasses.replace(robot, paths=paths, notes=notes + fitted.notes)


def motion_limits(
    table: DHTable, moved: Sequence[tuple[Array, Array]], options: RobotOptions | None = None
) -> TrajectoryLimits:
    """Speed and torque limits that cover the motions of an arm, one for each demonstration.

    Args:
        table: The arm, n joints.
        moved: Times (T,) [s] and joint angles (T, n) [rad] of each.
        options: What is assumed.
    """
    chosen = options or RobotOptions()
    each = [trajectory_limits(table, time, q, body=chosen.body, options=chosen.limits) for time, q in moved]
    return TrajectoryLimits(*(np.max([getattr(one, name) for one in each], axis=0) for name in ("velocity", "effort")))


def _widened_notes(position: Array, q: Array) -> tuple[str, ...]:
    """Which narrowed ranges reach further than the motion and its margin, to hold 0."""
    far = (position[:, 0] == 0.0) & (q.min(axis=0) > 0.0) | (position[:, 1] == 0.0) & (q.max(axis=0) < 0.0)
    names = ", ".join(f"joint_{i + 1}" for i in np.flatnonzero(far))
    if not names:
        return ()
    return (f"The narrowed range of {names} reaches to 0, which the motion does not use: many readers insist on it.",)
