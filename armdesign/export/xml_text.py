"""Numbers, frames and names as robot files take them; nothing is rounded."""

from __future__ import annotations

import re
import unicodedata

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.export.options import DEFAULT_NAME


def number(value: float) -> str:
    """The shortest text that reads back as the same double; no negative zero."""
    return repr(float(value) + 0.0)


def numbers(values: ArrayLike) -> str:
    """Numbers on one line."""
    return " ".join(number(value) for value in np.asarray(values, dtype=float).ravel())


def safe_name(name: str, default: str = DEFAULT_NAME) -> str:
    """A name every reader takes: ASCII letters, digits and underscores, starting with a letter.

    Accents are dropped, any other run of characters becomes one underscore; nothing left gives the default.
    """
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode("ascii")
    plain = re.sub(r"[^A-Za-z0-9]+", "_", plain).strip("_")
    if not plain:
        return default
    return plain if plain[0].isalpha() else f"{default}_{plain}"


def safe_names(names: list[str], default: str) -> list[str]:
    """Names made safe, and numbered where two become the same.

    Args:
        names: The names.
        default: Name of what has no letter or digit.
    """
    taken: list[str] = []
    for name in names:
        safe = plain = safe_name(name, default)
        k = 2
        while safe in taken:
            safe, k = f"{plain}_{k}", k + 1
        taken.append(safe)
    return taken


def rpy(rotation: Array) -> Array:
    """Roll, pitch and yaw about fixed axes, R = Rz(yaw) Ry(pitch) Rx(roll), as URDF and SDF have it.

    Yaw is read off first; pitch and roll are those of what is left after undoing it. So at and near gimbal lock
    (pitch = +-90 deg), where roll and yaw are not defined one by one, the three still rebuild R to rounding.

    Args:
        rotation: Shape (3, 3).

    Returns:
        Shape (3,) [rad].
    """
    R = rotation
    yaw = np.arctan2(R[1, 0], R[0, 0])
    c, s = np.cos(yaw), np.sin(yaw)
    pitch = np.arctan2(-R[2, 0], c * R[0, 0] + s * R[1, 0])
    roll = np.arctan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return np.array([roll, pitch, yaw])


def quaternion(rotation: Array) -> Array:
    """A rotation as w, x, y, z with w >= 0, by the largest of the four, so that no digits are lost.

    Args:
        rotation: Shape (3, 3).

    Returns:
        Shape (4,).
    """
    R = rotation
    squares = 1.0 + np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) @ np.diag(R)  # 4 w^2, 4 x^2, ...
    wx, wy, wz = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    xy, xz, yz = R[1, 0] + R[0, 1], R[0, 2] + R[2, 0], R[2, 1] + R[1, 2]
    products = np.array([[0, wx, wy, wz], [wx, 0, xy, xz], [wy, xy, 0, yz], [wz, xz, yz, 0]])  # 4 w x, ...
    largest = int(np.argmax(squares))
    row = products[largest]
    row[largest] = squares[largest]
    unit: Array = row / np.linalg.norm(row)
    return -unit if unit[0] < 0.0 else unit
