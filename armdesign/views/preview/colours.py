"""Colours of the preview: the arm, the demonstrator, and the scale on which distances are coloured.

Arm and demonstrator have the blue and the vermillion of Okabe and Ito. The scale is viridis, read from bright to dark:
its lightness falls evenly, so it can be read in grey and by the colour-blind, and large errors stand out on a light
background.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from armdesign._types import Array

ARM, DEMONSTRATOR = "#0072b2", "#d55e00"
BASE, TUBE, GRID, GRID_BOLD = "#3d4650", "#a9b7c4", "#ccd3da", "#9fabb7"
AXES = ("#cc3311", "#228833", "#0044aa")
SKY, GROUND = (0.99, 0.99, 1.0), (0.90, 0.92, 0.94)
"""Background, top and bottom, each red green blue in [0, 1]."""
VIRIDIS = ("#fde725", "#addc30", "#5ec962", "#28ae80", "#21918c", "#2c728e", "#3b528b", "#472d7b", "#440154")
"""Viridis from bright to dark, evenly spaced."""
STEPS = (1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True)
class Scale:
    """Distances from 0 to ``top`` as colours.

    Attributes:
        top: Distance of the last colour [m]; larger ones have it too.
    """

    top: float

    def rgb(self, distance: Array) -> Array:
        """Colours of distances [m], red green blue in [0, 1], one more axis of length 3."""
        anchors = np.array([components(colour) for colour in VIRIDIS])
        place = np.clip(np.asarray(distance) / self.top, 0.0, 1.0) * (len(anchors) - 1)
        return np.stack([np.interp(place, np.arange(len(anchors)), channel) for channel in anchors.T], axis=-1)


def scale_for(distance: Array) -> Scale:
    """The scale that ends at the largest distance, rounded up to 1, 2 or 5 times a power of ten [m]; 1 mm at least."""
    largest = max(float(np.max(distance)), 1e-3)
    power = 10.0 ** np.floor(np.log10(largest))
    return Scale(next(step * power for step in STEPS if step * power >= largest * (1.0 - 1e-9)))


def components(colour: str) -> tuple[float, float, float]:
    """Red, green and blue in [0, 1] of ``#rrggbb``."""
    red, green, blue = (int(colour[i : i + 2], 16) / 255.0 for i in (1, 3, 5))
    return red, green, blue


def number(colour: str) -> int:
    """``#rrggbb`` as the number that three.js takes."""
    return int(colour[1:], 16)
