"""Gradients of f and E by the design, against central differences of hinted walks solved to the end."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from scenes import PACKAGING, WELDING, problem_for, recorded

from armdesign.fitness.block import batch_of
from armdesign.fitness.constraints import design_space, joint_limits
from armdesign.fitness.robot import RobotFitness
from armdesign.fitness.sensitivity import Sensitivity
from armdesign.settings.place import Site
from armdesign.settings.sections import Design, Solver

EXACT = Solver(tolerance=1e-14, floor=0.0, max_steps=400)
METRICS = ("geodesic", "euler", "axis")
FINE = 0.001  # pieces of the area [m]; their number jumps, and with it E, the less the finer they are
H = 1e-4
TASKS = {"packaging": (PACKAGING, 0.0), "welding": (WELDING, 0.2)}


class Scene:
    """A recording, thinned out, with random designs that are valid on it."""

    def __init__(self, name, n, *, continuity=100.0, limit=np.pi, count=60, mounted=None, design=None, **others):
        weights, w_0 = TASKS[name]
        P, R = recorded(name)
        limits = np.tile([-limit, limit], (n, 1))
        settings = Design(**{"dof": n, **(design or {})})
        if settings.joints:
            limits = joint_limits(settings)
        self.problem = problem_for(
            P[::10], n, weights, R=R[::10] if w_0 > 0.0 else None, w_0=w_0, limits=limits, solver=EXACT, delta=FINE,
            continuity=continuity, **others,
        ).with_joints(settings.prismatic)  # fmt: skip
        if mounted is None:
            self.space = design_space(Design(dof=n, base_yaw=(-90.0, 90.0), **(design or {})))
        else:  # the task frame is the room, where the demonstrator's shoulder rests in the origin
            site = Site(mounted, (-0.2, 0.2), (-0.2, 0.2), (-0.2, 0.2), (-2.0, 2.0))
            self.space = design_space(Design(dof=n), [site])
        self.fitness = RobotFitness(self.problem, self.space)
        designs = self.space.sample(np.random.default_rng(5), count)
        scores, _ = self.fitness.evaluate(designs)
        self.designs, self.q0 = designs[scores.valid], scores.q0[scores.valid]

    def path(self, k):
        design = self.designs[k]
        batch = batch_of(*self.space.rows(design), poses=self.q0[k][None], bases=self.space.bases(design))
        return SimpleNamespace(q=self.fitness.evaluator.with_paths(batch)[1][0])

    def gradients(self, k):
        """Of f and E, shape (2, D)."""
        batch = batch_of(*self.space.rows(self.designs[k]), bases=self.space.bases(self.designs[k]))
        slopes = Sensitivity(self.problem, len(self.space.names)).slopes(batch, self.path(k).q[None])
        return np.stack([slopes.path_fitness[0], slopes.area[0]])[:, self.space.free]

    def differences(self, k, h):
        """The same by walks from the same start pose."""
        D = self.designs.shape[1]
        around = self.designs[k] + h * np.vstack([np.eye(D), -np.eye(D)])
        poses = np.tile(self.path(k).q[0], (2 * D, 1))
        scores = self.fitness.evaluator.evaluate(*self.space.rows(around), None, poses, bases=self.space.bases(around))
        values = np.stack([scores.path_fitness, scores.area])
        return (values[:, :D] - values[:, D:]) / (2 * h)

    def errors(self, k):
        """Relative to the largest slope; NaN where the differences themselves do not agree with finer ones."""
        wide, narrow = self.differences(k, H), self.differences(k, H / 2)
        scale = np.abs(narrow).max(axis=1, keepdims=True)
        error = np.abs(self.gradients(k) - narrow) / scale
        return np.where(np.abs(wide - narrow) < 2e-3 * scale, error, np.nan)


@pytest.mark.parametrize(("name", "n"), [("packaging", 3), ("packaging", 5), ("welding", 3), ("welding", 4)])
def test_gradients_equal_central_differences(name, n):
    scene = Scene(name, n)
    errors = np.stack([scene.errors(k) for k in range(6)])
    assert np.isfinite(errors).mean() > 0.8
    assert np.nanmax(errors[:, 0]) < 1e-3
    assert np.nanquantile(errors[:, 1], 0.9) < 3e-3  # E also depends on where q goes along flat directions


@pytest.mark.parametrize("metric", METRICS)
def test_gradients_hold_in_every_metric_and_with_either_mount(metric):
    for mount in ("start", "identity"):
        scene = Scene("welding", 3, orientation_metric=metric, mount=mount)
        errors = np.stack([scene.errors(k) for k in range(3)])
        assert np.isfinite(errors).mean() > 0.8
        assert np.nanmax(errors) < 5e-3


def test_gradients_hold_for_lengths_of_either_sign():
    scene = Scene("welding", 3, count=120, design={"a": (-0.5, 0.5), "d": (-0.5, 0.5)})
    errors = np.stack([scene.errors(k) for k in range(6)])
    assert (scene.designs[:6] < 0.0).any(axis=0)[2:4].all()
    assert np.isfinite(errors).mean() > 0.8
    assert np.nanmax(errors[:, 0]) < 1e-3
    assert np.nanquantile(errors[:, 1], 0.9) < 3e-3


@pytest.mark.parametrize(("name", "joints"), [("packaging", "RPR"), ("packaging", "PRRP"), ("welding", "RRP")])
def test_gradients_hold_where_joints_slide(name, joints):
    scene = Scene(name, len(joints), count=200, design={"joints": joints, "travel": (-0.2, 0.3)})
    errors = np.stack([scene.errors(k) for k in range(6)])
    assert np.isfinite(errors).mean() > 0.7
    assert np.nanmax(errors[:, 0]) < 2e-3
    assert np.nanquantile(errors[:, 1], 0.9) < 5e-3


def test_joints_at_a_limit_stay_there():
    scene = Scene("packaging", 4, limit=1.6)
    held = [k for k in range(len(scene.designs)) if (np.abs(scene.path(k).q) >= 1.6).sum() >= 3][:4]
    assert len(held) == 4
    for k in held:
        assert np.nanmax(scene.errors(k)) < 5e-3


def test_a_path_on_the_edge_of_the_ball_moves_with_the_frame_before():
    scene = Scene("packaging", 4, continuity=12.0)
    moves = [np.linalg.norm(np.diff(scene.path(k).q, axis=0), axis=1) for k in range(8)]
    bound = [k for k in range(8) if (moves[k] > np.deg2rad(12.0) * (1 - 1e-9)).sum() >= 3][:4]
    assert len(bound) == 4
    for k in bound:
        assert np.nanmax(scene.errors(k)) < 5e-3


@pytest.mark.parametrize("mounted", ["floor", "wall", "ceiling"])
@pytest.mark.parametrize(("name", "metric"), [("packaging", "geodesic"), *(("welding", each) for each in METRICS)])
def test_gradients_by_the_base_pose_equal_central_differences(name, metric, mounted):
    scene = Scene(name, 3, mounted=mounted, orientation_metric=metric, count=120)
    errors = np.stack([scene.errors(k) for k in range(4)])
    base = errors[:, :, -4:]
    assert [n for n, free in zip(scene.space.names, scene.space.free, strict=True) if free][-4:] == [
        "base_yaw", "base_x", "base_y", "base_z"
    ]  # fmt: skip
    assert np.isfinite(base).mean() > 0.8
    assert np.nanmax(errors[:, 0]) < 2e-3
    assert np.nanquantile(errors[:, 1], 0.9) < 5e-3


@pytest.mark.parametrize("mounted", ["floor", "wall", "ceiling"])
def test_joint_paths_turn_with_the_design_as_their_differences_say(mounted):
    scene = Scene("welding", 3, mounted=mounted)
    design, q = scene.designs[0], scene.path(0).q
    batch = batch_of(*scene.space.rows(design), bases=scene.space.bases(design))
    slopes = Sensitivity(scene.problem, len(scene.space.names)).slopes(batch, q[None], turns=True)
    turns = slopes.turns[0][:, :, scene.space.free]
    for e in range(len(design)):
        ends = []
        for h in (H, -H):
            moved = design + h * np.eye(len(design))[e]
            poses = q[:1]
            batch = batch_of(*scene.space.rows(moved), poses=poses, bases=scene.space.bases(moved))
            ends.append(scene.fitness.evaluator.with_paths(batch)[1][0])
        np.testing.assert_allclose(turns[:, :, e], (ends[0] - ends[1]) / (2 * H), atol=2e-3 * np.abs(turns).max())
