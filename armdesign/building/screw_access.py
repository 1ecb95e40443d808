"""Whether the screws that hold a bracket on its face can be put in: heads, and keys along their holes, meet nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.building.parts import SCREWS, Part, Prism, Rod
from armdesign.building.shop import WEDGE, Face, Shop
from armdesign.errors import CatalogueError

SINK, BESIDE = 0.25e-3, 1e-3
"""Of what heads are sunk in: how much wider it is on either side, what is left beside it if drilled by hand [m]."""


class TurnError(CatalogueError):
    """A bracket of some kind does not turn so far, or its screws are not reached; another kind may do."""


def passed_by(taps: Sequence[Rod], places: Array) -> Array:
    """How near axes along y, at x and z, shape (..., k, 2), pass by those of tapped holes, shape (...) [m]."""
    plan = np.concatenate([np.linspace(tap.start, tap.end, 9) for tap in taps])[:, [0, 2]]
    gaps: Array = np.linalg.norm(places[..., None, :] - plan, axis=-1).min(axis=(-2, -1))
    return gaps


def overhung(part: Part, height: float, places: Array) -> Array:
    """How near axes along y, at x and z, (..., k, 2), pass by what of a part is above a height, shape (...) [m]."""
    least = np.full(places.shape[:-2], np.inf)
    for form in (each for each in part.solids if isinstance(each, Prism)):
        (x, y), (next_x, next_y) = form.polygon.T, np.roll(form.polygon, -1, axis=0).T
        cut = (y > height) != (next_y > height)
        seen = np.append(x[y > height], x[cut] + (height - y[cut]) / (next_y - y)[cut] * (next_x - x)[cut])
        if len(seen):
            middle = np.array([(seen.max() + seen.min()) / 2.0, form.z])
            half = np.array([np.ptp(seen), form.width]) / 2.0
            away = np.linalg.norm(np.maximum(np.abs(places - middle) - half, 0.0), axis=-1)
            least = np.minimum(least, away.min(axis=-1))
    return least


def heads_reach(face: Face) -> float:
    """How far heads of a face's screws reach towards a second plate [m]; -inf where their places are not known."""
    circle, far = face.circle, -np.inf
    if len(face.back):
        far = float(face.back[:, 0].max())
    elif circle.known or not circle.maker:
        far = circle.diameter / 2.0 * np.cos(np.pi / circle.count)
    return far + SCREWS[circle.thread][2] / 2.0


def wall_beside(face: Face, shop: Shop) -> float:
    """From the axis of a screw of a face, its head sunk in a block, to that of a tapped hole at least [m]."""
    wall = BESIDE if face.circle.maker else SINK  # by hand, by the machine
    return SCREWS[face.circle.thread][2] / 2.0 + SINK + SCREWS[shop.circle.thread][1] / 2.0 + wall


def reached(part: Part, face: Face, places: Array, shop: Shop) -> NDArray[np.bool_]:
    """Whether heads of a face's screws, and a key to each along its hole, meet nothing of a bracket, shape (...).

    Heads are sunk in a block, beside its tapped holes, or lie on a plate, clear of all that leans over it.

    Args:
        part: The bracket.
        face: The face.
        places: Of the holes, x and z, shape (..., k, 2) [m].
        shop: What the bracket is made for.
    """
    if part.note == "wedge":
        taps = [hole for hole in part.holes if "tapped" in hole.use]
        return np.asarray(passed_by(taps, places) >= wall_beside(face, shop))
    above = face.height + part.sizes["plate"] + 1e-6
    return np.asarray(overhung(part, above, places) >= SCREWS[face.circle.thread][2] / 2.0 + SINK)


def head_room(part: Part, face: Face, shop: Shop) -> float:
    """Diameter of the largest circle on which heads of a face's screws have room on a bracket and are reached [m].

    Args:
        part: The bracket.
        face: The face; 0 where the places of its holes are known, but are on no circle about the axis.
        shop: What the bracket is made for.

    Raises:
        TurnError: There is no room for its holes as far as they are known.
    """
    circle, found = face.circle, 0.0
    if len(face.back):
        clear = bool(reached(part, face, face.back, shop))
    elif not circle.maker:
        clear = bool(reached(part, face, circle.places(part.sizes["turn of the face's circle"]), shop))
    else:
        head, turns = SCREWS[circle.thread][2] / 2.0, np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
        ring, up = np.stack([np.cos(turns), 0.0 * turns, np.sin(turns)], axis=1), np.array([0.0, 1.0, 0.0])
        thick = WEDGE - 1e-3 if part.note == "wedge" else part.sizes["plate"]
        around = replace(circle, diameter=2.0).places(circle.turns)
        halves = np.arange(0.25e-3, 0.1, 0.25e-3)
        rims = (halves[:, None, None] + head + 1.5e-3) * ring + face.height * up
        on = part.holds(np.concatenate([rims, rims + thick * up], axis=1).reshape(-1, 3)).reshape(len(halves), -1)
        halves = halves[: np.append(on.all(axis=1), False).argmin()]
        free = reached(part, face, halves[:, None, None, None] * around, shop).any(axis=1)
        halves = halves[: np.append(free, False).argmin()]
        found = 2.0 * float(halves[-1]) if len(halves) else 0.0
        clear = found >= (circle.diameter - 1e-9 if circle.known else 1e-9)
    if not clear:
        raise TurnError(
            f"heads of the screws into {face.mark} have no room on its bracket, or no key reaches them", value=found,
            fix="Take other tubes or actuators, or search with a larger --clearance",
        )  # fmt: skip
    return found
