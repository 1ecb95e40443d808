"""Turning by angles about axes, for formats that write orientations that way.

Quaternions are x, y, z, w with the components first, shape (4, T): each component is one block of memory.
"""

from __future__ import annotations

import numpy as np

from armdesign._types import Array

AXES = "XYZ"
ORDERS = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")


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


def _cross(a: Array, b: Array) -> Array:
    """Cross products of vectors of shape (3, T) or (3, 1)."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
