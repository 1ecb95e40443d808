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
from armdesign.export.trajectory.exporting import TrajectoryOptions, make_trajectory
from armdesign.export.trajectory.simulated_arm import Pairs, Servo, SimulatedArm
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
    run: Result, *, servo: Servo | None = None, options: TrajectoryOptions | None = None, urdf: str | None = None
) -> Tracking:
    """Run the trajectory of a run on its exported arm.

    Args:
        run: The run.
        servo: The servos and the step.
        options: How the motion is smoothed, timed and sampled.
        urdf: The arm, with joints joint_1..joint_n and their effort limits; None for what a run folder's arm.urdf is.

    Raises:
        MissingExtraError: MuJoCo is not installed.
        DesignError: MuJoCo does not take the arm.
        SettingsError: A number is out of range, or the simulation does not stay finite.
    """
    servo = servo or Servo()
    trajectory = make_trajectory(run, options)
    path, timing, wanted = trajectory.path, trajectory.timing, trajectory.motion
    arm = SimulatedArm(result_urdf(run) if urdf is None else urdf, path, servo)
    fine, torque = arm.follow(path, timing)
    steps = np.arange(len(fine)) * servo.step
    q, tau = (np.stack([np.interp(wanted.time, steps, y) for y in values.T], axis=1) for values in (fine, torque))
    tip, meant = (tool_poses(run.table, angles)[:, :3, 3] for angles in (q, wanted.q))
    target = cubic(run.problem.task.time, run.problem.task.P[:, -1], wanted.demonstrated)
    return Tracking(
        time=wanted.time,
        demonstrated=wanted.demonstrated,
        q=q,
        wanted=wanted.q,
        torque=tau,
        tip=tip,
        target=target,
        error=np.linalg.norm(tip - target, axis=1),
        servo_error=np.linalg.norm(tip - meant, axis=1),
        saturated=np.asarray((np.abs(torque) >= _SEEN * arm.effort).mean(axis=0)),
        touching=arm.touching(q),
    )
