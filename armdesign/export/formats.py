"""The kinds of robot file: their names, what each is called in a folder, and how it is written."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from armdesign.errors import RunFolderError, SettingsError
from armdesign.export.dh_text import dh_csv, dh_toml
from armdesign.export.mjcf import robot_mjcf
from armdesign.export.planning import (
    controllers_yaml,
    joint_limits_yaml,
    kinematics_yaml,
    moveit_controllers_yaml,
    robot_srdf,
)
from armdesign.export.robot_file import Robot
from armdesign.export.sdf import robot_sdf
from armdesign.export.urdf import CONTROLLERS, robot_urdf
from armdesign.export.xacro import robot_xacro, robot_xacro_macro

FORMATS: dict[str, tuple[str, ...]] = {
    "urdf": ("arm.urdf",),
    "xacro": ("arm.xacro", "arm_macro.xacro"),
    "mjcf": ("arm.xml",),
    "sdf": ("arm.sdf",),
    "srdf": ("arm.srdf",),
    "moveit": ("joint_limits.yaml", "kinematics.yaml", "moveit_controllers.yaml"),
    "controllers": (CONTROLLERS,),
    "dh-csv": ("dh.csv",),
    "dh-toml": ("dh.toml",),
}
"""Kinds of robot file, and the names of their files."""


def robot_files(robot: Robot, kind: str, convention: str = "modified") -> dict[str, str]:
    """The files of one kind by name.

    Args:
        robot: The robot.
        kind: One of ``FORMATS``.
        convention: ``modified`` or ``classic``, for DH tables.

    Raises:
        SettingsError: There is no such kind or convention.
    """
    names = FORMATS[chosen(kind, tuple(FORMATS), "--format")[0]]
    if kind == "xacro":
        return dict(zip(names, (robot_xacro(robot, names[1]), robot_xacro_macro(robot)), strict=True))
    if kind in ("dh-csv", "dh-toml"):
        writer = dh_csv if kind == "dh-csv" else dh_toml
        return {names[0]: writer(robot.table, convention)}
    if kind == "moveit":
        texts = joint_limits_yaml(robot), kinematics_yaml(robot), moveit_controllers_yaml(robot)
        return dict(zip(names, texts, strict=True))
    writers = {
        "urdf": robot_urdf, "mjcf": robot_mjcf, "sdf": robot_sdf, "srdf": robot_srdf, "controllers": controllers_yaml,
    }  # fmt: skip
    return {names[0]: writers[kind](robot)}


def chosen(text: str, known: Sequence[str], flag: str) -> list[str]:
    """The names in a comma-separated list, each once, in their order.

    Raises:
        SettingsError: One is unknown, or there is none.
    """
    names = list(dict.fromkeys(name.strip().lower() for name in text.split(",") if name.strip()))
    for name in names or [text]:
        if name not in known:
            raise SettingsError(f"{flag} is {name!r}", value=name, allowed=list(known))
    return names


def check_places(folder: Path, names: Sequence[str], *, overwrite: bool) -> None:
    """See that files can go into a folder before any is written.

    Raises:
        RunFolderError: The folder is a file, a name in it is taken by a folder, or, without ``overwrite``, by a file.
    """
    above = next((part for part in (folder, *folder.parents) if part.exists()), None)
    if above is not None and not above.is_dir():
        fix = "Name a folder with --out"
        raise RunFolderError(f"the output {folder} cannot be a folder: {above} is a file", value=str(above), fix=fix)
    for path in (folder / name for name in names):
        if path.is_dir():
            fix = "Remove it, or name another folder with --out"
            raise RunFolderError(f"the output {path} is a folder, it should become a file", value=str(path), fix=fix)
        if path.exists() and not overwrite:
            fix = "Name another folder with --out, or add --overwrite"
            raise RunFolderError(f"{path} is there already", value=str(path), fix=fix)
