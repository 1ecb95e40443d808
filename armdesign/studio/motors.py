"""Motors for an arm: families in plain words, and the arm built of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

from armdesign.building.build import Build, build
from armdesign.building.build_options import BuildOptions
from armdesign.building.catalogue import find_catalogue, shipped
from armdesign.errors import CatalogueError, RunFolderError
from armdesign.runs.alternatives import alternatives
from armdesign.search.result import Result

OTHERS = 3
"""Further arms of a search at most that are built where the parts of the best do not fit."""


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


class Choice(NamedTuple):
    """What became of some arms that were to be built.

    Attributes:
        rank: Of the arm that is built, from 1 on.
        build: It.
        why: What is wrong with the arms before it; empty where there is none, or where something is wrong with all.
    """

    rank: int
    build: Build
    why: str


def arms_at_hand(result: Result) -> list[Result]:
    """An arm and, of its search, the best that differ from it and do the task as well, best first."""
    try:
        others = alternatives(result, 1 + OTHERS)[1:]
    except RunFolderError:  # it is not the best of a search
        others = []
    return [result, *(each for each in others if each.verdict.passed)]


def buildable(arms: Sequence[Result], options: BuildOptions, told: Callable[[int, str], None]) -> Choice:
    """The first of some arms whose parts fit, else that which comes nearest to it.

    Brackets are printed at the arm's own angles; those of 0 and 90 degrees are tried where these do not fit.

    Args:
        arms: Best first.
        options: What they are built of.
        told: Called before each try with the arm's rank and how its brackets are made; raises to end it.

    Raises:
        CatalogueError: None can be built of that.
    """
    found: list[Choice] = []
    error: CatalogueError | None = None
    for rank, arm in enumerate(arms, start=1):
        for printed in (True, False):
            told(rank, "printed brackets" if printed else "brackets of 0 and 90 degrees")
            try:
                made = build(arm, replace(options, printed=printed))
            except CatalogueError as fault:
                error = error or fault
                continue
            if not made.fault:
                why = found[0].build.fault if found else str(error or "")
                return Choice(rank, made, why if rank > 1 else "")
            found.append(Choice(rank, made, ""))
    if not found:
        raise error or CatalogueError("there is no arm to build", value=options.catalogue)
    return min(found, key=lambda each: (-each.build.fits, each.rank, each.build.result.verdict.hand_error.max))
