"""``armdesign study``: the paper's tables, done over on any demonstration."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from armdesign.cli import PanelCommand
from armdesign.cli.command_errors import one_sentence_errors, refuse_beside_resume
from armdesign.cli.command_options import ConfigOption, QuietOption
from armdesign.cli.setting_flags import Given, takes_settings
from armdesign.cli.study_flags import (
    DofOption,
    Flags,
    QuickOption,
    RepsOption,
    SearchesOption,
    SeedOption,
    StudyOutOption,
    StudyResumeOption,
    TasksArgument,
    request_from_flags,
    words,
)
from armdesign.cli.sweep_command import SHOWN_FAILURES, leave, say_stopping, unit_workers
from armdesign.cli.sweep_progress import SweepBar
from armdesign.cli.worker_options import ClusterOption, check_workers
from armdesign.errors import resume_command
from armdesign.experiments.studies import StudyRequest, StudyResult
from armdesign.experiments.studies.study_engine import planned, run_study
from armdesign.experiments.studies.study_registry import warm_up
from armdesign.experiments.studies.study_store import read_study_folder
from armdesign.experiments.sweep.ranges import whole_numbers
from armdesign.experiments.sweep.sweep_plan import Tasks
from armdesign.search.backends.processes import available_cores
from armdesign.settings.sections import Fitness, Search

app = typer.Typer(
    name="study",
    help="""Repeat the paper's studies on any demonstration.

    Each is a resumable sweep with tables, CSV, Markdown and a figure.
    """,
    no_args_is_help=True,
    rich_markup_mode=None,
)


@app.command(cls=PanelCommand)
@one_sentence_errors
@takes_settings(Fitness, Search, only=("scenario",))
def temporal(
    context: typer.Context,
    tasks: TasksArgument = None,
    quick: QuickOption = False,
    reps: Annotated[int | None, typer.Option("--reps", help="Random valid designs per n (default 10).")] = None,
    seed: SeedOption = None,
    dof: DofOption = None,
    budget: Annotated[
        int | None, typer.Option("--budget", help="Evaluations of every metaheuristic per frame (default 20000).")
    ] = None,
    algorithm: Annotated[
        str | None, typer.Option("--algorithm", help="Solvers: ga,pso,woa,es,abc,sa,slsqp,dls-16 ...; default: all.")
    ] = None,
    config: ConfigOption = None,
    *,
    given: Given,
    workers: SearchesOption = None,
    cluster: ClusterOption = None,
    out: StudyOutOption = None,
    resume: StudyResumeOption = None,
    quiet: QuietOption = False,
) -> None:
    """Compare solvers of a single frame.

    Mean temporal fitness G, time, and how often the best known is found.
    """
    options = {"algorithms": words(algorithm, "--algorithm"), "budget": budget}
    flags = Flags(tasks, quick, reps, seed, dof, given, config, options)
    study("temporal", context, flags, workers, cluster, out, resume, quiet=quiet)


@app.command(cls=PanelCommand)
@one_sentence_errors
@takes_settings(Fitness, Search, only=("scenario", "particles", "iterations"))
def robot(
    context: typer.Context,
    tasks: TasksArgument = None,
    quick: QuickOption = False,
    reps: RepsOption = None,
    seed: SeedOption = None,
    dof: DofOption = None,
    algorithm: Annotated[
        str | None, typer.Option("--algorithm", help="Searches: abc,ga,pso-opytimizer,sa,pso,rapso; default: all.")
    ] = None,
    config: ConfigOption = None,
    *,
    given: Given,
    workers: SearchesOption = None,
    cluster: ClusterOption = None,
    out: StudyOutOption = None,
    resume: StudyResumeOption = None,
    quiet: QuietOption = False,
) -> None:
    """Compare the searches of the paper for the whole robot.

    Mean robot fitness r and time at the same number of evaluations.
    """
    flags = Flags(tasks, quick, reps, seed, dof, given, config, {"algorithms": words(algorithm, "--algorithm")})
    study("robot", context, flags, workers, cluster, out, resume, quiet=quiet)


@app.command(cls=PanelCommand)
@one_sentence_errors
@takes_settings(Fitness, Search, only=("scenario", "particles", "iterations"))
def rapso(
    context: typer.Context,
    tasks: TasksArgument = None,
    quick: QuickOption = False,
    reps: RepsOption = None,
    seed: SeedOption = None,
    dof: DofOption = None,
    d: Annotated[str | None, typer.Option("--d", help="Angle intervals D: 2, 2-5 or 2,4 (default 2-5).")] = None,
    range_of: Annotated[
        str | None, typer.Option("--range", help="Readings of the range in eq. 8: valid,box (default: both).")
    ] = None,
    config: ConfigOption = None,
    *,
    given: Given,
    workers: SearchesOption = None,
    cluster: ClusterOption = None,
    out: StudyOutOption = None,
    resume: StudyResumeOption = None,
    quiet: QuietOption = False,
) -> None:
    """Compare RA-PSO with PSO, seed by seed.

    Change of fitness and of computational effort in percent, over D.
    """
    options = {"d": None if d is None else whole_numbers(d, "--d"), "range": words(range_of, "--range")}
    flags = Flags(tasks, quick, reps, seed, dof, given, config, options)
    study("rapso", context, flags, workers, cluster, out, resume, quiet=quiet)


@app.command(cls=PanelCommand)
@one_sentence_errors
@takes_settings(Fitness, Search, only=("scenario", "particles", "iterations"))
def designs(
    context: typer.Context,
    tasks: TasksArgument = None,
    quick: QuickOption = False,
    reps: RepsOption = None,
    seed: SeedOption = None,
    dof: DofOption = None,
    algorithm: Annotated[str | None, typer.Option("--algorithm", help="rapso (default), pso or multibasin.")] = None,
    within: Annotated[
        float | None,
        typer.Option(
            "--within",
            help="The smallest n whose f is within so many percent of more joints' best is chosen (default 4).",
        ),
    ] = None,
    enough: Annotated[
        float | None,
        typer.Option("--enough", help="Path fitness below which a further gain does not count [mm] (default 5)."),
    ] = None,
    config: ConfigOption = None,
    *,
    given: Given,
    workers: SearchesOption = None,
    cluster: ClusterOption = None,
    out: StudyOutOption = None,
    resume: StudyResumeOption = None,
    quiet: QuietOption = False,
) -> None:
    """Find the number of joints and the final design.

    r, f and E over n, and the DH table of the chosen arm.
    """
    options = {"algorithm": algorithm, "within": within, "enough": enough}
    flags = Flags(tasks, quick, reps, seed, dof, given, config, options)
    study("designs", context, flags, workers, cluster, out, resume, quiet=quiet)


@app.command("search", cls=PanelCommand)
@one_sentence_errors
@takes_settings(Fitness, Search, only=("scenario", "particles"))
def searches(
    context: typer.Context,
    tasks: TasksArgument = None,
    quick: QuickOption = False,
    reps: RepsOption = None,
    seed: SeedOption = None,
    dof: DofOption = None,
    budget: Annotated[int | None, typer.Option("--budget", help="Candidates of every search.")] = None,
    algorithm: Annotated[str | None, typer.Option("--algorithm", help="Search algorithms; default: all.")] = None,
    config: ConfigOption = None,
    *,
    given: Given,
    workers: SearchesOption = None,
    cluster: ClusterOption = None,
    out: StudyOutOption = None,
    resume: StudyResumeOption = None,
    quiet: QuietOption = False,
) -> None:
    """Compare this package's own searches.

    Best r and time at the same number of candidates.
    """
    options = {"algorithms": words(algorithm, "--algorithm"), "budget": budget}
    flags = Flags(tasks, quick, reps, seed, dof, given, config, options)
    study("search", context, flags, workers, cluster, out, resume, quiet=quiet)


def study(
    name: str,
    context: typer.Context,
    flags: Flags,
    workers: int | None,
    cluster: str | None,
    out: Path | None,
    resume: Path | None,
    *,
    quiet: bool,
) -> None:
    """Begin, extend or go on with a study.

    Exit code: 0 all runs are finished; 1 a run has failed, runs.csv says why (it is tried again the next time);
    2 bad input; 130 stopped by Ctrl-C.
    """
    check_workers(workers, cluster)
    if resume is not None:
        refuse_beside_resume(context, "a study", "To extend it, repeat its command with more, and --out for --resume")
        folder, (request, tasks) = resume, read_study_folder(resume, name)
    else:
        request, tasks = request_from_flags(name, flags)
        folder = out or Path("runs") / f"study-{name}{'-quick' if flags.quick else ''}"
    planned(request, tasks)
    carry_out(folder, request, tasks, workers or available_cores(), cluster, quiet=quiet)


def carry_out(
    folder: Path, request: StudyRequest, tasks: Tasks, workers: int, cluster: str | None, *, quiet: bool
) -> None:
    """Carry out a study, saying how it goes and what came of it."""

    def compile_more() -> None:
        warm_up(request.study, tasks)

    go_on = f"Go on with: {resume_command(f'study {request.study}', folder, cluster)}"
    try:
        with SweepBar() as bar, unit_workers(workers, cluster, tasks, quiet=quiet, warm_up=compile_more) as start:
            on_change = None if quiet else bar
            result = run_study(folder, request, tasks, start, on_change=on_change, on_interrupt=say_stopping)
    except KeyboardInterrupt:
        typer.echo(f"\n{go_on}", err=True)
        raise
    if not quiet:
        typer.echo(closing_text(folder, result))
    leave(result.runs, go_on)


def closing_text(folder: Path, result: StudyResult) -> str:
    """The tables, the runs that failed, and where everything lies."""
    rows = result.runs.rows.values()
    failed = [row for row in rows if row["state"] == "failed"]
    lines = [f"{table.text()}\n" for table in result.tables]
    lines.append(f"{result.runs.count('finished')} of {len(rows)} runs finished.")
    lines += [f"  {row['folder']} failed: {row['stopped_by']}" for row in failed[:SHOWN_FAILURES]]
    if len(failed) > SHOWN_FAILURES:
        lines.append(f"  and {len(failed) - SHOWN_FAILURES} more")
    return "\n".join([*lines, "Written:", *(f"  {folder / name}" for name in result.files)])
