"""The holes of a part as a workshop wants them: groups with a letter each, what to drill, and where."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from string import ascii_uppercase
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.building.part_tolerances import ANGLE
from armdesign.building.parts import PITCHES, SCREWS, Part, Rod
from armdesign.building.projection import View
from armdesign.building.sheet import number


class HoleGroup(NamedTuple):
    """Holes that are alike.

    Attributes:
        letter: What they are called on the sheet.
        holes: They.
        words: What to drill.
        circle: Diameter of the circle they are on [m]; 0 where on none.
    """

    letter: str
    holes: tuple[Rod, ...]
    words: str
    circle: float = 0.0

    @property
    def places(self) -> list[Array]:
        """Where holes in cheeks are, both cheeks' alike, x and y in the front view, shape (2,) each [m]."""
        return [
            np.array(place) for place in dict.fromkeys(tuple(np.round(h.start[:2], 7).tolist()) for h in self.holes)
        ]

    @property
    def way(self) -> Array:
        """Their direction, shape (3,)."""
        return direction(self.holes[0])

    @property
    def middle(self) -> Array:
        """The middle of where they end, shape (3,) [m]."""
        middle: Array = np.mean([hole.end for hole in self.holes], axis=0)
        return middle

    def turn(self, view: View) -> float:
        """From the horizontal of a view that looks along them to the first, anticlockwise [rad]."""
        x, y = view.flat(self.holes[0].end - self.middle)
        return float(round(np.arctan2(y, x), 6) % (2.0 * np.pi / len(self.holes)))


def direction(hole: Rod) -> Array:
    """The direction of a hole, shape (3,)."""
    way: Array = (hole.end - hole.start) / np.linalg.norm(hole.end - hole.start)
    return way


@lru_cache(maxsize=64)
def hole_groups(part: Part) -> list[HoleGroup]:
    """The holes of a part by what they are for, their diameter and direction; bores without a letter are left out."""
    groups: dict[tuple[object, ...], list[Rod]] = {}
    for hole in part.holes:
        if hole.use:
            # the two walls of a tube are one hole, two cheeks one group: their ways are opposite
            own = hole.use in part.circles
            way, place = direction(hole) * own, 0.0 if own else round(float(hole.end[2]), 6)
            way = way if own and part.circles[hole.use].diameter else np.abs(way)
            key = (hole.use, round(hole.radius, 7), *np.round(way, 5).tolist(), place)
            groups.setdefault(key, []).append(hole)
    found = []
    for letter, ((use, *_), holes) in zip(ascii_uppercase, groups.items(), strict=False):
        circle = part.circles.get(str(use))
        words = drilling(part, str(use), holes)
        found.append(HoleGroup(letter, tuple(holes), words, 0.0 if circle is None else circle.diameter))
    return found


def drilling(part: Part, use: str, holes: list[Rod]) -> str:
    """What to drill, as '4 × M4 × 8, drill ⌀3.3 × 10.5'.

    Args:
        part: The part.
        use: What the holes are for.
        holes: They, all alike.
    """
    size = f"⌀{number(2e3 * holes[0].radius, 2)}"
    if use not in part.circles:
        return f"{size} +0.1 / 0 across, both walls"
    thread, count = part.circles[use].thread, len(holes)
    (clear, tap, _), what = SCREWS[thread], use.split(" (", maxsplit=1)[0]
    if abs(2.0 * holes[0].radius - clear) < 1e-6:
        return f"{count} × {size} through, for {thread}{'' if what == 'through' else f': {what}'}"
    if abs(2.0 * holes[0].radius - tap) < 1e-6:
        return f"{count} × {thread} {tapping(part, thread, holes)}: {what}"
    return f"{count} × {size} counterbore, {number(1e3 * part.sizes['under heads'], 2)} left under heads"


def tapping(part: Part, thread: str, holes: list[Rod]) -> str:
    """How deep thread and drill are: 'through, drill ⌀3.3', '× 8, drill ⌀3.3 × 10.5' or '× 8, drill ⌀3.3 through'.

    Under a blind thread the drill goes on by three pitches, the short run-out of DIN 76, and its tip by 0.3 diameters.
    Where no material is left below that, it goes through; where there it would meet other holes, the thread ends two
    pitches above the drill, for a bottoming tap.

    Args:
        part: The part.
        thread: Of the holes.
        holes: They, all alike.
    """
    size, deep = f"⌀{number(2e3 * holes[0].radius, 2)}", float(np.linalg.norm(holes[0].end - holes[0].start))
    inner = [hole for hole in holes if part.holds((hole.end + 1e-5 * direction(hole))[None])[0]]
    if not inner:
        return f"through, drill {size}"
    more = float(np.ceil(6e3 * PITCHES[thread] - 1e-9)) / 2e3
    onward = [drilled_on(part, hole) for hole in inner]
    if min(solid for solid, _ in onward) > more + 0.6 * holes[0].radius:
        return f"× {number(1e3 * deep)}, drill {size} × {number(1e3 * (deep + more))}"
    if len(inner) == len(holes) and max(out for _, out in onward) < deep + 10e-3:
        return f"× {number(1e3 * deep)}, drill {size} through"
    shorter = float(np.floor(2e3 * (deep - 2.0 * PITCHES[thread]) + 1e-9)) / 2e3
    return f"× {number(1e3 * shorter)}, drill {size} × {number(1e3 * deep)}, bottoming tap"


def drilled_on(part: Part, hole: Rod) -> tuple[float, float]:
    """How far a drill can go on from the end of a hole, 0.5 mm about it, and how far it is out; inf if through others.

    Args:
        part: The part.
        hole: One of its holes.

    Returns:
        Both in metres.
    """
    u, steps = direction(hole), np.arange(0.0, 0.2, 0.5e-3)
    across, turns = np.linalg.svd(u[None])[2][1:], np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    ring = (hole.radius + 0.5e-3) * (np.cos(turns)[:, None] * across[0] + np.sin(turns)[:, None] * across[1])
    points = (hole.end + steps[:, None] * u)[:, None] + ring
    inside = part.holds(points.reshape(-1, 3)).reshape(points.shape[:2])
    others = [other.holds(points.reshape(-1, 3)).reshape(points.shape[:2]) for other in part.holes if other is not hole]
    met = np.any(others, axis=(0, 2)) if others else np.zeros(len(steps), dtype=bool)
    last = int(np.argmin(inside.any(axis=1)))
    solid = steps[int(np.argmax(~inside.all(axis=1) | met))]
    return float(solid), float("inf") if met[:last].any() else float(steps[last])


def datum(part: Part) -> Array:
    """Of a bracket the foot of its face's axis on that face, in the front view, shape (2,) [m]."""
    return np.array([0.0, part.sizes.get("face above middle", 0.0)])


HOLE_HEADS = ("hole", "drill", "on ⌀", "first x, y", "at", "view")


def hole_rows(part: Part, views: list[View]) -> Iterator[tuple[str, ...]]:
    """Rows of the hole table by ``HOLE_HEADS``: letter, what to drill, and where from the datum of a view [mm].

    Args:
        part: The part.
        views: Those that its sheet has.
    """
    for group in hole_groups(part):
        seen = next((view for view in views if looks_along(view, group.way)), None)
        if part.kind == "bracket" and not group.circle:  # in cheeks, from the axis and the plate
            for k, place in enumerate(group.places, start=1):
                x, y = (number(1e3 * float(each), 2) for each in place - datum(part))
                yield f"{group.letter}{k}", group.words if k == 1 else "", "", f"{x}, {y}", "", "front"
        elif not group.circle:
            yield group.letter, f"{group.words}, at S", "", "", "", ""
        elif seen is None:
            yield group.letter, group.words, number(1e3 * group.circle, 2), "", "", ""
        else:
            turn = group.turn(seen)
            x, y = (number(5e2 * group.circle * float(each), 2) for each in (np.cos(turn), np.sin(turn)))
            name = seen.name.split(",")[0].removesuffix(" view").removeprefix("right ")
            at = f"{number(np.degrees(turn), 2)}°"
            yield group.letter, group.words, number(1e3 * group.circle, 2), f"{x}, {y}", at, name


def looks_along(view: View, way: Array) -> bool:
    """Whether a view shows holes of a direction as circles, to half of what angles may be off."""
    return bool(np.linalg.norm(view.flat(way)) < np.sin(ANGLE / 2.0) * np.linalg.norm(way))
