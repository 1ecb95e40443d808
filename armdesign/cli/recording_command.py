"""``armdesign recording``: look at a recording, draw it, convert it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from armdesign.cli.common import ConfigOption, one_sentence_errors, refuse_existing, settings_from_flags
from armdesign.cli.recordings_asked import named_source, read_demonstration
from armdesign.cli.task_flags import NO_FLAGS, MirrorOption, TaskFlags, UnitsOption, UpOption, takes_task_flags
from armdesign.errors import SettingsError

if TYPE_CHECKING:
    from armdesign.demonstration import Recording
    from armdesign.settings.sections import Settings

app = typer.Typer(
    name="recording",
    help="Look at a recording, draw it, or convert it to plain CSV.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

FileArgument = Annotated[
    Path | None, typer.Argument(metavar="FILE", help="The recording, in any known format; or name it in --config.")
]
ReplaceOption = Annotated[bool, typer.Option("--overwrite", help="Replace what is there.")]


@app.command()
@one_sentence_errors
def info(
    file: FileArgument = None,
    config: ConfigOption = None,
    units: UnitsOption = None,
    up: UpOption = None,
    mirror: MirrorOption = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print it as JSON.")] = False,
) -> None:
    """Say what a recording holds: rate, length, units, points and bodies with their gaps, and arms by their names."""
    from armdesign.demonstration.summary import summarise, summary_text  # noqa: PLC0415

    summary = summarise(opened(file, config, {"units": units, "up": up, "mirror": mirror}))
    typer.echo(json.dumps(summary.to_dict(), indent=2) if as_json else summary_text(summary))


@app.command()
@one_sentence_errors
def plot(
    file: FileArgument = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Picture to write, .png, .svg or .pdf; default: FILE's name with .png.")
    ] = None,
    config: ConfigOption = None,
    units: UnitsOption = None,
    up: UpOption = None,
    mirror: MirrorOption = None,
    overwrite: ReplaceOption = False,
) -> None:
    """Draw the paths of all points from three sides, and when which of them was not seen."""
    from armdesign.demonstration.picture import check_kind, draw_recording  # noqa: PLC0415
    from armdesign.files import write_whole  # noqa: PLC0415

    settings = settled(file, config, {"units": units, "up": up, "mirror": mirror})
    target = out or Path(f"{named_source(settings, 'recording plot').stem}.png")
    kind = check_kind(target.suffix.lower().lstrip("."))
    refuse_existing(target, overwrite=overwrite)
    write_whole(target, draw_recording(read_demonstration(settings), kind))
    typer.echo(f"Written: {target}")


@app.command()
@one_sentence_errors
@takes_task_flags
def convert(
    paths: Annotated[
        list[Path], typer.Argument(metavar="FILE OUT.csv", help="The recording, and the plain CSV file to write.")
    ],
    config: ConfigOption = None,
    task: TaskFlags = NO_FLAGS,
    overwrite: ReplaceOption = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Do not say what was done.")] = False,
) -> None:
    """Write the points of a task as plain CSV: cleaned, in metres, z up; what was done goes to OUT.task.json.

    A search on it has the same task as one on the recording itself with the same flags. The orientation is written if
    --orientation asks for it. With the recording named in --config, OUT.csv is enough.
    """
    from armdesign.demonstration.convert import convert as converted  # noqa: PLC0415
    from armdesign.demonstration.convert import task_json_beside, write_conversion  # noqa: PLC0415

    file, out = in_and_out(paths)
    settings = settled(file, config, task.changes())
    named_source(settings, "recording convert")
    if settings.task.base_mode != "shoulder":
        fix = "Give --base-mode to the search on what is written"
        raise SettingsError("the points are written where they are in the room, whatever the base mode", fix=fix)
    refuse_existing(out, task_json_beside(out), overwrite=overwrite)
    conversion = converted(read_demonstration(settings), settings)
    written = write_conversion(out, conversion)
    if not quiet:
        typer.echo("\n".join(conversion.notes), err=True)
        typer.echo("Written: " + ", ".join(map(str, written)))


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


def settled(file: Path | None, config: Path | None, changes: dict[str, Any]) -> Settings:
    """Settings of the file and the flags, with the recording's path."""
    settings = settings_from_flags(config, {"task": changes})
    return settings if file is None else settings.replace({"task": {"recording": str(file), "files": {}}})


def opened(file: Path | None, config: Path | None, changes: dict[str, Any]) -> Recording:
    """The recording in metres with z up."""
    settings = settled(file, config, changes)
    named_source(settings, "recording info")
    return read_demonstration(settings)
