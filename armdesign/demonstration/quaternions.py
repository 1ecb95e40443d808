"""Unit quaternions x, y, z, w (scalar last) over time."""

from __future__ import annotations

import numpy as np

from armdesign.demonstration.recording import Array

_PARALLEL = 1e-6  # [rad] below this angle, straight and great-circle interpolation agree to rounding


def unit_continuous(quaternions: Array) -> Array:
    """Normalise, and choose each sign so that a quaternion lies in the same half-space as the one seen before it.

    Args:
        quaternions: Shape (T, 4); NaN = missing. No norm may be zero.

    Returns:
        The same rotations as unit quaternions, shape (T, 4); missing ones stay missing.
    """
    result: Array = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    seen = ~np.isnan(result[:, 0])
    known = result[seen]
    flips = np.where(np.sum(known[1:] * known[:-1], axis=1) < 0, -1.0, 1.0)
    result[seen] = known * np.concatenate([np.ones(min(1, len(known))), np.cumprod(flips)])[:, None]
    return result


def slerp(time: Array, quaternions: Array, at: Array) -> Array:
    """Interpolate along great circles, at constant angular velocity between two neighbours.

    With the angle phi between the neighbours a, b and s in [0, 1]:
    (sin((1 - s) phi) a + sin(s phi) b) / sin(phi).

    Args:
        time: Increasing times of the known quaternions, shape (K,) [s].
        quaternions: Known unit quaternions with continuous signs, shape (K, 4).
        at: Times wanted, within the known ones, shape (N,) [s].

    Returns:
        Shape (N, 4).
    """
    after = np.clip(np.searchsorted(time, at), 1, len(time) - 1)
    a, b = quaternions[after - 1], quaternions[after]
    s = ((at - time[after - 1]) / (time[after] - time[after - 1]))[:, None]
    phi = 2.0 * np.arctan2(np.linalg.norm(b - a, axis=1), np.linalg.norm(b + a, axis=1))[:, None]
    sine = np.sin(np.maximum(phi, _PARALLEL))
    weight_a = np.where(phi < _PARALLEL, 1.0 - s, np.sin((1.0 - s) * phi) / sine)
    weight_b = np.where(phi < _PARALLEL, s, np.sin(s * phi) / sine)
    mixed = weight_a * a + weight_b * b
    return np.asarray(mixed / np.linalg.norm(mixed, axis=1, keepdims=True))


def rotation_matrices(quaternions: Array) -> Array:
    """Rotation matrices of quaternions that are unit up to rounding or a few printed digits.

    R = I + 2 (w [v]x + [v]x [v]x) / |q|^2 with v = (x, y, z).

    Args:
        quaternions: Shape (T, 4).

    Returns:
        Shape (T, 3, 3), body to reference axes.
    """
    x, y, z, w = quaternions.T
    double = 2.0 / (x * x + y * y + z * z + w * w)
    rows = [
        [1 - double * (y * y + z * z), double * (x * y - z * w), double * (x * z + y * w)],
        [double * (x * y + z * w), 1 - double * (x * x + z * z), double * (y * z - x * w)],
        [double * (x * z - y * w), double * (y * z + x * w), 1 - double * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1).copy()
