"""What the words on the command line stand for: a run, a DH table, a URDF, or the name of a ready-made arm."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TypeAlias

from armdesign.errors import DesignError, SettingsError
from armdesign.experiments.compare.comparison import Design
from armdesign.experiments.compare.ready_made import open_ready_made, plain_name, ready_made_arms
from armdesign.experiments.compare.serial_arm import SerialArm, read_arm
from armdesign.fitness.constraints import joint_limits
from armdesign.kinematics.dh_files import read_design
from armdesign.runs.folder import settings_file
from armdesign.search.evaluation import check_design
from armdesign.settings.sections import Settings

Entrant: TypeAlias = "Design | SerialArm"
EXAMPLE = "a run folder, a DH table, the path of a URDF, or one of the names of 'armdesign compare --list'"


def open_entrants(texts: Sequence[str], settings: Settings, tools: Sequence[str] = ()) -> list[Entrant]:
    """Open all that take part.

    Args:
        texts: Run folders, files or names.
        settings: The settings; designs that carry none of their own have its joint limits.
        tools: Tool links, as LINK for every URDF given by its path or as ARM=LINK for one of ``texts``.

    Raises:
        DesignError: One of them cannot be read; the message says why.
        SettingsError: One is named twice, or a tool is for none of them.
    """
    if not texts:
        raise SettingsError("no arm is given", allowed=EXAMPLE)
    for text in texts:
        if texts.count(text) > 1:
            raise SettingsError(f"'{text}' is given twice", value=text, fix="Leave one out")
    chosen = tool_links(texts, tools)
    entrants = [open_entrant(text, settings, chosen.get(text)) for text in texts]
    names = [entrant.name for entrant in entrants]
    return [
        replace(entrant, name=text) if names.count(entrant.name) > 1 else entrant
        for text, entrant in zip(texts, entrants, strict=True)
    ]


def tool_links(texts: Sequence[str], tools: Sequence[str]) -> dict[str, str]:
    """The tool's link by entrant.

    Raises:
        SettingsError: A tool is for none of the entrants.
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


def open_entrant(text: str, settings: Settings, tool: str | None = None) -> Entrant:
    """Open one of them.

    Raises:
        DesignError: It cannot be read; the message says why.
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


def open_design(path: Path, settings: Settings) -> Design:
    """A design with the joint limits of its own search, else with those of the settings.

    Raises:
        DesignError: It cannot be read.
        SettingsError: Its joint limits do not fit its joints.
    """
    table = read_design(path)
    check_design(table)
    carried = settings_in(path)
    own = settings if carried is None else study_in(path, {"design": carried.get("design", {})})
    limits = joint_limits(replace(own.design, dof=table.dof))
    name = path.resolve().name if path.name != "result.json" else path.resolve().parent.name
    return Design(name, str(path), table, limits)


def study_in(path: Path, carried: Mapping[str, Mapping[str, object]]) -> Settings:
    """The settings that a result.json carries, checked.

    Raises:
        SettingsError: One is unknown or not allowed.
    """
    try:
        return Settings().replace(carried)
    except SettingsError as error:
        raise SettingsError(f"{path}: {error}", value=error.value) from error


def settings_in(path: Path) -> Mapping[str, Mapping[str, object]] | None:
    """The settings that a result.json carries; None for a plain DH table."""
    file = path / "result.json" if path.is_dir() else path
    try:
        content = json.loads(file.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return None
    settings = content.get("settings") if isinstance(content, dict) else None
    return settings if isinstance(settings, dict) else None
