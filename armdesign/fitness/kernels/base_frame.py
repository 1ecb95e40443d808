"""The demonstration as an arm sees it: in the frame of its base, which may stand anywhere and in any attitude."""

from __future__ import annotations

from armdesign.kinematics.compilation import branch, leaf
from armdesign.kinematics.kernels.skeleton import ORIGIN


@branch
def give_base(state, base):
    """Put an arm's base somewhere in the task frame, shape (12,): axes x, y, z, then the origin."""
    state.placed = 0
    for i in range(12):
        state.base[i] = base[i]
        if base[i] != (1.0 if i in (0, 4, 8) else 0.0):
            state.placed = 1


@leaf
def show_frame(scratch, state, arrays, t):
    """Write the points of frame t, and the hand's rotation where it counts, to scratch, as seen from the base.

    The same products in the same order as ``BasePose.inside``: placed beforehand, a task gives
    the same to the last bit.

    Args:
        scratch: Record of type SCRATCH; points and rotation are written.
        state: Record of type STATE with the base set.
        arrays: Demonstration and settings, a ProblemArrays.
        t: The frame.
    """
    base, P, R = state.base, arrays.P, arrays.R[min(t, len(arrays.R) - 1)]
    oriented = arrays.record[0].w_0 > 0.0
    if state.placed == 0:
        for p in range(P.shape[1]):
            for i in range(3):
                scratch.points[p, i] = P[t, p, i]
        if oriented:
            for i in range(3):
                for j in range(3):
                    scratch.rotation[i, j] = R[i, j]
        return
    for p in range(P.shape[1]):
        x, y, z = P[t, p, 0] - base[ORIGIN], P[t, p, 1] - base[ORIGIN + 1], P[t, p, 2] - base[ORIGIN + 2]
        for i in range(3):
            scratch.points[p, i] = base[3 * i] * x + base[3 * i + 1] * y + base[3 * i + 2] * z
    if oriented:
        for i in range(3):
            for j in range(3):
                scratch.rotation[i, j] = base[3 * i] * R[0, j] + base[3 * i + 1] * R[1, j] + base[3 * i + 2] * R[2, j]
