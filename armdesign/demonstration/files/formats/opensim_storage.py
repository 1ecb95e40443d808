"""Storage files of OpenSim (STO, MOT) that hold places of points; those of joint angles are refused by name.

    Positions
    version=1
    nRows=3
    nColumns=7
    inDegrees=no
    endheader
    time  hand_r_X  hand_r_Y  hand_r_Z  hand_r_Ox  hand_r_Oy  hand_r_Oz

BodyKinematics writes the centres of bodies so, PointKinematics one point (``state_0``, ``state_1``, ``state_2``, the
file's name is the point's), tables of vectors ``DataType=Vec3`` with the three numbers in one cell. Metres, y up.
"""

from __future__ import annotations

import re
from pathlib import Path

from armdesign.demonstration.files.csv_cells import MISSING, Dialect, read_rows
from armdesign.demonstration.files.formats.frame_clock import check_frames
from armdesign.demonstration.files.formats.marker_tables import clean_name, listed, once_each, row_steps
from armdesign.demonstration.files.text_files import LinesAhead, check_names, open_text, text_head
from armdesign.demonstration.recording import Step, Take
from armdesign.errors import RecordingError

_END = re.compile(r"\A(?:[^\n]*\n){0,40}?\s*endheader\b", re.IGNORECASE)
_AXIS = re.compile(r"(?P<name>.+)_(?P<axis>[xyz])", re.IGNORECASE)
_STATES = ["state_0", "state_1", "state_2"]
_WAY = "Give the .trc file that it was computed from, or the positions of BodyKinematics or PointKinematics"
_FIX = "Export the recording again"


def matches(head: bytes) -> bool:
    """Whether a file beginning with these bytes has a header that ends with ``endheader``."""
    return bool(_END.match(text_head(head).lstrip()))


def read(path: Path) -> Take:
    """Read places of points."""
    with open_text(path) as stream:
        lines = LinesAhead(stream, path)
        is_vectors = False
        while (text := lines.readline()) and text.strip().lower() != "endheader":
            key, _, value = text.partition("=")
            kind = value.strip().lower()
            is_vectors |= key.strip().lower() == "datatype" and kind == "vec3"
            if key.strip().lower() == "datatype" and kind not in ("double", "vec3", "float", ""):
                raise _refusal(path, f"values of the type {clean_name(value)[:40]}")
        lines.skip_blank()
        place = lines.place
        names = [clean_name(name) for name in re.split(r"\t|\s{2,}|(?<=\S) (?=\S)", lines.readline().strip())]
        check_names(names, len(names), place)
        if not names or names[0].lower() != "time":
            raise RecordingError(f"{place}: the first column is no time", allowed="time, then names", fix=_FIX)
        if is_vectors:
            names = [names[0], *(f"{name}_{axis}" for name in names[1:] for axis in "xyz")]
        points = _points(names, path)
        if not points:
            raise _refusal(path, f"{listed(names[1:])}: joint angles, forces or states, no places of points")
        between = r"[\s,]+" if is_vectors else r"\s+"
        lines.change = lambda line: "\t".join(re.split(between, line.strip())) + "\n" * line.endswith("\n")
        rows = read_rows(lines, names, lines.place, Dialect("\t", MISSING, may_be_cut=True))
    check_frames(rows)
    used = {column for columns in points.values() for column in columns} | {0}
    left = [name for i, name in enumerate(names) if i not in used]
    steps = row_steps(rows)
    if left:
        steps.append(Step("columns", f"Columns that are no part of a point were left out: {listed(left)}."))
    unique, name_steps = once_each(list(points))
    return Take(
        time=rows.times(0),
        points={new: rows.columns(points[old]) for new, old in zip(unique, points, strict=True)},
        orientations={},
        source=str(path),
        format="OpenSim storage",
        units="m",
        solved=True,
        steps=(*steps, *name_steps),
    )


def _points(names: list[str], path: Path) -> dict[str, list[int]]:
    """Name to the columns of x, y, z."""
    if names[1:4] == _STATES and len(names) == 4:
        return {clean_name(path.stem) or "point": [1, 2, 3]}
    parts: dict[str, dict[str, int]] = {}
    for column, name in enumerate(names):
        if match := _AXIS.fullmatch(name):
            point, number, axis = match["name"], 1, match["axis"].lower()
            while axis in parts.get(point, {}):  # a point that stands twice
                number += 1
                point = f"{match['name']}#{number}"
            parts.setdefault(point, {})[axis] = column
    # forces have the same endings: of a platform, such as ground_force_vx, or of its moments
    force = re.compile(r"force|torque|moment|vel|acc", re.IGNORECASE)
    whole = {name: axes for name, axes in parts.items() if len(axes) == 3 and not force.search(name)}
    return {name: [axes[axis] for axis in "xyz"] for name, axes in whole.items()}


def _refusal(path: Path, what: str) -> RecordingError:
    """The error for a file that holds something else."""
    return RecordingError(f"{path} is an OpenSim STO or MOT file of {what}", allowed="positions of points", fix=_WAY)
