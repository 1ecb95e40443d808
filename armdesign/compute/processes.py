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
from collections import deque
from dataclasses import dataclass
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
DEATHS_OF_A_CHUNK, DEATHS_OF_A_CANDIDATE = 2, 3
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
    """A process, the pipe to it, and what it is at."""

    process: SpawnProcess
    pipe: Connection
    chunk: Chunk | None = None


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
        self.workers = [self._start() for _ in range(workers)]

    @property
    def pids(self) -> list[int]:
        """Process numbers of the workers."""
        return [worker.process.pid or 0 for worker in self.workers]

    def evaluate(self, Phi: Array, cutoff: Array) -> tuple[Scores, Rejections]:
        """See Backend.evaluate.

        Raises:
            CandidateKillsWorkersError: A candidate has killed three workers.
        """
        waiting = deque(cut(len(Phi), len(self.workers)))
        done: dict[int, tuple[Scores, Rejections]] = {}
        remaining = len(Phi)
        while remaining:
            self._hand_out(waiting, Phi, cutoff)
            for worker in self._ready():
                chunk = worker.chunk
                answer = self._receive(worker)
                if chunk is None:
                    continue
                if answer is None:
                    waiting.extendleft(reversed(self._after_death(chunk, Phi)))
                else:
                    done[chunk.first] = answer
                    remaining -= chunk.last - chunk.first
        parts = [done[first] for first in sorted(done)]
        return join([scores for scores, _ in parts]), sum((removed for _, removed in parts), Rejections())

    def close(self) -> None:
        """End the workers."""
        for worker in self.workers:
            worker.pipe.close()
        for worker in self.workers:
            worker.process.join(timeout=0.5)
            if worker.process.is_alive():
                worker.process.kill()
                worker.process.join()
        self.workers = []

    def _start(self) -> Worker:
        """Start one worker."""
        ours, theirs = self.context.Pipe()
        process = self.context.Process(target=work, args=(theirs, self.prepared, self.block), daemon=True)
        process.start()
        theirs.close()
        return Worker(process, ours)

    def _hand_out(self, waiting: deque[Chunk], Phi: Array, cutoff: Array) -> None:
        """Give every free worker a chunk."""
        for worker in self.workers:
            if worker.chunk is None and waiting:
                chunk = worker.chunk = waiting.popleft()
                with contextlib.suppress(OSError):  # died while idle: its end shows in _ready
                    worker.pipe.send((Phi[chunk.first : chunk.last], cutoff[chunk.first : chunk.last]))

    def _ready(self) -> list[Worker]:
        """Workers that have answered or died."""
        signs = {worker.pipe: worker for worker in self.workers if worker.chunk is not None}
        return [signs[pipe] for pipe in wait(list(signs)) if isinstance(pipe, Connection)]

    def _receive(self, worker: Worker) -> tuple[Scores, Rejections] | None:
        """A worker's answer; None where it has died, in which case another takes its place.

        Raises:
            ArmDesignError: The worker reports an error for bad input.
        """
        try:
            answer: tuple[Scores, Rejections] | ArmDesignError = worker.pipe.recv()
        except (EOFError, OSError):
            worker.pipe.close()
            worker.process.join(timeout=1.0)
            fresh = self._start()
            worker.process, worker.pipe, worker.chunk = fresh.process, fresh.pipe, None
            return None
        worker.chunk = None
        if isinstance(answer, ArmDesignError):
            raise answer
        return answer

    def _after_death(self, chunk: Chunk, Phi: Array) -> list[Chunk]:
        """What to do again after a worker died on a chunk."""
        chunk.deaths += 1
        if chunk.last - chunk.first == 1:
            if chunk.deaths >= DEATHS_OF_A_CANDIDATE:
                raise CandidateKillsWorkersError(
                    f"a candidate has killed {chunk.deaths} worker processes: Phi = {Phi[chunk.first].tolist()}",
                    value=Phi[chunk.first].copy(),
                    fix="Please report it with the saved candidate; another seed avoids it",
                )
            return [chunk]
        if chunk.deaths < DEATHS_OF_A_CHUNK:
            return [chunk]
        return [Chunk(k, k + 1) for k in range(chunk.first, chunk.last)]


def cut(count: int, workers: int) -> list[Chunk]:
    """Cut a generation into chunks: the large ones first, so that the small ones even out the ends."""
    sizes = np.diff(np.round(np.r_[0.0, np.cumsum(np.repeat(SHARES, workers))] / workers * count).astype(int))
    ends = np.cumsum(sizes)
    return [Chunk(int(last - size), int(last)) for size, last in zip(sizes, ends, strict=True) if size > 0]


def work(pipe: Connection, prepared: Prepared, block: int | None) -> None:
    """Body of a worker process: answer chunks until the pipe closes. Ctrl-C is the parent's to handle."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    backend = InProcess(prepared, block)
    with contextlib.suppress(EOFError, OSError):  # the parent has ended
        while True:
            Phi, cutoff = pipe.recv()
            answer: tuple[Scores, Rejections] | ArmDesignError
            try:
                answer = backend.evaluate(Phi, cutoff)
            except ArmDesignError as error:
                answer = error
            pipe.send(answer)
