"""``armdesign search --dof auto``: how many joints a task needs, with the arm that has them."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import typer

from armdesign import views
from armdesign.cli.command_errors import INTERRUPTED
from armdesign.cli.screen import SearchBar, clock, compiling, say, say_in_handler, show_table, show_text
from armdesign.cli.tables import show_arm
from armdesign.cli.worker_options import check_workers, open_backend
from armdesign.errors import SettingsError, counted, resume_command
from armdesign.experiments.auto_dof.choose_dof import (
    Callbacks,
    DofChoice,
    carry_out_auto,
    claim_auto_folder,
    problems_by_joints,
    start_auto,
)
from armdesign.experiments.auto_dof.dof_records import AUTO, PICTURE, TABLE, DofResult, has_choice, holds_auto
from armdesign.experiments.auto_dof.dof_rule import rule_of
from armdesign.feasibility.words import tolerance_words
from armdesign.fitness.block import compile_kernels
from armdesign.runs.folder import RESULT_FILES, TASK_FILES, holds_run
from armdesign.runs.reading import read_result
from armdesign.search.backends.backend import Backend
from armdesign.search.design_problem import DesignProblem
from armdesign.search.result import Result
from armdesign.search.search import Progress
from armdesign.swarm import ALGORITHMS

TOLERANCE_MISSED = 3


def search_auto(
    *,
    prepare_for: Callable[[int], DesignProblem],
    source: Path,
    out: Path | None,
    workers: int | None,
    cluster: str | None,
    report: bool,
    overwrite: bool,
    quiet: bool,
    within: float | None = None,
    enough: float | None = None,
) -> None:
    """Search 2, 3, ... joints until more do not pay.

    Args:
        prepare_for: Gives the task prepared for a number of joints.
        source: What the folder is named after.
        out: The folder to write; by default runs/NAME-ALGORITHM-auto-seedS.
        workers: Worker processes; None for as many as pay.
        cluster: Dask scheduler whose workers evaluate.
        report: Whether the chosen arm gets its preview and report.
        overwrite: Whether what the folder holds is given up.
        quiet: Neither progress nor tables.
        within: How much a path fitness may be larger and still count as equal [%].
        enough: Path fitness below which a better one means nothing [mm].
    """
    rule = rule_of(within, enough)
    check_workers(workers, cluster)
    problems = problems_by_joints(prepare_for)
    stated = tolerance_words(next(iter(problems.values())).settings.needs)
    for flag, value in (("--within", within), ("--enough", enough)):
        if stated and value is not None:
            raise SettingsError(
                f"{flag} is given, but a tolerance of {stated} is stated, which decides alone", value=value,
                fix="Leave one of the two out",
            )  # fmt: skip
    place = folder_for(source, next(iter(problems.values()))) if out is None else out
    folder = claim_auto_folder(place, overwrite=overwrite)
    start_auto(folder, problems, rule)
    carry_on(folder, workers, cluster, report=report, quiet=quiet)


def resume_auto(folder: Path, *, workers: int | None, cluster: str | None, report: bool, quiet: bool) -> None:
    """Go on with the search for the number of joints where it stopped."""
    if has_choice(folder):
        say(f"{folder} is finished; nothing to resume.")
        return
    carry_on(folder, workers, cluster, report=report, quiet=quiet)


def folder_for(source: Path, problem: DesignProblem) -> Path:
    """A free name under runs/."""
    search = problem.settings.search
    name = f"{source.stem}-{search.algorithm}-auto-seed{search.seed}"
    folder, k = Path("runs") / name, 2
    while holds_run(folder) or holds_auto(folder):
        folder, k = Path("runs") / f"{name}-{k}", k + 1
    return folder


def carry_on(folder: Path, workers: int | None, cluster: str | None, *, report: bool, quiet: bool) -> None:
    """Search in the folder, saying what is done and why it ends."""
    check_workers(workers, cluster)

    def start_workers(problem: DesignProblem) -> AbstractContextManager[Backend]:
        return open_backend(problem, workers, cluster)

    go_on = f"Go on with: {resume_command('search', folder, cluster)}"
    try:
        with Screen(quiet) as screen:
            callbacks = Callbacks(screen.begin, screen.progress, screen.end, on_interrupt, say)
            choice = carry_out_auto(folder, start_workers, callbacks)
    except KeyboardInterrupt:
        typer.echo(f"\n{go_on}", err=True)
        raise
    if choice.interrupted:
        typer.echo(f"Interrupted. {go_on}", err=True)
        raise typer.Exit(INTERRUPTED)
    result = read_result(folder)
    more = views.writing.write_views(folder, result) if report else ()
    if not quiet:
        show_choice(choice, result, more)
    if choice.verdict is not None and choice.verdict.reason == "missed":
        raise typer.Exit(TOLERANCE_MISSED)


def on_interrupt() -> None:
    """What Ctrl-C is answered with."""
    say_in_handler("Stopping after this iteration; once more stops at once.")


class Screen:
    """What is shown of the searches, one after the other."""

    def __init__(self, quiet: bool) -> None:
        """Nothing shown yet."""
        self.quiet = quiet
        self.noted = False
        self.bar = SearchBar()

    def __enter__(self) -> Screen:
        """Nothing to do."""
        return self

    def __exit__(self, *error: object) -> None:
        """End a bar that was begun."""
        self.bar.__exit__(*error)

    def begin(self, n: int, problem: DesignProblem) -> None:
        """A search begins, or goes on."""
        self.bar.__exit__()
        self.bar = SearchBar()
        search = problem.settings.search
        if not self.quiet:
            if not self.noted:
                for note in problem.notes:
                    say(note)
            from_smaller = (
                f", {len(search.first)} to begin with: the best arm so far with a joint more" if search.first else ""
            )
            say(f"{counted(n, 'joint')} ({search.algorithm}, {search.size}{from_smaller}):")
        self.noted = True
        slopes = ALGORITHMS[search.algorithm].takes_slopes
        penalty = problem.penalty()
        with compiling(quiet=self.quiet, slopes=slopes, bodies=penalty is not None):
            compile_kernels(problem.path_problem, slopes=slopes)
            if penalty is not None:
                penalty.compile()

    def progress(self, progress: Progress) -> None:
        """An iteration is done."""
        if not self.quiet:
            self.bar(progress)

    def end(self, result: DofResult) -> None:
        """A search has ended."""
        self.bar.__exit__()
        if not self.quiet and not result.valid:
            say(f"No arm of {counted(result.dof, 'joint')}: {result.reason}")


def show_choice(choice: DofChoice, result: Result, more: tuple[str, ...]) -> None:
    """Print what every number of joints gives, why one was chosen, and its arm.

    Args:
        choice: How the searches ended.
        result: The chosen arm.
        more: Further files that were written.
    """
    names = [name for name in (*TASK_FILES, *RESULT_FILES) if name not in more]
    files = [name for name in names if (choice.folder / name).exists()]
    rows = []
    unseen = any(math.isfinite(found.held_out) for found in choice.results)
    for found in choice.results:
        mark = "*" if choice.verdict is not None and found.dof == choice.verdict.dof else ""
        lengths = (found.hand_error, found.hand_p95, found.hand_max, found.path_fitness, found.area)
        figures = [f"{1e3 * value:.2f}" for value in lengths]
        figures.insert(3, "yes" if found.feasible else "no")
        shown = [*figures, f"{found.fitness:.4f}", clock(found.wall_time)]
        held_out = [f"{1e3 * found.held_out:.2f}" if math.isfinite(found.held_out) else "-"] * unseen
        rows.append((mark, str(found.dof), *(shown if found.valid else ["no arm", *["-"] * 7]), *held_out))
    last = ["held out f [mm]"] * unseen
    headings = ("", "joints", "hand [mm]", "95 %", "largest", "feasible", "f [mm]", "E [mm]", "r [m]", "time", *last)
    show_text(choice.explanation)
    show_table(headings, rows)
    show_arm(result)
    typer.echo(f"Written in {choice.folder}, every search in a folder nN of its own:")
    typer.echo("\n".join(f"  {name}" for name in (AUTO, TABLE, PICTURE, *files, *more)))
