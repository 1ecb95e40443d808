"""Ready-made arms by short names, out of the robots that example-robot-data brings."""

from __future__ import annotations

import contextlib
import difflib
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from armdesign.errors import DesignError
from armdesign.experiments.compare.serial_arm import SerialArm, read_arm

ROBOTS = "share/example-robot-data/robots"


@dataclass(frozen=True)
class ReadyMade:
    """An arm of example-robot-data."""

    name: str  # its short name
    title: str  # maker and model
    path: str  # its URDF below the robots' folder


CATALOGUE = (
    ReadyMade("ur3", "Universal Robots UR3", "ur_description/urdf/ur3_robot.urdf"),
    ReadyMade("ur5", "Universal Robots UR5", "ur_description/urdf/ur5_robot.urdf"),
    ReadyMade("ur10", "Universal Robots UR10", "ur_description/urdf/ur10_robot.urdf"),
    ReadyMade("panda", "Franka Emika Panda with its hand", "panda_description/urdf/panda.urdf"),
    ReadyMade("kinova", "Kinova Jaco 2, 6 joints", "kinova_description/robots/kinova.urdf"),
    ReadyMade("xarm7", "UFACTORY xArm 7", "xarm_description/urdf/xarm7.urdf"),
    ReadyMade("z1", "Unitree Z1", "z1_description/urdf/z1.urdf"),
    ReadyMade("so100", "TheRobotStudio SO-100", "so_arm_description/urdf/so100.urdf"),
    ReadyMade("so101", "TheRobotStudio SO-101", "so_arm_description/urdf/so101.urdf"),
)
ALIASES = {"jaco": "kinova", "xarm": "xarm7"}


def robots_folder() -> Path | None:
    """Where example-robot-data keeps its robots; None where it is not installed."""
    places = [Path(sys.prefix) / ROBOTS]
    with contextlib.suppress(PackageNotFoundError):
        places.insert(0, Path(str(distribution("example-robot-data").locate_file(f"cmeel.prefix/{ROBOTS}"))))
    return next((place for place in places if place.is_dir()), None)


def ready_made_arms() -> dict[str, ReadyMade]:
    """The arms that the installed version has, by name."""
    folder = robots_folder()
    return {} if folder is None else {arm.name: arm for arm in CATALOGUE if (folder / arm.path).is_file()}


def plain_name(text: str) -> str:
    """A name as it is compared: SO-100 is so100, xArm is xarm7."""
    plain = "".join(letter for letter in text.lower() if letter.isalnum())
    return ALIASES.get(plain, plain)


def open_ready_made(name: str, tool: str | None = None) -> SerialArm:
    """A ready-made arm by its name.

    Args:
        name: The name; case and dashes do not count.
        tool: The link whose origin is the tool.

    Raises:
        DesignError: There is no such arm; the message lists those there are.
    """
    known, folder = ready_made_arms(), robots_folder()
    arm = known.get(plain_name(name))
    if arm is None or folder is None:
        near = difflib.get_close_matches(plain_name(name), known, n=1)
        fix = f"Did you mean {near[0]}?" if near else "Or give a run folder, a DH table or the path of a URDF"
        allowed = list(known) or "none: example-robot-data is not installed"
        raise DesignError(
            f"there is no run folder, file or ready-made arm '{name}'", value=name, allowed=allowed, fix=fix
        )
    return read_arm(folder / arm.path, tool=tool, name=arm.name)
