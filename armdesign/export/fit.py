"""Make the body fit a motion: the base plate out of the way, neighbouring links apart where they fold.

The kinematics stay as they are; what changes is the side the plate stands on and how far the collision shapes are cut
back at the joints. Links that touch although joints with some length lie between them are left alone and reported:
there the arm itself is in its own way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import counted
from armdesign.export.contacts import CollisionScene, Pair
from armdesign.export.options import AUTO, SIDES
from armdesign.export.solids import BodyFit, link_bodies
from armdesign.kinematics.dh import DHTable
from armdesign.settings import Body

MOST_FRAMES = 2000
"""Longer motions are thinned to about so many frames."""
GROWTH = 1.25
"""How much wider a sphere about a joint gets while the links still touch."""


@dataclass(frozen=True)
class FitResult:
    """A fit, and which links touch all the same.

    Attributes:
        fit: The room made.
        frames: Frames looked at.
        touching: Links that touch all the same, with the number of frames; not neighbours.
    """

    fit: BodyFit
    frames: int
    touching: dict[Pair, int]

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know."""
        notes = []
        if self.fit.side != "below":
            notes.append(f"The base plate stands {PLACES[self.fit.side]} the base, out of the way of the motion.")
        for (i, j), frames in sorted(self.touching.items()):
            first, second = ("base_link" if k == 0 else f"link_{k}" for k in (i, j))
            share = f"{frames} of {counted(self.frames, 'frame')}"
            notes.append(f"{first} and {second} touch in {share} of the demonstrated motion.")
        return tuple(notes)


PLACES = {
    "below": "below",
    "above": "above",
    "behind": "behind",
    "left": "to the left of",
    "right": "to the right of",
    "front": "in front of",
}


def fit_body(table: DHTable, q: ArrayLike, options: Body, side: str = AUTO) -> FitResult:
    """Find the room that a body has to make for a motion; no random numbers, same in same out.

    Args:
        table: The arm, n joints.
        q: Joint angles, shape (T, n) [rad].
        options: What the arm is built of.
        side: Where the base plate stands, one of ``SIDES``; ``auto`` puts it below, or where that touches the arm in
            motion, where most room is left.
    """
    angles = np.asarray(q, dtype=float)
    angles = angles[:: max(1, len(angles) // MOST_FRAMES)]
    spheres = (options.reach,) * table.dof
    fit = BodyFit(free_side(table, angles, options) if side == AUTO else side, spheres=spheres)
    while True:
        touching = _touching(table, angles, options, fit)
        near = {pair for pair in touching if meet(table, pair, options.reach)}
        if not near:
            return FitResult(fit, len(angles), touching)
        fit = _roomier(table, angles, options, fit, near)


def free_side(table: DHTable, q: Array, options: Body) -> str:
    """Below, unless the base touches the arm there; then the side that leaves it most room."""
    room = {}
    for side in SIDES:
        bodies = link_bodies(table, options, BodyFit(side))
        room[side] = CollisionScene(table, bodies).distance(q, lambda pair: pair[0] == 0)
        if room[side] > 0.0 and side == "below":
            return side
    return max(room, key=lambda side: room[side])


def _touching(table: DHTable, q: Array, options: Body, fit: BodyFit) -> dict[Pair, int]:
    """Frames in which each pair of links touches."""
    return CollisionScene(table, link_bodies(table, options, fit)).touching(q)


def meet(table: DHTable, pair: Pair, reach: float) -> bool:
    """Whether two links are neighbours: nothing between them, or only joints so close that their housings overlap."""
    i, j = pair
    return bool(np.hypot(table.a[i + 1 : j], table.d[i + 1 : j]).sum() < 2.0 * reach)


def _roomier(table: DHTable, q: Array, options: Body, fit: BodyFit, near: set[Pair]) -> BodyFit:
    """A fit with more room for neighbours that touch: the link before is cut back, a plate in the way let through."""
    without = replace(fit, plate=False)
    if fit.plate and any(i == 0 for i, _ in near):
        freed = near - set(_touching(table, q, options, without))
        if any(i == 0 for i, _ in freed):
            return without
    wider = {i for i, _ in near}
    return replace(fit, spheres=tuple(r * GROWTH if i in wider else r for i, r in enumerate(fit.spheres)))
