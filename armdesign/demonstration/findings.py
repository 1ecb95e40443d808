"""What a task's notes say, and whether the demonstrator's arm has a human size."""

from __future__ import annotations

import numpy as np

from armdesign.demonstration.gaps import seconds
from armdesign.demonstration.recording import Array, Recording
from armdesign.errors import TaskError

_STILL = 0.01  # [m] a base that moves less than this counts as standing
_LONGEST_ARM, _SHORTEST_ARM = 2.0, 0.1  # [m]


def opening_notes(recording: Recording, base: str, points: tuple[str, ...], orientation: str | None) -> tuple[str, ...]:
    """Sentences about the recording and what is used of it."""
    turns = "no orientation" if orientation is None else f"orientation of {orientation}"
    rate = f"{recording.rate:.0f}" if recording.rate >= 10 else f"{recording.rate:.2g}"
    return (
        f"The recording has {recording.frames} frames over {_duration(recording)}, about {rate} frames/s.",
        f"Base {base}; points from there to the hand: {', '.join(points)}; {turns}.",
    )


def base_notes(path: Array, base: str, base_mode: str) -> tuple[str, ...]:
    """A sentence where the base moves by more than 10 mm, saying what that means.

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
        return (
            f"{moved} all paths are measured from the moving base, so that what stands still in the room moves"
            " by as much in the task. Use 'fixed' where places in the room matter.",
        )
    return (
        f"{moved} the robot stands at that mean and the paths are those in the room, so that the arm's first part"
        " does not begin at the robot's base in every frame.",
    )


def closing_note(recording: Recording, length: float) -> str:
    """A sentence about the task that came out; ``length`` is that of the arm [m]."""
    return (
        f"The task has {recording.frames} frames over {_duration(recording)};"
        f" the demonstrator's arm measures {1e3 * length:.0f} mm."
    )


def arm_length(P: Array) -> float:
    """Length of the demonstrator's arm: the median over the frames of |p_1| + |p_2 - p_1| + ... [m].

    Args:
        P: Shape (T, m, 3) [m], relative to the base in each frame.
    """
    links = np.diff(P, axis=1, prepend=0.0)
    return float(np.median(np.linalg.norm(links, axis=2).sum(axis=1)))


def check_arm_length(P: Array, source: str, scale: float = 1.0) -> float:
    """Turn away an arm that no human has, which mostly means another unit than metres.

    Args:
        P: Shape (T, m, 3) [m], relative to the base in each frame.
        source: Where it comes from, for the message.
        scale: The factor already applied, for the message.

    Returns:
        The arm's length [m].

    Raises:
        TaskError: The arm is longer than 2 m or shorter than 0.1 m.
    """
    length = arm_length(P)
    if _SHORTEST_ARM <= length <= _LONGEST_ARM:
        return length
    scaled = "" if scale == 1.0 else f" after scaling by {scale:g}"
    message = f"{source}: from the base over the points the arm measures {length:.4g} m{scaled}"
    allowed = f"{_SHORTEST_ARM:g} to {_LONGEST_ARM:g} m"
    raise TaskError(message, value=length, allowed=allowed, fix=_length_fix(length, scale))


def _length_fix(length: float, scale: float) -> str:
    """What an arm of the wrong length seems to be, and what to do."""
    if length > 100.0:
        return f"This looks like millimetres: divide by 1000, that is, use scale {scale * 1e-3:g}"
    if length > 10.0:
        return f"This looks like centimetres: divide by 100, that is, use scale {scale * 1e-2:g}"
    if length > _LONGEST_ARM:
        return "Choose the base and points along one arm, from the shoulder to the hand, or set the scale"
    if scale < 1.0 and _SHORTEST_ARM <= length / scale <= _LONGEST_ARM:
        return "The recording looks like metres already: leave out the scale"
    return "Choose the base at the shoulder and points along the arm up to the hand, or set the scale"


def _duration(recording: Recording) -> str:
    """First to last frame, in words."""
    return seconds(float(recording.time[-1] - recording.time[0]))
