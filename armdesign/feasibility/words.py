"""The verdict in words: what every summary leads with."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armdesign.feasibility.needs import SLIDING, TURNING, joint_needs
from armdesign.feasibility.verdict import Spread, Verdict
from armdesign.feasibility.violations import figure, gap_words
from armdesign.kinematics.base_pose import MOUNTINGS, BasePose
from armdesign.settings import Settings
from armdesign.settings.sections import Needs

MEANINGS = {
    "r": "what the search minimises",
    "f": "weighted distance of the followed points from the arm",
    "E": "mean distance of the arm from the demonstrator's",
}
"""What the figures of the paper say, in words."""


class Judged(NamedTuple):
    """What the verdict's line is made of beside the verdict.

    Attributes:
        settings: What it was judged by.
        located: Whether the arm's place has been checked, in the room or among obstacles.
        speed: Share of the demonstrated speed to which the motion itself is slowed down, as that of a build.
    """

    settings: Settings
    located: bool
    speed: float = 1.0


def summary(
    verdict: Verdict, judged: Judged, base: BasePose, parts: tuple[float, str] | None = None
) -> tuple[str, ...]:
    """What an arm's summary begins with: the hand's error, the verdict with its reasons, place, gaps and speeds.

    Args:
        verdict: The verdict.
        judged: What it was judged by.
        base: Where the arm stands.
        parts: How near the parts of a build come [m], and the sentence that says so; None of other arms.
    """
    lines = [f"{hand_words(verdict)}.", f"verdict: {headline(verdict, judged)}."]
    lines += [f"  {reason}" for reason in verdict.reasons]
    lines += [base_words(base)] if base.frame == "room" else []
    gaps = [
        (gap.value, f"on the demonstrated motion {gap_words(gap)}, at {gap.time:.2f} s.")
        for gap in (verdict.self_clearance, verdict.obstacle_clearance)
        if gap is not None and gap.value >= judged.settings.body.clearance  # else it is among the reasons
    ]
    gaps += [] if parts is None else [parts]
    lines += [words for _, words in sorted(gaps)]
    return tuple(map(sentence, (*lines, speed_words(verdict, judged.settings))))


def hand_words(verdict: Verdict) -> str:
    """The hand's error, and that of its orientation where one is followed."""
    angle = verdict.hand_angle
    turned = "" if angle is None else f"; orientation {spread_words(angle, 'deg', float(np.rad2deg(1.0)))}"
    return f"hand error {spread_words(verdict.hand_error)}{turned}"


def spread_words(error: Spread, unit: str = "mm", factor: float = 1e3) -> str:
    """``8.12 mm mean, 21.3 mm (95 %), 33.0 mm largest``: what it stays below in 95 % of the frames in the middle.

    Args:
        error: The error.
        unit: The unit to show it in.
        factor: What it is multiplied by for that.
    """
    mean, p95, largest = (f"{figure(factor * value)} {unit}" for value in (error.mean, error.p95, error.max))
    return f"{mean} mean, {p95} (95 %), {largest} largest"


def conclusion(verdict: Verdict, judged: Judged) -> str:
    """What a verdict comes to: ``good``, ``part`` for a job done with limits, ``open`` without a tolerance, ``bad``.

    Args:
        verdict: The verdict.
        judged: What it was judged by.
    """
    share = possible_speed(verdict, judged)
    if not verdict.passed:
        return "bad"
    if verdict.tolerance_met is None:
        return "open"
    return "bad" if share == 0.0 else "part" if share < 1.0 or not judged.located else "good"


def possible_speed(verdict: Verdict, judged: Judged) -> float:
    """The share of the demonstrated speed at which the joints can do the task, at most 1."""
    return min(1.0, verdict.speed_fraction) * judged.speed


def headline(verdict: Verdict, judged: Judged) -> str:
    """The verdict in a clause, with what limits a job that is done: its speed, and a place that is not checked.

    Args:
        verdict: The verdict.
        judged: What it was judged by.
    """
    fit, kept, settings = verdict.feasible, verdict.tolerance_met, judged.settings
    thin = " as a thin arm, without bodies" if settings.body.kind == "thin" else ""
    what = f"feasible{thin}" if fit else "not feasible"
    if kept is not None:
        joined = {(True, True): ",", (True, False): ", but not", (False, True): ", though", (False, False): ", nor"}
        what += f"{joined[fit, kept]} within the tolerance of {tolerance_words(settings.needs)}"
    if verdict.passed:
        share = possible_speed(verdict, judged)
        slow = f", at {pace(share)} of the demonstrated speed" if share < 1.0 else ""
        what += slow if share > 0.0 else ", but its joints cannot at any speed"
        what += "" if judged.located else "; where it stands is not checked"
    return f"{what}; no tolerance is stated" if kept is None else what


def tolerance_words(needs: Needs) -> str:
    """The stated tolerances: ``5 mm and 3 deg in 95 % of the frames``; empty where none is."""
    given = [] if needs.hand_tolerance is None else [f"{1e3 * needs.hand_tolerance:g} mm"]
    given += [] if needs.tolerance_angle is None else [f"{needs.tolerance_angle:g} deg"]
    every = needs.tolerance_percentile == 100.0 or not given
    frames = "" if every else f" in {needs.tolerance_percentile:g} % of the frames"
    return f"{' and '.join(given)}{frames}"


def sentence(text: str) -> str:
    """A text with a capital letter."""
    return f"{text[:1].upper()}{text[1:]}"


def place_words(base: BasePose) -> str:
    """Where a base stands, as ``x 790, y -500, z 950 mm``."""
    x, y, z = (f"{round(1e3 * value) + 0:d}" for value in base.translation.tolist())
    return f"x {x}, y {y}, z {z} mm"


def base_words(base: BasePose) -> str:
    """Where a base stands in the room."""
    turn = base.rotation @ MOUNTINGS[base.mounted].T
    yaw = float(np.rad2deg(np.arctan2(turn[1, 0], turn[0, 0]))) + 0.0
    return f"The base is at {place_words(base)} in the room, yaw {yaw:.1f} deg, mounted as on a {base.mounted}."


def speed_words(verdict: Verdict, settings: Settings) -> str:
    """How fast the joints move, and at which share of the demonstrated speed they can do the task.

    Args:
        verdict: The verdict.
        settings: What it was judged by.
    """
    limits = joint_needs(settings)
    share = np.array(verdict.peak_speed) / limits.actuator_speed
    joint, peak_share = int(np.argmax(share)), float(share.max())
    slides = bool(limits.prismatic[joint])
    peak = verdict.peak_speed[joint] * (1.0 if slides else float(np.rad2deg(1.0)))
    joints = "within the stated limits the joints"
    if limits.speed is None:
        kinds = [] if limits.prismatic.all() else [f"{np.rad2deg(TURNING):g} deg/s"]
        kinds += [f"{SLIDING:g} m/s"] if limits.prismatic.any() else []
        others = limits.acceleration is not None or limits.torque is not None
        joints = f"joints of {' and '.join(kinds)}{' within the stated limits' if others else ''}"
    fastest = f"Joint {joint + 1} moves at up to {figure(peak)} {'m/s' if slides else 'deg/s'}, "
    fastest += "nearest its limit" if peak_share <= 1.0 else "furthest beyond its limit"
    if verdict.speed_fraction == 0.0:
        return f"{fastest}; {joints} cannot do the task at any speed."
    return f"{fastest}; {joints} do the task at {pace(verdict.speed_fraction)} of the demonstrated speed."


def pace(fraction: float) -> str:
    """A share of the demonstrated speed in percent, rounded down, so that it can be kept; ``100 %`` at the most."""
    percent = 100.0 * min(fraction, 1.0)
    shown = np.floor(percent) if percent >= 10.0 else np.floor(10.0 * percent) / 10.0
    return f"{shown:g} %"
