"""What has to be bought and cut: the bill of materials and the cut list, as CSV."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

import numpy as np

from armdesign.building import BILL, CUTS
from armdesign.building.build import Build
from armdesign.building.kit import EXACT, Kit, KitArm
from armdesign.building.parts import PITCHES, SCREWS, Screws
from armdesign.building.shop import ALUMINIUM
from armdesign.files import csv_table

GROUPS = {
    "bought": "To be bought", "cut": "Tubes to be cut", "made": "To be made", "printed": "To be printed",
    "screws": "Screws and nuts", "not chosen": "Still to be chosen",
}  # fmt: skip
"""How one comes by what a bill of materials lists, in its order, and the heading above."""
LENGTHS = (4, 5, 6, 8, 10, 12, 16, 20, 25, 30, 35, 40, 45, 50, 55, 60, 70, 80, 90, 100, 110, 120, 150, 200)
"""Of screws, under the head (ISO 4762) [mm]."""
SHORT = 0.5
"""By how much they may be shorter: js15 up to 50 mm [mm]."""

FRICTION, YIELD = 0.12, 640e6
"""Of screws' threads and heads, and the stress at which class 8.8 yields [Pa]."""
TIGHT = {False: 0.8, True: 0.2}
"""Share of VDI 2230's torque for screws in aluminium, and where a part is printed: what is under heads, or threads."""
TIGHTENING = {
    False: "Torques are 80 % of those of VDI 2230-1 for class 8.8 and a friction of 0.12, because threads and what is "
    "under heads are aluminium. An actuator's maker may allow less: then that holds.",
    True: "Torques are 20 % of those of VDI 2230-1 for class 8.8 and a friction of 0.12: an assumption, since no "
    "standard has printed PETG. Tighten again after a day. No thread lock on printed parts: it makes them crack. An "
    "actuator's maker may allow less: then that holds.",
}
"""Where torques are from, by whether parts are printed."""


class Row(NamedTuple):
    """A line of the bill of materials.

    Attributes:
        part: What it is called.
        quantity: How much of it.
        unit: Of the quantity.
        group: How one comes by it, one of ``GROUPS``.
        material: What it is made of, where it is made or cut.
        source: Where it is from.
        mass: Of one unit [kg]; None where it is not known.
        price: Of one unit; None where it is not known.
    """

    part: str
    quantity: float
    unit: str
    group: str
    material: str = ""
    source: str = ""
    mass: float | None = None
    price: float | None = None


def part_lists(build: Build) -> dict[str, str]:
    """The lists of a build by the names of their files."""
    return {BILL: bill_of_materials(build), CUTS: cut_list(build)}


def bill_of_materials(build: Build) -> str:
    """All that an arm takes, by how one comes by it, with its sums; prices that are not known are left empty.

    Actuators and what is made are counted by the piece, tubes by the metre without what the saw takes, screws by their
    standard length. Where parts do not fit together, actuators and tubes alone are listed. The first line of a build
    that is not to be made says so, with a quantity of 0.
    """
    rows = bill_rows(build)
    mass = sum(row.quantity * row.mass for row in rows if row.mass is not None)
    known = [row.quantity * row.price for row in rows if row.price is not None]
    text: list[tuple[object, ...]] = [(build.warning, 0, *[""] * 8)] if build.warning else []
    for row in rows:
        one = "" if row.mass is None else f"{row.mass:.4g}", "" if row.price is None else f"{row.price:.2f}"
        text.append((*row[:6], *one, "" if row.mass is None else f"{row.quantity * row.mass:.4g}",
                     "" if row.price is None else f"{row.quantity * row.price:.2f}"))  # fmt: skip
    text.append(("sum", *[""] * 7, f"{mass:.4g}", f"{sum(known):.2f}" if known else ""))
    money = f" [{build.currency}]" if build.currency else ""
    heads = ("part", "quantity", "unit", "group", "material", "source", "mass of one [kg]", f"price of one{money}",
             "mass [kg]", f"price{money}")  # fmt: skip
    return csv_table(heads, text)


def bill_rows(build: Build) -> list[Row]:
    """The lines of the bill of materials, by how one comes by them."""
    order = list(GROUPS)
    rows = sorted([*bought_rows(build), *made_rows(build)], key=lambda row: order.index(row.group))
    return rows + [Row(f"not chosen: {name}", count, "piece", "not chosen") for name, count in build.supply.open_items]


def grouped_bill(build: Build) -> dict[str, list[Row]]:
    """The bill as people read it: under headings, like screws in one line, no unit of pieces, mass and price of all."""
    found: dict[str, dict[str, Row]] = {}
    for row in bill_rows(build):
        name = row.part.removeprefix("not chosen: ")
        name = name.partition(", J")[0] if row.unit == "set" else name  # which end of which joint, the steps say
        lines, unit = found.setdefault(GROUPS[row.group], {}), "" if row.unit == "piece" else row.unit
        quantity = row.quantity + (lines[name].quantity if name in lines else 0)
        mass, price = (None if each is None else quantity * each for each in (row.mass, row.price))
        lines[name] = Row(name, quantity, unit, row.group, row.material, row.source, mass, price)
    return {title: list(lines.values()) for title, lines in found.items()}


def bought_rows(build: Build) -> list[Row]:
    """Actuators by the names that they are ordered by, links and brackets of a kit, and tubes."""
    rows = []
    for name, count in Counter(a.name for a in build.choice.actuators).items():
        a = next(each for each in build.choice.actuators if each.name == name)
        source = a.sheet or f"{a.maker} {a.family}".strip()
        rows.append(Row(build.supply.ordered(a), count, "piece", "bought", "", source, a.mass, a.price))
    if build.kit is not None and build.pieces is not None:
        return rows + kit_rows(build.pieces, build.kit, build.options.catalogue)
    lengths = [float(row[2]) for row in cuts(build)]
    body, tube = build.result.body.options, build.tube
    if lengths:
        name = f"tube {body.tube_diameter * 1e3:g} x {body.tube_wall * 1e3:g} mm" if tube is None else tube.name
        mass = float(np.pi * body.tube_wall * (body.tube_diameter - body.tube_wall) * body.tube_density)
        source, price = ("assumed", None) if tube is None else (build.options.stock or "aluminium", tube.price)
        density = body.tube_density if tube is None else tube.density
        material = "aluminium" if abs(density - ALUMINIUM[1]) < 150.0 else f"{density:g} kg/m^3"
        rows.append(Row(name, round(sum(lengths) / 1e3, 4), "m", "cut", material, source, mass, price))
    return rows


def made_rows(build: Build) -> list[Row]:
    """What is made, and the screws and nuts that join all; nothing where parts do not fit together."""
    if build.assembly is None:
        return []
    group = "printed" if build.options.printed else "made"
    rows = [
        Row(name, len(places), "piece", group, part.material, "its drawing", part.mass)
        for name, (part, places) in build.assembly.counted().items() if not part.bought and part.kind != "tube"
    ]  # fmt: skip
    screws: Counter[tuple[str, int, str]] = Counter()
    nuts: Counter[str] = Counter()
    for each in build.assembly.screws:
        if each.maker:
            rows.append(
                Row(f"screws into the {each.maker}, {each.joins[1]}", 1, "set", "screws", "", "maker's drawing")
            )
            continue
        screws[each.thread, screw_length(each), shortened(each)] += each.count
        nuts[each.thread] += each.count * each.nut
    rows += [Row(f"screw {thread} x {length}{cut}", count, "piece", "screws", "", "ISO 4762, class 8.8")
             for (thread, length, cut), count in sorted(screws.items())]  # fmt: skip
    return rows + [Row(f"locking nut {thread}", count, "piece", "screws", "", "ISO 10511")
                   for thread, count in sorted((+nuts).items())]  # fmt: skip


def screw_length(screws: Screws) -> int:
    """The shortest standard length that is long enough, under the head; with a nut also where it is short [mm]."""
    least = 1e3 * screws.length + (SHORT if screws.nut else 0.0)
    return next(length for length in LENGTHS if length >= least - 1e-6)


def shortened(screws: Screws) -> str:
    """What a screw has to be cut to, in words, where its standard length is too long; empty where not."""
    if screw_length(screws) <= 1e3 * screws.most + 1e-6:
        return ""
    return f", shortened to {np.floor(2e3 * screws.most) / 2.0:g} mm"


def torque(thread: str) -> float:
    """What a screw of class 8.8 is tightened with by VDI 2230-1, to 90 % of its yield with a friction of 0.12 [N m].

    M_A = F (0.16 P + 0.58 d2 mu + D_K mu / 2), F = 0.9 R_p A_0 / sqrt(1 + 3 t^2),
    t = 3 d2 / (2 d0) (P / (pi d2) + 1.155 mu), with d0 = (d2 + d3) / 2, A_0 its circle, and D_K the mean of the
    head's diameter and its hole's.

    Args:
        thread: One of ``SCREWS``.
    """
    pitch, (clear, _, head), d = PITCHES[thread], SCREWS[thread], 1e-3 * float(thread[1:])
    d2, d3 = d - 0.6495 * pitch, d - 1.2269 * pitch
    d0 = (d2 + d3) / 2.0
    shear = 1.5 * d2 / d0 * (pitch / (np.pi * d2) + 1.155 * FRICTION)
    force = 0.9 * YIELD * np.pi / 4.0 * d0**2 / np.sqrt(1.0 + 3.0 * shear**2)
    return float(force * (0.16 * pitch + 0.58 * d2 * FRICTION + (head + clear) / 4.0 * FRICTION))


def tightening(screws: Screws, *, printed: bool = False) -> str:
    """With what torque screws are tightened and what keeps them, in words.

    Args:
        screws: The screws, with a thread.
        printed: Whether what they hold is printed.
    """
    if screws.nut:
        return "tight by hand, so that the tube is not dented; the nut locks itself"
    moment = f"{TIGHT[printed] * torque(screws.thread):.2g} N m"
    if not printed:
        return f"{moment}, with medium thread lock"
    into_metal = "-" not in screws.joins[0] and screws.joins[0] != "B"  # an actuator
    return f"{moment}, " + ("thread lock on its tip alone" if into_metal else "no thread lock")


def kit_rows(arm: KitArm, kit: Kit, family: str) -> list[Row]:
    """Rows of the bill for a kit's links and brackets, in order from the base on, and for what is made in their place.

    Args:
        arm: The pieces.
        kit: The kit.
        family: Whose they are.
    """
    rows = []
    for k, each in enumerate(arm.placed, start=1):
        place, turned, mass = f"joint {k} to {k + 1}", f"{np.degrees(each.alpha):.2f} deg", each.mass(kit)
        if each.piece is None:
            rows.append(Row(f"part {place}, {turned}", 1, "piece", "made", "", "to be made", mass))
        elif each.piece.extends:
            inline = {"a": "", "u": ", inline input", "w": ", inline output"}[each.piece.extends]
            name = f"link {each.piece.type}{inline}, extension {each.extension * 1e3:.1f} mm, {turned}, {place}"
            rows.append(Row(name, 1, "piece", "bought", "", family, mass))
        else:
            side = "Right" if each.alpha > 0.0 else "Left"
            name = f"bracket {each.piece.type}{side}{each.piece.variant}, {place}"
            rows.append(Row(name, 1, "piece", "bought", "", family, mass))
        if abs(each.spacer) > EXACT:
            rows.append(Row(f"spacer {each.spacer * 1e3:.1f} mm, {place}", 1, "piece", "made", "", "to be made"))
    return rows


def cut_list(build: Build) -> str:
    """Every tube by its mark, with its length, its clocking and the angles of the brackets at its ends.

    The first line of a build that is not to be made says so, with a length of 0.
    """
    turned = "S of -b from S of -a, 0 to 360, clockwise seen from the inner end [deg]"
    heads = ("mark", "tube", "length [mm]", "outer diameter [mm]", "pin holes from the ends [mm]", turned,
             "inner end to", "its angle [deg]", "outer end to", "its angle [deg]")  # fmt: skip
    warning = [(build.warning, "", "0", *[""] * 7)] if build.warning else []
    return csv_table(heads, [*warning, *cuts(build)])


def cuts(build: Build) -> list[tuple[str, ...]]:
    """The rows of the cut list; of parts that do not fit together the tubes of the arm's body, without their ends."""
    if build.kit is not None and build.pieces is not None:
        links = [(k, each) for k, each in enumerate(build.pieces.placed, 1) if each.piece and each.piece.extends]
        return [
            ("", f"link, joint {k} to {k + 1}", f"{(each.extension - build.kit.shortest) * 1e3:.1f}",
             f"{build.kit.tube_diameter * 1e3:g}", "", "", "", "", "", "")
            for k, each in links
        ]  # fmt: skip
    if build.assembly is None:
        solids = [part for part in build.result.body.parts if part.solid.material == "tube"]
        return [
            ("", p.name, f"{1e3 * p.solid.length:.1f}", f"{2e3 * p.solid.radius:g}", "", "", "", "", "", "")
            for p in solids
        ]
    by_mark = {each.mark: each for each in build.assembly.placed}
    held = {each.joins[0]: each.joins[1] for each in build.assembly.screws}
    rows = []
    for each in build.assembly.placed:
        if each.part.kind != "tube":
            continue
        sizes = each.part.sizes
        ends: list[str] = []
        for end in "ab":
            other = held.get(f"{each.mark}-{end}", "")
            angle = by_mark[other].part.sizes.get("angle") if other in by_mark else None
            ends += [other or "tool", "" if angle is None else f"{np.degrees(angle):.2f}"]
        turn = np.degrees(sizes["turn of S"])
        rows.append(
            (each.mark, each.part.name, f"{1e3 * sizes['length']:.2f}", f"{1e3 * sizes['diameter']:g}",
             f"{1e3 * sizes['hole from end']:.2f}", f"{round(turn, 2) + 0.0:.2f}", *ends)
        )  # fmt: skip
    return rows
