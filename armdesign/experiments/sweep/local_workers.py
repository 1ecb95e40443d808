"""Worker processes on this machine that carry out whole searches; a dead one is replaced, its unit taken up again."""

from __future__ import annotations

import contextlib
import multiprocessing
import signal
import threading
import time
from collections import Counter
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path

from armdesign.errors import SearchError
from armdesign.experiments.sweep.units import Outcome, carry_out_unit
from armdesign.experiments.sweep.workers import News
from armdesign.search.backends.backend import Closing
from armdesign.search.backends.processes import FALSE_STARTS, children_ignore_ctrl_c, end_with_parent
from armdesign.search.search import Progress

DEATHS_OF_A_UNIT = 3
STOP = "stop"
REPORT_EVERY = 0.2
"""Shortest time between two reports of a worker [s]."""


@dataclass
class Worker:
    """A process, the pipe to it, the run folder it is at, and whether it has come as far as taking one."""

    process: SpawnProcess
    pipe: Connection
    place: Path | None = None
    ready: bool = False


class LocalCrew(Closing):
    """As many units at a time as there are worker processes; see Crew for the methods.

    A unit whose process dies, however it dies, goes on from its saved state in a fresh one; after three deaths it has
    failed.
    """

    def __init__(self, workers: int) -> None:
        """Start the workers.

        Args:
            workers: Number of processes, at least 1.
        """
        self.context = multiprocessing.get_context("spawn")
        self.stopping = False
        self.false_starts = 0
        self.deaths: Counter[str] = Counter()
        self.workers = [self._start() for _ in range(workers)]

    @property
    def pids(self) -> list[int]:
        """Process numbers of the workers."""
        return [worker.process.pid or 0 for worker in self.workers]

    def room(self) -> int:
        """See Crew.room."""
        return sum(worker.place is None for worker in self.workers)

    def take(self, place: Path) -> None:
        """See Crew.take."""
        free = next(worker for worker in self.workers if worker.place is None)
        self._hand_over(free, place)

    def wait(self, timeout: float) -> list[News]:
        """See Crew.wait.

        Raises:
            SearchError: Workers do not start.
        """
        busy = {worker.pipe: worker for worker in self.workers if worker.place is not None}
        if not busy:
            return []
        ready = wait(list(busy), timeout)
        news = [self._receive(busy[pipe]) for pipe in ready if isinstance(pipe, Connection)]
        return [item for item in news if item is not None]

    def interrupt(self) -> None:
        """See Crew.interrupt."""
        self.stopping = True
        for worker in self.workers:
            if worker.place is not None:
                with contextlib.suppress(OSError):  # has died: its end shows in wait
                    worker.pipe.send(STOP)

    def close(self) -> None:
        """See Crew.close."""
        for worker in self.workers:
            if worker.place is not None:
                worker.process.kill()
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
        process = self.context.Process(target=work, args=(theirs,), daemon=True)
        with children_ignore_ctrl_c():
            process.start()
        theirs.close()
        return Worker(process, ours)

    def _hand_over(self, worker: Worker, place: Path) -> None:
        """Give a worker a unit."""
        worker.place = place
        with contextlib.suppress(OSError):  # died while idle: its end shows in wait
            worker.pipe.send(place)

    def _receive(self, worker: Worker) -> News | None:
        """A worker's news; none where it says that it is ready, or has died and its unit goes on in another."""
        try:
            news: News | None = worker.pipe.recv()
        except (EOFError, OSError):
            return self._after_death(worker)
        if news is None:
            worker.ready, self.false_starts = True, 0
        elif news.outcome is not None:
            worker.place = None
        return news

    def _after_death(self, worker: Worker) -> News | None:
        """Replace a dead worker; its unit goes on in the new one, unless it has brought down too many."""
        place, ready, end = worker.place, worker.ready, self._replace(worker)
        if place is None:
            return None
        if self.stopping:
            return News(place.name, outcome=Outcome("interrupted"))
        if ready:
            self.deaths[place.name] += 1
        else:
            self._count_false_start(end)
        if self.deaths[place.name] >= DEATHS_OF_A_UNIT:
            reason = f"its process died {DEATHS_OF_A_UNIT} times, the last time {end}"
            return News(place.name, outcome=Outcome("failed", reason))
        self._hand_over(worker, place)
        return None

    def _replace(self, worker: Worker) -> str:
        """Put another process in the place of a dead one; returns how that one ended."""
        worker.pipe.close()
        worker.process.join(timeout=1.0)
        end = end_of(worker.process)
        fresh = self._start()
        worker.process, worker.pipe, worker.place, worker.ready = fresh.process, fresh.pipe, None, False
        return end

    def _count_false_start(self, end: str) -> None:
        """A worker has died before it could take a unit.

        Raises:
            SearchError: Too many in a row.
        """
        self.false_starts += 1
        if self.false_starts >= FALSE_STARTS:
            raise SearchError(
                f"{self.false_starts} worker processes in a row ended before they were ready, the last one {end}",
                fix="In a script, start the sweep under: if __name__ == '__main__'",
            )


def end_of(process: SpawnProcess) -> str:
    """How a process has ended, in words."""
    code = process.exitcode
    if code is None:
        return "without a word"
    if code >= 0:
        return f"with exit code {code}"
    with contextlib.suppress(ValueError):
        name = signal.Signals(-code).name
        return f"by {name}" + (" (perhaps for want of memory)" if name == "SIGKILL" else "")
    return f"by signal {-code}"


def work(pipe: Connection) -> None:
    """Body of a worker process: carry out the units that come through the pipe until it closes.

    Between units Ctrl-C is the parent's to handle. Within one, a first Ctrl-C, SIGTERM or word from the parent ends the
    search after its iteration.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    threading.Thread(target=end_with_parent, name="armdesign-parent", daemon=True).start()
    with contextlib.suppress(OSError):
        pipe.send(None)
    while True:
        try:
            place = pipe.recv()
        except (EOFError, OSError):  # the parent has ended
            return
        if place != STOP:  # one that came after the unit had ended
            reporter = Reporter(pipe, place.name)
            outcome = carry_out_unit(place, on_progress=reporter, stop=reporter.told_to_stop)
            with contextlib.suppress(OSError):
                pipe.send(News(place.name, outcome=outcome))


class Reporter:
    """Tells the parent about iterations, not too often, and hears from it when to stop."""

    def __init__(self, pipe: Connection, name: str) -> None:
        """Nothing told so far."""
        self.pipe, self.name = pipe, name
        self.last = -REPORT_EVERY
        self.stop = False

    def __call__(self, progress: Progress) -> None:
        """After an iteration."""
        now = time.monotonic()
        if now - self.last >= REPORT_EVERY:
            self.last = now
            with contextlib.suppress(OSError):  # the parent has ended, and so will this process
                self.pipe.send(News(self.name, progress=progress))

    def told_to_stop(self) -> bool:
        """Whether the parent wants the search to end."""
        with contextlib.suppress(EOFError, OSError):
            while not self.stop and self.pipe.poll():
                self.stop = self.pipe.recv() == STOP
        return self.stop
