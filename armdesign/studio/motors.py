"""Motors for an arm: families in plain words, and the arm built of them."""

from __future__ import annotations

from dataclasses import replace

from armdesign.building.build import Build, BuildOptions, build
from armdesign.building.catalogue import find_catalogue, shipped
from armdesign.errors import CatalogueError
from armdesign.search.result import Result


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
