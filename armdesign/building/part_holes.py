"""The holes of a part as a workshop wants them: groups with a letter each, what to drill, and where."""

from __future__ import annotations

from collections.abc import Iterator
from string import ascii_uppercase
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.building.part_tolerances import ANGLE
from armdesign.building.parts import SCREWS, Part, Rod
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


def hole_groups(part: Part) -> list[HoleGroup]:
    """The holes of a part by what they are for, their diameter and direction; bores without a letter are left out."""
    groups: dict[tuple[object, ...], list[Rod]] = {}
    for hole in part.holes:
        if hole.use:
            # the two walls of a tube are one hole: the ways of both are opposite, their place along it is one
            own = hole.use in part.circles
            way, place = direction(hole) * own, 0.0 if own else round(float(hole.end[2]), 6)
            key = (hole.use, round(hole.radius, 7), *np.round(way, 5).tolist(), place)
            groups.setdefault(key, []).append(hole)
    found = []
    for letter, ((use, *_), holes) in zip(ascii_uppercase, groups.items(), strict=False):
        circle = part.circles.get(str(use))
        words = drilling(part, str(use), holes)
        found.append(HoleGroup(letter, tuple(holes), words, 0.0 if circle is None else circle.diameter))
    return found


def drilling(part: Part, use: str, holes: list[Rod]) -> str:
    """What to drill, as '4 × M4 tapped, 8 mm deep'.

    Args:
        part: The part.
        use: What the holes are for.
        holes: They, all alike.
    """
    size = f"⌀{number(2e3 * holes[0].radius, 2)}"
    if use not in part.circles:
        return f"{size} {use}, both walls"
    deep = float(np.linalg.norm(holes[0].end - holes[0].start))
    thread, count = part.circles[use].thread, len(holes)
    (clear, tap, _), what = SCREWS[thread], use.split(" (", maxsplit=1)[0]
    if abs(2.0 * holes[0].radius - clear) < 1e-6:
        return f"{count} × {size} clearance, {thread}: {what}"
    if abs(2.0 * holes[0].radius - tap) < 1e-6:
        blind = abs(deep - part.sizes.get("tapped depth", 0.0)) < 1e-6
        depth = f"{number(1e3 * deep)} deep" if blind else "through"
        return f"{count} × {thread} tapped, {depth}: {what}"
    return f"{count} × {size} counterbore, leaves {number(1e3 * part.sizes['under heads'], 2)}"


def hole_rows(part: Part, views: list[View]) -> Iterator[tuple[str, str, str]]:
    """Rows of the hole table: letter, what to drill, and where [mm].

    Args:
        part: The part.
        views: Those that its sheet has.
    """
    for group in hole_groups(part):
        seen = next((view for view in views if looks_along(view, group.way)), None)
        if group.circle:
            where = f"on ⌀{number(1e3 * group.circle, 2)}"
            if seen is not None:
                where += f", first at {number(np.degrees(group.turn(seen)), 2)}° in {seen.name.split(',')[0]}"
        elif part.kind == "tube":
            end = part.sizes["length"] - group.holes[0].end[2]
            near = min(end, group.holes[0].end[2])
            where = (
                f"{number(1e3 * near, 2)} from the end at {'-a' if group.letter == 'A' else '-b'}, in line with S there"
            )
        elif part.kind == "bracket":  # in cheeks
            x, y = (sorted({round(1e3 * float(place), 2) for place in np.abs(row)}) for row in (
                [hole.start[0] for hole in group.holes],
                [part.sizes["face above middle"] - hole.start[1] for hole in group.holes],
            ))  # fmt: skip
            where = f"{' and '.join(map(number, x))} from the axis, {' and '.join(map(number, y))} from the plate"
        else:
            where = f"{number(1e3 * part.sizes['hole from disc'], 2)} from the disc"
            where += ", in line with S" if part.scribes else ""
        yield group.letter, group.words, where
    if part.kind == "tube":
        turn = number(np.degrees(part.sizes["turn of S"]), 2)
        yield "S", "scribe lines, 15 long, at both ends", f"-b {turn}° from -a, clockwise seen from -a"
    for use, circle in part.circles.items():
        if circle.maker:
            yield "–", f"{use}: not drilled here", f"by the maker's drawing, {circle.maker}"


def looks_along(view: View, way: Array) -> bool:
    """Whether a view shows holes of a direction as circles, to half of what angles may be off."""
    return bool(np.linalg.norm(view.flat(way)) < np.sin(ANGLE / 2.0) * np.linalg.norm(way))
