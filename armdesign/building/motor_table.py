"""Motors with gearboxes as the Motor-Gearbox Database (MGDB) lists them: three CSV files in SI units beside each other.

``NAME_motors.csv`` has the motors, ``NAME_gearboxes.csv`` the gearboxes, ``NAME_compatibility.csv`` in each line a
motor's key and those of the gearboxes that go on it, with * for any ending. Without the last two the motors drive their
joints directly. Of housings MGDB has nothing: columns ``diameter`` and ``length`` [m] have to be added to both tables.

With a gearbox of ratio i and efficiency eta, of a motor with torque constant k_t, resistance R and voltage V:

    rated torque    min(i eta k_t I_nom, what the gearbox bears continuously)
    peak torque     min(i eta k_t V / R, i eta max_int_torque, what the gearbox bears for a time)
    speed           omega_nl (1 - tau_motor R / (k_t V)) / i
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from armdesign.errors import CatalogueError

MOTORS = ("key", "manufacturer", "V", "k_t", "R", "mass", "inertia", "omega_nl", "I_nom")
GEARBOXES = ("key", "ratio", "mass", "inertia", "efficiency", "max_int_torque", "max_cont_torque")
"""Columns that are needed, as MGDB names them; of those that may be there are also max_int_torque, max_int_speed and
max_cont_speed of motors."""
ENDING = "_motors.csv"
DIRECT = {"key": "", "ratio": "1", "mass": "0", "inertia": "0", "efficiency": "1"}
"""In place of a gearbox where there is none."""


def motor_table(path: Path) -> dict[str, Any]:
    """Motors and their gearboxes, laid out as a catalogue's TOML file.

    Args:
        path: Of the motors.

    Raises:
        CatalogueError: The files cannot be read, or are no such tables.
    """
    motors = rows_of(path, MOTORS)
    stem = path.name.removesuffix(ENDING)
    gears, pairs = (path.with_name(f"{stem}_{kind}.csv") for kind in ("gearboxes", "compatibility"))
    geared = path.name.endswith(ENDING) and gears.is_file() and pairs.is_file()
    entries = []
    for motor, gear in combinations_of(motors, gears, pairs) if geared else ((m, DIRECT) for m in motors):
        entries.append(entry_of(motor, gear, path))
    figures = sorted({name for entry in entries for name in entry} - {"name"})
    return {
        "family": stem or path.stem,
        "maker": ", ".join(sorted({motor["manufacturer"] for motor in motors})),
        "units": {"torque": "N m", "speed": "rad/s", "mass": "kg", "length": "m"},
        "source": [{"document": f"{path.name}, laid out as MGDB", "date": "as the file has it", "figures": figures}],
        "actuator": entries,
    }


def rows_of(path: Path, needed: tuple[str, ...]) -> list[dict[str, str]]:
    """The rows of a table by its columns.

    Args:
        path: The file.
        needed: Columns that it has to have.

    Raises:
        CatalogueError: It cannot be read, lacks a column, or is empty.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = [{str(k).strip(): str(v or "").strip() for k, v in row.items()} for row in csv.DictReader(file)]
    except (OSError, UnicodeError, csv.Error) as error:
        raise CatalogueError(f"cannot read the motor table {path}: {error}", value=str(path)) from error
    lacking = [name for name in needed if not rows or name not in rows[0]]
    if lacking:
        raise CatalogueError(
            f"{path.name} lacks {', '.join(lacking)}, which MGDB's tables have", value=lacking, allowed=needed
        )
    return rows


def combinations_of(
    motors: list[dict[str, str]], gears: Path, pairs: Path
) -> Iterator[tuple[Mapping[str, str], Mapping[str, str]]]:
    """Every motor with every gearbox that goes on it.

    Args:
        motors: The motors; those for which there is none are left out.
        gears: File of the gearboxes.
        pairs: File that says which goes on which.
    """
    boxes = rows_of(gears, GEARBOXES)
    with pairs.open(encoding="utf-8-sig", newline="") as file:
        fitting = {row[0].strip(): [key.strip() for key in row[1:] if key.strip()] for row in csv.reader(file) if row}
    for motor in motors:
        found = [box for box in boxes if any(fnmatchcase(box["key"], key) for key in fitting.get(motor["key"], ()))]
        yield from ((motor, box) for box in found)


def entry_of(motor: Mapping[str, str], gear: Mapping[str, str], path: Path) -> dict[str, Any]:
    """A motor with a gearbox as the table of an actuator, without what is not known.

    Args:
        motor: The motor's row.
        gear: The gearbox's.
        path: Of the motors, for messages.

    Raises:
        CatalogueError: A figure is no number.
    """
    name = " + ".join(filter(None, (motor["key"], gear["key"])))

    def figure(row: Mapping[str, str], column: str, unknown: float = math.nan) -> float:
        """A figure; ``unknown`` where it is empty, nan or missing."""
        text = row.get(column, "") or "nan"
        try:
            value = float(text)
        except ValueError as error:
            raise CatalogueError(
                f"{path.name}: '{column}' of {row['key']} is {text!r}", value=text, allowed="a number, nan or inf"
            ) from error
        return unknown if math.isnan(value) else value

    geared = gear is not DIRECT
    k_t, voltage, ohms = (figure(motor, column) for column in ("k_t", "V", "R"))
    gain = figure(gear, "ratio") * figure(gear, "efficiency")
    stall = k_t * voltage / ohms if ohms > 0.0 else math.nan
    rated = min(gain * k_t * figure(motor, "I_nom"), figure(gear, "max_cont_torque", math.inf))
    most = min(stall, figure(motor, "max_int_torque", math.inf))
    peak = min(gain * most, figure(gear, "max_int_torque", math.inf))
    fastest = figure(motor, "omega_nl")
    free = min(fastest, figure(motor, "max_int_speed", math.inf))
    kept = min(fastest * (1.0 - rated / gain / stall), free, figure(motor, "max_cont_speed", math.inf))
    values = {
        "rated_torque": rated, "peak_torque": max(peak, rated), "rated_speed": kept / figure(gear, "ratio"),
        "no_load_speed": free / figure(gear, "ratio"), "mass": figure(motor, "mass") + figure(gear, "mass"),
        "diameter": max(figure(motor, "diameter"), figure(gear, "diameter")) if geared else figure(motor, "diameter"),
        "length": figure(motor, "length") + (figure(gear, "length") if geared else 0.0),
        "rotor_inertia": figure(motor, "inertia") + figure(gear, "inertia"), "ratio": figure(gear, "ratio"),
        "voltage": voltage,
    }  # fmt: skip
    return {"name": name, **{key: value for key, value in values.items() if math.isfinite(value)}}
