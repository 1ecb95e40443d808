"""A joint trajectory as the content of a CSV, ROS 2 YAML or NPZ file."""

from __future__ import annotations

import io

import numpy as np

from armdesign._types import Array
from armdesign.export.trajectory.scaling import Motion

CONTROLLER = "arm_controller"
"""The controller that follows the motion in ROS 2."""
FRAME_ID = "base_link"
NANOSECONDS = 1_000_000_000


def joint_names(dof: int) -> tuple[str, ...]:
    """Names of the joints as in the exported robot: joint_1..joint_n."""
    return tuple(f"joint_{i + 1}" for i in range(dof))


def csv_text(motion: Motion) -> str:
    """One row a sample: time [s], then joint_i [rad], velocity_i [rad/s] and acceleration_i [rad/s^2] of all joints.

    Numbers are the shortest text that reads back as the same double.
    """
    dof = motion.q.shape[1]
    heads = [f"{what}_{i + 1}" for what in ("joint", "velocity", "acceleration") for i in range(dof)]
    rows = np.column_stack([motion.time, motion.q, motion.v, motion.a]).tolist()
    return "\n".join([",".join(["time", *heads]), *(",".join(map(repr, row)) for row in rows)]) + "\n"


def ros_yaml(motion: Motion) -> str:
    """A ROS 2 message ``trajectory_msgs/msg/JointTrajectory``, as ``ros2 topic pub`` reads it.

    The stamp is 0, which asks a controller to begin at once.
    """
    lines = ["header:", "  stamp: {sec: 0, nanosec: 0}", f"  frame_id: {FRAME_ID}", "joint_names:"]
    lines += [f"- {name}" for name in joint_names(motion.q.shape[1])]
    lines.append("points:")
    for t, q, v, a in zip(motion.time.tolist(), motion.q, motion.v, motion.a, strict=True):
        sec, nanosec = seconds_nanoseconds(t)
        lines += [
            f"- positions: {_numbers(q)}",
            f"  velocities: {_numbers(v)}",
            f"  accelerations: {_numbers(a)}",
            "  effort: []",
            f"  time_from_start: {{sec: {sec}, nanosec: {nanosec}}}",
        ]
    return "\n".join(lines) + "\n"


def npz_bytes(motion: Motion) -> bytes:
    """Arrays time, demonstrated, q, v, a as of ``Motion`` and joint_names, for ``np.load`` without pickle."""
    stream = io.BytesIO()
    names = np.array(joint_names(motion.q.shape[1]))
    np.savez_compressed(
        stream, time=motion.time, demonstrated=motion.demonstrated, q=motion.q, v=motion.v, a=motion.a,
        joint_names=names,
    )  # fmt: skip
    return stream.getvalue()


def seconds_nanoseconds(time: float) -> tuple[int, int]:
    """A time of 0 or more as whole seconds and nanoseconds."""
    return divmod(round(time * NANOSECONDS), NANOSECONDS)


def _numbers(values: Array) -> str:
    """A YAML list of floats: the shortest texts that read back as the same doubles."""
    # YAML 1.1 takes 1e-05 for a word, so it gets its point
    texts = (
        text.replace("e", ".0e") if "e" in text and "." not in text else text for text in map(repr, values.tolist())
    )
    return f"[{', '.join(texts)}]"
