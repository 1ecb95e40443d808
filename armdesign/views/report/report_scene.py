"""What pictures of the room share: views at an angle, frames to one scale, shades from first to last instant."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from armdesign._types import Array
from armdesign.views.report.drawing import WIDTH, new_figure

ELEVATION = np.deg2rad(22.0)
SHADES = ("#B9CDDD", "#86AECB", "#4189B9", "#00456E")  # the first instant to the last, also in black and white


def framed(low: Array, high: Array, **room: float) -> Figure:
    """A figure with one axes from a low to a high corner, shape (2,) each, both directions to one scale.

    Args:
        low: Lowest corner [mm].
        high: Highest corner [mm].
        room: Left, right, bottom and top margin [inch].
    """
    width = WIDTH - room["left"] - room["right"]
    size = high - low
    height = float(np.clip(width * size[1] / size[0], 2.0, 4.4))
    figure = new_figure(height + room["bottom"] + room["top"], **room)
    axis = figure.subplots()
    spare = np.maximum(np.array([width, height]) / min(np.array([width, height]) / size) - size, 0.0) / 2.0
    (left, bottom), (right, top) = low - spare, high + spare
    axis.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    return figure


def box(points: Array) -> tuple[Array, Array]:
    """Lowest and highest corner around points of shape (p, 2), with a margin."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = 0.06 * float((high - low).max()) + 1e-6
    return low - margin, high + margin


def view(azimuth: float) -> Array:
    """Right and up of somebody who looks at the origin from an azimuth, shape (2, 3)."""
    c, s = np.cos(azimuth), np.sin(azimuth)
    sin_e, cos_e = np.sin(ELEVATION), np.cos(ELEVATION)
    return np.array([[-s, c, 0.0], [-sin_e * c, -sin_e * s, cos_e]])
