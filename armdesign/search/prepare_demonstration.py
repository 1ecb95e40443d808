"""From one recording and the settings to a demonstration: its task, and the settings that depend on the recording."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from armdesign._types import Array
from armdesign.cell.obstacle_file import read_obstacles
from armdesign.cell.obstacles import Obstacles
from armdesign.cell.standing import check_hand, check_places, standing_surface
from armdesign.demonstration import Recording, Selection, Step, Task, resolve, task_from_recording
from armdesign.demonstration.cleaning.cleaning import CLEANING_ENTRIES, settled_cleaning
from armdesign.demonstration.cleaning.gaps import seconds
from armdesign.demonstration.findings import warning
from armdesign.demonstration.points.expressions import unquoted
from armdesign.demonstration.points.selection import ORIGIN, with_carriers, with_orientation
from armdesign.demonstration.provenance import provenance_of
from armdesign.demonstration.task import task_of_selection
from armdesign.errors import SettingsError, TaskError, counted
from armdesign.feasibility.needs import check_bodies
from armdesign.fitness.problem import SCENARIOS, resolve_weights, start_effort
from armdesign.search.design_problem import Demonstration
from armdesign.settings.place import NEAR_TASK, Site, near_task, sites
from armdesign.settings.sections import Settings
from armdesign.settings.sections import Task as TaskSettings

SAME_RATE = 1e-3
"""Relative difference of frame rates that is none."""
ROUNDED = 0.3
"""Relative distance of the steps in time from the declared rate, up to which they are that rate, rounded."""


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
    check_bodies(settings)
    places = sites(settings.cell)
    settings, steps = settled_base_mode(settings, places)
    # first the points, then their weights: these say whether an orientation has to be found, too
    chosen = select(recording, settings)
    w_0, weights = weights_for(settings, len(chosen.points))
    if w_0 > 0.0:
        chosen = select_orientation(chosen, recording, settings)
    how = settled_cleaning(settings.task, chosen.recording)
    obstacles = read_obstacles(settings.cell.obstacles, settings.cell.obstacle_units)
    if obstacles.carriers:
        chosen = with_carriers(chosen, recording, obstacles.carriers)
    if counts_from_base(recording, settings):
        origin = np.zeros(3) if places else None
        task = replace(task_from_recording(chosen.recording, base=ORIGIN, origin=origin), steps=chosen.steps)
    else:
        keep_base = bool(settings.cell.obstacles or settings.cell.stay_within)
        task = task_of_selection(chosen, how, in_room=bool(places), keep_base=keep_base)
    steps = [*steps, *task.steps]
    wanted = settings.task.orientation
    if wanted is not None and chosen.orientation is None:
        sentence = f"The orientation of '{wanted}' is not followed: the orientation weight w_0 is 0."
        steps.append(Step("orientation", sentence))
    settings = settled(settings, chosen, how, w_0, weights)
    reach = settings.design.length[1] if longest is None else longest
    if places:
        places = near_task(places, task.P[:, -1], reach)
        settings = settings.replace({"cell": {"place": settled_places(settings, places)}})
    provenance = provenance_of(chosen, settings.task)
    settings, more = settled_continuity(settings, recorded_step(chosen.recording), task.dt)
    steps += more
    steps += check_reach(task, reach, places, searched=longest is None)
    steps += continuity_warnings(task, settings, reach)
    return Demonstration(settings, task, tuple(steps), provenance, obstacles=cell_of(settings, task, obstacles, places))


def cell_of(settings: Settings, task: Task, obstacles: Obstacles, places: Sequence[Site]) -> Obstacles:
    """What stands in the room during a demonstration, checked against it.

    Args:
        settings: The settings.
        task: The task, not placed.
        obstacles: What was read.
        places: Where the base may stand.

    Raises:
        ObstacleError: The demonstrated hand goes through an obstacle, or what carries one is not known.
        SettingsError: A place lies inside an obstacle, or what the base stands on is not known.
    """
    around = obstacles.carried(task.bodies)
    if around.each and task.origin is None:
        raise SettingsError("obstacles stand in the room, but the base moves with the recording", fix="Set base_mode")
    if task.origin is not None:
        check_hand(around, task.P[:, -1] + task.origin, task.time)
    check_places(around, places)
    return Obstacles((*around.each, *standing_surface(settings.cell.stand, places).each))


def select(recording: Recording, settings: Settings) -> Selection:
    """The points that the settings ask for, without an orientation.

    Where the points of the recording count from the base already, the name of an expression counts, as in the settings
    of a run on the recording that its task was made of.

    Args:
        recording: The demonstration.
        settings: Base and points; by default the first point is the base, and all others are tracked.

    Raises:
        TaskError: There is no such point.
    """
    task = settings.task
    if not counts_from_base(recording, settings):
        try:
            return resolve(recording, task.base, task.points, None)
        except TaskError:
            if not (sites(settings.cell) and task.base is None and task.points):
                raise
            return resolve(recording, ORIGIN, task.points, None)  # a base with a place of its own needs no point
    names = tuple(named(text, recording) for text in task.points or tuple(recording.points))
    for name in names:
        if name not in recording.points:
            raise TaskError(f"unknown point '{name}'", value=name, allowed=list(recording.points))
    used = {name: recording.points[name] for name in names}
    # what would change the points once more has no effect: they have been converted and cleaned before
    entries = ("units", "up", "mirror", "time_unit", "base_mode", *CLEANING_ENTRIES)
    given = {name: getattr(task, name) for name in entries}
    default = TaskSettings()
    unused = [name for name, x in given.items() if x not in (False, "off") and x != getattr(default, name)]
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
    """Whether the recording's points count from the base already, or are finished where the base has a place."""
    if recording.about.captured and sites(settings.cell):
        return False
    return settings.task.base == ORIGIN and ORIGIN not in recording.points


def settled_base_mode(settings: Settings, places: Sequence[Site]) -> tuple[Settings, list[Step]]:
    """The settings with the base mode that goes with a base in the room, and what has to be said of it.

    Args:
        settings: The settings as asked for.
        places: Where the base may stand; none where it stands at a point of the recording.
    """
    fixed = settings.replace({"task": {"base_mode": "fixed"}})
    if places:
        shown = "; ".join(str(site) for site in places if site != NEAR_TASK) or "the floor near the task"
        sentence = f"The base is placed in the room: {shown}. All paths are those in the room."
        return fixed, [Step("place", sentence, {"places": [str(site) for site in places]})]
    if settings.cell.obstacles and settings.task.base_mode != "fixed":
        sentence = "Obstacles stand in the room, and so does the base: base_mode is 'fixed'."
        return fixed, [Step("base-mode", sentence, {"base_mode": "fixed"})]
    return settings, []


def settled_places(settings: Settings, places: Sequence[Site]) -> tuple[str, ...]:
    """The places for the settings: as they were given, unless only the task could tell."""
    return tuple(map(str, places)) if NEAR_TASK in sites(settings.cell) else settings.cell.place


def named(text: str, recording: Recording) -> str:
    """The name that an expression gives to a point."""
    return text if text in recording.points else unquoted(text.partition("=")[0])


def settled(
    settings: Settings, chosen: Selection, how: TaskSettings, w_0: float, weights: tuple[float, ...]
) -> Settings:
    """The settings with everything entered that was left to the recording, so that they prepare the same task again.

    Args:
        settings: The settings as asked for.
        chosen: Points and orientation.
        how: How the data are cleaned.
        w_0: Weight of the orientation.
        weights: w_1..w_m of the points.
    """
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
    """Time between frames [s]: what the file declares where its times agree with it."""
    declared = recording.about.rate
    # times written with few decimals have a wrong median step, the declared rate is exact
    return 1.0 / declared if declared and abs(declared * recording.step - 1.0) < ROUNDED else recording.step


def weights_for(settings: Settings, m: int) -> tuple[float, tuple[float, ...]]:
    """The weights (w_0, (w_1..w_m)) for m points: those given, else the scenario's.

    One weight more than points means that the first is w_0.

    Args:
        settings: The weights, or the scenario that has some.
        m: Number of points.

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


def check_reach(task: Task, longest: float, places: Sequence[Site] = (), *, searched: bool) -> tuple[Step, ...]:
    """Compare the hand's distance from the base with the longest arm allowed.

    Args:
        task: The task.
        longest: Length of the longest arm [m].
        places: Where the base may stand; none where it stands in the origin of the task.
        searched: Whether an arm is searched for, so that it can be no longer; else there is one of that length.

    Returns:
        A note on the frames that are out of reach; none if there are none.

    Raises:
        TaskError: The first hand point lies out of reach of any arm.
    """
    hand = task.P[:, -1]
    away: Array = np.stack([distance_from(site, hand) for site in places] or [np.linalg.norm(hand, axis=1)])
    distance = away.min(axis=0)
    if places and distance[0] >= longest:
        raise TaskError(
            f"no place of the base reaches the task: at the start the hand is {distance[0]:.3f} m from the nearest, "
            f"and no arm may be longer than L_max = {longest:g} m",
            value=float(distance[0]),
            fix="Move or widen the place (--place, --base-at), raise design.length, or check --units",
        )
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
        f"In {beyond} of {len(distance)} frames the hand is farther from {'any place of ' if places else ''}the base "
        f"(up to {distance.max():.3f} m) than "
        f"{'the longest arm reaches, L_max =' if searched else 'the arm is long,'} {longest:g} m."
    )
    return (Step("reach", sentence, {"frames": beyond, "farthest": float(distance.max())}),)


def distance_from(site: Site, points: Array) -> Array:
    """Distances of points in the room, shape (T, 3) [m], from the nearest place of a site, shape (T,) [m]."""
    low, high = site.box
    return np.asarray(np.linalg.norm(points - np.clip(points, low, high), axis=1))


def settled_continuity(settings: Settings, recorded: float, dt: float) -> tuple[Settings, tuple[Step, ...]]:
    """Keep the speed that eps per frame means at the recorded rate, where the task has another rate.

    Resampled at half the rate, the same joint speed needs steps of twice the size; eps as it is would forbid motions
    that were allowed.

    Args:
        settings: The settings.
        recorded: Time between frames of the recording [s].
        dt: Time between frames of the task [s].

    Returns:
        The settings, and a note where they have changed.
    """
    fitness, task = settings.fitness, settings.task
    asked = task.rate is not None or task.cut
    if fitness.continuity_speed is not None or not asked or abs(dt / recorded - 1.0) < SAME_RATE:
        return settings, ()
    speed = fitness.continuity / recorded
    sentence = (
        f"eps = {fitness.continuity:g} deg per frame at the recorded {1 / recorded:.4g} frames/s is {speed:.4g} deg/s; "
        f"that speed is kept, which makes {speed * dt:.4g} deg per frame at {1 / dt:.4g} frames/s."
    )
    details = {"continuity": fitness.continuity, "recorded_rate": 1.0 / recorded, "continuity_speed": speed}
    return settings.replace({"fitness": {"continuity_speed": speed}}), (Step("continuity", sentence, details),)


def continuity_warnings(task: Task, settings: Settings, longest: float) -> tuple[Step, ...]:
    """Warnings where no arm can follow within the bound on the joints' steps.

    A joint moves the hand by at most its angle times the arm's length, and |dq_1| + ... + |dq_n| <= sqrt(n) |dq|. So
    from frame to frame the hand moves by at most eps sqrt(n) L_max, and turns by at most eps sqrt(n).

    Args:
        task: The task.
        settings: Its settings.
        longest: Length L_max of the longest arm [m].
    """
    fitness, n = settings.fitness, settings.design.dof
    speed = fitness.continuity_speed
    eps = math.radians(fitness.continuity if speed is None else speed * task.dt)
    bound, arms = eps * math.sqrt(n), f"any arm of {counted(n, 'joint')}"
    path = np.linalg.norm(np.diff(task.P[:, -1], axis=0), axis=1)
    moves = f"'{task.points[-1]}' moves faster than {arms} and {longest:g} m"
    steps = [_too_fast(task, path, bound * longest, moves, ("m/s", 1.0))]
    if task.R is not None and fitness.orientation_weight:
        turns = f"'{task.orientation}' turns faster than {arms}"
        steps.append(_too_fast(task, turn_angles(task.R), bound, turns, ("deg/s", 180.0 / math.pi)))
    return tuple(step for step in steps if step is not None)


def turn_angles(R: Array) -> Array:
    """Angle of R_t^T R_{t+1} for rotations of shape (T, 3, 3), shape (T - 1,) [rad]."""
    relative = np.einsum("tij,tik->tjk", R[:-1], R[1:])
    x, y, z = (relative[:, i, j] - relative[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0)))
    sine = np.sqrt(x * x + y * y + z * z)  # 2 sin of the angle, beside 2 cos from the trace
    return np.asarray(np.arctan2(sine, np.trace(relative, axis1=1, axis2=2) - 1.0))


def _too_fast(task: Task, path: Array, bound: float, what: str, unit: tuple[str, float]) -> Step | None:
    """The warning for steps beyond a bound; None if there are none.

    Args:
        task: The task.
        path: Length of the steps from frame to frame, shape (T - 1,) [m] or [rad].
        bound: The longest step that an arm can follow, likewise.
        what: What is faster than which arms, in words.
        unit: Unit of speed in the sentence, and its size per m/s or rad/s.
    """
    beyond = np.flatnonzero(path > bound * (1.0 + 1e-9))
    if len(beyond) == 0:
        return None
    k, (name, size) = int(np.argmax(path)), unit
    fastest, most = path[k] / task.dt * size, bound / task.dt * size
    times = f"first at {seconds(task.time[beyond[0]])}, most at {seconds(task.time[k])}"
    sentence = (
        f"in {counted(len(beyond), 'frame')} of {len(path) + 1} {what} can follow with eps (at most {most:.3g} "
        f"{name}), {times} ({fastest:.3g} {name}); raise fitness.continuity, or look for jumps there"
    )
    details: dict[str, object] = {"frames": len(beyond), "bound": most, "fastest": float(fastest), "unit": name}
    return warning(sentence, details | {"times": [float(t) for t in task.time[beyond]]})
