"""Make the two example recordings, packaging.csv and welding.csv: a person's right arm at work, 50 frames a second.

The arm has a person's joints and lengths: three joints in the shoulder, one in the elbow, the turn of the forearm and
two in the wrist. It moves like a person's, too: by minimum jerk between rests (Flash and Hogan, 1985). Four bands of
markers sit on the shoulder, the middle of the upper arm, the middle of the forearm and the hand, and are read with
a motion-capture system's noise. Both files depend on nothing but the constants and the seed below.

    python examples/make_recordings.py [--out DIR]

World frame: x forward from the person, y to the left, z up, metres; the floor is z = 0.
Every limb's own frame has -z along the limb; with the arm hanging, thumb forward, each of them equals the world frame.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

SEED = 2401
STEP = 0.02  # [s]
FRAMES = {"packaging": 100, "welding": 125}

# The person: shoulder joint above the floor, joint to joint lengths, wrist to the centre of the hand [m].
SHOULDER = np.array([0.0, -0.18, 1.40])
UPPER_ARM, FOREARM, HAND = 0.30, 0.26, 0.08

# The joints, and how far they go in a healthy arm [deg]. Abduction is away from the body, rotation inwards, deviation
# towards the thumb; pronation is counted from the position with the thumb up.
JOINT_LIMITS = {
    "shoulder flexion": (-60, 170),
    "shoulder abduction": (-30, 120),
    "shoulder rotation": (-80, 80),
    "elbow flexion": (0, 145),
    "forearm pronation": (-80, 80),
    "wrist deviation": (-35, 20),
    "wrist flexion": (-60, 75),
}

# Noise of one frame: position of a band (the mean of its markers) per axis [m]; its orientation per axis [rad].
POSITION_NOISE, ORIENTATION_NOISE = 0.0003, np.radians(0.1)
SWAY = np.array([0.0020, 0.0012, 0.0006])  # the standing person's sway at the shoulder, amplitudes [m]

# Scene I, packaging: boxes as (lower corner, upper corner) [m].
BELT_HEIGHT = 0.95
OBSTACLE = np.array([[0.36, -0.25, 0.90], [0.56, -0.21, 1.06]])  # a machine guard between the belt and the carton
CARTON = np.array([[0.10, -0.58, 0.86], [0.46, -0.30, 1.00]])  # open at the top; the lower corner is its floor
GRIP_HEIGHT = 0.12  # the hand's centre above the bottom of the item it holds [m]
ITEM_HALF_WIDTH = 0.04

# The way of the hand: time [s], hand's centre [m], fingers' direction, elbow swivel [deg]. It rests at equal poses.
PACKAGING = [
    (0.00, (0.40, -0.05, 1.14), (0.72, 0.52, -0.40), 22),  # over the item
    (0.32, (0.42, -0.04, 1.07), (0.70, 0.50, -0.52), 22),  # closing on it
    (0.40, (0.42, -0.04, 1.07), (0.70, 0.50, -0.52), 22),  # lifting off
    (1.02, (0.36, -0.22, 1.30), (0.87, 0.40, -0.28), 42),  # over the guard, pulled in towards the body
    (1.84, (0.27, -0.43, 0.98), (0.72, -0.12, -0.68), 36),  # in the carton
    (1.98, (0.27, -0.43, 0.98), (0.72, -0.12, -0.68), 36),  # letting go
]
PACKAGING_RESTS = (1, 2, 4)  # rows at which the hand stands still on the way

# Scene II, welding: a seam that winds across a dome (a part of a sphere), from its left to its right.
DOME_RADIUS = 0.50
DOME_CENTRE = np.array([0.54, -0.24, 0.52])  # of the sphere [m]
SEAM_Y = (0.17, -0.13)  # where it starts and ends, from the dome's centre to the left [m]
SEAM_X = (0.00, -0.06)  # and forward; in between it bows away from the person, once and twice over, by ...
SEAM_BOWS = (0.025, 0.013)
HEADING = np.radians(16.0)  # of the fingers, from square to the seam back to where it came from [rad]
FINGER_SLOPE = np.radians(12.0)  # of the fingers down to the dome's surface [rad]
TORCH_NECK = np.radians(38.0)  # the bend of the torch, on from the fingers [rad]
TORCH = 0.16  # centre of the hand to the torch's tip, along the bent neck [m]
GRIP_ROLL = np.radians(60.0)  # of the palm, from down to the left [rad]
WELDING_SWIVEL = np.radians([18.0, 28.0])  # of the elbow, from start to end [rad]


def minimum_jerk(times: ArrayLike, values: ArrayLike, t: Array) -> Array:
    """Values along the path of least jerk through all of `values`, at rest at both ends.

    The minimiser is the quintic spline; a rest on the way is the end of one call and the start of the next.

    Args:
        times: When each value is passed, shape (k,) [s].
        values: Shape (k, ...).
        t: Instants asked for, shape (T,) [s].

    Returns:
        Shape (T, ...).
    """
    points = np.asarray(values, dtype=float)
    still = [(1, np.zeros(points.shape[1:])), (2, np.zeros(points.shape[1:]))]
    return np.asarray(make_interp_spline(np.asarray(times), points, k=5, bc_type=(still, still))(t))


def unit(vectors: Array) -> Array:
    """Vectors divided by their length, shape (..., 3)."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def hand_rotation(fingers: ArrayLike, palm: ArrayLike) -> Rotation:
    """Orientation of hands from the way the fingers point and, roughly, the way the palm faces; each shape (T, 3)."""
    z = -unit(np.asarray(fingers, dtype=float))
    x = unit(np.cross(np.asarray(palm, dtype=float), z))
    return Rotation.from_matrix(np.stack([x, np.cross(z, x), z], axis=-1))


def elbow_position(wrist: Array, swivel: Array) -> Array:
    """Where the elbow is, from the wrist and the turn of the elbow about the line from shoulder to wrist.

    Args:
        wrist: Relative to the shoulder, shape (T, 3) [m].
        swivel: 0 is lowest, positive is out to the right, shape (T,) [rad].

    Returns:
        Relative to the shoulder, shape (T, 3) [m].

    Raises:
        ValueError: A wrist is farther away than the arm is long, or nearer than it can fold.
    """
    reach = np.linalg.norm(wrist, axis=1, keepdims=True)
    if np.any(reach >= UPPER_ARM + FOREARM) or np.any(reach <= UPPER_ARM - FOREARM):
        raise ValueError(f"wrist {reach.min():.3f} to {reach.max():.3f} m from the shoulder: this arm cannot do that")
    along = (UPPER_ARM**2 - FOREARM**2 + reach**2) / (2 * reach)
    axis = wrist / reach
    down = unit(axis[:, 2:] * axis - [0.0, 0.0, 1.0])
    side = np.cos(swivel)[:, None] * down + np.sin(swivel)[:, None] * np.cross(down, axis)
    return np.asarray(along * axis + np.sqrt(UPPER_ARM**2 - along**2) * side)


def joint_angles(hand: Array, rotation: Rotation, swivel: Array) -> Array:
    """Inverse kinematics of the arm, in closed form: shoulder and wrist are each three joints through one point.

    Args:
        hand: Centres of the hand relative to the shoulder, shape (T, 3) [m].
        rotation: Orientations of the hand, T of them.
        swivel: Turn of the elbow, shape (T,) [rad].

    Returns:
        Angles in the order and with the signs of JOINT_LIMITS, shape (T, 7) [rad].
    """
    wrist = hand + rotation.apply([0.0, 0.0, HAND])
    elbow = elbow_position(wrist, swivel)
    z = -unit(elbow)
    forearm = unit(wrist - elbow)
    bend = np.arccos(np.clip(-np.sum(z * forearm, axis=1), -1.0, 1.0))
    x = unit(forearm - np.sum(z * forearm, axis=1, keepdims=True) * z)  # the elbow bends towards x
    upper = Rotation.from_matrix(np.stack([x, np.cross(z, x), z], axis=-1))
    flexion, abduction, turn = upper.as_euler("YXZ").T
    below = (upper * Rotation.from_euler("y", -bend[:, None])).inv() * rotation
    pronation, deviation, wrist_flexion = below.as_euler("ZYX").T
    return np.stack([-flexion, -abduction, turn, bend, pronation, -deviation, wrist_flexion], axis=1)


def arm_points(q: Array) -> tuple[dict[str, Array], Rotation]:
    """Forward kinematics of the arm.

    Args:
        q: Joint angles, shape (T, 7) [rad].

    Returns:
        Points on the arm relative to the shoulder by name, each (T, 3) [m], and the orientation of the hand.
    """
    upper = Rotation.from_euler("YXZ", q[:, :3] * [-1, -1, 1])
    fore = upper * Rotation.from_euler("y", -q[:, 3:4])
    hand = fore * Rotation.from_euler("ZYX", q[:, 4:] * [1, -1, 1])
    limb = np.array([0.0, 0.0, -1.0])
    elbow = upper.apply(UPPER_ARM * limb)
    wrist = elbow + fore.apply(FOREARM * limb)
    points = {
        "shoulder": np.zeros_like(elbow),
        "upper_arm": elbow / 2,
        "elbow": elbow,
        "forearm": (elbow + wrist) / 2,
        "wrist": wrist,
        "hand": wrist + hand.apply(HAND * limb),
    }
    return points, hand


def check_posture(q: Array) -> None:
    """Refuse joint angles, shape (T, 7) [rad], that JOINT_LIMITS forbids: a scene was changed and the arm got twisted.

    Raises:
        ValueError: Names the joint, the frame and the angle.
    """
    for (joint, (low, high)), angles in zip(JOINT_LIMITS.items(), np.degrees(q).T, strict=True):
        frame = int(np.argmax(np.abs(angles - (low + high) / 2)))
        if not low <= angles[frame] <= high:
            raise ValueError(f"{joint} is {angles[frame]:.0f} deg in frame {frame}; allowed: {low} to {high} deg")


def packaging_angles(t: Array) -> Array:
    """Joint angles of scene I at the instants t: minimum jerk in the joints through the poses of PACKAGING, (T, 7)."""
    times, hands, fingers, swivels = (np.array(column, dtype=float) for column in zip(*PACKAGING, strict=True))
    palm = np.tile([0.0, 0.6, -1.0], (len(times), 1))  # down and a little to the left
    poses = joint_angles(hands - SHOULDER, hand_rotation(fingers, palm), np.radians(swivels))
    q = np.tile(poses[-1], (len(t), 1))
    for first, last in zip((0, *PACKAGING_RESTS), (*PACKAGING_RESTS, len(times) - 1), strict=True):
        now = (t >= times[first]) & (t < times[last])
        q[now] = minimum_jerk(times[first : last + 1], poses[first : last + 1], t[now])
    return q


def seam(share: Array) -> Array:
    """Points of the weld seam in the world, shape (T, 3) [m], at `share` of the way from 0 to 1, shape (T,)."""
    x = SEAM_X[0] + share * (SEAM_X[1] - SEAM_X[0])
    x = x + SEAM_BOWS[0] * np.sin(np.pi * share) + SEAM_BOWS[1] * np.sin(2 * np.pi * share)
    y = SEAM_Y[0] + share * (SEAM_Y[1] - SEAM_Y[0])
    return np.asarray(DOME_CENTRE + np.stack([x, y, np.sqrt(DOME_RADIUS**2 - x**2 - y**2)], axis=1))


def welding_hand(share: Array) -> tuple[Array, Rotation]:
    """The hand as it holds the torch's tip on the seam, everywhere at the same angles to the seam and the surface.

    Args:
        share: How far along the seam, from 0 to 1, shape (T,).

    Returns:
        Centres of the hand in the world, shape (T, 3) [m], and its orientations.
    """
    tip = seam(share)
    normal = unit(tip - DOME_CENTRE)
    back = unit(seam(share - 1e-4) - seam(share + 1e-4))
    ahead = np.cos(HEADING) * np.cross(back, normal) + np.sin(HEADING) * back
    fingers = np.cos(FINGER_SLOPE) * ahead - np.sin(FINGER_SLOPE) * normal
    torch = np.cos(FINGER_SLOPE + TORCH_NECK) * ahead - np.sin(FINGER_SLOPE + TORCH_NECK) * normal
    palm = np.sin(GRIP_ROLL) * np.cross(normal, ahead) - np.cos(GRIP_ROLL) * normal
    return tip - TORCH * torch, hand_rotation(fingers, palm)


def welding_angles(t: Array, shoulder: Array) -> Array:
    """Joint angles of scene II: the torch's tip runs along the seam at an even pace, whatever the shoulder does.

    Args:
        t: Instants, shape (T,) [s].
        shoulder: Where the shoulder is in the world, shape (T, 3) [m].

    Returns:
        Shape (T, 7) [rad].
    """
    share = minimum_jerk(t[-1] * np.array([0.0, 0.15, 0.85, 1.0]), [0.0, 0.08, 0.92, 1.0], t)
    hand, rotation = welding_hand(share)
    swivel = WELDING_SWIVEL[0] + share * (WELDING_SWIVEL[1] - WELDING_SWIVEL[0])
    return joint_angles(hand - shoulder, rotation, swivel)


def swaying_shoulder(t: Array, rng: np.random.Generator) -> Array:
    """The shoulder of a person standing still: slow waves of random phase about its place, shape (T, 3) [m]."""
    waves = np.array([0.3, 0.7])[:, None] * t  # [Hz] [s]
    phases = rng.uniform(0.0, 2 * np.pi, (3, 2, 1))
    return np.asarray(SHOULDER + (SWAY[:, None] * np.sin(2 * np.pi * waves + phases).mean(axis=1)).T)


def recording(t: Array, q: Array, shoulder: Array, oriented: bool, rng: np.random.Generator) -> str:
    """The table a motion-capture system would export, as CSV text.

    Args:
        t: Instants, shape (T,) [s].
        q: Joint angles, shape (T, 7) [rad].
        shoulder: Where the shoulder is in the world, shape (T, 3) [m].
        oriented: Whether to add the hand's quaternion (scalar last; z along the fingers, x towards the thumb).
        rng: Source of the measurement noise.
    """
    points, hand = arm_points(q)
    names = ["time"]
    columns = [[f"{value:.2f}" for value in t]]
    for band in ("shoulder", "upper_arm", "forearm", "hand"):
        measured = shoulder + points[band] + rng.normal(0.0, POSITION_NOISE, (len(t), 3))
        names += [f"{band}_{axis}" for axis in "xyz"]
        columns += [[f"{value:.6f}" for value in column] for column in measured.T]
    if oriented:
        shaken = Rotation.from_rotvec(rng.normal(0.0, ORIENTATION_NOISE, (len(t), 3))) * hand
        quaternions = (shaken * Rotation.from_euler("x", np.pi)).as_quat(canonical=True)
        flips = np.sum(quaternions[1:] * quaternions[:-1], axis=1) < 0  # q and -q are one rotation: keep to one
        quaternions[1:] *= np.where(np.cumsum(flips) % 2, -1.0, 1.0)[:, None]
        names += [f"hand_q{axis}" for axis in "xyzw"]
        columns += [[f"{value:.8f}" for value in column] for column in quaternions.T]
    return "\n".join([",".join(names), *map(",".join, zip(*columns, strict=True))]) + "\n"


def make_recording(scene: str, frames: int) -> str:
    """CSV text of scene "packaging" (positions) or "welding" (also the hand's orientation)."""
    rng = np.random.default_rng([SEED, frames])
    t = np.asarray(STEP * np.arange(frames), dtype=np.float64)
    shoulder = swaying_shoulder(t, rng)
    welding = scene == "welding"
    q = welding_angles(t, shoulder) if welding else packaging_angles(t)
    check_posture(q)
    return recording(t, q, shoulder, oriented=welding, rng=rng)


def main() -> None:
    """Write both files, each whole or not at all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder to write to (default: here)")
    folder = parser.parse_args().out
    folder.mkdir(parents=True, exist_ok=True)
    for scene, frames in FRAMES.items():
        target = folder / f"{scene}.csv"
        partial = target.with_suffix(".partial")
        partial.write_text(make_recording(scene, frames), encoding="ascii", newline="\n")
        os.replace(partial, target)
        print(f"{target}: {frames} frames")


if __name__ == "__main__":
    main()
