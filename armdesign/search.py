"""The glue: a task and settings in, the best arm out. The only place that knows both the swarm and the robot."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armdesign.errors import SearchError
from armdesign.evaluation import Evaluation, evaluate_design
from armdesign.fitness.constraints import DesignSpace
from armdesign.fitness.evaluator import Scores
from armdesign.fitness.robot import Rejections, RobotFitness
from armdesign.settings import SearchSettings
from armdesign.study import Prepared
from armdesign.swarm import Box, Effort, History, Swarm, make_swarm, measure_effort

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Progress:
    """Where a search stands after an iteration.

    Attributes:
        iteration: Iterations done, 1..M.
        iterations: M.
        fitness: Best robot fitness r so far [m]; infinite while no candidate was valid.
        path_fitness: Its f [m].
        area: Its E [m].
        valid: Valid particles in this iteration.
        particles: N.
        elapsed: Time since the search began [s].
    """

    iteration: int
    iterations: int
    fitness: float
    path_fitness: float
    area: float
    valid: int
    particles: int
    elapsed: float


@dataclass(frozen=True)
class SearchResult:
    """What a search has found.

    Attributes:
        prepared: Task and settings it ran on.
        best: The best arm with its path.
        history: Best, mean of the personal bests, valid particles and evaluations per iteration.
        effort: Iterations to convergence and computational effort (method section 7).
        rejections: How many candidates each test removed.
        wall_time: Duration [s].
    """

    prepared: Prepared
    best: Evaluation
    history: History
    effort: Effort
    rejections: Rejections
    wall_time: float


def search(
    prepared: Prepared, *, on_progress: Callable[[Progress], None] | None = None, block: int | None = None
) -> SearchResult:
    """Search the arm that follows a demonstration best.

    Args:
        prepared: Task and settings, from :func:`armdesign.study.prepare`.
        on_progress: Called after every iteration.
        block: Arms evaluated side by side; any value gives the same result.

    Raises:
        SearchError: No candidate reached the first frame.
        SettingsError: The bounds leave no arm.
    """
    settings = prepared.study.search
    began = time.monotonic()
    space = prepared.space()
    fitness = RobotFitness(prepared.problem(), space, block)
    swarm = new_swarm(settings, space)
    rejections, leader, nearest = Rejections(), (np.inf, np.inf, np.inf), np.inf
    for iteration in range(1, settings.iterations + 1):
        scores, removed = fitness.evaluate(swarm.ask(), swarm.personal_best_fitness if settings.prune else None)
        swarm.tell(scores.fitness, scores.valid)
        rejections += removed
        nearest = min(nearest, float(scores.start_error.min()))
        leader = better(leader, scores)
        if on_progress is not None:
            valid = int(scores.valid.sum())
            elapsed = time.monotonic() - began
            on_progress(Progress(iteration, settings.iterations, *leader, valid, settings.particles, elapsed))
    if not np.isfinite(swarm.best_fitness):
        raise nothing_found(prepared, nearest)
    best = evaluate_design(space.table(swarm.best_position), prepared)
    history = swarm.history
    effort = measure_effort(history.best, history.valid)
    return SearchResult(prepared, best, history, effort, rejections, time.monotonic() - began)


def new_swarm(settings: SearchSettings, space: DesignSpace) -> Swarm:
    """The swarm of the settings at its first iteration."""
    parameters: dict[str, float | int | str] = {"w": settings.inertia, "c1": settings.c1, "c2": settings.c2}
    if settings.algorithm == "rapso":
        parameters |= {
            "c_min": settings.c_range[0],
            "c_max": settings.c_range[1],
            "range_of": settings.range,
            "angle_interval": settings.angle_interval,
        }
    box = Box(*space.bounds, space.angular)
    rng = np.random.default_rng(settings.seed)
    return make_swarm(settings.algorithm, box, settings.particles, rng, space.sample, **parameters)


def better(leader: tuple[float, float, float], scores: Scores) -> tuple[float, float, float]:
    """The better of the leader's (r, f, E) and the best candidate's."""
    k = int(np.argmin(scores.fitness))
    if scores.fitness[k] < leader[0]:
        return float(scores.fitness[k]), float(scores.path_fitness[k]), float(scores.area[k])
    return leader


def nothing_found(prepared: Prepared, nearest: float) -> SearchError:
    """The error of a search in which no arm was valid."""
    tolerance = prepared.study.fitness.reach_tolerance
    miss = f"the nearest stopped {nearest * 1e3:.1f} mm short" if np.isfinite(nearest) else "none came near it"
    return SearchError(
        f"no candidate brings its end-effector within {tolerance * 1e3:g} mm of the hand's first point: {miss}",
        value=nearest,
        fix="Use more joints (design.dof), more particles or iterations, or wider bounds",
    )
