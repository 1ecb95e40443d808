"""The workers of a Dask cluster, wherever they run: the same jobs as in worker processes on this machine.

Dask does what it is made for: it hands the jobs out, moves them from a worker that is lost to another, restarts
workers, and gives up a job that brings down one worker after the other (its setting
``distributed.scheduler.allowed-failures``). What the jobs have in common travels to each worker once, as a worker
plugin, which also reaches workers that join later. Needs the extra ``cluster``.
"""

from __future__ import annotations

import contextlib
import threading
import time
import uuid
from collections import deque
from collections.abc import Mapping
from itertools import count
from typing import TYPE_CHECKING, Any

from armdesign.errors import SearchError
from armdesign.search.backends.dask_connection import Say, cannot_load, explained, kernels_here, other_version, tell
from armdesign.search.backends.parallel import ParallelBackend, evaluator
from armdesign.search.backends.workers import Closing, Event, Handler, Job, JobContext, Setup
from armdesign.search.design_problem import DesignProblem

import distributed  # isort: skip (its lack is told above)
from distributed import Client, Future, KilledWorker, WorkerPlugin, get_worker  # isort: skip
from distributed import TimeoutError as StillWaitingError  # isort: skip

if TYPE_CHECKING:
    from distributed import Worker

REPORT_EVERY = 2.0
"""Shortest time between two reports of a job, and between two looks whether it has to stop [s]."""
IDLE = 0.2
"""How long to wait for a worker while there is none and no job is at hand [s]."""


class HandlerPlugin(WorkerPlugin):  # type: ignore[misc,unused-ignore]
    """What does the jobs on a worker. The setup with its arguments travels; what it gives is built there, and kept."""

    def __init__(self, start: Setup, arguments: tuple[object, ...], *, exclusive: bool) -> None:
        """Put up what travels.

        Args:
            start: Gives the handler.
            arguments: What it gets.
            exclusive: Whether jobs are done one at a time, however many threads the worker has.
        """
        self.start, self.arguments, self.exclusive = start, arguments, exclusive
        self.kernels = kernels_here()

    def setup(self, worker: Worker) -> None:
        """Arrive on a worker; the building waits for the first job, off the worker's event loop."""
        self.building, self.job = threading.Lock(), threading.Lock()
        self.handler: Handler | None = None

    def perform(self, content: object, context: JobContext) -> Any:  # noqa: ANN401 (the handler's answer)
        """Do a job.

        Raises:
            SearchError: The worker runs other kernels than the client.
        """
        with self.building:
            if self.handler is None:
                if self.kernels != kernels_here():
                    raise other_version(get_worker().address, self.kernels, kernels_here())
                self.handler = self.start(*self.arguments)
        with self.job if self.exclusive else contextlib.nullcontext():
            return self.handler(content, context)


class DaskWorkers(Closing):
    """The workers of a Dask cluster; see ``Workers`` for the methods."""

    share_disk = False

    def __init__(
        self, client: Client, setup: Setup, *arguments: object, exclusive: bool = False, say: Say | None = None
    ) -> None:
        """Send what the jobs have in common to the workers.

        Args:
            client: Connection to the scheduler, see dask_connection.connect; stays open when the workers are closed.
            setup: Called on each worker with the arguments; gives what does the jobs there.
            arguments: Travel to each worker once.
            exclusive: Whether a worker process does one job at a time, instead of one on each of its threads.
            say: Called with a sentence when jobs have to wait for workers.

        Raises:
            SearchError: The connection is lost, or a worker cannot load what it is sent.
        """
        self.client, self.exclusive, self.say = client, exclusive, say
        self.address = str(client.scheduler.address)
        self.name = f"armdesign-{uuid.uuid4().hex}"
        self.numbers, self.missing = count(), False
        self.at_hand: dict[Future, Job] = {}
        self.jobs: dict[str, Job] = {}
        self.reports: deque[tuple[str, Mapping[str, Any]]] = deque()
        with explained(self.address):
            self.stop = distributed.Event(self.name, client=client)
            client.register_plugin(HandlerPlugin(setup, arguments, exclusive=exclusive), name=self.name)
            client.subscribe_topic(self.name, lambda event: self.reports.append((event[1]["job"], event[1]["content"])))

    def room(self) -> int:
        """See Workers.room.

        Raises:
            SearchError: The scheduler is lost.
        """
        with explained(self.address):
            threads: dict[str, int] = self.client.nthreads()
        return max(0, (len(threads) if self.exclusive else sum(threads.values())) - len(self.at_hand))

    def started(self) -> bool:
        """See Workers.started; a cluster has those that have."""
        return True

    def begin(self, job: Job) -> None:
        """See Workers.begin."""
        key = f"{self.name}-{next(self.numbers)}"
        with explained(self.address):
            self.at_hand[self.client.submit(perform, self.name, key, job.content, key=key, pure=False)] = job
        self.jobs[key] = job

    def wait(self, timeout: float) -> list[Event]:
        """See Workers.wait.

        Raises:
            SearchError: The scheduler is lost.
        """
        if not self.at_hand:
            time.sleep(min(timeout, IDLE))
        else:
            with explained(self.address), contextlib.suppress(StillWaitingError), self.client.as_current():
                distributed.wait(list(self.at_hand), timeout=timeout, return_when="FIRST_COMPLETED")
        reports = [self.reports.popleft() for _ in range(len(self.reports))]
        events = [Event(self.jobs[key], "report", content) for key, content in reports if key in self.jobs]
        events += [self._end(future) for future in list(self.at_hand) if future.done()]
        if self.say is not None and not events:
            self._say_if_none_left(self.say)
        return events

    def interrupt(self) -> None:
        """See Workers.interrupt."""
        with explained(self.address):
            self.stop.set()

    def drop(self) -> None:
        """See Workers.drop."""
        if self.at_hand:
            with explained(self.address):
                self.client.cancel(list(self.at_hand))
        self.at_hand, self.jobs = {}, {}

    def close(self) -> None:
        """See Workers.close; the client stays open."""
        if self.client.status == "running":
            with contextlib.suppress(OSError, StillWaitingError, SearchError):  # the scheduler has just gone
                self.client.unsubscribe_topic(self.name)
                self.drop()
                self.client.unregister_worker_plugin(self.name)
                self.stop.clear()
        self.at_hand, self.jobs = {}, {}

    def _end(self, future: Future) -> Event:
        """How a job has ended.

        Raises:
            SearchError: The scheduler is lost.
        """
        job = self.at_hand.pop(future)
        del self.jobs[future.key]
        with explained(self.address):
            error = future.exception()
            if error is None:
                return Event(job, "answer", future.result())
        if isinstance(error, KilledWorker):
            job.deaths += error.allowed_failures + 1
            return Event(job, "given up", "")
        return Event(job, "error", cannot_load(self.address, error) if isinstance(error, ImportError) else error)

    def _say_if_none_left(self, say: Say) -> None:
        """Say so, once, when there are no workers."""
        with explained(self.address):
            missing = not self.client.nthreads()
        if missing and not self.missing:
            tell(say, "The cluster has no workers left; waiting for new ones.")
        self.missing = missing


class DaskCluster(ParallelBackend):
    """Evaluates candidates on the workers of a Dask cluster; the same scores as in one process."""

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
        super().__init__(DaskWorkers(client, evaluator, problem, block, exclusive=True, say=say))


def perform(holder: str, key: str, content: object) -> Any:  # noqa: ANN401 (the handler's answer)
    """Body of a job on a worker.

    Args:
        holder: Name of the plugin that holds the handler, of the topic for reports, and of the event that asks for
            the end.
        key: The job's key.
        content: What the handler gets.
    """
    plugin: HandlerPlugin = get_worker().plugins[holder]
    return plugin.perform(content, TopicContext(holder, key))


class TopicContext(JobContext):
    """The context of a job on a worker of a cluster: a topic for its reports, an event that asks for the end."""

    def __init__(self, name: str, key: str) -> None:
        """Nothing reported so far.

        Args:
            name: Name of topic and event.
            key: The job's key.
        """
        self.name, self.key = name, key
        self.reported, self.looked, self.stop = time.monotonic(), -REPORT_EVERY, False

    def report(self, content: Mapping[str, Any]) -> None:
        """See JobContext.report."""
        now = time.monotonic()
        if now - self.reported >= REPORT_EVERY:
            self.reported = now
            get_worker().log_event(self.name, {"job": self.key, "content": dict(content)})

    def stop_requested(self) -> bool:
        """See JobContext.stop_requested."""
        now = time.monotonic()
        if not self.stop and now - self.looked >= REPORT_EVERY:
            self.looked = now
            self.stop = bool(distributed.Event(self.name).is_set())
        return self.stop
