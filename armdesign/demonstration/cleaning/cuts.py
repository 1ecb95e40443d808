"""Cutting a bad stretch out of the middle of a recording, where the arm stands still while it lasts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import TIME_TOLERANCE, seconds
from armdesign.demonstration.recording import MIN_FRAMES, Recording, Step
from armdesign.errors import RecordingError, SettingsError

STILL = 0.005  # [m] what a point may have moved from one end of a cut to the other
STILL_TURN = math.radians(3.0)  # the same of an orientation
STILL_SPEED = 1.0  # [m/s] of the joint, where frames follow so fast that 5 mm would be a jerk
REST = 0.1  # [s] before and behind a cut, in which the hand may move no further than that
Stretch = tuple[float, float]


@dataclass(frozen=True)
class Cut:
    """A stretch that is taken out.

    Attributes:
        last: Last frame before it.
        next: First frame behind it.
        shift: By how much the later times move up [s].
    """

    last: int
    next: int
    shift: float


def cut_out(recording: Recording, stretches: Sequence[Stretch]) -> tuple[Recording, tuple[Step, ...]]:
    """Take out the frames strictly between two times, for each pair; later times move up to one step behind.

    Args:
        recording: Any recording, its last point the hand; gaps within a stretch do not matter.
        stretches: Pairs of times in the recording [s].

    Raises:
        SettingsError: A stretch has no frames, overlaps another or reaches an end of the recording.
        RecordingError: The arm has moved from one end of a stretch to the other; the message says by how much.
    """
    cuts = plan_cuts(recording, stretches)
    if not cuts:
        return recording, ()
    keep = np.ones(recording.frames, dtype=bool)
    time = recording.time.copy()
    steps = []
    for cut in cuts:
        moved = _check_still(recording, cut)
        keep[cut.last + 1 : cut.next] = False
        time[cut.next :] -= cut.shift
        steps.append(_step(recording, cut, moved))
    if keep.sum() < MIN_FRAMES:
        raise SettingsError(f"cut leaves {keep.sum()} frames, a motion takes at least three", value=tuple(stretches))
    return recording.changed(time[keep], lambda p: p[keep], lambda q: q[keep]), tuple(steps)


def moved_up(recording: Recording, stretches: Sequence[Stretch], time: float | None) -> float | None:
    """Where a time of the recording lies after the cuts [s]; within a stretch, at the joint.

    Args:
        recording: The recording before the cuts.
        stretches: Pairs of times in the recording [s].
        time: The time; None for none.
    """
    if time is None:
        return None
    moved = time
    for cut in plan_cuts(recording, stretches):
        last, next_ = recording.time[cut.last], recording.time[cut.next]
        if time >= next_ - TIME_TOLERANCE:
            moved -= cut.shift
        elif time > last + TIME_TOLERANCE:
            return float(moved - (time - last))
    return float(moved)


def plan_cuts(recording: Recording, stretches: Sequence[Stretch]) -> list[Cut]:
    """The cuts in order of time.

    Args:
        recording: Any recording.
        stretches: Pairs of times in the recording [s].

    Raises:
        SettingsError: A stretch has no frames, overlaps another or reaches an end of the recording.
    """
    time = recording.time
    cuts: list[Cut] = []
    for a, b in sorted(stretches):
        last = int(np.searchsorted(time, a + TIME_TOLERANCE, side="right")) - 1
        next_ = int(np.searchsorted(time, b - TIME_TOLERANCE, side="left"))
        named = f"cut {a:g}:{b:g}"
        if last < 0 or next_ >= len(time):
            span = f"times within {seconds(time[0])} and {seconds(time[-1])}"
            fix = "Take a beginning or an end away with --from and --to"
            raise SettingsError(f"{named} reaches an end of the recording", value=(a, b), allowed=span, fix=fix)
        if next_ - last < 2:
            raise SettingsError(f"{named} holds no frame", value=(a, b), fix="Give two times A:B with frames between")
        if cuts and last < cuts[-1].next:
            raise SettingsError(f"{named} overlaps another cut", value=(a, b), fix="Join them to one")
        cuts.append(Cut(last, next_, float(time[next_] - time[last]) - recording.step))
    return cuts


def _check_still(recording: Recording, cut: Cut) -> float:
    """The furthest any point has moved over a cut [m].

    Raises:
        RecordingError: It is too far, or the hand does not rest at the ends.
    """
    moved = {name: _jump(values, cut) for name, values in recording.points.items()}
    limit = min(STILL, STILL_SPEED * recording.step)
    name = max(moved, key=lambda name: moved[name])
    if moved[name] > limit:
        message = f"'{name}' moves by {1e3 * moved[name]:.0f} mm"
        raise _refused(recording, cut, message, f"at most {1e3 * limit:.2g} mm", moved[name])
    for name, values in recording.orientations.items():
        turned = _jump(values, cut)
        if turned > STILL_TURN:
            message = f"'{name}' turns by {math.degrees(turned):.0f} deg"
            raise _refused(recording, cut, message, f"at most {math.degrees(STILL_TURN):.2g} deg", turned)
    hand = list(recording.points)[-1]
    for name, path in _paths_of_rest(recording, hand, cut).items():
        if path > STILL:
            message = f"'{hand}' still moves {name}, by {1e3 * path:.0f} mm in {seconds(REST)}"
            raise _refused(recording, cut, message, f"at most {1e3 * STILL:.2g} mm", path)
    return max(moved.values())


def _refused(recording: Recording, cut: Cut, what: str, allowed: str, value: float) -> RecordingError:
    """The error for a cut where the arm does not stand still."""
    span = f"from {seconds(recording.time[cut.last])} to {seconds(recording.time[cut.next])}"
    message = f"{recording.source}: the stretch {span} cannot be cut out, {what}"
    fix = "Choose both ends where the hand stands still at the same place, or crop with --from and --to"
    return RecordingError(message, value=value, allowed=allowed, fix=fix)


def _jump(values: Array, cut: Cut) -> float:
    """How far a series is from one end of a cut to the other; 0 where it was not seen at both.

    Of positions, shape (T, 3), the distance [m]; of quaternions, shape (T, 4), the angle between them [rad].
    """
    seen = np.flatnonzero(~np.isnan(values[:, 0]))
    before, after = seen[seen <= cut.last], seen[seen >= cut.next]
    if not len(before) or not len(after):
        return 0.0
    a, b = values[before[-1]], values[after[0]]
    if values.shape[1] == 3:
        return float(np.linalg.norm(b - a))
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    return float(2.0 * np.arccos(min(1.0, abs(float(a @ b)))))


def _paths_of_rest(recording: Recording, hand: str, cut: Cut) -> dict[str, float]:
    """How far the hand moves shortly before and shortly behind a cut [m]."""
    time, values = recording.time, recording.points[hand]
    last, next_ = time[cut.last], time[cut.next]
    spans = {
        "before it": values[(time >= last - REST - TIME_TOLERANCE) & (time <= last)],
        "behind it": values[(time >= next_) & (time <= next_ + REST + TIME_TOLERANCE)],
    }
    seen = {name: span[~np.isnan(span[:, 0])] for name, span in spans.items()}
    return {name: float(np.linalg.norm(span[-1] - span[0])) if len(span) else 0.0 for name, span in seen.items()}


def _step(recording: Recording, cut: Cut, moved: float) -> Step:
    """What was cut out."""
    last, next_ = float(recording.time[cut.last]), float(recording.time[cut.next])
    count = cut.next - cut.last - 1
    many = f"{count} frames" if count > 1 else "1 frame"
    sentence = (
        f"Cut out {many} between {seconds(last)} and {seconds(next_)}, over which no point moves more than "
        f"{1e3 * moved:.2g} mm; later times move up by {seconds(cut.shift)}."
    )
    return Step("cut", sentence, {"from": last, "to": next_, "frames": count, "moved": moved, "shift": cut.shift})
