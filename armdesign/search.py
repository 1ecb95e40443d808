"""The glue: a task and settings in, the best arm out. The only place that knows both the swarm and the robot."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from armdesign.compute import Backend, InProcess
from armdesign.errors import SearchError
from armdesign.evaluation import Evaluation, evaluate_design
from armdesign.fitness.constraints import DesignSpace
from armdesign.fitness.evaluator import Scores
from armdesign.fitness.robot import Rejections
from armdesign.settings import SearchSettings
from armdesign.study import Prepared
from armdesign.swarm import Box, Effort, History, State, Swarm, make_swarm, measure_effort, swarm_from_state

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
        stopped_by: Why it ended: iterations, patience, target, time_limit or interrupted.
        wall_time: Duration, earlier parts of a resumed search included [s].
    """

    prepared: Prepared
    best: Evaluation
    history: History
    effort: Effort
    rejections: Rejections
    stopped_by: str
    wall_time: float


class Search:
    """A search that goes one iteration at a time and can be put down and taken up between any two of them."""

    def __init__(self, prepared: Prepared, backend: Backend) -> None:
        """Draw the first generation.

        Args:
            prepared: Task and settings, from :func:`armdesign.study.prepare`.
            backend: Who evaluates the candidates.

        Raises:
            SettingsError: The bounds leave no arm.
        """
        self.prepared, self.backend = prepared, backend
        self.settings = prepared.study.search
        self.space = prepared.space()
        self.swarm = new_swarm(self.settings, self.space)
        self.rejections = Rejections()
        self.leader = (np.inf, np.inf, np.inf)
        self.nearest = np.inf
        self.earlier, self.began = 0.0, time.monotonic()

    @property
    def elapsed(self) -> float:
        """Time spent, earlier parts included [s]."""
        return self.earlier + time.monotonic() - self.began

    def advance(self) -> Progress:
        """Evaluate one generation."""
        swarm = self.swarm
        X = swarm.ask()
        cutoff = swarm.personal_best_fitness if self.settings.prune else np.full(len(X), np.inf)
        scores, removed = self.backend.evaluate(X, cutoff)
        swarm.tell(scores.fitness, scores.valid)
        self.rejections += removed
        self.nearest = min(self.nearest, float(scores.start_error.min()))
        self.leader = better(self.leader, scores)
        return Progress(
            swarm.iteration, self.settings.iterations, *self.leader,
            int(scores.valid.sum()), self.settings.particles, self.elapsed,
        )  # fmt: skip

    def ended_by(self) -> str | None:
        """The stop rule that holds now, or None."""
        settings, best = self.settings, self.swarm.history.best
        if len(best) >= settings.iterations:
            return "iterations"
        if settings.target is not None and self.swarm.best_fitness <= settings.target:
            return "target"
        if settings.patience is not None and stalled(best, settings.patience):
            return "patience"
        if settings.time_limit is not None and self.elapsed >= settings.time_limit:
            return "time_limit"
        return None

    def result(self, stopped_by: str) -> SearchResult:
        """The best arm so far.

        Raises:
            SearchError: No candidate has reached the first frame.
        """
        if not np.isfinite(self.swarm.best_fitness):
            raise nothing_found(self.prepared, self.nearest)
        best = evaluate_design(self.space.table(self.swarm.best_position), self.prepared)
        history = self.swarm.history
        effort = measure_effort(history.best, history.valid)
        return SearchResult(self.prepared, best, history, effort, self.rejections, stopped_by, self.elapsed)

    def state(self) -> State:
        """Everything a later process needs to go on, as arrays and JSON values."""
        search = {
            "rejections": asdict(self.rejections),
            "leader": [repr(x) for x in self.leader],
            "nearest": repr(self.nearest),
            "elapsed": self.elapsed,
        }
        return self.swarm.state() | {"search": search}

    def restore(self, state: State) -> None:
        """Go on where a state was taken."""
        search = dict(state["search"])
        self.swarm = swarm_from_state({name: value for name, value in state.items() if name != "search"})
        self.rejections = Rejections(**search["rejections"])
        r, f, E = search["leader"]
        self.leader = float(r), float(f), float(E)
        self.nearest = float(search["nearest"])
        self.earlier, self.began = float(search["elapsed"]), time.monotonic()


def search(
    prepared: Prepared,
    *,
    on_progress: Callable[[Progress], None] | None = None,
    block: int | None = None,
    backend: Backend | None = None,
) -> SearchResult:
    """Search the arm that follows a demonstration best.

    Args:
        prepared: Task and settings, from :func:`armdesign.study.prepare`.
        on_progress: Called after every iteration.
        block: Arms evaluated side by side; any value gives the same result.
        backend: Who evaluates; by default this process.

    Raises:
        SearchError: No candidate reached the first frame.
        SettingsError: The bounds leave no arm.
    """
    run = Search(prepared, InProcess(prepared, block) if backend is None else backend)
    while (reason := run.ended_by()) is None:
        progress = run.advance()
        if on_progress is not None:
            on_progress(progress)
    return run.result(reason)


def stalled(best: Array, patience: int, gain: float = 1e-3) -> bool:
    """Whether the last ``patience`` iterations have brought less than a relative gain of 0.1 %."""
    if len(best) <= patience or not np.isfinite(best[-1 - patience]):
        return False
    return bool(best[-1] > (1.0 - gain) * best[-1 - patience])


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
