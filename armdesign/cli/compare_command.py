"""``armdesign compare``: designs and ready-made arms on the same task."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from armdesign.cli.command_errors import one_sentence_errors, refuse_existing, refuse_without
from armdesign.cli.command_options import ConfigOption, QuietOption, WeightFlags, option, settings_from_flags
from armdesign.cli.input_recordings import from_run_folder, open_recording
from armdesign.cli.screen import StatusBar, clock, compiling, say, show_table, show_text
from armdesign.cli.setting_flags import Given, takes_settings
from armdesign.errors import RunFolderError, SettingsError
from armdesign.experiments.compare.arms import Arm, carried_settings, open_arms
from armdesign.experiments.compare.base_pose import BaseProgress, BaseSearch
from armdesign.experiments.compare.comparison import compare as compare_arms
from armdesign.experiments.compare.comparison import some_problem, with_joints
from armdesign.experiments.compare.comparison_table import (
    EFFORT,
    FITNESS,
    comparison_csv,
    comparison_json,
    comparison_notes,
    effort_cells,
    fitness_cells,
)
from armdesign.experiments.compare.ready_made import ready_made_arms
from armdesign.files import write_whole
from armdesign.fitness.block import compile_kernels
from armdesign.runs.folder import settings_file
from armdesign.runs.reading import read_problem
from armdesign.search.design_problem import DesignProblem
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Fitness, Settings, Task

BASE = "Base of ready-made arms"
"""Panel of the options on the search for a base pose."""


@one_sentence_errors
@takes_settings(Task, Fitness, without=("demonstrations",))
def compare(
    arms: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="RUN|ARM",
            help="Run folders, DH tables, names of ready-made arms such as ur5 or panda, or paths of URDFs.",
        ),
    ] = None,
    recording: Annotated[
        Path | None,
        option("--task", "FILE", "A recording, or a run folder for its task (default: that of the first run)."),
    ] = None,
    tool: Annotated[
        list[str] | None,
        option("--tool", "[ARM=]LINK", "Link of a URDF whose origin is the tool; default: the last link."),
    ] = None,
    evaluations: Annotated[int, option("--evaluations", "N", "Base poses tried for each ready-made arm.", BASE)] = 1000,
    box: Annotated[
        float, option("--box", "X", "How far from the shoulder a base may stand along each axis [m].", BASE)
    ] = 0.5,
    seed: Annotated[int, option("--seed", "N", "Seed of the search for base poses.", BASE)] = 0,
    payload: Annotated[
        float | None, option("--payload", "X", "Mass carried at the tool, for the torques [kg] (default: the task's).")
    ] = None,
    config: ConfigOption = None,
    *,
    given: Given,
    json_file: Annotated[Path | None, option("--json", "FILE", "JSON file to write with all figures.")] = None,
    csv_file: Annotated[Path | None, option("--csv", "FILE", "CSV file to write with the table.")] = None,
    overwrite: Annotated[bool, option("--overwrite", None, "Replace the files of --json and --csv.")] = False,
    quiet: QuietOption = False,
    catalogue: Annotated[bool, option("--list", None, "List the ready-made arms and end.")] = False,
) -> None:
    """Compare designs and ready-made arms on the same task.

    All arms are scored by one fitness. The base of a design is where its run has it, by default at the demonstrator's
    shoulder; that of a ready-made arm is searched where the settings let a base stand, by default in a box around the
    shoulder, with its turn about the vertical. The skeleton of a ready-made arm is the polyline through its joint
    origins to the tool. The settings are those of --config, else those of the first run,
    else the published ones.
    """
    if catalogue:
        known = [f"{arm.name:<8} {arm.title}" for arm in ready_made_arms().values()]
        typer.echo("\n".join(known) or "example-robot-data is not installed.")
        return
    if json_file is None and csv_file is None:
        refuse_without("--json or --csv", {"--overwrite": overwrite})
    base_search = BaseSearch(evaluations, box, seed)
    if payload is not None and not 0.0 <= payload <= 1e4:
        raise SettingsError(f"--payload is {payload:g} kg", value=payload, allowed="0 to 10000 kg")
    check_outputs(json_file, csv_file, overwrite=overwrite)
    weight_flags = WeightFlags.out_of(given)
    folder = task_folder(recording, arms or []) if recording is not None or config is None else None
    if folder is None:
        if config is None:
            carried = (carried_settings(Path(arm)) for arm in arms or [])
            settings = next((found for found in carried if found is not None), Settings())
        else:
            settings = settings_from_flags(config, {})
        if config is not None and recording is None:
            settings = from_run_folder(settings, config.parent)
        opened = open_arms(arms or [], settings, tool or ())
        problem = task_of_recording(recording, settings.replace(given), weight_flags, opened)
    else:
        flags = {"--scenario": weight_flags.scenario, "--config": config, "--weights": weight_flags.weights}
        flags |= {f"--{name.replace('_', '-')}": value for name, value in given["task"].items()}
        useless = [name for name, value in flags.items() if value is not None]
        if useless:
            raise SettingsError(
                f"the task is that of the run {folder}, with its settings; {', '.join(useless)} would not be used",
                value=useless, fix="Leave them out, or give a recording with --task",
            )  # fmt: skip
        problem = read_problem(folder)
        opened = open_arms(arms or [], problem.settings, tool or ())
    if not quiet:
        for note in problem.notes if folder is None else ():
            say(note)
    with compiling(quiet=quiet):
        compile_kernels(some_problem(problem))
    with BaseBar(quiet=quiet) as bar:
        comparison = compare_arms(opened, problem, base_search, payload=payload, on_progress=bar)
    if json_file is not None:
        source = str(recording if recording is not None else folder or problem.settings.task.recording)
        write_whole(json_file, comparison_json(comparison, source))
    if csv_file is not None:
        write_whole(csv_file, comparison_csv(comparison))
    if not quiet:
        show_table(EFFORT, [effort_cells(row) for row in comparison.rows])
        typer.echo()
        show_table(FITNESS, [fitness_cells(row) for row in comparison.rows])
        show_text("\n".join(comparison_notes(comparison)))


def task_folder(recording: Path | None, arms: Sequence[str]) -> Path | None:
    """The run folder whose own task is meant; None where a recording is."""
    if recording is None:
        return next((Path(arm) for arm in arms if settings_file(Path(arm)).is_file()), None)
    if recording.is_dir():
        return recording
    beside = recording.parent
    whole = settings_file(beside).is_file() and (beside / "task.json").is_file()
    return beside if recording.name == "task.csv" and whole else None


def task_of_recording(
    recording: Path | None, settings: Settings, weight_flags: WeightFlags, arms: Sequence[Arm]
) -> DesignProblem:
    """The task of a recording, for arms of so many joints and such a length at most.

    Raises:
        SettingsError: There is no recording.
    """
    if recording is None and settings.task.recording is None and not settings.task.files:
        raise SettingsError("no task is given", fix="Name a recording or a run folder with --task")
    settings = with_joints(settings, max(arm.dof for arm in arms))
    _, demonstration, settings = open_recording(recording, settings, weight_flags, "compare ARM --task")
    return prepare(demonstration, settings, longest=max(arm.length for arm in arms))


def check_outputs(json_file: Path | None, csv_file: Path | None, *, overwrite: bool) -> None:
    """Turn away outputs that cannot be written, before any work is done.

    Raises:
        RunFolderError: One is a folder, is there already or has no folder, or both are the same.
    """
    for target in (json_file, csv_file):
        if target is None:
            continue
        if target.is_dir():
            raise RunFolderError(f"the output {target} is a folder", value=str(target), fix="Give the name of a file")
        if not target.parent.is_dir():
            raise RunFolderError(f"there is no folder {target.parent} for the output {target.name}", value=str(target))
        refuse_existing(target, overwrite=overwrite)
    if json_file is not None and json_file == csv_file:
        raise RunFolderError(f"--json and --csv are both {json_file}", value=str(json_file), fix="Name two files")


class BaseBar(StatusBar):
    """Progress of the searches for base poses: a bar for each arm in a terminal, one line each elsewhere."""

    def __init__(self, *, quiet: bool) -> None:
        """Show nothing yet."""
        super().__init__()
        self.quiet, self.name, self.begun = quiet, "", 0.0

    def __call__(self, name: str, progress: BaseProgress) -> None:
        """Show how far the search for the base of an arm is."""
        if name != self.name:
            self.__exit__()
            self.name, self.begun = name, time.monotonic()
        last = progress.evaluations >= progress.total
        if self.quiet or not (last or self.terminal):
            return
        best = f"r {progress.fitness:.4f}" if progress.fitness < float("inf") else "the start is not reached yet"
        text = f"{name}: {progress.evaluations} of {progress.total} base poses, {best}"
        if self.terminal:
            self.draw(progress.evaluations, progress.total, text)
        else:
            say(f"{text}, {clock(time.monotonic() - self.begun)}")
