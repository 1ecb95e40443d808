"""The exported arm under position control in MuJoCo, with gravity: how well it follows the demonstrated hand.

For the servos see ``armdesign.export.trajectory.simulated_arm``. Links pass through each other unless contacts are
asked for: the search knows no collisions either. Which links touch along the motion is reported.

Everything here needs the extra ``sim``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import cubic
from armdesign.export.trajectory.scaling import RAMP, Motion, sample, timing_of
from armdesign.export.trajectory.simulated_arm import Pairs, Servo, SimulatedArm
from armdesign.export.trajectory.smooth import CUTOFF, fit_path
from armdesign.export.trajectory.tool_poses import tool_poses
from armdesign.export.urdf import result_urdf
from armdesign.search.result import Result

_SEEN = 0.999  # share of the effort limit from which on a servo counts as saturated


@dataclass(frozen=True, eq=False)
class Tracking:
    """What the simulated arm did, at N even times.

    Attributes:
        time: Shape (N,), from 0 [s].
        demonstrated: Time in the demonstration that each sample stands for, shape (N,) [s].
        q: Joint angles, shape (N, n) [rad].
        wanted: Joint angles asked for, shape (N, n) [rad].
        torque: Torques of the servos, shape (N, n) [N m].
        tip: End-effector, shape (N, 3) [m].
        target: Demonstrated hand, shape (N, 3) [m].
        error: Distance of the end-effector to the demonstrated hand, shape (N,) [m]; what the design itself misses is
            in it.
        servo_error: Distance of the end-effector to where the angles asked for put it, shape (N,) [m].
        saturated: Share of the time that each servo was at its effort limit, shape (n,).
        touching: Links that touch along the motion, with the share of the samples.
    """

    time: Array
    demonstrated: Array
    q: Array
    wanted: Array
    torque: Array
    tip: Array
    target: Array
    error: Array
    servo_error: Array
    saturated: Array
    touching: Pairs

    @property
    def notes(self) -> tuple[str, ...]:
        """What the simulation showed, one sentence each."""
        hand, servos = 1e3 * self.error, 1e3 * self.servo_error
        notes = [
            f"Simulated in MuJoCo, the end-effector stays {hand.mean():.1f} mm from the demonstrated hand on average, "
            f"{hand.max():.1f} mm at most; from where the joint angles put it, {servos.mean():.1f} mm and "
            f"{servos.max():.1f} mm."
        ]
        for joint in np.flatnonzero(self.saturated > 0.0):
            share = 100.0 * self.saturated[joint]
            notes.append(f"The servo of joint_{joint + 1} is at its effort limit for {share:.1f} % of the time.")
        for (first, second), share in sorted(self.touching.items()):
            notes.append(f"{first} and {second} touch or overlap in {100.0 * share:.0f} % of the motion.")
        return tuple(notes)


def simulate(
    run: Result,
    *,
    servo: Servo | None = None,
    speed: float = 1.0,
    cutoff: float = CUTOFF,
    ramp: float = RAMP,
    rate: float | None = None,
    urdf: str | None = None,
) -> Tracking:
    """Run the trajectory of a run on its exported arm.

    Args:
        run: The run.
        servo: The servos and the step.
        speed: Factor on the demonstrated speed.
        cutoff: Frequency of the motion that smoothing keeps by half [Hz].
        ramp: Length of the ramps from and to rest [s of the demonstration].
        rate: Samples per second of the result [1/s]; None for the demonstration's frame rate.
        urdf: The arm, with joints joint_1..joint_n and their effort limits; None for what a run folder's arm.urdf is.

    Raises:
        MissingExtraError: MuJoCo is not installed.
        DesignError: MuJoCo does not take the arm.
        SettingsError: A number is out of range, or the simulation does not stay finite.
    """
    servo, task = servo or Servo(), run.problem.task
    path = fit_path(task.time, run.evaluation.path.q, run.limits, cutoff=cutoff)
    timing = timing_of(path, speed=speed, ramp=ramp)
    wanted = sample(path, timing, 1.0 / task.dt if rate is None else rate)
    text = result_urdf(run) if urdf is None else urdf
    arm = SimulatedArm(text, path, servo)
    fine, torque = arm.follow(path, timing)
    steps = np.arange(len(fine)) * servo.step
    q, tau = (np.stack([np.interp(wanted.time, steps, y) for y in values.T], axis=1) for values in (fine, torque))
    saturated = np.asarray((np.abs(torque) >= _SEEN * arm.effort).mean(axis=0))
    return _tracking(run, wanted, q, tau, saturated, arm.touching(q))


def _tracking(run: Result, wanted: Motion, q: Array, torque: Array, saturated: Array, touching: Pairs) -> Tracking:
    """Compare what was done with what was wanted."""
    tip, meant = (tool_poses(run.table, angles)[:, :3, 3] for angles in (q, wanted.q))
    target = cubic(run.problem.task.time, run.problem.task.P[:, -1], wanted.demonstrated)
    error, servo_error = (np.linalg.norm(tip - place, axis=1) for place in (target, meant))
    return Tracking(
        wanted.time, wanted.demonstrated, q, wanted.q, torque, tip, target, error, servo_error, saturated, touching
    )
