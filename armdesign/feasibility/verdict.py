"""Whether an arm can exist and does its task: the hand's error, what it touches, how fast and strong it has to be.

Everything is measured on the arm's own joint paths, on exact shapes; of several demonstrations the worst counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody
from armdesign.bodies.exact import ExactObstacle, ExactScene
from armdesign.cell.obstacles import Obstacles
from armdesign.feasibility.demand import joint_demand, speed_fraction
from armdesign.feasibility.needs import check_needs, joint_needs
from armdesign.feasibility.penalty import Requirements
from armdesign.feasibility.swept import envelope_excess
from armdesign.feasibility.violations import (
    Followed,
    Gap,
    demand_violations,
    envelope_violations,
    gap_violations,
    hand_violations,
    place_violations,
    share,
)
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.motion import smooth_motion


@dataclass(frozen=True)
class Spread:
    """An error over the frames, of several demonstrations each figure that of the worst.

    Attributes:
        mean: Its mean.
        p95: What it stays below in 95 % of the frames.
        max: Its largest.
    """

    mean: float
    p95: float
    max: float


@dataclass(frozen=True)
class Verdict:
    """Whether an arm can exist, and does its task well enough.

    Attributes:
        feasible: Whether nothing is violated: bodies and obstacles apart by the stated clearance, the base in its
            place, stated speeds, accelerations, torques and the stated envelope kept.
        hand_error: Distance of the end-effector from the hand [m].
        hand_angle: Angle between their orientations [rad]; None where no orientation is followed.
        tolerance: How large the distance may be [m]; None where none is stated.
        tolerance_met: Whether the stated tolerances, of distance and angle, are met; None where none is stated.
        self_clearance: Where the arm's bodies come nearest to one another; None for a thin arm.
        obstacle_clearance: Where they come nearest to an obstacle; None where there is none.
        envelope_excess: How far they leave the surface that the demonstrator's arm has swept [m]; None for a thin arm.
        speed_fraction: Share of the demonstrated speed, at most 1, at which every joint keeps its stated limits, or
            where no speed is stated, that of the assumed actuator.
        peak_speed: Largest speed of every joint at the demonstrated speed [rad/s; m/s].
        peak_torque: Largest torque of every joint at the demonstrated speed [N m; N].
        reasons: What is violated, in sentences, worst first.
    """

    feasible: bool
    hand_error: Spread
    hand_angle: Spread | None
    tolerance: float | None
    tolerance_met: bool | None
    self_clearance: Gap | None
    obstacle_clearance: Gap | None
    envelope_excess: float | None
    speed_fraction: float
    peak_speed: tuple[float, ...]
    peak_torque: tuple[float, ...]
    reasons: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether the arm is feasible and meets the tolerance, where one is stated."""
        return self.feasible and self.tolerance_met is not False


def judge(arm: ArmBody, base: BasePose, followed: Sequence[Followed], requirements: Requirements) -> Verdict:
    """Judge an arm by what it does on the demonstrations.

    Args:
        arm: The arm with its body; of a thin arm the body that robot files assume, for its torques alone.
        base: Where it stands in the room.
        followed: What it does on each demonstration, one or more.
        requirements: What it has to do, and what it must stay clear of.

    Raises:
        SettingsError: What is asked for does not fit the arm or the task.
    """
    angles = [each.angle for each in followed if each.angle is not None]
    settings = requirements.settings
    check_needs(settings, oriented=bool(angles))
    needs, limits = settings.needs, joint_needs(settings)
    gaps: tuple[Gap | None, Gap | None] = (None, None)
    excess: float | None = None
    if settings.body.kind == "tube":
        scenes = [
            ExactScene(arm, exact_obstacles(shown.obstacles), base.matrix) for shown in requirements.demonstrations
        ]
        gaps = clearances(scenes, followed)
        excess = farthest(arm, base, followed, requirements)
    demand = joint_demand(arm, [smooth_motion(each.time, each.q, arm.limits) for each in followed], needs.payload, base)
    missed = hand_violations(followed, needs)
    violated = [*place_violations(base, settings.cell), *demand_violations(demand, limits)]
    violated += gap_violations(gaps, followed, settings.body.clearance)
    violated += envelope_violations(excess, settings.cell.stay_within)
    stated = needs.hand_tolerance is not None or needs.tolerance_angle is not None
    reasons = sorted((*missed, *violated), key=lambda each: (not each.touches, -each.excess))
    return Verdict(
        feasible=not violated,
        hand_error=spread([each.miss for each in followed]),
        hand_angle=spread(angles) if angles else None,
        tolerance=needs.hand_tolerance,
        tolerance_met=not missed if stated else None,
        self_clearance=gaps[0],
        obstacle_clearance=gaps[1],
        envelope_excess=excess,
        speed_fraction=speed_fraction(demand, limits),
        peak_speed=tuple(demand.speed.max(axis=0).tolist()),
        peak_torque=tuple(np.abs(demand.torque).max(axis=0).tolist()),
        reasons=tuple(each.sentence for each in reasons),
    )


def exact_obstacles(obstacles: Obstacles) -> list[ExactObstacle]:
    """Obstacles as the exact check takes them, in the room."""
    return [ExactObstacle(one.name, one.shape.geometry(), one.pose) for one in obstacles.each]


def clearances(scenes: Sequence[ExactScene], followed: Sequence[Followed]) -> tuple[Gap | None, Gap | None]:
    """Where the arm's bodies come nearest to one another and to obstacles, over all demonstrations.

    Args:
        scenes: The arm among the obstacles of each demonstration.
        followed: What it does on each.
    """
    found: tuple[list[Gap], list[Gap]] = ([], [])
    for k, (scene, each) in enumerate(zip(scenes, followed, strict=True)):
        for gaps, clearance in zip(found, (scene.self_clearance, scene.obstacle_clearance), strict=True):
            least = clearance(each.q)
            if least is not None:
                gaps.append(Gap(least.value, least.frame, least.bodies, float(each.time[least.frame]), k))
    own, others = (min(gaps, key=lambda gap: gap.value, default=None) for gaps in found)
    return own, others


def farthest(arm: ArmBody, base: BasePose, followed: Sequence[Followed], requirements: Requirements) -> float:
    """How far the arm's bodies leave what the demonstrator's arm has swept, over all demonstrations [m].

    Args:
        arm: The arm with its body.
        base: Where it stands in the room.
        followed: What it does on each demonstration.
        requirements: What was demonstrated.
    """
    pose = base.matrix
    if requirements.origin is not None:  # what was demonstrated counts from there
        pose[:3, 3] -= requirements.origin
    pairs = zip(followed, requirements.demonstrations, strict=True)
    return max(envelope_excess(arm, pose, each.q, shown.arm) for each, shown in pairs)


def spread(errors: Sequence[Array]) -> Spread:
    """Mean, 95 % and largest of an error, given over the frames of each demonstration; the worst demonstration's."""
    figures = [(series.mean(), share(series, 95.0), series.max()) for series in errors]
    return Spread(*(float(max(values)) for values in zip(*figures, strict=True)))
