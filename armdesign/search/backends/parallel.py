"""Candidates evaluated by workers: a generation is shared out in equal parts, and put together again.

Where it is so small that more workers would not be faster, it goes to fewer, see ``shares``. A search that is made of
parts has them carried on by the same workers, see ``part_scheduler``.

A worker that dies costs nothing but time: its part is done again. A part that kills twice is taken apart into single
candidates, and a candidate that kills its workers ends the search, by name.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.errors import SearchError
from armdesign.fitness.block import Scores, compile_kernels
from armdesign.fitness.robot import Generation, Rejections
from armdesign.search.backends.backend import InProcess, join
from armdesign.search.backends.processes import WorkerProcesses
from armdesign.search.backends.shares import Shares
from armdesign.search.backends.workers import Closing, Event, Handler, Job, JobContext, Workers
from armdesign.search.design_problem import DesignProblem
from armdesign.search.swarms import search_space, step
from armdesign.swarm import Part, State

LONGEST = 1.0
"""Work in a part, about [s]: a lost worker loses little, and handing a part out, 0.2 to 10 ms, does not count."""
FIRST_PACE = 1e-3
"""Time per candidate taken for granted until one is measured [s]."""
DEATHS_OF_A_PART = 2
LOOK_EVERY = 5.0
"""Longest time between two looks at the workers [s]."""


class CandidateKillsWorkersError(SearchError):
    """A candidate has brought down every worker that tried it; ``value`` is its Phi."""


@dataclass(frozen=True)
class Answer:
    """What a worker makes of its part of a generation.

    Attributes:
        scores: Scores of its candidates.
        removed: What removed the others.
        seconds: Time the evaluation took [s].
    """

    scores: Scores
    removed: Rejections
    seconds: float


class Stretch(NamedTuple):
    """A part of a search, to be carried on with for a while.

    Attributes:
        state: The part, see `Part.state`.
        seconds: How long [s].
    """

    state: State
    seconds: float = 0.5


def evaluator(problem: DesignProblem, block: int | None = None) -> Handler:
    """The setup of a worker that evaluates candidates, or carries on parts of the search: builds its block once.

    Args:
        problem: Task and settings.
        block: Arms side by side.
    """
    compile_kernels(problem.path_problem)
    backend = InProcess(problem, block)
    space, prune = search_space(problem.settings.search, problem.space), problem.settings.search.prune

    def carry_on(stretch: Stretch) -> State:
        end, part = time.monotonic() + stretch.seconds, Part.from_state(stretch.state, space)
        while True:
            step(part, backend, prune=prune)
            if part.done or time.monotonic() >= end:
                return part.state()

    def evaluate(part: Generation | Stretch, context: JobContext) -> Answer | State:
        if isinstance(part, Stretch):
            return carry_on(part)
        began = time.perf_counter()
        scores, removed = backend.evaluate(
            part.Phi, part.cutoff, part.poses, slopes=part.slopes, coarse=part.coarse  # type: ignore[arg-type]
        )  # fmt: skip
        return Answer(scores, removed, time.perf_counter() - began)

    return evaluate


class ParallelBackend(Closing):
    """Evaluates on workers; the same scores as in one process, whatever their number and the parts."""

    def __init__(self, workers: Workers) -> None:
        """Take over the workers; they close with the backend.

        Args:
            workers: Started with the setup ``evaluator``.
        """
        self.workers, self.shares = workers, Shares()
        self.paces: dict[int, float] = {}  # by the number of coarse frames

    def evaluate(
        self, Phi: Array, cutoff: Array, poses: Array | None = None, *, slopes: bool = False, coarse: int = 0
    ) -> tuple[Scores, Rejections]:
        """See Backend.evaluate.

        Raises:
            CandidateKillsWorkersError: A candidate has killed several workers.
            SearchError: Workers do not start, or the connection to them is lost.
        """
        self.workers.drop()  # of a generation that was broken off nobody wants the answers
        generation = Generation(Phi, cutoff, poses, slopes=slopes, coarse=coarse)
        kind, started, began = (coarse, slopes, poses is None), self.workers.started(), time.perf_counter()
        share = self.shares.choose(kind, len(Phi), self.workers.room())
        parts = cut(len(Phi), share, self.paces.get(coarse, FIRST_PACE))
        ends = self._done([Job(generation.part(part), DEATHS_OF_A_PART) for part in parts])
        answers: list[Answer] = []
        for part, end in zip(parts, ends, strict=True):
            if end.kind == "given up":
                answers += [self._alone(generation.part(slice(k, k + 1))) for k in range(part.start, part.stop)]
            else:
                answers.append(end.content)
        if started:
            self.shares.learn(kind, len(Phi), share, time.perf_counter() - began)
        self.paces[coarse] = max(sum(answer.seconds for answer in answers) / len(Phi), 1e-6)
        return join([answer.scores for answer in answers]), sum((a.removed for a in answers), Rejections())

    def close(self) -> None:
        """See Backend.close."""
        self.workers.close()

    def _alone(self, candidate: Generation) -> Answer:
        """The answer to a suspect candidate, with no other job at hand, so that no other can be blamed.

        Raises:
            CandidateKillsWorkersError: It has killed as many workers as a job may.
        """
        job = Job(candidate)
        (end,) = self._done([job])
        if end.kind == "given up":
            design = np.asarray(candidate.Phi)[0]
            raise CandidateKillsWorkersError(
                f"a candidate has killed {job.deaths} worker processes: Phi = {design.tolist()}",
                value=design.copy(),
                fix="Please report it with failed_candidate.json of the run folder; another seed avoids it",
            )
        answer: Answer = end.content
        return answer

    def _done(self, jobs: Sequence[Job]) -> list[Event]:
        """How every job has ended, in the order of the jobs.

        Raises:
            ArmDesignError: A worker reports an error, such as one for bad input.
        """
        waiting, ends = deque(jobs), dict[Job, Event]()
        while len(ends) < len(jobs):
            if waiting:
                for _ in range(min(len(waiting), self.workers.room())):
                    self.workers.begin(waiting.popleft())
            for event in self.workers.wait(LOOK_EVERY):
                if event.kind == "error":
                    raise event.content
                if event.is_end:
                    ends[event.job] = event
        return [ends[job] for job in jobs]


class WorkerPool(ParallelBackend):
    """Evaluates on worker processes on this machine."""

    workers: WorkerProcesses

    def __init__(self, problem: DesignProblem, workers: int, block: int | None = None) -> None:
        """Start the processes.

        Args:
            problem: Task and settings; travels to each worker once.
            workers: Number of processes, at least 1.
            block: Arms side by side in each.
        """
        super().__init__(WorkerProcesses(workers, evaluator, problem, block))

    @property
    def pids(self) -> list[int]:
        """Process numbers of the workers."""
        return self.workers.pids


def cut(count: int, workers: int, pace: float) -> list[slice]:
    """Cut a generation into equal parts: one for each worker, or several where one would take longer than LONGEST.

    Each end of a part leaves the block of arms half empty for a while, so that fewer parts are less work.

    Args:
        count: Candidates.
        workers: Worker processes; none counts as one.
        pace: Time per candidate [s].
    """
    workers = max(workers, 1)
    parts = min(count, workers * max(1, math.ceil(count * pace / workers / LONGEST)))
    return [slice(k * count // parts, (k + 1) * count // parts) for k in range(parts)]
