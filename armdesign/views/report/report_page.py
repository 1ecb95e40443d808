"""The report as one HTML page."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import jinja2
import markupsafe
import numpy as np

from armdesign._version import __version__
from armdesign.building import RECORD
from armdesign.building.build import Build
from armdesign.building.part_lists import cuts, grouped_bill
from armdesign.building.parts import Assembly
from armdesign.building.record import Origin, recorded_build, recorded_origin
from armdesign.errors import ArmDesignError, short_names
from armdesign.export.options import RobotOptions
from armdesign.export.robot_file import resolved_options
from armdesign.export.templates import templates_in
from armdesign.export.trajectory.simulation import Tracking
from armdesign.export.xml_text import rpy
from armdesign.feasibility.violations import figure, share
from armdesign.kinematics.dh import DHTable
from armdesign.search.result import Result, SearchFacts
from armdesign.views.report import plots, words
from armdesign.views.report.answers import WORDS, answers, next_steps, plain_verdict, story, worst_frame
from armdesign.views.report.cell_pictures import cell_pictures
from armdesign.views.report.cell_rendering import cell_rendering, worst_rendering
from armdesign.views.report.facts import (
    FitnessParts,
    JointLoads,
    fitness_parts,
    joint_loads,
)
from armdesign.views.report.gaps import clearances
from armdesign.views.report.others import other_arms, winners
from armdesign.views.report.sketch import sketch_picture
from armdesign.views.report.tracking import tracking_picture

TEMPLATES = Path(__file__).resolve().parent / "templates"
AT_BOUND = 1e-9
SEEN = 1e-3
"""Shorter solids, of offsets that are nearly 0, are not listed [m]."""


def report_html(run: Result, *, options: RobotOptions | None = None, tracking: Tracking | None = None) -> str:
    """The report of a run as one page that needs no network; the same run gives the same page.

    Args:
        run: The run.
        options: What the arm is assumed to be built of and to carry.
        tracking: How it follows the hand in a simulation, from ``armdesign.export.trajectory.simulation.simulate``.
    """
    chosen = resolved_options(options, run)
    payload = chosen.limits.payload or 0.0
    facts, history = run.facts, run.history
    parts, worst, others = fitness_parts(run), worst_frame(run), other_arms(run)
    loads = joint_loads(run, chosen)
    made = recorded_build(run) if run.folder is not None and (run.folder / RECORD).is_file() else None
    origin = recorded_origin(run) if made else None
    near = clearances(run, made)
    pictures = {
        "rendering": cell_rendering(run, made),
        "sketch": sketch_picture(run, built=made is not None),
        "errors": plots.error_picture(run, worst),
        "worst": worst_rendering(run, worst, made),
        "cell": cell_pictures(run),
        "clearance": plots.clearance_picture(run, near),
        "joints": [*plots.joint_pictures(run, loads), plots.limits_picture(run, loads)],
        "fitness": plots.fitness_picture(run, parts),
        "tracking": tracking_picture(run, tracking) if tracking else None,
        "convergence": plots.convergence_picture(history) if history is not None else None,
    }
    context = {
        "run": run,
        "facts": facts,
        "verdict": run.verdict,
        "built": built_words(made, origin) if made else "",
        "fault": made.fault if made else "",
        "verdict_words": WORDS,
        "headline": plain_verdict(run, worst, loads.miss, made),
        "story": story(run, worst, near.least, loads.error, origin),
        "reasons": run.verdict.reasons if len(run.verdict.reasons) > 1 or not run.verdict.feasible else (),
        "answers": answers(run, worst, near.least),
        "steps": next_steps(run, others, made, origin),
        "parts": parts,
        "pictures": pictures,
        "version": __version__,
        "made_by": run.version,
        "figures": key_figures(run, loads, payload),
        "points": point_rows(run, parts),
        "demonstrations": demonstration_rows(run),
        "modified": modified_rows(run.table, bound_marks(run, facts)),
        "classic": run.table.to_classic().rows.tolist(),  # alpha, a, d, theta [rad, m, m, rad]
        "solids": [] if made else solid_rows(run),
        "joints": joint_rows(loads),
        "limits": words.limit_sentences(run, loads),
        "whose_limits": words.whose_limits(run, chosen, built=made is not None),
        "lag": loads.lag,
        "free": loads.free,
        "masses": loads.masses,
        "payload": payload,
        "others": others,
        "winners": winners(others),
        "orientation": orientation_row(run),
        "mount": np.rad2deg(rpy(run.evaluation.path.mount)),
        "assumptions": words.assumptions(chosen, run.base_pose, words.unused(run, built=made is not None)),
        "bill": grouped_bill(made) if made else {},
        "marks": bracket_marks(made.assembly) if made and made.assembly else {},
        "currency": made.currency if made else "",
        "cuts": cuts(made) if made else [],
        "settings": words.changed_settings(run.problem.settings),
        "freedom": words.freedom(run.problem.settings.design),
        "weights": words.weights_sentence(run),
        "sources": words.source_sentences(run),
        "trust": words.trust(facts) if facts else "",
        "search": words.search_sentences(facts, run) if facts else [],
        "removed": words.REMOVED,
        "recipes": words.recipes(run),
        "terms": words.TERMS,
    }
    return fill(context)


def built_words(made: Build, origin: Origin | None) -> str:
    """What an arm is built of and after, in sentences.

    Args:
        made: Its parts.
        origin: The design that it is built after, where that is known.
    """
    maker = next((a.maker for a in made.choice.actuators if a.maker), "")
    motors = ", ".join(f"J{j} {a.name}" for j, a in enumerate(made.choice.actuators, start=1))
    words = f"Built {f'from {origin.run}, ' if origin else ''}of {f'{maker} motors'.strip()}: {motors}."
    sure = origin.sure if origin else ""
    return f"{words} {f'How sure its search was: {sure}' if sure else 'How sure its search was is not known here.'}"


def bracket_marks(assembly: Assembly) -> dict[str, str]:
    """Where each kind of bracket goes, its marks by its name in the bill."""
    return {
        name: ", ".join(each.mark for each in places)
        for name, (part, places) in assembly.counted().items()
        if part.kind == "bracket"
    }


def fill(context: dict[str, Any]) -> str:
    """The template with its values; markup in a value is escaped, only the figures are markup themselves.

    Raises:
        ArmDesignError: The template is missing or damaged.
    """
    environment = templates_in(TEMPLATES)
    environment.filters["mm"] = lambda value, digits=1: number(1e3 * value, digits)
    environment.filters["deg"] = lambda value, digits=1: number(float(np.rad2deg(value)), digits)
    environment.filters["figure"] = lambda value: figure(1e3 * value)
    environment.filters["fixed"] = number
    environment.filters["command"] = command
    environment.filters["plain"] = lambda value: f"{value:g}"
    try:
        return environment.get_template("report.html.j2").render(context)
    except jinja2.TemplateError as error:
        raise ArmDesignError(
            f"the report's template in {TEMPLATES} cannot be filled in: {error!r}", fix="Reinstall armdesign"
        ) from error


def command(text: str) -> markupsafe.Markup:
    """A command, escaped, of which no line ends within an option: browsers break lines behind hyphens."""
    words = (markupsafe.escape(word) for word in re.split(r"(\s+)", text))
    unbroken = markupsafe.Markup('<span class="option">{}</span>')
    return markupsafe.Markup("").join(unbroken.format(word) if word.startswith("-") else word for word in words)


def number(value: float, digits: int = 1) -> str:
    """A number with a fixed count of digits, a true minus sign and no negative zero."""
    return f"{round(float(value), digits) + 0.0:.{digits}f}".replace("-", "−")


def key_figures(run: Result, loads: JointLoads, payload: float) -> list[tuple[str, str]]:
    """What the arm is, in a few figures."""
    peak, speed = np.abs(loads.torque).max(axis=0), np.abs(loads.motion.v).max(axis=0)
    strongest, fastest = int(peak.argmax()), int(np.where(loads.prismatic, 0.0, speed).argmax())
    pulls = loads.prismatic[strongest]
    figures = [
        ("Joints", run.table.joints if any(loads.prismatic) else str(run.table.dof)),
        ("Lengths of all links, tool included", f"{number(1e3 * run.table.length, 0)} mm"),
        (
            f"Moving mass{'' if run.problem.settings.body.modules else ', assumed'}"  # a build's is that of its parts
            f"{', without payload' if payload else ''}",
            f"{number(loads.masses[1:].sum(), 2)} kg",
        ),
        (
            f"Largest {'force' if pulls else 'torque'}, joint {strongest + 1}",
            f"{figure(peak[strongest])} {'N' if pulls else 'N m'}",
        ),
    ]
    if not all(loads.prismatic):
        figures.append((f"Fastest turn, joint {fastest + 1}", f"{number(np.rad2deg(speed[fastest]), 0)} deg/s"))
    return [*figures, ("Payload", f"{number(payload, 2)} kg" if payload else "none stated")]


def solid_rows(run: Result) -> list[tuple[str, float, float, float]]:
    """The solids of the arm that can be seen: name, diameter [m], length [m], mass [kg]."""
    solids = [(part.name, part.solid) for part in run.body.parts if part.solid.length > SEEN]
    return [(name, 2.0 * solid.radius, solid.length, solid.mass) for name, solid in solids]


def demonstration_rows(run: Result) -> list[dict[str, Any]]:
    """What the arm does on each of several demonstrations and on those held out; nothing where there is but one."""
    problem, evaluation = run.problem, run.evaluation
    seen = list(zip(problem.demonstrations, evaluation.demonstrations, strict=True))
    every = [*seen, *zip(problem.holdouts, evaluation.holdouts, strict=True)]
    if len(every) == 1:
        return []
    names = short_names([each.name for each, _ in every])
    return [
        {
            "name": name,
            "held_out": k >= len(seen),
            "frames": len(each.task.time),
            "duration": float(each.task.time[-1] - each.task.time[0]),
            "scored": scored,
            "hand": scored.path.distance[:, -1],
        }
        for k, (name, (each, scored)) in enumerate(zip(names, every, strict=True))
    ]


def point_rows(run: Result, parts: FitnessParts) -> list[dict[str, Any]]:
    """Weight, errors and part of the fitness of every point."""
    distance, factor = run.evaluation.path.distance, parts.factors[0]
    rows = zip(run.problem.task.points, run.problem.settings.fitness.weights, distance.T, parts.points, strict=True)
    return [
        {
            "name": name,
            "weight": weight,
            "mean": float(errors.mean()),
            "median": float(np.median(errors)),
            "p95": share(errors, 95.0),
            "max": float(errors.max()),
            "part": factor * float(part),
        }
        for name, weight, errors, part in rows
    ]


def orientation_row(run: Result) -> list[float]:
    """Mean, median, 95 % and largest error of the orientation [rad]; nothing where none is followed."""
    error = run.evaluation.path.orientation_error
    if not run.problem.settings.fitness.orientation_weight:
        return []
    return [float(x) for x in (error.mean(), np.median(error), share(error, 95.0), error.max())]


def bound_marks(run: Result, facts: SearchFacts | None) -> np.ndarray[Any, Any]:
    """Which of (alpha, a, d) of a searched arm lie at a bound they could have left, shape (n + 1, 3)."""
    table = run.table
    marks = np.zeros((table.dof + 1, 3), dtype=bool)
    space = run.problem.space
    if facts is None or space.dof != table.dof:
        return marks
    entries = np.stack([table.alpha, table.a, table.d], axis=1).ravel()
    lower, upper, free = space.lower[: space.cells], space.upper[: space.cells], space.free[: space.cells]
    at_end = (np.abs(entries - lower) < AT_BOUND) | (np.abs(entries - upper) < AT_BOUND)
    marks[:] = (free & at_end).reshape(marks.shape)
    return marks


def modified_rows(table: DHTable, marks: np.ndarray[Any, Any]) -> list[dict[str, Any]]:
    """The rows of the modified table; the joint that turns about a row's z."""
    return [
        {
            "label": "tool" if i == table.dof else str(i),
            "joint": None if i == table.dof else i + 1,
            "slides": i < table.dof and table.prismatic[i],
            "alpha": float(table.alpha[i]),
            "a": float(table.a[i]),
            "d": float(table.d[i]),
            "theta": float(table.theta[i]),
            "marks": marks[i].tolist(),
        }
        for i in range(table.dof + 1)
    ]


def joint_rows(loads: JointLoads) -> list[dict[str, Any]]:
    """Range, peak speed and peak torque of every joint with their limits."""
    q, v, torque = loads.motion.q, np.abs(loads.motion.v), np.abs(loads.torque)
    return [
        {
            "slides": loads.prismatic[i],
            "low": float(q[:, i].min()),
            "high": float(q[:, i].max()),
            "lower": float(loads.limits.position[i, 0]),
            "upper": float(loads.limits.position[i, 1]),
            "share": float(v[:, i].max() / loads.limits.velocity[i]),
            "speed": float(v[:, i].max()),
            "velocity": float(loads.limits.velocity[i]),
            "torque": float(torque[:, i].max()),
            "effort": float(loads.limits.effort[i]),
        }
        for i in range(q.shape[1])
    ]
