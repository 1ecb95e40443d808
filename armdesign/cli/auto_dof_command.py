"""``armdesign search --dof auto``: how many joints a task needs, with the arm that has them."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import typer

from armdesign.cli.command_errors import INTERRUPTED
from armdesign.cli.screen import SearchBar, announce_compiling, clock, say, say_in_handler, show_table, show_text
from armdesign.cli.tables import show_evaluation
from armdesign.cli.worker_options import check_workers, open_backend
from armdesign.errors import RunFolderError, SettingsError, counted, resume_command
from armdesign.experiments.auto_dof.choose_dof import Outcome, Watch, carry_out_auto, start_auto
from armdesign.experiments.auto_dof.dof_records import AUTO, PICTURE, TABLE, Found, chosen, holds_auto
from armdesign.experiments.auto_dof.dof_rule import JOINTS, rule_of
from armdesign.fitness.block import compile_kernels
from armdesign.runs.folder import RESULT_FILES, TASK_FILES, claim_folder, holds_run
from armdesign.runs.reading import read_result
from armdesign.search.backends import Backend
from armdesign.search.design_problem import DesignProblem
from armdesign.search.result import Result
from armdesign.search.search import Progress
from armdesign.views import writing as views


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
    tasks = prepared_tasks(prepare_for)
    folder = claimed(folder_for(source, next(iter(tasks.values()))) if out is None else out, overwrite=overwrite)
    start_auto(folder, tasks, rule)
    carry_on(folder, workers, cluster, report=report, quiet=quiet)


def resume_auto(folder: Path, *, workers: int | None, cluster: str | None, report: bool, quiet: bool) -> None:
    """Go on with the search for the number of joints where it stopped."""
    if chosen(folder):
        say(f"{folder} is finished; nothing to resume.")
        return
    carry_on(folder, workers, cluster, report=report, quiet=quiet)


def prepared_tasks(prepare_for: Callable[[int], DesignProblem]) -> dict[int, DesignProblem]:
    """The task for every number of joints to choose from.

    Raises:
        SettingsError: Settings that fit one number of joints only.
    """
    fewest, most = prepare_for(JOINTS[1]).settings.design.auto_dof or JOINTS
    tasks = {}
    for n in range(fewest, most + 1):
        tasks[n] = prepare_for(n)
        try:
            tasks[n].space, tasks[n].path_problem
        except SettingsError as error:
            fix = "Settings that name single joints go with a --dof of that number, or with a narrower design.auto_dof"
            raise SettingsError(
                f"--dof auto, with {counted(n, 'joint')}: {error}", value=error.value, fix=fix
            ) from error
    return tasks


def folder_for(source: Path, problem: DesignProblem) -> Path:
    """A free name under runs/."""
    search = problem.settings.search
    name = f"{source.stem}-{search.algorithm}-auto-seed{search.seed}"
    folder, k = Path("runs") / name, 2
    while holds_run(folder) or holds_auto(folder):
        folder, k = Path("runs") / f"{name}-{k}", k + 1
    return folder


def claimed(folder: Path, *, overwrite: bool) -> Path:
    """Make the folder before the work begins.

    Raises:
        RunFolderError: It holds something already, or cannot be written.
    """
    if holds_auto(folder) and not overwrite:
        unfinished = "" if chosen(folder) else f", go on with it by --resume {folder}"
        raise RunFolderError(
            f"{folder} already holds a search for the number of joints", value=str(folder),
            fix=f"Name another with --out{unfinished}, or add --overwrite",
        )  # fmt: skip
    return claim_folder(folder, overwrite=overwrite)


def carry_on(folder: Path, workers: int | None, cluster: str | None, *, report: bool, quiet: bool) -> None:
    """Search in the folder, saying what is done and why it ends."""
    check_workers(workers, cluster)

    def start_workers(problem: DesignProblem) -> AbstractContextManager[Backend]:
        return open_backend(problem, workers, cluster)

    go_on = f"Go on with: {resume_command('search', folder, cluster)}"
    try:
        with Screen(quiet) as screen:
            watch = Watch(screen.begin, screen.progress, screen.end, on_interrupt, say)
            outcome = carry_out_auto(folder, start_workers, watch)
    except KeyboardInterrupt:
        typer.echo(f"\n{go_on}", err=True)
        raise
    if outcome.interrupted:
        typer.echo(f"Interrupted. {go_on}", err=True)
        raise typer.Exit(INTERRUPTED)
    result = read_result(folder)
    more = views.write_views(folder, result) if report else ()
    if not quiet:
        show_outcome(outcome, result, more)


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
        with announce_compiling(self.quiet):
            compile_kernels(problem.path_problem, slopes=problem.settings.search.algorithm == "multibasin")

    def progress(self, progress: Progress) -> None:
        """An iteration is done."""
        if not self.quiet:
            self.bar(progress)

    def end(self, found: Found) -> None:
        """A search has ended."""
        self.bar.__exit__()
        if not self.quiet and not found.valid:
            say(f"No arm of {counted(found.dof, 'joint')}: {found.reason}")


def show_outcome(outcome: Outcome, result: Result, more: tuple[str, ...]) -> None:
    """Print what every number of joints gives, why one was chosen, and its arm.

    Args:
        outcome: How the searches ended.
        result: The chosen arm.
        more: Further files that were written.
    """
    names = [name for name in (*TASK_FILES, *RESULT_FILES) if name not in more]
    files = [name for name in names if (outcome.folder / name).exists()]
    rows = []
    for found in outcome.found:
        mark = "*" if outcome.verdict is not None and found.dof == outcome.verdict.dof else ""
        lengths = (found.path_fitness * 1e3, found.area * 1e3, found.fitness, found.hand_error * 1e3, found.length)
        figures = [f"{value:.{2 if k in (0, 1, 3) else 4}f}" for k, value in enumerate(lengths)]
        shown = [*figures, clock(found.wall_time)] if found.valid else ["no valid arm", *["-"] * 5]
        rows.append((mark, str(found.dof), *shown))
    show_table(("", "joints", "f [mm]", "E [mm]", "r [m]", "hand [mm]", "L [m]", "time"), rows)
    show_text(outcome.explanation)
    show_evaluation(result.evaluation, result.problem)
    typer.echo(f"Written in {outcome.folder}, every search in a folder nN of its own:")
    typer.echo("\n".join(f"  {name}" for name in (AUTO, TABLE, PICTURE, *files, *more)))
