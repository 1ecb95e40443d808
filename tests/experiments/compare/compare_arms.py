"""Arms, tasks and URDFs for the tests of the comparison."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin

from armdesign.demonstration import read_recording
from armdesign.experiments.compare.polyline_arm import PolylineEvaluator, arm_problem
from armdesign.experiments.compare.serial_arm import read_arm
from armdesign.export.urdf import urdf_text
from armdesign.kinematics.dh import DHTable
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Fitness, Settings, Solver

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
WEIGHTS = (1 / 6, 1 / 3, 1 / 2)


@cache
def example_problem(name="packaging", dof=6):
    """An example's task with the settings that are meant for it."""
    settings = Settings().replace({"design": {"dof": dof}, "fitness": {"scenario": name}})
    return prepare(read_recording(EXAMPLES / f"{name}.csv"), settings, longest=1.5)


def frames_at(arm, q):
    """Frames of a ready-made arm's joints, turned by q, and of its tool in the base, shape (n + 1, 4, 4)."""
    poses = [pin.SE3.Identity()]
    for placement, turn in zip(arm.placements, [*(arm.axes * q[:, None]), np.zeros(3)], strict=True):
        poses.append(poses[-1] * pin.SE3(placement) * pin.SE3(pin.exp3(turn), np.zeros(3)))
    return np.array([pose.homogeneous for pose in poses[1:]])


def bent_table(rng, n, *, first=False):
    """A random arm whose rows have a length along x or along z but not both, so that its joint origins are the
    corners of its skeleton; the first row has one where asked for."""
    a, d = rng.uniform(0.05, 0.3, (2, n + 1))
    along_x = rng.random(n + 1) < 0.5
    a[~along_x], d[along_x] = 0.0, 0.0
    if not first:
        a[0] = d[0] = 0.0
    a[-1], d[-1] = 0.0, 0.1
    return DHTable(rng.uniform(-np.pi / 2, np.pi / 2, n + 1), a, d)


def exported(table, folder, limits=None):
    """The arm of a design's URDF."""
    path = folder / "arm.urdf"
    path.write_text(urdf_text(table, limits=limits), encoding="utf-8")
    return read_arm(path)


def task_for(rng, table, limits, frames=25):
    """Points near an arm that moves smoothly, and its tool's turns: P (T, 3, 3), R (T, 3, 3)."""
    t = np.linspace(0.0, 1.0, frames)[:, None]
    q = limits[:, 0] + (
        0.3 + 0.4 * rng.random(table.dof) + 0.1 * np.sin(3 * t + rng.uniform(0, 6, table.dof))
    ) * np.ptp(limits, axis=1)
    frames_of = [table.frames(row) for row in q]
    places = np.array([[f[table.dof // 2][:3, 3], f[table.dof - 1][:3, 3], f[-1][:3, 3]] for f in frames_of])
    noise = rng.normal(0.0, 0.01, places.shape)
    noise[0] = 0.0  # the start can be reached
    return places + noise, np.array([f[-1][:3, :3] for f in frames_of])


def settings(w_0=0.0, **others):
    """Fitness settings for three points."""
    weights = tuple((1.0 - w_0) * w for w in WEIGHTS)
    return Fitness(weights=weights, orientation_weight=w_0, **others)


def evaluator(arm, P, R=None, fitness=None, block=None, **solver):
    """An evaluator of a ready-made arm."""
    problem = arm_problem(arm, P, R, 0.02, fitness or settings(), Solver(**solver))
    return PolylineEvaluator(problem, arm, block)


def urdf(*joints, links=None, name="robot"):
    """A URDF text; each joint is (name, type, parent, child[, inner XML])."""
    names = links or dict.fromkeys(link for joint in joints for link in joint[2:4])
    text = "".join(f'<link name="{link}"/>' for link in names)
    for title, kind, parent, child, *inner in joints:
        text += (
            f'<joint name="{title}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
            f'<origin xyz="0 0 0.2"/><axis xyz="0 1 0"/>{inner[0] if inner else LIMIT}</joint>'
        )
    return f'<robot name="{name}">{text}</robot>'


LIMIT = '<limit lower="-2" upper="2" effort="1" velocity="1"/>'
