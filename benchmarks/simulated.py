"""Searches on more workers than this machine has cores: the schedule with the measured CPU time of every job."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from copy import deepcopy
from typing import Any

from plan import PACKAGING, Plan
from tables import Table
from workers import timed_search

from armdesign.search.backends.backend import InProcess
from armdesign.search.backends.parallel import ParallelBackend, evaluator
from armdesign.search.backends.workers import Closing, Event, Job, JobContext
from armdesign.search.design_problem import DesignProblem


class SimulatedWorkers(Closing):
    """Does every job here as it begins, and has it end when a worker of its own would: by a clock of CPU time.

    What the search itself does between two calls counts, a copy in place of the way to a worker and back too.
    """

    share_disk = True

    def __init__(self, count: int, problem: DesignProblem) -> None:
        """Nothing is at hand.

        Args:
            count: Number of workers.
            problem: Task and settings.
        """
        self.count, self.handle = count, evaluator(problem)
        self.at_hand: list[tuple[float, Job, Any]] = []
        self.clock, self.seen = 0.0, time.process_time()

    def now(self, skipped: float = 0.0) -> float:
        """The clock, set on by the CPU time since the last call but for what was skipped [s]."""
        used = time.process_time()
        self.clock, self.seen = self.clock + used - self.seen - skipped, used
        return self.clock

    def room(self) -> int:
        """See Workers.room."""
        return self.count - len(self.at_hand)

    def started(self) -> bool:
        """See Workers.started."""
        return True

    def begin(self, job: Job) -> None:
        """See Workers.begin."""
        content = deepcopy(job.content)
        began = time.process_time()
        answer = deepcopy(self.handle(content, JobContext()))
        took = time.process_time() - began
        self.at_hand.append((self.now(took) + took, job, answer))

    def wait(self, _timeout: float) -> Sequence[Event]:
        """See Workers.wait."""
        if not self.at_hand:
            return []
        first = min(self.at_hand, key=lambda each: each[0])
        self.at_hand.remove(first)
        self.clock = max(self.now(), first[0])
        return [Event(first[1], "answer", first[2])]

    def interrupt(self) -> None:
        """See Workers.interrupt."""

    def drop(self) -> None:
        """See Workers.drop."""
        self.at_hand.clear()


def tables(plan: Plan) -> Iterator[Table]:
    """A row for every search and number of workers."""
    iterations, budget = plan.pick((100, 50_000), (10, 5000))
    rows = []
    for dof, search in ((3, {"iterations": iterations}), (4, {"iterations": iterations}), (4, {"budget": budget})):
        problem = PACKAGING.problem(dof, search=search)
        with InProcess(problem) as backend:
            one = timed_search(problem, backend, time.process_time)
        name = "default" if "budget" in search else "RA-PSO"
        for count in (2, 4, 8):
            workers = SimulatedWorkers(count, problem)
            seconds = timed_search(problem, ParallelBackend(workers), workers.now)
            rows.append({"search": name, "n": dof, "W": count, "one s": one, "W s": seconds, "x one": one / seconds})
    yield Table(
        "workers-simulated",
        "Packaging on W workers, simulated: the search's own schedule, each job with the CPU time it takes here",
        rows,
        [
            "The aims are 1.85 times one worker with two, 3.5 with four. Start-up is not counted. Batches of less than",
            "0.25 s go to as many workers as pay by the wall clock, on which jobs follow one another: n = 3 is low.",
        ],
    )
