"""Read DH tables from files: result.json, or a table in JSON, TOML or CSV, modified or classic."""

from __future__ import annotations

import csv
import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from armdesign.errors import DesignError
from armdesign.kinematics.base_pose import MOUNTINGS, BasePose
from armdesign.kinematics.dh import DHTable

CONVENTIONS = ("modified", "classic")
COLUMNS = ("alpha", "a", "d", "theta")
LABELS = ("row", "i", "joint", "link", "name")
"""Columns of a CSV that only label its rows."""
COMMENT = re.compile(r"^#\s*(convention|base_yaw|joints)\s*:\s*(.*?)\s*$", re.MULTILINE)
"""A comment line of a CSV that says what its columns do not."""
EXAMPLE = 'rows like { "alpha": 1.57, "a": 0.3, "d": 0.0 } [rad, m]'


def read_design(path: str | Path, convention: str | None = None) -> DHTable:
    """Read an arm.

    Args:
        path: A run's result.json (or its folder), or a file with ``convention``, ``base_yaw`` and ``rows`` in JSON or
            TOML, or a CSV with the columns alpha, a, d and optionally theta [rad, m]; ``_deg`` behind an angle's name
            gives it in degrees. A modified table has n + 1 rows, the tool last; a classic one a row per joint.
        convention: ``modified`` or ``classic``; by default what the file says, else modified.

    Raises:
        DesignError: The file cannot be read, or is not a DH table; the message says where.
    """
    path = design_file(path)
    text = read_text(path)
    content = parse(path, text)
    table: Any = content.get("dh", content) if isinstance(content, Mapping) else content
    if not isinstance(table, Mapping) or not isinstance(table.get("rows"), list) or not table["rows"]:
        raise DesignError(f"{path} holds no DH table: 'rows' is missing or empty", allowed=EXAMPLE)
    stated = settle_convention(path, table.get("convention"), convention)
    rows = np.array([row_values(path, f"rows[{i}]", row) for i, row in enumerate(table["rows"])])
    yaw = number(path, "base_yaw", table.get("base_yaw", 0.0))
    joints = joint_kinds(path, table, content)
    if stated == "classic":
        if yaw != 0.0:
            raise DesignError(f"{path}: a classic table has no base_yaw", value=yaw, allowed=0)
        return with_fixed_rows(DHTable.from_classic(rows, joints), path, table)
    if len(rows) < 2:
        raise DesignError(f"{path}: a modified table needs a row per joint and a tool row, this has {len(rows)}")
    return DHTable.from_rows(rows, yaw, joints)


def joint_kinds(path: Path, table: Mapping[str, Any], content: Any) -> str:  # noqa: ANN401 (whatever the file holds)
    """The kinds of the joints, as RRPR, that a table or the result around it states; empty where all turn.

    Raises:
        DesignError: They are no text.
    """
    stated = table.get("joints", content.get("joints") if isinstance(content, Mapping) else None)
    if stated is None:
        return ""
    if not isinstance(stated, str):
        raise DesignError(f"{path}: joints is {stated!r}", value=stated, allowed="letters R and P, such as RRPR")
    return stated.strip().upper()


def read_base_pose(path: str | Path) -> BasePose | None:
    """Where the base of an arm stands in the room, out of a run's result.json; None for a file that does not say it.

    Args:
        path: The file or the run folder.

    Raises:
        DesignError: The file cannot be read, or what it says is no pose.
    """
    path = design_file(path)
    if path.suffix.lower() != ".json":
        return None
    content = parse(path, read_text(path))
    pose = content.get("base_pose") if isinstance(content, Mapping) else None
    if pose is None or (isinstance(pose, Mapping) and pose.get("frame") != "room"):
        return None
    return base_pose_of(pose, path)


def base_pose_of(pose: object, path: Path) -> BasePose:
    """A base pose as result.json holds it.

    Args:
        pose: A table of translation, rotation, mounted and frame.
        path: Where it was read, for the message.

    Raises:
        DesignError: It is none.
    """
    try:
        entries = dict(pose)  # type: ignore[call-overload]
        translation = np.array(entries["translation"], dtype=float).reshape(3)
        rotation = np.array(entries["rotation"], dtype=float).reshape(3, 3)
        mounted, frame = str(entries["mounted"]), str(entries["frame"])
    except (KeyError, TypeError, ValueError) as error:
        raise DesignError(f"{path} is damaged: 'base_pose' is {pose!r}", value=pose) from error
    turns = np.abs(rotation @ rotation.T - np.eye(3)).max() < 1e-6 and np.linalg.det(rotation) > 0.0
    if not (turns and np.isfinite(translation).all() and mounted in MOUNTINGS):
        raise DesignError(f"{path} is damaged: 'base_pose' is {pose!r}", value=pose)
    return BasePose(translation, rotation, mounted, frame)


def with_fixed_rows(table: DHTable, path: Path, content: Mapping[str, Any]) -> DHTable:
    """A classic table with what its rows ``base`` and ``tool`` put before the first axis and behind the last.

    Raises:
        DesignError: A row holds what a modified table has no place for.
    """
    base, tool = (
        [0.0] * 4 if content.get(name) is None else row_values(path, name, content[name]) for name in ("base", "tool")
    )
    for where, value in (("base.d", base[2]), ("tool.alpha", tool[0]), ("tool.a", tool[1])):
        if value != 0.0:
            raise DesignError(f"{path}: {where} is {value:g}", value=value, allowed=0)
    rows = np.stack([table.alpha, table.a, table.d, table.theta], axis=1)
    rows[0, :2], rows[-1, 2:] = base[:2], tool[2:]
    return DHTable.from_rows(rows, base[3], table.joints)


def design_file(path: str | Path) -> Path:
    """The file to read; of a run folder its result.json.

    Raises:
        DesignError: There can be no such path.
    """
    try:
        return Path(path) / "result.json" if Path(path).is_dir() else Path(path)
    except OSError as error:
        raise DesignError(f"cannot read the design {path}: {error.strerror}", value=str(path)) from error


def settle_convention(path: Path, stated: object, asked: str | None) -> str:
    """The convention of a table: what the file states, else what was asked for, else modified.

    Raises:
        DesignError: There is no such convention, or the two contradict each other.
    """
    for convention in (stated, asked):
        if convention is not None and convention not in CONVENTIONS:
            raise DesignError(f"{path}: convention is {convention!r}", value=convention, allowed=list(CONVENTIONS))
    if stated is not None and asked is not None and stated != asked:
        raise DesignError(f"{path} says that it is {stated}, but {asked} was asked for", value=asked, allowed=stated)
    return str(stated or asked or "modified")


def read_text(path: Path) -> str:
    """The file's text."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise DesignError(f"cannot read the design {path}: {error.strerror}", value=str(path)) from error
    except UnicodeDecodeError as error:
        raise DesignError(f"the design {path} is not text", allowed="JSON, TOML or CSV") from error


def parse(path: Path, text: str) -> Any:  # noqa: ANN401 (file content)
    """The file's content as plain Python values, by its form rather than its ending."""
    stripped = text.lstrip()
    try:
        if stripped.startswith(("{", "[{", "[[{")) or path.suffix.lower() == ".json":
            return json.loads(text)
        first = next((line for line in stripped.splitlines() if line and not line.startswith("#")), "")
        if "=" not in first and not first.startswith("["):
            return csv_table(path, text)
        return tomllib.loads(text)
    except json.JSONDecodeError as error:
        raise DesignError(
            f"the design {path} is not valid JSON: line {error.lineno}, column {error.colno}: {error.msg}"
        ) from error
    except tomllib.TOMLDecodeError as error:
        raise DesignError(f"the design {path} is not valid TOML: {error}") from error
    except (ValueError, RecursionError) as error:
        raise DesignError(f"the design {path} holds numbers or nesting beyond all bounds: {error}") from error


def csv_table(path: Path, text: str) -> dict[str, Any]:
    """A CSV table with a header. Comments such as ``# convention: classic`` and ``# base_yaw: 0.5`` are entries.

    A classic table's rows labelled base and tool are kept apart from those of the joints.
    """
    table: dict[str, Any] = dict(COMMENT.findall(text))
    labelled = csv_rows(path, text)
    fixed = ("base", "tool") if table.get("convention") == "classic" else ()
    table |= {label: row for label, row in labelled if label in fixed}
    table["rows"] = [row for label, row in labelled if label not in fixed]
    if fixed and not table["rows"]:
        raise DesignError(f"{path}: a classic table needs a row per joint", allowed=EXAMPLE)
    return table


def csv_rows(path: Path, text: str) -> list[tuple[str, dict[str, str]]]:
    """Label (or nothing) and cells of each row of a CSV table; lines that start with # are comments."""
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    reader = csv.DictReader(lines, skipinitialspace=True)
    names = [name.strip() for name in reader.fieldnames or ()]
    if not {"a", "d"} <= set(names):
        raise DesignError(f"{path}: the header is '{', '.join(names)}'", allowed="alpha,a,d or alpha,a,d,theta")
    unknown = [name for name in names if name not in (*allowed_names(), *LABELS)]
    if unknown:
        raise DesignError(f"{path}: unknown column '{unknown[0]}'", allowed=list(COLUMNS))
    rows = []
    for i, row in enumerate(reader):
        if None in row:
            raise DesignError(
                f"{path}: rows[{i}] has more cells than the header has columns", fix="Write decimals with a point"
            )
        cells = {name.strip(): (cell or "").strip() for name, cell in row.items()}
        label = next((cell for name, cell in cells.items() if name in LABELS), "")
        rows.append((label, {name: cell for name, cell in cells.items() if name not in LABELS}))
    return rows


def allowed_names() -> tuple[str, ...]:
    """Names a column may have."""
    return (*COLUMNS, "alpha_deg", "theta_deg")


def row_values(path: Path, where: str, row: object) -> list[float]:
    """One row as (alpha, a, d, theta) [rad, m, m, rad]."""
    if isinstance(row, (list, tuple)) and len(row) in (3, 4):
        row = dict(zip(COLUMNS, row, strict=False))
    if not isinstance(row, Mapping):
        raise DesignError(f"{path}: {where} is {row!r}", value=row, allowed=EXAMPLE)
    unknown = [name for name in row if name not in allowed_names()]
    if unknown:
        raise DesignError(f"{path}: {where} has an unknown entry '{unknown[0]}'", allowed=list(allowed_names()))
    values = []
    for name in COLUMNS:
        if f"{name}_deg" in row:
            values.append(float(np.deg2rad(number(path, f"{where}.{name}_deg", row[f"{name}_deg"]))))
        elif name in row or name == "theta":
            values.append(number(path, f"{where}.{name}", row.get(name, 0.0)))
        else:
            raise DesignError(f"{path}: {where} has no '{name}'", value=dict(row), allowed=EXAMPLE)
    return values


def number(path: Path, where: str, value: object) -> float:
    """A finite number out of a file."""
    try:
        result = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        result = float("nan")
    if not np.isfinite(result) or isinstance(value, bool):
        raise DesignError(f"{path}: {where} is {value!r}", value=value, allowed="a finite number")
    return result
