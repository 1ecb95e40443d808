"""What the report begins with: the verdict in words, four answers to the questions behind it, and what to do next."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.bodies.exact import carriers
from armdesign.building.build import Build
from armdesign.building.record import Origin
from armdesign.errors import counted
from armdesign.feasibility.needs import SLIDING, TURNING, joint_needs
from armdesign.feasibility.verdict import Verdict, exact_obstacles
from armdesign.feasibility.violations import figure, share
from armdesign.feasibility.words import (
    conclusion,
    pace,
    place_words,
    possible_speed,
    sentence,
    speed_words,
    spread_words,
    tolerance_words,
)
from armdesign.kinematics.base_pose import BasePose
from armdesign.runs.folder import ALTERNATIVES
from armdesign.search.result import Result, done
from armdesign.settings import Body, Settings
from armdesign.views.report.gaps import Near
from armdesign.views.report.others import OTHERS, OtherArm

STANDS = 2e-3
"""What is no further off carries the base [m]; and what a surface may be tilted."""
EDGE = 5e-4
"""A base that is no further from a bound of its region stands at its edge [m]."""
WORDS = {"good": "Yes", "part": "Yes, with limits", "open": "Not judged", "bad": "No"}
"""Whether an arm does the job, by what a page marks it with."""
ON = {"floor": "standing upright", "wall": "mounted on a wall, its axis level", "ceiling": "hanging, its axis down"}


class Answer(NamedTuple):
    """What the head of the page says to one question.

    Attributes:
        question: The question.
        figure: The answer in a figure.
        words: The answer in a sentence or two.
        good: Whether that is as asked for; None where nothing is asked for or known.
        part: Whether it limits a job that is done.
    """

    question: str
    figure: str
    words: str
    good: bool | None = None
    part: bool = False


class Worst(NamedTuple):
    """Where the tool is furthest from the hand.

    Attributes:
        error: How far [m].
        frame: The frame.
        time: Its time in the demonstration [s].
        demonstration: In which demonstration, from 0.
        name: That demonstration's name; empty where there is but one.
    """

    error: float
    frame: int
    time: float
    demonstration: int = 0
    name: str = ""

    @property
    def at(self) -> str:
        """When that is, in words."""
        return f"at {self.time:.2f} s" + (f" of {self.name}" if self.name else "")


class NextStep(NamedTuple):
    """Something to do with the arm.

    Attributes:
        text: What and why.
        code: The command.
    """

    text: str
    code: str


def worst_frame(run: Result) -> Worst:
    """Where the tool is furthest from the hand, over all demonstrations."""
    several = len(run.problem.demonstrations) > 1
    pairs = zip(run.problem.demonstrations, run.evaluation.demonstrations, strict=True)
    found = []
    for k, (each, scored) in enumerate(pairs):
        followed = done(run.table, each, scored, several=several)
        frame = int(followed.miss.argmax())
        found.append(Worst(float(followed.miss[frame]), frame, float(followed.time[frame]), k, followed.name))
    return max(found, key=lambda one: one.error)


def plain_verdict(run: Result, worst: Worst, smooth: Array, made: Build | None = None) -> tuple[str, str]:
    """Whether the arm does the job, in a sentence that needs no other, and what is not known or kept all the same.

    The sentence is the second; the first, what it comes to, is one of ``WORDS``.

    Args:
        run: The run.
        worst: Where the error is largest.
        smooth: How far the tool is off on the smooth motion that is exported, in every frame, shape (T,) [m].
        made: Its parts, where it is a build.
    """
    if made is not None and made.fault:
        return "bad", f"{made.warning}."
    verdict, needs, judged = run.verdict, run.problem.settings.needs, (run if made is None else made).judged
    tolerance, allowed = needs.hand_tolerance, tolerance_words(needs)
    off = f"{figure(1e3 * worst.error, None if tolerance is None else 1e3 * tolerance)} mm"
    exported = "" if kept_when_smooth(worst, float(smooth.max())) else figure(1e3 * float(smooth.max()))
    off += f" as solved, {exported} mm as its motion is exported" if exported else ""
    if not verdict.feasible:
        also = f" It follows the hand to {off}." if verdict.tolerance_met is not False else ""
        return "bad", f"This arm cannot do the job as it is.{also}"
    also = "" if run.located else " Where it stands has not been checked."
    if verdict.tolerance_met is None:
        return "open", f"This arm follows the hand to {off}. Nobody has said how much is allowed.{also}"
    if verdict.tolerance_met:
        kind, fraction = conclusion(verdict, judged), possible_speed(verdict, judged)
        slow = "" if fraction >= 1.0 else f", at {pace(fraction)} of the speed shown"
        slow = slow if fraction > 0.0 else ", but its joints cannot at any speed"
        if tolerance is not None and share(smooth, needs.tolerance_percentile) > tolerance:
            kind, also = "part" if kind == "good" else kind, f" As exported it is beyond that.{also}"
        return kind, f"This arm does the job{slow}: it follows the hand to {off}; {allowed} are allowed.{also}"
    words = f"This arm misses the hand by up to {off}; {allowed} are allowed. All else that was asked for is kept."
    return "bad", words


def kept_when_smooth(worst: Worst, smooth: float) -> bool:
    """Whether the smooth motion that is exported is off by no more than the solved one, in the figures shown."""
    return smooth <= worst.error or figure(1e3 * smooth) == figure(1e3 * worst.error)


def story(run: Result, worst: Worst, nearest: Sequence[Near], smooth: float, origin: Origin | None = None) -> str:
    """The rest of the verdict: where the error is largest, where it stands, what it clears, how fast it is.

    Args:
        run: The run.
        worst: Where the error is largest.
        nearest: What comes nearest to what, the least first.
        smooth: How far the tool is off on the smooth motion that is exported, at worst [m].
        origin: The design that it is built after, where that is known.
    """
    verdict = run.verdict
    parts = [f"It is furthest off {worst.at}, on average {figure(1e3 * verdict.hand_error.mean)} mm."]
    if kept_when_smooth(worst, smooth):  # else it is in the headline
        parts.append(f"Its exported motion, which is smooth, is off by up to {figure(1e3 * smooth)} mm.")
    if origin is not None:
        parts.append(
            f"As designed it follows the hand to {figure(1e3 * origin.error)} mm, as built to "
            f"{figure(1e3 * verdict.hand_error.max)} mm."
        )
    if run.base_pose.frame == "room":
        parts.append(f"It stands {standing(run)}.")
    if not nearest and run.problem.settings.body.kind != "thin":
        parts.append("What it touches is not known.")
    elif not nearest:
        parts.append("It was searched as lines without bodies, so what it touches is not known.")
    elif nearest[0].value <= 0.0:
        parts.append(f"It touches: {nearest[0].words}.")
    else:
        body = run.problem.settings.body
        short = [near for near in nearest if near.short(body.clearance)]
        least = (short or nearest)[0]
        less = f", too near ({required(body, [least])})" if short else ""
        parts.append(f"Nearest to touching: {least.words}{less}.")
    fraction, span = verdict.speed_fraction, run.problem.task.time
    if fraction == 0.0:
        parts.append("Its joints cannot do this at any speed.")
    elif fraction >= 1.0:
        parts.append("It keeps the demonstrated pace.")
    else:
        seconds = float(span[-1] - span[0])
        parts.append(
            f"{motors(run)} it takes {figure(seconds / fraction)} s for what was shown in {figure(seconds)} s: "
            f"{pace(fraction)} of the speed."
        )
    return " ".join(parts)


def motors(run: Result) -> str:
    """The speeds that the pace rests on, as the beginning of a sentence."""
    limits = joint_needs(run.problem.settings)
    if limits.speed is not None:
        return "With the stated joints"
    turning = [] if limits.prismatic.all() else [f"{np.rad2deg(TURNING):g} deg/s"]
    return f"With joints of {' and '.join([*turning, *([f'{SLIDING:g} m/s'] if limits.prismatic.any() else [])])}"


def standing(run: Result) -> str:
    """On what an arm with a place in the room stands, with its coordinates."""
    base = run.base_pose
    on = {"floor": "upright", "wall": "on a wall", "ceiling": "hanging"}[base.mounted]
    obstacles = run.problem.first.obstacles
    for one, carries in zip(obstacles.each, carriers(exact_obstacles(obstacles), base.matrix), strict=True):
        on = f"on the {one.name}" if carries else on
    return f"{on}, at {place_words(base).replace('-', '−')} in the recording's room"


def next_steps(
    run: Result, others: Sequence[OtherArm], made: Build | None = None, origin: Origin | None = None
) -> list[NextStep]:
    """What to do with the arm now, the most useful first, four at the most.

    Args:
        run: The run.
        others: Other arms that lie in its folder.
        made: Its parts, where it is a build.
        origin: The design that it is built after, where that is known.
    """
    verdict, settings, facts = run.verdict, run.problem.settings, run.facts
    folder = str(run.folder or run.name)
    place, config = shlex.quote(folder), shlex.quote(f"{folder}/settings.toml")
    found = []
    further = shlex.quote(f"{folder}-{run.table.dof + 1}")
    tolerance = settings.needs.hand_tolerance
    if tolerance is not None and not verdict.passed:
        fit = [arm for arm in others if arm.place and arm.error is not None and arm.error <= tolerance]
        for arm in sorted(fit, key=lambda each: each.error or 0.0)[:1]:
            text = f"Look at {arm.name}: it keeps the tolerance, {figure(1e3 * (arm.error or 0.0))} mm at worst."
            found.append(NextStep(text, f"armdesign report {shlex.quote(f'{folder}/{arm.place}')}"))
        if not fit and run.folder is not None and (run.folder / ALTERNATIVES).is_file():
            text = "Look at the other arms of this search: one may be better where it matters to you."
            found.append(NextStep(text, f"armdesign alternatives {place}"))
    if facts is not None and facts.agreement is not None and facts.agreement.agreeing < 2:
        more = f"armdesign search --resume {place} --budget {3000 * max(1, round(facts.evaluations / 1000))}"
        found.append(NextStep("Search on: this search is not sure that there is no better arm.", more))
    if made is not None and made.fault:
        words, _, command = made.remedy(origin.run if origin else "RUN").partition("\n")
        found += [NextStep(words.replace(":", "."), command.strip())] if words else []
    if not verdict.passed and facts is not None:
        text = f"Give it a joint more: {counted(run.table.dof + 1, 'joint')}."
        code = f"armdesign search --config {config} --dof {run.table.dof + 1} --out {further}"
        found += [] if any(settings.design.prismatic) else [NextStep(text, code)]
    if settings.body.kind == "thin":
        text = "Give it a body: this arm was searched as lines, which may run into each other."
        found.append(NextStep(text, f"armdesign check {place} --body tube"))
    if verdict.tolerance_met is None:
        text = "Say how far the tool may be off; the verdict then says whether that is kept."
        found.append(NextStep(text, f"armdesign check {place} --tolerance 10mm"))
    if verdict.passed and not (made is not None and made.fault):
        found.append(NextStep("See it move, with the person beside it.", f"armdesign preview {place}"))
        if made is not None:
            text = "Have the drawings and solids of its parts; the lists of what to order and to cut are below."
            found.append(NextStep(text, f"armdesign export {place} --format drawing,step"))
            found.append(NextStep("See how exactly its parts have to be made.", f"armdesign tolerance {place}"))
        else:
            found.append(
                NextStep("Pick motors and tubes, with a list of parts.", f"armdesign build {place} --catalogue rmd")
            )
        found.append(NextStep("Hand it to a simulator or a planner.", f"armdesign export {place} --package my_arm"))
        text = "Hold it against robots that can be bought; the report then shows both."
        found.append(NextStep(text, f"armdesign compare {place} ur5 panda --json {shlex.quote(folder + '/' + OTHERS)}"))
    else:
        found.append(NextStep("See where it fails.", f"armdesign preview {place}"))
    return found[:4]


def answers(run: Result, worst: Worst, nearest: Sequence[Near]) -> list[Answer]:
    """What the head of the page says of a run, a question each.

    Args:
        run: The run.
        worst: Where the error is largest.
        nearest: What comes nearest to what, the least first.
    """
    verdict, settings = run.verdict, run.problem.settings
    stand = place(run.base_pose, run.problem.task.base)
    return [
        job(verdict, settings, worst),
        stand._replace(words=f"{stand.words}{at_the_edge(run)}", part=not run.located),
        touching(nearest, settings),
        fast(verdict, settings),
    ]


def job(verdict: Verdict, settings: Settings, worst: Worst) -> Answer:
    """Whether the hand is followed well enough.

    Args:
        verdict: The verdict.
        settings: What it was judged by.
        worst: Where the error is largest.
    """
    words = f"Hand: {spread_words(verdict.hand_error)}, {worst.at}."
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
    turn = np.rad2deg(np.arctan2(base.rotation[1, 0], base.rotation[0, 0]))
    if base.mounted == "wall":
        turn = np.rad2deg(np.arctan2(base.rotation[1, 2], base.rotation[0, 2]))
    words = f"In the recording's room, {ON[base.mounted]}, turned by {turn:.0f} deg about the vertical."
    return Answer(question, place_words(base).replace("-", "−"), words.replace("-", "−"))


def at_the_edge(run: Result) -> str:
    """Where the base stands on a bound of the region that the search was free to place it in, as a sentence or none."""
    base, problem = run.base_pose, run.problem
    for site in problem.space.sites if base.frame == "room" else ():
        (low, high), at = site.box + problem.in_room.shift, base.translation
        if site.mounted != base.mounted or (at < low - STANDS).any() or (at > high + STANDS).any():
            continue
        ends = [f"{'xyz'[k]} {1e3 * at[k]:.0f} of {1e3 * low[k]:.0f} to {1e3 * high[k]:.0f} mm" for k in range(3)
                if high[k] > low[k] and min(abs(at[k] - low[k]), abs(high[k] - at[k])) < EDGE]  # fmt: skip
        return f" It is at the edge of where it may stand: {', '.join(ends)}.".replace("-", "−") if ends else ""
    return ""


def touching(nearest: Sequence[Near], settings: Settings) -> Answer:
    """What the arm comes nearest to.

    Args:
        nearest: What comes nearest to what, the least first.
        settings: What it was judged by.
    """
    question = "Does it touch anything?"
    if not nearest and settings.body.kind == "thin":
        return Answer(question, "not known", "The arm was searched as lines, without bodies.")
    if not nearest:
        return Answer(question, "not known", "Its parts do not fit together, or no two of them could touch.")
    least, told = nearest[0], sorted(nearest[:2], key=lambda near: not near.short(settings.body.clearance))
    words = ". ".join(sentence(near.words) for near in told)
    kept = not any(near.short(settings.body.clearance) for near in nearest)
    shown = f"{figure(1e3 * least.value)} mm free" if least.value > 0.0 else "it does"
    return Answer(question, shown, f"{words}. {sentence(required(settings.body, nearest))}.", kept)


def required(body: Body, nearest: Sequence[Near]) -> str:
    """What has to stay free between bodies and between the parts of a build, in a clause.

    Args:
        body: What the arm was judged by.
        nearest: What of it is to be told.
    """
    parts = [near.gap.rule for near in nearest if near.gap is not None][:1]
    if all(near.gap is not None for near in nearest):
        return parts[0]
    whose = "assumed" if body.clearance == Body().clearance else "asked for"
    of = " between housings" if parts else ""
    return "; ".join([*parts, f"{whose}{of}: {1e3 * body.clearance:g} mm"])


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
    what = "force" if slides[strongest] else "torque"
    words += f" Largest {what}: {figure(verdict.peak_torque[strongest])} {unit}, joint {strongest + 1}."
    kept = verdict.speed_fraction >= 1.0 if settings.needs.max_speed is not None else None
    shown = f"{pace(verdict.speed_fraction)} of the speed shown" if verdict.speed_fraction > 0.0 else "at no speed"
    return Answer("How fast is it?", shown, words, kept, kept is None and verdict.speed_fraction < 1.0)
