"""Arms, tasks and recordings that several tests stand on."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from plain_reference import arc_lengths, arm, point_at
from scipy.spatial.transform import Rotation

from armdesign.demonstration import build_task, read_recording
from armdesign.fitness.problem import make_problem
from armdesign.kinematics.dh import DHTable
from armdesign.settings.sections import Fitness, Solver, Task

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared"
PACKAGING, WELDING = (1 / 6, 1 / 3, 1 / 2), (0.0, 0.1, 0.7)
RECORDINGS = {
    "packaging": ROOT / "examples/packaging.csv",
    "welding": ROOT / "examples/welding.csv",
    "box_lift": SHARED / "recordings/converted/box_lift.csv",
    "handover": SHARED / "recordings/converted/handover_giver.csv",
}


def random_table(rng, n, *, theta=False, negative=False, yaw=False, zeros=True):
    """A random arm of human size; about a third of the lengths are zero."""
    low = -0.3 if negative else 0.0
    a, d = rng.uniform(low, 0.3, (2, n + 1))
    if zeros:
        a[rng.random(n + 1) < 0.3], d[rng.random(n + 1) < 0.3] = 0.0, 0.0
    d[-1] = 0.1
    return DHTable(
        rng.uniform(-np.pi / 2, np.pi / 2, n + 1),
        a,
        d,
        rng.uniform(-np.pi, np.pi, n + 1) if theta else np.zeros(n + 1),
        rng.uniform(-np.pi, np.pi) if yaw else 0.0,
    )


def rows_of(table):
    """A table as rows (alpha, a, d, theta)."""
    return np.stack([table.alpha, table.a, table.d, table.theta], axis=1)


def random_frames(rng, count, m, spread=0.3):
    """Points of an arm-like chain: each a step from the one before, shape (count, m, 3)."""
    return np.cumsum(rng.normal(0.0, spread / np.sqrt(3), (count, m, 3)), axis=1)


def full_turn(n):
    """Joint limits of +-pi."""
    return np.tile([-np.pi, np.pi], (n, 1))


def settings_for(weights, w_0=0.0, **others):
    """Fitness settings with resolved weights."""
    return Fitness(weights=tuple(weights), orientation_weight=w_0, **others)


def problem_for(P, n, weights, *, R=None, w_0=0.0, limits=None, solver=None, dt=0.02, **others):
    """A problem of n joints, +-pi by default."""
    bounds = full_turn(n) if limits is None else limits
    return make_problem(P, R, dt, bounds, settings_for(weights, w_0, **others), solver or Solver())


@cache
def recorded(name):
    """Points (T, 3, 3) and hand rotations (T, 3, 3) or None of a recording; skips where it is absent."""
    if not RECORDINGS[name].exists():
        pytest.skip("the shared recordings are not at hand")
    recording = read_recording(RECORDINGS[name])
    oriented = "hand" if "hand" in recording.orientations else None
    task = build_task(recording, Task(orientation=oriented, max_gap=1.0))
    return task.P, task.R


def reach_task(rng, n, frames=30, *, noise=0.0, table=None):
    """A task an arm can follow: the places of three points on an arm that moves smoothly, and its tool's turns.

    Returns:
        P (T, 3, 3), R (T, 3, 3), the arm and its joint angles (T, n).
    """
    table = table or random_table(rng, n, zeros=False)
    t = np.linspace(0.0, 1.0, frames)[:, None]
    q = rng.uniform(-1.5, 1.5, n) + t * rng.uniform(-0.8, 0.8, n) + 0.2 * np.sin(2 * np.pi * t + rng.uniform(0, 6, n))
    P, R = np.empty((frames, 3, 3)), np.empty((frames, 3, 3))
    for k in range(frames):
        vertices, tool = arm(rows_of(table), q[k], table.base_yaw)
        P[k] = point_at(vertices, np.array([0.35, 0.7, 1.0]) * arc_lengths(vertices)[-1])
        R[k] = tool[:3, :3]
    return P + rng.normal(0.0, noise, P.shape) if noise else P, R, table, q


def random_rotation(rng):
    """A uniformly random rotation matrix."""
    return Rotation.random(rng=rng).as_matrix()
