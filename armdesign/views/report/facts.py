"""What the report shows, as numbers: the fitness in its parts, the loads of the joints, how the search went."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from armdesign._types import Array
from armdesign.bodies.loads import base_gravity, joint_torques
from armdesign.export.joints import JointLimits
from armdesign.export.limits import exported_limits
from armdesign.export.options import RobotOptions
from armdesign.export.planning import FEW, sampled_contacts
from armdesign.export.robot_file import make_robot, resolved_options, result_arm, trajectory_start
from armdesign.export.servos import lag_note
from armdesign.export.trajectory.exporting import TrajectoryOptions
from armdesign.kinematics.motion import SmoothMotion
from armdesign.search.result import Result


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


def fitness_parts(run: Result) -> FitnessParts:
    """Split the fitness of a run."""
    fitness, path = run.problem.settings.fitness, run.evaluation.path
    below = np.asarray(fitness.weights) * path.distance**2
    root = np.sqrt(below.sum(axis=1, keepdims=True))
    shares = np.divide(below, root, out=np.zeros_like(below), where=root > 0.0) / below.shape[1]
    orientation = (fitness.orientation_weight or 0.0) * float(path.orientation_error.mean())
    factors = (fitness.lambda_f, fitness.lambda_E)
    return FitnessParts(shares.mean(axis=0), orientation, float(path.area.mean()), factors)


@dataclass(frozen=True)
class JointLoads:
    """What the motion asks of the n joints.

    Attributes:
        time: Times of the frames, shape (T,) [s].
        motion: The smooth motion, which is what ``armdesign export --trajectory`` writes.
        torque: Torques that hold and move the arm, shape (T, n) [N m; N of joints that slide].
        limits: Limits of the joints, as in the URDF.
        masses: Of base_link, link_1, ..., link_n, shape (n + 1,) [kg].
        prismatic: Which joints slide, n of them.
        free: Share of random poses within the joint limits that are free of self-collision.
        lag: How far the servos of the exported arm stay behind the motion, in words.
        miss: How far the tool is off on the smooth motion, shape (T,) [m].
        payload: What it carries [kg].
    """

    time: Array
    motion: SmoothMotion
    torque: Array
    limits: JointLimits
    masses: Array
    prismatic: tuple[bool, ...]
    free: float
    lag: str
    miss: Array
    payload: float = 0.0

    @property
    def error(self) -> float:
        """How far the tool is off on the smooth motion, at worst [m]."""
        return float(self.miss.max())


def joint_loads(run: Result, options: RobotOptions) -> JointLoads:
    """Speeds and torques along the demonstrated motion, of several the first; the limits cover all of them.

    Args:
        run: The run.
        options: What the arm is assumed to be built of and to carry.
    """
    chosen = resolved_options(options, run)
    arm, _ = result_arm(run, chosen)
    limits, motion = chosen.limits, run.moved[0]
    exported = exported_limits(run, arm, chosen)[0]
    start, pace = trajectory_start(run, TrajectoryOptions())
    return JointLoads(
        time=run.problem.task.time,
        motion=motion,
        torque=joint_torques(arm, motion, limits.payload or 0.0, base_gravity(run.base_pose)),
        limits=exported,
        masses=np.array([each.inertial.mass for each in arm.links]),
        prismatic=run.table.prismatic,
        free=sampled_contacts(arm, run.limits, samples=FEW).free,
        lag=lag_note(replace(make_robot(arm, exported, chosen, start), pace=pace)),
        payload=limits.payload or 0.0,
        miss=np.linalg.norm(run.table.skeleton(motion.q)[:, -1] - run.problem.task.P[:, -1], axis=1),
    )
