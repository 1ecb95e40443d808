"""Progress of a sweep on stderr."""

from __future__ import annotations

import shutil
import time
from typing import TYPE_CHECKING

import typer

from armdesign.cli.common import StatusLine, clock

if TYPE_CHECKING:
    from armdesign.experiments.sweep import Standing
    from armdesign.search.search import Progress

EVERY = 1.0
"""Shortest time between two changes of the line [s]."""


class SweepLine(StatusLine):
    """A line for every run that has ended; in a terminal below them one line, rewritten, on the runs at hand."""

    def __init__(self) -> None:
        """Nothing shown yet."""
        super().__init__()
        self.shown = 0.0

    def __call__(self, standing: Standing) -> None:
        """Show what is new, if it is time to."""
        clear = "\r\x1b[2K" if self.terminal else ""
        if standing.ended is not None:
            typer.echo(clear + ended_text(standing), err=True)
            self.open = False
        if self.terminal and standing.running and time.monotonic() - self.shown >= EVERY:
            self.shown = time.monotonic()
            self.rewrite(standing_text(standing)[: shutil.get_terminal_size().columns - 1])


def ended_text(standing: Standing) -> str:
    """Which run has ended and how, and the time left for the others."""
    left = "" if standing.left is None or standing.left < 1.0 else f"  {clock(standing.left)} left"
    best = "" if standing.fitness is None else f", r {standing.fitness:.4f}"
    outcome = standing.outcome
    how = "" if outcome is None else outcome.state + best + (f": {outcome.reason}" if outcome.reason else "")
    return f"{counts_text(standing)}{left}  {standing.ended}  {how}"


def standing_text(standing: Standing) -> str:
    """Runs done, time left, and the runs at hand with their iteration and best."""
    left = "" if standing.left is None else f"  {clock(standing.left)} left"
    at_hand = " | ".join(f"{name} {search_text(progress)}" for name, progress in standing.running.items())
    return f"{counts_text(standing)}{left}  {at_hand}"


def counts_text(standing: Standing) -> str:
    """Runs done of all."""
    failed = f" ({standing.failed} failed)" if standing.failed else ""
    return f"{standing.finished + standing.failed}/{standing.total} runs{failed}"


def search_text(progress: Progress | None) -> str:
    """Iteration and best of a search."""
    if progress is None:
        return "begins"
    best = "-" if progress.fitness == float("inf") else f"{progress.fitness:.4f}"
    return f"{progress.iteration}/{progress.iterations} r {best}"
