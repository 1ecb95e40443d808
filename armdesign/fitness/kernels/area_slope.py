"""Gradient of the area E_t by every coordinate of an arm, see variations.

The sum over the pieces is gone through once: what pushes each piece is gathered per segment as a force and a moment,
what moves it along the arm is passed on to the cuts it lies between. The number of pieces is kept constant.
"""

from __future__ import annotations

import numpy as np

from armdesign.fitness.kernels.area import ROUNDING
from armdesign.fitness.kernels.association import MAX_POINTS
from armdesign.fitness.kernels.variations import YAW, coordinates, ends_of, own_shift
from armdesign.kinematics.compilation import branch, leaf
from armdesign.kinematics.kernels.skeleton import MAX_SEGMENTS

PULL = np.dtype(
    [
        ("force", np.float64, (MAX_SEGMENTS, 3)),  # sum of the gradients by a piece's place
        ("moment", np.float64, (MAX_SEGMENTS, 3)),
        ("base", np.float64, 3),  # sum of the gradients by p_0, where the base is
        ("along", np.float64, MAX_SEGMENTS),  # derivative by the pieces' distance from the segment's start
        ("cut", np.float64, MAX_POINTS + 1),  # derivative by the arc length of each cut, the base first
    ]
)
"""Scratch: derivatives of the total by what the pieces' places depend on."""


@branch
def area_slope(variation, pull, chain, match, points, delta, n):
    """Write the gradient of E_t, as frame_area computes it, to ``variation.area``."""
    for k in range(chain.segments):
        pull.along[k] = 0.0
        for r in range(3):
            pull.force[k, r] = pull.moment[k, r] = 0.0
    for i in range(len(points) + 1):
        pull.cut[i] = 0.0
    for r in range(3):
        pull.base[r] = 0.0
    total = pull_pieces(pull, chain, match, points, delta)
    spread_pull(variation, pull, chain, match, len(points), n)
    for c in range(variation.first, coordinates(n)):
        variation.area[c] = (variation.area[c] - total / chain.length * variation.stretch[c]) / chain.length


@branch
def pull_pieces(pull, chain, match, points, delta):
    """Gather the derivatives over all pieces; returns the total, E_t times L."""
    total, begin, k = 0.0, 0.0, 0
    for i in range(len(points)):
        end = chain.arc[match.segment[i]] + match.along[i]
        length = end - begin
        pieces = int(np.ceil(length / delta - ROUNDING))
        if pieces > 0:
            piece, part = length / pieces, 0.0
            for j in range(pieces):
                share = (j + 0.5) / pieces
                arc = begin + share * length
                while k + 1 < chain.segments and chain.arc[k + 1] <= arc:
                    k += 1
                start = points[i - 1] if i > 0 else points[i]
                distance, push = pull_piece(pull, chain, k, arc - chain.arc[k], start, points[i], piece, i > 0)
                part += distance
                pull.along[k] += push
                pull.cut[i] += (1.0 - share) * push
                pull.cut[i + 1] += share * push
            pull.cut[i] -= part / pieces
            pull.cut[i + 1] += part / pieces
            total += part * piece
        begin = end
    return total


@leaf
def pull_piece(pull, chain, k, along, start, end, piece, inner):
    """Distance of one piece to the demonstrated segment; its pull is added to segment k's, the part along given."""
    u = chain.direction[k]
    px, py, pz = (chain.start[k, 0] + along * u[0], chain.start[k, 1] + along * u[1], chain.start[k, 2] + along * u[2])
    ax = start[0] if inner else 0.0
    ay = start[1] if inner else 0.0
    az = start[2] if inner else 0.0
    bx, by, bz = end[0] - ax, end[1] - ay, end[2] - az
    square = bx * bx + by * by + bz * bz
    x, y, z = px - ax, py - ay, pz - az
    s = min(max((x * bx + y * by + z * bz) / square, 0.0), 1.0) if square > 0.0 else 0.0
    x, y, z = x - s * bx, y - s * by, z - s * bz
    distance = np.sqrt(x * x + y * y + z * z)
    scale = piece / distance if distance > 0.0 else 0.0  # gradient of |x| is x / |x|, weighted by the piece's length
    x, y, z = scale * x, scale * y, scale * z
    force, moment = pull.force[k], pull.moment[k]
    force[0], force[1], force[2] = force[0] + x, force[1] + y, force[2] + z
    moment[0] += py * z - pz * y
    moment[1] += pz * x - px * z
    moment[2] += px * y - py * x
    if not inner:  # the segment begins at the base, and moves with it there
        pull.base[0] -= (1.0 - s) * x
        pull.base[1] -= (1.0 - s) * y
        pull.base[2] -= (1.0 - s) * z
    return distance, x * u[0] + y * u[1] + z * u[2]


@branch
def spread_pull(variation, pull, chain, match, m, n):
    """Hand the derivatives on to the coordinates: those of segments, of their arcs, and of the cuts with theirs."""
    area, first = variation.area, variation.first
    for c in range(first, coordinates(n)):
        area[c] = 0.0
    for c in range(first, YAW):
        axis = variation.axis[c]
        area[c] = axis[0] * pull.base[0] + axis[1] * pull.base[1] + axis[2] * pull.base[2]
    for k in range(chain.segments):
        own, force, moment = own_shift(chain, k), pull.force[k], pull.moment[k]
        for c in range(first, own):
            axis = variation.axis[c]
            area[c] += axis[0] * force[0] + axis[1] * force[1] + axis[2] * force[2]
            area[c] += axis[3] * moment[0] + axis[4] * moment[1] + axis[5] * moment[2]
            area[c] -= pull.along[k] * variation.stretch[c]
    for i in range(m):
        own = own_shift(chain, match.segment[i])
        for c in range(first, own):
            area[c] += pull.cut[i + 1] * (variation.stretch[c] + variation.glide[i, c])
        for c in range(own, own + ends_of(chain, match.segment[i])):
            area[c] += pull.cut[i + 1] * variation.glide[i, c]
