"""What the report says in words and tables: settings, assumptions, and how to run the arm elsewhere."""

from __future__ import annotations

import re
import shlex
from collections.abc import Collection, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.bodies.loads import base_gravity
from armdesign.export.formats import FORMATS
from armdesign.export.options import RobotOptions
from armdesign.export.options import assumptions as assumed
from armdesign.export.trajectory.exporting import FILES
from armdesign.export.trajectory.ros2_bag import TRAJECTORY_TOPIC
from armdesign.fitness.constraints import joint_limits
from armdesign.fitness.problem import start_effort
from armdesign.kinematics.base_pose import BasePose
from armdesign.search.result import Result, SearchFacts
from armdesign.settings.kinds import toml_value
from armdesign.settings.sections import SECTIONS, Body, Design, Settings, Solver
from armdesign.views.report.facts import JointLoads

LONG = re.compile(r"-?\d+\.\d{10,}(e-?\d+)?")
"""Numbers with what rounding has left behind."""
UNIT = re.compile(r" ?\[([^\]]+)\]")
ELSEWHERE = {
    "task": ("recording", "files", "base", "points", "orientation"),
    "fitness": ("weights", "orientation_weight"),
}
"""Settings that other parts of the page show."""
ELSEWHERE_SET = {"module_slide": ("--module-slide", "armdesign search"), "post": ("", "")}
"""Of assumptions that the report and export have no option for: the option and the command that has it."""
STOPPED = {
    "iterations": "all iterations were done",
    "budget": "the budget of candidates was spent",
    "agreement": "as many independent starts as were asked for have ended in the same best fitness",
    "patience": "there was no gain of 0.1 % for as many iterations as were to be waited",
    "target": "the target was reached",
    "time_limit": "the time limit was reached",
    "interrupted": "it was interrupted",
}
REMOVED = {
    "constraints": "outside the bounds, of a length that is not allowed, or with two joints on one axis",
    "reach": "too short for the hand's first point",
    "start": "without a pose that brings the end-effector to the hand's first point",
    "pruned": "dropped before the end of the motion, as their error up to there was larger than that of a better arm",
    "path": "losing the hand in a later frame, where every frame has to reach it",
}


BEYOND = 0.05
"""What a joint may be beyond a limit before it is said [deg; mm]."""
RESTS = 0.5
"""A joint that comes to its limit counts as there while it is no further from it [deg; mm]."""
NEAR_LIMIT = 0.01
"""Share of its range within which a joint is near its limit."""
MOST_LETTERS = 200
"""Of a setting's value that are shown."""
TERMS = (
    ("demonstration", "What the person did, as it was recorded; its points are named places on the person's arm."),
    ("hand, tool", "The last of these points, and the end of the robot arm that has to follow it."),
    ("error", "The distance from a point of the person to its place on the arm; of the hand, to the tool."),
    ("f", "The error of all points in one figure: their weighted distances, averaged over the motion (eq. 3)."),
    ("E", "How far the arm is on average from the person's, along all of its length (eq. 5)."),
    ("r", "What the search makes as small as it can: a weighted sum of f and E (eq. 6). Only its order matters."),
    ("DH table", "The arm in four numbers a joint: twist alpha and distance a from the axis before, the offset d "
     "along the axis, and q, by which the joint turns. In Craig's modified form, and in the classic one."),
    ("joint module", "Motor, gear and bearing of a joint, one cylinder about its axis."),
    ("clearance", "The least gap between solids over the whole motion, between the frames, too."),
    ("independent start", "The search starts over again and again, each time knowing nothing of what it has found. "
     "Where several end in one arm, a better one is unlikely; p is how often that is wrong."),
    ("feasible", "It touches nothing, stands where it may, and keeps all stated limits. An assumed speed is "
     "none of these: where joints cannot follow with it, the verdict says at which share of the speed they can."),
)  # fmt: skip
"""The words of the page that not everybody knows, each explained once."""


class Setting(NamedTuple):
    """A setting that is not at its default."""

    name: str
    value: str
    default: str
    doc: str


class Assumption(NamedTuple):
    """A number that was assumed."""

    name: str
    value: str
    flag: str = ""
    command: str = ""


@dataclass(frozen=True)
class Recipe:
    """A way to use the arm elsewhere.

    Attributes:
        title: The program.
        text: What to know.
        code: What to type.
    """

    title: str
    text: str
    code: str


def changed_settings(settings: Settings) -> list[Setting]:
    """The settings that differ from the defaults, but for those that other parts of the page show or that follow."""
    default, found = Settings(), []
    effort = start_effort(Solver(), settings.design.dof)._asdict()
    for kind in SECTIONS:
        title = kind.title()
        now, before = getattr(settings, title), getattr(default, title)
        for entry in fields(kind):  # type: ignore[arg-type]
            value, usual = getattr(now, entry.name), getattr(before, entry.name)
            if entry.name in ("modules", "inertials"):  # of a build: its parts, listed as such
                continue
            follows = title == "solver" and effort.get(entry.name, object()) == value
            follows |= usual is None and value in (False, "off")  # decided by the recording: nothing is done
            if value == usual or follows or entry.name in ELSEWHERE.get(title, ()):
                continue
            doc = " ".join(str(entry.metadata["doc"]).split())
            value = [Path(each).name for each in value] if entry.name == "obstacles" else value
            found.append(Setting(f"{title}.{entry.name}", shown(value), shown(usual), doc))
    return found


def shown(value: Any) -> str:  # noqa: ANN401 (values of settings)
    """A value as in settings.toml; a long one, such as the designs that a search begins with, by its beginning."""
    text = "not set" if value is None else toml_value(value)
    text = LONG.sub(lambda found: f"{float(found.group()):.9g}", text)
    return text if len(text) <= MOST_LETTERS else f"{text[:MOST_LETTERS]} ..."


def freedom(design: Design) -> list[str]:
    """What the search was free to choose, in sentences."""
    alpha, a, d, length = (pair(getattr(design, name)) for name in ("alpha", "a", "d", "length"))
    yaw = design.base_yaw
    sentences = [
        f"The twists alpha lie within {alpha} deg, the link lengths a within {a} m and the offsets d within {d} m; "
        f"the tool is {1e3 * design.tool_length:g} mm long, the first row only turns.",
        f"The whole arm is {length} m long, tool included. Its base is "
        + ("not turned about z." if yaw == (0.0, 0.0) else f"turned by {pair(yaw)} deg about z."),
        "Joints turn within "
        + (
            f"{pair(design.joint_limits[0])} deg."
            if len(set(design.joint_limits)) == 1
            else ", ".join(f"{pair(limits)} (J{i})" for i, limits in enumerate(design.joint_limits, start=1)) + " deg."
        ),
    ]
    if any(design.prismatic):
        limits = joint_limits(design)
        slides = [f"{pair(limits[i])} m (J{i + 1})" for i in np.flatnonzero(design.prismatic)]
        turns = [f"{pair(np.rad2deg(limits[i]))} deg (J{i + 1})" for i in np.flatnonzero(~np.array(design.prismatic))]
        said = [f"Joints turn within {', '.join(turns)}." if turns else "", f"Joints slide within {', '.join(slides)}."]
        sentences[-1] = " ".join(said).strip()
    if design.bounds:
        entries = ", ".join(f"{name} within {pair(bounds)}" for name, bounds in design.bounds.items())
        sentences.append(f"Bounds of single entries [deg, m]: {entries}.")
    return sentences


def pair(ends: Sequence[float] | Array) -> str:
    """Two bounds."""
    return f"{ends[0]:g} to {ends[1]:g}".replace("-", "−")


def unused(run: Result, *, built: bool) -> set[str]:
    """Names of the assumptions that a run does not rest on: what its task states, or its parts have.

    Args:
        run: The run.
        built: Whether it is made of known parts.
    """
    needs, slides = run.problem.settings.needs, run.table.prismatic
    left_out = {"actuator_speed": needs.max_speed is not None or all(slides),
                "actuator_torque": needs.max_torque is not None or all(slides),
                "slide_speed": not any(slides), "slide_force": not any(slides)}  # fmt: skip
    body = [each.name for each in fields(Body)] if built else []
    return {*body, *(name for name, unused in left_out.items() if unused)}


def assumptions(options: RobotOptions, base: BasePose, unused: Collection[str] = ()) -> list[Assumption]:
    """Every number behind masses, speeds, torques and robot files that was assumed, not searched or measured.

    Args:
        options: What is assumed.
        base: How the arm is mounted, so where gravity pulls.
        unused: Names of what this arm does not rest on; what is not set is left out, too.
    """
    rows = []
    for option in assumed(options):
        if option.name in unused or option.value is None:
            continue
        unit = UNIT.search(option.doc)
        value = f"{option.value:g} {unit.group(1) if unit else ''}"
        value = ("yes" if option.value else "no") if isinstance(option.value, bool) else value
        text = " ".join(UNIT.sub("", option.doc).split()).rstrip(".")
        rows.append(Assumption(text, value.strip(), *ELSEWHERE_SET.get(option.name, (option.flag, ""))))
    pull = base_gravity(base)
    along = [(axis, f"{g:.4g}") for axis, g in zip("xyz", pull, strict=True) if abs(g) > 1e-3 * np.linalg.norm(pull)]
    axes, gravity = (", ".join(each) for each in zip(*along, strict=True))
    return [
        *rows,
        Assumption(f"Gravity, along the base's {axes}", f"{gravity} m/s^2".replace("-", "−")),
        Assumption("Friction and rotor inertia in the torques; a margin has to cover them", "none"),
    ]


def weights_sentence(run: Result) -> str:
    """What counts how much."""
    fitness, task = run.problem.settings.fitness, run.problem.task
    parts = [f"{name} {w:.3g}" for name, w in zip(task.points, fitness.weights, strict=True)]
    if fitness.orientation_weight:
        parts.append(f"orientation of {task.orientation or task.points[-1]} {fitness.orientation_weight:.3g}")
    return f"Weights: {', '.join(parts)}."


def source_sentences(run: Result) -> list[str]:
    """The files that the recording was read from, without the folders they were in."""
    sentences = []
    for source in run.problem.first.provenance.sources:
        if source.path:
            name = source.path.replace("\\", "/").rpartition("/")[2]
            digest = f" (SHA-256 {source.sha256[:16]}...)" if isinstance(source.sha256, str) else ""
            sentences.append(f"Recorded in {name}{digest}.")
    return sentences


def trust(facts: SearchFacts) -> str:
    """How sure the search is that there is no better arm, in words for everybody."""
    known = facts.agreement
    if known is None:
        return f"The algorithm {facts.algorithm} cannot tell whether there is a better arm; multibasin can."
    if not known.beginnings:
        return (
            "The search ended too early to say how good this arm is beside the best possible. A larger budget may "
            "find a better one."
        )
    return facts.found


def search_sentences(facts: SearchFacts, run: Result) -> list[str]:
    """How the search went."""
    search = run.problem.settings.search
    each = f"{facts.evaluations / facts.wall_time:,.0f}" if facts.wall_time > 0.0 else "any number"
    return [
        f"{facts.evaluations:,} candidate arms in {duration(facts.wall_time)}, {each} a second.",
        f"It ended since {STOPPED.get(facts.stopped_by, facts.stopped_by)}.",
        f"Algorithm {facts.algorithm}, {search.size}, seed {facts.seed}; {run.progress} done.",
        f"From iteration {facts.converged_at} on the best arm was within 1 % of the last; up to there "
        f"{facts.computational_effort:,.0f} candidates had been valid (the paper's computational effort).",
    ]


def limit_sentences(run: Result, loads: JointLoads) -> list[str]:
    """Which joints go beyond their limits or come near them: angles or travel, speed, torque.

    Args:
        run: The run.
        loads: What its motion asks of the joints.
    """
    q, limits = loads.motion.q, loads.limits
    room = np.minimum(limits.position[:, 1] - q.max(axis=0), q.min(axis=0) - limits.position[:, 0])
    found = []
    for i, spare in enumerate(room.tolist()):
        factor, unit = (1e3, "mm") if loads.prismatic[i] else (float(np.rad2deg(1.0)), "deg")
        at_top = limits.position[i, 1] - q[:, i].max() <= q[:, i].min() - limits.position[i, 0]
        end = float(q[:, i].max() if at_top else q[:, i].min())
        limit = float(limits.position[i, 1 if at_top else 0])
        said = f"{factor * end:.1f} {unit} against a limit of {factor * limit:g} {unit}".replace("-", "−")
        if spare < -BEYOND / factor:
            found.append(f"Joint {i + 1} goes to {said}.")
        elif spare <= BEYOND / factor:
            ends = [(float(b), np.abs(q[:, i] - b) <= RESTS / factor) for b in limits.position[i]
                    if (np.abs(q[:, i] - b) <= BEYOND / factor).any()]  # fmt: skip
            said = " and ".join(f"{factor * b:g} {unit}, {spells(loads.time, at)}" for b, at in ends)
            found.append(f"Joint {i + 1} is at its limit of {said}.".replace("-", "−"))
        elif spare < NEAR_LIMIT * np.ptp(limits.position[i]):
            found.append(f"Joint {i + 1} comes near its limit: {said}.")
    if not found:
        found.append("Every joint stays well within its range.")
    for what, values, bounds in (
        ("speed", np.abs(loads.motion.v).max(axis=0), limits.velocity),
        ("torque", np.abs(loads.torque).max(axis=0), limits.effort),
    ):
        over = [f"joint {i + 1} ({100 * values[i] / bounds[i]:.0f} %)" for i in np.flatnonzero(values > bounds)]
        if over:
            found.append(f"At the demonstrated pace more {what} is needed than the limit: {', '.join(over)}.")
    return found


def spells(time: Array, inside: Array) -> str:
    """When something holds, in words: from when to when, at most three times; "at" where it is one frame.

    Args:
        time: Times of the frames, shape (T,) [s].
        inside: In which it holds, shape (T,), in one at least.
    """
    edges = np.flatnonzero(np.diff(np.r_[False, inside, False].astype(int))).reshape(-1, 2) - [0, 1]
    said = [f"at {time[a]:.2f} s" if a == b else f"from {time[a]:.2f} to {time[b]:.2f} s" for a, b in edges]
    more = f" and {len(said) - 3} times more" if len(said) > 3 else ""
    return ", ".join(said[:3]) + more


def whose_limits(run: Result, options: RobotOptions, *, built: bool) -> str:
    """Where the limits of speed and torque are from, in a sentence.

    Args:
        run: The run.
        options: What is assumed.
        built: Whether it is made of known parts.
    """
    needs = run.problem.settings.needs
    states = {"speed": needs.max_speed is not None, "torque": needs.max_torque is not None}
    assumed = "what this motion needs, with a margin" if options.limits.margin else "those of an assumed actuator"
    if built:
        return "Speed and torque limits are those of its motors."
    if len(set(states.values())) == 1:
        return f"Speed and torque limits are {'those that the task states' if states['speed'] else assumed}."
    stated, other = sorted(states, key=lambda what: not states[what])
    return f"{stated.capitalize()} limits are those that the task states, {other} limits {assumed}."


def duration(seconds: float) -> str:
    """A time in words."""
    if seconds < 60.0:
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes} min" if hours else f"{minutes} min {rest} s"


def recipes(run: Result) -> list[Recipe]:
    """How to run the arm elsewhere."""
    folder = str(run.folder or run.name)
    place, urdf = shlex.quote(folder), shlex.quote(f"{folder}/arm.urdf")
    mjcf, motion = (shlex.quote(f"{folder}/export/{name}") for name in (FORMATS["mjcf"][0], FILES["ros"]))
    return [
        Recipe(
            "See it move",
            "In the browser, with play, pause and a slider; with --html FILE as one file to mail.",
            f"armdesign preview {place}",
        ),
        Recipe(
            "Pinocchio",
            "The URDF lies in the run folder; its frame tool0 is the end-effector.",
            f"import pinocchio as pin\n\nmodel = pin.buildModelFromUrdf({f'{folder}/arm.urdf'!r})\n"
            "data = model.createData()\npin.framesForwardKinematics(model, data, pin.neutral(model))\n"
            'print(data.oMf[model.getFrameId("tool0")])',
        ),
        Recipe(
            "MuJoCo",
            "As MJCF, with position actuators.",
            f"armdesign export {place} --format mjcf\npython -m mujoco.viewer --mjcf={mjcf}",
        ),
        Recipe(
            "ROS 2",
            "The model in RViz; the demonstrated motion, sent to a joint trajectory controller.",
            f"ros2 launch urdf_tutorial display.launch.py model:=$(realpath {urdf})\n"
            f"armdesign export {place} --trajectory ros\n"
            f"ros2 topic pub --once {TRAJECTORY_TOPIC} "
            f'trajectory_msgs/msg/JointTrajectory "$(cat {motion})"',
        ),
        Recipe(
            "Gazebo, xacro, tables",
            "SDF, a xacro with ros2_control, the DH table; the motion as CSV, NPZ or a bag. The options named under "
            "Assumptions below change what is assumed.",
            f"armdesign export {place} --format sdf,dh-csv\n"
            f"armdesign export {place} --format xacro --ros2-control gazebo\n"
            f"armdesign export {place} --trajectory csv,npz,ros2-bag",
        ),
    ]
