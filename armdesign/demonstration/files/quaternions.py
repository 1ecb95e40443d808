"""Unit quaternions x, y, z, w (scalar last) over time, and turns by angles about axes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array

_PARALLEL = 1e-6  # [rad] below this angle, straight and great-circle interpolation agree to rounding
_SKEW = 0.01  # far above the rounding of matrices with five decimals, as Qualisys prints them
AXES = "XYZ"
ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")


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


def from_matrices(matrices: Array) -> Array:
    """Unit quaternions of rotation matrices; the inverse of ``rotation_matrices``.

    4 q_i q follows from the matrix for every component q_i; that with the largest |q_i| loses no digits.

    Args:
        matrices: Shape (T, 3, 3); NaN = missing.

    Returns:
        Shape (T, 4), each with one of its two signs; missing ones stay missing.
    """
    m = np.asarray(matrices, dtype=float)
    xx, yy, zz = m[:, 0, 0], m[:, 1, 1], m[:, 2, 2]
    xy, xz, yz = m[:, 1, 0] + m[:, 0, 1], m[:, 0, 2] + m[:, 2, 0], m[:, 2, 1] + m[:, 1, 2]
    wx, wy, wz = m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]
    rows = np.array(
        [
            [1 + xx - yy - zz, xy, xz, wx],
            [xy, 1 - xx + yy - zz, yz, wy],
            [xz, yz, 1 - xx - yy + zz, wz],
            [wx, wy, wz, 1 + xx + yy + zz],
        ]
    )
    best = np.einsum("iit->it", rows).argmax(axis=0)
    chosen = rows[best, :, np.arange(len(m))]
    return np.asarray(chosen / np.linalg.norm(chosen, axis=1, keepdims=True))


def are_rotations(matrices: Array) -> NDArray[np.bool_]:
    """Which matrices of shape (T, 3, 3) are right-handed with orthonormal columns to 1 %; False where missing."""
    with np.errstate(all="ignore"):
        skew = np.abs(matrices.transpose(0, 2, 1) @ matrices - np.eye(3)).max(axis=(1, 2))
        return np.asarray((skew < _SKEW) & (np.linalg.det(matrices) > 0))


def product(left: Array, right: Array) -> Array:
    """Quaternions of the rotations ``right`` and then ``left``, shape (..., 4): R(product(a, b)) = R(a) R(b)."""
    a, b = np.asarray(left), np.asarray(right)
    u, v, p, q = a[..., :3], b[..., :3], a[..., 3:], b[..., 3:]
    scalar = p * q - np.sum(u * v, axis=-1, keepdims=True)
    return np.concatenate([p * v + q * u + np.cross(u, v), scalar], axis=-1)


def identity(frames: int) -> Array:
    """The rotation that turns nothing, shape (4, T)."""
    result = np.zeros((4, frames))
    result[3] = 1.0
    return result


def turned(quaternions: Array, axis: int, angle: Array) -> Array:
    """Turn further about one of the axes that the turned body has by then: q (e_k sin(a / 2), cos(a / 2)).

    Args:
        quaternions: Shape (4, T).
        axis: 0, 1 or 2 for x, y or z.
        angle: Shape (T,) [rad].

    Returns:
        Shape (4, T).
    """
    i, j, k = axis, (axis + 1) % 3, (axis + 2) % 3
    sine, cosine = np.sin(0.5 * angle), np.cos(0.5 * angle)
    result = quaternions * cosine
    result[i] += sine * quaternions[3]
    result[j] += sine * quaternions[k]
    result[k] -= sine * quaternions[j]
    result[3] -= sine * quaternions[i]
    return result


def rotated(quaternions: Array, vectors: Array) -> Array:
    """Vectors turned by unit quaternions (u, w): v + 2 w (u x v) + 2 u x (u x v).

    Args:
        quaternions: Shape (4, T).
        vectors: Shape (3, T) or (3, 1).

    Returns:
        Shape (3, T).
    """
    u, w = quaternions[:3], quaternions[3]
    double = 2.0 * _cross(u, vectors)
    return np.asarray(vectors + w * double + _cross(u, double))


def euler_quaternions(order: str, angles: Array) -> Array:
    """Rotations of consecutive turns, each about an axis of the body as the turns before have left it (intrinsic).

    Args:
        order: The axes of the turns, such as ``XYZ``: first about x, then about the new y, then about the new z.
        angles: One column per turn, shape (T, 3) [rad].

    Returns:
        Body to reference axes, x, y, z, w, shape (T, 4).
    """
    result = identity(len(angles))
    for axis, angle in zip(order, angles.T, strict=True):
        result = turned(result, AXES.index(axis), angle)
    return result.T


def rotation_vector_quaternions(vectors: Array) -> Array:
    """Rotations about an axis by an angle, both in one vector of that direction and length: (u sin(a/2) / a, cos(a/2)).

    Args:
        vectors: Shape (T, 3) [rad].

    Returns:
        Quaternions x, y, z, w, shape (T, 4).
    """
    with np.errstate(over="ignore", invalid="ignore"):  # a damaged file holds any number
        angle = np.linalg.norm(vectors, axis=1, keepdims=True)
        angle[np.isinf(angle)] = np.nan
    return np.hstack([0.5 * np.sinc(angle / (2.0 * np.pi)) * vectors, np.cos(0.5 * angle)])


def _cross(a: Array, b: Array) -> Array:
    """Cross products of vectors of shape (3, T) or (3, 1)."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
