"""What the search's capsules are made of, from the settings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.bodies.kernels.capsules import SIZES
from armdesign.settings import Body


def capsule_sizes(
    body: Body, limits: Array, prismatic: Sequence[bool] = (), *, placed: bool = False
) -> NDArray[np.void]:
    """The sizes of the capsules about all solids.

    Args:
        body: What the arm is built of.
        limits: Joint limits, shape (n, 2) [rad; m of prismatic joints].
        prismatic: Which of the n joints slide; none by default.
        placed: Whether the base stands on a mounting face, so that its plate is known.

    Returns:
        One SIZES record, shape (1,).
    """
    sizes = np.zeros(1, dtype=SIZES)
    record = sizes[0]
    record["tube"], record["slide"] = body.tube_diameter / 2.0, body.module_slide
    for j, module in enumerate(body.modules_of(len(limits))):
        record["housing_half"][j], record["housing"][j] = capsule_about(module.diameter / 2.0, module.length)
        record["reach"][j] = body.reach_about(module)
    record["plate_half"], record["plate"] = capsule_about(body.base_diameter / 2.0, body.base_height)
    record["placed"], record["plate_centre"] = placed, body.base_height / 2.0
    record["prismatic"][: len(prismatic)] = prismatic
    record["lower"][: len(limits)], record["upper"][: len(limits)] = limits.T
    return sizes


def capsule_about(radius: float, length: float) -> tuple[float, float]:
    """Half length of the segment and radius of a capsule whose caps go through the rims of a cylinder [m]."""
    return length / 4.0, float(np.hypot(radius, length / 4.0))
