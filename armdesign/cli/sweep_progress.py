"""Progress of a sweep on stderr."""

from __future__ import annotations

from armdesign.cli.screen import StatusBar, clock, say
from armdesign.experiments.sweep import SweepStatus
from armdesign.search.search import Progress


class SweepBar(StatusBar):
    """A line for every run that has ended; in a terminal a bar below them, with the runs that are computed."""

    def __call__(self, status: SweepStatus) -> None:
        """Show what is new, if it is time to."""
        if status.ended is not None:
            say(ended_text(status))
        if self.terminal:
            done = status.finished + status.failed
            self.draw(done, status.total, status_text(status)[: self.console.width - 12])


def ended_text(status: SweepStatus) -> str:
    """Which run has ended and how, and the time left for the others."""
    left = "" if status.left is None or status.left < 1.0 else f"  {clock(status.left)} left"
    best = "" if status.fitness is None else f", r {status.fitness:.4f}"
    outcome = status.outcome
    how = "" if outcome is None else outcome.state + best + (f": {outcome.reason}" if outcome.reason else "")
    return f"{counts_text(status)}{left}  {status.ended}  {how}"


def status_text(status: SweepStatus) -> str:
    """Runs done, time left, and the runs at hand with their iteration and best."""
    left = "" if status.left is None else f"  {clock(status.left)} left"
    running = " | ".join(f"{name} {search_text(progress)}" for name, progress in status.running.items())
    return f"{counts_text(status)}{left}  {running}"


def counts_text(status: SweepStatus) -> str:
    """Runs done of all."""
    failed = f" ({status.failed} failed)" if status.failed else ""
    return f"{status.finished + status.failed}/{status.total} runs{failed}"


def search_text(progress: Progress | None) -> str:
    """Iteration and best of a search."""
    if progress is None:
        return "begins"
    best = "-" if progress.fitness == float("inf") else f"{progress.fitness:.4f}"
    return f"{progress.iteration}/{progress.iterations} r {best}"
