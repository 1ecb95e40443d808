"""The arm as every robot file tells it: solids, limits and tags, put together once."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody, LinkBody, arm_body
from armdesign.bodies.exact import free_side
from armdesign.bodies.loads import GRAVITY, base_gravity
from armdesign.export.contacts import Pair, thinned, touching_links, touching_notes
from armdesign.export.joints import JointLimits
from armdesign.export.limits import exported_limits
from armdesign.export.options import AUTO, RobotOptions
from armdesign.export.trajectory.exporting import TrajectoryOptions, timed_path
from armdesign.export.trajectory.scaling import motion_at
from armdesign.export.trajectory.tool_poses import tool_poses
from armdesign.export.xml_text import safe_name, safe_names
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.dh import DHTable
from armdesign.search.evaluation import motions
from armdesign.search.result import Result
from armdesign.settings import Body

PLACES = {
    "below": "below",
    "above": "above",
    "behind": "behind",
    "left": "to the left of",
    "right": "to the right of",
    "front": "in front of",
}


SAMPLES = 2000
"""Places of a trajectory that its speeds are looked up at."""


class Pace(NamedTuple):
    """How fast a trajectory is.

    Attributes:
        joints: Peak speeds of the joints, shape (n,) [rad/s; m/s].
        tool: Peak speed of tool0 [m/s].
    """

    joints: Array
    tool: float


@dataclass(frozen=True, eq=False)
class Robot:
    """An arm ready to be written down.

    Attributes:
        name: Robot name, safe.
        arm: The arm and its solids, n joints.
        limits: Limits of its joints.
        options: What was assumed.
        start: First point of the exported trajectory, shape (n,) [rad; m]; zeros without one.
        pace: How fast that is.
        base: Where it stands in the room.
        paths: Demonstrated points by safe name, relative to the base, shape (T, 3) each [m].
        touching: Links that touch in the demonstrated motion, with the number of frames.
        notes: What a user should know.
        meshes: Of links that are shown by meshes: file, pose in the link's frame and material of each.
    """

    name: str
    arm: ArmBody
    limits: JointLimits
    options: RobotOptions
    start: Array
    pace: Pace
    base: BasePose = field(default_factory=BasePose)
    paths: Mapping[str, Array] = field(default_factory=dict)
    touching: Mapping[Pair, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    meshes: Mapping[int, Sequence[tuple[str, Array, str]]] = field(default_factory=dict)

    @property
    def table(self) -> DHTable:
        """The arm's DH table."""
        return self.arm.table

    @cached_property
    def bodies(self) -> tuple[LinkBody, ...]:
        """Solids of base_link, link_1, ..., link_n."""
        return self.arm.links

    @property
    def root(self) -> Array:
        """Pose of base_link in the frame that the file counts from, on request the room's, shape (4, 4)."""
        return self.base.matrix if self.options.tags.world else np.eye(4)

    @property
    def gravity(self) -> Array:
        """Gravity in the frame that the file counts from, shape (3,) [m/s^2]."""
        return np.array(GRAVITY) if self.options.tags.world else base_gravity(self.base)


def make_robot(
    arm: DHTable | ArmBody,
    limits: JointLimits,
    options: RobotOptions | None = None,
    start: ArrayLike | None = None,
) -> Robot:
    """An arm of its own, without a demonstration.

    Args:
        arm: The arm, n joints; where only its table is given, with the body that the options say.
        limits: Limits of its joints.
        options: What is assumed.
        start: Pose to start from, shape (n,) [rad]; zeros by default.
    """
    chosen = options or RobotOptions()
    if isinstance(arm, DHTable):
        side = chosen.tags.base_side
        arm = arm_body(arm, chosen.body or Body(), None, limits.position, side="below" if side == AUTO else side)
    pose = np.zeros(arm.table.dof) if start is None else np.asarray(start, dtype=float)
    return Robot(safe_name(chosen.tags.name), arm, limits, chosen, pose, Pace(np.zeros(arm.table.dof), 0.0))


def finished_robot(
    result: Result, options: RobotOptions | None = None, timing: TrajectoryOptions | None = None
) -> Robot:
    """The arm of a finished search or evaluation, with its body and its limits.

    Args:
        result: The arm with its paths.
        options: What is assumed.
        timing: How the trajectory beside it is smoothed and timed, whose first point is the start.

    Raises:
        SettingsError: An option is out of range.
    """
    chosen, task = resolved_options(options, result), result.problem.task
    arm, notes = result_arm(result, chosen)
    limits, of_limits = exported_limits(result, arm, chosen)
    start, pace = trajectory_start(result, timing or TrajectoryOptions())
    q = thinned(np.concatenate([angles for _, angles in motions(result.evaluation, result.problem)]))
    touching = touching_links(arm, q)
    robot = make_robot(arm, limits, chosen, start)
    names = safe_names(list(task.points), "point")
    return dataclasses.replace(
        robot,
        pace=pace,
        base=result.base_pose,
        paths={name: task.P[:, i] for i, name in enumerate(names)},
        touching=touching,
        notes=(*of_limits, *notes, *touching_notes(touching, len(q))),
    )


def trajectory_start(result: Result, timing: TrajectoryOptions) -> tuple[Array, Pace]:
    """First point of the exported trajectory, shape (n,) [rad; m], and how fast the trajectory is.

    Args:
        result: The arm with its paths.
        timing: How it is smoothed and timed.
    """
    path, timed, _ = timed_path(result, timing)
    time = np.linspace(0.0, timed.total, SAMPLES)
    motion = motion_at(path, timed, time)
    steps = np.linalg.norm(np.diff(tool_poses(result.table, motion.q)[:, :3, 3], axis=0), axis=1)
    return motion.q[0], Pace(np.abs(motion.v).max(axis=0), float(steps.max() / (time[1] - time[0])))


def resolved_options(options: RobotOptions | None, result: Result) -> RobotOptions:
    """Options with what is not set taken from the settings of a result: its body and its payload.

    Args:
        options: What is assumed.
        result: The arm with its settings.
    """
    chosen, settings = options or RobotOptions(), result.problem.settings
    limits = chosen.limits
    if limits.payload is None:
        limits = dataclasses.replace(limits, payload=settings.needs.payload)
    return dataclasses.replace(chosen, body=chosen.body or settings.body, limits=limits)


def result_arm(result: Result, options: RobotOptions) -> tuple[ArmBody, tuple[str, ...]]:
    """The arm of a result with its solids, and what to know about its base.

    Args:
        result: The arm with its paths.
        options: What it is built of, and where its plate is, see ``resolved_options``.
    """
    body, side = options.body or result.problem.settings.body, options.tags.base_side
    if result.placed:
        return arm_body(result.table, body, result.slides, result.limits, placed=True), ()
    if side == AUTO and body == result.problem.settings.body and result.plate_side is not None:
        side = result.plate_side  # where it was judged
    elif side == AUTO:
        q = np.concatenate([angles for _, angles in motions(result.evaluation, result.problem)])
        side = free_side(arm_body(result.table, body, result.slides, result.limits), thinned(q))
    notes = (
        () if side == "below" else (f"The base plate stands {PLACES[side]} the base, out of the way of the motion.",)
    )
    return arm_body(result.table, body, result.slides, result.limits, side=side), notes
