"""``armdesign search``: a recording in, the best arm out."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armdesign.cli.common import (
    INTERRUPTED,
    ClusterOption,
    ConfigOption,
    OverwriteOption,
    ProgressLine,
    QuietOption,
    ScenarioOption,
    WeightsOption,
    WorkersOption,
    announce_compiling,
    check_cluster,
    check_workers,
    clock,
    one_sentence_errors,
    open_backend,
    refuse_beside_resume,
    say,
    seconds,
    settings_from_flags,
    tell_at_once,
    with_weights,
)
from armdesign.cli.recordings_asked import Asked, open_demonstrations
from armdesign.cli.task_flags import NO_FLAGS, TaskFlags, takes_task_flags
from armdesign.errors import RunFolderError, SettingsError, counted, resume_command

if TYPE_CHECKING:
    from armdesign.runs.folder import Written
    from armdesign.search.prepare import Prepared
    from armdesign.search.search import SearchResult


AUTO = "auto"
DOF_ALLOWED = "a whole number from 1 to 10, or auto"
OTHER_KINDS = {"auto.json": "a search for the number of joints", "sweep.toml": "a sweep", "study.json": "a study"}
"""What holds runs in folders of their own, by the file it is known by."""
STOPPED = {
    "iterations": "",
    "budget": "",
    "patience": ", stopped for want of gain",
    "target": ", stopped at the target",
    "time_limit": ", stopped at the time limit",
    "interrupted": ", interrupted",
}


@one_sentence_errors
@takes_task_flags
def search(
    context: typer.Context,
    recordings: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[RECORDING]...",
            show_default=False,
            help="The demonstration, or several of one task; may also be named in the settings file.",
        ),
    ] = None,
    dof: Annotated[
        str | None,
        typer.Option("--dof", metavar="N|auto", help="Number of joints n (default 3), or auto: as many as pay."),
    ] = None,
    algorithm: Annotated[str | None, typer.Option("--algorithm", help="multibasin (default), rapso or pso.")] = None,
    scenario: ScenarioOption = None,
    config: ConfigOption = None,
    holdout: Annotated[
        list[Path] | None,
        typer.Option("--holdout", help="A demonstration the search does not see; the arm is scored on it. Repeatable."),
    ] = None,
    demonstrations: Annotated[
        str | None,
        typer.Option("--demonstrations", help="Of several, the arm's fitness is their mean (default) or the worst."),
    ] = None,
    task: TaskFlags = NO_FLAGS,
    weights: WeightsOption = None,
    particles: Annotated[int | None, typer.Option("--particles", help="Particles N of a swarm (default 400).")] = None,
    iterations: Annotated[
        int | None, typer.Option("--iterations", help="Iterations M of a swarm (default 200).")
    ] = None,
    budget: Annotated[
        int | None, typer.Option("--budget", help="Most candidates of multibasin (default 25000).")
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Seed of the random numbers (default 0).")] = None,
    patience: Annotated[
        int | None, typer.Option("--patience", help="Stop after this many iterations without a gain of 0.1 %.")
    ] = None,
    target: Annotated[float | None, typer.Option("--target", help="Stop once the fitness r is this low [m].")] = None,
    time_limit: Annotated[str | None, typer.Option("--time-limit", help="Stop after this time, e.g. 30m.")] = None,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    resume: Annotated[
        Path | None, typer.Option("--resume", help="Go on with the search in this run folder where it stopped.")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Run folder to write (default runs/NAME).")] = None,
    report: Annotated[
        bool, typer.Option("--report/--no-report", help="Also write preview.html and report.html (default).")
    ] = True,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
    within: Annotated[
        float | None,
        typer.Option("--within", help="With --dof auto: gain of f by more joints that does not pay [%] (default 4)."),
    ] = None,
    enough: Annotated[
        float | None,
        typer.Option("--enough", help="With --dof auto: f below which an arm is good enough [mm] (default 5)."),
    ] = None,
    write_config: Annotated[
        bool, typer.Option("--write-config", help="Print all settings with their documentation as TOML and end.")
    ] = False,
) -> None:
    """Search the arm that follows a recorded demonstration best, or several demonstrations of one task.

    Writes a run folder: result.json, arm.urdf, trajectory.csv, task.csv, task.json (what was done to the data),
    history.csv, study.toml, and to look at preview.html and report.html. Its state is saved after every iteration:
    Ctrl-C ends it with the best arm so far, and --resume goes on, also after a crash.
    """
    if resume is not None:
        refuse_beside_resume(context, "a search", "For another search leave --resume out and choose another --out")
        take_up(resume, workers, cluster, report=report, quiet=quiet)
        return
    count = joint_count(dof)
    auto = count == AUTO
    refuse_without_auto(auto=auto, within=within, enough=enough)
    settings = settings_from_flags(
        config,
        {
            "task": task.changes() | {"holdouts": [str(path.resolve()) for path in holdout or ()] or None},
            "design": {"dof": None if auto else count},
            "fitness": {"demonstrations": demonstrations},
            "search": {
                "algorithm": algorithm,
                "particles": particles,
                "iterations": iterations,
                "budget": budget,
                "seed": seed,
                "patience": patience,
                "target": target,
                "time_limit": seconds(time_limit),
            },
        },
    )
    if write_config:
        if recordings:
            first, *more = (str(path.resolve()) for path in recordings)
            settings = settings.replace({"task": {"recording": first, "more_recordings": more or None}})
        weighted = with_weights(settings, scenario, weights, lambda: len(settings.task.points) or 3)
        typer.echo(weighted.to_toml(comments=True), nl=False)
        return
    asked = open_demonstrations(recordings, settings, scenario, weights)
    if demonstrations is not None and len(asked.seen) == 1:
        raise SettingsError(
            "--demonstrations is given, but there is one demonstration", value=demonstrations,
            fix="Name several recordings, or leave it out",
        )  # fmt: skip
    check_workers(workers, cluster)
    check_cluster(cluster)
    if auto:
        from armdesign.cli.auto_dof_command import search_auto  # noqa: PLC0415

        search_auto(
            prepare_for=asked.prepared, source=asked.source, out=out, workers=workers, cluster=cluster, report=report,
            overwrite=overwrite, quiet=quiet, within=within, enough=enough,
        )  # fmt: skip
        return
    folder = folder_for(asked, out)
    begin(asked.prepared(), folder, workers, cluster, report=report, overwrite=overwrite, quiet=quiet)


def joint_count(text: str | None) -> int | str | None:
    """The number of joints of --dof, or AUTO.

    Raises:
        SettingsError: It is neither.
    """
    if text is None or text.strip().lower() == AUTO:
        return text and AUTO
    try:
        count = int(text)
    except ValueError as error:
        raise SettingsError(f"--dof is {text!r}", value=text, allowed=DOF_ALLOWED) from error
    if not 1 <= count <= 10:
        raise SettingsError(f"setting 'design.dof' is {count}", value=count, allowed=DOF_ALLOWED)
    return count


def refuse_without_auto(*, auto: bool, **given: float | None) -> None:
    """Refuse flags that mean something with --dof auto alone.

    Raises:
        SettingsError: One is given without it.
    """
    for name, value in given.items():
        if value is not None and not auto:
            raise SettingsError(f"--{name} is given without --dof auto", value=value, fix="Leave it out, or add that")


def folder_for(asked: Asked, out: Path | None) -> Path:
    """The run folder: --out, or a free name under runs/ that tells recording, algorithm, joints and seed."""
    from armdesign.runs.folder import free_folder  # noqa: PLC0415

    if out is not None:
        return out
    settings, more = asked.settings, len(asked.seen) - 1
    several = f"-and-{more}-more" if more else ""
    name = f"{asked.source.stem}{several}-{settings.search.algorithm}-n{settings.design.dof}-seed{settings.search.seed}"
    return free_folder(Path("runs"), name)


def begin(
    prepared: Prepared,
    folder: Path,
    workers: int | None,
    cluster: str | None,
    *,
    report: bool,
    overwrite: bool,
    quiet: bool,
) -> None:
    """Start the run folder and search."""
    from armdesign.runs import folder as runfolder  # noqa: PLC0415

    refuse_other_kinds(folder)
    prepared.space().check_not_empty()
    for each in prepared.demonstrations:
        each.problem()
    runfolder.claim_folder(folder, overwrite=overwrite)
    carry_on(folder, prepared, workers, cluster, fresh=True, report=report, quiet=quiet)


def refuse_other_kinds(folder: Path) -> None:
    """Turn away a folder of runs, whose files a single run would stand among.

    Raises:
        RunFolderError: It holds a sweep, a study or a search for the number of joints.
    """
    for name, kind in OTHER_KINDS.items():
        if os.path.isfile(folder / name):  # False for names too long, too
            raise RunFolderError(f"{folder} holds {kind}", value=str(folder), fix="Name another folder with --out")


def take_up(folder: Path, workers: int | None, cluster: str | None, *, report: bool, quiet: bool) -> None:
    """Go on with the search of a run folder."""
    from armdesign.runs.resumable import finished, open_run, tidy_up  # noqa: PLC0415

    if (folder / "auto.json").exists():
        from armdesign.cli.auto_dof_command import resume_auto  # noqa: PLC0415

        resume_auto(folder, workers=workers, cluster=cluster, report=report, quiet=quiet)
        return
    if finished(folder):
        tidy_up(folder)
        typer.echo(f"{folder} is finished; nothing to resume.", err=True)
        return
    carry_on(folder, open_run(folder), workers, cluster, fresh=False, report=report, quiet=quiet)


def carry_on(
    folder: Path,
    prepared: Prepared,
    workers: int | None,
    cluster: str | None,
    *,
    fresh: bool,
    report: bool,
    quiet: bool,
) -> None:
    """Search in a run folder, saying what is decided and done."""
    from armdesign.fitness.block import compile_kernels  # noqa: PLC0415
    from armdesign.runs.resumable import carry_out  # noqa: PLC0415
    from armdesign.views import writing as views  # noqa: PLC0415

    if not quiet:
        typer.echo(opening(prepared), err=True)
    with announce_compiling(quiet):
        compile_kernels(prepared.problem())

    def on_interrupt() -> None:
        tell_at_once("Stopping after this iteration; once more stops at once.")

    with ProgressLine() as progress, open_backend(prepared, workers, cluster) as backend:
        result, written = carry_out(
            folder,
            prepared,
            backend,
            fresh=fresh,
            on_progress=None if quiet else progress,
            on_interrupt=on_interrupt,
            on_note=say,
        )
    if report:
        written = replace(written, files=(*written.files, *views.write_views(folder)))
    if not quiet:
        typer.echo(closing(result, written))
    if result.stopped_by == "interrupted":
        say(f"Interrupted; go on with: {resume_command('search', folder, cluster)}")
        raise typer.Exit(INTERRUPTED)


def opening(prepared: Prepared) -> str:
    """What is going to be searched, and what was decided on the way."""
    settings, task = prepared.settings, prepared.task
    lines = [*prepared.notes, *warnings_of_others(prepared)]
    shown = ", ".join(f"{name} {w:.3g}" for name, w in zip(task.points, settings.fitness.weights, strict=True))
    if settings.fitness.orientation_weight:
        shown += f", orientation of {settings.task.orientation} {settings.fitness.orientation_weight:.3g}"
    lines.append(f"Weights: {shown}.")
    lines.append(
        f"Searching an arm of {counted(settings.design.dof, 'joint')} with {settings.search.algorithm}, "
        f"{settings.search.size}, seed {settings.search.seed}."
    )
    return "\n".join(lines)


def warnings_of_others(prepared: Prepared) -> list[str]:
    """What is doubtful about further demonstrations; everything that was done to them is in their task.json."""
    return [
        f"{Path(each.name).name}: {step.sentence}"
        for each in (*prepared.others, *prepared.holdouts)
        for step in each.steps
        if step.name == "warning"
    ]


def closing(result: SearchResult, written: Written) -> str:
    """The arm that was found, and where it lies."""
    from armdesign.cli.tables import evaluation_table  # noqa: PLC0415

    count = int(result.history.evaluations[-1])
    lines = [
        f"Best of {counted(count, 'candidate')} in {clock(result.wall_time)}{STOPPED[result.stopped_by]}:",
        evaluation_table(result.best, result.prepared),
        "Written:",
        *(f"  {written.folder / name}" for name in written.files),
    ]
    return "\n".join(lines)
