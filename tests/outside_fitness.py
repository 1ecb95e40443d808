"""f and E of joint angles on a task, from nothing but DH products and the method's text."""

from itertools import pairwise

import numpy as np

from armdesign.kinematics.dh import DHTable


def corners(table: DHTable, q):
    """Corners of the arm skeleton, shape (2 n + 3, 3): per row along x_{i-1} by a_i, then along z_i by d_i."""
    pose, points = table.base(), [np.zeros(3)]
    for i, frame in enumerate(table.frames(q)):
        points += [pose[:3, 3] + table.a[i] * pose[:3, 0], frame[:3, 3]]
        pose = frame
    return np.array(points)


def arc(line):
    """Arc length at every corner."""
    return np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))]


def at(line, sigma):
    """Points at sigma, by arc length, shape (k, 3)."""
    length = arc(line)
    return np.stack([np.interp(np.asarray(sigma) * length[-1], length, line[:, c]) for c in range(3)], axis=1)


def nearest(line, point):
    """Per segment: arc length of the closest place and its square distance."""
    length = arc(line)
    found = []
    for (a, b), begin in zip(pairwise(line), length, strict=False):
        span = float(np.linalg.norm(b - a))
        s = 0.0 if span == 0.0 else min(max(float((point - a) @ (b - a)) / span, 0.0), span)
        found.append((begin + s, float(np.sum((point - a - (0.0 if span == 0.0 else s / span) * (b - a)) ** 2))))
    return found


def place(line, points, weights):
    """Places of two free points, and the hand at the end: the exact ordered minimum, segment pair by segment pair."""
    total = arc(line)[-1]
    w = np.maximum(weights, 1e-6)
    first, second = nearest(line, points[0]), nearest(line, points[1])
    middle = nearest(line, (w[0] * points[0] + w[1] * points[1]) / (w[0] + w[1]))  # both at one place
    best = (np.inf, 0.0, 0.0)
    for j, (s_2, d_2) in enumerate(second):
        for i, (s_1, d_1) in enumerate(first[: j + 1]):
            if s_1 <= s_2:
                best = min(best, (w[0] * d_1 + w[1] * d_2, s_1, s_2))
            elif i == j:
                s = middle[j][0]
                spot = at(line, [s / total])[0]
                value = w[0] * np.sum((spot - points[0]) ** 2) + w[1] * np.sum((spot - points[1]) ** 2)
                best = min(best, (float(value), s, s))
    return np.array([best[1], best[2], total]) / total


def errors(line, sigma, points):
    """Distances of the points to their places, shape (m,)."""
    return np.linalg.norm(at(line, sigma) - points, axis=1)


def areas(line, sigma, points, delta):
    """E_t: length-weighted mean distance of the pieces' midpoints to the segments p_{i-1} p_i."""
    total, ends, path = arc(line)[-1], np.r_[0.0, sigma], np.vstack([np.zeros(3), points])
    value = 0.0
    for i in range(len(points)):
        length = (ends[i + 1] - ends[i]) * total
        pieces = int(np.ceil(length / delta - 1e-9))  # ten whole pieces are ten, whatever the rounding
        if pieces == 0:
            continue
        middles = at(line, ends[i] + (np.arange(pieces) + 0.5) / pieces * length / total)
        a, b = path[i], path[i + 1]
        s = np.clip((middles - a) @ (b - a) / max(float((b - a) @ (b - a)), 1e-300), 0.0, 1.0)
        value += float(np.linalg.norm(middles - a - s[:, None] * (b - a), axis=1).mean()) * length
    return value / total


def turn(R):
    """Angle of a rotation matrix."""
    vector = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return float(np.arctan2(np.linalg.norm(vector) / 2.0, (np.trace(R) - 1.0) / 2.0))


def fitness(table, q, P, weights, delta, w_0=0.0, R=None, mount=None):
    """f and E over all frames, eq. 3 and 5; three points, the hand tied to the end-effector."""
    g, E = [], []
    for t, angles in enumerate(q):
        line = corners(table, angles)
        sigma = place(line, P[t], weights)
        value = np.sqrt(np.sum(weights * errors(line, sigma, P[t]) ** 2)) / len(weights)
        if w_0 > 0.0:
            value += w_0 * turn((table.frames(angles)[-1][:3, :3] @ mount).T @ R[t])
        g.append(value)
        E.append(areas(line, sigma, P[t], delta))
    return float(np.mean(g)), float(np.mean(E))
