"""``armdesign export``: robot files and trajectories of a finished run, for other tools."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from armdesign.building.build_files import BUILD_FORMATS
from armdesign.cli.command_errors import one_sentence_errors, refuse_without
from armdesign.cli.command_options import QuietOption, option
from armdesign.cli.screen import compiling, say, written_text
from armdesign.cli.setting_flags import Given, takes_settings
from armdesign.errors import SettingsError
from armdesign.export.dh_text import check_convention
from armdesign.export.export_files import SolidOptions
from armdesign.export.export_files import export as write_export
from armdesign.export.formats import FORMATS, chosen
from armdesign.export.options import LimitOptions, RobotOptions, SimulationOptions, TagOptions
from armdesign.export.trajectory.exporting import FILES, TrajectoryOptions
from armdesign.runs.reading import read_result
from armdesign.settings import Body

TRAJECTORY = "Trajectory"
FOLDER = "export"
"""Folder below the run that the files go to by default."""


@one_sentence_errors
@takes_settings(TagOptions, LimitOptions, Body, SimulationOptions, without={"kind", "module_slide"})
def export(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run folder with a result.")],
    robot_format: Annotated[
        str | None,
        option(
            "--format",
            "NAME,...",
            "Robot files, one or more of urdf, xacro, mjcf, sdf, srdf, moveit (YAML), controllers (ros2_control), "
            "dh-csv, dh-toml (default urdf, or none with --trajectory or --package); of a build its parts: "
            f"{', '.join(BUILD_FORMATS)}.",
        ),
    ] = None,
    trajectory: Annotated[
        str | None,
        option(
            "--trajectory",
            "NAME,...",
            "Trajectory files, one or more of csv, ros (ROS 2 YAML), ros2-bag, npz (default none).",
        ),
    ] = None,
    package: Annotated[
        str | None,
        option("--package", "NAME", "A ROS 2 description package: URDF, SRDF, controllers, MoveIt, launch files."),
    ] = None,
    meshes: Annotated[
        bool, option("--meshes", None, "Of a build: the URDF shows its parts' meshes, written beside it.")
    ] = False,
    printer: Annotated[
        str | None,
        option("--printer", "LxWxH", "Of a build: name the parts too large for a printer, in mm."),
    ] = None,
    out: Annotated[Path | None, option("--out", "DIR", "Folder to write to (default RUN/export).")] = None,
    overwrite: Annotated[bool, option("--overwrite", None, "Replace files of the same names.")] = False,
    convention: Annotated[
        str, option("--convention", "modified|classic", "Convention of the DH table in dh-csv and dh-toml.")
    ] = "modified",
    rate: Annotated[
        float | None,
        option("--rate", "X", "Samples per second [Hz]; default: the rate of the demonstration.", TRAJECTORY),
    ] = None,
    speed: Annotated[
        float | None,
        option("--speed", "X", "Speed of the motion as a multiple of the demonstrated one (default 1).", TRAJECTORY),
    ] = None,
    fit_limits: Annotated[
        bool,
        option(
            "--fit-limits",
            None,
            "Slow the motion down until it keeps --max-velocity and --max-acceleration.",
            TRAJECTORY,
        ),
    ] = False,
    max_velocity: Annotated[
        float | None, option("--max-velocity", "X", "Speed limit of joints that turn [rad/s].", TRAJECTORY)
    ] = None,
    max_acceleration: Annotated[
        float | None, option("--max-acceleration", "X", "Acceleration limit of joints that turn [rad/s^2].", TRAJECTORY)
    ] = None,
    cutoff: Annotated[
        float | None,
        option(
            "--cutoff",
            "X",
            "Cut-off frequency of the smoothing, which halves an oscillation of it [Hz] (default 6).",
            TRAJECTORY,
        ),
    ] = None,
    ramp: Annotated[
        float | None,
        option("--ramp", "X", "Time to start from rest, and to come to rest [s] (default 0.5).", TRAJECTORY),
    ] = None,
    quiet: QuietOption = False,
    *,
    given: Given,
) -> None:
    """Write robot files and trajectories for other tools.

    What a robot file assumes beyond the design (tubes, motors, loads) is an option below, with its default.
    """
    wanted = robot_format if any(each is not None for each in (robot_format, trajectory, package)) else "urdf"
    kinds = [] if wanted is None else chosen(wanted, (*FORMATS, *BUILD_FORMATS), "--format")
    motions = [] if trajectory is None else chosen(trajectory, tuple(FILES), "--trajectory")
    check_convention(convention)
    timing: dict[str, Any] = {
        "rate": rate, "speed": speed, "fit_limits": fit_limits, "max_velocity": max_velocity,
        "max_acceleration": max_acceleration, "cutoff": cutoff, "ramp": ramp,
    }  # fmt: skip
    if not kinds and package is None:
        robot_flags = [f"--{name.replace('_', '-')}" for section in given.values() for name in section]
        refuse_without("--format", dict.fromkeys(robot_flags, True))
    if not motions:
        refuse_without("--trajectory", {f"--{name.replace('_', '-')}": value for name, value in timing.items()})
    options = RobotOptions(
        None, LimitOptions(**given["limits"]), SimulationOptions(**given["simulation"]), TagOptions(**given["tags"])
    )
    with compiling(quiet=quiet):
        finished = read_result(run)
    refuse_for_builds(finished.problem.settings.body, given["body"])
    options = replace(options, body=replace(finished.problem.settings.body, **given["body"]))
    done = write_export(
        finished, out if out is not None else run / FOLDER, kinds, motions, options=options, convention=convention,
        timing=TrajectoryOptions(**{name: value for name, value in timing.items() if value is not None}),
        package=package, solids=SolidOptions(meshes, None if printer is None else printer_of(printer)),
        overwrite=overwrite,
    )  # fmt: skip
    if not quiet:
        for note in done.notes:
            say(note)
        typer.echo(written_text(list(done.paths)))


def refuse_for_builds(body: Body, given: Mapping[str, object]) -> None:
    """Refuse flags for sizes and masses that a build has from its parts.

    Raises:
        SettingsError: One was given, and the run is a build.
    """
    fixed = [name for name in given if not name.startswith("tool_") and name != "clearance"]
    if fixed and body.modules is not None:
        flag = f"--{fixed[0].replace('_', '-')}"
        raise SettingsError(
            f"{flag} is given for a build, whose sizes and masses are those of its parts", value=given[fixed[0]],
            fix=f"Leave {flag} out, or build it of other parts",
        )  # fmt: skip


def printer_of(text: str) -> tuple[float, float, float]:
    """Sides of what a printer takes [m].

    Args:
        text: Such as ``220x220x250``, in millimetres.

    Raises:
        SettingsError: It is none.
    """
    sides = text.lower().split("x")
    try:
        a, b, c = (float(side) * 1e-3 for side in sides)
    except ValueError:
        a = b = c = math.nan
    if not all(0.0 < side < 10.0 for side in (a, b, c)):
        raise SettingsError(f"--printer is {text!r}", value=text, allowed="three lengths in mm, such as 220x220x250")
    return a, b, c
