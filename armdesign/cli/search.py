"""``armdesign search``: a recording in, the best arm out."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armdesign.cli.common import (
    BaseOption,
    ConfigOption,
    OrientationOption,
    OverwriteOption,
    PointsOption,
    ProgressLine,
    QuietOption,
    ScenarioOption,
    WeightsOption,
    announce_compiling,
    clock,
    one_sentence_errors,
    read_settings,
    task_changes,
    with_weights,
)
from armdesign.errors import SettingsError

if TYPE_CHECKING:
    from armdesign.demonstration import Recording
    from armdesign.runfolder import Written
    from armdesign.search import SearchResult
    from armdesign.settings import Study
    from armdesign.study import Prepared


@one_sentence_errors
def search(
    recording: Annotated[
        Path | None, typer.Argument(help="The demonstration; may also be named in the settings file.")
    ] = None,
    dof: Annotated[int | None, typer.Option("--dof", help="Number of joints n (default 3).")] = None,
    algorithm: Annotated[str | None, typer.Option("--algorithm", help="rapso (default) or pso.")] = None,
    scenario: ScenarioOption = None,
    config: ConfigOption = None,
    base: BaseOption = None,
    points: PointsOption = None,
    orientation: OrientationOption = None,
    weights: WeightsOption = None,
    particles: Annotated[int | None, typer.Option("--particles", help="Number of particles N (default 400).")] = None,
    iterations: Annotated[
        int | None, typer.Option("--iterations", help="Number of iterations M (default 200).")
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", help="Seed of the random numbers (default 0).")] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Run folder to write (default runs/NAME).")] = None,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
    write_config: Annotated[
        bool, typer.Option("--write-config", help="Print all settings with their documentation as TOML and end.")
    ] = False,
) -> None:
    """Search the arm that follows a recorded demonstration best.

    Writes a run folder: result.json, arm.urdf, trajectory.csv, task.csv, history.csv and study.toml.
    """
    study = read_settings(
        config,
        {
            "task": task_changes(base, points, orientation),
            "design": {"dof": dof},
            "search": {"algorithm": algorithm, "particles": particles, "iterations": iterations, "seed": seed},
        },
    )
    if write_config:
        count = len(study.task.points) or 3
        typer.echo(with_weights(study, scenario, weights, count).to_toml(comments=True), nl=False)
        return
    source, demonstration, study = open_recording(recording, study, scenario, weights)
    run(demonstration, study, folder_for(source, study, out), overwrite=overwrite, quiet=quiet)


def open_recording(
    recording: Path | None, study: Study, scenario: str | None, weights: str | None
) -> tuple[Path, Recording, Study]:
    """Read the recording, and settle the settings that depend on its points."""
    from armdesign.demonstration import read_recording  # noqa: PLC0415
    from armdesign.study import first_base  # noqa: PLC0415

    if recording is None and study.task.recording is None:
        raise SettingsError(
            "no recording given", fix="Write 'armdesign search RECORDING', or set task.recording in the settings"
        )
    source = recording or Path(str(study.task.recording))
    demonstration = read_recording(source)
    study = study.replace({"task": {"recording": str(source.resolve())}})
    chosen = study.task.points or [p for p in demonstration.points if p != first_base(demonstration, study)]
    return source, demonstration, with_weights(study, scenario, weights, len(chosen))


def folder_for(source: Path, study: Study, out: Path | None) -> Path:
    """The run folder: --out, or a free name under runs/ that tells recording, algorithm, joints and seed."""
    from armdesign.runfolder import free_folder  # noqa: PLC0415

    if out is not None:
        return out
    name = f"{source.stem}-{study.search.algorithm}-n{study.design.dof}-seed{study.search.seed}"
    return free_folder(Path("runs"), name)


def run(demonstration: Recording, study: Study, folder: Path, *, overwrite: bool, quiet: bool) -> None:
    """Prepare, search and write, saying what is decided and done."""
    from armdesign import runfolder  # noqa: PLC0415
    from armdesign.fitness.evaluator import compile_kernels  # noqa: PLC0415
    from armdesign.search import search as search_arm  # noqa: PLC0415
    from armdesign.study import prepare  # noqa: PLC0415

    prepared = prepare(demonstration, study)
    prepared.space()
    problem = prepared.problem()
    runfolder.claim_folder(folder, overwrite=overwrite)
    if not quiet:
        typer.echo(opening(prepared), err=True)
    with announce_compiling(quiet):
        compile_kernels(problem)
    result = search_arm(prepared, on_progress=None if quiet else ProgressLine())
    written = runfolder.write_search(folder, result)
    if not quiet:
        typer.echo(closing(result, written))


def opening(prepared: Prepared) -> str:
    """What is going to be searched, and what was decided on the way."""
    study, task = prepared.study, prepared.task
    lines = [*prepared.notes]
    shown = ", ".join(f"{name} {w:.3g}" for name, w in zip(task.points, study.fitness.weights, strict=True))
    if study.fitness.orientation_weight:
        shown += f", orientation of {study.task.orientation} {study.fitness.orientation_weight:.3g}"
    lines.append(f"Weights: {shown}.")
    lines.append(
        f"Searching an arm of {study.design.dof} joints with {study.search.algorithm}, {study.search.particles} "
        f"particles, {study.search.iterations} iterations, seed {study.search.seed}."
    )
    return "\n".join(lines)


def closing(result: SearchResult, written: Written) -> str:
    """The arm that was found, and where it lies."""
    from armdesign.cli.tables import evaluation_table  # noqa: PLC0415

    count = int(result.history.evaluations[-1])
    lines = [
        f"Best of {count} candidates in {clock(result.wall_time)}:",
        evaluation_table(result.best, result.prepared),
        "Written:",
        *(f"  {written.folder / name}" for name in written.files),
    ]
    return "\n".join(lines)
