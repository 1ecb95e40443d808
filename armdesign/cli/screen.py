"""What the commands show: sentences and tables that fit the terminal, or 80 columns, and progress on stderr."""

from __future__ import annotations

import os
import sys
import textwrap
import time
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TypeVar

import typer
from rich.console import Console
from rich.progress import BarColumn, TaskID, TextColumn
from rich.progress import Progress as RichProgress
from rich.table import Table

from armdesign.experiments.sweep.run_sweep import SweepStatus
from armdesign.feasibility.penalty import KERNELS
from armdesign.fitness.block import compilation_progress, compile_kernels
from armdesign.search.design_problem import DesignProblem
from armdesign.search.search import Progress
from armdesign.swarm import ALGORITHMS

WIDTH = 80
"""Columns of what is written to a file or a pipe."""
EVERY = 0.1
"""Shortest time between two changes of a bar [s]."""
PATIENCE = 1.5
"""Time that compiling may take unseen [s]."""
Bar = TypeVar("Bar", bound="StatusBar")


def console(*, stderr: bool = False) -> Console:
    """Where to print: as wide as the terminal, 80 columns and no colours where it is none."""
    made = Console(stderr=stderr, highlight=False, markup=False, emoji=False)
    if not made.is_terminal:
        made.width = WIDTH
    return made


def say(sentence: str) -> None:
    """Write a sentence to stderr, wrapped at words; a path is never cut, so that it can be copied."""
    typer.echo(wrapped(sentence, console(stderr=True).width), err=True)


def show_text(sentence: str) -> None:
    """Write a sentence to stdout, wrapped at words like one on stderr."""
    typer.echo(wrapped(sentence, console().width))


def wrapped(text: str, width: int = WIDTH) -> str:
    """Lines of a text that fit a width, each continued with an indent; words are not cut."""
    lines = []
    for line in text.splitlines():
        indent = " " * (len(line) - len(line.lstrip()) + 2)
        parts = textwrap.wrap(line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
        lines += parts or [""]
    return "\n".join(lines)


def say_in_handler(sentence: str) -> None:
    """A sentence on stderr from within a signal handler, where the stream's own buffer may be in use."""
    try:
        os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, f"\n{sentence}\n".encode())
    except OSError:
        return  # nobody reads it; the search stops all the same


def show_table(headings: Sequence[str], rows: Sequence[Sequence[str]], *, left: Collection[int] = (0,)) -> None:
    """Print a table; its first column is folded where the terminal is too narrow, and never in a file.

    Args:
        headings: One for every column.
        rows: Cells, one for every column.
        left: Columns of words, aligned to the left; the others hold numbers.
    """
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="bold")
    for k, heading in enumerate(headings):
        table.add_column(heading, justify="left" if k in left else "right", no_wrap=k > 0, overflow="fold")
    for row in rows:
        table.add_row(*row)
    out = console()
    if not out.is_terminal:
        out.width = max(WIDTH, out.measure(table, options=out.options.update(max_width=10_000)).maximum)
    with out.capture() as capture:
        out.print(table)
    typer.echo("\n".join(line.rstrip() for line in capture.get().splitlines()))


def clock(seconds: float) -> str:
    """A duration as m:ss or h:mm:ss."""
    total = round(seconds)
    hours, minutes = divmod(total // 60, 60)
    return f"{hours}:{minutes:02d}:{total % 60:02d}" if hours else f"{minutes}:{total % 60:02d}"


class StatusBar:
    """A progress bar on stderr that is redrawn in a terminal; elsewhere the lines that its user writes.

    Attributes:
        console: Standard error.
        terminal: Whether that is a terminal.
    """

    def __init__(self) -> None:
        """Show nothing yet."""
        self.console = console(stderr=True)
        self.terminal = self.console.is_terminal
        self.drawn: tuple[RichProgress, TaskID] | None = None
        self.last = 0.0

    def __enter__(self: Bar) -> Bar:
        """Nothing to do."""
        return self

    def __exit__(self, *error: object) -> None:
        """End a bar that was begun, so that what comes next, such as an error, has its own line."""
        if self.drawn is not None:
            self.drawn[0].refresh()
            self.drawn[0].stop()
            self.drawn = None

    def draw(self, done: int, total: int, text: str) -> None:
        """Redraw the bar, if it is time to."""
        if self.drawn is None:
            columns = (BarColumn(bar_width=10), TextColumn("{task.description}", markup=False))
            # drawn by hand: a thread that draws could hold a lock while worker processes are forked
            progress = RichProgress(*columns, console=self.console, auto_refresh=False)
            self.drawn = progress, progress.add_task("", total=total)
            progress.start()
        progress, task = self.drawn
        progress.update(task, completed=done, total=total, description=text)
        now = time.monotonic()
        if done >= total or now - self.last > EVERY:
            self.last = now
            progress.refresh()


class SearchBar(StatusBar):
    """Progress of a search: a bar in a terminal, a line per tenth elsewhere."""

    tenth = -1

    def __call__(self, progress: Progress) -> None:
        """Show an iteration if it is time to."""
        done, total = progress.iteration, progress.iterations
        if self.terminal:
            self.draw(done, total, progress_text(progress))
        elif 10 * done // total > self.tenth or done == total:
            self.tenth = 10 * done // total
            say(f"{progress.unit} {progress_text(progress)}")


def progress_text(progress: Progress) -> str:
    """Iterations, best fitness in the paper's terms, valid particles, time left."""
    left = progress.elapsed / progress.iteration * (progress.iterations - progress.iteration)
    if progress.fitness == float("inf"):
        best = "no valid arm yet"
    else:
        best = f"r {progress.fitness:.4f}  f {progress.path_fitness * 1e3:.1f}, E {progress.area * 1e3:.1f} mm"
    digits = len(str(progress.iterations))
    return f"{progress.iteration:{digits}d}/{progress.iterations}  {best}  valid {progress.valid}  {clock(left)} left"


class SweepBar(StatusBar):
    """A line for every run of a sweep that has ended; in a terminal a bar below them, with the runs under way."""

    def __call__(self, status: SweepStatus) -> None:
        """Show what is new, if it is time to."""
        done, failed = status.finished + status.failed, f" ({status.failed} failed)" if status.failed else ""
        counts = f"{done}/{status.total} runs{failed}"
        if status.left is not None and (self.terminal or status.left >= 1.0):
            counts += f"  {clock(status.left)} left"
        if status.ended is not None:
            best = "" if status.fitness is None else f", r {status.fitness:.4f}"
            outcome = status.outcome
            how = "" if outcome is None else outcome.state + best + (f": {outcome.reason}" if outcome.reason else "")
            say(f"{counts}  {status.ended}  {how}")
        if self.terminal:
            running = " | ".join(f"{name} {search_text(progress)}" for name, progress in status.running.items())
            self.draw(done, status.total, f"{counts}  {running}"[: self.console.width - 12])


def search_text(progress: Progress | None) -> str:
    """Iteration and best fitness of a search that is one of several."""
    if progress is None:
        return "begins"
    best = "-" if progress.fitness == float("inf") else f"{progress.fitness:.4f}"
    return f"{progress.iteration}/{progress.iterations} r {best}"


class CompilationBar(StatusBar):
    """Progress of compiling the kernels where that takes a while: a bar in a terminal, one line elsewhere."""

    text = "Compiling the kernels, once on this machine ..."

    def __init__(self) -> None:
        """Begin to wait."""
        super().__init__()
        self.begun, self.said = time.monotonic(), False

    def __call__(self, done: int, total: int) -> None:
        """Show a kernel that is compiled, if it is time to; kernels that come from the disk cache pass unseen."""
        if self.terminal and (self.drawn or done < total) and time.monotonic() - self.begun > PATIENCE:
            self.draw(done, total, self.text)
        elif not self.said and done < total and time.monotonic() - self.begun > PATIENCE:
            self.said = True
            say(self.text)


@contextmanager
def compiling(*, quiet: bool, slopes: bool = False, bodies: bool = False) -> Iterator[None]:
    """Show how far compiling is in a context in which kernels are called for the first time.

    Args:
        quiet: Show nothing.
        slopes: Whether the kernels of the gradients are called, too.
        bodies: Whether those are that keep bodies clear of each other.
    """
    if quiet:
        yield
        return
    with CompilationBar() as bar, compilation_progress(bar, slopes=slopes, also=KERNELS if bodies else ()):
        yield


def compile_for(problem: DesignProblem, *, quiet: bool) -> None:
    """Compile what a search of a problem calls, showing how far that is unless it is to be quiet."""
    slopes, penalty = ALGORITHMS[problem.settings.search.algorithm].takes_slopes, problem.penalty()
    with compiling(quiet=quiet, slopes=slopes, bodies=penalty is not None):
        compile_kernels(problem.path_problem, slopes=slopes)
        if penalty is not None:
            penalty.compile()


def written_text(paths: Sequence[Any]) -> str:
    """The files that were written, one a line."""
    return "\n".join(["Written:", *(f"  {path}" for path in paths)])
