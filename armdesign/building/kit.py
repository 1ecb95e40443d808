"""Kits: links and brackets that are bolted between actuators, and which of them make up a DH table.

A piece ties the output flange of one actuator to the housing of the next. Between the axes of joints j and j + 1 it is

    Tz(u) Rx(alpha) Tx(a) Tz(w),

u along the first axis from the flange on, w along the second up to the housing's face: a row of a modified DH table.
An actuator of height h between two pieces makes d = w + h + u of the pieces on its two sides. The kit's pieces are

* a **link** whose tube is at a right angle to both axes: u = w = offset, alpha any, a its extension;
* a link whose tube leaves along the first axis (Inline in): u its extension, w = offset, alpha = +-90 deg, a = 0;
* a link whose tube ends along the second axis (Inline out): u = offset, w its extension, alpha = +-90 deg, a = 0;
* a **bracket**: u and w its own, alpha = +-90 deg, a = 0.

What stands between the base and the first actuator, and between the last and the tool, is made, so that d of the first
and of the last joint is free. In a catalogue, lengths and masses in its units:

    [kit]
    tube_diameter = 32.0
    shortest = 25.4               # extension of a link without tube
    [kit.link]
    type = "R8"                   # as HRDF calls it
    offset = 20.0
    mass = 0.199                  # of a link without extension
    mass_per_metre = 0.4
    inline_input = 0.015          # what adapters along the axis weigh more
    inline_output = 0.013
    [[kit.bracket]]
    type = "R8Light"
    before = 40.0                 # u
    after = 43.0                  # w
    mass = 0.14
    variant = ""                  # what HRDF has behind Left and Right
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from armdesign.files import is_number
from armdesign.kinematics.dh import DHTable

EXACT = 1e-7
"""Difference of a length or angle from a piece's that is none [m; rad]."""
SPACER, NO_PIECE = 1.0, 10.0
"""What a spacer to be made counts, and a part to be made in place of a piece of the kit."""
LINK_FIGURES = ("offset", "mass", "mass_per_metre", "inline_input", "inline_output")
BRACKET_FIGURES = ("before", "after", "mass")
INLINE = ("RightAngle", "Inline")


class Piece(NamedTuple):
    """A kind of piece of a kit.

    Attributes:
        type: What HRDF calls it: a link's style, or a bracket's up to Left and Right.
        extends: Which length is its extension: ``a``, ``u`` or ``w``; empty for a bracket.
        u: Along the first axis [m]; 0 where that is the extension.
        w: Along the second axis [m]; 0 where that is the extension.
        mass: Without extension [kg].
        variant: Of a bracket, what HRDF has behind Left and Right.
    """

    type: str
    extends: str
    u: float
    w: float
    mass: float
    variant: str = ""

    @property
    def square(self) -> bool:
        """Whether its axes are at a right angle and meet, so that alpha = +-90 deg and a = 0."""
        return self.extends != "a"


@dataclass(frozen=True)
class Kit:
    """The links and brackets of a family.

    Attributes:
        pieces: Kinds of pieces.
        shortest: Least extension of a link [m].
        mass_per_metre: Of a link's tube [kg/m].
        tube_diameter: Of a link's tube [m].
    """

    pieces: tuple[Piece, ...]
    shortest: float
    mass_per_metre: float
    tube_diameter: float

    @property
    def fittings(self) -> float:
        """Mass of what is bolted to an actuator, a link's without its tube [kg]; a bracket weighs about the same."""
        return max(piece.mass for piece in self.pieces if piece.extends)

    @property
    def body(self) -> dict[str, float]:
        """Settings of a body with the kit's tubes: their diameter, as massive as they weigh."""
        return {"tube_diameter": self.tube_diameter, "tube_wall": self.tube_diameter / 2.0,
                "tube_density": 4.0 * self.mass_per_metre / (np.pi * self.tube_diameter**2)}  # fmt: skip


class Placed(NamedTuple):
    """A piece in an arm.

    Attributes:
        piece: Its kind; None for a part to be made.
        extension: Of a link [m]; 0 of a bracket.
        alpha: Twist from the axis before to the one behind, axes as in ``KitArm`` [rad].
        a: Distance of the axes [m].
        u: Along the first axis [m].
        w: Along the second axis [m].
        spacer: What has to be put under it [m]; negative where it does not fit.
    """

    piece: Piece | None
    extension: float
    alpha: float
    a: float
    u: float
    w: float
    spacer: float

    def mass(self, kit: Kit) -> float:
        """Of a piece of the kit; of a part to be made as if it were a tube of the kit [kg]."""
        if self.piece is None:
            return kit.mass_per_metre * (abs(self.a) + abs(self.u) + abs(self.w))
        return self.piece.mass + kit.mass_per_metre * self.extension


@dataclass(frozen=True)
class KitArm:
    """An arm of a kit.

    Attributes:
        signs: 1 where a joint's axis is that of the table, -1 where it is turned round, so that d is not negative, n
            of them; the angle of the joint then is minus that of the run.
        first: w ahead of the first actuator, along its axis from the corner C_1 on [m].
        placed: Pieces between the actuators, n - 1 of them.
        last: u behind the last actuator, from its flange to the origin of its joint's frame [m].
    """

    signs: tuple[int, ...]
    first: float
    placed: tuple[Placed, ...]
    last: float

    @property
    def whole(self) -> bool:
        """Whether it is made of the kit's pieces alone, between its first and its last actuator."""
        return all(each.piece is not None and abs(each.spacer) <= EXACT for each in self.placed)


def kit_faults(kit: object) -> Iterator[str]:
    """What is wrong with the kit of a catalogue.

    Args:
        kit: Its table.
    """
    if not isinstance(kit, dict):
        yield f"'kit' is {kit!r}, not a table [kit]"
        return
    for name in kit:
        if name not in ("tube_diameter", "shortest", "link", "bracket"):
            yield f"unknown entry 'kit.{name}'; allowed: tube_diameter, shortest, link, bracket"
    link, brackets = kit.get("link"), kit.get("bracket", [])
    if not isinstance(link, dict) or not isinstance(brackets, list) or not all(isinstance(x, dict) for x in brackets):
        yield "a [kit] needs a table [kit.link], and its brackets are tables [[kit.bracket]]"
        return
    places = [("kit", kit, ("tube_diameter", "shortest")), ("kit.link", link, LINK_FIGURES)]
    places += [("kit.bracket", each, BRACKET_FIGURES) for each in brackets]
    for where, table, figures in places:
        for name in figures:
            low = -1e3 if name == "after" else 0.0
            value = table.get(name, "missing")
            if not is_number(value) or not low <= value <= 1e3:
                yield f"'{where}.{name}' is {value!r}; allowed: a number, {low:g} to 1000"
        for name in table:
            if where != "kit" and name not in (*figures, "type", "variant"):
                yield f"unknown entry '{where}.{name}'; allowed: {', '.join((*figures, 'type', 'variant'))}"
        if where != "kit" and not (isinstance(table.get("type"), str) and table["type"]):
            yield f"'{where}.type' is {table.get('type', 'missing')!r}, not a text"
        if not isinstance(table.get("variant", ""), str):
            yield f"'{where}.variant' is {table['variant']!r}, not a text"


def kit_of(content: Mapping[str, Any], scales: Mapping[str, float]) -> Kit:
    """The kit of a checked catalogue.

    Args:
        content: Its table [kit].
        scales: Sizes of the catalogue's units.
    """
    metre, kilogram, link = scales["length"], scales["mass"], content["link"]
    offset = metre * link["offset"]
    pieces = [
        Piece(link["type"], "a", offset, offset, kilogram * link["mass"]),
        Piece(link["type"], "u", 0.0, offset, kilogram * (link["mass"] + link["inline_input"])),
        Piece(link["type"], "w", offset, 0.0, kilogram * (link["mass"] + link["inline_output"])),
    ]
    pieces += [
        Piece(each["type"], "", metre * each["before"], metre * each["after"], kilogram * each["mass"],
              each.get("variant", ""))
        for each in content.get("bracket", [])
    ]  # fmt: skip
    return Kit(tuple(pieces), metre * content["shortest"], kilogram * link["mass_per_metre"],
               metre * content["tube_diameter"])  # fmt: skip


def kit_arm(table: DHTable, heights: Sequence[float], kit: Kit) -> KitArm:
    """The pieces that an arm is made of, parts to be made where the kit has none.

    Of each pair of neighbouring axes every piece that has their twist and distance may be taken; the choice is that
    with the fewest parts and spacers to be made, by dynamic programming from the base on.

    Args:
        table: The arm, n joints that turn.
        heights: Of the actuators, from the housing's face to the flange, n of them [m].
        kit: The kit.
    """
    n = table.dof
    signs = tuple(-1 if 0 < i < n - 1 and table.d[i] < 0.0 else 1 for i in range(n))
    rooms = [float(signs[i] * table.d[i] - heights[i]) for i in range(n)]
    twists = [float(table.alpha[k + 1]) + np.pi / 2.0 * (2 - signs[k] - signs[k + 1]) for k in range(n - 1)]
    gaps = [(float(np.mod(x + np.pi, 2.0 * np.pi) - np.pi), float(table.a[k + 1])) for k, x in enumerate(twists)]
    best: list[tuple[float, tuple[Piece | None, ...]]] = [(0.0, ())]
    for k, gap in enumerate(gaps):
        reached = []
        for piece in (*fitting(*gap, kit), None):
            steps = []
            for cost, taken in best:
                spacer = shared(rooms[k], taken[-1], piece, kit)[2] if taken else 0.0
                steps.append((cost + NO_PIECE * (piece is None) + misfit(spacer), (*taken, piece)))
            reached.append(min(steps, key=lambda step: step[0]))
        best = reached
    pieces = min(best, key=lambda step: step[0])[1]
    if not pieces:
        return KitArm(signs, 0.0, (), rooms[0])
    # u and w of each, and the spacer under it; the ends are free
    joints = [shared(rooms[k], pieces[k - 1], pieces[k], kit) for k in range(1, n - 1)]
    first, last = end(rooms[0], pieces[0], "u", kit), end(rooms[-1], pieces[-1], "w", kit)
    u = [first, *(each[1] for each in joints)]
    w = [*(each[0] for each in joints), last]
    spacers = [0.0, *(each[2] for each in joints)]
    placed = []
    for k, piece in enumerate(pieces):
        lengths = {"a": gaps[k][1], "u": u[k], "w": w[k]}
        extension = lengths[piece.extends] if piece is not None and piece.extends else 0.0
        placed.append(Placed(piece, extension, *gaps[k], u[k], w[k], spacers[k]))
    return KitArm(signs, rooms[0] - first, tuple(placed), rooms[-1] - last)


def fitting(alpha: float, a: float, kit: Kit) -> list[Piece]:
    """The pieces of a kit that have a twist alpha [rad] and a distance of axes a [m]."""
    square = abs(abs(alpha) - np.pi / 2.0) <= EXACT and abs(a) <= EXACT
    return [each for each in kit.pieces if (square if each.square else a >= kit.shortest - EXACT)]


def shared(room: float, behind: Piece | None, ahead: Piece | None, kit: Kit) -> tuple[float, float, float]:
    """How the two pieces at a joint share what its d leaves beside the actuator, w + u + a spacer [m].

    An extension takes what is left, but is not shorter than the shortest, a part to be made whatever is left.

    Args:
        room: d less the actuator's height [m].
        behind: The piece that ends at the joint, whose w counts.
        ahead: The piece that begins at it, whose u counts.
        kit: The kit.

    Returns:
        w of the first, u of the second, and the spacer, negative where they do not fit.
    """
    w = behind.w if behind is not None and behind.extends != "w" else None
    u = ahead.u if ahead is not None and ahead.extends != "u" else None
    least = [0.0 if each is None else kit.shortest for each in (behind, ahead)]
    if w is None:
        w = max(room - u, least[0]) if u is not None else max(room - least[1], least[0])
        w = room - (u or 0.0) if behind is None and u is not None else w
    if u is None:
        u = room - w if ahead is None else max(room - w, least[1])
    return w, u, room - w - u


def misfit(spacer: float) -> float:
    """What a spacer counts in the choice of pieces; one of negative length more than any part to be made."""
    if abs(spacer) <= EXACT:
        return 0.0
    return SPACER if spacer > 0.0 else 100.0 * NO_PIECE


def end(room: float, piece: Piece | None, side: str, kit: Kit) -> float:
    """Length u or w of a piece at the first or last joint, where the part that is made takes the rest [m].

    Args:
        room: d less the actuator's height [m].
        piece: The piece; None for a part to be made.
        side: Which length: ``u`` or ``w``.
        kit: The kit.
    """
    if piece is None:
        return 0.0
    if piece.extends == side:
        return max(room, kit.shortest)
    return piece.u if side == "u" else piece.w
