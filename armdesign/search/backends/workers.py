"""What a search and a sweep need of their workers: jobs go in, events come out, wherever the workers run.

The evaluation of candidates (``parallel``) and the runs of sweeps and studies use the same two classes of workers:
processes on this machine (``processes``) and a Dask cluster (``dask_workers``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Literal, Protocol, TypeAlias, TypeVar

S = TypeVar("S")
DEATHS = 3
"""Worker processes that may die on a job before it is given up."""


class Closing:
    """Makes an object close when its ``with`` block ends."""

    def close(self) -> None:
        """Let go of what is held; nothing by default."""

    def __enter__(self: S) -> S:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class JobContext:
    """What a job reports to and asks whether it has to stop; this one has no listener."""

    def report(self, content: Mapping[str, Any]) -> None:
        """Send plain values to whoever began the job; reports that follow each other too fast are dropped."""

    def stop_requested(self) -> bool:
        """Whether the job is asked to end early."""
        return False


Handler: TypeAlias = Callable[[Any, JobContext], Any]
"""Does a job: takes its content and its context, returns the answer."""
Setup: TypeAlias = Callable[..., Handler]
"""Called once in every worker; gives its handler. Travels by its name, so it stands at the top of a module."""


@dataclass(eq=False)
class Job:
    """A piece of work for one worker.

    Attributes:
        content: What the handler gets; it travels to the worker.
        limit: Worker processes that may die on it before it is given up; on a cluster the scheduler's setting holds.
        deaths: Those that have died on it.
    """

    content: Any
    limit: int = DEATHS
    deaths: int = 0


@dataclass(frozen=True)
class Event:
    """What has become of a job.

    Attributes:
        job: The job.
        kind: A report while it goes on; or how it has ended: with an answer, with an error that the handler raised, or
            given up, since it has killed worker processes, or one after it was asked to stop.
        content: The report, the answer, the exception, or how the last process ended, in words ("" if not known).
    """

    job: Job
    kind: Literal["report", "answer", "error", "given up"]
    content: Any

    @property
    def is_end(self) -> bool:
        """Whether the job has ended."""
        return self.kind != "report"


class Workers(Protocol):
    """Does jobs, several at a time, in any order.

    Attributes:
        share_disk: Whether the workers see the files of this process.
    """

    share_disk: bool

    def room(self) -> int:
        """How many further jobs would begin now; with none at hand the number of workers."""
        ...

    def started(self) -> bool:
        """Whether none of the workers is still starting, so that a job takes as long as another one like it."""
        ...

    def begin(self, job: Job) -> None:
        """Hand a job out; there has to be room for it."""
        ...

    def wait(self, timeout: float) -> Sequence[Event]:
        """What has become of the jobs at hand, as soon as there is something; empty after the timeout [s].

        Raises:
            SearchError: Workers do not start, or the scheduler is lost.
        """
        ...

    def interrupt(self) -> None:
        """Ask the jobs at hand to stop; every one of them still has its end among the events."""
        ...

    def drop(self) -> None:
        """Break off the jobs at hand; nothing is heard of them any more."""
        ...

    def close(self) -> None:
        """End processes and connections, jobs at hand included."""
        ...
