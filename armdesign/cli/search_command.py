"""``armdesign search``: a recording in, the best arm out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from armdesign import views
from armdesign.building.room import room_for_motors
from armdesign.cli.auto_dof_command import resume_auto, search_auto
from armdesign.cli.command_errors import (
    INTERRUPTED,
    one_sentence_errors,
    refuse_beside_resume,
    refuse_other_algorithms,
    refuse_without,
)
from armdesign.cli.command_options import (
    OUTPUT,
    ConfigOption,
    OverwriteOption,
    QuietOption,
    WeightFlags,
    option,
    settings_from_flags,
)
from armdesign.cli.input_recordings import Demonstrations, Split, from_run_folder, open_demonstrations
from armdesign.cli.screen import SearchBar, clock, compile_for, say, say_in_handler, show_text, written_text
from armdesign.cli.setting_flags import Given, takes_settings
from armdesign.cli.tables import show_arm
from armdesign.cli.worker_options import ClusterOption, RunOptions, WorkersOption, check_workers, open_backend
from armdesign.errors import SettingsError, counted, resume_command
from armdesign.experiments.sweep.sweep_store import refuse_other_kinds
from armdesign.runs.folder import SETTINGS, TASK, TASK_JSON, URDF, claim_folder, free_folder, old_name_note
from armdesign.runs.reading import read_problem
from armdesign.runs.resumable import EXTENSIBLE, carry_out, extend_run, finished, tidy_up
from armdesign.search.design_problem import DesignProblem
from armdesign.search.result import Result
from armdesign.settings.sections import ARM, RECORDING, Body, Cell, Design, Fitness, Needs, Search, Task

AUTO = "auto"
STOPPED = {
    "iterations": "",
    "budget": "",
    "agreement": ", stopped since independent starts agree",
    "patience": ", stopped for want of gain",
    "target": ", stopped at the target",
    "time_limit": ", stopped at the time limit",
    "interrupted": ", interrupted",
}


@one_sentence_errors
@takes_settings(Design, Task, Cell, Body, Needs, Fitness, Search, words={"dof": AUTO})
def search(
    context: typer.Context,
    recordings: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RECORDING",
            show_default=False,
            help="Recording of the demonstration, or of several of one task; may also be named in the settings file.",
        ),
    ] = None,
    config: ConfigOption = None,
    *,
    given: Given,
    within: Annotated[
        float | None,
        option(
            "--within",
            "X",
            "With --dof auto: the fewest joints whose path fitness f is within X % of the best (default 4).",
            ARM,
        ),
    ] = None,
    enough: Annotated[
        float | None,
        option(
            "--enough",
            "X",
            "With --dof auto: path fitness f below which more joints bring nothing [mm] (default 5).",
            ARM,
        ),
    ] = None,
    holdout: Annotated[
        list[Path] | None,
        option(
            "--holdout",
            "FILE",
            "Another demonstration, on which the arm that was found is scored. Repeatable.",
            RECORDING,
        ),
    ] = None,
    cycles: Annotated[
        str | None,
        option(
            "--cycles",
            "all|best",
            "Where a recording holds the job several times (see 'recording cycles'): all times, or the most typical.",
            RECORDING,
        ),
    ] = None,
    holdout_every: Annotated[
        int | None,
        option("--holdout-every", "N", "Hold out every N-th demonstration, and score the arm on it.", RECORDING),
    ] = None,
    motors: Annotated[
        str | None,
        option(
            "--motors",
            "FAMILY",
            "Leave the room that this family's motors (see 'catalogue list') and their brackets take, for --payload: "
            "sets diameter and length of joints and tubes, where not given, so that 'build' has parts that fit.",
            ARM,
        ),
    ] = None,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    resume: Annotated[
        Path | None,
        option(
            "--resume",
            "DIR",
            "Go on with the search in this run folder; a larger --budget or --iterations, or another stop rule, "
            "extends it.",
        ),
    ] = None,
    out: Annotated[
        Path | None, option("--out", "DIR", "Run folder to write (default runs/RECORDING-ALGORITHM-nN-seedS).", OUTPUT)
    ] = None,
    report: Annotated[
        bool,
        option(
            "--report/--no-report",
            None,
            "Whether to write preview.html and report.html (default: --report).",
            OUTPUT,
            show_default=False,
        ),
    ] = True,
    overwrite: OverwriteOption = False,
    quiet: QuietOption = False,
    write_config: Annotated[
        bool,
        option(
            "--write-config",
            None,
            "Print all settings, with their documentation, as TOML for --config and end.",
            OUTPUT,
        ),
    ] = False,
) -> None:
    """Search the arm that follows a recorded demonstration best.

    Several demonstrations of one task are followed by one arm. Writes a run folder: result.json, arm.urdf,
    trajectory.csv, task.csv, task.json (what was done to the data), history.csv, settings.toml, and to look at
    preview.html and report.html. Its state is saved every second: Ctrl-C ends the search with the best arm so
    far, and --resume goes on, also after a crash.
    """
    how = RunOptions(workers, cluster, report, quiet)
    if resume is not None:
        fix = "For another search leave --resume out and choose another --out"
        refuse_beside_resume(context, "a search", fix, also=EXTENSIBLE)
        resume_search(resume, given["search"], how)
        return
    auto = given["design"].get("dof") == AUTO
    if auto:
        del given["design"]["dof"]
    else:
        refuse_without("--dof auto", {"--within": within, "--enough": enough})
    if out is None:
        refuse_without("--out", {"--overwrite": overwrite})
    weight_flags = WeightFlags.out_of(given)
    if holdout:
        given["task"]["holdouts"] = [str(path.resolve()) for path in holdout]
    settings = settings_from_flags(config, given)
    if motors is not None:
        room = room_for_motors(motors, settings.design.length[1], settings.needs.payload)
        settings = settings.replace({"body": {name: room[name] for name in room if name not in given["body"]}})
    refuse_other_algorithms(given["search"], [settings.search.algorithm])
    if write_config:
        if cycles is not None or holdout_every is not None:
            message = "--cycles and --holdout-every are settled when the recordings are read"
            raise SettingsError(message, fix="Leave them out; the run's settings.toml names the parts")
        if recordings:
            first, *more = (str(path.resolve()) for path in recordings)
            settings = settings.replace({"task": {"recording": first, "more_recordings": more or None}})
        weighted = weight_flags.over(settings)
        typer.echo(weighted.to_toml(comments=True), nl=False)
        return
    if config is not None and not recordings:
        settings = from_run_folder(settings, config.parent)
    split = Split(cycles, holdout_every)
    opened = open_demonstrations(recordings, settings, weight_flags, split=split)
    if given["fitness"].get("demonstrations") is not None and len(opened.seen) == 1:
        raise SettingsError(
            "--demonstrations is given, but there is one demonstration", value=given["fitness"]["demonstrations"],
            fix="Name several recordings, or leave it out",
        )  # fmt: skip
    check_workers(workers, cluster)
    if auto:
        search_auto(opened, out, how, overwrite=overwrite, within=within, enough=enough)
        return
    folder, problem = folder_for(opened, out), opened.problem()
    refuse_other_kinds(folder)
    problem.check()
    claim_folder(folder, overwrite=overwrite)
    carry_on(folder, problem, how, fresh=True)


def folder_for(opened: Demonstrations, out: Path | None) -> Path:
    """The run folder: --out, or a free name under runs/ made of recording, algorithm, joints and seed."""
    if out is not None:
        return out
    settings, more = opened.settings, len(opened.seen) - 1
    several = f"-and-{more}-more" if more else ""
    name = (
        f"{opened.source.stem}{several}-{settings.search.algorithm}-n{settings.design.dof}-seed{settings.search.seed}"
    )
    return free_folder(Path("runs"), name)


def resume_search(folder: Path, changes: Mapping[str, Any], how: RunOptions) -> None:
    """Go on with the search of a run folder, with another length or other stop rules where some are given."""
    if changes:
        extend(folder, changes)
    elif (folder / "auto.json").exists():
        resume_auto(folder, how)
        return
    elif finished(folder):
        tidy_up(folder)
        say(f"{folder} is finished; nothing to resume.")
        return
    problem = read_problem(folder)
    if note := old_name_note(folder):
        say(note)
    carry_on(folder, problem, how, fresh=False)


def extend(folder: Path, changes: Mapping[str, Any]) -> None:
    """Give the search of a run folder another length or other stop rules, and say what that means.

    Raises:
        RunFolderError: The folder holds a search for the number of joints.
        SettingsError: The algorithm has no such setting, or the search would stop at once all the same.
    """
    refuse_other_kinds(folder)
    settings = read_problem(folder).settings.search
    refuse_other_algorithms(changes, [settings.algorithm])
    extend_run(folder, changes)
    if "budget" in changes and changes["budget"] != settings.budget:
        say(
            f"The budget becomes {changes['budget']} instead of {settings.budget}: this is another run than one with "
            "that budget from the start, which would have planned its stages otherwise."
        )


def carry_on(folder: Path, problem: DesignProblem, how: RunOptions, *, fresh: bool) -> None:
    """Search in a run folder, saying what is decided and done."""
    if not how.quiet:
        for sentence in opening(problem):
            say(sentence)
    compile_for(problem, quiet=how.quiet)

    def on_interrupt() -> None:
        say_in_handler("Stopping after this iteration; once more stops at once.")

    with SearchBar() as progress, open_backend(problem, how.workers, how.cluster) as backend:
        result, files = carry_out(
            folder,
            problem,
            backend,
            fresh=fresh,
            on_progress=None if how.quiet else progress,
            on_interrupt=on_interrupt,
            on_note=say,
        )
    # of a further demonstration only its folder is named
    names = [SETTINGS, TASK, TASK_JSON, *dict.fromkeys(name.split("/")[0] for name in files)]
    if how.report:
        names += views.writing.write_views(folder, result, files[URDF])
    if not how.quiet:
        show_result(result, [folder / name for name in names])
    if result.facts is not None and result.facts.interrupted:
        typer.echo(f"Interrupted; go on with: {resume_command('search', folder, how.cluster)}", err=True)
        raise typer.Exit(INTERRUPTED)


def opening(problem: DesignProblem) -> list[str]:
    """Sentences on what is going to be searched, and on what was decided on the way."""
    settings, task = problem.settings, problem.task
    # what else was done to further demonstrations is in their task.json
    warnings = [
        f"{Path(each.name).name}: {step.sentence}"
        for each in problem.every[1:]
        for step in each.steps
        if step.name == "warning"
    ]
    lines = [*problem.notes, *warnings]
    shown = ", ".join(f"{name} {w:.3g}" for name, w in zip(task.points, settings.fitness.weights, strict=True))
    if settings.fitness.orientation_weight:
        shown += f", orientation of {settings.task.orientation} {settings.fitness.orientation_weight:.3g}"
    lines.append(f"Weights: {shown}.")
    lines.append(
        f"Searching an arm of {counted(settings.design.dof, 'joint')} with {settings.search.algorithm}, "
        f"{settings.search.size}, seed {settings.search.seed}."
    )
    return lines


def show_result(result: Result, files: Sequence[Path]) -> None:
    """Print the arm that was found, and where its files are."""
    facts = result.facts
    if facts is not None:
        count = counted(facts.evaluations, "candidate")
        typer.echo(f"Best of {count} in {clock(facts.wall_time)}{STOPPED[facts.stopped_by]}:")
        if facts.found:
            show_text(facts.found)
    show_arm(result)
    typer.echo(written_text(files))
