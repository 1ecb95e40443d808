"""A smooth joint path through the angles of the frames, with its velocities and accelerations, and what it changes.

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
from armdesign.kinematics.motion import checked_motion

CUTOFF = 6.0
"""Default cutoff [Hz], the usual one for the motion of human arms."""
CUTOFF_RANGE = (0.1, 1000.0)
KNOTS_PER_CYCLE = 8.0
"""Knots per period of the cutoff; more change the fit no further, since it is smoother than that."""
DEGREE = 5
_ROUNDS = 50
_NEAR = 1e-4  # [rad]; a path that comes so near to a limit at a sample may pass it between two


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


def fit_path(time: ArrayLike, q: ArrayLike, limits: ArrayLike | None = None, *, cutoff: float = CUTOFF) -> SmoothPath:
    """Fit a joint path.

    Where the fit of a joint leaves its limits, it is fitted again with the spline's control points kept inside. The
    spline lies in their hull, so it is inside at every time, not only at the frames.

    Args:
        time: Times of the frames, shape (T,), T >= 3, increasing [s].
        q: Joint angles without jumps by a full turn, shape (T, n) [rad].
        limits: Joint limits, shape (n, 2) [rad]; None for none.
        cutoff: Frequency of the motion that is kept by half [Hz]; at most half of the frame rate is used.

    Raises:
        DesignError: Times or angles are not usable, or the limits do not fit the joints.
        SettingsError: The cutoff is out of range.
    """
    times, angles = checked_motion(time, q)
    low, high = CUTOFF_RANGE
    if not low <= cutoff <= high:
        raise SettingsError(f"the cutoff is {cutoff} Hz", value=cutoff, allowed=f"{low:g} to {high:g} Hz")
    cutoff = min(float(cutoff), (len(times) - 1) / float(times[-1] - times[0]) / 2.0)
    knots = _knots(times, cutoff)
    basis = scipy.interpolate.BSpline.design_matrix(times, knots, DEGREE)
    system, right = basis.T @ basis + _roughness(times, knots, cutoff), basis.T @ angles
    points = _solve(system, right)
    bounded: tuple[int, ...] = ()
    if limits is not None:
        bounds = _checked_limits(limits, angles.shape[1])
        bounded = _outside(scipy.interpolate.BSpline(knots, points, DEGREE), bounds)
        for joint in bounded:
            points[:, joint] = bounded_minimum(system, right[:, joint], *bounds[joint])
    deviation = np.abs(basis @ points - angles).max(axis=0)
    return SmoothPath(times, scipy.interpolate.BSpline(knots, points, DEGREE), deviation, bounded, cutoff)


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
    values = scipy.interpolate.BSpline.design_matrix(at.ravel(), knots[3:-3], DEGREE - 3) @ _third_derivative(knots)
    step = (times[-1] - times[0]) / (len(times) - 1)
    strength = 1.0 / (step * (2.0 * np.pi * cutoff) ** 6)
    return scipy.sparse.csc_array(strength * (values.T @ scipy.sparse.diags_array((half * weights).ravel()) @ values))


def _third_derivative(knots: Array) -> scipy.sparse.csc_array:
    """Matrix from the control points of a spline to those of its third derivative, shape (K - 3, K)."""
    matrix = scipy.sparse.eye_array(len(knots) - DEGREE - 1)
    for degree in range(DEGREE, DEGREE - 3, -1):
        factor = degree / (knots[degree + 1 : -1] - knots[1 : -degree - 1])
        matrix = (
            scipy.sparse.diags_array([-factor, factor], offsets=[0, 1], shape=(len(factor), len(factor) + 1)) @ matrix
        )
        knots = knots[1:-1]
    return scipy.sparse.csc_array(matrix)


def _solve(system: scipy.sparse.csc_array, right: Array) -> Array:
    """Solution of a sparse system for every column."""
    return np.asarray(scipy.sparse.linalg.splu(system.tocsc()).solve(right))


def _outside(spline: scipy.interpolate.BSpline, limits: Array) -> tuple[int, ...]:
    """Joints whose path leaves its limits somewhere."""
    q = spline(_between(spline.t))
    leaves = (q.min(axis=0) < limits[:, 0] + _NEAR) | (q.max(axis=0) > limits[:, 1] - _NEAR)
    beyond = (spline.c.min(axis=0) < limits[:, 0]) | (spline.c.max(axis=0) > limits[:, 1])
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
    points, force = _solve(system, right), np.zeros(len(right))
    at_low, at_high = np.zeros(len(right), dtype=bool), np.zeros(len(right), dtype=bool)
    for _ in range(_ROUNDS):
        now_low, now_high = (points < low) | (at_low & (force > 0.0)), (points > high) | (at_high & (force < 0.0))
        if np.array_equal(now_low, at_low) and np.array_equal(now_high, at_high):
            break
        at_low, at_high = now_low, now_high
        free = np.flatnonzero(~(at_low | at_high))
        points = np.where(at_low, low, np.where(at_high, high, 0.0))
        if len(free):
            points[free] = _solve(system[free][:, free], (right - system @ points)[free])
        force = system @ points - right
    return np.clip(points, low, high)


def _checked_limits(limits: ArrayLike, dof: int) -> Array:
    """Joint limits as an array, shape (n, 2).

    Raises:
        DesignError: There are not two for each joint, or a lower one is not below the upper.
    """
    bounds = np.asarray(limits, dtype=float)
    if bounds.shape != (dof, 2) or not (bounds[:, 0] < bounds[:, 1]).all():
        raise DesignError(
            "the joint limits do not fit the motion", value=limits, allowed=f"shape ({dof}, 2), lower < upper"
        )
    return bounds
