"""``armdesign search``: a recording in, the best arm out."""

from __future__ import annotations

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
    read_settings,
    refuse_beside_resume,
    say,
    seconds,
    tell_at_once,
    with_weights,
)
from armdesign.cli.task_flags import NO_FLAGS, TaskFlags, takes_task_flags
from armdesign.errors import SettingsError
from armdesign.parameters import is_unicode
from armdesign.wording import counted, resume_command

if TYPE_CHECKING:
    from armdesign.demonstration import Recording
    from armdesign.runfolder import Written
    from armdesign.search import SearchResult
    from armdesign.settings import Study
    from armdesign.study import Prepared


STOPPED = {
    "iterations": "",
    "patience": ", stopped for want of gain",
    "target": ", stopped at the target",
    "time_limit": ", stopped at the time limit",
    "interrupted": ", interrupted",
}


@one_sentence_errors
@takes_task_flags
def search(
    context: typer.Context,
    recording: Annotated[
        Path | None, typer.Argument(help="The demonstration; may also be named in the settings file.")
    ] = None,
    dof: Annotated[int | None, typer.Option("--dof", help="Number of joints n (default 3).")] = None,
    algorithm: Annotated[str | None, typer.Option("--algorithm", help="rapso (default) or pso.")] = None,
    scenario: ScenarioOption = None,
    config: ConfigOption = None,
    task: TaskFlags = NO_FLAGS,
    weights: WeightsOption = None,
    particles: Annotated[int | None, typer.Option("--particles", help="Number of particles N (default 400).")] = None,
    iterations: Annotated[
        int | None, typer.Option("--iterations", help="Number of iterations M (default 200).")
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
    write_config: Annotated[
        bool, typer.Option("--write-config", help="Print all settings with their documentation as TOML and end.")
    ] = False,
) -> None:
    """Search the arm that follows a recorded demonstration best.

    Writes a run folder: result.json, arm.urdf, trajectory.csv, task.csv, task.json (what was done to the data),
    history.csv, study.toml, and to look at preview.html and report.html. Its state is saved after every iteration:
    Ctrl-C ends it with the best arm so far, and --resume goes on, also after a crash.
    """
    if resume is not None:
        refuse_beside_resume(context, "a search", "For another search leave --resume out and choose another --out")
        take_up(resume, workers, cluster, report=report, quiet=quiet)
        return
    study = read_settings(
        config,
        {
            "task": task.changes(),
            "design": {"dof": dof},
            "search": {
                "algorithm": algorithm,
                "particles": particles,
                "iterations": iterations,
                "seed": seed,
                "patience": patience,
                "target": target,
                "time_limit": seconds(time_limit),
            },
        },
    )
    if write_config:
        if recording is not None:
            study = study.replace({"task": {"recording": str(recording.resolve())}})
        weighted = with_weights(study, scenario, weights, lambda: len(study.task.points) or 3)
        typer.echo(weighted.to_toml(comments=True), nl=False)
        return
    source, demonstration, study = open_recording(recording, study, scenario, weights)
    folder = folder_for(source, study, out)
    begin(demonstration, study, folder, workers, cluster, report=report, overwrite=overwrite, quiet=quiet)


def open_recording(
    recording: Path | None, study: Study, scenario: str | None, weights: str | None, command: str = "search"
) -> tuple[Path, Recording, Study]:
    """Read the recording, and settle the settings that depend on its points.

    Returns:
        What runs are named after, the recording, and the settings with the paths it was read from.
    """
    from armdesign.study import choose  # noqa: PLC0415

    if recording is not None:
        if not is_unicode(str(recording)):
            raise SettingsError(f"the name of the recording {str(recording)!a} is not UTF-8", fix="Rename the file")
        study = study.replace({"task": {"recording": str(recording), "files": {}}})
    source = named_source(study, command)
    demonstration = read_demonstration(study)
    task = study.task
    files = {name: str(Path(path).resolve()) for name, path in task.files.items()}
    single = None if files else str(source.resolve())
    study = study.replace({"task": {"recording": single, "files": files}})
    chosen = with_weights(study, scenario, weights, lambda: len(choose(demonstration, study, oriented=False).points))
    return source, demonstration, chosen


def named_source(study: Study, command: str) -> Path:
    """The recording's path; of several files, the folder of the first.

    Raises:
        SettingsError: None is named, or both one and several.
    """
    task = study.task
    if task.recording is not None and task.files:
        raise SettingsError("task.recording and task.files are set", fix="Leave one out")
    if task.recording is None and not task.files:
        raise SettingsError(
            "no recording given", fix=f"Write 'armdesign {command} RECORDING', or set task.recording in the settings"
        )
    return (
        Path(task.recording) if task.recording is not None else Path(next(iter(task.files.values()))).resolve().parent
    )


def read_demonstration(study: Study) -> Recording:
    """The recording that the settings name; units and axes do not count where points count from the base already."""
    from armdesign.demonstration import read_recording, read_recordings  # noqa: PLC0415
    from armdesign.study import ORIGIN  # noqa: PLC0415

    task = study.task
    relative = task.base == ORIGIN
    units, up, mirror = (None, None, False) if relative else (task.units, task.up, task.mirror)
    if task.files:
        return read_recordings(task.files, rate=task.file_rate, units=units, up=up, mirror=mirror)
    return read_recording(str(task.recording), units=units, up=up, mirror=mirror)


def folder_for(source: Path, study: Study, out: Path | None) -> Path:
    """The run folder: --out, or a free name under runs/ that tells recording, algorithm, joints and seed."""
    from armdesign.runfolder import free_folder  # noqa: PLC0415

    if out is not None:
        return out
    name = f"{source.stem}-{study.search.algorithm}-n{study.design.dof}-seed{study.search.seed}"
    return free_folder(Path("runs"), name)


def begin(
    demonstration: Recording,
    study: Study,
    folder: Path,
    workers: int | None,
    cluster: str | None,
    *,
    report: bool,
    overwrite: bool,
    quiet: bool,
) -> None:
    """Prepare the task, start the run folder and search."""
    from armdesign import runfolder  # noqa: PLC0415
    from armdesign.study import prepare  # noqa: PLC0415

    check_workers(workers, cluster)
    check_cluster(cluster)
    prepared = prepare(demonstration, study)
    prepared.space().check_not_empty()
    prepared.problem()
    runfolder.claim_folder(folder, overwrite=overwrite)
    carry_on(folder, prepared, workers, cluster, fresh=True, report=report, quiet=quiet)


def take_up(folder: Path, workers: int | None, cluster: str | None, *, report: bool, quiet: bool) -> None:
    """Go on with the search of a run folder."""
    from armdesign.running import finished, open_run, tidy_up  # noqa: PLC0415

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
    from armdesign import views  # noqa: PLC0415
    from armdesign.fitness.evaluator import compile_kernels  # noqa: PLC0415
    from armdesign.running import carry_out  # noqa: PLC0415

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
    study, task = prepared.study, prepared.task
    lines = [*prepared.notes]
    shown = ", ".join(f"{name} {w:.3g}" for name, w in zip(task.points, study.fitness.weights, strict=True))
    if study.fitness.orientation_weight:
        shown += f", orientation of {study.task.orientation} {study.fitness.orientation_weight:.3g}"
    lines.append(f"Weights: {shown}.")
    lines.append(
        f"Searching an arm of {counted(study.design.dof, 'joint')} with {study.search.algorithm}, "
        f"{counted(study.search.particles, 'particle')}, {counted(study.search.iterations, 'iteration')}, "
        f"seed {study.search.seed}."
    )
    return "\n".join(lines)


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
