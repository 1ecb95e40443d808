"""``armdesign evaluate``: score a given arm on a task."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from armdesign.cli.common import (
    ConfigOption,
    OverwriteOption,
    QuietOption,
    ScenarioOption,
    WeightsOption,
    announce_compiling,
    one_sentence_errors,
    settings_from_flags,
)
from armdesign.cli.recordings_asked import open_demonstrations
from armdesign.cli.task_flags import NO_FLAGS, TaskFlags, takes_task_flags
from armdesign.errors import SettingsError


@one_sentence_errors
@takes_task_flags
def evaluate(
    design: Annotated[
        Path, typer.Argument(help="A run folder or its result.json, or a DH table in TOML, JSON or CSV (rad, m).")
    ],
    recordings: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="[RECORDING]...",
            show_default=False,
            help="The demonstration, or several of one task; default: those in the settings.",
        ),
    ] = None,
    convention: Annotated[
        str | None,
        typer.Option("--convention", help="modified or classic; default: what the file says, else modified."),
    ] = None,
    scenario: ScenarioOption = None,
    config: ConfigOption = None,
    task: TaskFlags = NO_FLAGS,
    weights: WeightsOption = None,
    out: Annotated[Path | None, typer.Option("--out", help="Also write a run folder.")] = None,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Score a given arm on a task: fitness, errors per point, and with --out its trajectory and URDF.

    The settings are those of --config, else those a result.json carries, else the published ones.
    """
    from armdesign.cli.tables import evaluation_table  # noqa: PLC0415
    from armdesign.fitness.block import compile_kernels  # noqa: PLC0415
    from armdesign.kinematics.dh_files import read_design  # noqa: PLC0415
    from armdesign.runs import folder as runfolder  # noqa: PLC0415
    from armdesign.search.evaluation import check_design, evaluate_design  # noqa: PLC0415

    table = read_design(design, convention)
    check_design(table)
    carried = {} if config is not None else settings_of(design)
    try:
        settings = settings_from_flags(config, carried)
    except SettingsError as error:
        raise SettingsError(f"{config or design}: {error}", value=error.value) from error
    held = {"holdouts": None} if recordings else {}
    settings = settings.replace({"task": task.changes() | held, "design": {"dof": table.dof}})
    asked = open_demonstrations(recordings, settings, scenario, weights, "evaluate DESIGN")
    prepared = asked.prepared(longest=table.length)
    with announce_compiling(quiet):
        compile_kernels(prepared.problem())
    evaluation = evaluate_design(table, prepared)
    if out is not None:
        runfolder.claim_folder(out, overwrite=overwrite)
    if not quiet:
        for note in prepared.notes:
            typer.echo(note, err=True)
        typer.echo(evaluation_table(evaluation, prepared))
    if out is None:
        return
    written = runfolder.write_evaluation(out, evaluation, prepared)
    if not quiet:
        typer.echo("\n".join(["Written:", *(f"  {out / name}" for name in written.files)]))


def settings_of(design: Path) -> dict[str, dict[str, Any]]:
    """The settings a result.json carries; nothing for a plain DH table."""
    path = design / "result.json" if design.is_dir() else design
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return {}
    settings = content.get("settings") if isinstance(content, dict) else None
    return settings if isinstance(settings, dict) else {}
