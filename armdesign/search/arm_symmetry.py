"""What a search algorithm may know of arms: their length, and which designs are the same arm."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.fitness.constraints import DesignSpace
from armdesign.swarm import Slab

FLAT = 1e-3
"""Link length below which two joint axes count as meeting [m]."""
KEPT = 60
"""Designs that a search keeps at most as its alternatives."""
SMALLEST_ROOM = 0.1
"""Smallest width of a place in terms of which two bases differ [m]."""
DIFFERENT = 0.3
"""Distance from which two arms count as different, every entry in terms of the width of its bounds."""


def length_slab(space: DesignSpace) -> Slab:
    """L_min < L < L_max as bounds of a weighted sum of Phi.

    L is linear in the entries that cannot be negative; of the others the least and the most that they can add count.
    """
    lower, upper = space.bounds
    weights = np.where(space.extending & (lower >= space.shortest_at), 1.0, 0.0)
    shortest, longest = space.reachable_lengths
    least = most = shortest - float(weights @ lower)  # what the other entries add to L, those outside Phi included
    if (space.extending & (lower < space.shortest_at)).any():
        most = longest - float(weights @ upper)
    return Slab(weights, space.length[0] - most, space.length[1] - least)


def canonical_form(space: DesignSpace) -> Callable[[Array], Array]:
    """Designs in a form in which the same arm looks the same.

    A row i >= 1 may be seen from behind, Rz(pi) T_i, which turns the signs of alpha_i and a_i: a_i is made positive.
    Where two axes meet, a_i = 0, row i may be turned by half a turn about both: Rx(alpha) = Rz(-pi) Rx(-alpha) Rz(pi),
    and the two half turns go into the joint angles before and behind. So the sign of alpha_i says nothing for
    i = 1..n-1. Of the tool the same holds but for its own turn about its axis, which the mount takes up.

    Returns:
        A function of designs Phi, shape (N, D), that gives as many.
    """
    lower, upper = (side[: space.cells].reshape(space.dof + 1, 3)[:, :2] for side in (space.lower, space.upper))
    turnable = turning_rows(space)

    def canonical(Phi: Array) -> Array:
        entries = space.full(Phi)  # fixed entries included; those of the base come last
        rows = entries[:, : space.cells].reshape(len(entries), space.dof + 1, 3)
        behind = (rows[:, :, 1] < 0.0) & turnable & (-rows[:, :, :2] <= upper).all(axis=2)
        behind &= (-rows[:, :, :2] >= lower).all(axis=2)
        rows[:, :, :2] = np.where(behind[:, :, None], -rows[:, :, :2], rows[:, :, :2])
        meeting = (np.abs(rows[:, 1:, 1]) < FLAT) & turnable[1:]
        rows[:, 1:, 0] = np.where(meeting, np.abs(rows[:, 1:, 0]), rows[:, 1:, 0])
        entries[:, : space.cells] = rows.reshape(len(entries), space.cells)
        if len(space.sites) > 1:  # what lies beyond the box of its site is the same as on its edge
            site, standing = space.standing(Phi)
            entries[:, space.cells :] = np.column_stack([standing, site + 0.5])
        chosen: Array = entries[:, space.free]
        return chosen

    return canonical


def arm_distances(space: DesignSpace, design: Array, others: Array) -> Array:
    """How different arms are, however they are written down.

    A joint may be described with its axis the other way round, T_i Rx(pi), which turns the twists of its row and the
    next by pi and the sign of d_i; and a row i >= 1 from behind, Rz(pi) T_i, which turns the signs of alpha_i and a_i.
    The half turns go into the joint angles. The distance is the smallest over all of these.

    Args:
        space: The design space; every entry counts in terms of the width of its bounds.
        design: Phi, shape (D,).
        others: Phi, shape (A, D).

    Returns:
        Euclidean distances, shape (A,).
    """
    n, cells = space.dof, space.cells
    entries = space.full(np.vstack([design, others]))
    one, rows = entries[0, :cells].reshape(n + 1, 3), entries[1:, :cells].reshape(-1, n + 1, 3)
    width = (space.upper - space.lower)[:cells].reshape(n + 1, 3)
    # an entry that is fixed counts in terms of the widest of its kind, if any is free
    unit = np.where(width > 0.0, width, width.max(axis=0))
    unit = np.where(unit > 0.0, unit, 1.0)
    standing = base_distances(space, np.vstack([design, others]))
    # squared distances; every row may choose its own side, since the half turns go into the joints beside it
    best = np.full(len(others), np.inf)
    turnable = turning_rows(space)
    choices = [(0, 1) if kind == "R" else (0,) for kind in space.joints]  # a slide's limits are not the same either way
    for turns in product(*choices):  # every choice of axes to turn round: 2^n ways to write the arm
        turned = np.array([*turns, 0])  # of axis i; the tool is not turned
        alpha = rows[:, :, 0] + np.pi * (turned + np.r_[0, turned[:-1]])
        d = rows[:, :, 2] * np.where(turned == 1, -1.0, 1.0)
        across = ((d - one[:, 2]) / unit[:, 2]) ** 2
        ways = []
        for side in (1.0, -1.0):  # each row as it is, and from behind
            # angles differ by at most half a turn
            twist = (side * alpha - one[:, 0] + np.pi) % (2.0 * np.pi) - np.pi
            ways.append((twist / unit[:, 0]) ** 2 + ((side * rows[:, :, 1] - one[:, 1]) / unit[:, 1]) ** 2)
        ways[1][:, ~turnable] = np.inf
        best = np.minimum(best, (np.minimum(*ways) + across).sum(axis=1))
    return np.asarray(np.sqrt(best + standing**2))


def turning_rows(space: DesignSpace) -> NDArray[np.bool_]:
    """Rows that joints enclose which can take up half turns, shape (n + 1,): row 0 hangs on the base, slides cannot."""
    kinds = np.array([*space.joints, "R"])  # the mount takes up what is behind the tool row
    return np.asarray(np.r_[False, (kinds[:-1] == "R") & (kinds[1:] == "R")])


def base_distances(space: DesignSpace, Phi: Array) -> Array:
    """How differently the bases of designs stand than that of the first, by the widths of the bounds, shape (N - 1,).

    Args:
        space: The design space.
        Phi: Designs, shape (N, D).
    """
    yaw = space.full(Phi)[:, space.cells]
    wide = max(float(space.upper[space.cells] - space.lower[space.cells]), 1.0)
    if not space.sites:
        return np.asarray((yaw[1:] - yaw[0]) / wide)
    site, standing = space.standing(Phi)
    turned, shifted = standing[1:, 0] - standing[0, 0], standing[1:, 1:] - standing[0, 1:]
    turned = (turned + np.pi) % (2.0 * np.pi) - np.pi
    place = slice(space.cells + 1, space.cells + 4)
    unit = np.maximum(space.upper[place] - space.lower[place], SMALLEST_ROOM)
    other = (site[1:] != site[0]).astype(float)  # mounted otherwise, or somewhere else altogether
    return np.asarray(np.sqrt((turned / wide) ** 2 + ((shifted / unit) ** 2).sum(axis=1) + other))


def different_arms(Phi: Array, space: DesignSpace, distance: float, most: int) -> list[int]:
    """Indices of designs that differ from each other: going down the list, each that differs from all kept so far.

    Args:
        Phi: Designs, best first, shape (A, D).
        space: The design space.
        distance: Smallest distance, see arm_distances.
        most: Largest number of them.
    """
    kept: list[int] = []
    for k, design in enumerate(Phi):
        if len(kept) == most:
            break
        if not kept or float(arm_distances(space, design, Phi[kept]).min()) >= distance:
            kept.append(k)
    return kept
