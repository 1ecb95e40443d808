"""The questions that the report's head answers: whether it does the job, where it stands, what it touches, how fast."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from armdesign.feasibility.needs import joint_needs
from armdesign.feasibility.verdict import Verdict
from armdesign.feasibility.violations import figure, gap_words
from armdesign.feasibility.words import pace, speed_words, spread_words, tolerance_words
from armdesign.kinematics.base_pose import BasePose
from armdesign.search.result import Result
from armdesign.settings import Settings

ON = {"floor": "standing upright", "wall": "mounted on a wall, its axis level", "ceiling": "hanging, its axis down"}


class Answer(NamedTuple):
    """What the head of the page says to one question.

    Attributes:
        question: The question.
        figure: The answer in a figure.
        words: The answer in a sentence or two.
        good: Whether that is as asked for; None where nothing is asked for or known.
    """

    question: str
    figure: str
    words: str
    good: bool | None = None


def answers(run: Result) -> list[Answer]:
    """What the head of the page says of a run."""
    verdict, settings = run.verdict, run.problem.settings
    return [
        job(verdict, settings),
        place(run.base_pose, run.problem.task.base),
        touching(verdict, settings),
        fast(verdict, settings),
    ]


def job(verdict: Verdict, settings: Settings) -> Answer:
    """Whether the hand is followed well enough.

    Args:
        verdict: The verdict.
        settings: What it was judged by.
    """
    words = f"Hand: {spread_words(verdict.hand_error)}."
    if verdict.hand_angle is not None:
        words += f" Orientation: {spread_words(verdict.hand_angle, 'deg', float(np.rad2deg(1.0)))}."
    met = verdict.tolerance_met
    if met is None:
        words += " No tolerance is stated."
    else:
        words += f" {'Within' if met else 'Not within'} the tolerance of {tolerance_words(settings.needs)}."
    return Answer("Does it do the job?", f"{figure(1e3 * verdict.hand_error.max)} mm off at worst", words, met)


def place(base: BasePose, point: str) -> Answer:
    """Where the base stands.

    Args:
        base: Its pose.
        point: Name of the recording's point it stands at, where it is not placed.
    """
    question = "Where does it stand?"
    if base.frame != "room":
        return Answer(
            question, f"at {point}", f"Its base goes wherever the recorded point {point} goes: no fixed place."
        )
    x, y, z = (f"{round(1e3 * value) + 0:d}".replace("-", "−") for value in base.translation.tolist())
    turn = np.rad2deg(np.arctan2(base.rotation[1, 0], base.rotation[0, 0]))
    if base.mounted == "wall":
        turn = np.rad2deg(np.arctan2(base.rotation[1, 2], base.rotation[0, 2]))
    words = f"In the recording's room, {ON[base.mounted]}, turned by {turn:.0f} deg about the vertical."
    return Answer(question, f"x {x}, y {y}, z {z} mm", words.replace("-", "−"))


def touching(verdict: Verdict, settings: Settings) -> Answer:
    """What the arm comes nearest to.

    Args:
        verdict: The verdict.
        settings: What it was judged by.
    """
    question = "Does it touch anything?"
    gaps = [gap for gap in (verdict.self_clearance, verdict.obstacle_clearance) if gap is not None]
    if not gaps:
        return Answer(question, "not known", "The arm was searched as lines, without bodies.")
    least = min(gaps, key=lambda gap: gap.value)
    asked = 1e3 * settings.body.clearance
    words = ". ".join(f"{gap_words(gap)[:1].upper()}{gap_words(gap)[1:]} at {gap.time:.2f} s" for gap in gaps)
    kept = least.value >= settings.body.clearance
    shown = f"{figure(1e3 * least.value)} mm free" if least.value >= 0.0 else "it does"
    return Answer(question, shown, f"{words}. Asked for: {asked:g} mm.", kept)


def fast(verdict: Verdict, settings: Settings) -> Answer:
    """At what share of the demonstrated speed the task can be done, with the peaks of the joints.

    Args:
        verdict: The verdict.
        settings: What it was judged by.
    """
    slides = joint_needs(settings).prismatic
    strongest = int(np.argmax(verdict.peak_torque))
    unit = "N" if slides[strongest] else "N m"
    words = speed_words(verdict, settings)
    words += f" Largest load: {figure(verdict.peak_torque[strongest])} {unit}, joint {strongest + 1}."
    kept = verdict.speed_fraction >= 1.0 if settings.needs.max_speed is not None else None
    shown = pace(verdict.speed_fraction).replace(" of the demonstrated speed", " of the speed shown")
    return Answer("How fast is it?", shown if verdict.speed_fraction > 0.0 else "at no speed", words, kept)
