"""How far an arm's bodies leave the volume that the demonstrator's arm has swept, with the gradient."""

from __future__ import annotations

from armdesign.bodies.kernels.capsules import build_body
from armdesign.cell.kernels.distance import segment_excess
from armdesign.feasibility.kernels.check_arms import take
from armdesign.feasibility.kernels.clearance import trace_path
from armdesign.feasibility.kernels.clearance_slope import add_excess_slope
from armdesign.kinematics.compilation import entry


@entry
def check_envelope(traced, glides, room, arms, grid, turns, slopes):
    """Find how far the bodies of candidates, but for link 0, are from the swept volume at most, in all frames.

    Args:
        traced: Scratch, a Traced.
        glides: One GLIDE record, shape (1,).
        room: Sizes, a Room.
        arms: The candidates, an Arms; violation is written: the largest distance that is above the one there [m].
        grid: FieldArrays of the swept volume in the task frame.
        turns: Derivatives of the joint angles, shape (N, T, n, E), or (0, T, n, E) where no gradient is wanted.
        slopes: Gradient of that distance, shape (N, E), written.
    """
    work = traced.work[0]
    body, witness = work.body, work.check.witness
    for k in range(len(arms.rows)):
        take(traced, arms, k)
        build_body(work.body, room.sizes[0], work.rows[: work.dof + 1], work.slides)
        trace_path(traced, room)
        worst, capsule, frame = arms.violation[k], -1, 0
        for i in range(body.parts):
            if body.link[i] == 0:
                continue
            f = 0
            while f < len(traced.path):
                ends = traced.ends[i, f]
                away = segment_excess(grid, ends[:3], ends[3:6], witness) + body.radius[i]
                if away > worst:
                    worst, capsule, frame = away, i, f
                reach = traced.way[i, f] + worst - away
                f += 1
                # until it has gone so far it cannot be farther away; no distance changes by more than one moves
                while f < len(traced.path) and traced.way[i, f] <= reach:
                    f += 1
        arms.violation[k] = worst
        if len(turns) > 0 and capsule >= 0:
            for e in range(slopes.shape[1]):
                slopes[k, e] = 0.0
            add_excess_slope(slopes[k], glides, traced, room, turns[k], grid, capsule, frame)
