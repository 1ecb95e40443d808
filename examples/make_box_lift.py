"""Make box_lift.c3d: a person lifts a box from a low table onto a shelf, as an optical system records it, at 100 Hz.

The person is that of make_recordings.py. Seven markers stick on the skin of the right arm, at the acromion, on both
sides of elbow and wrist, and on two knuckles; in a C3D file in millimetres, z up. The box hides a knuckle for a moment.

    python examples/make_box_lift.py [--out FILE]
"""

from __future__ import annotations

import argparse
import os
import struct
from pathlib import Path

import make_recordings as person
import numpy as np
from make_recordings import Array

RATE = 100.0  # [Hz]
NOISE = 0.0003  # of a marker per axis [m]
HIDDEN = ("MCP5", slice(118, 127))  # the marker that the shelf's edge hides, and when
ELBOW, WRIST, KNUCKLES = 0.035, 0.028, 0.035  # from the middle of each to its markers [m]

# Time [s], hand's centre [m], fingers' direction, elbow swivel [deg]. The hand rests at rows 1, 2 and 4.
LIFT = [
    (0.00, (0.36, -0.24, 1.00), (0.90, 0.25, -0.36), 25),  # beside the box
    (0.40, (0.38, -0.20, 0.94), (0.90, 0.25, -0.36), 20),  # gripping it at the side
    (0.52, (0.38, -0.20, 0.94), (0.90, 0.25, -0.36), 20),  # lifting
    (1.30, (0.29, -0.20, 1.18), (0.92, 0.30, -0.10), 30),  # close to the body
    (2.20, (0.44, -0.20, 1.40), (0.90, 0.30, 0.32), 35),  # on the shelf
    (2.40, (0.44, -0.20, 1.40), (0.90, 0.30, 0.32), 35),  # letting go
]
RESTS = (1, 2, 4)


def lift_angles(t: Array) -> Array:
    """Joint angles at the instants t: minimum jerk in the joints through the poses of LIFT, shape (T, 7) [rad]."""
    times, hands, fingers, swivels = (np.array(column, dtype=float) for column in zip(*LIFT, strict=True))
    palm = np.tile([0.0, 1.0, 0.0], (len(times), 1))  # to the box, on the left
    rotation = person.hand_rotation(fingers, palm)
    poses = person.joint_angles(hands - person.SHOULDER, rotation, np.radians(swivels))
    q = np.tile(poses[-1], (len(t), 1))
    for first, last in zip((0, *RESTS), (*RESTS, len(times) - 1), strict=True):
        now = (t >= times[first]) & (t < times[last])
        q[now] = person.minimum_jerk(times[first : last + 1], poses[first : last + 1], t[now])
    return q


def markers(t: Array, rng: np.random.Generator) -> dict[str, Array]:
    """Where the markers are in the world, each (T, 3) [m], NaN where hidden."""
    q = lift_angles(t)
    person.check_posture(q)
    points, hand = person.arm_points(q)
    shoulder = person.swaying_shoulder(t, rng)
    hinge = person.unit(np.cross(points["wrist"] - points["elbow"], points["elbow"]))  # axis of the elbow
    thumb = hand.apply([1.0, 0.0, 0.0])
    places = {
        "ACR": np.zeros_like(hinge),
        "EPICL": points["elbow"] - ELBOW * hinge,
        "EPICM": points["elbow"] + ELBOW * hinge,
        "STYLR": points["wrist"] + WRIST * thumb,
        "STYLU": points["wrist"] - WRIST * thumb,
        "MCP2": points["hand"] + KNUCKLES * thumb,
        "MCP5": points["hand"] - KNUCKLES * thumb,
    }
    measured = {name: shoulder + place + rng.normal(0.0, NOISE, place.shape) for name, place in places.items()}
    measured[HIDDEN[0]][HIDDEN[1]] = np.nan
    return measured


def c3d(points: dict[str, Array]) -> bytes:
    """A C3D file (Intel, floats, millimetres) of markers, each (T, 3) [m], NaN where one is not seen."""
    places = np.stack([*points.values()], axis=1)  # (T, n, 3)
    frames, count = places.shape[:2]
    width = max(map(len, points))
    names = "".join(name.ljust(width) for name in points).encode()
    parameters = {  # the type of a value, -1 letters, 2 integers, 4 floats; its dimensions; its bytes
        "USED": (2, (), struct.pack("<H", count)),
        "FRAMES": (2, (), struct.pack("<H", frames)),
        "SCALE": (4, (), struct.pack("<f", -1.0)),
        "RATE": (4, (), struct.pack("<f", RATE)),
        "UNITS": (-1, (2,), b"mm"),
        "X_SCREEN": (-1, (2,), b"+X"),
        "Y_SCREEN": (-1, (2,), b"+Z"),
        "LABELS": (-1, (width, count), names),
        "DATA_START": (2, (), struct.pack("<H", 3)),
    }
    records = struct.pack("<bb5sHB", 5, -1, b"POINT", 3, 0)
    for name, (kind, dimensions, raw) in parameters.items():
        content = struct.pack("<bB", kind, len(dimensions)) + bytes(dimensions) + raw + b"\0"
        records += struct.pack("<bb", len(name), 1) + name.encode() + struct.pack("<H", len(content) + 2) + content
    header = struct.pack("<2B5HfHHf", 2, 0x50, count, 0, 1, frames, 10, -1.0, 3, 0, RATE)
    section = bytes([1, 0x50, 1, 84]) + records
    if len(section) > 512:
        raise ValueError(f"the parameters take {len(section)} bytes; allowed: one block of 512")
    seen = np.isfinite(places).all(axis=2, keepdims=True)
    numbers = np.concatenate([np.where(seen, 1000.0 * places, 0.0), np.where(seen, 0.0, -1.0)], axis=2)
    data = numbers.astype("<f4").tobytes()
    return header.ljust(512, b"\0") + section.ljust(512, b"\0") + data + bytes(-len(data) % 512)


def main() -> None:
    """Write the file, whole or not at all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("box_lift.c3d"))
    target = parser.parse_args().out
    t = np.arange(round(LIFT[-1][0] * RATE) + 1) / RATE
    partial = target.with_suffix(".partial")
    partial.write_bytes(c3d(markers(t, np.random.default_rng([person.SEED, len(t)]))))
    os.replace(partial, target)
    print(f"{target}: {len(t)} frames")


if __name__ == "__main__":
    main()
