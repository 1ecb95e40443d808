"""From one recording and the settings to a demonstration: its task, and the settings that depend on the recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from armdesign.demonstration import Recording, Selection, Step, Task, resolve, task_from_recording
from armdesign.demonstration.cleaning.cleaning import CLEANING_ENTRIES, settled_cleaning
from armdesign.demonstration.points.expressions import unquoted
from armdesign.demonstration.points.selection import with_orientation
from armdesign.demonstration.provenance import provenance_of
from armdesign.demonstration.task import task_of_selection
from armdesign.errors import SettingsError, TaskError, counted
from armdesign.fitness.problem import SCENARIOS, resolve_weights, start_effort
from armdesign.search.continuity import pace_steps, settled_continuity
from armdesign.search.design_problem import Demonstration
from armdesign.settings.sections import Settings
from armdesign.settings.sections import Task as TaskSettings

ORIGIN = "origin"
"""Name of the base where the points of a recording already count from it, as in a run's task.csv."""


def prepare_demonstration(recording: Recording, settings: Settings, *, longest: float | None = None) -> Demonstration:
    """Build the task of a recording and settle every setting that was left to it.

    Args:
        recording: The demonstration.
        settings: The settings.
        longest: Length of the longest arm in question [m]; by default L_max of the search.

    Raises:
        TaskError: A point is unknown, the orientation is missing, or the start is out of reach.
        SettingsError: The weights do not fit the points.
        RecordingError: The data cannot be used.
    """
    chosen = select(recording, settings)
    w_0, weights = weights_for(settings, len(chosen.points))
    if w_0 > 0.0:
        chosen = select_orientation(chosen, recording, settings)
    how = settled_cleaning(settings.task, chosen.recording)
    if counts_from_base(recording, settings):
        task = replace(task_from_recording(chosen.recording, base=ORIGIN), steps=chosen.steps)
    else:
        task = task_of_selection(chosen, how)
    steps = list(task.steps)
    wanted = settings.task.orientation
    if wanted is not None and chosen.orientation is None:
        sentence = f"The orientation of '{wanted}' is not followed: the orientation weight w_0 is 0."
        steps.append(Step("orientation", sentence))
    settings = settled(settings, chosen, how, w_0, weights)
    provenance = provenance_of(chosen, settings.task)
    settings, more = settled_continuity(settings, recorded_step(chosen.recording), task.dt)
    steps += more
    reach = settings.design.length[1] if longest is None else longest
    steps += check_reach(task, reach, searched=longest is None)
    steps += pace_steps(task, settings, reach)
    return Demonstration(settings, task, tuple(steps), provenance)


def select(recording: Recording, settings: Settings) -> Selection:
    """The points that the settings ask for, without an orientation.

    Where the points of the recording count from the base already, the name of an expression counts, as in the settings
    of a run on the recording that its task was made of.

    Raises:
        TaskError: There is no such point.
    """
    task = settings.task
    if not counts_from_base(recording, settings):
        return resolve(recording, task.base, task.points, None)
    names = tuple(named(text, recording) for text in task.points or tuple(recording.points))
    for name in names:
        if name not in recording.points:
            raise TaskError(f"unknown point '{name}'", value=name, allowed=list(recording.points))
    used = {name: recording.points[name] for name in names}
    unused = unused_settings(settings)
    sentence = f"The points count from the base already; not used: {', '.join(unused)}."
    steps = (Step("unused", sentence, {"settings": unused}),) if unused else ()
    kept = Recording(recording.time, used, {}, recording.source, recording.about)
    return Selection(kept, ORIGIN, names, None, steps, {})


def select_orientation(selection: Selection, recording: Recording, settings: Settings) -> Selection:
    """The points with the orientation that the settings ask for.

    Args:
        selection: The points, from ``select``.
        recording: What they were selected from.
        settings: Their settings.

    Raises:
        TaskError: There is no such orientation.
    """
    wanted, fix = settings.task.orientation, "take weights with w_0 = 0 such as the packaging scenario's"
    if not counts_from_base(recording, settings):
        try:
            return with_orientation(selection, recording, wanted)
        except TaskError as error:
            message = f"an orientation is to be followed (w_0 > 0), but {error}"
            raise TaskError(message, value=error.value, fix=f"Or {fix}") from error
    turn = named(wanted or selection.points[-1], recording)
    if turn not in recording.orientations:
        raise TaskError(
            f"the orientation of '{turn}' is to be followed (w_0 > 0), but the recording has none for it",
            value=turn,
            allowed=list(recording.orientations) or "none: this recording holds positions only",
            fix=f"Name another point, or {fix}",
        )
    turns = {turn: recording.orientations[turn]}
    kept = Recording(recording.time, selection.recording.points, turns, recording.source, recording.about)
    return replace(selection, recording=kept, orientation=turn)


def counts_from_base(recording: Recording, settings: Settings) -> bool:
    """Whether the recording's points count from the base already."""
    return settings.task.base == ORIGIN and ORIGIN not in recording.points


def named(text: str, recording: Recording) -> str:
    """The name that an expression gives to a point."""
    return text if text in recording.points else unquoted(text.partition("=")[0])


def unused_settings(settings: Settings) -> list[str]:
    """Task settings that are set but do nothing where points count from the base already."""
    default = TaskSettings()
    names = ("units", "up", "mirror", "base_mode", *CLEANING_ENTRIES)
    nothing = (False, "off")
    values = {name: getattr(settings.task, name) for name in names}
    return [name for name, value in values.items() if value not in nothing and value != getattr(default, name)]


def settled(
    settings: Settings, chosen: Selection, how: TaskSettings, w_0: float, weights: tuple[float, ...]
) -> Settings:
    """The settings with everything entered that was left to the recording, so that it prepares the same again."""
    meant = chosen.expressions
    turn = chosen.orientation
    task = {
        "base": meant.get(chosen.base, chosen.base),
        "points": [meant.get(name, name) for name in chosen.points],
        "orientation": turn if turn is None or turn in chosen.points else meant.get(turn, turn),
    }
    if chosen.base != ORIGIN or chosen.expressions:
        task |= {name: getattr(how, name) for name in ("outliers", "repeats", "low_pass")}
    return settings.replace(
        {
            "solver": start_effort(settings.solver, settings.design.dof)._asdict(),
            "task": task,
            "fitness": {"weights": weights, "orientation_weight": w_0},
        }
    )


def recorded_step(recording: Recording) -> float:
    """Time between frames [s]: what the file declares where its times agree, rounded as they may be."""
    declared = recording.about.rate
    return 1.0 / declared if declared and abs(declared * recording.step - 1.0) < 0.3 else recording.step


def weights_for(settings: Settings, m: int) -> tuple[float, tuple[float, ...]]:
    """The weights (w_0, (w_1..w_m)) for m points: those given, else the scenario's.

    One weight more than points means that the first is w_0.

    Raises:
        SettingsError: They do not fit the points or do not sum to 1; the message says what to write.
    """
    fitness = settings.fitness
    if len(fitness.weights) == m + 1 and fitness.orientation_weight is None:
        fitness = replace(fitness, orientation_weight=fitness.weights[0], weights=fitness.weights[1:])
    given = fitness.weights or (SCENARIOS[fitness.scenario][1] if fitness.scenario == "welding" else ())
    shown = ",".join(f"{w:.12g}" for w in given)
    if given and len(given) != m:
        raise SettingsError(
            f"there are {counted(len(given), 'weight')} ({shown.replace(',', ', ')}) for {counted(m, 'point')}",
            value=given,
            allowed=f"{counted(m, 'weight')} w_1..w_{m}, or {m + 1} with the orientation's w_0 first",
            fix="Give others with --weights, or take those that grow along the arm with --scenario packaging"
            if fitness.weights
            else f"The {fitness.scenario} weights are for three points: choose three with --points, or use --weights",
        )
    try:
        return resolve_weights(fitness, m)
    except SettingsError as error:
        left = 1.0 - sum(given)
        if not given or left <= 0.0 or fitness.orientation_weight:
            raise
        fix = f"Put the orientation's weight first, --weights {left:.6g},{shown}, or make them sum to 1"
        raise SettingsError(str(error), value=error.value, fix=fix) from error


def check_reach(task: Task, longest: float, *, searched: bool) -> tuple[Step, ...]:
    """Compare the hand's distance from the base with the longest arm allowed.

    Raises:
        TaskError: The first hand point lies out of reach of any arm.
    """
    distance = np.linalg.norm(task.P[:, -1], axis=1)
    if searched and distance[0] >= longest:
        raise TaskError(
            f"the task is out of reach: at the start the hand is {distance[0]:.3f} m from the base, "
            f"and no arm may be longer than L_max = {longest:g} m",
            value=float(distance[0]),
            fix="Raise design.length, or check --base and --units",
        )
    beyond = int((distance > longest).sum())
    if beyond == 0:
        return ()
    sentence = (
        f"In {beyond} of {len(distance)} frames the hand is farther from the base (up to {distance.max():.3f} m) than "
        f"{'the longest arm reaches, L_max =' if searched else 'the arm is long,'} {longest:g} m."
    )
    return (Step("reach", sentence, {"frames": beyond, "farthest": float(distance.max())}),)
