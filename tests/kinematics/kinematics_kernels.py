"""The kinematics kernels made callable: skeletons of a block of arms, and single damped steps."""

from __future__ import annotations

import numpy as np

from armdesign.kinematics.compilation import entry
from armdesign.kinematics.kernels.dls import STEP, Region, propose
from armdesign.kinematics.kernels.skeleton import CHAIN, MAX_DOF, load_arm, update_skeleton
from armdesign.kinematics.models import ArmBlock


@entry
def load_block(chains, placements, rows, yaws):
    """Load one design per chain."""
    for b in range(len(chains)):
        load_arm(chains[b], placements[b * (rows.shape[1] - 1) :], rows[b], yaws[b])


@entry
def update_block(chains, poses):
    """Bring every skeleton up to date."""
    for b in range(len(chains)):
        update_skeleton(chains[b], poses[b * chains[b].dof :])


@entry
def propose_all(steps, n, q, previous, radius, lower, upper, mu, done):
    """One damped step per record; the arrays have a row each."""
    for b in range(len(steps)):
        done[b] = propose(steps[b], n, Region(q[b], previous[b], radius[b], lower[b], upper[b]), mu[b])


def load(tables):
    """A block with these arms in it, all with the same kinds of joints, and their chains."""
    n, slides = tables[0].dof, tables[0].prismatic
    block = ArmBlock(len(tables), n, slides)
    chains = np.zeros(len(tables), dtype=CHAIN)
    chains["slides"][:, :n], chains["sliding"] = slides, any(slides)
    rows = np.stack([np.stack([t.alpha, t.a, t.d, t.theta], axis=1) for t in tables])
    load_block(chains, block.placements, rows, np.array([t.base_yaw for t in tables]))
    return block, chains


def pose(block, chains, q):
    """Pose the block, q of shape (B, n)."""
    block.q[:] = np.asarray(q).ravel()
    block.update()
    update_block(chains, block.poses)


def damped_steps(gradients, matrices, q, previous, radius, lower, upper, mu):
    """Steps of a batch of models, shape (B, n), and whether each has one."""
    count, n = gradients.shape
    steps, done = np.zeros(count, dtype=STEP), np.zeros(count, dtype=np.bool_)
    steps["gradient"][:, :n], steps["matrix"][:, :n, :n] = gradients, np.tril(matrices)
    padded = [np.zeros((count, MAX_DOF)) for _ in range(4)]
    for array, values in zip(padded, (q, previous, lower, upper), strict=True):
        array[:, :n] = values
    at, centre, low, high = padded
    propose_all(steps, n, at, centre, radius, low, high, mu, done)
    return steps["move"][:, :n].copy(), done
