"""Motors for an arm: families in plain words, the room they need in a search, and the arm built of them."""

from __future__ import annotations

from dataclasses import replace

from armdesign.building.build import Build, BuildOptions, build
from armdesign.building.catalogue import find_catalogue, shipped
from armdesign.building.shop import envelope, shop_of
from armdesign.errors import CatalogueError
from armdesign.search.result import Result
from armdesign.settings.sections import Body

MARGIN, GRAVITY = 1.2, 9.81
TUBES = {"tube_diameter": 0.025, "tube_wall": 0.002, "tube_density": 2700.0}
"""Thin enough that flanges and brackets have room between motors [m, kg/m^3]."""


def span(values: list[float], unit: str) -> str:
    """The least and the most of some figures, in words."""
    low, high = min(values), max(values)
    return f"{low:.2g} {unit}" if low == high else f"{low:.2g} to {high:.3g} {unit}"


def families() -> tuple[str, ...]:
    """The families of motors with their makers and what they can do, that with the strongest first."""
    named = []
    for name in shipped():
        found = find_catalogue(name)
        strongest = max(a.peak_torque for a in found.actuators)
        volts = span([a.voltage for a in found.actuators if a.voltage is not None], "V")
        named.append((strongest, f"{name}: {found.maker}, up to {strongest:.3g} N m, {volts}"))
    return tuple(words for _, words in sorted(named, reverse=True))


def room_for(words: str, reach: float, payload: float) -> dict[str, float]:
    """Entries of the section Body by which a search leaves room for a family's motors and their brackets [m].

    The shoulder's motor has to hold load, tubes and further motors on part of the arm's reach; the room is that of the
    widest and the longest of those no heavier, since any of them may be chosen further out.

    Args:
        words: The family, as ``families`` has it.
        reach: Of the arm [m].
        payload: What it carries [kg].
    """
    catalogue = find_catalogue(family_of(words))
    sizes = sorted(catalogue.actuators, key=lambda a: a.mass)
    able = [a for a in sizes if a.rated_torque >= MARGIN * GRAVITY * reach / 3.0 * (payload + 0.4 + 1.5 * a.mass)]
    most = able[0].mass if able else sizes[-1].mass
    body = Body(**TUBES)  # type: ignore[arg-type]
    shop = shop_of(body, None, printed=True)
    taken = [envelope(a, shop) if catalogue.kit is None else (a.diameter, a.length) for a in sizes if a.mass <= most]
    across, along = (round(max(each), 3) for each in zip(*taken, strict=True))
    tubes = TUBES if catalogue.kit is None else catalogue.kit.body
    return {"joint_diameter": across, "joint_length": along, "module_slide": 0.0, **tubes}


def family_of(words: str) -> str:
    """The name of a family out of what the page calls it."""
    return words.partition(":")[0]


def best_build(result: Result, options: BuildOptions) -> Build:
    """An arm built with brackets printed at its own angles, or with those of 0 and 90 degrees where only that fits.

    Args:
        result: The arm.
        options: What it is built of.

    Raises:
        CatalogueError: Neither can be.
    """
    found: list[Build] = []
    for printed in (True, False):
        try:
            made = build(result, replace(options, printed=printed))
        except CatalogueError:
            if not printed and not found:
                raise
            continue
        if not made.fault:
            return made
        found.append(made)
    return min(found, key=lambda made: (-made.fits, made.result.verdict.hand_error.max))
