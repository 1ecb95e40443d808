"""Small sound recordings of every format, to be damaged: written here, and beginnings of real ones where at hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from c3d_bytes import MIPS, c3d_bytes

FRAMES = 12
NAMES = ("S:ACR", "S:ELB", "S:WRI")
REAL = Path(__file__).resolve().parents[3] / "shared" / "recordings"
_LINES = 20  # of a real file

_rng = np.random.default_rng(11)
_P = np.cumsum(_rng.normal(0, 4, (FRAMES, 3, 3)), axis=0) + np.array(
    [[100.0, 900, 1400], [300, 800, 1200], [500, 600, 1100]]
)
_Q = np.array([0.1, 0.2, 0.3, 0.927]) + _rng.normal(0, 0.01, (FRAMES, 3, 4))
_Q /= np.linalg.norm(_Q, axis=2, keepdims=True)


def seeds() -> dict[str, list[bytes]]:
    """Contents by format, under the name that the format has in messages or a part of it."""
    return {
        "TRC": [trc("\t"), trc(",").replace(b"\n\n", b"\n"), *_real("opensim/*.trc", "pyomeca/*.trc")],
        "Vicon": [vicon(), *_real("pyomeca/*vicon.csv")],
        "Qualisys": [qualisys(), qualisys_6d()],
        "Motive": [
            motive("1.21"),
            motive("1.23"),
            motive("1.23", rotation="XYZ"),
            motive("1.25", kind="Bone"),
            *_real("motive_layout/*.csv"),
        ],
        "BVH": [bvh()],
        "bone": [bone(), *_real("kth_handover/*.csv")],
        "plain": [plain(), *_real("converted/*.csv")],
        "C3D": [*c3d()],
    }


def _real(*patterns: str) -> list[bytes]:
    paths = sorted(path for pattern in patterns for path in REAL.glob(pattern))
    return [b"".join(path.read_bytes().splitlines(keepends=True)[:_LINES]) for path in paths]


def _cells(values, digits: int = 4) -> list[str]:
    return ["" if np.isnan(value) else f"{value:.{digits}f}" for value in np.ravel(values)]


def _gap(positions: np.ndarray) -> np.ndarray:
    gap = positions.copy()
    gap[4:6, 1] = np.nan
    return gap


def trc(delimiter: str) -> bytes:
    """TRC, in mm."""
    rows = [["PathFileType", "4", "(X/Y/Z)", "take.trc"]]
    rows += [
        [
            "DataRate",
            "CameraRate",
            "NumFrames",
            "NumMarkers",
            "Units",
            "OrigDataRate",
            "OrigDataStartFrame",
            "OrigNumFrames",
        ]
    ]
    rows += [["100.0", "100.0", str(FRAMES), "3", "mm", "100.0", "1", str(FRAMES)]]
    rows += [["Frame#", "Time", *(cell for name in NAMES for cell in (name, "", ""))]]
    rows += [["", "", *(f"{axis}{i}" for i in (1, 2, 3) for axis in "XYZ")], []]
    rows += [[str(i + 1), f"{i / 100:.5f}", *_cells(row)] for i, row in enumerate(_gap(_P))]
    return "\n".join(delimiter.join(row) for row in rows).encode() + b"\n"


def vicon() -> bytes:
    """Vicon Nexus CSV."""
    rows = ["Trajectories", "100", ",," + ",,,".join(NAMES), "Frame,Sub Frame" + ",X,Y,Z" * 3, "," + ",mm" * 9]
    rows += [",".join([str(i + 1), "0", *_cells(row)]) for i, row in enumerate(_gap(_P))]
    return "\r\n".join(rows).encode() + b"\r\n"


def qualisys() -> bytes:
    """Qualisys TSV, 3D."""
    rows = _qualisys_head(
        "3D", ["NO_OF_MARKERS", "3"], ["MARKER_NAMES", *NAMES], ["TRAJECTORY_TYPES", *["Measured"] * 3]
    )
    rows += [["Frame", "Time", *(f"{name} {axis}" for name in NAMES for axis in "XYZ")]]
    rows += [[str(i + 1), f"{i / 100:.5f}", *(cell or "nan" for cell in _cells(row))] for i, row in enumerate(_gap(_P))]
    return "\r\n".join("\t".join(row) for row in rows).encode() + b"\r\n"


def qualisys_6d() -> bytes:
    """Qualisys TSV, 6D: position, angles, residual and matrix of bodies."""
    rows = _qualisys_head("6D", ["NO_OF_BODIES", "2"], ["BODY_NAMES", "arm", "hand"])
    columns = ["X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{i}]" for i in range(9))]
    rows += [["Frame", "Time", *columns * 2]]
    turn = [0.0, 0.0, 30.0, 0.5, 0.866025, 0.5, 0.0, -0.5, 0.866025, 0.0, 0.0, 0.0, 1.0]
    rows += [
        [str(i + 1), f"{i / 100:.5f}", *_cells(row[0]), *_cells(turn, 6), *_cells(row[1]), *_cells(turn, 6)]
        for i, row in enumerate(_P)
    ]
    return "\r\n".join("\t".join(row) for row in rows).encode() + b"\r\n"


def _qualisys_head(included: str, *more: list[str]) -> list[list[str]]:
    rows = [["NO_OF_FRAMES", str(FRAMES)], ["NO_OF_CAMERAS", "8"], ["FREQUENCY", "100"], ["NO_OF_ANALOG", "0"]]
    return [*rows, ["TIME_STAMP", "2019-09-18, 16:30:02"], ["DATA_INCLUDED", included], *more]


def motive(version: str, rotation: str = "Quaternion", kind: str = "Rigid Body") -> bytes:
    """OptiTrack Motive CSV with two bodies and a marker on each; two frames hidden."""
    axes = "XYZW" if rotation == "Quaternion" else rotation
    old = version == "1.21"
    columns = [(kind, "Arm"), (kind, "Hand")]
    width = len(axes) + 3 + (kind == "Rigid Body")
    parts = [f"{kind} Marker"] * 3
    types = [kind] * width * 2 + parts * 2
    names = [name for _, name in columns for _ in range(width)]
    names += [f"{name}:Marker1" for _, name in columns for _ in range(3)]
    error = ["Error Per Marker" if old else "Mean Marker Error"] if kind == "Rigid Body" else []
    above = (["Rotation"] * len(axes) + ["Position"] * 3 + error) * 2 + ["Position"] * 6
    below = [*axes, *"XYZ", *[""] * len(error)] * 2 + [*"XYZ"] * 2
    head = ["Format Version", version, "Take Name", "take 手", "Capture Frame Rate", "100.000000"]
    head += ["Export Frame Rate", "100.000000", "Capture Start Time", "2019-09-18 04.30.02.695 PM"]
    head += ["Total Frames in Take", str(FRAMES), "Total Exported Frames", str(FRAMES), "Rotation Type", rotation]
    rows = [[*head, "Length Units", "Millimeters", "Coordinate Space", "Global"], []]
    rows += [
        ["", "" if old else "Type", *types],
        ["", "" if old else "Name", *names],
        ["", "" if old else "ID", *["7"] * len(names)],
    ]
    rows += [["", "Parent", *["Root"] * len(names)]] if version == "1.25" else []
    rows += [["", "", *above], ["Frame", "Time" if old else "Time (Seconds)", *below]]
    for i in range(FRAMES):
        bodies = [cell for b in (1, 2) for cell in _body(i, b, axes, bool(error))]
        rows.append([str(72210 + i), f"{722.1 + i / 100:.6f}", *bodies, *_cells(_P[i, 1:])])
    mark = "\ufeff" if version == "1.25" else ""
    return (mark + "\r\n".join(",".join(row) for row in rows) + "\r\n").encode()


def _body(frame: int, body: int, axes: str, error: bool) -> list[str]:
    turn = _Q[frame, body] if len(axes) == 4 else np.array([10.0, 20.0, 30.0]) + frame
    cells = [*_cells(turn, 6), *_cells(_P[frame, body]), *(["0.000349"] if error else [])]
    return [""] * len(cells) if frame in (4, 5) and body == 1 else cells


def bvh() -> bytes:
    """BVH of an arm."""
    rotations = "Zrotation Yrotation Xrotation"
    lines = ["HIERARCHY", "ROOT Hips", "{", "OFFSET 0 0 0", f"CHANNELS 6 Xposition Yposition Zposition {rotations}"]
    for name in ("RightArm", "RightForeArm", "RightHand"):
        lines += [f"JOINT {name}", "{", "OFFSET 11.5 0.2 -0.1", f"CHANNELS 3 {rotations}"]
    lines += ["End Site", "{", "OFFSET 3 0 0", "}", *"}}}}", "MOTION", f"Frames: {FRAMES}", "Frame Time: .0083333"]
    values = np.random.default_rng(2).uniform(-30, 30, (FRAMES, 15))
    return "\n".join([*lines, *(" ".join(_cells(row)) for row in values)]).encode() + b"\n"


def bone() -> bytes:
    """One bone's CSV: position and quaternion, no times."""
    rows = [",".join([*_cells(p / 1000, 12), *_cells(q, 12)]) for p, q in zip(_P[:, 0], _Q[:, 0], strict=True)]
    return "\n".join(["x,y,z,q0,q1,q2,q3", *rows]).encode() + b"\n"


def plain() -> bytes:
    """Plain CSV."""
    head = ["time", *(f"{name}_{axis}" for name in ("shoulder", "elbow", "hand") for axis in "xyz")]
    rows = [
        [f"{i / 100:.4f}", *_cells(p / 1000, 6), *_cells(q, 6)]
        for i, (p, q) in enumerate(zip(_P, _Q[:, 2], strict=True))
    ]
    return "\n".join(",".join(row) for row in [[*head, *(f"hand_q{axis}" for axis in "xyzw")], *rows]).encode() + b"\n"


def c3d() -> list[bytes]:
    """C3D of floats with analog samples, of integers, and of a foreign processor with poses."""
    pose = np.tile(np.eye(4), (FRAMES, 1, 2, 1, 1))
    groups = {"POINT": {"LABELS": list(NAMES), "X_SCREEN": "+X", "Y_SCREEN": "+Z", "ANGLES": ["S:Angle"]}}
    groups["TRIAL"] = {"ACTUAL_START_FIELD": [1, 0], "ACTUAL_END_FIELD": [FRAMES, 0]}
    return [
        c3d_bytes(
            _P, analog=np.ones((FRAMES, 4, 2)), groups=groups, residual=np.where(np.isnan(_gap(_P)[..., 0]), -1.0, 0.5)
        ),
        c3d_bytes(_P, scale=0.1, groups=groups),
        c3d_bytes(_P, rotations=pose, groups=groups),
        c3d_bytes(_P, rotations=pose, processor=MIPS),
    ]
