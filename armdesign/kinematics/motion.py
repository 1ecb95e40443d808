"""The smooth motion of the joints: one spline through a joint path, which verdict, report, builds and export all use.

The angles y_i of a joint at the frames' times t_i are fitted by the spline f of degree 5 that minimises

    sum_i (y_i - f(t_i))^2 + lambda * integral of f'''(t)^2 dt,

f is C4, so velocities, accelerations and jerks are continuous; its ends are free. Of frames dt apart the fit keeps an
oscillation of angular frequency w by the factor 1 / (1 + lambda dt w^6). That is a low-pass without phase, and lambda
is chosen so that the factor is 1/2 at a cutoff frequency. Quadratics stay as they are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import DesignError, SettingsError

CUTOFF = 6.0
"""Default cutoff [Hz], the usual one for the motion of human arms."""
CUTOFF_RANGE = (0.1, 1000.0)
KNOTS_PER_CYCLE = 8.0
"""Knots per period of the cutoff; more change the fit no further, since it is smoother than that."""
DEGREE = 5
_ROUNDS = 50
_NEAR = 1e-4  # [rad]; a path that comes so near to a limit at a sample may pass it between two


@dataclass(frozen=True)
class SmoothMotion:
    """The smooth path and its derivatives at the frames.

    Attributes:
        q: Joint angles, shape (T, n) [rad; m of joints that slide].
        v: Joint speeds, shape (T, n) [rad/s].
        a: Joint accelerations, shape (T, n) [rad/s^2].
    """

    q: Array
    v: Array
    a: Array

    def at_speed(self, share: float) -> SmoothMotion:
        """The motion along the same path at this share of the speed."""
        return SmoothMotion(self.q, share * self.v, share**2 * self.a)


@dataclass(frozen=True, eq=False)
class SmoothPath:
    """A joint path of class C4 over the times of the frames.

    Attributes:
        time: Times of the frames, shape (T,) [s].
        spline: The path, n joints at once.
        deviation: Largest change of each joint's angle at a frame, shape (n,) [rad].
        bounded: Joints, from 0, whose fit had to be held inside their limits.
        cutoff: Frequency that is kept by half [Hz]; at most half of the frame rate.
    """

    time: Array
    spline: scipy.interpolate.BSpline
    deviation: Array
    bounded: tuple[int, ...]
    cutoff: float

    @property
    def start(self) -> float:
        """Time of the first frame [s]."""
        return float(self.time[0])

    @property
    def duration(self) -> float:
        """Time from the first frame to the last [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return len(self.deviation)

    def at(self, time: ArrayLike, order: int = 0) -> Array:
        """Angles, or their derivatives of an order up to 5, at times within those of the frames.

        Args:
            time: Shape (N,) [s]; times outside count as the first or the last.
            order: 0 for angles, 1 for velocities, 2 for accelerations ...

        Returns:
            Shape (N, n) [rad/s^order].
        """
        inside = np.clip(np.asarray(time, dtype=float), self.time[0], self.time[-1])
        return np.asarray(self.spline(inside, nu=order), dtype=float)


class Smoothing:
    """The fit of joint paths over the times of one demonstration, laid out once for many paths.

    Where the fit of a joint leaves its limits, it is fitted again with the spline's control points kept inside. The
    spline lies in their hull, so it is inside at every time, not only at the frames. Where the path itself is beyond a
    limit, it is held at the path's own extreme.
    """

    def __init__(self, time: ArrayLike, limits: ArrayLike | None = None, cutoff: float = CUTOFF) -> None:
        """Lay out the fit.

        Args:
            time: Times of the frames, shape (T,), T >= 3, increasing [s].
            limits: Joint limits, shape (n, 2) [rad]; None for none.
            cutoff: Frequency of the motion that is kept by half [Hz]; at most half of the frame rate is used.

        Raises:
            DesignError: Times or limits are not usable.
            SettingsError: The cutoff is out of range.
        """
        self.time = checked_times(time)
        low, high = CUTOFF_RANGE
        if not low <= cutoff <= high:
            raise SettingsError(f"the cutoff is {cutoff} Hz", value=cutoff, allowed=f"{low:g} to {high:g} Hz")
        self.limits = None if limits is None else checked_limits(limits)
        self.cutoff = min(float(cutoff), (len(self.time) - 1) / float(self.time[-1] - self.time[0]) / 2.0)
        self.knots = _knots(self.time, self.cutoff)
        self.rows = tuple(_derivative_matrix(self.time, self.knots, order) for order in range(3))
        """Matrices from control points to angles, velocities and accelerations at the frames, shape (T, K) each."""
        self.system = (self.rows[0].T @ self.rows[0] + _roughness(self.time, self.knots, self.cutoff)).tocsc()
        self._solve = scipy.sparse.linalg.splu(self.system).solve

    def path(self, q: ArrayLike) -> SmoothPath:
        """Fit a joint path without jumps by a full turn, shape (T, n) [rad].

        Raises:
            DesignError: The angles are not usable, or the limits do not fit the joints.
        """
        angles = checked_angles(q, len(self.time))
        points, bounded = self._points(angles)
        spline = scipy.interpolate.BSpline(self.knots, points, DEGREE)
        return SmoothPath(self.time, spline, np.abs(self.rows[0] @ points - angles).max(axis=0), bounded, self.cutoff)

    def motion(self, q: ArrayLike) -> SmoothMotion:
        """The fit of a joint path, shape (T, n) [rad], and its derivatives at the frames.

        Raises:
            DesignError: As ``path``.
        """
        points, _ = self._points(checked_angles(q, len(self.time)))
        return SmoothMotion(*(rows @ points for rows in self.rows))

    def weights(self, order: int, frame: int) -> Array:
        """Derivative of a fitted angle, speed or acceleration by the angles it is fitted to, shape (T,).

        Args:
            order: 0 for the angle, 1 for the speed, 2 for the acceleration.
            frame: The frame that it is taken in.
        """
        row = self.rows[order][[frame]].toarray()[0]
        return np.asarray(self.rows[0] @ self._solve(row))

    def _points(self, angles: Array) -> tuple[Array, tuple[int, ...]]:
        """Control points of the fit, shape (K, n), and the joints that were held inside their limits."""
        right = self.rows[0].T @ angles
        points = np.asarray(self._solve(right))
        if self.limits is None:
            return points, ()
        if len(self.limits) != angles.shape[1]:
            allowed = f"shape ({angles.shape[1]}, 2)"
            raise DesignError("the joint limits do not fit the motion", value=self.limits.tolist(), allowed=allowed)
        low, high = np.minimum(self.limits[:, 0], angles.min(axis=0)), np.maximum(self.limits[:, 1], angles.max(axis=0))
        bounded = _outside(self.knots, points, np.stack([low, high], axis=1))
        for joint in bounded:
            points[:, joint] = bounded_minimum(self.system, right[:, joint], low[joint], high[joint])
        return points, bounded


def fit_path(time: ArrayLike, q: ArrayLike, limits: ArrayLike | None = None, *, cutoff: float = CUTOFF) -> SmoothPath:
    """Fit a joint path, as ``Smoothing`` does.

    Args:
        time: Times of the frames, shape (T,), T >= 3, increasing [s].
        q: Joint angles without jumps by a full turn, shape (T, n) [rad].
        limits: Joint limits, shape (n, 2) [rad]; None for none.
        cutoff: Frequency of the motion that is kept by half [Hz]; at most half of the frame rate is used.

    Raises:
        DesignError: Times or angles are not usable, or the limits do not fit the joints.
        SettingsError: The cutoff is out of range.
    """
    return Smoothing(time, limits, cutoff).path(q)


def smooth_motion(time: ArrayLike, q: ArrayLike, limits: ArrayLike | None = None) -> SmoothMotion:
    """The fit of a joint path and its derivatives at the frames; see ``fit_path``."""
    return Smoothing(time, limits).motion(q)


def peak_times(path: SmoothPath) -> Array:
    """Times close enough to see every peak of a path and of its derivatives: 16 from knot to knot, shape (N,) [s]."""
    return _between(np.asarray(path.spline.t))


def _between(knots: Array) -> Array:
    """16 even times from knot to knot."""
    return np.linspace(knots[0], knots[-1], 16 * (len(knots) - 2 * DEGREE - 1) + 1)


def _knots(times: Array, cutoff: float) -> Array:
    """Evenly spaced knots, not more than there are frames, those at the ends repeated."""
    first, last = times[[0, -1]]
    pieces = min(len(times) - 1, int(np.ceil((last - first) * cutoff * KNOTS_PER_CYCLE)))
    inner = np.linspace(first, last, pieces + 1)
    return np.concatenate([np.full(DEGREE, first), inner, np.full(DEGREE, last)])


def _roughness(times: Array, knots: Array, cutoff: float) -> scipy.sparse.csc_array:
    """Matrix W with c^T W c = lambda * integral of f'''^2 for control points c, shape (K, K).

    f''' is of degree 2 from knot to knot, so three Gauss points integrate its square exactly.
    """
    nodes, weights = np.polynomial.legendre.leggauss(3)
    inner = knots[DEGREE:-DEGREE]
    half = np.diff(inner)[:, None] / 2.0
    at = inner[:-1, None] + half * (1.0 + nodes)
    values = _derivative_matrix(at.ravel(), knots, 3)
    step = (times[-1] - times[0]) / (len(times) - 1)
    strength = 1.0 / (step * (2.0 * np.pi * cutoff) ** 6)
    return scipy.sparse.csc_array(strength * (values.T @ scipy.sparse.diags_array((half * weights).ravel()) @ values))


def _derivative_matrix(times: Array, knots: Array, order: int) -> scipy.sparse.csr_array:
    """Matrix from the control points of a spline to its derivative of an order at times (N,), shape (N, K)."""
    matrix = scipy.sparse.eye_array(len(knots) - DEGREE - 1)
    for degree in range(DEGREE, DEGREE - order, -1):
        factor = degree / (knots[degree + 1 : -1] - knots[1 : -degree - 1])
        matrix = (
            scipy.sparse.diags_array([-factor, factor], offsets=[0, 1], shape=(len(factor), len(factor) + 1)) @ matrix
        )
        knots = knots[1:-1]
    return scipy.sparse.csr_array(scipy.interpolate.BSpline.design_matrix(times, knots, DEGREE - order) @ matrix)


def _outside(knots: Array, points: Array, limits: Array) -> tuple[int, ...]:
    """Joints whose path leaves its limits somewhere."""
    beyond = (points.min(axis=0) < limits[:, 0]) | (points.max(axis=0) > limits[:, 1])
    if not beyond.any():
        return ()
    q = scipy.interpolate.BSpline(knots, points, DEGREE)(_between(knots))
    leaves = (q.min(axis=0) < limits[:, 0] + _NEAR) | (q.max(axis=0) > limits[:, 1] - _NEAR)
    return tuple(int(joint) for joint in np.flatnonzero(leaves & beyond))


def bounded_minimum(system: scipy.sparse.csc_array, right: Array, low: float, high: float) -> Array:
    """Control points c of one joint in [low, high] that minimise c^T A c / 2 - b^T c, shape (K,).

    Primal-dual active sets: solve with the points fixed that left the range, free those whose force points inwards.

    Args:
        system: A, shape (K, K).
        right: b, shape (K,).
        low: Lower limit [rad].
        high: Upper limit [rad].
    """

    def solve(matrix: scipy.sparse.csc_array, values: Array) -> Array:
        return np.asarray(scipy.sparse.linalg.splu(matrix.tocsc()).solve(values))

    points, force = solve(system, right), np.zeros(len(right))
    at_low, at_high = np.zeros(len(right), dtype=bool), np.zeros(len(right), dtype=bool)
    for _ in range(_ROUNDS):
        now_low, now_high = (points < low) | (at_low & (force > 0.0)), (points > high) | (at_high & (force < 0.0))
        if np.array_equal(now_low, at_low) and np.array_equal(now_high, at_high):
            break
        at_low, at_high = now_low, now_high
        free = np.flatnonzero(~(at_low | at_high))
        points = np.where(at_low, low, np.where(at_high, high, 0.0))
        if len(free):
            points[free] = solve(system[free][:, free], (right - system @ points)[free])
        force = system @ points - right
    return np.clip(points, low, high)


def checked_times(time: ArrayLike) -> Array:
    """Times of frames as an array, shape (T,) [s].

    Raises:
        DesignError: There are fewer than 3, they are not finite, or do not increase.
    """
    times = np.array(time, dtype=float)
    if times.ndim != 1:
        raise DesignError(f"times of shape {times.shape}", allowed="(T,)")
    if len(times) < 3:
        raise DesignError(f"the motion has {len(times)} frame(s)", value=len(times), allowed="3 or more")
    if not np.isfinite(times).all():
        bad = int(np.flatnonzero(~np.isfinite(times))[0])
        raise DesignError(f"the time of frame {bad} of the motion is not finite", value=bad)
    if (np.diff(times) <= 0.0).any():
        bad = int(np.flatnonzero(np.diff(times) <= 0.0)[0]) + 1
        moment = float(times[bad])
        raise DesignError(f"the time of frame {bad}, {moment!r} s, is not after the one before", value=moment)
    return times


def checked_angles(q: ArrayLike, frames: int) -> Array:
    """A joint path of so many frames as an array, shape (T, n).

    Raises:
        DesignError: Its shape does not fit, or values are not finite.
    """
    angles = np.array(q, dtype=float)
    if angles.ndim != 2 or len(angles) != frames or angles.shape[1] < 1:
        raise DesignError(f"times of shape {(frames,)} and angles of shape {angles.shape}", allowed="(T,) and (T, n)")
    if not np.isfinite(angles).all():
        bad = int(np.flatnonzero(~np.isfinite(angles).all(axis=1))[0])
        raise DesignError(f"frame {bad} of the motion holds a value that is not finite", value=bad)
    return angles


def checked_limits(limits: ArrayLike) -> Array:
    """Joint limits as an array, shape (n, 2).

    Raises:
        DesignError: There are not two for each joint, or a lower one is not below the upper.
    """
    bounds = np.asarray(limits, dtype=float)
    if bounds.ndim != 2 or bounds.shape[1] != 2 or not (bounds[:, 0] < bounds[:, 1]).all():
        raise DesignError("the joint limits are not usable", value=limits, allowed="shape (n, 2), lower < upper")
    return bounds
