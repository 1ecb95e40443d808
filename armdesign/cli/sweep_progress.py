"""Progress of a sweep on stderr."""

from __future__ import annotations

from armdesign.cli.screen import StatusBar, clock, say
from armdesign.experiments.sweep import Standing
from armdesign.search.search import Progress


class SweepBar(StatusBar):
    """A line for every run that has ended; in a terminal a bar below them, with the runs that are computed."""

    def __call__(self, standing: Standing) -> None:
        """Show what is new, if it is time to."""
        if standing.ended is not None:
            say(ended_text(standing))
        if self.terminal:
            done = standing.finished + standing.failed
            self.draw(done, standing.total, standing_text(standing)[: self.console.width - 12])


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
