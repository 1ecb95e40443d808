"""How near an arm comes to itself, to obstacles and, as it is built, its parts to one another: what the report says."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.bodies.exact import TOLERANCE, ExactScene
from armdesign.building.build import Build
from armdesign.building.parts_clearance import PartsGap
from armdesign.feasibility.verdict import exact_obstacles
from armdesign.feasibility.violations import figure
from armdesign.search.result import Result
from armdesign.views.report.drawing import MOST_DRAWN

ALWAYS = "on the whole motion shown"


class Near(NamedTuple):
    """Two bodies, or two parts of a build, where they come nearest.

    Attributes:
        value: How near, negative where they are inside one another [m].
        bodies: What they are called.
        when: When or where that is, in words; ``ALWAYS`` where they keep their distance.
        gap: Of parts of a build, that which says what they have to keep; None of bodies.
    """

    value: float
    bodies: tuple[str, str]
    when: str
    gap: PartsGap | None = None

    def short(self, clearance: float) -> bool:
        """Whether they come nearer than they may.

        Args:
            clearance: What bodies have to keep [m].
        """
        return self.value < clearance if self.gap is None else self.gap.met

    @property
    def words(self) -> str:
        """The same in a clause."""
        both, value = " and ".join(self.bodies), f"{figure(1e3 * abs(self.value))} mm"
        if self.value == 0.0:
            return f"{both} meet, {self.when}"
        if self.value < 0.0:
            return f"{both} are inside one another by {value}, {self.when}"
        if self.when == ALWAYS:
            return f"{both} are {value} apart {self.when}"
        return f"{both} come within {value} of each other, {self.when}"


class Clearances(NamedTuple):
    """How near an arm comes to what it must not touch.

    Attributes:
        least: Where it comes nearest, the least first: to itself, to obstacles, part to part; of what keeps one
            distance and of what does not. Empty where nothing is known.
        time: Times that are drawn, shape (T,) [s].
        series: The least distance of those that change, by what it is from, shape (T,) each [m].
    """

    least: tuple[Near, ...]
    time: Array
    series: dict[str, Array]


def clearances(run: Result, made: Build | None = None) -> Clearances:
    """How near an arm comes to itself and to obstacles.

    Args:
        run: The run.
        made: Its parts, where it is a build.
    """
    if run.problem.settings.body.kind == "thin":
        return Clearances((), np.zeros(0), {})
    verdict, q = run.verdict, run.evaluation.path.q
    gaps = {"one another": verdict.self_clearance, "obstacles": verdict.obstacle_clearance}
    least_at = [gap.frame for gap in gaps.values() if gap is not None and gap.demonstration == 0]
    chosen = np.unique([*np.linspace(0, len(q) - 1, min(len(q), MOST_DRAWN)).astype(int), *least_at])
    solids = [
        one if one.poses.ndim == 2 else one._replace(poses=one.poses[chosen])
        for one in exact_obstacles(run.problem.first.obstacles)
    ]
    constant = ExactScene(run.body, solids, run.base_pose.matrix).constant_pairs(q[chosen])
    scene, time = ExactScene(run.body, solids, run.base_pose.matrix, constant), run.problem.task.time[chosen]
    names, found = {frozenset(each) for each in constant.values()}, []
    series: dict[str, Array] = {}
    changing = scene.self_clearance(q[chosen]), scene.obstacle_clearance(q[chosen])
    for (what, gap), drawn in zip(gaps.items(), changing, strict=True):
        if gap is None:
            continue
        still = frozenset(gap.bodies) in names and (drawn is None or drawn.value > gap.value + 2.0 * TOLERANCE)
        found.append(Near(gap.value, gap.bodies, ALWAYS if still else f"at {gap.time:.2f} s"))
        if drawn is not None:
            series[what] = drawn.each
            if still:
                found.append(Near(drawn.value, drawn.bodies, f"at {time[drawn.frame]:.2f} s"))
    if made is not None and made.gap is not None:
        where = "on the motion" if made.gap.joint is None else f"at joint {made.gap.joint}"
        found.append(Near(made.gap.value, made.told(made.gap).parts, where, made.gap))
    if made is not None and made.assembly is None and made.kit is None:
        found = []  # of parts that do not fit together nothing is known
    return Clearances(tuple(sorted(found, key=lambda near: near.value)), time, series)
