"""Arms that the tests of this room share, and where urdfdom's own reader is."""

from __future__ import annotations

import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from armdesign.export.joints import joint_limits
from armdesign.export.robot_file import make_robot
from armdesign.kinematics.dh import DHTable

CHECK_URDF = shutil.which("check_urdf") or shutil.which(str(Path(sys.executable).with_name("check_urdf")))


def random_design(n, seed):
    """A table with zeros, right angles, negative lengths, offsets, a base yaw and, of every second seed, joints that
    slide; and lopsided limits.
    """
    rng = np.random.default_rng([n, seed])
    alpha = rng.choice([0.0, np.pi / 2, -np.pi / 2, rng.uniform(-np.pi, np.pi)], n + 1)
    a, d = rng.uniform(-0.4, 0.5, (2, n + 1)) * (rng.random((2, n + 1)) > 0.35)
    theta = rng.choice([0.0, np.pi / 2, -np.pi / 2, rng.uniform(-3, 3)], n + 1) * (seed % 3 > 0)
    table = DHTable(alpha, a, d, theta, base_yaw=rng.uniform(-np.pi, np.pi) * (seed % 2))
    kinds = np.random.default_rng([n, seed, 7]).choice(["R", "P"], n)
    table = replace(table, joints="".join(kinds) if seed % 2 else "")
    return table, np.stack([-rng.uniform(0, 3, n), rng.uniform(0.1, 3, n)], axis=1), rng


def random_robot(n, seed, options=None):
    """The same as a robot, started off from some pose, with a source of random numbers."""
    table, limits, rng = random_design(n, seed)
    speeds, torques = rng.uniform(0.5, 4, n), rng.uniform(1, 50, n)
    start = rng.uniform(*limits.T)
    return make_robot(table, joint_limits(table.prismatic, limits, speeds, torques), options, start=start), rng
