"""Violation of clearance of many candidates, with its gradient, and the choice of the slides of their joint modules."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armdesign.bodies.kernels.capsules import build_body
from armdesign.feasibility.kernels.clearance import check_path, load_candidate, trace_path
from armdesign.feasibility.kernels.clearance_slope import add_violation_slope
from armdesign.kinematics.compilation import branch, entry

ROUNDING = 1e-12
GRID = 4
"""Steps that the range of a slide is cut into; finer ones cost more and hardly make more arms feasible."""
WORTH = 0.8
"""The slides are looked at again where they have brought the violation below this share."""
BETTER = 1e-6
"""How much smaller a violation has to be for a slide to move [m]."""


class Arms(NamedTuple):
    """Candidates.

    Attributes:
        rows: DH rows, shape (N, n + 1, 4) [rad, m, m, rad].
        bases: Poses that row 0 starts from, in the task frame, shape (N, 12).
        slides: s_j of their joints, shape (N, n) [m].
        paths: Joint paths, shape (N, T, n) [rad; m].
        met: 1 for an obstacle that has been met, shape (N, K).
        violation: V, shape (N,) [m].
    """

    rows: np.ndarray
    bases: np.ndarray
    slides: np.ndarray
    paths: np.ndarray
    met: np.ndarray
    violation: np.ndarray


@entry
def check_arms(traced, glides, room, arms, turns, slopes):
    """Check candidates along their paths, between the frames, too; violation and met are written, or added to.

    Args:
        traced: Scratch, a Traced.
        glides: One GLIDE record, shape (1,).
        room: What is around, a Room.
        arms: The candidates, an Arms.
        turns: Derivatives of the joint angles, shape (N, T, n, E), or (0, T, n, E) where no gradient is wanted.
        slopes: Gradient of the violation, shape (N, E), added to.
    """
    work = traced.work[0]
    check = work.check
    check.between, check.enough = 1, np.inf
    for k in range(len(arms.rows)):
        take(traced, arms, k)
        build_body(work.body, room.sizes[0], work.rows[: work.dof + 1], work.slides)
        trace_path(traced, room)
        V = check_path(traced, room)
        arms.violation[k] += V
        for i in range(len(traced.flags)):
            arms.met[k, i] = traced.flags[i].met
        if len(turns) > 0 and V > 0.0:
            add_violation_slope(slopes[k], glides, traced, room, turns[k])


@entry
def settle_slides(traced, room, arms):
    """Move the slides of candidates so that fewer bodies touch on a thinned path; slides and violation are written.

    The pair that misses most has a say: the slides that shape its two bodies are tried, from where the joint's origin
    is outwards, and the best is kept. That is repeated as long as it helps.

    Args:
        traced: Scratch, a Traced.
        room: What is around, a Room.
        arms: The candidates with their thinned paths.
    """
    work = traced.work[0]
    check, n = work.check, arms.rows.shape[1] - 1
    check.between = 0
    for k in range(len(arms.rows)):
        take(traced, arms, k)
        check.enough = np.inf
        best = thin_violation(traced, room)
        for _ in range(2 * n):
            first, second, before = check.first, check.second, best
            if best == 0.0:
                break
            for side in range(4):
                body = work.body
                capsule = first if side < 2 else second
                joint = 0 if capsule < 0 else (body.module[capsule] if side % 2 == 0 else 0)
                if capsule >= 0 and body.module[capsule] == 0:
                    joint = body.link[capsule] + side % 2
                if 0 < joint <= n and room.sizes[0].prismatic[joint - 1] == 0 and best > 0.0:
                    best = try_slide(traced, room, joint - 1, best)
            if best > WORTH * before:
                break
            check.enough = np.inf
            best = thin_violation(traced, room)  # tells which pair it is now
        arms.violation[k] = best
        for j in range(n):
            arms.slides[k, j] = work.slides[j]


@branch
def take(traced, arms, k):
    """Take in a candidate with its path and slides."""
    load_candidate(traced, arms.rows[k], arms.bases[k])
    path = arms.paths[k]
    for t in range(len(path)):
        for j in range(path.shape[1]):
            traced.path[t, j] = path[t, j]
    for j in range(path.shape[1]):
        traced.work[0].slides[j] = arms.slides[k, j]
    for i in range(len(traced.flags)):
        traced.flags[i].met = arms.met[k, i]


@branch
def thin_violation(traced, room):
    """V of the present slides."""
    work = traced.work[0]
    build_body(work.body, room.sizes[0], work.rows[: work.dof + 1], work.slides)
    trace_path(traced, room)
    return check_path(traced, room)


@branch
def try_slide(traced, room, j, best):
    """Put a joint's slide where the violation is least, as near to the joint's origin as may be.

    Args:
        traced: The candidate; its slides are set.
        room: What is around.
        j: The joint, from 0.
        best: V at the present slides [m].

    Returns:
        V then.
    """
    work = traced.work[0]
    check, sizes, d = work.check, room.sizes[0], work.rows[j, 2]
    low, high = min(0.0, d) - sizes.slide, max(0.0, d) + sizes.slide
    kept, step = work.slides[j], (high - low) / GRID
    for m in range(2 * GRID + 1):
        place = d + (m + 1) // 2 * step * (1.0 if m % 2 == 1 else -1.0)
        if max(low - place, place - high) <= ROUNDING and place != kept and best > 0.0:
            work.slides[j], check.enough = place, best
            found = thin_violation(traced, room)
            if found < best - BETTER:
                best, kept = found, place
    work.slides[j] = kept
    return best
