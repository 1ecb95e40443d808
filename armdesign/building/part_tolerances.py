"""What parts that are made may be off: what drawings state, and what it adds up to along a link.

Lengths are to ISO 2768-m, angles within ``ANGLE``. Deviations of parts are independent, so of what lies in a row the
squares add up: a link's length is off by the root of the sum of its parts' squares, and so is its twist.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from armdesign.building.parts import Assembly, Part

ISO_2768_M = ((6e-3, 0.1e-3), (30e-3, 0.2e-3), (120e-3, 0.3e-3), (400e-3, 0.5e-3), (1.0, 0.8e-3), (np.inf, 1.2e-3))
"""Deviations allowed of lengths up to so much [m]."""
ANGLE = float(np.radians(0.2))
"""Deviation allowed of angles [rad]."""
ANGLES = ("angle", "turn")
"""What names of dimensions that are angles begin with."""
IN_A_ROW: Mapping[str, tuple[str, ...]] = {
    "tube": ("length",), "spacer": ("length",), "tube flange": ("thickness",), "tool plate": ("thickness",),
    "base plate": ("thickness",), "corner": ("tube's side from corner",) * 2,
    "bracket": ("tube's plate from middle", "tube above middle", "high side", "tube above face"),
}  # fmt: skip
"""The dimensions of parts that a link's length is the sum of."""


def deviation(name: str, value: float) -> float:
    """What a dimension of a name and a value may be off either way [m; rad]."""
    return ANGLE if name.startswith(ANGLES) else next(off for most, off in ISO_2768_M if abs(value) <= most)


def deviations(part: Part) -> Iterator[tuple[bool, float]]:
    """What a part adds to its link: whether to its twist, and how much [rad; m]."""
    yield from ((True, ANGLE) for name in part.sizes if name.startswith(ANGLES))
    if not part.bought:  # what is drilled by the maker's drawing is turned as exactly as the rest
        yield from ((True, ANGLE) for circle in part.circles.values() if circle.maker)
    for name in IN_A_ROW.get(part.kind, ()):
        if name in part.sizes:
            yield False, deviation(name, part.sizes[name])


def link_deviations(assembly: Assembly, dof: int) -> tuple[tuple[float, float], ...]:
    """What length and twist of every link may be off, n + 1 pairs [m, rad].

    Args:
        assembly: The parts.
        dof: Number of joints n.
    """
    found = []
    for link in range(dof + 1):
        each = [off for placed in assembly.of_link(link) for off in deviations(placed.part)]
        lengths, twists = ([off for turned, off in each if turned is which] for which in (False, True))
        found.append((float(np.linalg.norm(lengths)), float(np.linalg.norm(twists))))
    return tuple(found)
