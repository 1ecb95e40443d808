"""What an arm that cannot exist costs in the search: an exact penalty, added to the robot fitness r."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.bodies.capsules import capsule_sizes
from armdesign.cell.distance_field import swept_field
from armdesign.cell.obstacles import Obstacles
from armdesign.feasibility.clearance import ClearanceCheck, Envelope, Posed
from armdesign.feasibility.kernels.check_arms import check_arms, settle_slides
from armdesign.feasibility.motion_limits import Design, Load, peak_excess
from armdesign.feasibility.needs import JointNeeds, joint_needs
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.motion import Smoothing
from armdesign.settings.place import sites
from armdesign.settings.sections import Settings

KERNELS = (check_arms, settle_slides)
"""What is compiled where bodies are asked for."""
JUMP = 0.02
"""Cost of any violation at all, so that the search does not rest beside the feasible arms."""
PER_METRE = 100.0
"""Cost of a violation by its size [1/m]; for a metre of f and of E the paper has PAPER_WEIGHT."""
PAPER_WEIGHT = 20.0
PEAK = 0.1
"""Violation of twice the speed, acceleration, torque or distance from the swept volume that is allowed [m]."""


@dataclass(frozen=True, eq=False)
class Shown:
    """What a penalty may know of one demonstration.

    Attributes:
        time: Frame times, shape (T,) [s].
        arm: The demonstrator's arm in the task frame, from the base point to the hand, shape (T, m + 1, 3) [m]; the
            points alone, shape (T, m, 3), where the recording has no base point.
        obstacles: What stands in the room, or goes through it.
    """

    time: Array
    arm: Array
    obstacles: Obstacles = field(default_factory=Obstacles)

    @property
    def dt(self) -> float:
        """Median time from frame to frame [s]."""
        return float(np.median(np.diff(self.time)))


@dataclass(frozen=True, eq=False)
class Requirements:
    """What an arm must be able to do and what it must stay clear of, as plain data.

    Attributes:
        settings: Body, needs and cell.
        limits: Joint limits, shape (n, 2) [rad; m of prismatic joints].
        prismatic: Which joints slide, n of them.
        demonstrations: What is demonstrated, in the order of the paths that the penalty gets.
        origin: Position of the task frame in the room, whose axes it has, shape (3,) [m]; None where there is no room.
    """

    settings: Settings
    limits: Array
    prismatic: tuple[bool, ...]
    demonstrations: tuple[Shown, ...]
    origin: Array | None = None


@dataclass(frozen=True, eq=False)
class Parts:
    """What counts in a penalty.

    Attributes:
        needs: Limits of the joints.
        load: What is moved where torques are limited.
        clearance: What the bodies have to stay clear of; None for a thin arm.
        smooth: Smoothing of every demonstration; none where neither speeds, accelerations nor torques are limited.
        envelope: The demonstrator's swept volume and how far the bodies may leave it [m]; None where that is no matter.
        weight: Cost of a violation, by that of the paper's terms.
    """

    needs: JointNeeds
    load: Load
    clearance: ClearanceCheck | None
    smooth: tuple[Smoothing, ...]
    envelope: Envelope | None
    weight: float


class ArmPenalty:
    """JUMP [V > 0] + PER_METRE V, with V the sum of all violations, each the mean over the demonstrations [m]."""

    def __init__(self, parts: Parts) -> None:
        """Count these."""
        self.parts = parts

    def compile(self) -> None:
        """Compile the kernels of clearance, or load them from the disk cache."""
        if self.parts.clearance is not None:
            self.parts.clearance.compile()

    def __call__(
        self, rows: Array, bases: Array, paths: Sequence[Array], turns: Sequence[Array] | None
    ) -> tuple[Array, Array | None]:
        """See Penalty of armdesign.fitness.robot."""
        parts, count = self.parts, len(rows)
        slopes = None if turns is None else np.zeros((count, turns[0].shape[3]))
        violation, slides = np.zeros(count), rows[:, :-1, 2]
        if parts.clearance is not None:
            found = parts.clearance(rows, bases, paths, turns)
            violation, slides = violation + found.violation, found.slides
            slopes = None if slopes is None else slopes + found.slopes
            if parts.envelope is not None:
                away, also = parts.clearance.beyond(parts.envelope, Posed(rows, bases, slides), paths, turns)
                violation += PEAK * away
                slopes = None if slopes is None else slopes + PEAK * also
        for k in range(count if parts.smooth else 0):
            design = Design(rows[k], bases[k], slides[k])
            for d, smooth in enumerate(parts.smooth):
                turned = None if turns is None else turns[d][k]
                excess, slope = peak_excess(parts.needs, parts.load, smooth, design, paths[d][k], turned)
                violation[k] += PEAK * excess / len(paths)
                if slopes is not None and slope is not None:
                    slopes[k] += PEAK * slope / len(paths)
        cost: Array = parts.weight * (JUMP * (violation > 0.0) + PER_METRE * violation)
        return cost, None if slopes is None else parts.weight * PER_METRE * slopes


def make_penalty(requirements: Requirements) -> ArmPenalty | None:
    """The penalty of the settings; None where nothing is asked of an arm but its path.

    Args:
        requirements: What an arm must be able to do and what it must stay clear of.
    """
    settings = requirements.settings
    needs, clearance, envelope = joint_needs(settings), clearance_check(requirements), None
    limited = any(limit is not None for limit in (needs.speed, needs.acceleration, needs.torque))
    if clearance is None and not limited:
        return None
    if settings.cell.stay_within is not None:
        fields = tuple(swept_field(shown.arm).arrays for shown in requirements.demonstrations)
        envelope = Envelope(fields, settings.cell.stay_within)
    placed = bool(sites(settings.cell))
    weight = (settings.fitness.lambda_f + settings.fitness.lambda_E) / PAPER_WEIGHT
    return ArmPenalty(
        Parts(
            needs, Load(settings.body, settings.needs.payload, placed, requirements.limits, requirements.prismatic),
            clearance,
            tuple(Smoothing(shown.time, requirements.limits) for shown in requirements.demonstrations)
            if limited else (),
            envelope, weight or 1.0,
        )
    )  # fmt: skip


def clearance_check(requirements: Requirements) -> ClearanceCheck | None:
    """The check for clearance; None for a thin arm, which has no bodies."""
    settings = requirements.settings
    if settings.body.kind == "thin":
        return None
    sizes = capsule_sizes(settings.body, requirements.limits, requirements.prismatic, placed=bool(sites(settings.cell)))
    around = [shown.obstacles.arrays(requirements.origin) for shown in requirements.demonstrations]
    frames = [len(shown.time) for shown in requirements.demonstrations]
    return ClearanceCheck(sizes, len(requirements.limits), settings.body.clearance, around, frames)


def choose_slides(
    requirements: Requirements, table: DHTable, base: BasePose | None, paths: Sequence[ArrayLike]
) -> Array:
    """Where the joint modules of a finished arm sit on their axes, as the search has chosen it.

    Args:
        requirements: Those of the search.
        table: The arm, n joints.
        base: Where its base stands in the task frame; None in its origin.
        paths: Its joint paths, shape (T, n) each [rad; m of prismatic joints].

    Returns:
        s_j, shape (n,) [m]; those of the joints' origins for a thin arm.
    """
    check = clearance_check(requirements)
    if check is None:
        return table.d[:-1].copy()
    pose = (base or BasePose()).matrix @ table.base()
    rows = np.stack([table.alpha, table.a, table.d, table.theta], axis=1)[None]
    first = np.concatenate([pose[:3, :3].T.ravel(), pose[:3, 3]])[None]
    slides: Array = check.settled(rows, first, [np.asarray(path, dtype=float)[None] for path in paths])[0]
    return slides
