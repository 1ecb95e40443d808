"""What the steps of a task say, and whether the demonstrator's arm has a human size."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import seconds
from armdesign.demonstration.recording import Recording, Step
from armdesign.errors import TaskError

_STILL = 0.01  # [m] a base that moves less than this counts as standing
_LONGEST_ARM, _SHORTEST_ARM = 2.0, 0.1  # [m]


def recording_step(recording: Recording) -> Step:
    """How much was recorded."""
    rate = f"{recording.rate:.0f}" if recording.rate >= 10 else f"{recording.rate:.2g}"
    form = f" ({recording.about.format})" if recording.about.captured and recording.about.format else ""
    duration = float(recording.time[-1] - recording.time[0])
    return Step(
        "recording",
        f"The recording{form} has {recording.frames} frames over {seconds(duration)}, about {rate} frames/s.",
        {
            "frames": recording.frames,
            "duration": duration,
            "rate": recording.rate,
            "captured": recording.about.captured,
        },
    )


def points_step(base: str, points: Sequence[str], orientation: str | None, expressions: Mapping[str, str]) -> Step:
    """What is used of the recording.

    Args:
        base: Name of the base.
        points: Names of the points.
        orientation: Name of the orientation, or None.
        expressions: Name to what is behind it.
    """
    shown = {name: expressions.get(name, name) for name in (base, *points)}
    turns = "no orientation" if orientation is None else f"orientation of {orientation}"
    path = ", ".join(shown[name] for name in points)
    sentence = f"Base {shown[base]}; points from there to the hand: {path}; {turns}."
    details = {"base": shown[base], "points": [shown[name] for name in points], "orientation": orientation}
    return Step("points", sentence, details)


def base_steps(path: Array, base: str, base_mode: str) -> tuple[Step, ...]:
    """A step where the base moves by more than 10 mm, saying what that means.

    Args:
        path: The base in the recording, shape (T, 3) [m].
        base: Its name.
        base_mode: ``shoulder`` or ``fixed``.
    """
    reach = float(np.linalg.norm(path - path.mean(axis=0), axis=1).max())
    if reach <= _STILL:
        return ()
    moved = f"The base {base} moves up to {1e3 * reach:.0f} mm from its mean; with base_mode '{base_mode}'"
    if base_mode == "shoulder":
        sentence = (
            f"{moved} all paths are measured from the moving base, so that what stands still in the room moves"
            " by as much in the task. Use --base-mode fixed where places in the room matter."
        )
    else:
        sentence = (
            f"{moved} the robot stands at that mean and the paths are those in the room, so that the arm's first part"
            " does not begin at the robot's base in every frame."
        )
    return (Step("base", sentence, {"mode": base_mode, "moves": reach}),)


def task_step(recording: Recording, length: float) -> Step:
    """The task that came out.

    Args:
        recording: The cleaned points.
        length: Of the demonstrator's arm [m].
    """
    duration = float(recording.time[-1] - recording.time[0])
    sentence = (
        f"The task has {recording.frames} frames over {seconds(duration)};"
        f" the demonstrator's arm measures {1e3 * length:.0f} mm."
    )
    return Step("task", sentence, {"frames": recording.frames, "duration": duration, "arm_length": length})


def arm_length(P: Array) -> float:
    """Length of the demonstrator's arm: the median over the frames of |p_1| + |p_2 - p_1| + ... [m].

    Args:
        P: Shape (T, m, 3) [m], relative to the base in each frame; frames with NaN do not count.
    """
    links = np.linalg.norm(np.diff(P, axis=1, prepend=0.0), axis=2).sum(axis=1)
    seen = links[~np.isnan(links)]
    return float(np.median(seen)) if len(seen) else float("nan")


def check_arm_length(P: Array, source: str, scale: float = 1.0) -> float:
    """Turn away an arm that no human has, which mostly means another unit than metres.

    Args:
        P: Shape (T, m, 3) [m], relative to the base in each frame.
        source: Where it comes from, for the message.
        scale: The factor already applied, for the message.

    Returns:
        The arm's length [m]; NaN where it is never seen as a whole.

    Raises:
        TaskError: The arm is longer than 2 m or shorter than 0.1 m.
    """
    length = arm_length(P)
    if _SHORTEST_ARM <= length <= _LONGEST_ARM or np.isnan(length):
        return length
    scaled = "" if scale == 1.0 else f" after scaling by {scale:g}"
    message = f"{source}: from the base over the points the arm measures {length:.4g} m{scaled}"
    allowed = f"{_SHORTEST_ARM:g} to {_LONGEST_ARM:g} m"
    raise TaskError(message, value=length, allowed=allowed, fix=_length_fix(length, scale))


def _length_fix(length: float, scale: float) -> str:
    """What an arm of the wrong length seems to be, and what to do."""
    if scale < 1.0 and _SHORTEST_ARM <= length / scale <= _LONGEST_ARM:
        return "The recording looks like metres already: leave out --scale"
    for unit, word, least in (("mm", "millimetres", 100.0), ("cm", "centimetres", 10.0)):
        if length > least:
            return f"This looks like {word}: read it with --units {unit} (task.units in a settings file)"
    if length > _LONGEST_ARM:
        return "Choose --base and --points along one arm, from the shoulder to the hand, or set --units or --scale"
    return "Choose --base at the shoulder and --points along the arm up to the hand, or set --units or --scale"
