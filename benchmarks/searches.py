"""Per search: default and RA-PSO in a run folder, what they spend besides evaluating, and what pruning brings."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from plan import Job, Plan, designs
from tables import Row, Table

from armdesign.fitness.block import Scores
from armdesign.fitness.robot import Rejections
from armdesign.runs.resumable import carry_out
from armdesign.search.backends.backend import InProcess
from armdesign.search.design_problem import DesignProblem
from armdesign.search.result import Result

Array = NDArray[np.float64]
DOF = 3


@dataclass
class TimedBackend(InProcess):
    """Evaluates in this process, by the clock.

    Attributes:
        problem: Task and settings.
        seconds: Time spent evaluating.
        frames: Frames solved.
        steps: Kernel evaluations.
        first: When the first evaluation began.
        last: When the last one ended.
    """

    problem: DesignProblem
    seconds: float = 0.0
    frames: int = 0
    steps: int = 0
    first: float = field(default=np.inf)
    last: float = 0.0

    def __post_init__(self) -> None:
        """Allocate the block, and touch everything once."""
        super().__init__(self.problem)
        some = designs(self.problem, 8)
        super().evaluate(some, np.full(len(some), np.inf))

    def evaluate(
        self, Phi: Array, cutoff: Array, poses: Array | None = None, *, slopes: bool = False, coarse: int = 0
    ) -> tuple[Scores, Rejections]:
        """See Backend.evaluate."""
        began = time.perf_counter()
        scores, removed = super().evaluate(Phi, cutoff, poses, slopes=slopes, coarse=coarse)
        self.last = time.perf_counter()
        self.first = min(self.first, began)
        self.seconds += self.last - began
        self.frames += int(scores.frames.sum())
        self.steps += int(scores.steps.sum())
        return scores, removed


@dataclass(frozen=True)
class Searched:
    """A search with its times [s]: whole, evaluating, between first and last evaluation; frames solved and steps."""

    result: Result
    wall: float
    evaluating: float
    iterating: float
    frames: int
    steps: int


def tables(plan: Plan) -> Iterator[Table]:
    """Default searches, those of RA-PSO and, on fewer iterations, with and without pruning."""
    (iterations, compared), budget = plan.pick((200, 60), (10, 5)), plan.pick(25_000, 1_000)
    searched(plan.jobs[0].problem(DOF, search={"iterations": 1}))  # loads what a first run folder loads
    notes = [
        "glue: part of the batches' time that is not evaluation (the search's own work, saving).",
        "ends: seconds before the first evaluation and behind the last one (settings, best path, URDF, files).",
    ]
    yield Table(
        "search",
        f"A default search in a run folder, n = {DOF}, {budget} candidates, one process, state saved after every batch "
        "(one run)",
        [search_row(job, {"budget": budget}) for job in plan.jobs],
        notes,
    )
    yield Table(
        "swarm",
        f"The same by RA-PSO, n = {DOF}, N = 400, M = {iterations}",
        [search_row(job, {"iterations": iterations}) for job in plan.jobs],
        [*notes, "The aim for glue is 5 % at most."],
    )
    yield Table(
        "pruning",
        f"What each test removed and what pruning saves, n = {DOF}, N = 400, M = {compared} (one run each)",
        [pruning_row(job, compared) for job in plan.jobs],
        ["Per cent of all candidates, in the order of the tests. same: the history is the same to the last bit."],
    )


def search_row(job: Job, search: dict[str, int]) -> Row:
    """A search with these settings."""
    done = searched(job.problem(DOF, search=search))
    return {
        "task": job.name,
        "wall s": done.wall,
        "evaluating s": done.evaluating,
        "glue %": 100.0 * (1.0 - done.evaluating / done.iterating),
        "ends s": done.wall - done.iterating,
        "us/candidate": 1e6 * done.evaluating / int(done.result.history.evaluations[-1]),
        "r mm": 1e3 * done.result.fitness,
    }


def pruning_row(job: Job, iterations: int) -> Row:
    """The same search with and without pruning."""
    plain, pruned = (
        searched(job.problem(DOF, search={"iterations": iterations, "prune": prune})) for prune in (False, True)
    )
    removed, count = pruned.result.facts.rejected, int(pruned.result.history.evaluations[-1])
    tests = ("constraints", "reach", "start", "pruned")
    shares = {name: removed[name] for name in tests} | {"whole path": count - sum(removed[name] for name in tests)}
    return {
        "task": job.name,
        **{f"{name} %": 100.0 * number / count for name, number in shares.items()},
        "frames saved %": 100.0 * (1.0 - pruned.frames / plain.frames),
        "steps saved %": 100.0 * (1.0 - pruned.steps / plain.steps),
        "s unpruned": plain.evaluating,
        "s pruned": pruned.evaluating,
        "x faster": plain.evaluating / pruned.evaluating,
        "same": "yes" if np.array_equal(plain.result.history.best, pruned.result.history.best) else "NO",
    }


def searched(problem: DesignProblem) -> Searched:
    """Carry out a search in a temporary run folder."""
    with tempfile.TemporaryDirectory() as folder, TimedBackend(problem) as backend:
        began = time.perf_counter()
        result, _ = carry_out(Path(folder), problem, backend, fresh=True)
        wall = time.perf_counter() - began
    if result.facts.interrupted:  # Ctrl-C or SIGTERM: half a search is no measurement
        raise KeyboardInterrupt
    return Searched(result, wall, backend.seconds, backend.last - backend.first, backend.frames, backend.steps)
