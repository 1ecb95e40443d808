"""Robot files and trajectories of a result, for other tools, in a folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from armdesign.building.build_files import BUILD_FORMATS, mesh_files, mesh_places, printing_notes
from armdesign.building.record import recorded_build
from armdesign.errors import RunFolderError, SettingsError
from armdesign.export.dh_text import check_convention
from armdesign.export.formats import FORMATS, check_places, chosen, robot_files
from armdesign.export.options import RobotOptions
from armdesign.export.robot_file import finished_robot
from armdesign.export.ros_package import check_package_name, ros_package
from armdesign.export.servos import lag_note
from armdesign.export.trajectory.exporting import FILES, TrajectoryOptions, make_trajectory, place_for, write_trajectory
from armdesign.export.trajectory.ros2_bag import typestore
from armdesign.export.urdf import HARDWARE
from armdesign.export.urdf_check import check_urdf
from armdesign.files import write_whole
from armdesign.search.result import Result


@dataclass(frozen=True)
class SolidOptions:
    """What is asked of the parts of a build.

    Attributes:
        meshes: Whether the URDF shows their meshes instead of cylinders, and they are written beside it.
        printer: Sides of what a printer takes, whose exceptions are named [m]; None for no such note.
    """

    meshes: bool = False
    printer: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Export:
    """What was written.

    Attributes:
        paths: The files, and the folders of ROS 2 bags.
        notes: What to know about them, one sentence each.
    """

    paths: tuple[Path, ...]
    notes: tuple[str, ...]


def export(
    result: Result,
    folder: str | Path,
    formats: str | Sequence[str] = ("urdf",),
    trajectories: str | Sequence[str] = (),
    *,
    options: RobotOptions | None = None,
    convention: str = "modified",
    timing: TrajectoryOptions | None = None,
    package: str | None = None,
    solids: SolidOptions | None = None,
    overwrite: bool = False,
) -> Export:
    """Write robot files and trajectories of a result; all is made and checked before the first is written.

    Args:
        result: The arm with its motion.
        folder: Where to; made where it is missing.
        formats: Robot files: ``urdf``, ``xacro``, ``mjcf``, ``sdf``, ``srdf``, ``moveit``, ``controllers``, ``dh-csv``,
            ``dh-toml``, and of builds ``step``, ``stl``; a list, or by commas. With ros2_control for Gazebo the
            controllers come along.
        trajectories: Trajectories: ``csv``, ``ros`` (ROS 2 YAML), ``ros2-bag``, ``npz``; a list, or by commas.
        options: What the robot files assume beyond the design.
        convention: Of the DH tables, ``modified`` or ``classic``.
        timing: How the trajectories are smoothed, timed and sampled.
        package: Name of a ROS 2 package to write into a folder of that name.
        solids: What is asked of the parts of a build.
        overwrite: Whether files of the same names are replaced.

    Raises:
        SettingsError: A kind or convention is unknown, or an option is out of range.
        RunFolderError: A file cannot be written, or is there already; or parts of what is no build were asked for.
        CatalogueError: The parts of a build do not fit.
        MissingExtraError: A bag was asked for, and rosbags is not installed, or solids, and Open CASCADE is not.
        DesignError: The URDF does not read back as the arm, as after a change of its template.
    """
    place = Path(folder)
    wanted = names(formats, (*FORMATS, *BUILD_FORMATS), "the format")
    motions = names(trajectories, tuple(FILES), "the trajectory")
    check_convention(convention)
    kinds, of_parts = [kind for kind in wanted if kind in FORMATS], [kind for kind in wanted if kind in BUILD_FORMATS]
    ask = solids or SolidOptions()
    if ask.meshes and "urdf" not in kinds:
        raise SettingsError("meshes go into the URDF, which is not asked for", value=wanted, fix="Add urdf to --format")
    build = recorded_build(result) if of_parts or ask != SolidOptions() else None
    hardware = (options or RobotOptions()).tags.ros2_control
    if hardware in ("gazebo", HARDWARE["gazebo"]) and {"urdf", "xacro"} & set(kinds) and "controllers" not in kinds:
        kinds.append("controllers")
    check_places(place, [name for kind in kinds for name in FORMATS[kind]], overwrite=overwrite)
    if package is not None:
        check_places(place, [f"{check_package_name(package)}/package.xml"], overwrite=overwrite)
    places = {kind: place_for(kind, place, overwrite=overwrite) for kind in motions}
    if "ros2-bag" in motions:
        typestore()
    files: dict[str, str | bytes] = {}
    notes: list[str] = []
    if build is not None:
        for kind in of_parts:
            files |= BUILD_FORMATS[kind](build)
        files |= mesh_files(build) if ask.meshes else {}
        check_places(place, list(files), overwrite=overwrite)
        notes += [build.warning] if build.warning else []
        notes += [] if ask.printer is None else printing_notes(build, ask.printer)
    if kinds or package is not None:
        robot = finished_robot(result, options, timing)
        if build is not None and ask.meshes:
            robot = replace(robot, meshes=mesh_places(build))
        made = {name: text for kind in kinds for name, text in robot_files(robot, kind, convention).items()}
        for name in FORMATS["urdf"]:
            if name in made:
                check_urdf(made[name], robot)
        files |= made
        notes += [*robot.notes, *([lag_note(robot)] if "mjcf" in kinds else [])]
        if package is not None:
            packed = ros_package(replace(robot, meshes={}), package)
            check_urdf(packed[f"urdf/{robot.name}.urdf"], robot)
            files |= {f"{package}/{name}": text for name, text in packed.items()}
    trajectory = make_trajectory(result, timing) if motions else None
    try:
        place.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunFolderError(
            f"cannot write to the output folder {place}: {error.strerror}", value=str(place),
            fix="Name a folder you may write to with --out",
        ) from error  # fmt: skip
    for name, text in files.items():
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        write_whole(place / name, text)
    if trajectory is not None:
        for kind, where in places.items():
            write_trajectory(trajectory, kind, where, overwrite=overwrite)
        notes += trajectory.notes
    return Export((*(place / name for name in files), *places.values()), tuple(dict.fromkeys(notes)))


def names(wanted: str | Sequence[str], known: tuple[str, ...], what: str) -> list[str]:
    """The kinds asked for, each once; nothing where nothing is.

    Raises:
        SettingsError: One is unknown.
    """
    text = wanted if isinstance(wanted, str) else ",".join(wanted)
    return chosen(text, known, what) if text else []
