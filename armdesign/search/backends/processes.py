"""Worker processes on this machine: each does one job at a time, one that dies is replaced and its job done again."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import ForkServerContext, SpawnContext
from multiprocessing.process import BaseProcess
from typing import Any

from armdesign.errors import ArmDesignError, SearchError
from armdesign.search.backends.workers import Closing, Event, Job, JobContext, Setup

FALSE_STARTS = 5
"""Worker processes in a row that may end before they are ready."""
GRACE = 0.5
"""How long idle workers may take to end before they are killed [s]."""
REPORT_EVERY = 0.2
"""Shortest time between two reports of a job [s]."""
STOP = "stop"
"""Sent to a worker to have its job stop."""
PRELOADED = ["armdesign.search.backends.parallel", "scipy.linalg.cython_lapack", "numba.np.npyimpl"]
"""Imported once, by the process that workers are forked from; the last two are what Numba needs to load a kernel."""


def available_cores() -> int:
    """Cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def worker_context() -> ForkServerContext | SpawnContext:
    """How worker processes start here: forked from a server that has imported what they need, where there are forks.

    The server starts at once. Called seconds before the first workers are asked for, it imports on another core while
    this process still does so.
    """
    if "forkserver" in multiprocessing.get_all_start_methods():
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload(PRELOADED)
        with children_ignore_ctrl_c(), contextlib.suppress(ChildProcessError):  # a fork of a process with a server
            forkserver.ensure_running()
            return context
    return multiprocessing.get_context("spawn")


@dataclass(eq=False)
class Worker:
    """A process, the pipe to it, the job it is doing, and whether it has come as far as taking any."""

    process: BaseProcess
    pipe: Connection
    job: Job | None = None
    ready: bool = False


class WorkerProcesses(Closing):
    """Worker processes on this machine; see ``Workers`` for the methods.

    A job whose process dies, however it dies, is done again in a fresh one, until it has killed as many as its limit
    allows. A process that dies before it is ready counts for no job; several of them in a row are an error.
    """

    share_disk = True

    def __init__(self, count: int, setup: Setup, *arguments: object) -> None:
        """Start the processes.

        Args:
            count: Number of processes, at least 1.
            setup: Called in each of them with the arguments; gives what does the jobs there.
            arguments: Travel to each process once.
        """
        self.context = worker_context()
        self.body = (setup, arguments)
        self.stopping = False
        self.false_starts = 0
        self.workers = [self._start() for _ in range(count)]

    @property
    def pids(self) -> list[int]:
        """Process numbers of the workers."""
        return [worker.process.pid or 0 for worker in self.workers]

    def room(self) -> int:
        """See Workers.room."""
        return sum(worker.job is None for worker in self.workers)

    def started(self) -> bool:
        """See Workers.started."""
        return all(worker.ready for worker in self.workers)

    def begin(self, job: Job) -> None:
        """See Workers.begin."""
        free = next(worker for worker in self.workers if worker.job is None)
        if not free.process.is_alive():  # died while idle, which is not the job's doing
            self._replace(free)
        self._send(free, job)

    def wait(self, timeout: float | None) -> list[Event]:
        """See Workers.wait.

        Raises:
            SearchError: Workers do not start.
        """
        busy = {worker.pipe: worker for worker in self.workers if worker.job is not None}
        ready = wait(list(busy), timeout) if busy else []
        events = [self._receive(busy[pipe]) for pipe in ready if isinstance(pipe, Connection)]
        return [event for event in events if event is not None]

    def interrupt(self) -> None:
        """See Workers.interrupt."""
        self.stopping = True
        for worker in self.workers:
            if worker.job is not None:
                with contextlib.suppress(OSError):  # has died: its end shows in wait
                    worker.pipe.send(STOP)

    def drop(self) -> None:
        """See Workers.drop."""
        for worker in self.workers:
            if worker.job is not None:
                worker.process.kill()
                self._replace(worker)

    def close(self) -> None:
        """See Workers.close."""
        for worker in self.workers:
            if worker.job is not None:
                worker.process.kill()
            worker.pipe.close()  # an idle worker ends when it reads the end of its pipe
        deadline = time.monotonic() + GRACE
        for worker in self.workers:
            worker.process.join(max(0.0, deadline - time.monotonic()))
            if worker.process.is_alive():
                worker.process.kill()
                worker.process.join()
        self.workers = []

    def _start(self) -> Worker:
        ours, theirs = self.context.Pipe()
        process = self.context.Process(target=serve, args=(theirs, *self.body), daemon=True)
        with children_ignore_ctrl_c():
            process.start()
        theirs.close()
        return Worker(process, ours)

    def _send(self, worker: Worker, job: Job) -> None:
        worker.job = job
        with contextlib.suppress(OSError):  # has just died: its end shows in wait
            worker.pipe.send(job.content)

    def _receive(self, worker: Worker) -> Event | None:
        """What a worker sends; None where it is ready, or has died and its job goes on in another process."""
        job = worker.job
        assert job is not None  # noqa: S101 (wait looks at busy workers alone)
        try:
            kind, content = worker.pipe.recv()
        except (EOFError, OSError):
            return self._after_death(worker, job)
        if kind == "ready":
            worker.ready, self.false_starts = True, 0
            return None
        event = Event(job, kind, content)
        if event.is_end:
            worker.job = None
        return event

    def _after_death(self, worker: Worker, job: Job) -> Event | None:
        """Replace a dead worker; its job goes on in the new one, unless it has killed too many.

        Raises:
            SearchError: Too many in a row have died before they were ready.
        """
        was_ready, end = worker.ready, self._replace(worker)
        if was_ready:
            job.deaths += 1
        else:
            self.false_starts += 1
            if self.false_starts >= FALSE_STARTS:
                raise SearchError(
                    f"{self.false_starts} worker processes in a row ended before they were ready, the last one {end}",
                    fix="Use one worker, and in a script start the work under: if __name__ == '__main__'",
                )
        if self.stopping or job.deaths >= job.limit:
            return Event(job, "given up", end)
        self._send(worker, job)
        return None

    def _replace(self, worker: Worker) -> str:
        """Put another process in the place of one that is dead or dying; returns how that one ended, in words."""
        worker.pipe.close()
        worker.process.join(timeout=1.0)
        if worker.process.is_alive():  # it has closed its pipe and hangs
            worker.process.kill()
            worker.process.join()
        end = end_of(worker.process.exitcode)
        fresh = self._start()
        worker.process, worker.pipe, worker.job, worker.ready = fresh.process, fresh.pipe, None, False
        return end


def end_of(code: int | None) -> str:
    """How a process with an exit code has ended, in words."""
    if code is None:
        return "for no known reason"
    if code >= 0:
        return f"with exit code {code}"
    with contextlib.suppress(ValueError):
        name = signal.Signals(-code).name
        return f"by {name}" + (" (perhaps for want of memory)" if name == "SIGKILL" else "")
    return f"by signal {-code}"


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
    """End this worker at once when the process that started it is gone, even in the middle of a job."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


class PipeContext(JobContext):
    """The context of a job in a worker process: the pipe to the process that began it."""

    def __init__(self, pipe: Connection) -> None:
        """Nothing sent so far.

        Args:
            pipe: The worker's end.
        """
        self.pipe, self.last, self.stop = pipe, -REPORT_EVERY, False

    def report(self, content: Mapping[str, Any]) -> None:
        """See JobContext.report."""
        now = time.monotonic()
        if now - self.last >= REPORT_EVERY:
            self.last = now
            with contextlib.suppress(OSError):  # the parent has ended, and so will this process
                self.pipe.send(("report", content))

    def stop_requested(self) -> bool:
        """See JobContext.stop_requested."""
        with contextlib.suppress(EOFError, OSError):
            while not self.stop and self.pipe.poll():
                self.stop = self.pipe.recv() == STOP
        return self.stop


def serve(pipe: Connection, setup: Setup, arguments: tuple[object, ...]) -> None:
    """Body of a worker process: do the jobs that come through the pipe until it closes.

    Ctrl-C is the parent's to handle, unless a handler catches it for the time of its job.

    Args:
        pipe: The worker's end.
        setup: Gives the handler.
        arguments: What the setup gets.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})  # see children_ignore_ctrl_c
    threading.Thread(target=end_with_parent, name="armdesign-parent", daemon=True).start()
    handler = setup(*arguments)
    with contextlib.suppress(OSError):
        pipe.send(("ready", None))
    while True:
        try:
            content = pipe.recv()
        except (EOFError, OSError):  # the parent has closed it, or has ended
            return
        if isinstance(content, str) and content == STOP:  # came after the job had ended
            continue
        try:
            message = "answer", handler(content, PipeContext(pipe))
        except ArmDesignError as error:
            message = "error", error
        with contextlib.suppress(OSError):
            pipe.send(message)
