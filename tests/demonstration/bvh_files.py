"""Writes BVH files, and works out joint by joint and frame by frame where everything is."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

CMU = "Zrotation Yrotation Xrotation"
ARM = ("Hips", "Spine", "RightShoulder", "RightArm", "RightForeArm", "RightHand")


@dataclass
class Joint:
    """A joint with its children; a child given as three numbers is an End Site."""

    name: str
    offset: tuple
    channels: str = CMU
    children: list = field(default_factory=list)


def person(channels=CMU):
    """Hips, spine with head and right arm, and a left leg: y up, in no particular unit."""
    hand = Joint("RightHand", (-4.4, 0.1, 0.0), channels, [(-1.0, 0.0, 0.0)])
    forearm = Joint("RightForeArm", (-5.1, 0.0, 0.2), channels, [hand])
    arm = Joint("RightArm", (-1.1, 0.2, 0.0), channels, [forearm])
    head = Joint("Head", (0.0, 3.1, 0.2), channels, [(0.0, 1.5, 0.0)])
    spine = Joint(
        "Spine", (0.0, 4.2, -0.3), channels, [head, Joint("RightShoulder", (-0.8, 2.4, 0.0), channels, [arm])]
    )
    leg = Joint("Left Leg", (1.3, -1.8, 0.8), channels, [(0.0, -14.0, 0.0)])
    return Joint("Hips", (0.0, 0.0, 0.0), f"Xposition Yposition Zposition {channels}", [spine, leg])


def joints(joint):
    """A joint and all below it, as they stand in the file."""
    yield joint
    for child in joint.children:
        if isinstance(child, Joint):
            yield from joints(child)


def motion(roots, frames, rng, angle=60.0):
    """Random numbers for all channels, shape (T, channels)."""
    names = [name for root in roots for joint in joints(root) for name in joint.channels.split()]
    scale = np.array([angle if name.endswith("rotation") else 10.0 for name in names])
    return rng.uniform(-1.0, 1.0, (frames, len(names))) * scale


def bvh_text(roots, table, *, step="0.0083333", count=None, end="\n", gap=" ", brace="\n", number="{:.6f}"):
    """The text of a file; ``brace``: what stands between a name and its brace."""
    lines = ["HIERARCHY"]
    for root in roots:
        lines += _lines(root, "ROOT", "", brace)
    lines += ["MOTION", f"Frames: {len(table) if count is None else count}", f"Frame Time: {step}"]
    lines += [gap.join(number.format(value) for value in row) for row in table]
    return end.join(lines).replace("\n", end) + end


def _lines(joint, word, indent, brace):
    lines = [
        f"{indent}{word} {joint.name}{brace}{indent if brace != ' ' else ''}{{",
        f"{indent}\tOFFSET {_three(joint.offset)}",
    ]
    channels = joint.channels.split()
    lines += [f"{indent}\tCHANNELS {len(channels)} {' '.join(channels)}"] if channels else []
    for child in joint.children:
        if isinstance(child, Joint):
            lines += _lines(child, "JOINT", indent + "\t", brace)
        else:
            lines += [f"{indent}\tEnd Site", f"{indent}\t{{", f"{indent}\t\tOFFSET {_three(child)}", f"{indent}\t}}"]
    return [*lines, f"{indent}}}"]


def _three(values):
    return " ".join(f"{value:.6f}" for value in values)


def places(roots, table):
    """Every joint's 4x4 pose in every frame, and every end's place: name to list over frames, by plain recursion."""
    result = {}
    for row in table:
        numbers = iter(row)
        for root in roots:
            _walk(root, np.eye(4), numbers, result)
    return {name: np.array(values) for name, values in result.items()}


def _walk(joint, parent, numbers, result):
    pose = parent @ _shift(joint.offset)
    turn = np.eye(4)
    for channel in joint.channels.split():
        value = next(numbers)
        axis = "xyz".index(channel[0].lower())
        if channel.lower().endswith("position"):
            pose = pose @ _shift(value * np.eye(3)[axis])
        else:
            step = np.eye(4)
            step[:3, :3] = Rotation.from_euler("xyz"[axis], value, degrees=True).as_matrix()
            turn = turn @ step
    pose = pose @ turn
    result.setdefault(joint.name, []).append(pose)
    for child in joint.children:
        if isinstance(child, Joint):
            _walk(child, pose, numbers, result)
        else:
            result.setdefault(f"{joint.name} (end)", []).append(pose @ _shift(child))


def _shift(offset):
    pose = np.eye(4)
    pose[:3, 3] = offset
    return pose
