"""``armdesign recording``: look at a recording, draw it, convert it."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Annotated

import typer

from armdesign.cli import PanelCommand
from armdesign.cli.command_errors import one_sentence_errors, refuse_existing
from armdesign.cli.command_options import ConfigOption, option, settings_from_flags
from armdesign.cli.input_recordings import named_source
from armdesign.cli.screen import say
from armdesign.cli.setting_flags import Given, takes_settings
from armdesign.demonstration.cleaning.cleaning import crop
from armdesign.demonstration.convert import convert as converted
from armdesign.demonstration.convert import task_json_beside, write_conversion
from armdesign.demonstration.cycles import find_cycles
from armdesign.demonstration.picture import check_kind, draw_recording
from armdesign.demonstration.summary import summarise, summary_text
from armdesign.errors import SettingsError, counted
from armdesign.files import write_whole
from armdesign.search.design_arm import recording_of
from armdesign.settings.sections import Settings, Task

READING = ("units", "up", "mirror", "time_unit", "quaternions", "confidence", "rate")
"""Settings that say how a recording is read."""
app = typer.Typer(
    name="recording",
    help="Look at a recording, draw it, or convert it to plain CSV.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

FileArgument = Annotated[
    Path | None,
    typer.Argument(metavar="FILE", help="The recording, in any known format; may also be named in --config."),
]
ReplaceOption = Annotated[bool, option("--overwrite", None, "Replace files of the same names.")]


@app.command(cls=PanelCommand)
@one_sentence_errors
@takes_settings(Task, only=READING)
def info(
    file: FileArgument = None,
    config: ConfigOption = None,
    *,
    given: Given,
    as_json: Annotated[bool, option("--json", None, "Print the same as JSON.")] = False,
) -> None:
    """Say what a recording holds.

    Rate, length, units, points and bodies with their gaps, and the arms that the points' names make.
    """
    settings = settings_of(file, config, given)
    named_source(settings, "recording info")
    summary = summarise(recording_of(settings))
    typer.echo(json.dumps(summary.to_dict(), indent=2) if as_json else summary_text(summary))


@app.command(cls=PanelCommand)
@one_sentence_errors
@takes_settings(Task, only=READING)
def plot(
    file: FileArgument = None,
    out: Annotated[
        Path | None,
        option("--out", "FILE", "Picture to write, .png, .svg or .pdf (default: the recording's name with .png)."),
    ] = None,
    config: ConfigOption = None,
    *,
    given: Given,
    overwrite: ReplaceOption = False,
) -> None:
    """Draw the paths of all points from three sides, and their gaps."""
    settings = settings_of(file, config, given)
    target = out or Path(f"{named_source(settings, 'recording plot').stem}.png")
    kind = check_kind(target.suffix.lower().lstrip("."))
    refuse_existing(target, overwrite=overwrite)
    write_whole(target, draw_recording(recording_of(settings), kind))
    typer.echo(f"Written: {target}")


@app.command(cls=PanelCommand)
@one_sentence_errors
@takes_settings(Task)
def convert(
    paths: Annotated[
        list[Path], typer.Argument(metavar="FILE OUT.csv", help="The recording, and the plain CSV file to write.")
    ],
    config: ConfigOption = None,
    *,
    given: Given,
    overwrite: ReplaceOption = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing.")] = False,
) -> None:
    """Write the points of a task as plain CSV.

    They are cleaned, in metres, z up; what was done goes to OUT.task.json. A search on it has the same task as one on
    the recording itself with the same flags. The orientation is written if --orientation asks for it. With the
    recording named in --config, OUT.csv is enough.
    """
    file, out = in_and_out(paths)
    settings = settings_of(file, config, given)
    named_source(settings, "recording convert")
    if settings.task.base_mode != "shoulder":
        fix = "Give --base-mode to the search on what is written"
        raise SettingsError("the points are written where they are in the room, whatever the base mode", fix=fix)
    refuse_existing(out, task_json_beside(out), overwrite=overwrite)
    conversion = converted(recording_of(settings), settings)
    written = write_conversion(out, conversion)
    if not quiet:
        for note in conversion.notes:
            say(note)
        typer.echo("Written: " + ", ".join(map(str, written)))


@app.command(cls=PanelCommand)
@one_sentence_errors
@takes_settings(Task, only=(*READING, "base", "points", "start", "stop"))
def cycles(
    file: FileArgument = None,
    config: ConfigOption = None,
    *,
    given: Given,
    as_json: Annotated[bool, option("--json", None, "Print the same as JSON.")] = False,
) -> None:
    """Find the times that the same job is done in one recording.

    They begin and end in the same pose. How far each is from the others is the mean distance of their paths.
    """
    settings = settings_of(file, config, given)
    source = named_source(settings, "recording cycles")
    recording, _ = crop(recording_of(settings), settings.task.start, settings.task.stop)
    found = find_cycles(recording, settings.task.base, settings.task.points)
    if as_json:
        every = [cycle._asdict() for cycle in found.every]
        typer.echo(json.dumps({"cycles": every, "typical": found.typical, "pose": found.pose}, indent=2))
        return
    typer.echo(f"{counted(len(found.every), 'cycle')}, each from the pose at {found.pose:.2f} s and back to it")
    typer.echo("       from [s]    to [s]  length [s]  from the others [mm]")
    for i, cycle in enumerate(found.every):
        mark, length = "*" if i == found.typical else " ", cycle.stop - cycle.start
        typer.echo(f"{mark} {i + 1:3d} {cycle.start:9.2f} {cycle.stop:9.2f} {length:11.2f} {1e3 * cycle.apart:21.1f}")
    typer.echo("* is the most typical. To follow all of them, or that one:")
    typer.echo(f"  armdesign search {shlex.quote(str(source))} --cycles all --holdout-every 4")
    typer.echo(f"  armdesign search {shlex.quote(str(source))} --cycles best")


def in_and_out(paths: list[Path]) -> tuple[Path | None, Path]:
    """Recording and output; no recording where one path is given.

    Raises:
        SettingsError: Too many paths, or an output that is no .csv.
    """
    if len(paths) > 2:
        fix = "Several files are read as one through task.files in --config"
        raise SettingsError(
            f"{len(paths)} paths are given", value=list(map(str, paths)), allowed="FILE OUT.csv", fix=fix
        )
    out = paths[-1]
    if out.suffix.lower() != ".csv":
        fix = f"Write 'armdesign recording convert {paths[0]} {paths[0].stem}-converted.csv'"
        raise SettingsError(f"the output {out} is no .csv file", value=str(out), fix=fix)
    return (paths[0] if len(paths) == 2 else None), out


def settings_of(file: Path | None, config: Path | None, given: Given) -> Settings:
    """Settings of the file and the flags, with the recording's path.

    Args:
        file: The recording on the command line; None for that in the settings.
        config: The settings file.
        given: The settings whose flags were given.
    """
    settings = settings_from_flags(config, given)
    return settings if file is None else settings.replace({"task": {"recording": str(file), "files": {}}})
