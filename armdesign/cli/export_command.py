"""``armdesign export``: robot files and trajectories of a finished run, for other tools."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from armdesign.cli.common import QuietOption, announce_compiling, one_sentence_errors
from armdesign.cli.section_flags import takes_sections
from armdesign.errors import RunFolderError
from armdesign.export.options import BodyOptions, LimitOptions, RobotOptions, SimulationOptions, TagOptions

if TYPE_CHECKING:
    from armdesign.runs.reading import FinishedRun

SECTIONS = {"tags": TagOptions, "limits": LimitOptions, "body": BodyOptions, "simulation": SimulationOptions}
FOLDER = "export"
"""Folder below the run that the files go to by default."""


@one_sentence_errors
@takes_sections(lambda: SECTIONS)
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
    convention: Annotated[str, typer.Option("--convention", help="DH table: modified or classic.")] = "modified",
    rate: Annotated[
        float | None, typer.Option("--rate", help="Trajectory: samples per second; default: as demonstrated.")
    ] = None,
    speed: Annotated[float, typer.Option("--speed", help="Trajectory: factor on the demonstrated speed.")] = 1.0,
    fit_limits: Annotated[
        bool, typer.Option("--fit-limits", help="Trajectory: slow down as far as the two limits below ask for.")
    ] = False,
    max_velocity: Annotated[
        float | None, typer.Option("--max-velocity", help="Trajectory: joint speed limit [rad/s].")
    ] = None,
    max_acceleration: Annotated[
        float | None, typer.Option("--max-acceleration", help="Trajectory: joint acceleration limit [rad/s^2].")
    ] = None,
    cutoff: Annotated[
        float | None, typer.Option("--cutoff", help="Trajectory: frequency that smoothing keeps by half [Hz].")
    ] = None,
    ramp: Annotated[
        float | None, typer.Option("--ramp", help="Trajectory: length of the ramps from and to rest [s].")
    ] = None,
    quiet: QuietOption = False,
    *,
    tags: TagOptions,
    limits: LimitOptions,
    body: BodyOptions,
    simulation: SimulationOptions,
) -> None:
    """Write the arm and its motion for other tools: robot files and trajectories.

    What a robot file assumes beyond the design (tubes, motors, loads) is an option below, with its default.
    """
    from armdesign.export.dh_text import check_convention  # noqa: PLC0415
    from armdesign.export.formats import FORMATS, check_places, chosen  # noqa: PLC0415
    from armdesign.export.trajectory.exporting import FILES, place_for  # noqa: PLC0415
    from armdesign.runs.reading import read_finished  # noqa: PLC0415

    wanted = robot_format if robot_format is not None or trajectory is not None else "urdf"
    kinds = [] if wanted is None else chosen(wanted, tuple(FORMATS), "--format")
    motions = [] if trajectory is None else chosen(trajectory, tuple(FILES), "--trajectory")
    check_convention(convention)
    folder = out if out is not None else run / FOLDER
    with announce_compiling(quiet):
        finished = read_finished(run)
    check_places(folder, [name for kind in kinds for name in FORMATS[kind]], overwrite=overwrite)
    for kind in motions:
        place_for(kind, folder, overwrite=overwrite)
    timing = {
        "rate": rate, "speed": speed, "fit_limits": fit_limits, "max_velocity": max_velocity,
        "max_acceleration": max_acceleration, "cutoff": cutoff, "ramp": ramp,
    }  # fmt: skip
    options = RobotOptions(body, limits, simulation, tags)
    written, notes = write_robot(finished, kinds, options, convention, folder) if kinds else ([], [])
    for kind in motions:
        path, told = write_motion(finished, kind, folder, timing, overwrite=overwrite)
        written, notes = [*written, path], [*notes, *told]
    if not quiet:
        for note in dict.fromkeys(notes):
            typer.echo(note, err=True)
        typer.echo("\n".join(["Written:", *(f"  {path}" for path in written)]))


def write_robot(
    run: FinishedRun, kinds: list[str], options: RobotOptions, convention: str, folder: Path
) -> tuple[list[Path], list[str]]:
    """Write the robot files of some kinds, once all of them are made.

    Returns:
        Their paths, and what to know about them.
    """
    from armdesign.export.formats import robot_files  # noqa: PLC0415
    from armdesign.export.robot_file import finished_robot  # noqa: PLC0415
    from armdesign.files import write_whole  # noqa: PLC0415

    robot = finished_robot(run.evaluation, run.prepared, options)
    files = {name: text for kind in kinds for name, text in robot_files(robot, kind, convention).items()}
    make_folder(folder)
    for name, text in files.items():
        write_whole(folder / name, text)
    return [folder / name for name in files], list(robot.notes)


def write_motion(
    run: FinishedRun, kind: str, folder: Path, timing: Mapping[str, object], *, overwrite: bool
) -> tuple[Path, tuple[str, ...]]:
    """Write one kind of trajectory; settings that are not given are left to the trajectory's own defaults."""
    from armdesign.export.trajectory.exporting import export_trajectory  # noqa: PLC0415

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
