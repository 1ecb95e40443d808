"""What a motion asks of an arm's joints: speeds, accelerations, and the torques that move its solids and a payload."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
import scipy
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.bodies.arm_body import ArmBody, tool_inertial
from armdesign.errors import DesignError, SettingsError
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.models import arm_model

PEAK_WINDOW = 0.12
"""Default length of the smoothing window [s]: with a cubic it passes about 6 Hz, the usual cut-off for arm motion."""
GRAVITY = (0.0, 0.0, -9.81)
"""Gravity in the base frame of an arm that stands on the floor [m/s^2]."""


@dataclass(frozen=True)
class SmoothMotion:
    """A joint path and its derivatives at evenly spaced times.

    Attributes:
        q: Joint angles, shape (T, n) [rad, m].
        v: Joint speeds, shape (T, n) [rad/s, m/s].
        a: Joint accelerations, shape (T, n) [rad/s^2, m/s^2].
    """

    q: Array
    v: Array
    a: Array


def base_gravity(base: BasePose) -> Array:
    """Gravity as a base feels it that stands somewhere in a room, R^T (0, 0, -g), shape (3,) [m/s^2]."""
    pull: Array = base.rotation.T @ np.array(GRAVITY)
    return pull


def smooth_motion(time: ArrayLike, q: ArrayLike, window: float = PEAK_WINDOW) -> SmoothMotion:
    """Smooth a joint path and differentiate it, by Savitzky-Golay on T evenly spaced times.

    Uneven times are first brought to even ones by linear interpolation. Angles and speeds come from a cubic fitted over
    the window, accelerations from a quadratic: inside the path the two give the same acceleration, while at its ends
    the quadratic does not blow up noise. The window is the odd number of frames next to ``window``, at least 5; with
    3 or 4 frames one quadratic through 3 of them serves for everything.

    Args:
        time: Shape (T,), T >= 3, increasing [s].
        q: Shape (T, n) [rad, m].
        window: Length of the window [s].

    Raises:
        DesignError: There are too few frames, shapes do not match, values are not finite, or times do not increase.
        SettingsError: The window is not a positive number.
    """
    times, angles = checked_motion(time, q)
    if not (np.isfinite(window) and window > 0.0):
        raise SettingsError(f"the smoothing window is {window!r} s", value=window, allowed="> 0")
    even = np.linspace(times[0], times[-1], len(times))
    angles = np.stack([np.interp(even, times, column) for column in angles.T], axis=1)
    dt = float(times[-1] - times[0]) / (len(times) - 1)
    length = _window_frames(window / dt, len(times))
    order = min(3, length - 1)
    return SmoothMotion(
        q=scipy.signal.savgol_filter(angles, length, order, axis=0),
        v=scipy.signal.savgol_filter(angles, length, order, deriv=1, delta=dt, axis=0),
        a=scipy.signal.savgol_filter(angles, length, 2, deriv=2, delta=dt, axis=0),
    )


def joint_torques(arm: ArmBody, motion: SmoothMotion, payload: float = 0.0, gravity: ArrayLike = GRAVITY) -> Array:
    """Inverse dynamics of the arm along a motion, tau = M(q) a + C(q, v) v + g(q), by Pinocchio's ``rnea``.

    Args:
        arm: The arm and its solids.
        motion: The motion, T frames.
        payload: Point mass at tool0 [kg].
        gravity: Gravity in the base frame, shape (3,) [m/s^2]; see ``base_gravity`` for a base on a wall.

    Returns:
        Torques, shape (T, n) [N m; N of prismatic joints].
    """
    pull = np.asarray(gravity, dtype=float)
    if pull.shape != (3,) or not np.isfinite(pull).all():
        raise SettingsError("gravity is not a finite vector", value=gravity, allowed="three numbers [m/s^2]")
    model = dynamic_model(arm, payload)
    model.gravity.linear = pull
    data = model.createData()
    return np.stack([pin.rnea(model, data, *state) for state in zip(motion.q, motion.v, motion.a, strict=True)])


def dynamic_model(arm: ArmBody, payload: float = 0.0) -> Any:  # noqa: ANN401 (a pin.Model)
    """The Pinocchio model of an arm with the inertias of its solids.

    Args:
        arm: The arm and its solids.
        payload: Point mass at tool0 [kg].
    """
    table = arm.table
    model = arm_model(table)
    for joint, link in enumerate(arm.links[1:], start=1):
        inertial = link.inertial
        model.appendBodyToJoint(joint, pin.Inertia(inertial.mass, inertial.com, inertial.inertia), pin.SE3.Identity())
    tool = pin.SE3(table.placements()[-1])
    hand = tool_inertial(arm.options)
    model.appendBodyToJoint(table.dof, pin.Inertia(hand.mass, hand.com, hand.inertia), tool)
    model.appendBodyToJoint(table.dof, pin.Inertia(payload, np.zeros(3), np.zeros((3, 3))), tool)
    return model


def _window_frames(wanted: float, frames: int) -> int:
    """The odd window nearest to ``wanted`` frames, from 5 up to all of them; 3 where there are no 5 frames."""
    if frames < 5:
        return 3
    most = frames if frames % 2 else frames - 1
    nearest = 2 * round((min(wanted, most) - 1.0) / 2.0) + 1
    return int(np.clip(nearest, 5, most))


def checked_motion(time: ArrayLike, q: ArrayLike) -> tuple[Array, Array]:
    """Times (T,) and angles (T, n) as arrays.

    Raises:
        DesignError: Shapes do not match, there are fewer than 3 frames, values are not finite, or times do not
            increase.
    """
    times, angles = np.array(time, dtype=float), np.array(q, dtype=float)
    if times.ndim != 1 or angles.ndim != 2 or len(times) != len(angles) or angles.shape[1] < 1:
        raise DesignError(f"times of shape {times.shape} and angles of shape {angles.shape}", allowed="(T,) and (T, n)")
    if len(times) < 3:
        raise DesignError(f"the motion has {len(times)} frame(s)", value=len(times), allowed="3 or more")
    if not (np.isfinite(times).all() and np.isfinite(angles).all()):
        bad = int(np.flatnonzero(~(np.isfinite(times) & np.isfinite(angles).all(axis=1)))[0])
        raise DesignError(f"frame {bad} of the motion holds a value that is not finite", value=bad)
    if (np.diff(times) <= 0.0).any():
        bad = int(np.flatnonzero(np.diff(times) <= 0.0)[0]) + 1
        moment = float(times[bad])
        raise DesignError(f"the time of frame {bad}, {moment!r} s, is not after the one before", value=moment)
    return times, angles
