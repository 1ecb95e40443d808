"""How far the parts of an arm can move against each other between two frames, and how far apart they are at least."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array


def joint_radii(poses: Array, ends: Array, links: NDArray[np.int64], steps: Array, turning: NDArray[np.bool_]) -> Array:
    """How far the parts reach from the axis of every joint at most while the joints go straight from frame to frame.

    At a frame it is the larger distance of the part's two ends from the axis; between two frames it changes by what the
    joints in between can move the part by, V, so it never exceeds (f_t + f_{t+1} + V) / 2. Of a prismatic joint it is
    1, so that times a step of the joint it is a displacement, too.

    Args:
        poses: Frames of base and joints, shape (T, n + 1, 4, 4).
        ends: Centres of the end faces of S parts in their link's frame, shape (S, 2, 3) [m].
        links: The links that they belong to, shape (S,).
        steps: Largest |q_{t+1} - q_t|, shape (T - 1, n) [rad, m].
        turning: Which joints are revolute, shape (n,).

    Returns:
        Shape (S, n, T - 1) [m]; without the parts' own radii.
    """
    T, n = len(poses), len(turning)
    placed = poses[:, links]  # (T, S, 4, 4)
    points = np.einsum("tsij,sej->tsei", placed[..., :3, :3], ends) + placed[..., None, :3, 3]
    radii = np.ones((len(links), n, T - 1))
    at = np.empty((len(links), n, T))
    for k in range(n):
        away = np.cross(points - poses[:, k + 1, None, None, :3, 3], poses[:, k + 1, None, None, :3, 2])
        at[:, k] = np.linalg.norm(away, axis=-1).max(axis=2).T
    for s, link in enumerate(links):
        for joints in (range(link - 1, -1, -1), range(link, n)):  # towards the base, towards the tool
            moved = np.zeros(T - 1)
            for k in joints:
                if turning[k]:
                    radii[s, k] = (at[s, k, :-1] + at[s, k, 1:] + moved) / 2.0
                moved = moved + steps[:, k] * radii[s, k]
    return radii


def displacements(
    radii: Array, thickness: Array, links: NDArray[np.int64], steps: Array, turning: NDArray[np.bool_]
) -> Array:
    """How far any point of every part can move against every link of the arm from frame to frame.

    Args:
        radii: Of ``joint_radii``, shape (S, n, T - 1) [m].
        thickness: Radii of the parts, shape (S,) [m].
        links: The links that they belong to, shape (S,).
        steps: Largest |q_{t+1} - q_t|, shape (T - 1, n) [rad, m].
        turning: Which joints are revolute, shape (n,).

    Returns:
        Shape (S, n + 1, T - 1) [m].
    """
    reach = radii + np.where(turning, thickness[:, None], 0.0)[:, :, None]
    each = reach * steps.T  # (S, n, T - 1)
    moved = np.zeros((len(links), steps.shape[1] + 1, len(steps)))
    for s, link in enumerate(links):
        for m in range(link - 1, -1, -1):
            moved[s, m] = moved[s, m + 1] + each[s, m]
        for m in range(link + 1, steps.shape[1] + 1):
            moved[s, m] = moved[s, m - 1] + each[s, m - 1]
    return moved


def segment_distance(first: Array, second: Array) -> Array:
    """Distance of segments: between their insides where both come nearest there, else from an end of one to the other.

    Args:
        first: Ends of segments, shape (..., 2, 3) [m].
        second: Ends of as many others, shape (..., 2, 3) [m].

    Returns:
        Shape (...,) [m].
    """
    p, u = first[..., 0, :], first[..., 1, :] - first[..., 0, :]
    q, v = second[..., 0, :], second[..., 1, :] - second[..., 0, :]
    nearest = np.minimum.reduce(
        [
            *(_point_distance(first[..., e, :], q, v) for e in (0, 1)),
            *(_point_distance(second[..., e, :], p, u) for e in (0, 1)),
        ]
    )
    w = p - q
    uu, uv, vv, uw, vw = (np.sum(x * y, axis=-1) for x, y in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    spread = uu * vv - uv * uv
    crossing = spread > 1e-12 * uu * vv
    safe = np.where(crossing, spread, 1.0)
    s, t = (uv * vw - vv * uw) / safe, (uu * vw - uv * uw) / safe
    inside = crossing & (s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)
    between = np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1)
    least: Array = np.where(inside, np.minimum(between, nearest), nearest)
    return least


def _point_distance(point: Array, start: Array, span: Array) -> Array:
    """Distance of points from segments, shape (...,) [m]."""
    length = np.maximum(np.sum(span * span, axis=-1), np.finfo(float).tiny)
    share = np.clip(np.sum((point - start) * span, axis=-1) / length, 0.0, 1.0)
    distance: Array = np.linalg.norm(point - start - share[..., None] * span, axis=-1)
    return distance
