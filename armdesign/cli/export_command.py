"""``armdesign export``: robot files and trajectories of a finished run, for other tools."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from armdesign.cli.command_errors import one_sentence_errors, refuse_without
from armdesign.cli.command_options import QuietOption
from armdesign.cli.screen import announce_compiling, say, written_text
from armdesign.cli.setting_flags import Given, takes_settings
from armdesign.errors import RunFolderError
from armdesign.export.dh_text import check_convention
from armdesign.export.formats import FORMATS, check_places, chosen, robot_files
from armdesign.export.options import BodyOptions, LimitOptions, RobotOptions, SimulationOptions, TagOptions
from armdesign.export.robot_file import finished_robot
from armdesign.export.trajectory.exporting import FILES, export_trajectory, place_for
from armdesign.files import write_whole
from armdesign.runs.reading import read_result
from armdesign.search.result import Result

TRAJECTORY = "Trajectory"
FOLDER = "export"
"""Folder below the run that the files go to by default."""


@one_sentence_errors
@takes_settings(TagOptions, LimitOptions, BodyOptions, SimulationOptions)
def export(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder with a result.")],
    robot_format: Annotated[
        str | None,
        typer.Option(
            "--format",
            help="Robot files, by commas: urdf, xacro, mjcf, sdf, dh-csv, dh-toml; default: urdf, "
            "where no trajectory is asked for.",
        ),
    ] = None,
    trajectory: Annotated[
        str | None,
        typer.Option("--trajectory", help="Trajectories, by commas: csv, ros (ROS 2 YAML), ros2-bag, npz."),
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="Folder to write to; default: RUN/export.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace files of the same names.")] = False,
    convention: Annotated[
        str, typer.Option("--convention", metavar="modified|classic", help="Convention of the DH table.")
    ] = "modified",
    rate: Annotated[
        float | None,
        typer.Option(
            "--rate", metavar="X", rich_help_panel=TRAJECTORY, help="Samples per second; default: as demonstrated."
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            "--speed", metavar="X", rich_help_panel=TRAJECTORY, help="Factor on the demonstrated speed (default 1)."
        ),
    ] = None,
    fit_limits: Annotated[
        bool,
        typer.Option(
            "--fit-limits", rich_help_panel=TRAJECTORY, help="Slow down as far as the two limits below ask for."
        ),
    ] = False,
    max_velocity: Annotated[
        float | None,
        typer.Option("--max-velocity", metavar="X", rich_help_panel=TRAJECTORY, help="Joint speed limit [rad/s]."),
    ] = None,
    max_acceleration: Annotated[
        float | None,
        typer.Option(
            "--max-acceleration", metavar="X", rich_help_panel=TRAJECTORY, help="Joint acceleration limit [rad/s^2]."
        ),
    ] = None,
    cutoff: Annotated[
        float | None,
        typer.Option(
            "--cutoff", metavar="X", rich_help_panel=TRAJECTORY, help="Frequency that smoothing keeps by half [Hz]."
        ),
    ] = None,
    ramp: Annotated[
        float | None,
        typer.Option(
            "--ramp", metavar="X", rich_help_panel=TRAJECTORY, help="Length of the ramps from and to rest [s]."
        ),
    ] = None,
    quiet: QuietOption = False,
    *,
    given: Given,
) -> None:
    """Write robot files and trajectories for other tools.

    What a robot file assumes beyond the design (tubes, motors, loads) is an option below, with its default.
    """
    wanted = robot_format if robot_format is not None or trajectory is not None else "urdf"
    kinds = [] if wanted is None else chosen(wanted, tuple(FORMATS), "--format")
    motions = [] if trajectory is None else chosen(trajectory, tuple(FILES), "--trajectory")
    check_convention(convention)
    timing = {
        "rate": rate, "speed": speed, "fit_limits": fit_limits or None, "max_velocity": max_velocity,
        "max_acceleration": max_acceleration, "cutoff": cutoff, "ramp": ramp,
    }  # fmt: skip
    if not kinds:
        options_given = [name for section in given.values() for name in section]
        refuse_without("--format", {f"--{name.replace('_', '-')}": name for name in options_given})
    if not motions:
        refuse_without("--trajectory", {f"--{name.replace('_', '-')}": value for name, value in timing.items()})
    folder = out if out is not None else run / FOLDER
    with announce_compiling(quiet):
        finished = read_result(run)
    check_places(folder, [name for kind in kinds for name in FORMATS[kind]], overwrite=overwrite)
    for kind in motions:
        place_for(kind, folder, overwrite=overwrite)
    options = RobotOptions(
        BodyOptions(**given["body"]),
        LimitOptions(**given["limits"]),
        SimulationOptions(**given["simulation"]),
        TagOptions(**given["tags"]),
    )
    written, notes = write_robot(finished, kinds, options, convention, folder) if kinds else ([], [])
    for kind in motions:
        path, more = write_motion(finished, kind, folder, timing, overwrite=overwrite)
        written, notes = [*written, path], [*notes, *more]
    if not quiet:
        for note in dict.fromkeys(notes):
            say(note)
        typer.echo(written_text(written))


def write_robot(
    run: Result, kinds: list[str], options: RobotOptions, convention: str, folder: Path
) -> tuple[list[Path], list[str]]:
    """Write the robot files of some kinds, once all of them are made.

    Returns:
        Their paths, and what to know about them.
    """
    robot = finished_robot(run, options)
    files = {name: text for kind in kinds for name, text in robot_files(robot, kind, convention).items()}
    make_folder(folder)
    for name, text in files.items():
        write_whole(folder / name, text)
    return [folder / name for name in files], list(robot.notes)


def write_motion(
    run: Result, kind: str, folder: Path, timing: Mapping[str, object], *, overwrite: bool
) -> tuple[Path, tuple[str, ...]]:
    """Write one kind of trajectory; settings that are not given are left to the trajectory's own defaults."""
    given = {name: value for name, value in timing.items() if value is not None}
    done = export_trajectory(run, kind, folder, overwrite=overwrite, **given)  # type: ignore[arg-type]
    return done.path, done.notes


def make_folder(folder: Path) -> None:
    """Make a folder.

    Raises:
        RunFolderError: It cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunFolderError(
            f"cannot write to the output folder {folder}: {error.strerror}", value=str(folder),
            fix="Name a folder you may write to with --out",
        ) from error  # fmt: skip
