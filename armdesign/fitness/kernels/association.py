"""Which point of the arm belongs to which point of the demonstration: the sigma of eq. 3, eliminated exactly.

For a given q the free sigma minimise sum max(w_i, 1e-6) d_i^2 under sigma_1 <= ... <= sigma_m over the polyline.
Every point's own closest point is tried first; where the order fails, a dynamic programme over the segments with
isotonic regression inside each of them finds the optimum.
"""

from __future__ import annotations

import numpy as np

from armdesign.kinematics.compilation import branch, leaf
from armdesign.kinematics.kernels.skeleton import MAX_SEGMENTS

MAX_POINTS = 12
SMALLEST_WEIGHT = 1e-6

MATCH = np.dtype(
    [
        ("segment", np.int64, MAX_POINTS),  # segment each point is tied to
        ("along", np.float64, MAX_POINTS),  # where on it, from its start [m]
        ("pool", np.int64, MAX_POINTS),  # first point of the run that shares one place, by order
        ("sliding", np.int64, MAX_POINTS),  # 1 strictly inside its segment, 0 at an end or tied
        ("place", np.float64, (MAX_POINTS, 3)),  # s(sigma_i, q) [m]
        ("residual", np.float64, (MAX_POINTS, 3)),  # s(sigma_i, q) - p_i [m]
        ("distance", np.float64, MAX_POINTS),  # |residual| [m]
        # scratch of the dynamic programme
        ("projection", np.float64, (MAX_POINTS, MAX_SEGMENTS)),  # unclamped foot point of a point on a segment
        ("offset", np.float64, (MAX_POINTS, MAX_SEGMENTS)),  # squared distance to the segment's start
        ("near", np.float64, (MAX_POINTS, MAX_SEGMENTS)),  # squared distance to the segment
        ("cost", np.float64, (MAX_POINTS + 1, MAX_SEGMENTS + 1)),
        ("choice", np.int64, (MAX_POINTS + 1, MAX_SEGMENTS + 1)),
        ("level", np.float64, MAX_POINTS),
        ("mass", np.float64, MAX_POINTS),
        ("head", np.int64, MAX_POINTS),
    ]
)
"""Result and scratch of one association; one record an arm."""


@leaf
def associate(match, chain, points, weights, free):
    """Tie every point to its place on the arm.

    Args:
        match: Record of type MATCH, written.
        chain: Record of type CHAIN, up to date.
        points: Demonstrated points p_1..p_m of one frame, shape (m, 3) [m].
        weights: w_1..w_m, shape (m,).
        free: Number of free sigma: m, or m - 1 where the hand is tied to the end-effector.
    """
    if not closest_points(match, chain, points, free):
        ordered_points(match, chain, weights, free)
    for i in range(free):
        k = match.segment[i]
        inside = 0.0 < match.along[i] < chain.extent[k]
        match.sliding[i] = 1 if inside else 0
        for c in range(3):
            match.place[i, c] = chain.start[k, c] + match.along[i] * chain.direction[k, c]
    for i in range(free, len(points)):
        match.segment[i], match.pool[i], match.sliding[i] = chain.segments - 1, i, 0
        match.along[i] = chain.extent[chain.segments - 1]
        for c in range(3):
            match.place[i, c] = chain.tip[c]
    for i in range(len(points)):
        total = 0.0
        for c in range(3):
            match.residual[i, c] = match.place[i, c] - points[i, c]
            total += match.residual[i, c] * match.residual[i, c]
        match.distance[i] = np.sqrt(total)


@leaf
def at_end(chain, match, p):
    """Whether the place of point p is the end of its segment; of one without length, which is both, it is."""
    return match.along[p] >= chain.extent[match.segment[p]]


@leaf
def closest_points(match, chain, points, free):
    """Each point's own closest place. Returns whether these are already in order along the arm."""
    in_order = True  # sigma_1 <= ... <= sigma_m, section 3
    reached = 0.0
    for i in range(free):
        best = np.inf
        for k in range(chain.segments):
            x = points[i, 0] - chain.start[k, 0]
            y = points[i, 1] - chain.start[k, 1]
            z = points[i, 2] - chain.start[k, 2]
            foot = x * chain.direction[k, 0] + y * chain.direction[k, 1] + z * chain.direction[k, 2]
            square = x * x + y * y + z * z
            match.projection[i, k], match.offset[i, k] = foot, square
            along = min(max(foot, 0.0), chain.extent[k])
            square += along * (along - 2.0 * foot)  # |p - s|^2 by Pythagoras: |p - start|^2 - foot^2 + (foot - along)^2
            match.near[i, k] = square
            if square < best:
                best = square
                match.segment[i], match.along[i] = k, along
        match.pool[i] = i
        arc = chain.arc[match.segment[i]] + match.along[i]
        in_order = in_order and arc >= reached
        reached = arc
    return in_order


@branch
def ordered_points(match, chain, weights, free):
    """Best ordered places: cost[i, k] is the least cost of the first i points on the first k segments."""
    for k in range(chain.segments + 1):
        match.cost[0, k], match.choice[0, k] = 0.0, 0
    for i in range(1, free + 1):
        match.cost[i, 0] = np.inf
    for k in range(1, chain.segments + 1):
        for i in range(1, free + 1):
            match.cost[i, k], match.choice[i, k] = match.cost[i, k - 1], i
            bound = 0.0  # each point for itself costs no more than in order
            for first in range(i - 1, -1, -1):
                bound += max(weights[first], SMALLEST_WEIGHT) * match.near[first, k - 1]
                total = match.cost[first, k - 1] + bound
                if total < match.cost[i, k] and first < i - 1:
                    total = match.cost[first, k - 1] + isotonic_run(match, chain, weights, first, i, k - 1)
                if total < match.cost[i, k]:
                    match.cost[i, k], match.choice[i, k] = total, first
    last = free
    for k in range(chain.segments, 0, -1):
        first = match.choice[last, k]
        if first < last:
            isotonic_run(match, chain, weights, first, last, k - 1)
            for i in range(first, last):
                match.segment[i], match.along[i], match.pool[i] = k - 1, match.level[i], match.head[i]
        last = first


@branch
def isotonic_run(match, chain, weights, first, last, k):
    """Put points first..last - 1 on segment k in order, by pooling adjacent violators.

    The places are left in ``match.level``, the first point of each pool in ``match.head``. Limiting an isotonic
    regression to an interval is the same as clamping it.

    Returns:
        The weighted squared distance.
    """
    for i in range(first, last):
        match.level[i], match.mass[i], match.head[i] = match.projection[i, k], max(weights[i], SMALLEST_WEIGHT), i
        while match.head[i] > first and match.level[match.head[i] - 1] > match.level[i]:
            left = match.head[i] - 1
            mass = match.mass[left] + match.mass[i]
            match.level[i] = (match.mass[left] * match.level[left] + match.mass[i] * match.level[i]) / mass
            match.mass[i], match.head[i] = mass, match.head[left]
    i = last - 1
    while i >= first:  # the last point of a pool knows it; hand its level to the others
        head = match.head[i]
        for j in range(head, i):
            match.level[j], match.head[j] = match.level[i], head
        i = head - 1
    total = 0.0
    for i in range(first, last):
        along = min(max(match.level[i], 0.0), chain.extent[k])
        match.level[i] = along
        square = match.offset[i, k] + along * (along - 2.0 * match.projection[i, k])
        total += max(weights[i], SMALLEST_WEIGHT) * square
    return total
