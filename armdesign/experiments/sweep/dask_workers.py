"""A crew on a Dask cluster: whole searches as tasks, with news of their iterations, and a stop that loses nothing.

The run folder's files travel to whichever worker has a thread free, and come back when the search has ended or was
asked to stop; the workers need not share this disk. The unit of a worker that is lost is begun again on another one,
from the files it was sent with. Needs the extra ``cluster``.
"""

from __future__ import annotations

import contextlib
import time
import uuid
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from armdesign.errors import ArmDesignError
from armdesign.experiments.sweep.units import Outcome, carry_out_elsewhere, contents
from armdesign.experiments.sweep.workers import News
from armdesign.search.backends.backend import Closing
from armdesign.search.backends.dask_connection import Kernels, explained, kernels_here, other_version
from armdesign.search.search import Progress

from distributed import Client, Event, Future, get_worker, wait  # isort: skip (its lack is told above)
from distributed import TimeoutError as StillWaitingError  # isort: skip

REPORT_EVERY = 2.0
"""Shortest time between two reports of a search, and between two looks whether it has to stop [s]."""


class DaskCrew(Closing):
    """As many units at a time as the workers have threads; see Crew for the methods."""

    def __init__(self, client: Client) -> None:
        """Listen for news.

        Args:
            client: Connection to the scheduler, see dask_connection.connect; stays open when the crew closes.
        """
        self.client, self.address = client, str(client.scheduler.address)
        self.topic = f"armdesign-{uuid.uuid4().hex}"
        self.stop = Event(self.topic, client=client)
        self.out: dict[Future, str] = {}
        self.heard: deque[News] = deque()
        client.subscribe_topic(self.topic, self._hear)

    def room(self) -> int:
        """See Crew.room.

        Raises:
            SearchError: The scheduler is lost.
        """
        with explained(self.address):
            threads: dict[str, int] = self.client.nthreads()
        return max(0, sum(threads.values()) - len(self.out))

    def take(self, place: Path) -> None:
        """See Crew.take."""
        task = (place.name, contents(place), self.topic, kernels_here())
        with explained(self.address):
            self.out[self.client.submit(carry_out_on_worker, *task, pure=False)] = place.name

    def wait(self, timeout: float) -> list[News]:
        """See Crew.wait.

        Raises:
            SearchError: The scheduler is lost.
        """
        with explained(self.address), contextlib.suppress(StillWaitingError), self.client.as_current():
            if self.out:
                wait(list(self.out), timeout=timeout, return_when="FIRST_COMPLETED")
            else:
                time.sleep(timeout)
        at_hand = set(self.out.values())
        news = [self.heard.popleft() for _ in range(len(self.heard))]
        news = [item for item in news if item.name in at_hand]
        done = [future for future in self.out if future.done()]
        return news + [News(self.out.pop(future), outcome=self._outcome(future)) for future in done]

    def interrupt(self) -> None:
        """See Crew.interrupt."""
        with explained(self.address):
            self.stop.set()

    def close(self) -> None:
        """See Crew.close."""
        if self.client.status == "running":
            with contextlib.suppress(OSError, StillWaitingError):  # the scheduler has just gone
                self.client.unsubscribe_topic(self.topic)
                self.client.cancel(list(self.out))
                self.stop.clear()
        self.out = {}

    def _hear(self, event: tuple[float, Mapping[str, Any]]) -> None:
        """Take in what a worker says; called by the client's own thread."""
        _, told = event
        self.heard.append(News(told["name"], progress=Progress(**told["progress"])))

    def _outcome(self, future: Future) -> Outcome:
        """How a unit has ended; what no unit should raise, such as the end of its workers, is told as it is."""
        try:
            with explained(self.address):
                outcome: Outcome = future.result()
        except ArmDesignError as error:
            return Outcome("failed", str(error))
        except Exception as error:
            return Outcome("failed", f"{type(error).__name__}: {error}")
        return outcome


def carry_out_on_worker(name: str, files: Mapping[str, bytes], topic: str, kernels: Kernels) -> Outcome:
    """Body of a unit on a worker.

    Args:
        name: Name of the run folder.
        files: Its content; with a saved state the search goes on from there.
        topic: Where to report, and the event that asks for the end.
        kernels: Kernels of the client.

    Raises:
        SearchError: This worker runs other kernels.
    """
    if kernels != kernels_here():
        raise other_version(get_worker().address, kernels, kernels_here())
    if Event(topic).is_set():
        return Outcome("interrupted")
    return carry_out_elsewhere(name, files, on_progress=reporter(name, topic))


def reporter(name: str, topic: str) -> Callable[[Progress], None]:
    """Something to call after every iteration of a unit on a worker: reports, not too often, and hears when to stop."""
    last = time.monotonic()

    def report(progress: Progress) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last < REPORT_EVERY:
            return
        last = now
        get_worker().log_event(topic, {"name": name, "progress": asdict(progress)})
        if Event(topic).is_set():
            raise KeyboardInterrupt  # a worker's thread gets no signals; the iteration is done and saved

    return report
