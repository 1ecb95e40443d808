"""The search for the best arm: an algorithm asks for designs, a backend evaluates them, stop rules end it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.errors import SearchError
from armdesign.fitness.robot import Rejections
from armdesign.search.backends.backend import Backend, InProcess
from armdesign.search.backends.parallel import ParallelBackend
from armdesign.search.design_problem import DesignProblem
from armdesign.search.evaluation import evaluate_candidate
from armdesign.search.part_scheduler import PartScheduler
from armdesign.search.result import Result, SearchFacts
from armdesign.search.swarms import Note, new_swarm, parameters, search_space, step
from armdesign.swarm import State, algorithm_from_state


@dataclass(frozen=True)
class Progress:
    """How far a search is after a batch of candidates.

    Attributes:
        iteration: Iterations done, 1..M, or candidates, whichever the algorithm counts.
        iterations: How many are planned.
        fitness: Best robot fitness r so far [m]; infinite while no candidate was valid.
        path_fitness: f of that arm [m].
        area: E of that arm [m].
        valid: Valid candidates of the batch.
        particles: Candidates of the batch.
        elapsed: Time since the search began [s].
        unit: What is counted: iteration or candidate.
    """

    iteration: int
    iterations: int
    fitness: float
    path_fitness: float
    area: float
    valid: int
    particles: int
    elapsed: float
    unit: str = "iteration"


class NothingFoundError(SearchError):
    """No candidate of a whole search has reached the first frame."""

    exit_code = 4


class Search:
    """A search, one batch of candidates at a time; between any two its state can be saved, and restored later.

    Attributes:
        problem: The demonstrations and the settings.
        backend: Who evaluates the candidates.
        swarm: The search algorithm, asked for designs and told their fitness.
        rejections: How many candidates each test has removed so far.
        leader: r, f and E of the best arm so far [m].
        nearest: Smallest distance between a first frame's end-effector and the hand so far [m].
    """

    def __init__(self, problem: DesignProblem, backend: Backend) -> None:
        """Begin; the first generation is drawn at once.

        Args:
            problem: The demonstrations and the settings, see ``prepare``.
            backend: Who evaluates the candidates.

        Raises:
            SettingsError: The bounds leave no arm.
        """
        self.problem, self.backend = problem, backend
        self.scheduler = PartScheduler(backend) if isinstance(backend, ParallelBackend) else None
        self.settings = problem.settings.search
        self.space = problem.space
        self.swarm = new_swarm(self.settings, self.space)
        self.swarm.ask()  # the draw shows here, before anything is written, whether the bounds leave an arm
        self.rejections = Rejections()
        self.leader = (np.inf, np.inf, np.inf)
        self.nearest = np.inf
        self.earlier, self.began = 0.0, time.monotonic()

    @property
    def elapsed(self) -> float:
        """Time spent, earlier parts included [s]."""
        return self.earlier + time.monotonic() - self.began

    def advance(self) -> Progress | None:
        """Take in the next batch of candidates, evaluated here and now or by workers in the meantime.

        Returns:
            How far the search is then; None where the workers have not finished one yet.
        """
        swarm = self.swarm
        by_parts = swarm.unread or (self.scheduler is not None and self.scheduler.work_on(swarm))
        if not by_parts:
            step(swarm, self.backend, prune=self.settings.prune)
        elif swarm.unread:
            swarm.read()
        else:
            return None
        return self._noted()

    def _noted(self) -> Progress:
        """Take in what was noted with the last batch."""
        note, history = Note(*self.swarm.note), self.swarm.history
        self.rejections += note.removed
        self.nearest = min(self.nearest, note.nearest)
        if note.fitness < self.leader[0]:
            self.leader = note.fitness, note.path_fitness, note.area
        count = int(history.evaluations[-1] - (history.evaluations[-2] if len(history.evaluations) > 1 else 0))
        valid = int(history.valid[-1])
        return Progress(*self.swarm.progress, *self.leader, valid, count, self.elapsed, unit=self.swarm.unit)

    def gather(self, stopped_by: str) -> None:
        """Take in what workers have found beyond the last batch, where the search ends at no certain place.

        Args:
            stopped_by: What has ended it; it cannot go on from here.
        """
        if stopped_by in ("interrupted", "time_limit"):
            for _ in self.swarm.gather():
                self._noted()

    def ended_by(self) -> str | None:
        """The stop rule that holds now, by the name of its setting; None to go on."""
        settings, best = self.settings, self.swarm.history.best
        if self.swarm.done:
            return self.swarm.ending
        if settings.target is not None and self.swarm.best_fitness <= settings.target:
            return "target"
        if settings.patience is not None and stalled(best[self.steps()], settings.patience):
            return "patience"
        if settings.time_limit is not None and len(best) and self.elapsed >= settings.time_limit:  # one batch at least
            return "time_limit"
        return None

    def steps(self) -> NDArray[np.intp]:
        """Rows of the history at the ends of whole generations, counted back from the last row, shape (G,).

        Patience counts generations: the batches of an algorithm may be of any size.
        """
        evaluations, size = self.swarm.history.evaluations, self.swarm.generation
        if not len(evaluations):
            return np.arange(0)
        ends = np.arange(evaluations[-1] % size, evaluations[-1] + 1, size)
        rows = np.searchsorted(evaluations, ends, side="right") - 1
        return np.asarray(rows[rows >= 0])

    def result(self, stopped_by: str) -> Result:
        """The best arm so far, followed along every demonstration once more.

        Args:
            stopped_by: What ended the search: a stop rule, or ``interrupted``.

        Raises:
            NothingFoundError: No candidate has reached the first frame.
        """
        if not np.isfinite(self.swarm.best_fitness):
            raise nothing_found(self.problem, self.nearest)
        problem, best = evaluate_candidate(self.swarm.best_position, self.problem)
        history, settings = self.swarm.history, self.settings
        effort = history.effort
        facts = SearchFacts(
            algorithm=settings.algorithm,
            seed=settings.seed,
            evaluations=int(history.evaluations[-1]),
            rejected=asdict(self.rejections),
            converged_at=effort.iterations,
            computational_effort=effort.computational_effort,
            mean_valid=effort.mean_valid,
            stopped_by=stopped_by,
            wall_time=self.elapsed,
            agreement=self.swarm.agreement,
        )
        return Result(problem, best, history, facts, self.swarm.basins)

    def state(self) -> State:
        """Everything that another process needs to go on, as arrays and values that JSON can hold."""
        search = {  # text keeps infinity, which JSON does not
            "rejections": asdict(self.rejections),
            "leader": [repr(x) for x in self.leader],
            "nearest": repr(self.nearest),
            "elapsed": self.elapsed,
        }
        return self.swarm.state() | {"search": search}

    def restore(self, state: State) -> None:
        """Go on where a state was taken; the length in the settings counts, so that a search can be extended.

        Args:
            state: What `state` returned, for the same problem.

        Raises:
            SearchError: The state is damaged, or that of another problem.
        """
        search = dict(state["search"])
        swarm = {name: value for name, value in state.items() if name != "search"}
        length = getattr(self.settings, self.swarm.length)
        space = search_space(self.settings, self.space)
        self.swarm = algorithm_from_state(swarm, space, length, parameters(self.settings, self.space))
        self.rejections = Rejections(**search["rejections"])
        r, f, E = search["leader"]
        self.leader = float(r), float(f), float(E)
        self.nearest = float(search["nearest"])
        self.earlier, self.began = float(search["elapsed"]), time.monotonic()


def search(
    problem: DesignProblem,
    *,
    on_progress: Callable[[Progress], None] | None = None,
    block: int | None = None,
    backend: Backend | None = None,
) -> Result:
    """Search for the arm that follows the demonstrations best.

    Args:
        problem: The demonstrations and the settings, see ``prepare``.
        on_progress: Called after every batch of candidates.
        block: Arms evaluated side by side in this process; any value gives the same result.
        backend: Who evaluates; by default this process.

    Raises:
        NothingFoundError: No candidate reached the first frame.
        SettingsError: The bounds leave no arm.
    """
    run = Search(problem, InProcess(problem, block) if backend is None else backend)
    while (reason := run.ended_by()) is None:
        progress = run.advance()
        if on_progress is not None and progress is not None:
            on_progress(progress)
    run.gather(reason)
    return run.result(reason)


def stalled(best: Array, patience: int, gain: float = 1e-3) -> bool:
    """Whether the last iterations have brought too little.

    Args:
        best: The best fitness after every iteration, shape (M,).
        patience: Number of iterations that count.
        gain: What they have to bring, relative.
    """
    if len(best) <= patience or not np.isfinite(best[-1 - patience]):
        return False
    return bool(best[-1] > (1.0 - gain) * best[-1 - patience])


def nothing_found(problem: DesignProblem, nearest: float) -> NothingFoundError:
    """The error of a search in which no arm was valid.

    Args:
        problem: The demonstrations and the settings.
        nearest: Smallest distance between a first frame's end-effector and the hand [m].
    """
    tolerance = problem.settings.fitness.reach_tolerance
    if problem.settings.fitness.reach_frames == "all" and nearest <= tolerance:
        return NothingFoundError(
            f"no candidate keeps its end-effector within {tolerance * 1e3:g} mm of the hand in every frame, though "
            "some reach it at the start",
            value=tolerance,
            fix="Raise fitness.reach_tolerance, use more joints (design.dof), or reach_frames = 'start'",
        )
    miss = f"the nearest stopped {nearest * 1e3:.1f} mm short" if np.isfinite(nearest) else "none came near it"
    settings = problem.settings.search
    larger = "a larger --budget" if settings.has("budget") else "more --particles or --iterations"
    return NothingFoundError(
        f"no candidate brings its end-effector within {tolerance * 1e3:g} mm of the hand's first point: {miss}",
        value=nearest,
        fix=f"Use more joints (--dof), {larger}, or wider bounds",
    )
