"""When the arm is where on its path: slower or faster than demonstrated, from rest to rest, within joint limits.

The path f stays as it is; only the demonstrated time s that the arm has got to becomes a function of the time t,
q(t) = f(s(t)), so that

    v = f'(s) ds/dt,    a = f''(s) (ds/dt)^2 + f'(s) d2s/dt2.

With u = speed * t, ds/du grows from 0 to 1 over the first ``ramp`` of u, along 3 x^2 - 2 x^3, and falls likewise at the
end. So the arm starts and ends at rest with zero acceleration, as trajectory controllers ask for, without leaving the
path; each ramp covers ``ramp / 2`` of the demonstration and so adds as much to its duration. A speed of c makes every
velocity c times and every acceleration c^2 times what it is at speed 1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import SettingsError
from armdesign.feasibility.needs import TURNING
from armdesign.kinematics.motion import SmoothPath, peak_times

RAMP = 0.5
"""Default length of the ramps at both ends [s of the demonstration]."""
SPEED_RANGE = (0.01, 10.0)
RATE_RANGE = (1.0, 10_000.0)
"""Samples per second [1/s]."""
MOST_SAMPLES = 10_000_000
MAX_ACCELERATION, MAX_SLIDE_ACCELERATION = 10.0, 5.0
"""Default joint acceleration limits, in the range of lightweight arms [rad/s^2]; of joints that slide [m/s^2]."""
_SLACK = 1e-3  # peaks are looked up at samples; between two they may be that much higher


@dataclass(frozen=True)
class Timing:
    """The demonstrated time s as a function of the time t.

    Attributes:
        start: Demonstrated time of the first frame [s].
        duration: Demonstrated time from the first frame to the last [s].
        speed: Factor on the demonstrated speed.
        ramp: Length of the ramps at both ends [s of the demonstration]; 0 to begin and end at full speed.
    """

    start: float
    duration: float
    speed: float = 1.0
    ramp: float = 0.0

    @property
    def total(self) -> float:
        """How long the motion takes [s]."""
        return (self.duration + self.ramp) / self.speed

    def at(self, time: ArrayLike) -> tuple[Array, Array, Array]:
        """Demonstrated time [s], its first [1] and second derivative [1/s] by time.

        Args:
            time: Times from 0 to ``total``, shape (N,) [s]; outside, the arm is at its first or last pose.

        Returns:
            Three arrays of shape (N,).
        """
        t = np.asarray(time, dtype=float)
        u = np.clip(self.speed * t, 0.0, self.duration + self.ramp)
        late = u > (self.duration + self.ramp) / 2.0
        near = np.where(late, self.duration + self.ramp - u, u)  # from the nearer end
        x = np.minimum(near / self.ramp, 1.0) if self.ramp > 0.0 else np.ones_like(u)
        done = self.ramp * (x**3 - x**4 / 2.0) + np.maximum(near - self.ramp, 0.0)
        bend = 6.0 * x * (1.0 - x) / self.ramp if self.ramp > 0.0 else np.zeros_like(u)
        s = self.start + np.where(late, self.duration - done, done)
        return s, self.speed * x * x * (3.0 - 2.0 * x), self.speed**2 * np.where(late, -bend, bend)


@dataclass(frozen=True, eq=False)
class Motion:
    """A joint trajectory of N samples.

    Attributes:
        time: Shape (N,), from 0 [s].
        demonstrated: Time in the demonstration that each sample stands for, shape (N,) [s].
        q: Joint angles, shape (N, n) [rad].
        v: Joint velocities, shape (N, n) [rad/s].
        a: Joint accelerations, shape (N, n) [rad/s^2].
    """

    time: Array
    demonstrated: Array
    q: Array
    v: Array
    a: Array


def timing_of(path: SmoothPath, *, speed: float = 1.0, ramp: float = RAMP) -> Timing:
    """The timing of a path at a constant factor of the demonstrated speed, with ramps at its ends.

    Args:
        path: The path.
        speed: Factor on the demonstrated speed.
        ramp: Length of the ramps [s of the demonstration]; at most the demonstration's duration is used.

    Raises:
        SettingsError: A number is out of range.
    """
    low, high = SPEED_RANGE
    if not low <= speed <= high:
        raise SettingsError(f"speed is {speed}", value=speed, allowed=f"{low:g} to {high:g} times the demonstrated one")
    if not 0.0 <= ramp < np.inf:
        raise SettingsError(f"ramp is {ramp} s", value=ramp, allowed="0 s or more")
    return Timing(path.start, path.duration, float(speed), min(float(ramp), path.duration))


def sample(path: SmoothPath, timing: Timing, rate: float) -> Motion:
    """The motion at even times k / rate from 0 on.

    With ramps the last sample is the first at or after the end, where the arm rests; without, the last before it.

    Args:
        path: The path.
        timing: When the arm is where on it.
        rate: Samples per second [1/s].

    Raises:
        SettingsError: The rate is out of range, or gives fewer than two or too many samples.
    """
    low, high = RATE_RANGE
    if not low <= rate <= high:
        raise SettingsError(f"rate is {rate} samples/s", value=rate, allowed=f"{low:g} to {high:g} samples/s")
    steps = timing.total * rate
    count = int(np.ceil(steps - 1e-6) if timing.ramp > 0.0 else np.floor(steps + 1e-6)) + 1
    if not 2 <= count <= MOST_SAMPLES:
        fix = "Take another rate"
        raise SettingsError(f"{timing.total:.3g} s at {rate:g} samples/s are {count} samples", value=rate, fix=fix)
    return motion_at(path, timing, np.arange(count) / rate)


def motion_at(path: SmoothPath, timing: Timing, time: ArrayLike) -> Motion:
    """The motion at given times.

    Args:
        path: The path.
        timing: When the arm is where on it.
        time: Shape (N,) [s].
    """
    t = np.asarray(time, dtype=float)
    s, ds, dds = timing.at(t)
    first, second = path.at(s, 1), path.at(s, 2)
    return Motion(t, s, path.at(s), first * ds[:, None], second * ds[:, None] ** 2 + first * dds[:, None])


def fastest_speed(
    path: SmoothPath,
    *,
    ramp: float = RAMP,
    velocity: ArrayLike = TURNING,
    acceleration: ArrayLike = MAX_ACCELERATION,
) -> tuple[float, str]:
    """The highest speed at which the joints' velocities and accelerations keep their limits, ramps included.

    With the peaks V and A of a joint at speed 1, the speed c gives c V and c^2 A: c = min(v_max / V, sqrt(a_max / A)).
    The peaks are looked up at 16 samples from knot to knot, and c is taken 0.1 % lower for what lies between them.

    Args:
        path: The path.
        ramp: Length of the ramps [s of the demonstration].
        velocity: Velocity limits, one or shape (n,) [rad/s; m/s].
        acceleration: Acceleration limits, one or shape (n,) [rad/s^2; m/s^2].

    Returns:
        The speed, not held within ``SPEED_RANGE``, and what decides it, as ``the velocity of joint_2``.

    Raises:
        SettingsError: A limit is not positive, or their number does not fit the joints.
    """
    bounds = [_limit("velocity", velocity, path.dof), _limit("acceleration", acceleration, path.dof)]
    timing = timing_of(path, ramp=ramp)
    extent = timing.duration + timing.ramp
    demonstrated = peak_times(path) - path.start
    ramps = np.linspace(0.0, timing.ramp, 16 * 64 + 1)
    motion = motion_at(path, timing, np.concatenate([ramps, demonstrated + timing.ramp / 2.0, extent - ramps]))
    with np.errstate(divide="ignore"):
        by_velocity = bounds[0] / np.abs(motion.v).max(axis=0)
        by_acceleration = np.sqrt(bounds[1] / np.abs(motion.a).max(axis=0))
    joint = int(np.argmin(np.minimum(by_velocity, by_acceleration)))
    what = "velocity" if by_velocity[joint] <= by_acceleration[joint] else "acceleration"
    return float((1.0 - _SLACK) * min(by_velocity[joint], by_acceleration[joint])), f"the {what} of joint_{joint + 1}"


def _limit(name: str, given: ArrayLike, dof: int) -> Array:
    """Limits of n joints, shape (n,)."""
    values = np.asarray(given, dtype=float)
    if values.shape not in ((), (1,), (dof,)) or not (values > 0.0).all():
        allowed = f"one number above 0, or one for each of {dof} joints"
        raise SettingsError(f"the {name} limits are {values.tolist()}", value=given, allowed=allowed)
    return np.asarray(np.broadcast_to(values, (dof,)))
