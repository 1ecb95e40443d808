"""``armdesign study``: the paper's tables, done over on any demonstration."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from armdesign.cli import PanelCommand
from armdesign.cli.command_errors import one_sentence_errors, refuse_beside_resume
from armdesign.cli.command_options import ConfigOption, QuietOption, option
from armdesign.cli.screen import SweepBar
from armdesign.cli.setting_flags import Given, takes_settings
from armdesign.cli.study_request import StudyFlags, request_from_flags, words
from armdesign.cli.sweep_command import leave, lines_of_failures, say_stopping, unit_workers
from armdesign.cli.worker_options import COMPUTING, ClusterOption, check_workers
from armdesign.errors import resume_command
from armdesign.experiments.studies.study_engine import StudyResult, planned, run_study
from armdesign.experiments.studies.study_plan import StudyRequest
from armdesign.experiments.studies.study_registry import warm_up
from armdesign.experiments.studies.study_store import read_study_folder
from armdesign.experiments.sweep.ranges import whole_numbers
from armdesign.experiments.sweep.sweep_plan import Tasks
from armdesign.search.backends.processes import available_cores
from armdesign.settings.sections import Fitness, Search

OwnOptions = Callable[..., dict[str, Any]]
"""A command's function: from the options that only this study has to what they ask for, None where not given."""

app = typer.Typer(
    name="study",
    help="""Repeat the paper's studies on any demonstration.

    Each is a resumable sweep with tables, CSV, Markdown and a figure.
    """,
    no_args_is_help=True,
    rich_markup_mode=None,
)


def study_command(name: str, *settings: str) -> Callable[[OwnOptions], OwnOptions]:
    """Make a function a study's command, with the options that all studies have beside its own."""

    def decorate(own_options: OwnOptions) -> OwnOptions:
        own = inspect.signature(own_options, eval_str=True).parameters
        common = list(inspect.signature(study, eval_str=True).parameters.values())[2:]
        position = [parameter.name for parameter in common].index("config")

        @functools.wraps(own_options)
        def command(**values: Any) -> None:  # noqa: ANN401 (whatever the options hold)
            options = own_options(**{key: values.pop(key) for key in own})
            study(name, options, **values)

        parameters = [*common[:position], *own.values(), *common[position:]]
        only_keywords = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in parameters]
        command.__signature__ = inspect.Signature(only_keywords)  # type: ignore[attr-defined]
        with_flags = takes_settings(Fitness, Search, only=("scenario", *settings))(command)
        app.command(name, cls=PanelCommand)(one_sentence_errors(with_flags))
        return own_options

    return decorate


def study(
    name: str,
    options: Mapping[str, Any],
    context: typer.Context,
    tasks: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="TASK",
            show_default=False,
            help="Recordings, settings files (.toml) that name one, or the examples packaging and welding "
            "(default: both examples).",
        ),
    ] = None,
    *,
    quick: Annotated[bool, option("--quick", None, "A small study, a few minutes on two cores.")] = False,
    reps: Annotated[
        int | None,
        option(
            "--reps",
            "N",
            "Repetitions for every task and n: searches with a seed each; in study temporal, random arms.",
        ),
    ] = None,
    seed: Annotated[int | None, option("--seed", "N", "Seed of the first repetition (default 0).")] = None,
    dof: Annotated[
        str | None, option("--dof", "N", "Numbers of joints n: one (3), a range (3-6) or a list (3,5).")
    ] = None,
    config: ConfigOption = None,
    given: Given,
    workers: Annotated[
        int | None, option("--workers", "N", "Runs at a time, each in its own process; default: all cores.", COMPUTING)
    ] = None,
    cluster: ClusterOption = None,
    out: Annotated[
        Path | None, option("--out", "DIR", "Folder of the study, new or to extend (default runs/study-NAME).")
    ] = None,
    resume: Annotated[
        Path | None, option("--resume", "DIR", "Go on with the study in this folder; needs nothing else.")
    ] = None,
    quiet: QuietOption = False,
) -> None:
    """Begin, extend or go on with a study; ``options`` are what its own flags ask for, None where not given."""
    check_workers(workers, cluster)
    if resume is not None:
        refuse_beside_resume(context, "a study", "To extend it, repeat its command with more, and --out for --resume")
        folder, (request, tasks_read) = resume, read_study_folder(resume, name)
    else:
        flags = StudyFlags(tasks, quick, reps, seed, dof, given, config, options)
        request, tasks_read = request_from_flags(name, flags)
        folder = out or Path("runs") / f"study-{name}{'-quick' if quick else ''}"
    planned(request, tasks_read)
    carry_out(folder, request, tasks_read, workers or available_cores(), cluster, quiet=quiet)


@study_command("temporal")
def temporal(
    budget: Annotated[
        int | None, option("--budget", "N", "Evaluations of every metaheuristic per frame (default 20000).")
    ] = None,
    algorithm: Annotated[
        str | None, option("--algorithm", "NAME,...", "Solvers: ga,pso,woa,es,abc,sa,slsqp,dls-16; default: all.")
    ] = None,
) -> dict[str, Any]:
    """Compare solvers of a single frame.

    Mean temporal fitness G, time, and how often the best known is found.
    """
    return {"algorithms": words(algorithm, "--algorithm"), "budget": budget}


@study_command("robot", "particles", "iterations")
def robot(
    algorithm: Annotated[
        str | None, option("--algorithm", "NAME,...", "Searches: abc,ga,pso-opytimizer,sa,pso,rapso; default: all.")
    ] = None,
) -> dict[str, Any]:
    """Compare the searches of the paper for the whole robot.

    Mean robot fitness r and time at the same number of evaluations.
    """
    return {"algorithms": words(algorithm, "--algorithm")}


@study_command("rapso", "particles", "iterations")
def rapso(
    d: Annotated[
        str | None,
        option("--d", "N", "Numbers D of angle intervals: one (2), a range (2-5) or a list (2,4) (default 2-5)."),
    ] = None,
    range_of: Annotated[
        str | None, option("--range", "valid,box", "Readings of the range in eq. 8 (default: both).")
    ] = None,
) -> dict[str, Any]:
    """Compare RA-PSO with PSO, seed by seed.

    Change of fitness and of computational effort in percent, over D.
    """
    return {"d": None if d is None else whole_numbers(d, "--d"), "range": words(range_of, "--range")}


@study_command("designs", "particles", "iterations")
def designs(
    algorithm: Annotated[str | None, option("--algorithm", "NAME", "rapso (default), pso or multibasin.")] = None,
    within: Annotated[
        float | None,
        option(
            "--within",
            "X",
            "Choose the fewest joints whose path fitness f is within X % of the best of more (default 4).",
        ),
    ] = None,
    enough: Annotated[
        float | None,
        option("--enough", "X", "Path fitness f below which a further gain does not count [mm] (default 5)."),
    ] = None,
) -> dict[str, Any]:
    """Find the number of joints and the final design.

    r, f and E over n, and the DH table of the chosen arm.
    """
    return {"algorithm": algorithm, "within": within, "enough": enough}


@study_command("search", "particles")
def searches(
    budget: Annotated[int | None, option("--budget", "N", "Candidates of every search.")] = None,
    algorithm: Annotated[str | None, option("--algorithm", "NAME,...", "Search algorithms; default: all.")] = None,
) -> dict[str, Any]:
    """Compare this package's own searches.

    Best r and time at the same number of candidates.
    """
    return {"algorithms": words(algorithm, "--algorithm"), "budget": budget}


def carry_out(
    folder: Path, request: StudyRequest, tasks: Tasks, workers: int, cluster: str | None, *, quiet: bool
) -> None:
    """Carry out a study, showing how far it is and what came of it."""
    algorithms = (*request.options.get("algorithms", ()), request.options.get("algorithm", ""))

    def compile_more() -> None:
        warm_up(request.study, tasks)

    go_on = f"Go on with: {resume_command(f'study {request.study}', folder, cluster)}"
    try:
        with (
            SweepBar() as bar,
            unit_workers(workers, cluster, tasks, algorithms, quiet=quiet, warm_up=compile_more) as start,
        ):
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
    lines = [f"{table.text()}\n" for table in result.tables]
    lines.append(f"{result.runs.count('finished')} of {len(result.runs.rows)} runs finished.")
    return "\n".join(
        [*lines, *lines_of_failures(result.runs), "Written:", *(f"  {folder / name}" for name in result.files)]
    )
