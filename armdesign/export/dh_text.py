"""The DH table as a file that ``armdesign evaluate`` reads back to the last bit, modified or classic."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from armdesign.errors import SettingsError
from armdesign.export.xml_text import number
from armdesign.kinematics.dh import DHTable

CONVENTIONS = ("modified", "classic")
COLUMNS = ("alpha", "a", "d", "theta")
FORMULAS = {
    "modified": "T_i = Rx(alpha_i) Tx(a_i) Tz(d_i) Rz(theta_i + q_i), after Rz(base_yaw); the tool row is fixed",
    "classic": "A_i = Rz(theta_i + q_i) Tz(d_i) Tx(a_i) Rx(alpha_i); the rows base and tool are fixed",
}

Row = tuple[str, Sequence[float]]
"""A label, 0..n, base or tool, and alpha, a, d, theta [rad, m, m, rad]."""


def check_convention(convention: str) -> None:
    """Refuse a convention that is none.

    Raises:
        SettingsError: There is no such convention.
    """
    if convention not in CONVENTIONS:
        raise SettingsError(f"--convention is {convention!r}", value=convention, allowed=list(CONVENTIONS))


def dh_rows(table: DHTable, convention: str = "modified") -> list[Row]:
    """The rows of a table with their labels.

    Modified: a row per joint, then the tool. Classic: the base, a row per joint, the tool; the two fixed rows hold what
    lies before the first joint's axis and behind the last.

    Args:
        table: The arm, n joints.
        convention: ``modified`` or ``classic``.

    Raises:
        SettingsError: There is no such convention.
    """
    check_convention(convention)
    n = table.dof
    if convention == "modified":
        values = np.stack([table.alpha, table.a, table.d, table.theta], axis=1)
        return [("tool" if i == n else str(i), row) for i, row in enumerate(values.tolist())]
    joints = [(str(i), row) for i, row in enumerate(table.to_classic().rows.tolist(), start=1)]
    base = (float(table.alpha[0]), float(table.a[0]), 0.0, float(table.base_yaw))
    tool = (0.0, 0.0, float(table.d[-1]), float(table.theta[-1]))
    return [("base", base), *joints, ("tool", tool)]


def dh_csv(table: DHTable, convention: str = "modified") -> str:
    """A table as CSV, angles in radians and lengths in metres; what has no column is in comments above.

    Raises:
        SettingsError: There is no such convention.
    """
    rows = dh_rows(table, convention)
    head = [f"# {FORMULAS[convention]} [rad, m]", f"# convention: {convention}"]
    if convention == "modified":
        head.append(f"# base_yaw: {number(table.base_yaw)}")
    if any(table.prismatic):
        head.append(f"# joints: {table.joints}")
    lines = [",".join([label, *(number(value) for value in row)]) for label, row in rows]
    return "\n".join([*head, ",".join(["row", *COLUMNS]), *lines]) + "\n"


def dh_toml(table: DHTable, convention: str = "modified") -> str:
    """A table as TOML, angles in radians and lengths in metres.

    Raises:
        SettingsError: There is no such convention.
    """
    rows = dict(dh_rows(table, convention))
    lines = [f"# {FORMULAS[convention]} [rad, m]", f'convention = "{convention}"']
    if any(table.prismatic):
        lines.append(f'joints = "{table.joints}"')
    if convention == "modified":
        lines.append(f"base_yaw = {number(table.base_yaw)}")
    else:
        fixed = {name: rows.pop(name) for name in ("base", "tool")}
        lines += [f"{name} = {{ {', '.join(_entries(row))} }}" for name, row in fixed.items()]
    for label, row in rows.items():
        lines += ["", f"[[rows]]  # {label}", *_entries(row)]
    return "\n".join(lines) + "\n"


def _entries(row: Sequence[float]) -> list[str]:
    """A row as TOML entries."""
    return [f"{name} = {number(value)}" for name, value in zip(COLUMNS, row, strict=True)]
