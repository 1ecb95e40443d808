"""Arms by the words of the command line: a run, a DH table, a URDF, or the name of a ready-made arm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

from armdesign._types import Array
from armdesign.errors import DesignError, RunFolderError, SettingsError
from armdesign.experiments.compare.ready_made import open_ready_made, plain_name, ready_made_arms
from armdesign.experiments.compare.serial_arm import SerialArm, read_arm
from armdesign.feasibility.needs import joint_needs
from armdesign.files import read_json
from armdesign.fitness.constraints import joint_limits
from armdesign.kinematics.base_pose import BasePose
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.dh_files import read_base_pose, read_design
from armdesign.runs.folder import settings_file
from armdesign.runs.reading import read_slides
from armdesign.search.evaluation import check_design
from armdesign.search.result import Result
from armdesign.settings.sections import Body, Settings

EXAMPLE = "a run folder, a DH table, the path of a URDF, or one of the names of 'armdesign compare --list'"


@dataclass(frozen=True, eq=False)
class DesignArm:
    """A design to be compared."""

    name: str  # what to call it
    source: str  # where it was read
    table: DHTable  # the arm
    limits: Array  # joint limits, shape (n, 2) [rad]
    base: BasePose | None = None  # where its base stands in the room; None where nothing says it
    # where its joint modules sit on their axes, n of them [m]; None where nothing says it
    slides: tuple[float, ...] | None = None
    body: Body | None = None  # what its links and joints are made of; None where nothing says it
    # stated limits of its joints' speeds, shape (n,) [rad/s; m/s]; None where nothing says it
    speeds: Array | None = None

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return self.table.dof

    @property
    def length(self) -> float:
        """Length L [m]."""
        return self.table.length


Arm: TypeAlias = "DesignArm | SerialArm"


def open_arms(
    given: Sequence[str | Path | Result | Arm], settings: Settings, tools: Sequence[str] = ()
) -> list[DesignArm | SerialArm]:
    """Open the arms to compare; those of one name are called as they were given.

    Args:
        given: Run folders, files, names of ready-made arms, results, or arms already open.
        settings: The settings; designs that carry none of their own have its joint limits.
        tools: Tool links, as LINK for every URDF given by its path or as ARM=LINK for one of ``given``.

    Raises:
        DesignError: One of them cannot be read; the message says why.
        SettingsError: No arm is given, one is given twice, or a tool is for none of them.
    """
    if not given:
        raise SettingsError("no arm is given", allowed=EXAMPLE)
    texts = [str(arm) for arm in given if isinstance(arm, str | Path)]
    for text in texts:
        if texts.count(text) > 1:
            raise SettingsError(f"'{text}' is given twice", value=text, fix="Leave one out")
    links = tool_links(texts, tools)
    arms: list[DesignArm | SerialArm] = []
    for arm in given:
        if isinstance(arm, Result):
            place = str(arm.folder or arm.name)
            own = arm.problem.settings
            rest = arm.base_pose, arm.known_slides, own.body, joint_needs(own).speed
            arms.append(DesignArm(arm.name, place, arm.table, arm.limits, *rest))
        elif isinstance(arm, str | Path):
            arms.append(open_arm(str(arm), settings, links.get(str(arm))))
        else:
            arms.append(arm)
    names = [arm.name for arm in arms]
    return [
        replace(arm, name=str(text)) if isinstance(text, str | Path) and names.count(arm.name) > 1 else arm
        for text, arm in zip(given, arms, strict=True)
    ]


def tool_links(texts: Sequence[str], tools: Sequence[str]) -> dict[str, str]:
    """The tool's link by arm.

    Raises:
        SettingsError: A tool is for none of the arms.
    """
    links: dict[str, str] = {}
    for tool in tools:
        arm, sign, link = tool.rpartition("=")
        meant = [arm] if sign else [text for text in texts if is_urdf(text)]
        if not link or not set(meant) <= set(texts) or not meant:
            raise SettingsError(
                f"--tool {tool} is for none of the arms given", value=tool,
                allowed="LINK where a URDF is given by its path, or ARM=LINK with an ARM as it is given",
            )  # fmt: skip
        links |= dict.fromkeys(meant, link)
    return links


def open_arm(text: str, settings: Settings, tool: str | None = None) -> DesignArm | SerialArm:
    """Open one arm.

    Args:
        text: A run folder, a file or a name.
        settings: The settings; a design that carries none of its own has its joint limits.
        tool: The tool's link, of a URDF.

    Raises:
        DesignError: It cannot be read; the message says why.
        SettingsError: It is no URDF and has a tool, or its settings are not allowed.
    """
    path = Path(text)
    holds_design = path.is_dir() and (path / "result.json").is_file()
    if plain_name(text) in ready_made_arms() and not path.is_file() and not holds_design:
        return open_ready_made(text, tool)
    if is_urdf(text):
        return read_arm(path, tool=tool, name=path.stem)
    if tool is not None:
        raise SettingsError(f"--tool is for URDFs, '{text}' is none", value=tool)
    if path.is_dir() and not holds_design:
        fix = f"Finish the search first: armdesign search --resume {text}" if settings_file(path).exists() else None
        raise DesignError(f"{text} holds no result: result.json is missing", value=text, fix=fix)
    if not path.exists():
        if len(path.parts) > 1 or path.suffix:
            raise DesignError(f"there is no run folder or file {text}", value=text, fix="Check the path")
        return open_ready_made(text)
    return open_design(path, settings)


def is_urdf(text: str) -> bool:
    """Whether a path is one of a URDF, by its ending or its content."""
    path = Path(text)
    if path.suffix.lower() in (".urdf", ".xacro", ".xml"):
        return True
    try:
        return path.is_file() and path.open("rb").read(200).lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<")
    except OSError:
        return False


def open_design(path: Path, settings: Settings) -> DesignArm:
    """A design with the joint limits of its own search, else with those of the settings.

    Raises:
        DesignError: It cannot be read.
        SettingsError: Its joint limits do not fit its joints.
    """
    table = read_design(path)
    check_design(table)
    carried = carried_settings(path, ("design", "body", "needs"))
    own, speeds = carried or settings, None if carried is None else joint_needs(carried).speed
    limits = joint_limits(replace(own.design, dof=table.dof, joints=table.joints))
    name = path.resolve().name if path.name != "result.json" else path.resolve().parent.name
    slides = read_slides(content_of(path), path, table.dof)
    return DesignArm(name, str(path), table, limits, read_base_pose(path), slides, own.body, speeds)


def content_of(path: Path) -> dict[str, Any]:
    """What the result.json of a run says; nothing for what is no run, such as a plain DH table."""
    try:
        return read_json(path / "result.json" if path.is_dir() else path)
    except RunFolderError:
        return {}


def carried_settings(path: Path, sections: Sequence[str] | None = None) -> Settings | None:
    """The settings in the result.json of a run; None for what is no run, such as a plain DH table.

    Args:
        path: The run folder or its result.json.
        sections: Those that are looked at; all by default.

    Raises:
        SettingsError: One is unknown or not allowed.
    """
    carried = content_of(path).get("settings")
    if not isinstance(carried, Mapping):
        return None
    kept = {name: entries for name, entries in carried.items() if sections is None or name in sections}
    try:
        return Settings().replace(kept)
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}", value=error.value) from error
