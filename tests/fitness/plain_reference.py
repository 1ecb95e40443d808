"""The method in plain NumPy and SciPy, written from its formulas alone: nothing here is shared with the package.

Slow and simple: an arm is a polyline of vertices, an association is a dynamic programme over candidate places.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

SMALLEST_WEIGHT = 1e-6


def turn(axis, angle):
    """Homogeneous rotation about a coordinate axis."""
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler(axis, angle).as_matrix()
    return pose


def shift(x, y, z):
    """Homogeneous translation."""
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def arm(dh, q, yaw=0.0):
    """Vertices of the skeleton, base to tool with pieces of no length left out, and the tool frame.

    Eq. 2: T_i = Rx(alpha_i) Tx(a_i) Tz(d_i) Rz(theta_i + q_i); the skeleton goes along x by a_i, then along z by d_i.

    Args:
        dh: Rows (alpha, a, d) or (alpha, a, d, theta), tool last, shape (n + 1, 3 or 4).
        q: Joint angles, shape (n,).
        yaw: Turn about z before row 0.
    """
    pose, vertices = turn("z", yaw), [np.zeros(3)]
    for i, (alpha, a, d, *theta) in enumerate(np.asarray(dh, dtype=float)):
        pose = pose @ turn("x", alpha)
        for length, step in ((a, shift(a, 0, 0)), (d, shift(0, 0, d))):
            pose = pose @ step
            if length != 0.0:
                vertices.append(pose[:3, 3].copy())
        angle = (theta[0] if theta else 0.0) + (q[i] if i < len(q) else 0.0)
        pose = pose @ turn("z", angle)
    return np.array(vertices), pose


def arc_lengths(vertices):
    """Arc length at every vertex."""
    return np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(vertices, axis=0), axis=1))]


def point_at(vertices, arc):
    """Points of the polyline at given arc lengths, shape (k, 3)."""
    arcs = arc_lengths(vertices)
    return np.stack([np.interp(arc, arcs, vertices[:, c]) for c in range(3)], axis=-1)


def associate(vertices, points, weights, tie_hand=True):
    """Arc lengths of the exact optimum: min sum max(w_i, 1e-6) d_i^2 with arcs that do not decrease.

    Points that share a place at the optimum form a run; a run's common place minimises its cost on some segment, so
    it is the run's mean foot point there, clamped to the segment. All runs on all segments give finitely many
    candidates that contain the optimum; the ordered choice among them is a dynamic programme.
    """
    arcs = arc_lengths(vertices)
    count = len(points) - 1 if tie_hand else len(points)
    w = np.maximum(weights, SMALLEST_WEIGHT)
    starts, pieces, extents = vertices[:-1], np.diff(vertices, axis=0), np.diff(arcs)
    feet = np.einsum("pkc,kc->pk", points[:count, None] - starts[None], pieces) / extents
    places = []
    for first in range(count):
        for end in range(first + 1, count + 1):
            common = np.average(feet[first:end], axis=0, weights=w[first:end])
            places.append(arcs[:-1] + np.clip(common, 0.0, extents))
    chosen = np.zeros(0)
    if count:
        candidates = np.sort(np.concatenate(places))
        on_arm = point_at(vertices, candidates)
        costs = [w[i] * ((on_arm - points[i]) ** 2).sum(axis=1) for i in range(count)]
        chosen = candidates[best_order(costs)]
    return np.r_[chosen, arcs[-1]] if tie_hand else chosen


def best_order(costs):
    """Indices i_1 <= i_2 <= ... with the least sum of costs[k][i_k]."""
    total, cheapest = costs[0], []
    for cost in costs[1:]:
        best = np.minimum.accumulate(total)
        where = np.maximum.accumulate(np.where(total == best, np.arange(len(total)), 0))
        cheapest.append(where)
        total = total[where] + cost
    order = [int(np.argmin(total))]
    for where in reversed(cheapest):
        order.append(int(where[order[-1]]))
    return order[::-1]


def orientation_error(hand, target, metric):
    """e_R in the three metrics of method section 3."""
    if metric == "geodesic":
        return Rotation.from_matrix(hand.T @ target).magnitude()
    if metric == "axis":
        return 2.0 * np.arcsin(min(1.0, np.linalg.norm(hand[:, 2] - target[:, 2]) / 2.0))
    roll_pitch_yaw = [Rotation.from_matrix(R).as_euler("xyz") for R in (hand, target)]
    difference = roll_pitch_yaw[0] - roll_pitch_yaw[1]
    return np.linalg.norm(np.pi - np.mod(np.pi - difference, 2.0 * np.pi))


def temporal(vertices, tool, points, weights, *, w_0=0.0, target=None, mount=None, metric="geodesic", tie_hand=True):
    """Eq. 3: g, the arcs of the points, their distances and e_R."""
    arcs = associate(vertices, points, weights, tie_hand)
    distance = np.linalg.norm(point_at(vertices, arcs) - points, axis=1)
    error = 0.0
    if w_0 > 0.0:
        error = orientation_error(tool[:3, :3] @ (np.eye(3) if mount is None else mount), target, metric)
    return np.sqrt(np.sum(weights * distance**2)) / len(points) + w_0 * error, arcs, distance, error


def area(vertices, arcs, points, delta=0.01):
    """E_t of method section 5: the length-weighted mean distance to the demonstrator's segments."""
    total, begin = 0.0, 0.0
    joints = np.vstack([np.zeros(3), points])
    for p, q, end in zip(joints[:-1], joints[1:], arcs, strict=True):
        pieces = int(np.ceil((end - begin) / delta - 1e-9))  # a last bit more makes no further piece
        if pieces > 0:
            middle = begin + (np.arange(pieces) + 0.5) * (end - begin) / pieces
            x, axis = point_at(vertices, middle) - p, q - p
            s = np.clip(x @ axis / max(axis @ axis, 1e-300), 0.0, 1.0)
            total += np.linalg.norm(x - s[:, None] * axis, axis=1).mean() * (end - begin)
        begin = end
    return total / arc_lengths(vertices)[-1]


def path(dh, yaw, q, P, weights, *, w_0=0.0, R=None, mount=None, metric="geodesic", tie_hand=True, delta=0.01):
    """g, E_t, sigma, distances and e_R of every frame of a path."""
    rows = []
    for t, points in enumerate(P):
        vertices, tool = arm(dh, q[t], yaw)
        g, arcs, distance, error = temporal(
            vertices, tool, points, np.asarray(weights), w_0=w_0, target=None if R is None else R[t], mount=mount,
            metric=metric, tie_hand=tie_hand,
        )  # fmt: skip
        rows.append((g, area(vertices, arcs, points, delta), arcs / arc_lengths(vertices)[-1], distance, error))
    return tuple(np.array(column) for column in zip(*rows, strict=True))
