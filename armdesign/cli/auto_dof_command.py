"""``armdesign search --dof auto``: how many joints a task needs, with the arm that has them."""

from __future__ import annotations

import math
from contextlib import closing
from pathlib import Path

import typer

from armdesign import views
from armdesign.cli.command_errors import INTERRUPTED
from armdesign.cli.input_recordings import Demonstrations
from armdesign.cli.screen import SearchBar, clock, compile_for, say, say_in_handler, show_table, show_text
from armdesign.cli.tables import show_arm
from armdesign.cli.worker_options import RunOptions, check_workers, open_backend
from armdesign.errors import SettingsError, counted, resume_command
from armdesign.experiments.auto_dof.choose_dof import (
    Callbacks,
    DofChoice,
    carry_out_auto,
    claim_auto_folder,
    problems_by_joints,
    start_auto,
)
from armdesign.experiments.auto_dof.dof_records import AUTO, PICTURE, TABLE, has_choice, holds_auto
from armdesign.experiments.auto_dof.dof_rule import DofResult, rule_of
from armdesign.feasibility.words import tolerance_words
from armdesign.runs.folder import RESULT_FILES, TASK_FILES, holds_run
from armdesign.runs.reading import read_result
from armdesign.search.design_problem import DesignProblem
from armdesign.search.result import Result
from armdesign.search.search import Progress

TOLERANCE_MISSED = 3


def search_auto(
    opened: Demonstrations,
    out: Path | None,
    how: RunOptions,
    *,
    overwrite: bool,
    within: float | None,
    enough: float | None,
) -> None:
    """Search 2, 3, ... joints until more do not pay.

    Args:
        opened: The demonstrations; the folder is named after them.
        out: The folder to write; by default runs/NAME-ALGORITHM-auto-seedS.
        how: How the searches are carried out and shown.
        overwrite: Whether what the folder holds is given up.
        within: How much a path fitness may be larger and still count as equal [%].
        enough: Path fitness below which a better one means nothing [mm].
    """
    rule = rule_of(within, enough)
    problems = problems_by_joints(opened.problem)
    first = next(iter(problems.values()))
    stated = tolerance_words(first.settings.needs)
    for flag, value in (("--within", within), ("--enough", enough)):
        if stated and value is not None:
            raise SettingsError(
                f"{flag} is given, but a tolerance of {stated} is stated, which decides alone", value=value,
                fix="Leave one of the two out",
            )  # fmt: skip
    if out is None:
        search = first.settings.search
        name = f"{opened.source.stem}-{search.algorithm}-auto-seed{search.seed}"
        out, k = Path("runs") / name, 2
        while holds_run(out) or holds_auto(out):
            out, k = Path("runs") / f"{name}-{k}", k + 1
    folder = claim_auto_folder(out, overwrite=overwrite)
    start_auto(folder, problems, rule)
    carry_on(folder, how)


def resume_auto(folder: Path, how: RunOptions) -> None:
    """Go on with the search for the number of joints where it stopped."""
    if has_choice(folder):
        say(f"{folder} is finished; nothing to resume.")
    else:
        carry_on(folder, how)


def carry_on(folder: Path, how: RunOptions) -> None:
    """Search in the folder, saying what is done and why it ends."""
    check_workers(how.workers, how.cluster)
    go_on = f"Go on with: {resume_command('search', folder, how.cluster)}"
    try:
        with closing(Screen(how.quiet)) as screen:
            callbacks = Callbacks(screen.begin, screen.progress, screen.end, on_interrupt, say)
            choice = carry_out_auto(folder, lambda problem: open_backend(problem, how.workers, how.cluster), callbacks)
    except KeyboardInterrupt:
        typer.echo(f"\n{go_on}", err=True)
        raise
    if choice.interrupted:
        typer.echo(f"Interrupted. {go_on}", err=True)
        raise typer.Exit(INTERRUPTED)
    result = read_result(folder)
    more = views.writing.write_views(folder, result) if how.report else ()
    if not how.quiet:
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

    def close(self) -> None:
        """End a bar that was begun."""
        self.bar.__exit__()

    def begin(self, n: int, problem: DesignProblem) -> None:
        """A search begins, or goes on."""
        self.close()
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
        compile_for(problem, quiet=self.quiet)

    def progress(self, progress: Progress) -> None:
        """An iteration is done."""
        if not self.quiet:
            self.bar(progress)

    def end(self, result: DofResult) -> None:
        """A search has ended."""
        self.close()
        if not self.quiet and not result.valid:
            say(f"No arm of {counted(result.dof, 'joint')}: {result.reason}")


def show_choice(choice: DofChoice, result: Result, more: tuple[str, ...]) -> None:
    """Print what every number of joints gives, why one was chosen, and its arm."""
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
