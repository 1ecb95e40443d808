"""Who carries out the units of a sweep. Anything that takes run folders and reports how they ended can be a crew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from armdesign.experiments.sweep.units import Outcome
from armdesign.search.search import Progress


@dataclass(frozen=True)
class News:
    """What a crew has to say about a unit: how far its search is, or how the work on it has ended.

    Attributes:
        name: Name of its run folder.
        progress: Where the search stands.
        outcome: How it ended; None while it goes on.
    """

    name: str
    progress: Progress | None = None
    outcome: Outcome | None = None


class Crew(Protocol):
    """Carries out units, several at a time, in any order.

    A crew whose members do not share this disk takes the folder's files with it (`units.contents`), has them carried
    out by `units.carry_out_elsewhere`, and puts the files that come back into the outcome; the sweep writes them.
    """

    def room(self) -> int:
        """How many further units it would begin now."""
        ...

    def take(self, place: Path) -> None:
        """Begin with the unit in a run folder."""
        ...

    def wait(self, timeout: float) -> Sequence[News]:
        """News of the units at hand, as soon as there is some; empty after the timeout [s]."""
        ...

    def interrupt(self) -> None:
        """Have the units at hand stop after their iteration; every one of them still reports its outcome."""
        ...

    def close(self) -> None:
        """Let go of processes and connections; units still at hand are dropped where they stand."""
        ...
