"""From a file's units and axes to metres with z up."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.quaternions import product
from armdesign.demonstration.points.guess import find_arms
from armdesign.demonstration.points.handedness import handed_steps
from armdesign.demonstration.points.time_sanity import time_steps
from armdesign.demonstration.points.units_and_up import find_up, measure, unit_of_size
from armdesign.demonstration.recording import About, Recording, Step, Take
from armdesign.errors import RecordingError, SettingsError

UNITS: Mapping[str, float] = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254}
"""Metres per unit."""
_NAMED = {"m": "metres", "cm": "centimetres", "mm": "millimetres", "in": "inches"}
AXES = ("x", "y", "z", "-x", "-y", "-z")
"""Axes that may point up; those that point down have a minus, as of cameras, whose y points down."""
_Y_UP = ("TRC", "Motive", "BVH", "OpenSim", "Rokoko")  # formats whose files mostly have y up
_FARTHEST = 1e9  # in any unit; damaged files hold larger numbers, and the square of these is far from overflow
_HALF = math.sqrt(0.5)
_ORDER = {"x": (1, 2, 0), "y": (0, 2, 1), "z": (0, 1, 2)}  # columns that become x, y, z
_SIGN = {
    "x": (1.0, 1.0, 1.0), "y": (1.0, -1.0, 1.0), "z": (1.0, 1.0, 1.0),
    "-x": (-1.0, 1.0, -1.0), "-y": (1.0, 1.0, -1.0), "-z": (1.0, -1.0, -1.0),
}  # fmt: skip
_TURN = {
    "x": (-0.5, -0.5, -0.5, 0.5), "y": (_HALF, 0.0, 0.0, _HALF), "z": (0.0, 0.0, 0.0, 1.0),
    "-x": (-0.5, 0.5, 0.5, 0.5), "-y": (-_HALF, 0.0, 0.0, _HALF), "-z": (1.0, 0.0, 0.0, 0.0),
}  # fmt: skip


def to_recording(take: Take, *, units: str | None = None, up: str | None = None, mirror: bool = False) -> Recording:
    """Put a take into metres with z up: (x, y, z) of a y-up take becomes (x, -z, y), of an x-up take (y, z, x).

    Where an axis points down (``-y``), that is a turn the other way: (x, z, -y).

    Quaternions are turned along, q' = q_T q; each body keeps its own axes. Every thing done is a step in ``about``.

    Args:
        take: The content of a file.
        units: ``m``, ``cm``, ``mm``, ``in`` or metres per unit as a number; None for what the file says, or what
            makes human lengths of the numbers.
        up: The axis that points up, ``x``, ``y``, ``z`` or, of those that point down, ``-x``, ``-y``, ``-z``; None
            for what the file says, or what is usual for its format unless the data say otherwise.
        mirror: Whether to mirror left and right, y -> -y, to make a right arm of a left one.

    Raises:
        SettingsError: ``units`` or ``up`` is none of the values allowed.
        RecordingError: The unit is neither given nor to be seen from the data, the take has no sound times, or a point
            lies where none can be.
    """
    for name, values in take.points.items():
        far = np.abs(values) > _FARTHEST
        if far.any():
            frame = int(np.argmax(far.any(axis=1)))
            message = f"{take.source}: point '{name}' lies at {values[frame][far[frame]][0]:.3g} in frame {frame + 1}"
            allowed = f"{-_FARTHEST:g} to {_FARTHEST:g}"
            raise RecordingError(message, value=frame, allowed=allowed, fix="Export the recording again")
    factor, unit_steps = _factor(take, units)
    axis, up_steps = _up(take, up, factor)
    steps = (*take.steps, *time_steps(take), *unit_steps, *up_steps)
    about = About(take.format, take.captured, take.rate, dict(take.bodies), steps)
    recording = Recording(
        take.time,
        {name: _upright(values, axis, factor) for name, values in take.points.items()},
        {name: _turned(values, axis) for name, values in take.orientations.items()},
        take.source,
        about,
    )
    if mirror:
        return mirrored(recording)
    doubts = handed_steps(recording.points)
    return replace(recording, about=replace(about, steps=(*steps, *doubts))) if doubts else recording


def mirrored(recording: Recording) -> Recording:
    """Left and right exchanged at the plane of x and z: p' = S p and R' = S R S with S = diag(1, -1, 1)."""
    # S (x, y, z) = (x, -y, z); S R S turns by the same angle about the mirrored axis, the other way round.
    result = recording.changed(
        recording.time, lambda p: p * [1.0, -1.0, 1.0], lambda q: q * np.array([-1.0, 1.0, -1.0, 1.0])
    )
    step = Step("mirror", "Mirrored left and right (y to -y), so that a left arm becomes a right one.")
    return replace(result, about=replace(result.about, steps=(*result.about.steps, step)))


def is_mirrored(recording: Recording) -> bool:
    """Whether left and right were exchanged on reading."""
    return sum(step.name == "mirror" for step in recording.about.steps) % 2 == 1


def unit_factor(units: str) -> float:
    """Metres per unit."""
    text = units.strip()
    if text.lower() in UNITS:
        return UNITS[text.lower()]
    try:
        factor = float(text)
    except ValueError:
        factor = math.nan
    if not (math.isfinite(factor) and factor > 0):
        allowed = f"{', '.join(UNITS)}, or metres per unit as a number above 0"
        raise SettingsError(f"units is '{units}'", value=units, allowed=allowed)
    return factor


def _factor(take: Take, units: str | None) -> tuple[float, list[Step]]:
    """Metres per unit of the take, and where that comes from."""
    if units is not None:
        factor = unit_factor(units)
        said = "" if take.units in {None, units} else f" although the file says {take.units}"
        return factor, [_unit_step(factor, f"as asked for{said}", units)]
    if take.units is not None:
        factor = unit_factor(take.units)
        return factor, [_unit_step(factor, "as the file says", take.units)] if take.captured else []
    size = measure(take, find_arms(take.points))
    found = unit_of_size(size)
    if found is None:
        message = f"{take.source}: the file does not say its unit of length, and none fits: {size}"
        allowed = f"{', '.join(UNITS)}, or metres per unit as a number"
        raise RecordingError(message, value=take.units, allowed=allowed, fix="Say it with --units")
    return found.factor, [_unit_step(found.factor, found.why, found.name)]


def _unit_step(factor: float, why: str, unit: str) -> Step:
    """What was made of the unit."""
    done = "taken as they are" if factor == 1.0 else f"multiplied by {factor:.6g}"
    name = unit if unit in UNITS else f"{factor:.9g}"
    details = {"unit": name, "metres_per_unit": factor, "from": why}
    named = _NAMED.get(unit, f"units of {factor:.6g} m")
    return Step("units", f"Lengths are in {named}, {why}; {done}.", details)


def _up(take: Take, up: str | None, factor: float) -> tuple[str, list[Step]]:
    """The axis that points up, and where that comes from."""
    if up is not None:
        axis = up.strip().lower()
        if axis not in AXES:
            raise SettingsError(f"up is '{up}'", value=up, allowed=", ".join(AXES))
        return axis, [_up_step(axis, "as asked for")]
    custom = "y" if any(word in take.format for word in _Y_UP) else "z"
    found = find_up(take, factor, take.up or custom)
    if take.up is not None:
        steps = [_up_step(take.up, "as the file says")]
        if found.axis not in {None, take.up}:
            sentence = (
                f"The file says that {take.up} is up, but {found.why}, as if {found.axis} were: check it, or use "
                f"--up {found.axis}."
            )
            steps.append(Step("up-doubt", sentence, {"said": take.up, "seems": found.axis}))
        return take.up, steps if take.captured else []
    if found.axis is None:
        return custom, [_up_step(custom, f"as is usual for {take.format}, which does not say (otherwise use --up)")]
    usual = "" if found.axis == custom else f", although {custom} is usual for {take.format}"
    return found.axis, [_up_step(found.axis, f"because {found.why}{usual} (otherwise use --up)")]


def _up_step(axis: str, why: str) -> Step:
    """What was made of the up axis."""
    done = {
        "x": "turned so that z points up, (x, y, z) to (y, z, x)",
        "y": "turned so that z points up, (x, y, z) to (x, -z, y)",
        "z": "axes left as they are",
        "-x": "turned so that z points up, (x, y, z) to (-y, z, -x)",
        "-y": "turned so that z points up, (x, y, z) to (x, z, -y)",
        "-z": "turned by half about x, (x, y, z) to (x, -y, -z)",
    }
    points = f"{axis[1:]} points down" if axis.startswith("-") else f"{axis} points up"
    return Step("up", f"{points}, {why}: {done[axis]}.", {"axis": axis, "from": why})


def _upright(values: Array, axis: str, factor: float) -> Array:
    """Positions of shape (T, 3) in metres with z up; where nothing is to be done, the numbers stay to the last bit."""
    turned = np.asarray(values, dtype=float)
    if axis != "z":
        turned = np.stack([sign * turned[:, i] for i, sign in zip(_ORDER[axis[-1]], _SIGN[axis], strict=True)], axis=1)
    return turned if factor == 1.0 else turned * factor


def _turned(quaternions: Array, axis: str) -> Array:
    """Quaternions of shape (T, 4) with z up."""
    return quaternions if axis == "z" else product(np.array(_TURN[axis]), quaternions)
