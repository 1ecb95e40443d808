"""Worker processes on this machine: a generation is shared out in chunks, a dead worker is replaced.

Each worker builds its own block of arms once and then answers chunks over a pipe. A worker that dies costs nothing
but time: its chunk is done again. A chunk that kills twice is taken apart into single candidates, and a candidate that
kills three times ends the search, by name.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import select
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import TypeAlias

from armdesign._types import Array
from armdesign.errors import ArmDesignError, SearchError
from armdesign.fitness.block import Scores
from armdesign.fitness.robot import Generation, Rejections
from armdesign.search.backends.backend import Closing, InProcess, join
from armdesign.search.design_problem import DesignProblem

Answer: TypeAlias = tuple[Scores, Rejections]
DEATHS_OF_A_CHUNK, DEATHS_OF_A_CANDIDATE, FALSE_STARTS = 2, 3, 5
GRACE = 0.5
"""How long idle workers may take to end before they are killed [s]."""
LARGEST, SMALLEST = 128, 16
"""Candidates in a chunk: few enough that a chunk and an answer always fit into the pipe together, and enough to pay."""
AHEAD = 2
"""Chunks a worker may hold: the arms of the next one begin beside the last arms of the first."""


class CandidateKillsWorkersError(SearchError):
    """A candidate has brought down every worker that tried it; ``value`` is its Phi."""


@dataclass
class Chunk:
    """Consecutive candidates of a generation."""

    first: int
    last: int
    deaths: int = 0


@dataclass
class Worker:
    """A process, the pipe to it, the chunks it is at, and whether it has come as far as taking any."""

    process: SpawnProcess
    pipe: Connection
    chunks: deque[Chunk] = field(default_factory=deque)
    ready: bool = False

    def may_take(self, chunk: Chunk) -> bool:
        """Whether there is room for a chunk; one on which a worker has died is dealt with alone."""
        alone = chunk.deaths > 0 or any(held.deaths > 0 for held in self.chunks)
        return not self.chunks or (len(self.chunks) < AHEAD and not alone)


def available_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class WorkerPool(Closing):
    """Evaluates on worker processes; the same scores as in one process, whatever the number and the chunks."""

    def __init__(self, problem: DesignProblem, workers: int, block: int | None = None) -> None:
        """Start the workers.

        Args:
            problem: Task and settings; travels to each worker once.
            workers: Number of processes, at least 1.
            block: Arms side by side in each.
        """
        self.problem, self.block = problem, block
        self.context = multiprocessing.get_context("spawn")
        self.false_starts = 0
        self.workers = [self._start() for _ in range(workers)]

    @property
    def pids(self) -> list[int]:
        """Process numbers of the workers."""
        return [worker.process.pid or 0 for worker in self.workers]

    def evaluate(
        self, Phi: Array, cutoff: Array, poses: Array | None = None, *, slopes: bool = False
    ) -> tuple[Scores, Rejections]:
        """See Backend.evaluate.

        Raises:
            CandidateKillsWorkersError: A candidate has killed three workers.
            SearchError: Workers do not start.
        """
        self._end_unfinished()
        generation = Generation(Phi, cutoff, poses, slopes=slopes)
        waiting = deque(cut(len(Phi), len(self.workers)))
        done: dict[int, Answer] = {}
        remaining = len(Phi)
        while remaining:
            self._hand_out(waiting, generation)
            for worker in self._answering():
                try:
                    answer = self._receive(worker)
                except (EOFError, OSError):
                    waiting.extendleft(reversed(self._after_death(worker, Phi)))
                    continue
                if answer is not None:
                    chunk = worker.chunks.popleft()
                    done[chunk.first] = answer
                    remaining -= chunk.last - chunk.first
        parts = [done[first] for first in sorted(done)]
        return join([scores for scores, _ in parts]), sum((removed for _, removed in parts), Rejections())

    def close(self) -> None:
        """End the workers."""
        for worker in self.workers:
            worker.pipe.close()
        deadline = time.monotonic() + GRACE
        for worker in self.workers:
            worker.process.join(max(0.0, deadline - time.monotonic()))
            if worker.process.is_alive():
                worker.process.kill()
                worker.process.join()
        self.workers = []

    def _start(self) -> Worker:
        """Start one worker."""
        ours, theirs = self.context.Pipe()
        process = self.context.Process(target=work, args=(theirs, self.problem, self.block), daemon=True)
        with children_ignore_ctrl_c():
            process.start()
        theirs.close()
        return Worker(process, ours)

    def _replace(self, worker: Worker) -> None:
        """Put another process in the place of one that is dead or has to go."""
        worker.pipe.close()
        worker.process.kill()
        worker.process.join()
        fresh = self._start()
        worker.process, worker.pipe, worker.chunks, worker.ready = fresh.process, fresh.pipe, deque(), False

    def _end_unfinished(self) -> None:
        """Replace workers that are still at a generation that was broken off; nobody wants their answers."""
        for worker in self.workers:
            if worker.chunks:
                self._replace(worker)

    def _hand_out(self, waiting: deque[Chunk], generation: Generation) -> None:
        """Give every worker with room for it a chunk, those without any first."""
        for _ in range(AHEAD):
            for worker in sorted(self.workers, key=lambda worker: len(worker.chunks)):
                if waiting and worker.may_take(waiting[0]):
                    chunk = waiting.popleft()
                    worker.chunks.append(chunk)
                    with contextlib.suppress(OSError):  # died while idle: its end shows when its answer is read
                        worker.pipe.send(generation.part(slice(chunk.first, chunk.last)))

    def _answering(self) -> list[Worker]:
        """Workers that have answered or died."""
        busy = {worker.pipe: worker for worker in self.workers if worker.chunks}
        return [busy[pipe] for pipe in wait(list(busy)) if isinstance(pipe, Connection)]

    def _receive(self, worker: Worker) -> Answer | None:
        """The answer to the oldest chunk of a worker; None where it says that it is ready.

        Raises:
            EOFError, OSError: It has died.
            ArmDesignError: It reports an error for bad input.
        """
        answer: Answer | ArmDesignError | None = worker.pipe.recv()
        if answer is None:
            worker.ready, self.false_starts = True, 0
            return None
        if isinstance(answer, ArmDesignError):
            raise answer  # another chunk may never be answered: the worker is replaced, see _end_unfinished
        return answer

    def _after_death(self, worker: Worker, Phi: Array) -> list[Chunk]:
        """Replace a dead worker; returns what has to be done again."""
        ready, chunks = worker.ready, list(worker.chunks)
        self._replace(worker)
        if ready:
            return [again for chunk in chunks for again in blame(chunk, Phi)]
        self.false_starts += 1
        if self.false_starts >= FALSE_STARTS:
            raise SearchError(
                f"{self.false_starts} worker processes in a row ended before they were ready",
                fix="Use one worker, and in a script start the search under: if __name__ == '__main__'",
            )
        return chunks


def blame(chunk: Chunk, Phi: Array) -> list[Chunk]:
    """What to do again after a worker died on a chunk of candidates Phi.

    Raises:
        CandidateKillsWorkersError: It is one candidate's third time.
    """
    chunk.deaths += 1
    if chunk.last - chunk.first == 1:
        if chunk.deaths < DEATHS_OF_A_CANDIDATE:
            return [chunk]
        raise CandidateKillsWorkersError(
            f"a candidate has killed {chunk.deaths} worker processes: Phi = {Phi[chunk.first].tolist()}",
            value=Phi[chunk.first].copy(),
            fix="Please report it with failed_candidate.json of the run folder; another seed avoids it",
        )
    if chunk.deaths < DEATHS_OF_A_CHUNK:
        return [chunk]
    return [Chunk(k, k + 1) for k in range(chunk.first, chunk.last)]


def cut(count: int, workers: int) -> list[Chunk]:
    """Cut a generation into chunks, each two thirds of a worker's share of what is left, so that all end together."""
    chunks, first = [], 0
    while first < count:
        share = round((count - first) / (1.5 * workers))
        last = min(count, first + min(LARGEST, max(SMALLEST, share)))
        chunks.append(Chunk(first, last))
        first = last
    return chunks


@contextmanager
def children_ignore_ctrl_c() -> Iterator[None]:
    """Keep Ctrl-C from processes that are started meanwhile, from their first moment on; here it comes a bit later."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # starts with the first worker otherwise, and takes the mask off
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def end_with_parent() -> None:
    """End this worker at once when the process that started it is gone, even in the middle of a chunk."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def quick_poll(pipe: Connection) -> Callable[[], object]:
    """Tells whether something has come; Connection.poll takes as long as a round of the whole block."""
    if not hasattr(select, "poll"):
        return pipe.poll
    poller = select.poll()
    poller.register(pipe.fileno(), select.POLLIN | select.POLLHUP)
    return lambda: poller.poll(0)


def work(pipe: Connection, problem: DesignProblem, block: int | None) -> None:
    """Body of a worker process: answer chunks until the pipe closes. Ctrl-C is the parent's to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with_parent, daemon=True).start()
    backend, has_come = InProcess(problem, block), quick_poll(pipe)
    with contextlib.suppress(EOFError, OSError):  # the parent has ended
        pipe.send(None)
        while True:
            first = pipe.recv()
            try:
                for answer in backend.stream(first, lambda: pipe.recv() if has_come() else None):
                    pipe.send(answer)
            except ArmDesignError as error:
                pipe.send(error)
