"""A crew on anything that takes calls and gives futures: a pool of threads or processes, or a cluster's executor."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from pathlib import Path

from armdesign.experiments.sweep.units import Outcome, carry_out_elsewhere, contents
from armdesign.experiments.sweep.workers import News
from armdesign.search.backends.backend import Closing


class FuturesCrew(Closing):
    """Sends the run folder's files out and takes the finished ones back; see Crew for the methods.

    Whoever carries a unit out shares nothing with this process, neither disk nor signals. There is no news of single
    iterations, and a unit that is dropped while it is under way begins anew the next time. Of Dask it needs
    ``client.get_executor(pure=False)``.
    """

    def __init__(self, executor: Executor, slots: Callable[[], int]) -> None:
        """Nothing sent yet.

        Args:
            executor: Carries out the calls; stays open when the crew closes.
            slots: How many units to have out at a time, asked anew before each.
        """
        self.executor, self.slots = executor, slots
        self.out: dict[Future[Outcome], str] = {}
        self.dropped: list[str] = []

    def room(self) -> int:
        """See Crew.room."""
        return max(0, self.slots() - len(self.out))

    def take(self, place: Path) -> None:
        """See Crew.take."""
        self.out[self.executor.submit(carry_out_elsewhere, place.name, contents(place))] = place.name

    def wait(self, timeout: float) -> list[News]:
        """See Crew.wait."""
        news = [News(name, outcome=Outcome("interrupted")) for name in self.dropped]
        self.dropped = []
        done = wait(self.out, 0.0 if news else timeout, FIRST_COMPLETED).done
        return news + [News(self.out.pop(future), outcome=outcome_of(future)) for future in done]

    def interrupt(self) -> None:
        """Drop the units that can be dropped; the others are waited for."""
        for future in [future for future in self.out if future.cancel()]:
            self.dropped.append(self.out.pop(future))

    def close(self) -> None:
        """See Crew.close."""
        for future in self.out:
            future.cancel()
        self.out = {}


def outcome_of(future: Future[Outcome]) -> Outcome:
    """How a unit has ended; what no unit should raise, such as the end of its worker, is told as it is."""
    if future.cancelled():
        return Outcome("interrupted")
    error = future.exception()
    return future.result() if error is None else Outcome("failed", f"{type(error).__name__}: {error}")
