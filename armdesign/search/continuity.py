"""What the bound on the joints' steps means for a demonstration: kept in resampling, and told where it is too tight."""

from __future__ import annotations

import math

import numpy as np

from armdesign._types import Array
from armdesign.demonstration import Step, Task
from armdesign.demonstration.cleaning.gaps import seconds
from armdesign.demonstration.findings import warning
from armdesign.errors import counted
from armdesign.settings.sections import Settings

_SAME = 1e-3  # relative difference of steps in time that is no resampling


def settled_continuity(settings: Settings, recorded: float, dt: float) -> tuple[Settings, tuple[Step, ...]]:
    """Keep the speed that eps per frame means at the recorded rate, where the task has another rate.

    Args:
        settings: The settings.
        recorded: Time between frames of the recording [s].
        dt: Time between frames of the task [s].
    """
    fitness, task = settings.fitness, settings.task
    asked = task.rate is not None or task.cut
    if fitness.continuity_speed is not None or not asked or abs(dt / recorded - 1.0) < _SAME:
        return settings, ()
    speed = fitness.continuity / recorded
    sentence = (
        f"eps = {fitness.continuity:g} deg per frame at the recorded {1 / recorded:.4g} frames/s is {speed:.4g} deg/s; "
        f"that speed is kept, which makes {speed * dt:.4g} deg per frame at {1 / dt:.4g} frames/s."
    )
    details = {"continuity": fitness.continuity, "recorded_rate": 1.0 / recorded, "continuity_speed": speed}
    return settings.replace({"fitness": {"continuity_speed": speed}}), (Step("continuity", sentence, details),)


def pace_steps(task: Task, settings: Settings, longest: float) -> tuple[Step, ...]:
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
    bound = eps * math.sqrt(n)
    arms = f"any arm of {counted(n, 'joint')} and {longest:g} m"
    path = np.linalg.norm(np.diff(task.P[:, -1], axis=0), axis=1)
    steps = [_too_fast(task, path, bound * longest, f"'{task.points[-1]}' moves", arms, "m/s", 1.0)]
    if task.R is not None and fitness.orientation_weight:
        turns = f"'{task.orientation}' turns"
        steps.append(
            _too_fast(task, turned(task.R), bound, turns, f"any arm of {counted(n, 'joint')}", "deg/s", 180 / math.pi)
        )
    return tuple(step for step in steps if step is not None)


def turned(R: Array) -> Array:
    """Angle of R_t^T R_{t+1} for rotations of shape (T, 3, 3), shape (T - 1,) [rad]."""
    relative = np.einsum("tij,tik->tjk", R[:-1], R[1:])
    x, y, z = (relative[:, i, j] - relative[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0)))
    sine = np.sqrt(x * x + y * y + z * z)
    return np.asarray(np.arctan2(sine, np.trace(relative, axis1=1, axis2=2) - 1.0))


def _too_fast(task: Task, path: Array, bound: float, what: str, arms: str, unit: str, per_unit: float) -> Step | None:
    """The warning for steps of shape (T - 1,) beyond a bound; None if there are none."""
    beyond = np.flatnonzero(path > bound * (1.0 + 1e-9))
    if len(beyond) == 0:
        return None
    k = int(np.argmax(path))
    fastest, most = path[k] / task.dt * per_unit, bound / task.dt * per_unit
    times = f"first at {seconds(task.time[beyond[0]])}, most at {seconds(task.time[k])}"
    told = (
        f"in {counted(len(beyond), 'frame')} of {len(path) + 1} {what} faster than {arms} can follow with eps (at most "
        f"{most:.3g} {unit}), {times} ({fastest:.3g} {unit}); raise fitness.continuity, or look for jumps there"
    )
    details: dict[str, object] = {"frames": len(beyond), "bound": most, "fastest": float(fastest), "unit": unit}
    return warning(told, details | {"times": [float(t) for t in task.time[beyond]]})
