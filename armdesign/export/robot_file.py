"""The arm as every robot file tells it: solids, limits and tags, put together once."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

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


@dataclass(frozen=True, eq=False)
class Robot:
    """An arm ready to be written down.

    Attributes:
        name: Robot name, safe.
        arm: The arm and its solids, n joints.
        limits: Limits of its joints.
        options: What was assumed.
        start: First pose of the demonstrated motion, shape (n,) [rad]; zeros without one.
        base: Where it stands in the room.
        paths: Demonstrated points by safe name, relative to the base, shape (T, 3) each [m].
        touching: Links that touch in the demonstrated motion, with the number of frames.
        notes: What a user should know.
    """

    name: str
    arm: ArmBody
    limits: JointLimits
    options: RobotOptions
    start: Array
    base: BasePose = field(default_factory=BasePose)
    paths: Mapping[str, Array] = field(default_factory=dict)
    touching: Mapping[Pair, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

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
    return Robot(safe_name(chosen.tags.name), arm, limits, chosen, pose)


def finished_robot(result: Result, options: RobotOptions | None = None) -> Robot:
    """The arm of a finished search or evaluation, with its body and its limits.

    Args:
        result: The arm with its paths.
        options: What is assumed.

    Raises:
        SettingsError: An option is out of range.
    """
    chosen = resolved_options(options, result)
    task, q_0 = result.problem.task, result.evaluation.path.q[0]
    arm, notes = result_arm(result, chosen)
    limits, of_limits = exported_limits(result, arm, chosen.limits)
    q = thinned(np.concatenate([angles for _, angles in motions(result.evaluation, result.problem)]))
    touching = touching_links(arm, q)
    robot = make_robot(arm, limits, chosen, q_0)
    names = safe_names(list(task.points), "point")
    return dataclasses.replace(
        robot,
        base=result.base_pose,
        paths={name: task.P[:, i] for i, name in enumerate(names)},
        touching=touching,
        notes=(*of_limits, *notes, *touching_notes(touching, len(q))),
    )


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
    if side == AUTO:
        q = np.concatenate([angles for _, angles in motions(result.evaluation, result.problem)])
        side = free_side(arm_body(result.table, body, result.slides, result.limits), thinned(q))
    notes = (
        () if side == "below" else (f"The base plate stands {PLACES[side]} the base, out of the way of the motion.",)
    )
    return arm_body(result.table, body, result.slides, result.limits, side=side), notes
