"""What an arm that cannot exist costs in the search: an exact penalty, added to the robot fitness r."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from armdesign._types import Array
from armdesign.cell.obstacles import Obstacles
from armdesign.fitness.robot import Penalty
from armdesign.settings.sections import Settings


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


def make_penalty(requirements: Requirements) -> Penalty | None:
    """The penalty of the settings; None where nothing is asked of an arm but its path.

    Args:
        requirements: What an arm must be able to do and what it must stay clear of.
    """
    return None
