"""What has to be bought and cut: the bill of materials and the cut list, as CSV."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np

from armdesign.building.build import Build
from armdesign.files import csv_table

BILL = "parts.csv"
CUTS = "cuts.csv"


def part_lists(build: Build) -> dict[str, str]:
    """The lists of a build by the names of their files."""
    return {BILL: bill_of_materials(build), CUTS: cut_list(build)}


def bill_of_materials(build: Build) -> str:
    """Part, quantity, source, mass and price of each, and their sums; prices that are not known are left empty.

    Actuators are counted by the piece, tubes by the metre without what the saw takes; the base plate and what joins the
    parts are one piece each, to be made.
    """
    rows: list[tuple[str, float, str, str, float, float | None]] = []
    actuators = {a.name: a for a in build.choice.actuators}
    for name, count in Counter(a.name for a in build.choice.actuators).items():
        a = actuators[name]
        rows.append((name, count, "piece", a.sheet or a.family, a.mass, a.price))
    arm = build.result.body
    solids = [part.solid for part in arm.parts if part.solid.material == "tube"]
    metres = sum(solid.length for solid in solids)
    per_metre = sum(solid.mass for solid in solids) / metres if metres else 0.0
    body = arm.options
    name = f"tube {body.tube_diameter * 1e3:g} x {body.tube_wall * 1e3:g} mm"
    if build.tube is not None:
        name = build.tube.name
    if metres:
        price = None if build.tube is None else build.tube.price
        rows.append((name, round(metres, 4), "m", build.options.stock or "assumed", per_metre, price))
    twists = [round(float(np.degrees(x)), 3) for x in build.result.table.alpha]
    for angle, count in Counter(twists).items():
        rows.append((f"bracket of {angle:g} deg between two axes", count, "piece", "to be made", 0.0, None))
    if any(part.name == "base plate" for part in arm.parts):
        rows.append(("base plate", 1, "piece", "to be made", body.base_mass, None))
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


def cut_list(build: Build) -> str:
    """Every tube with its length, and the angle to the next tube of the same link."""
    arm = build.result.body
    solids = [part for part in arm.parts if part.solid.material == "tube"]
    corners = [""] * len(solids)
    for k, (first, second) in enumerate(pairwise(solids)):
        if first.link == second.link:
            cosine = abs(float(first.solid.pose[:3, 2] @ second.solid.pose[:3, 2]))
            corners[k] = f"{np.degrees(np.arccos(min(cosine, 1.0))):.2f}"
    rows = []
    for part, corner in zip(solids, corners, strict=True):
        size = f"{2e3 * part.solid.radius:g}"
        rows.append((part.name, f"{part.solid.length * 1e3:.1f}", size, corner))
    return csv_table(("tube", "length [mm]", "outer diameter [mm]", "angle to the next [deg]"), rows)
