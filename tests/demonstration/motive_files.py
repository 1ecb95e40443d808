"""Writes Motive CSV files of each version, as Motive lays them out."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation


@dataclass(frozen=True)
class Item:
    """A rigid body or bone (with turns), or a marker (without): positions (T, 3), quaternions x, y, z, w (T, 4)."""

    type: str
    name: str
    positions: np.ndarray
    quaternions: np.ndarray | None = None
    parent: str = "Root"
    id: str = ""


def arm(frames=40, seed=0, kind="Rigid Body", prefix=""):
    """Bodies Shoulder, Forearm and Hand of a moving arm, in metres, y up."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, 1.0, frames)[:, None]
    items, place = [], np.array([0.1, 1.4, -0.2])
    for name in ("Shoulder", "Forearm", "Hand"):
        turns = Rotation.from_rotvec(0.4 * np.sin(3.0 * time + rng.uniform(0, 6, 3)) + rng.uniform(-1, 1, 3))
        items.append(Item(kind, prefix + name, np.broadcast_to(place, (frames, 3)).copy(), turns.as_quat()))
        place = place + turns.apply([0.3, 0.0, 0.0])
    return items


def markers(bodies, kind="Marker", spread=0.05, count=3):
    """Markers on each body, ``Body:Marker1`` and so on."""
    result = []
    for body in bodies:
        for number in range(count):
            local = spread * np.eye(3)[number % 3]
            places = body.positions + Rotation.from_quat(body.quaternions).apply(local)
            result.append(Item(kind, f"{body.name}:Marker{number + 1}", places))
    return result


def motive_text(
    items,
    version="1.23",
    *,
    rate=120.0,
    frames=None,
    units="Meters",
    rotation="Quaternion",
    space="Global",
    take="Take 1",
    end="\n",
    blank="",
    digits=6,
    time_digits=6,
    timecode=False,
    facts=(),
    hidden=(),
):
    """The text of a file.

    ``frames``: frame numbers; ``facts``: line 1 entries to replace or (value None) leave out; ``hidden``: pairs of item
    name and frame index whose cells stay empty.
    """
    total = len(items[0].positions)
    frames = np.arange(total) if frames is None else frames
    cells = [_cells(item, version, rotation, digits) for item in items]
    lines = [_first_line(version, rate, total, units, rotation, space, take, facts), blank]
    rows = [_row(items, cells, text) for text in _words(version)]
    rows += [[kind for _, kinds, _, _ in cells for kind in kinds], [axis for _, _, axes, _ in cells for axis in axes]]
    old = version == "1.21"
    starts = [("", "" if old else word) for word in ("Type", "Name", "ID", "Parent")][: len(rows) - 2]
    starts += [("", ""), ("Frame", "Time" if old else "Time (Seconds)")]
    extra = [""] * (len(starts) - 1) + ["TimeCode"] if timecode else None
    for number, (start, row) in enumerate(zip(starts, rows, strict=True)):
        lines.append(",".join([*start, *([extra[number]] if extra else []), *row]))
    for index, frame in enumerate(frames):
        values = [f"{frame}", f"{frame / rate:.{time_digits}f}"] + (["15:26:46:12.02"] if timecode else [])
        for item, (width, _, _, texts) in zip(items, cells, strict=True):
            values += [""] * width if (item.name, index) in hidden else texts[index]
        lines.append(",".join(values))
    return end.join(lines) + end


def _first_line(version, rate, total, units, rotation, space, take, facts):
    pairs = {
        "Format Version": version,
        "Take Name": f'"{take}"' if "," in take else take,
        "Take Notes": "",
        "Capture Frame Rate": f"{rate:.6f}",
        "Export Frame Rate": f"{rate:.6f}",
        "Capture Start Time": "2019-09-18 04.30.02.695 PM",
        "Capture Start Frame": "0",
        "Total Frames in Take": str(total),
        "Total Exported Frames": str(total),
        "Rotation Type": rotation,
        "Length Units": units,
        "Coordinate Space": space,
    }
    if version == "1.21":
        del pairs["Take Notes"], pairs["Capture Start Frame"]
    pairs |= dict(facts)
    return ",".join(f"{name},{value}" for name, value in pairs.items() if value is not None)


def _words(version):
    return ("type", "name", "id", "parent") if version == "1.25" else ("type", "name", "id")


def _row(items, cells, word):
    return [getattr(item, word) for item, (width, *_) in zip(items, cells, strict=True) for _ in range(width)]


def _cells(item, version, rotation, digits):
    """Number of columns, kinds, axes, and the cells of each frame."""
    blocks = []
    if item.quaternions is not None and rotation == "Quaternion":
        blocks.append(("Rotation", "XYZW", item.quaternions))
    elif item.quaternions is not None:
        angles = Rotation.from_quat(item.quaternions).as_euler(rotation, degrees=True)
        blocks.append(("Rotation", "XYZ", angles[:, [rotation.index(axis) for axis in "XYZ"]]))
    blocks.append(("Position", "XYZ", item.positions))
    more = _quality(item, version)
    if more:
        blocks.append((more, [""], np.full((len(item.positions), 1), 0.000123)))
    kinds = [kind for kind, axes, _ in blocks for _ in axes]
    axes = [axis for _, axes, _ in blocks for axis in axes]
    table = np.hstack([values for *_, values in blocks])
    return len(axes), kinds, axes, [[f"{value:.{digits}f}" for value in row] for row in table]


def _quality(item, version):
    """The column that Motive adds to an item."""
    if item.type == "Rigid Body":
        return "Error Per Marker" if version == "1.21" else "Mean Marker Error"
    return "Marker Quality" if item.type == "Rigid Body Marker" else ""
