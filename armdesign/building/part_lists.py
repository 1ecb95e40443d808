"""What has to be bought and cut: the bill of materials and the cut list, as CSV."""

from __future__ import annotations

from collections import Counter

import numpy as np

from armdesign.building.build import Build
from armdesign.building.kit import EXACT, Kit, KitArm
from armdesign.building.parts import Screws
from armdesign.files import csv_table

BILL = "parts.csv"
CUTS = "cuts.csv"
LENGTHS = (4, 5, 6, 8, 10, 12, 16, 20, 25, 30, 35, 40, 45, 50, 55, 60, 70, 80, 90, 100, 110, 120, 150, 200)
"""Of screws, under the head (ISO 4762) [mm]."""


def part_lists(build: Build) -> dict[str, str]:
    """The lists of a build by the names of their files."""
    return {BILL: bill_of_materials(build), CUTS: cut_list(build)}


def bill_of_materials(build: Build) -> str:
    """Part, quantity, source, mass and price of each, and their sums; prices that are not known are left empty.

    Actuators and what is made are counted by the piece, tubes by the metre without what the saw takes, screws by their
    standard length. Where parts do not fit together, actuators and tubes alone are listed.
    """
    rows: list[tuple[str, float, str, str, float, float | None]] = []
    actuators = {a.name: a for a in build.choice.actuators}
    for name, count in Counter(a.name for a in build.choice.actuators).items():
        a = actuators[name]
        rows.append((name, count, "piece", a.sheet or a.family, a.mass, a.price))
    if build.kit is not None and build.pieces is not None:
        rows += kit_rows(build.pieces, build.kit, build.options.catalogue)
    lengths = [float(row[2]) for row in cuts(build)]
    body = build.result.body.options
    tube = f"tube {body.tube_diameter * 1e3:g} x {body.tube_wall * 1e3:g} mm" if build.tube is None else build.tube.name
    if lengths and build.kit is None:
        area = np.pi * body.tube_wall * (body.tube_diameter - body.tube_wall)
        price = None if build.tube is None else build.tube.price
        source = build.options.stock or "assumed"
        rows.append((tube, round(sum(lengths) / 1e3, 4), "m", source, float(area * body.tube_density), price))
    if build.assembly is not None:
        for name, (part, places) in build.assembly.counted().items():
            if not part.bought and part.kind != "tube":
                rows.append((f"{name}, {part.material}", len(places), "piece", "to be made", part.mass, None))
        screws: Counter[tuple[str, int, str]] = Counter()
        for each in build.assembly.screws:
            screws[each.thread, screw_length(each), shortened(each)] += each.count
        for (thread, length, cut), count in sorted(screws.items()):
            rows.append((f"screw {thread} x {length}{cut}", count, "piece", "ISO 4762", 0.0, None))
        nuts = Counter({each.thread: 0 for each in build.assembly.screws if each.nut})
        for each in build.assembly.screws:
            nuts[each.thread] += each.count * each.nut
        for thread, count in sorted((+nuts).items()):
            rows.append((f"locking nut {thread}", count, "piece", "ISO 10511", 0.0, None))
    mass = sum(quantity * each for _, quantity, _, _, each, _ in rows)
    known = [quantity * price for _, quantity, _, _, _, price in rows if price is not None]
    text: list[tuple[object, ...]] = [
        (part, quantity, unit, source, f"{each:.4g}", "" if price is None else f"{price:.2f}",
         f"{quantity * each:.4g}", "" if price is None else f"{quantity * price:.2f}")
        for part, quantity, unit, source, each, price in rows
    ]  # fmt: skip
    text.append(("sum", "", "", "", "", "", f"{mass:.4g}", f"{sum(known):.2f}" if known else ""))
    money = f" [{build.currency}]" if build.currency else ""
    heads = ("part", "quantity", "unit", "source", "mass of one [kg]", f"price of one{money}", "mass [kg]",
             f"price{money}")  # fmt: skip
    return csv_table(heads, text)


def screw_length(screws: Screws) -> int:
    """The shortest standard length that is long enough, under the head [mm]."""
    return next(length for length in LENGTHS if length >= 1e3 * screws.length - 1e-6)


def shortened(screws: Screws) -> str:
    """What a screw has to be cut to, in words, where its standard length is too long; empty where not."""
    if screw_length(screws) <= 1e3 * screws.most + 1e-6:
        return ""
    return f", shortened to {np.floor(1e3 * screws.most):.0f} mm"


def kit_rows(arm: KitArm, kit: Kit, family: str) -> list[tuple[str, float, str, str, float, float | None]]:
    """Rows of the bill for a kit's links and brackets, in order from the base on, and for what is made in their place.

    Args:
        arm: The pieces.
        kit: The kit.
        family: Whose they are.
    """
    rows: list[tuple[str, float, str, str, float, float | None]] = []
    for k, each in enumerate(arm.placed, start=1):
        place, turned = f"joint {k} to {k + 1}", f"{np.degrees(each.alpha):.2f} deg"
        if each.piece is None:
            rows.append((f"part {place}, {turned}", 1, "piece", "to be made", each.mass(kit), None))
        elif each.piece.extends:
            inline = {"a": "", "u": ", inline input", "w": ", inline output"}[each.piece.extends]
            name = f"link {each.piece.type}{inline}, extension {each.extension * 1e3:.1f} mm, {turned}, {place}"
            rows.append((name, 1, "piece", family, each.mass(kit), None))
        else:
            side = "Right" if each.alpha > 0.0 else "Left"
            name = f"bracket {each.piece.type}{side}{each.piece.variant}, {place}"
            rows.append((name, 1, "piece", family, each.mass(kit), None))
        if abs(each.spacer) > EXACT:
            rows.append((f"spacer {each.spacer * 1e3:.1f} mm, {place}", 1, "piece", "to be made", 0.0, None))
    return rows


def cut_list(build: Build) -> str:
    """Every tube by its mark, with its length, its clocking and the angles of the brackets at its ends."""
    heads = ("mark", "tube", "length [mm]", "outer diameter [mm]", "pin holes from the ends [mm]",
             "outer pin hole turned [deg]", "inner end to", "its angle [deg]", "outer end to",
             "its angle [deg]")  # fmt: skip
    return csv_table(heads, cuts(build))


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
        turn = np.degrees(sizes["turn of second hole"])
        rows.append(
            (each.mark, each.part.name, f"{1e3 * sizes['length']:.2f}", f"{1e3 * sizes['diameter']:g}",
             f"{1e3 * sizes['hole from end']:.2f}", f"{turn:.2f}", *ends)
        )  # fmt: skip
    return rows
