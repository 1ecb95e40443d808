"""The area E_t between the arm and the demonstrated segments (method section 5)."""

from __future__ import annotations

import numpy as np

from armdesign.kinematics.compilation import branch

ROUNDING = 1e-9
"""Part of a piece that is put down to rounding: a part of ten whole pieces is cut into ten."""


@branch
def frame_area(chain, match, points, delta):
    """E_t: the length-weighted mean distance of the arm to the demonstrator's segments.

    The sigma cut the arm into parts, part i lies between sigma_{i-1} and sigma_i. Each part is cut into
    ceil(length / delta) equal pieces by arc length; a piece's midpoint has a distance to the straight segment
    p_{i-1} p_i, with p_0 the base.

    Args:
        chain: Record of type CHAIN, up to date.
        match: Record of type MATCH for the same pose.
        points: Shape (m, 3) [m].
        delta: Length of a piece [m].

    Returns:
        E_t [m].
    """
    total, begin, k = 0.0, 0.0, 0
    for i in range(len(points)):
        end = chain.arc[match.segment[i]] + match.along[i]
        length = end - begin
        pieces = int(np.ceil(length / delta - ROUNDING))  # section 5: ceil(length / delta)
        if pieces > 0:
            piece = length / pieces
            ax = points[i - 1, 0] if i > 0 else 0.0
            ay = points[i - 1, 1] if i > 0 else 0.0
            az = points[i - 1, 2] if i > 0 else 0.0
            bx, by, bz = points[i, 0] - ax, points[i, 1] - ay, points[i, 2] - az
            square = bx * bx + by * by + bz * bz
            inverse = 1.0 / square if square > 0.0 else 0.0
            part = 0.0
            for j in range(pieces):
                # pieces come in order of arc length, so the segment index k only ever grows
                arc = begin + (j + 0.5) * piece
                while k + 1 < chain.segments and chain.arc[k + 1] <= arc:
                    k += 1
                along = arc - chain.arc[k]
                x = chain.start[k, 0] + along * chain.direction[k, 0] - ax
                y = chain.start[k, 1] + along * chain.direction[k, 1] - ay
                z = chain.start[k, 2] + along * chain.direction[k, 2] - az
                s = min(max((x * bx + y * by + z * bz) * inverse, 0.0), 1.0)
                x, y, z = x - s * bx, y - s * by, z - s * bz
                part += np.sqrt(x * x + y * y + z * z)
            total += part * piece
        begin = end
    return total / chain.length  # E_t of section 5
