"""Arms on a task side by side: one table for designs, other numbers of joints, alternatives and ready-made arms."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from html import escape

import numpy as np
import pinocchio as pin

from armdesign._types import Array
from armdesign.building.build import Build
from armdesign.experiments.compare.comparison import ArmScore
from armdesign.experiments.compare.serial_arm import SerialArm
from armdesign.feasibility.words import base_words, pace
from armdesign.kinematics.base_pose import BasePose, placed_base
from armdesign.search.result import Result, done
from armdesign.studio.takes import nearest

Place = Callable[[int], Array]
"""Where an arm's links are in a frame of the task: frame number to poses, shape (L, 4, 4), base first."""
BUILT = ", as built"
"""What the name of an arm as it is built ends with."""
ASSUMED_LOAD = 0.5
"""What an arm carries where nobody has said it, gripper included [kg]."""
CHANGED_RUN = "-changed"
"""What the folder of an arm that was changed by hand ends with, behind the name of its search."""
SORTS = ("largest error", "mean error", "joints", "length", "mass")


@dataclass(frozen=True, eq=False)
class Arm:
    """An arm that does the task.

    Attributes:
        name: What to call it.
        joints: Number of joints.
        time: Frame times of the task, shape (T,) [s].
        error: Distance of the end-effector from the hand, shape (T,) [m]; infinite where it does not reach the start.
        length: Its length [m].
        mass: What moves [kg]; None where it is not known.
        place: Where its links are.
        result: The design, or the arm as it is built; None of a ready-made arm.
        built: Its parts; None where they are not chosen.
        design: What it was built after; None where it is not built.
        stands: Where a ready-made arm stands, in a sentence.
    """

    name: str
    joints: int
    time: Array
    error: Array
    length: float
    mass: float | None
    place: Place
    result: Result | None = None
    built: Build | None = None
    design: Result | None = None
    stands: str = ""

    @property
    def worst(self) -> float:
        """When the error is largest [s]."""
        return float(self.time[int(np.argmax(self.error))])

    def at(self, time: float) -> Array:
        """Where its links are at a time, shape (L, 4, 4)."""
        return self.place(nearest(self.time, time))


def design_arm(result: Result, name: str | None = None) -> Arm:
    """A design with what it does on the first demonstration.

    Args:
        result: The design.
        name: What to call it; by default as its run.
    """
    table, q = result.table, result.evaluation.path.q
    base = result.base_pose.matrix
    error = done(table, result.problem.first, result.evaluation.demonstrations[0]).miss

    def place(frame: int) -> Array:
        return np.asarray(base @ np.concatenate([np.eye(4)[None], table.frames(q[frame])[:-1]]))

    mass, time = result.body.moving_mass, result.problem.task.time
    return Arm(name or result.name, table.dof, time, error, table.length, mass, place, result)


def built_arm(made: Build, name: str, design: Result) -> Arm:
    """An arm of parts with what it does.

    Args:
        made: Its parts.
        name: What the design is called.
        design: The design.
    """
    return replace(design_arm(made.result, f"{name}{BUILT}"), built=made, design=design)


def ready_made_arm(row: ArmScore, result: Result) -> Arm:
    """A ready-made arm where it does best.

    Args:
        row: Its score.
        result: A design for the same task.
    """
    if not isinstance(row.arm, SerialArm) or row.base is None:
        raise TypeError("a ready-made arm is wanted")
    arm, q, problem = row.arm, row.path.q, result.problem.in_room
    pose = placed_base(row.base[:3], float(row.base[3]), row.mounted)
    stand = BasePose(pose.translation + problem.shift, pose.rotation, row.mounted)
    base = stand.matrix

    def place(frame: int) -> Array:
        poses = [base]
        for i, placement in enumerate(arm.placements):
            poses.append(poses[-1] @ placement)
            if i < arm.dof:
                poses[-1][:3, :3] = poses[-1][:3, :3] @ pin.exp3(q[frame, i] * arm.axes[i])
        return np.array(poses)

    time = result.problem.task.time
    error = row.path.distance[:, -1] if row.reached else np.full(len(time), np.inf)
    stands = base_words(stand) if result.placed else ""
    return Arm(arm.name, arm.dof, time, error, arm.length, row.moving_mass, place, stands=stands)


def millimetres(length: float) -> str:
    """A length in words, as precise as anybody would say it."""
    if not np.isfinite(length):
        return "not reached"
    value = 1e3 * length
    return f"{value:.0f} mm" if value >= 9.95 else f"{value:.1f} mm"


def load_words(load: float) -> str:
    """What an arm carries, gripper included, and whether that is only assumed.

    Args:
        load: The load [kg].
    """
    return f"carries {load:g} kg{' (assumed)' if load == ASSUMED_LOAD else ''}"


def ordered(arms: Sequence[Arm], by: str) -> list[Arm]:
    """Arms sorted by one of ``SORTS``, what is not known last."""
    keys: dict[str, Callable[[Arm], float | None]] = {
        "largest error": lambda arm: float(arm.error.max()),
        "mean error": lambda arm: float(arm.error.mean()),
        "joints": lambda arm: arm.joints,
        "length": lambda arm: arm.length,
        "mass": lambda arm: arm.mass,
    }
    values = {id(arm): keys[by](arm) for arm in arms}
    return sorted(arms, key=lambda arm: (values[id(arm)] is None, values[id(arm)] or 0.0))


def arms_table(arms: Sequence[Arm], colours: Sequence[str]) -> str:
    """The arms as a table of a page.

    Args:
        arms: In their order.
        colours: The colour that each is drawn in.
    """
    heads = ("Arm", "Joints", "Largest error", "Mean", "Length", "Mass")
    rows = []
    for arm, colour in zip(arms, colours, strict=True):
        cells = (
            str(arm.joints), millimetres(float(arm.error.max())), millimetres(float(arm.error.mean())),
            f"{arm.length:.2f} m", "-" if arm.mass is None else f"{arm.mass:.1f} kg",
        )  # fmt: skip
        name = f'<th scope="row"><i style="background:{colour}"></i>{escape(arm.name)}</th>'
        rows.append(f"<tr>{name}{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>")
    head = "".join(f'<th scope="col">{each}</th>' for each in heads)
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{"".join(rows)}</tbody></table></div>'


def job_words(arm: Arm) -> tuple[str, str]:
    """What an arm does, in a line, and its mark: ``part`` where its parts fit, but slowly or at no checked place."""
    error, result, made = float(arm.error.max()), arm.result, arm.built
    if result is None:
        return f"Largest error of the hand: {millimetres(error)}", ""
    if made is not None:
        if made.fault:
            return f"Not to be built as it is: {made.fault}", "bad"
        slow = "as fast as shown" if made.speed >= 1.0 else f"at {pace(made.speed)} of the demonstrated speed"
        words = f"Does the job to {millimetres(error)}, {slow}, and its parts fit on this motion"
        if not result.located:
            return f"{words}; where it stands is not checked", "part"
        return words, "good" if made.speed >= 1.0 else "part"
    within = result.problem.settings.needs.hand_tolerance
    if within is not None and error > within:
        return f"Misses the hand by up to {millimetres(error)}; {1e3 * within:g} mm are allowed", "bad"
    return f"Follows the hand to {millimetres(error)}; its parts are not chosen yet", ""
