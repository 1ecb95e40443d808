"""What the report tells, as numbers: the fitness in its parts, the loads of the joints, how the search went."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.errors import RunFolderError, counted
from armdesign.export.joint_load import GRAVITY, SmoothMotion, TrajectoryLimits, joint_torques, smooth_motion
from armdesign.export.joints import narrowed
from armdesign.export.options import RobotOptions
from armdesign.export.robot_file import motion_limits
from armdesign.export.solids import link_bodies
from armdesign.kinematics.dh import DHTable
from armdesign.runs.reading import FinishedRun
from armdesign.search.evaluation import motions
from armdesign.swarm import ALGORITHMS

HISTORY = ("best", "mean", "valid")
"""Columns of history.csv that are drawn."""


@dataclass(frozen=True)
class FitnessParts:
    """The robot fitness as a sum, r = lambda_f (f_1 + ... + f_m + f_R) + lambda_E E.

    The root in eq. 3 is shared out by what each point has below it, w_i d_i^2.

    Attributes:
        points: f_1, ..., f_m, shape (m,) [m].
        orientation: f_R, the mean of w_0 e_R [m]; 0 where no orientation is followed.
        area: E [m].
        factors: lambda_f and lambda_E.
    """

    points: Array
    orientation: float
    area: float
    factors: tuple[float, float]

    @property
    def path(self) -> float:
        """The path fitness f [m]."""
        return float(self.points.sum()) + self.orientation

    @property
    def total(self) -> float:
        """The robot fitness r [m]."""
        return self.factors[0] * self.path + self.factors[1] * self.area


def fitness_parts(run: FinishedRun) -> FitnessParts:
    """Split the fitness of a run."""
    fitness, path = run.prepared.settings.fitness, run.evaluation.path
    below = np.asarray(fitness.weights) * path.distance**2
    root = np.sqrt(below.sum(axis=1, keepdims=True))
    shares = np.divide(below, root, out=np.zeros_like(below), where=root > 0.0) / below.shape[1]
    orientation = (fitness.orientation_weight or 0.0) * float(path.orientation_error.mean())
    factors = (fitness.lambda_f, fitness.lambda_E)
    return FitnessParts(shares.mean(axis=0), orientation, float(path.area.mean()), factors)


def start_error(run: FinishedRun) -> float:
    """Distance of the end-effector to the hand's first point [m]."""
    tip = run.table.frames(run.evaluation.path.q[0])[-1, :3, 3]
    return float(np.linalg.norm(tip - run.prepared.task.P[0, -1]))


@dataclass(frozen=True)
class JointLoads:
    """What the motion asks of the n joints.

    Attributes:
        time: Even times of the smoothed motion, shape (T,) [s].
        motion: The smoothed motion.
        torque: Torques that hold and move the arm, shape (T, n) [N m].
        limits: Speed and torque limits, as in the URDF.
        range: Joint limits, shape (n, 2) [rad].
        masses: Of base_link, link_1, ..., link_n, shape (n + 1,) [kg].
    """

    time: Array
    motion: SmoothMotion
    torque: Array
    limits: TrajectoryLimits
    range: Array
    masses: Array


def joint_loads(run: FinishedRun, options: RobotOptions) -> JointLoads:
    """Speeds and torques along the demonstrated motion, of several the first; the limits cover all of them.

    Args:
        run: The run.
        options: What the arm is assumed to be built of and to carry.
    """
    body, limits = options.body, options.limits
    time, q = run.prepared.task.time, run.evaluation.path.q
    narrow, moved = limits.narrow_limits, motions(run.evaluation, run.prepared)
    every = np.concatenate([angles for _, angles in moved])
    motion = smooth_motion(time, q, limits.window)
    return JointLoads(
        time=np.linspace(time[0], time[-1], len(time)),
        motion=motion,
        torque=joint_torques(run.table, motion, body, limits.payload, GRAVITY),
        limits=motion_limits(run.table, moved, options),
        range=run.limits if narrow is None else narrowed(run.limits, every, float(np.deg2rad(narrow))),
        masses=np.array([each.inertial.mass for each in link_bodies(run.table, body)]),
    )


@dataclass(frozen=True)
class SearchFacts:
    """How a search went, out of result.json.

    Attributes:
        algorithm: Its name.
        seed: Of the random numbers.
        candidates: Arms that were looked at.
        rejected: How many of them each test has removed.
        converged_at: Iteration whose best is within 1 % of the last.
        effort: Computational effort CE, valid particles up to there.
        stopped_by: Why it ended.
        wall_time: How long it took [s].
        progress: How far it went, as "3 of 200 iterations".
    """

    algorithm: str
    seed: int
    candidates: int
    rejected: Mapping[str, int]
    converged_at: int
    effort: float
    stopped_by: str
    wall_time: float
    progress: str

    @property
    def interrupted(self) -> bool:
        """Whether somebody ended it before its time."""
        return self.stopped_by == "interrupted"


def search_facts(run: FinishedRun) -> SearchFacts | None:
    """How the search went; None for an arm that was given and only scored.

    Raises:
        RunFolderError: An entry of result.json is missing or of the wrong type; the message names it.
    """
    if "stopped_by" not in run.content:
        return None
    rejected, search = entry(run, "rejected", dict), run.prepared.settings.search
    algorithm = ALGORITHMS[search.algorithm]
    done = algorithm.units_done(entry(run, "evaluations", int), vars(search))
    return SearchFacts(
        algorithm=entry(run, "algorithm", str),
        seed=entry(run, "seed", int),
        candidates=entry(run, "evaluations", int),
        rejected={str(name): count for name, count in rejected.items() if isinstance(count, int)},
        converged_at=entry(run, "converged_at", int),
        effort=float(entry(run, "computational_effort", (int, float))),
        stopped_by=entry(run, "stopped_by", str),
        wall_time=float(entry(run, "wall_time", (int, float))),
        progress=f"{done} of {counted(getattr(search, algorithm.length), algorithm.unit)}",
    )


def history_columns(run: FinishedRun) -> dict[str, Array] | None:
    """Best, mean and valid particles of every iteration; None for an arm that was not searched.

    Raises:
        RunFolderError: There is a history, but without one of them; the message names it.
    """
    if not run.history:
        return None
    for name in HISTORY:
        if len(run.history.get(name, ())) == 0:
            where = "the history" if run.folder is None else str(run.folder / "history.csv")
            raise RunFolderError(f"{where} is damaged: the column '{name}' is missing", value=name, fix="Search again")
    return {name: run.history[name] for name in HISTORY}


def entry(run: FinishedRun, name: str, kind: type | tuple[type, ...]) -> Any:  # noqa: ANN401 (values come from JSON)
    """An entry of result.json.

    Raises:
        RunFolderError: It is missing or of the wrong type.
    """
    value = run.content.get(name)
    endless = isinstance(value, float) and not np.isfinite(value)
    if endless or isinstance(value, bool) or not isinstance(value, kind):
        where = "the result" if run.folder is None else str(run.folder / "result.json")
        what = "is missing" if name not in run.content else f"is {value!r}"
        raise RunFolderError(f"{where} is damaged: '{name}' {what}", value=value, fix="Search again")
    return value


def arm_corners(table: DHTable, q: Array) -> Array:
    """Corners of the arm skeleton from the base to the tool: per row along x_{i-1} by a_i, then along z_i by d_i.

    Args:
        table: The arm.
        q: Joint angles, shape (n,) [rad].

    Returns:
        Shape (2 n + 3, 3) [m]; every second one from the third on is a joint's origin, the last is the tool.
    """
    corners, pose = [np.zeros(3)], table.base()
    for frame, a in zip(table.frames(q), table.a, strict=True):
        corners += [pose[:3, 3] + a * pose[:3, 0], frame[:3, 3]]
        pose = frame
    return np.array(corners)
