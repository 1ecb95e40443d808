"""What is asked of an arm and not kept, in sentences with the figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.errors import counted
from armdesign.feasibility.demand import JointDemand
from armdesign.feasibility.needs import UNITS, JointNeeds
from armdesign.kinematics.base_pose import MOUNTINGS, BasePose
from armdesign.settings.place import NEAR_TASK, Site, sites
from armdesign.settings.sections import Cell, Needs

ROUNDED = 1e-6
"""How far outside of its place a base may be for rounding [m, rad]."""
FULL_TURNS = (-2.0 * np.pi, 0.0, 2.0 * np.pi)
VERBS = {"max_speed": "moves at", "max_acceleration": "accelerates at", "max_torque": "needs"}


@dataclass(frozen=True, eq=False)
class Followed:
    """What an arm does on one demonstration.

    Attributes:
        time: Times of the frames, shape (T,) [s].
        q: Joint angles, shape (T, n) [rad].
        miss: Distance of the end-effector from the hand, shape (T,) [m].
        angle: Angle between their orientations, shape (T,) [rad]; None where no orientation is followed.
        name: What the demonstration is called, where there are several.
    """

    time: Array
    q: Array
    miss: Array
    angle: Array | None = None
    name: str = ""


@dataclass(frozen=True)
class Gap:
    """Where two bodies come nearest.

    Attributes:
        value: Their distance, negative where they are inside one another [m].
        frame: The frame it is in, or before it, from 0.
        bodies: Their names.
        time: When, in the demonstration [s].
        demonstration: In which one, from 0.
    """

    value: float
    frame: int
    bodies: tuple[str, str]
    time: float
    demonstration: int = 0


@dataclass(frozen=True)
class Violation:
    """Something that is asked for and not kept.

    Attributes:
        sentence: What, in words.
        excess: How far beyond what is allowed, as a multiple of that.
        touches: Whether bodies are inside one another, which comes first whatever the excess.
    """

    sentence: str
    excess: float
    touches: bool = False


def share(errors: Array, percent: float) -> float:
    """The least value that an error does not exceed in a share of the frames.

    Args:
        errors: The error in every frame, shape (T,).
        percent: The share [%].
    """
    return float(np.percentile(errors, percent, method="inverted_cdf"))


def hand_violations(followed: Sequence[Followed], needs: Needs) -> list[Violation]:
    """Tolerances of the hand that are not kept, each in the demonstration where it is worst.

    Args:
        followed: What the arm does on each demonstration.
        needs: The tolerances.
    """
    found = []
    if needs.hand_tolerance is not None:
        errors = [1e3 * each.miss for each in followed]
        found += missed("The hand", errors, followed, (1e3 * needs.hand_tolerance, needs.tolerance_percentile, "mm"))
    if needs.tolerance_angle is not None:
        errors = [np.rad2deg(each.angle) for each in followed if each.angle is not None]
        allowed = (needs.tolerance_angle, needs.tolerance_percentile, "deg")
        found += missed("Its orientation", errors, followed, allowed)
    return found


def missed(
    what: str, errors: Sequence[Array], followed: Sequence[Followed], allowed: tuple[float, float, str]
) -> list[Violation]:
    """The violation of one tolerance, or nothing.

    Args:
        what: What misses.
        errors: By how much, in every frame of each demonstration, in the unit of the tolerance.
        followed: The demonstrations.
        allowed: The tolerance, in which share of the frames it counts [%], and its unit.
    """
    tolerance, percent, unit = allowed
    values = [share(series, percent) for series in errors]
    worst = int(np.argmax(values))
    value, each = values[worst], followed[worst]
    if value <= tolerance:
        return []
    at = f"at {each.time[int(np.argmax(errors[worst]))]:.2f} s"
    when = at if percent == 100.0 else f"or more in {100.0 - percent:g} % of the frames"
    where = f" of {each.name}" if each.name else ""
    sentence = f"{what} misses by {figure(value, tolerance)} {unit} {when}{where}; {tolerance:g} {unit} are allowed."
    return [Violation(sentence, value / tolerance - 1.0)]


def demand_violations(demand: JointDemand, limits: JointNeeds) -> list[Violation]:
    """Stated speeds, accelerations and torques that are not kept, for each the joint that is furthest beyond.

    Args:
        demand: What the joints have to do.
        limits: What is stated.
    """
    found = []
    pairs = ((demand.speed, limits.speed), (demand.acceleration, limits.acceleration), (demand.torque, limits.torque))
    for (name, units), (series, stated) in zip(UNITS.items(), pairs, strict=True):
        if stated is None:
            continue
        peaks = np.abs(series).max(axis=0)
        joint, beyond = int(np.argmax(peaks / stated)), int((peaks > stated).sum())
        if not beyond:
            continue
        slides = bool(limits.prismatic[joint])
        factor = 1.0 if slides or name == "max_torque" else np.rad2deg(1.0)
        peak, allowed, unit = factor * peaks[joint], factor * stated[joint], units[slides]
        more = f" (beyond it, too: {counted(beyond - 1, 'other joint')})" if beyond > 1 else ""
        moves = f"Joint {joint + 1} {VERBS[name]} {figure(peak, allowed)} {unit}"
        words = f"{moves}; {allowed:.6g} {unit} are allowed{more}."
        found.append(Violation(words, float(peaks[joint] / stated[joint]) - 1.0))
    return found


def place_violations(base: BasePose, cell: Cell) -> list[Violation]:
    """A base that stands nowhere it may, or nothing.

    Args:
        base: Where it stands in the room.
        cell: Where it may stand.
    """
    places = sites(cell)
    if not places or any(stands_at(base, site) for site in places):
        return []
    x, y, z = base.translation
    where = "; ".join("anywhere on the floor" if site == NEAR_TASK else str(site) for site in places)
    seen = f"The base stands at x {x:.3f}, y {y:.3f}, z {z:.3f} m, mounted as on a {base.mounted}, which"
    if base.frame != "room":
        seen = "The base moves with the recording's base point, and so"
    return [Violation(f"{seen} is outside of its place: {where}.", 1.0)]


def stands_at(base: BasePose, site: Site) -> bool:
    """Whether a base stands in a site, to a micrometre and a microradian.

    Args:
        base: Where it stands in the room.
        site: The site.
    """
    low, high = site.box
    turn = base.rotation @ MOUNTINGS[site.mounted].T
    yaw = np.arctan2(turn[1, 0], turn[0, 0])
    turned = any(site.yaw[0] - ROUNDED <= yaw + full <= site.yaw[1] + ROUNDED for full in FULL_TURNS)
    inside = (base.translation >= low - ROUNDED).all() and (base.translation <= high + ROUNDED).all()
    return bool(inside and turned and abs(turn[2, 2] - 1.0) <= ROUNDED and base.frame == "room")


def gap_violations(gaps: Sequence[Gap | None], followed: Sequence[Followed], clearance: float) -> list[Violation]:
    """Bodies that come nearer to one another, or to an obstacle, than is asked for.

    Args:
        gaps: Where they come nearest; None where there is nothing to compare.
        followed: What the arm does on each demonstration.
        clearance: The least distance that is asked for [m].
    """
    found = []
    for gap in gaps:
        if gap is not None and gap.value < clearance:
            name = followed[gap.demonstration].name
            where = f"{gap.time:.2f} s{f' of {name}' if name else ''}"
            asked = f"{1e3 * clearance:g} mm are asked for"
            words = f"{gap_words(gap, clearance)} at {where}; {asked}."
            found.append(Violation(words, 1.0 - gap.value / clearance, gap.value < 0.0))
    return found


def envelope_violations(excess: float | None, allowed: float | None) -> list[Violation]:
    """Bodies that leave what the demonstrator's arm has swept by more than is allowed.

    Args:
        excess: By how much they leave it [m]; None for a thin arm.
        allowed: By how much they may [m]; None where that is no matter.
    """
    if excess is None or allowed is None or excess <= allowed:
        return []
    words = f"The arm leaves what the demonstrator's arm has swept by {figure(1e3 * excess, 1e3 * allowed)} mm"
    return [Violation(f"{words}; {1e3 * allowed:g} mm are allowed.", excess / allowed - 1.0)]


def gap_words(gap: Gap, clearance: float | None = None) -> str:
    """Where two bodies come nearest: ``link_2 and table come within 1.20 mm of each other``.

    Args:
        gap: Where.
        clearance: What their distance is held against [m].
    """
    first, second = gap.bodies
    if gap.value < 0.0:
        return f"{first} and {second} are inside one another by {figure(-1e3 * gap.value)} mm"
    return f"{first} and {second} come within {figure(1e3 * gap.value, clearance and 1e3 * clearance)} mm of each other"


def figure(value: float, limit: float | None = None) -> str:
    """A number with about three digits: 0.042, 5.04, 33.0, 910; 0 below half of the fourth decimal.

    Args:
        value: The number.
        limit: What it is held against, with as many more digits as show on which side of that it is.
    """
    decimals = 4 if abs(value) < 5e-5 else min(max(2 - int(np.floor(np.log10(abs(value)))), 0), 4)
    short = "0" if abs(value) < 5e-5 else f"{value:.{decimals}f}"
    longer = (f"{value:.{digits}f}" for digits in range(decimals, 8))
    if limit is None or np.sign(float(short) - limit) == np.sign(value - limit):
        return short
    return next((text for text in longer if np.sign(float(text) - limit) == np.sign(value - limit)), short)
