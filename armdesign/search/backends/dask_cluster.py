"""A Dask cluster: a generation is shared out in chunks among the workers of a scheduler, wherever they run.

Dask does what it is made for: it hands the chunks out, moves them from a worker that is lost to another, restarts
workers, and gives up on a chunk that brings down one worker after the other (its setting
``distributed.scheduler.allowed-failures``). The task travels to each worker once, as a worker plugin, which also
reaches workers that join later and keeps the block of arms that the worker builds.

Needs the extra ``cluster``, and is imported only where a cluster is asked for.
"""

from __future__ import annotations

import contextlib
import math
import threading
import time
import uuid
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from armdesign._types import Array
from armdesign.fitness.block import Scores, compile_kernels
from armdesign.fitness.robot import Generation, Rejections
from armdesign.search.backends.backend import Closing, InProcess, join
from armdesign.search.backends.dask_connection import Say, await_all, explained, kernels_here, other_version
from armdesign.search.backends.processes import CandidateKillsWorkersError
from armdesign.search.design_problem import DesignProblem

from distributed import Client, Future, KilledWorker, WorkerPlugin, get_worker  # isort: skip (its lack is told above)
from distributed import TimeoutError as StillWaitingError  # isort: skip

if TYPE_CHECKING:
    from distributed import Worker

LARGEST, SMALLEST = 1.0, 0.1
"""Work in a chunk [s]: at most a second, so that a lost worker loses little and the ends even out; at least ten times
what handing it out costs, 3 to 10 ms."""
FEWEST = 40
"""Candidates a chunk holds in any case: with fewer the block of arms stays half empty at the end of every chunk."""
FIRST_PACE = 0.01
"""Time per candidate taken for granted until one is measured [s]."""


@dataclass(frozen=True)
class Answer:
    """What a worker makes of a chunk.

    Attributes:
        scores: Scores of its candidates.
        removed: What removed the others.
        seconds: Time the evaluation took [s].
    """

    scores: Scores
    removed: Rejections
    seconds: float


class TaskPlugin(WorkerPlugin):  # type: ignore[misc,unused-ignore]
    """The task on a worker. What travels is the task alone; the block of arms is built there, and kept."""

    def __init__(self, name: str, problem: DesignProblem, block: int | None = None) -> None:
        """Put up what travels.

        Args:
            name: Name under which the worker keeps it.
            problem: Task and settings.
            block: Arms side by side.
        """
        self.name, self.problem, self.block = name, problem, block
        self.kernels = kernels_here()

    def setup(self, worker: Worker) -> None:
        """Arrive on a worker; compiling and building wait for the first chunk, off the worker's event loop."""
        self.lock = threading.Lock()
        self.backend: InProcess | None = None

    def evaluate(self, Phi: Array, cutoff: Array, poses: Array | None, *, slopes: bool) -> Answer:
        """Evaluate a chunk; one at a time, however many threads the worker has.

        Raises:
            SearchError: The worker runs other kernels than the client.
        """
        with self.lock:
            backend = self._built()
            began = time.perf_counter()
            scores, removed = backend.evaluate(Phi, cutoff, poses, slopes=slopes)
            return Answer(scores, removed, time.perf_counter() - began)

    def _built(self) -> InProcess:
        """The block of arms, built at the first chunk."""
        if self.backend is None:
            if self.kernels != kernels_here():
                raise other_version(get_worker().address, self.kernels, kernels_here())
            compile_kernels(self.problem.path_problem)
            self.backend = InProcess(self.problem, self.block)
        return self.backend


class DaskCluster(Closing):
    """Evaluates on the workers of a Dask cluster; the same scores as in one process, whatever they are."""

    def __init__(
        self, client: Client, problem: DesignProblem, block: int | None = None, *, say: Say | None = None
    ) -> None:
        """Send the task to the workers.

        Args:
            client: Connection to the scheduler, see dask_connection.connect; stays open when the backend closes.
            problem: Task and settings; travels to each worker once.
            block: Arms side by side on each.
            say: Called with a sentence when the search has to wait for workers.

        Raises:
            SearchError: The connection is lost, or a worker cannot load the task.
        """
        self.client, self.say = client, say
        self.address = str(client.scheduler.address)
        self.name = f"armdesign-{uuid.uuid4().hex}"
        self.pace = FIRST_PACE
        self.futures: list[Future] = []
        with explained(self.address):
            client.register_plugin(TaskPlugin(self.name, problem, block), name=self.name)

    def evaluate(
        self, Phi: Array, cutoff: Array, poses: Array | None = None, *, slopes: bool = False
    ) -> tuple[Scores, Rejections]:
        """See Backend.evaluate.

        Raises:
            CandidateKillsWorkersError: A candidate has killed as many workers as Dask allows.
            SearchError: The scheduler is lost, or a worker cannot evaluate.
        """
        with explained(self.address):
            chunks = cut(len(Phi), len(self.client.nthreads()), self.pace)
            answers = self._answers(chunks, Generation(Phi, cutoff, poses, slopes=slopes))
        self.futures = []
        self.pace = max(sum(answer.seconds for answer in answers) / len(Phi), 1e-6)
        return join([answer.scores for answer in answers]), sum((a.removed for a in answers), Rejections())

    def close(self) -> None:
        """Take the task off the workers; chunks not begun are dropped."""
        if self.client.status == "running":
            with contextlib.suppress(OSError, StillWaitingError):  # the scheduler has just gone
                self.client.cancel(self.futures)
                self.client.unregister_worker_plugin(self.name)
        self.futures = []

    def _answers(self, chunks: list[slice], generation: Generation) -> list[Answer]:
        """Answers to all chunks in their order; a chunk that Dask gave up on is taken apart."""
        futures = self._submit(chunks, generation)
        try:
            return self._gather(futures)
        except KilledWorker:
            pass
        answers = []
        for chunk, future in zip(chunks, futures, strict=True):
            try:
                answers += self._gather([future])
            except KilledWorker:
                answers += [self._alone(k, generation) for k in range(chunk.start, chunk.stop)]
        return answers

    def _alone(self, k: int, generation: Generation) -> Answer:
        """Answer to one candidate with nothing else in the queue, so that no other can be blamed."""
        try:
            (answer,) = self._gather(self._submit([slice(k, k + 1)], generation))
        except KilledWorker as error:
            design = np.asarray(generation.Phi)[k]
            raise CandidateKillsWorkersError(
                f"a candidate has killed {error.allowed_failures + 1} workers of the cluster: Phi = {design.tolist()}",
                value=design.copy(),
                fix="Please report it with the saved candidate; another seed avoids it",
            ) from error
        return answer

    def _submit(self, chunks: list[slice], generation: Generation) -> list[Future]:
        """Hand chunks over to the scheduler."""
        parts = [generation.part(chunk) for chunk in chunks]
        pieces = [part.Phi for part in parts], [part.cutoff for part in parts], [part.poses for part in parts]
        self.futures = self.client.map(evaluate_chunk, *pieces, holder=self.name, slopes=generation.slopes, pure=False)
        return self.futures

    def _gather(self, futures: list[Future]) -> list[Answer]:
        """Wait for answers and collect them."""
        await_all(self.client, futures, self.say)
        answers: list[Answer] = self.client.gather(futures)
        return answers


def evaluate_chunk(Phi: Array, cutoff: Array, poses: Array | None, holder: str, slopes: bool) -> Answer:
    """Body of a chunk on a worker.

    Args:
        Phi: Designs, shape (K, D) [rad, m].
        cutoff: Fitness beyond which a candidate may be dropped, shape (K,).
        poses: Start poses, shape (K, n) [rad], or None.
        holder: Name of the plugin that holds the task.
        slopes: Whether the gradients of r are wanted.
    """
    plugin: TaskPlugin = get_worker().plugins[holder]
    return plugin.evaluate(Phi, cutoff, poses, slopes=slopes)


def cut(count: int, workers: int, pace: float) -> list[slice]:
    """Cut a generation into chunks: the large ones first, so that the small ones even out the ends.

    Each takes half of an even share of what is left, but no more work than LARGEST and no less than SMALLEST, no fewer
    candidates than FEWEST, and before all never more than an even share of the whole.

    Args:
        count: Candidates.
        workers: Worker processes; none counts as one.
        pace: Time per candidate [s].
    """
    share = math.ceil(count / max(workers, 1))
    largest = min(share, max(FEWEST, int(LARGEST / pace)))
    smallest = min(largest, max(FEWEST, math.ceil(SMALLEST / pace)))
    chunks, first = [], 0
    while first < count:
        half_share = math.ceil((count - first) / (2 * max(workers, 1)))
        last = min(count, first + min(largest, max(smallest, half_share)))
        chunks.append(slice(first, last))
        first = last
    return chunks
