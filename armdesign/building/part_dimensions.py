"""What is written on the views of a part: each dimension in the view that shows it as it is, and what goes where.

Frames and corners are those of ``brackets``, ``tube_joints`` and ``assembly``. Every value is the distance of two
points of the part's solids as the view shows it, so that none can differ from what STEP files have.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.building.part_holes import datum
from armdesign.building.part_tolerances import deviation
from armdesign.building.parts import Part, Placed, Prism, Rod, Screws
from armdesign.building.projection import View
from armdesign.building.sheet import number

FRONT = View("front view", (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
TOP = View("top view", (1.0, 0.0, 0.0), (0.0, 0.0, -1.0))
SIDE = View("right side view", (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
BOTTOM = View("bottom view", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
PART_VIEWS = (FRONT, TOP, SIDE)
"""Of a part in its own frame, in third angle; z is what brackets are drawn out along, and the axis of round parts."""


class Dimension(NamedTuple):
    """A length of a part.

    Attributes:
        view: What shows it as it is.
        start: One end, shape (3,) [m]; its line is drawn on the left of the way from here to the end if there is room.
        end: The other.
        words: Around its value in millimetres, which stands for {}.
    """

    view: View
    start: Array
    end: Array
    words: str = "{}"

    @property
    def text(self) -> str:
        """What is written."""
        return self.words.format(number(1e3 * float(np.linalg.norm(self.view.flat(self.end - self.start))), 2))


def outlines(part: Part) -> list[Array]:
    """Corners of the outlines that brackets and corners are drawn out from, shape (K, 3) each [m]."""
    return [np.insert(form.polygon, 2, 0.0, axis=1) for form in part.solids if isinstance(form, Prism)]


def seats(part: Part) -> list[Array]:
    """Middles of the planes of a bracket or corner on the sides of tubes or spacers, shape (3,) each [m]."""
    use, circle = next((use, circle) for use, circle in part.circles.items() if use.startswith("tube"))
    own = [hole for hole in part.holes if hole.use == use]
    least = min(hole.radius for hole in own)  # counterbores aside
    mouths = [hole.start for hole in own if hole.radius < least + 1e-7]
    count = circle.count
    return [
        np.mean(mouths[k : k + count], axis=0) for k in range(0, (2 if part.kind == "corner" else 1) * count, count)
    ]


def outward(part: Part) -> list[Array]:
    """Directions of the tubes at a bracket or corner, shape (3,) each."""
    angle = part.sizes["angle"]
    turns = [np.pi / 2.0 - angle] if part.kind == "bracket" else [angle / 2.0, -angle / 2.0]
    return [np.array([np.cos(turn), np.sin(turn), 0.0]) for turn in turns]


def crossing_point(part: Part) -> Array:
    """Where the axes that a bracket or corner joins meet, shape (3,) [m]; of parallel ones where its tube begins."""
    if part.kind == "corner":
        return np.zeros(3)
    seat, u = seats(part)[0], outward(part)[0]
    return seat if abs(u[0]) < 1e-9 else seat - seat[0] / u[0] * u


def part_dimensions(part: Part) -> list[Dimension]:
    """The dimensions of a part, shortest first, so that longer ones go outside them."""
    kind = part.note if part.kind == "bracket" else part.kind
    found = [*(OWN[kind](part) if kind in OWN else ()), *cheek_dimensions(part)]
    for each in overall(part):
        if not any(each.view == one.view and _same(each, one) for one in found):
            found.append(each)
    lengths = [round(float(np.linalg.norm(each.view.flat(each.end - each.start))), 9) for each in found]
    order = sorted(range(len(found)), key=lambda k: ("under" in found[k].words, lengths[k]))
    return [found[k] for k in order if lengths[k] > 0.0]


def _same(one: Dimension, other: Dimension) -> bool:
    """Whether two dimensions measure the same way."""
    first, second = (np.abs(each.view.flat(each.end - each.start)) for each in (one, other))
    return bool(np.allclose(first, second, atol=1e-7))


def overall(part: Part) -> Iterator[Dimension]:
    """Length, height and depth of all of a part; of round ones along the axis and across."""
    prisms = [form for form in part.solids if isinstance(form, Prism)]
    if not prisms:
        low, high = extent(part)
        outer = max(form.radius for form in part.solids if isinstance(form, Rod))
        tolerance = "" if len(part.solids) > 1 else f" ±{number(1e3 * deviation('length', high - low), 2)}"
        yield Dimension(SIDE, np.array([0.0, -outer, low]), np.array([0.0, -outer, high]), "{}" + tolerance)
        yield Dimension(FRONT, np.array([outer, -outer, high]), np.array([-outer, -outer, high]), "⌀{}")
        return
    corners = np.concatenate([form.ends.reshape(-1, 3) for form in prisms])
    least, most = corners.min(axis=0), corners.max(axis=0)
    yield Dimension(FRONT, np.array([most[0], least[1], 0.0]), least)
    yield Dimension(FRONT, least, np.array([least[0], most[1], 0.0]))
    yield Dimension(TOP, np.array([least[0], 0.0, most[2]]), least)


def extent(part: Part) -> tuple[float, float]:
    """Where a round part begins and ends along its axis [m]."""
    ends = [z for form in part.solids if isinstance(form, Rod) for z in (form.start[2], form.end[2])]
    return float(min(ends)), float(max(ends))


def wedge_dimensions(part: Part) -> Iterator[Dimension]:
    """Of a block with a tilted side."""
    left, right, low, high = outlines(part)[0]
    yield Dimension(FRONT, left, high)
    if part.sizes["angle"] > 0.0:
        yield Dimension(FRONT, low, right)
        yield Dimension(FRONT, np.array([0.0, left[1], 0.0]), seats(part)[0])
    yield Dimension(FRONT, np.array([0.0, left[1], 0.0]), left)
    sunk = next((hole for hole in part.holes if hole.use == "face"), None)
    if sunk is not None:
        x = max(hole.start[0] for hole in part.holes if hole.use == "face")
        yield Dimension(FRONT, np.array([x, sunk.end[1], 0.0]), np.array([x, sunk.start[1], 0.0]), "{} under heads")


def plates_dimensions(part: Part) -> Iterator[Dimension]:
    """Of two plates, the second square to a tube: from where the axes of actuator and tube meet, and what they are."""
    outline, corners = outlines(part)[:2]
    u, seat, meet = outward(part)[0], seats(part)[0], crossing_point(part)
    low, high = outline[:, 1].min(), outline[:, 1].max()
    back = np.array([outline[:, 0].min(), low, 0.0])
    upper = np.array([back[0], high, 0.0])
    axis = np.array([0.0, high, 0.0])
    yield Dimension(FRONT, back, upper)
    yield Dimension(FRONT, upper, axis)
    if part.note == "standing":
        foot = outline[np.argmax(outline[:, 0])]
        yield Dimension(FRONT, foot, back)
        yield Dimension(FRONT, np.array([max(seat[0], foot[0]), seat[1], 0.0]), np.array([foot[0], low, 0.0]))
    elif abs(meet[1] - low) > 1e-6:
        yield Dimension(FRONT, np.array([back[0], meet[1], 0.0]), back)
    if float(np.linalg.norm(seat - meet)) > 1e-6:
        yield Dimension(FRONT, seat, meet)
    e = np.array([u[1], -u[0], 0.0])  # along the second plate, away from the first
    outer = sorted((corner for corner in corners if abs((corner - seat) @ u) < 1e-7), key=lambda c: float(c @ e))
    thick = float(np.max((seat - corners) @ u))
    if part.note == "standing":
        yield Dimension(FRONT, outer[0] - thick * u, outer[0])
        yield Dimension(FRONT, outer[0], seat)
    else:
        yield Dimension(FRONT, outer[-1], outer[-1] - thick * u)
        yield Dimension(FRONT, seat, outer[-1])
    yield Dimension(FRONT, outer[0], outer[-1])


def cheek_dimensions(part: Part) -> Iterator[Dimension]:
    """Of the cheeks beside a box, and of the plate between them and a wedge."""
    prisms = [form for form in part.solids if isinstance(form, Prism)]
    axis = np.append(datum(part), 0.0)
    for form in prisms:
        low, high = form.ends.min(axis=(0, 1)), form.ends.max(axis=(0, 1))
        if form.z > 0.0:
            yield Dimension(FRONT, np.array([high[0], axis[1], 0.0]), np.array([high[0], low[1], 0.0]))
            yield Dimension(FRONT, np.array([high[0], low[1], 0.0]), np.array([axis[0], low[1], 0.0]))
            yield Dimension(FRONT, np.array([axis[0], low[1], 0.0]), np.array([low[0], low[1], 0.0]))
            yield Dimension(BOTTOM, low, np.array([low[0], low[1], high[2]]))
            yield Dimension(BOTTOM, low * [1.0, 1.0, -1.0], low, "{} +0.2/0")  # a housing has to go in
        elif part.note == "wedge" and form is not prisms[0]:
            left = np.array([low[0], low[1], 0.0])
            yield Dimension(FRONT, left, np.array([low[0], high[1], 0.0]))
            yield Dimension(FRONT, axis, left)
            yield Dimension(BOTTOM, low, np.array([low[0], low[1], high[2]]))
            block = prisms[0].ends.max(axis=(0, 1)), prisms[0].ends.min(axis=(0, 1))
            yield Dimension(TOP, block[1], np.array([block[1][0], 0.0, block[0][2]]))


def corner_dimensions(part: Part) -> Iterator[Dimension]:
    """Of a block between two tubes: each side, how far it is from where their axes meet, how thick its edges are."""
    corners, part_faces = outlines(part)[0], seats(part)
    for seat, u in zip(part_faces, outward(part), strict=True):
        along = np.array([u[1], -u[0], 0.0])
        on = sorted((c for c in corners if abs((c - seat) @ u) < 1e-7), key=lambda c: float(c @ along))
        yield Dimension(FRONT, on[0], on[-1])
        yield Dimension(FRONT, on[0], seat)
        yield Dimension(FRONT, np.zeros(3), seat)
        faces = [face for face in part_faces if face is not seat]
        for end in (on[0], on[-1]):
            for inner in corners:
                along_edge = abs((inner - end) @ along) < 1e-7 and (end - inner) @ u > 1e-6
                of_other = any(abs((each - face) @ face) < 1e-9 for face in faces for each in (end, inner))
                if along_edge and not of_other:
                    yield Dimension(FRONT, *((inner, end) if end is on[0] else (end, inner)))


def round_dimensions(part: Part) -> Iterator[Dimension]:
    """Along a disc with a spigot, or a plate: how thick, how long, how wide, and where the hole across is."""
    disc, *spigots = (form for form in part.solids if isinstance(form, Rod))
    low, up = np.array([0.0, -disc.radius, 0.0]), np.array([0.0, 0.0, 1.0])
    for spigot in spigots:
        side = np.array([0.0, spigot.radius, 0.0])
        tolerance = f" ±{number(1e3 * deviation('thickness', disc.end[2]), 2)}"
        yield Dimension(SIDE, low, low + disc.end[2] * up, "{}" + tolerance)
        yield Dimension(SIDE, spigot.end + side, spigot.start + side)
        yield Dimension(SIDE, spigot.end - side, spigot.end + side, "⌀{} (bore −0.05 / −0.1)")
        hole = next(hole for hole in part.holes if hole.oblique)
        yield Dimension(SIDE, hole.end * up + side, spigot.start + side)
    for hole in part.holes:
        if hole.use == "through" and hole.end[2] < disc.end[2] - 1e-7:
            side = np.array([0.0, hole.end[1], 0.0])
            yield Dimension(SIDE, side + disc.start[2] * up, side + hole.end[2] * up, "{} under heads")
            break


def tube_dimensions(part: Part) -> Iterator[Dimension]:
    """Along a tube: its holes and scribe lines from its ends, and its wall."""
    length, radius = part.sizes["length"], part.sizes["diameter"] / 2.0
    side, z = np.array([0.0, radius, 0.0]), np.array([0.0, 0.0, 1.0])
    for end, way_in in ((0.0, 1.0), (length, -1.0)):
        hole = end + way_in * part.sizes["hole from end"]
        ends = side + hole * z, side + end * z
        yield Dimension(SIDE, *(ends if way_in > 0.0 else ends[::-1]))
    yield Dimension(SIDE, length * z - side, length * z - side + 2.0 * side, "⌀{}")


OWN = {
    "wedge": wedge_dimensions, "angle": plates_dimensions, "standing": plates_dimensions, "corner": corner_dimensions,
    "tube flange": round_dimensions, "tool plate": round_dimensions, "base plate": round_dimensions,
    "spacer": round_dimensions, "tube": tube_dimensions,
}  # fmt: skip

"""By kind; a bracket's kind is its note."""
ENDS = {
    "tube": ("end -a", "end -b"), "tube flange": ("on bracket or corner", "in tube"), "tool plate": ("tool", "in tube"),
    "base plate": ("floor", "bracket"), "spacer": ("", ""),
}  # fmt: skip
"""What goes on a round part where its z is least, and where it is most."""


def sides(places: Sequence[Placed], screws: Sequence[Screws]) -> list[tuple[str, Array]]:
    """What goes on which side of a part, in words, and a point of that side, shape (3,) [m].

    Args:
        places: Where the part is in the arm.
        screws: All of the arm.
    """
    part, z = places[0].part, np.array([0.0, 0.0, 1.0])
    if part.kind not in ("bracket", "corner"):
        ends = extent(part)
        return [(words, end * z) for words, end in zip(ENDS[part.kind], ends, strict=True) if words]
    held: dict[int, dict[str, list[str]]] = {}
    for each in places:
        for joined in screws:
            if each.mark in joined.joins:
                other = joined.spacer or next(mark for mark in joined.joins if mark != each.mark)
                tube, of = re.search(r"-T(\d+)", other), re.search(r"-C(\d+)", each.mark)
                side, what = -1, "base plate"
                if tube is not None:
                    side = 0 if of is None else int(tube[1]) - int(of[1])
                    what = "tube" if other.endswith(("-a", "-b")) else "spacer"
                elif other != "B":
                    what = f"{'housing' if each.mark.endswith(f'L{other[1:]}') else 'output'} of actuator"
                held.setdefault(side, {}).setdefault(what, []).append(other)
    faces = {k: seat + 5e-3 * np.array([turn[1], -turn[0], 0.0])
             for k, (seat, turn) in enumerate(zip(seats(part), outward(part), strict=True))}  # fmt: skip
    faces[-1] = np.append(datum(part), 0.0) - [5e-3, 0.0, 0.0]
    return [(" / ".join(f"{what} {', '.join(marks)}" for what, marks in words.items()), faces[side])
            for side, words in held.items()]  # fmt: skip
