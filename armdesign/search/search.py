"""The search for the best arm: an algorithm asks for designs, a backend evaluates them, stop rules end it."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.errors import SearchError, SettingsError, counted
from armdesign.fitness.block import Scores
from armdesign.fitness.constraints import DesignSpace
from armdesign.fitness.robot import Rejections
from armdesign.search.arm_symmetry import canonical_form, length_slab
from armdesign.search.backends.backend import Backend, InProcess
from armdesign.search.design_problem import DesignProblem
from armdesign.search.evaluation import evaluate_candidate
from armdesign.search.result import Result, SearchFacts
from armdesign.settings.sections import Search as SearchSettings
from armdesign.swarm import (
    Algorithm,
    Box,
    Sampler,
    SearchSpace,
    State,
    algorithm_from_state,
    make_algorithm,
)


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

    def advance(self) -> Progress:
        """Evaluate the next batch of candidates; returns how far the search is then."""
        swarm = self.swarm
        X = swarm.ask()
        # what comes to lie beyond its cutoff may be dropped on the way: it changes nothing of what the swarm does next
        cutoff = swarm.cutoff if self.settings.prune else np.full(len(X), np.inf)
        hints = swarm.hints
        sloped = swarm.wants_slopes
        scores, removed = self.backend.evaluate(X, cutoff, hints, slopes=sloped, coarse=swarm.coarse)
        slopes = scores.slopes if sloped and scores.slopes.shape[1] else None
        if not swarm.coarse:
            self.leader = better(self.leader, scores, hints)
        swarm.tell(scores.fitness, scores.valid, scores.q0, slopes)
        self.rejections += removed
        self.nearest = min(self.nearest, float(scores.start_error.min()))
        valid = int(scores.valid.sum())
        return Progress(*swarm.progress, *self.leader, valid, len(X), self.elapsed, unit=swarm.unit)

    def ended_by(self) -> str | None:
        """The stop rule that holds now, by the name of its setting; None to go on."""
        settings, best = self.settings, self.swarm.history.best
        if self.swarm.done:
            return self.swarm.ending
        if settings.target is not None and self.swarm.best_fitness <= settings.target:
            return "target"
        if settings.patience is not None and stalled(best[self.steps()], settings.patience):
            return "patience"
        if settings.time_limit is not None and self.elapsed >= settings.time_limit:
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
        self.swarm = algorithm_from_state(swarm, space, length, asdict(self.settings))
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
        if on_progress is not None:
            on_progress(progress)
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


def new_swarm(settings: SearchSettings, space: DesignSpace) -> Algorithm:
    """The search algorithm of the settings, before its first batch.

    Args:
        settings: The algorithm with its parameters, seed, and designs to begin with.
        space: The design space.
    """
    rng = np.random.default_rng(settings.seed)
    return make_algorithm(settings.algorithm, search_space(settings, space), rng, asdict(settings))


def search_space(settings: SearchSettings, space: DesignSpace) -> SearchSpace:
    """What a search algorithm may know of designs: bounds, the arm's length, equal arms, and how to draw valid ones.

    Args:
        settings: Designs to begin with.
        space: The design space.
    """
    return SearchSpace(
        Box(*space.bounds, space.angular), sample=first_generation(settings, space), anew=space.sample,
        slab=length_slab(space), canonical=canonical_form(space),
    )  # fmt: skip


def first_generation(settings: SearchSettings, space: DesignSpace) -> Sampler:
    """Where a search begins: the designs of ``search.first``, the others drawn from Omega_l.

    As much is drawn as without them, so that the random numbers of the search stay what they are without.

    Args:
        settings: Designs to begin with.
        space: The design space.

    Raises:
        SettingsError: A design has another number of entries than Phi or lies outside the bounds; when drawn, also
            where there are more designs than the first generation has room for.
    """
    first = settings.first or ()
    names = space.free_names
    for k, design in enumerate(first):
        if len(design) != len(names):
            raise SettingsError(
                f"search.first[{k}] has {counted(len(design), 'number')}", value=len(design),
                allowed=f"{len(names)}: {', '.join(names)}",
            )  # fmt: skip
        for name, x, low, high in zip(names, design, *space.bounds, strict=True):
            if not low <= x <= high:
                raise SettingsError(
                    f"search.first[{k}] has {name} = {x:g}", value=x, allowed=f"{low:g} to {high:g}, its bounds"
                )

    def sample(rng: np.random.Generator, count: int) -> Array:
        if len(first) > count:
            raise SettingsError(
                f"search.first has {len(first)} designs for a first generation of {counted(count, 'candidate')}",
                value=len(first), allowed=f"up to {count}", fix="Leave some out, or make the search larger",
            )  # fmt: skip
        X = space.sample(rng, count)
        if first:
            X[: len(first)] = first
        return X

    return sample


def better(
    leader: tuple[float, float, float], scores: Scores, hints: Array | None = None
) -> tuple[float, float, float]:
    """The better of the best arm so far and the best of a batch.

    Candidates evaluated with a hint do not count: from a start pose searched anew they may do worse.

    Args:
        leader: r, f and E of the best arm so far [m].
        scores: Scores of the batch.
        hints: Start poses that the batch was evaluated with, shape (N, n); a row that is not finite stands for none.
    """
    pure = scores.fitness if hints is None else np.where(np.isfinite(hints).all(axis=1), np.inf, scores.fitness)
    k = int(np.argmin(pure))
    if pure[k] < leader[0]:
        return float(scores.fitness[k]), float(scores.path_fitness[k]), float(scores.area[k])
    return leader


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
