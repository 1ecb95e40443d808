"""``armdesign evaluate``: score a given arm on a task."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

from armdesign.cli.command_errors import one_sentence_errors, refuse_without
from armdesign.cli.command_options import (
    OUTPUT,
    ConfigOption,
    OverwriteOption,
    QuietOption,
    WeightFlags,
    option,
    with_flags,
)
from armdesign.cli.input_recordings import from_run_folder, open_demonstrations
from armdesign.cli.screen import compiling, say, written_text
from armdesign.cli.setting_flags import Given, takes_settings
from armdesign.cli.tables import show_arm
from armdesign.errors import SettingsError
from armdesign.fitness.block import compile_kernels
from armdesign.kinematics.dh_files import read_base_pose, read_design
from armdesign.runs.folder import claim_folder
from armdesign.runs.writing import write_result
from armdesign.search.evaluation import at_given_place, check_design, evaluate_design
from armdesign.search.result import Result
from armdesign.settings.sections import Body, Cell, Fitness, Needs, Settings, Task, read_settings


@one_sentence_errors
@takes_settings(Task, Cell, Body, Needs, Fitness, without=("demonstrations",))
def evaluate(
    design: Annotated[
        Path,
        typer.Argument(
            metavar="DESIGN",
            help="A run folder or its result.json, or a DH table in TOML, JSON or CSV [rad, m].",
        ),
    ],
    recordings: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RECORDING",
            show_default=False,
            help="Recording of the demonstration, or of several of one task; default: those in the settings.",
        ),
    ] = None,
    convention: Annotated[
        str | None,
        option(
            "--convention",
            "modified|classic",
            "Convention of the DH table; default: what the file says, else modified.",
            autocompletion=lambda: ["modified", "classic"],
        ),
    ] = None,
    config: ConfigOption = None,
    *,
    given: Given,
    out: Annotated[
        Path | None, option("--out", "DIR", "Run folder to write; by default nothing is written.", OUTPUT)
    ] = None,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
) -> None:
    """Score a given arm on a task.

    Prints its fitness and the error of each point; --out writes them with the trajectory and the URDF as a run folder.
    The settings are those of --config, else those a result.json carries, else the published ones.
    """
    weight_flags = WeightFlags.out_of(given)
    if out is None:
        refuse_without("--out", {"--overwrite": overwrite})
    table = read_design(design, convention)
    check_design(table)
    try:
        settings = Settings().replace(settings_of(design)) if config is None else read_settings(config)
    except SettingsError as error:
        raise SettingsError(f"{config or design}: {error}", value=error.value) from error
    if recordings:
        settings = settings.replace({"task": {"holdouts": None}})
    kinds = table.joints if any(table.prismatic) or settings.design.joints else None
    settings = with_flags(settings, {**given, "design": {"dof": table.dof, "joints": kinds}})
    if not recordings:
        source = config or design
        settings = from_run_folder(settings, source if source.is_dir() else source.parent)
    opened = open_demonstrations(recordings, settings, weight_flags, "evaluate DESIGN")
    problem = at_given_place(opened.problem(longest=table.length), read_base_pose(design))
    with compiling(quiet=quiet):
        compile_kernels(problem.path_problem)
    result = Result(problem, evaluate_design(table, problem))
    if out is not None:
        claim_folder(out, overwrite=overwrite)
    if not quiet:
        for note in problem.notes:
            say(note)
        show_arm(result)
    if out is None:
        return
    written = write_result(out, result)
    if not quiet:
        typer.echo(written_text([out / name for name in written]))


def settings_of(design: Path) -> dict[str, dict[str, Any]]:
    """The settings a result.json carries; nothing for a plain DH table."""
    path = design / "result.json" if design.is_dir() else design
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return {}
    settings = content.get("settings") if isinstance(content, dict) else None
    # a run from before arms had bodies is that of a thin one
    return {"body": {"kind": "thin"}} | settings if isinstance(settings, dict) else {}
