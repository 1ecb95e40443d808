"""Worker processes on this machine: a generation is shared out in chunks, a dead worker is replaced.

Each worker builds its own block of arms once and then answers chunks over a pipe. A worker that dies costs nothing
but time: its chunk is done again. A chunk that kills twice is taken apart into single candidates, and a candidate that
kills three times ends the search, by name.
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess

import numpy as np
from numpy.typing import NDArray

from armdesign.compute.backend import Closing, InProcess, join
from armdesign.errors import ArmDesignError, SearchError
from armdesign.fitness.evaluator import Scores
from armdesign.fitness.robot import Rejections
from armdesign.study import Prepared

Array = NDArray[np.float64]
DEATHS_OF_A_CHUNK, DEATHS_OF_A_CANDIDATE, FALSE_STARTS = 2, 3, 5
GRACE = 0.5
"""How long idle workers may take to end before they are killed [s]."""
SHARES = (0.7, 0.2, 0.1)
"""How a worker's part of a generation is cut: one large chunk, then smaller ones for whoever is free first."""


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
    """A process, the pipe to it, what it is at, and whether it has come as far as taking chunks."""

    process: SpawnProcess
    pipe: Connection
    chunk: Chunk | None = None
    ready: bool = False


def available_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class WorkerPool(Closing):
    """Evaluates on worker processes; the same scores as in one process, whatever the number and the chunks."""

    def __init__(self, prepared: Prepared, workers: int, block: int | None = None) -> None:
        """Start the workers.

        Args:
            prepared: Task and settings; travels to each worker once.
            workers: Number of processes, at least 1.
            block: Arms side by side in each.
        """
        self.prepared, self.block = prepared, block
        self.context = multiprocessing.get_context("spawn")
        self.false_starts = 0
        self.workers = [self._start() for _ in range(workers)]

    @property
    def pids(self) -> list[int]:
        """Process numbers of the workers."""
        return [worker.process.pid or 0 for worker in self.workers]

    def evaluate(self, Phi: Array, cutoff: Array) -> tuple[Scores, Rejections]:
        """See Backend.evaluate.

        Raises:
            CandidateKillsWorkersError: A candidate has killed three workers.
            SearchError: Workers do not start.
        """
        self._end_unfinished()
        waiting = deque(cut(len(Phi), len(self.workers)))
        done: dict[int, tuple[Scores, Rejections]] = {}
        remaining = len(Phi)
        while remaining:
            self._hand_out(waiting, Phi, cutoff)
            for worker, chunk in self._answering():
                try:
                    answer = self._receive(worker)
                except (EOFError, OSError):
                    waiting.extendleft(reversed(self._after_death(worker, chunk, Phi)))
                    continue
                if answer is not None:
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
        process = self.context.Process(target=work, args=(theirs, self.prepared, self.block), daemon=True)
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
        worker.process, worker.pipe, worker.chunk, worker.ready = fresh.process, fresh.pipe, None, False

    def _end_unfinished(self) -> None:
        """Replace workers that are still at a generation that was broken off; nobody wants their answers."""
        for worker in self.workers:
            if worker.chunk is not None:
                self._replace(worker)

    def _hand_out(self, waiting: deque[Chunk], Phi: Array, cutoff: Array) -> None:
        """Give every free worker a chunk."""
        for worker in self.workers:
            if worker.chunk is None and waiting:
                chunk = worker.chunk = waiting.popleft()
                with contextlib.suppress(OSError):  # died while idle: its end shows when its answer is read
                    worker.pipe.send((Phi[chunk.first : chunk.last], cutoff[chunk.first : chunk.last]))

    def _answering(self) -> list[tuple[Worker, Chunk]]:
        """Workers that have answered or died, with what they are at."""
        busy = {worker.pipe: (worker, worker.chunk) for worker in self.workers if worker.chunk is not None}
        return [busy[pipe] for pipe in wait(list(busy)) if isinstance(pipe, Connection)]

    def _receive(self, worker: Worker) -> tuple[Scores, Rejections] | None:
        """A worker's answer; None where it says that it is ready.

        Raises:
            EOFError, OSError: It has died.
            ArmDesignError: It reports an error for bad input.
        """
        answer: tuple[Scores, Rejections] | ArmDesignError | None = worker.pipe.recv()
        if answer is None:
            worker.ready, self.false_starts = True, 0
            return None
        worker.chunk = None
        if isinstance(answer, ArmDesignError):
            raise answer
        return answer

    def _after_death(self, worker: Worker, chunk: Chunk, Phi: Array) -> list[Chunk]:
        """Replace a dead worker; returns what has to be done again."""
        ready = worker.ready
        self._replace(worker)
        if ready:
            return blame(chunk, Phi)
        self.false_starts += 1
        if self.false_starts >= FALSE_STARTS:
            raise SearchError(
                f"{self.false_starts} worker processes in a row ended before they were ready",
                fix="Use one worker, and in a script start the search under: if __name__ == '__main__'",
            )
        return [chunk]


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
    """Cut a generation into chunks: the large ones first, so that the small ones even out the ends."""
    sizes = np.diff(np.round(np.r_[0.0, np.cumsum(np.repeat(SHARES, workers))] / workers * count).astype(int))
    ends = np.cumsum(sizes)
    return [Chunk(int(last - size), int(last)) for size, last in zip(sizes, ends, strict=True) if size > 0]


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


def work(pipe: Connection, prepared: Prepared, block: int | None) -> None:
    """Body of a worker process: answer chunks until the pipe closes. Ctrl-C is the parent's to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=end_with_parent, daemon=True).start()
    backend = InProcess(prepared, block)
    with contextlib.suppress(EOFError, OSError):  # the parent has ended
        pipe.send(None)
        while True:
            Phi, cutoff = pipe.recv()
            answer: tuple[Scores, Rejections] | ArmDesignError
            try:
                answer = backend.evaluate(Phi, cutoff)
            except ArmDesignError as error:
                answer = error
            pipe.send(answer)
