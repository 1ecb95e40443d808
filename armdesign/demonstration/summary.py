"""What a recording holds: rate, length, points with their gaps, and the arms found by the names of its points."""

from __future__ import annotations

import dataclasses
import itertools
import shlex
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.cleaning.gaps import find_gaps, find_repeats, seconds
from armdesign.demonstration.points.guess import Arm
from armdesign.demonstration.points.selection import NAMED, arm_paths, guess_of
from armdesign.demonstration.recording import Recording

_WIDTH = 80
_OF_TIME = {"time", "times", "rate", "time-unit", "frames"}  # steps that tell of it
_HOLE = 1.5  # a step in time this many times the median is mentioned


@dataclass(frozen=True)
class Coverage:
    """How much of a point, or of an orientation, is there."""

    name: str
    share: float  # part of the frames in which it was seen
    gaps: int
    longest: float  # length of the longest gap [s]
    at: float | None  # when that begins [s]; None if there is no gap


@dataclass(frozen=True)
class Segment:
    """Distance of two neighbouring points of an arm."""

    name: str  # from where to where
    mean: float  # over the frames in which both were seen [m]
    spread: float  # standard deviation [m]


@dataclass(frozen=True)
class ArmSummary:
    """An arm found by the names of the points."""

    what: str  # side, subject and naming scheme in words
    base: str  # expression for the shoulder
    points: tuple[str, ...]  # expressions for the points from there to the hand
    orientation: str | None  # name of the point that has the hand's orientation; None for none
    segments: tuple[Segment, ...]
    chosen: bool  # whether a search takes this one by default


@dataclass(frozen=True)
class Summary:
    """What a recording holds."""

    source: str
    format: str
    frames: int
    start: float  # time of the first frame [s]
    duration: float  # from the first to the last frame [s]
    rate_declared: float | None  # frames per second that the file declares; None where it does not
    rate_measured: float  # frames per second by the median step in time
    longest_step: float  # longest time from one frame to the next [s]
    repeated: int  # number of frames that are equal to the one before
    points: tuple[Coverage, ...]  # how much of each point is there
    orientations: tuple[Coverage, ...]  # how much of each orientation is there
    bodies: Mapping[str, tuple[str, ...]]  # rigid bodies to the markers on them
    arms: tuple[ArmSummary, ...]
    guess: str  # what a search would take, in words
    steps: tuple[str, ...]  # what was found and done on reading, in words

    def to_dict(self) -> dict[str, Any]:
        """All of it as plain JSON values."""
        return dataclasses.asdict(self)


def summarise(recording: Recording) -> Summary:
    """Look a recording over.

    Args:
        recording: In metres with z up.
    """
    guess = guess_of(recording)
    about, time = recording.about, recording.time
    first, *others = recording.points or ("",)
    told = [step.details.get("declared") for step in about.steps if step.name == "rate"]
    declared = next((float(rate) for rate in told if isinstance(rate, int | float)), about.rate)
    words = guess.sentence if guess.arm else f"{guess.sentence}. Name those of the arm to a search, as in {NAMED}"
    in_order = f"Without --base and --points a search takes the base {first} and follows {', '.join(others)}."
    return Summary(
        source=recording.source,
        format=about.format or "recording",
        frames=recording.frames,
        start=float(time[0]),
        duration=float(time[-1] - time[0]),
        rate_declared=declared,
        rate_measured=recording.rate,
        longest_step=float(np.diff(time).max()),
        repeated=sum(gap.stop - gap.first for gap in find_repeats(recording)),
        points=tuple(_coverage(name, values, time) for name, values in recording.points.items()),
        orientations=tuple(_coverage(name, values, time) for name, values in recording.orientations.items()),
        bodies=dict(about.bodies),
        arms=tuple(_arm(arm, recording, about.captured and arm is guess.arm) for arm in guess.arms),
        guess=words if about.captured or not others else in_order,
        steps=(*(step.sentence for step in about.steps), *_unsaid(recording)),
    )


def _unsaid(recording: Recording) -> list[str]:
    """Unit, up axis and time of a recording where no step tells them, with the reason."""
    about = recording.about
    told = {step.name for step in about.steps}
    lines = []
    if about.format and not told & {"units", "up"}:
        lines.append(f"Lengths are in metres and z points up, as {about.format} has them.")
    if about.format and not told & _OF_TIME:
        declared = about.rate is not None
        why = "as the file says" if declared else f"as {recording.rate:.4g} frames/s are usual for a recording"
        lines.append(f"Times are in seconds, {why}.")
    return lines


def summary_text(summary: Summary) -> str:
    """A summary for people."""
    bodies = [
        _wrapped(f"{body}: {', '.join(each) or 'no marker of its own'}", "  ", "    ")
        for body, each in summary.bodies.items()
    ]
    blocks = [
        _heading(summary),
        "\n".join(["Found and done on reading:", *(_wrapped(step, "  - ") for step in summary.steps)])
        if summary.steps
        else "",
        _series_text("point", summary.points),
        _series_text("orientation", summary.orientations),
        "\n".join(["Bodies and the markers on them", *bodies]) if bodies else "",
        _arms_text(summary),
    ]
    return "\n\n".join(block for block in blocks if block)


def _coverage(name: str, values: Array, time: Array) -> Coverage:
    """How much of a series is there."""
    gaps = find_gaps(name, values, time)
    longest = max(gaps, key=lambda gap: gap.length, default=None)
    share = 1.0 - sum(gap.stop - gap.first for gap in gaps) / len(time)
    if longest is None:
        return Coverage(name, share, 0, 0.0, None)
    return Coverage(name, share, len(gaps), longest.length, longest.begins)


def _arm(arm: Arm, recording: Recording, chosen: bool) -> ArmSummary:
    """An arm with the lengths of its segments."""
    segments = []
    for (name, one), (following, other) in itertools.pairwise(arm_paths(arm, recording).items()):
        length = np.linalg.norm(other - one, axis=1)
        length = length[np.isfinite(length)]
        if len(length):
            segments.append(Segment(f"{name} to {following}", float(length.mean()), float(length.std())))
    return ArmSummary(str(arm), arm.base, arm.points, arm.orientation(recording.orientations), tuple(segments), chosen)


def _heading(summary: Summary) -> str:
    """File, format, length and rate."""
    declared = "" if summary.rate_declared is None else f"{summary.rate_declared:.6g} frames/s declared, "
    lines = [
        summary.source,
        f"  {summary.format}, {summary.frames} frames over {seconds(summary.duration)}, from {seconds(summary.start)}",
        f"  {declared}{summary.rate_measured:.6g} frames/s measured",
    ]
    if summary.longest_step * summary.rate_measured > _HOLE:
        lines.append(f"  longest time from one frame to the next: {seconds(summary.longest_step)}")
    if summary.repeated:
        lines.append(f"  {summary.repeated} frames repeat the one before")
    return "\n".join(lines)


def _wrapped(text: str, first: str, following: str | None = None) -> str:
    """Text in lines of a bearable length."""
    rest = " " * len(first) if following is None else following
    return textwrap.fill(text, _WIDTH, initial_indent=first, subsequent_indent=rest, break_on_hyphens=False)


def _series_text(what: str, series: tuple[Coverage, ...]) -> str:
    """Points with gaps as a table, those without as a list."""
    if not series:
        return ""
    whole = [each.name for each in series if each.gaps == 0]
    never = [each.name for each in series if not each.share]
    broken = [each for each in series if each.gaps and each.share]
    lines = [f"{len(series)} {what}{'s' if len(series) > 1 else ''}, {len(whole)} of them always seen"]
    if whole:
        lines.append(_wrapped(", ".join(whole), "  "))
    if never:
        lines.append(_wrapped(f"never seen: {', '.join(never)}", "  ", "    "))
    if broken:
        width = max(len("with gaps"), *(len(each.name) for each in broken))
        lines.append(f"  {'with gaps':<{width}}       seen   gaps  longest [s]  from [s]")
        for each in broken:
            at = 0.0 if each.at is None else each.at
            share = f"{100 * each.share:.1f}"  # 100.0 or 0.0 only where it is all or nothing
            share = {"100.0": "> 99.9", "0.0": "< 0.1"}.get(share, share) if 0 < each.share < 1 else share
            lines.append(f"  {each.name:<{width}}  {share:>7} %  {each.gaps:5d}  {each.longest:11.3f}  {at:8.3f}")
    return "\n".join(lines)


def _arms_text(summary: Summary) -> str:
    """The arms with their segments, and how to ask for them."""
    chosen = any(arm.chosen for arm in summary.arms)
    title = "Arms by the names of the points; a search takes the one marked * if it is not told otherwise"
    lines = [_wrapped(title, "") if chosen else _wrapped(summary.guess.rstrip(".") + ".", "")]
    for arm in summary.arms:
        lines.append(f"{'*' if arm.chosen else ' '} {arm.what}")
        lines += [f"    {s.name:<24} {s.mean:6.3f} m +- {s.spread:.3f} m" for s in arm.segments]
        flags = [f"--base {shlex.quote(arm.base)}", f"--points {shlex.quote(','.join(arm.points))}"]
        flags += [f"--orientation {arm.orientation}"] if arm.orientation else []
        line = "    " + " ".join(flags)
        lines.append(line if len(line) <= _WIDTH else "    " + " \\\n    ".join(flags))  # the shell joins them
    return "\n".join(lines)
