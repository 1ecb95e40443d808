"""Scheduling a sweep: hand its units to workers, keep the table, and stop so that it can be resumed."""

from __future__ import annotations

import os
import time
from collections import Counter, deque
from collections.abc import Callable, Collection, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from armdesign.errors import ArmDesignError, RunFolderError
from armdesign.experiments.sweep.jobs import Perform
from armdesign.experiments.sweep.run_table import TABLE, RunTable
from armdesign.experiments.sweep.sweep_plan import Sweep, Tasks, Unit, units_of
from armdesign.experiments.sweep.sweep_store import NEW_FOLDER, settle
from armdesign.experiments.sweep.units import RESULT, Outcome, UnitJob, begin_unit, bring_in, contents
from armdesign.runs.folder import claim_folder
from armdesign.runs.lock import locked
from armdesign.runs.resumable import Interrupts, interruptible
from armdesign.search.backends.workers import Event, Job, Workers
from armdesign.search.search import Progress

STOPS_OF_A_UNIT = 3
"""How often a unit may be interrupted by somebody else than the sweep."""
LISTEN = 0.5
"""Longest time between two looks at what the user wants [s]."""


@dataclass(frozen=True)
class SweepStatus:
    """How far a sweep is."""

    total: int  # number of runs
    finished: int  # those that are finished
    failed: int  # those that have failed
    running: dict[str, Progress | None]  # the runs under way, by name; None before their first iteration
    left: float | None = None  # estimate of the time left [s]; None before there is anything to base it on
    ended: str | None = None  # name of the run that has just ended, if that is the occasion
    outcome: Outcome | None = None  # how it ended
    fitness: float | None = None  # the r it found [m]


@dataclass(frozen=True)
class Plan:
    """What a sweep or a study has carried out."""

    units: Sequence[Unit]  # all units, in the order of the table
    # writes down what was asked, the tasks at least (`sweep_store.keep_tasks`), or refuses; called with the
    # folder locked, before anything else is written
    settle: Callable[[], None]
    table: str = TABLE  # name of the table's file
    perform: Perform | None = None  # does the work of the units that are no searches


def run_sweep(
    folder: Path,
    sweep: Sweep,
    tasks: Tasks,
    start_workers: Callable[[int], Workers],
    *,
    on_change: Callable[[SweepStatus], None] | None = None,
    on_interrupt: Callable[[], None] | None = None,
) -> RunTable:
    """Carry out the runs of a sweep that are not finished, and keep its table.

    A run that fails does not stop the others. The first Ctrl-C or SIGTERM stops the runs under way after their
    iteration, the second stops at once; either way the same call resumes the sweep later.

    Args:
        folder: The sweep's folder; made, resumed or extended.
        sweep: What is asked.
        tasks: Its recordings, prepared for each number of joints.
        start_workers: Starts workers with the setup ``unit_worker``, for so many units at most; not called for none.
        on_change: Called when a run has ended or a search has moved on, and twice a second.
        on_interrupt: Called when Ctrl-C or SIGTERM asks for the end.

    Returns:
        The table at the end.

    Raises:
        RunFolderError: Another process uses the folder, or it cannot be used.
        SettingsError: The folder holds a sweep with other settings.
        KeyboardInterrupt: Ctrl-C came twice.
    """
    plan = Plan(units_of(sweep, tasks), lambda: settle(folder, sweep, tasks))
    return run_units(folder, plan, start_workers, on_change=on_change, on_interrupt=on_interrupt)


def run_units(
    folder: Path,
    plan: Plan,
    start_workers: Callable[[int], Workers],
    *,
    on_change: Callable[[SweepStatus], None] | None = None,
    on_interrupt: Callable[[], None] | None = None,
) -> RunTable:
    """Carry out the units of a plan that are not finished, and keep their table; otherwise like ``run_sweep``."""
    if os.path.isfile(folder / RESULT):  # False for names too long, too
        raise RunFolderError(f"{folder} holds a run, not a sweep", value=str(folder), fix=NEW_FOLDER)
    claim_folder(folder)
    with locked(folder), interruptible(on_interrupt) as interrupts:
        plan.settle()
        table = RunTable(folder, plan.units, plan.table)
        table.write()
        pending = table.pending()
        if pending:
            with closing(start_workers(len(pending))) as workers:
                Scheduler(table, workers, interrupts, plan.perform, on_change).run(pending)
        return table


class Scheduler:
    """Hands units to workers until all have ended or somebody asks for the end."""

    def __init__(
        self,
        table: RunTable,
        workers: Workers,
        interrupts: Interrupts,
        perform: Perform | None = None,
        on_change: Callable[[SweepStatus], None] | None = None,
    ) -> None:
        """Nothing under way yet."""
        self.table, self.workers, self.interrupts = table, workers, interrupts
        self.perform, self.on_change = perform, on_change
        self.waiting: deque[Unit] = deque()
        self.running: dict[str, Progress | None] = {}
        self.stops: Counter[str] = Counter()
        self.pace = Pace()

    def run(self, units: Sequence[Unit]) -> None:
        """Have the units carried out."""
        self.waiting.extend(units)
        stopping = False
        while self.running or (self.waiting and not self.interrupts.requested):
            if self.interrupts.requested and not stopping:
                stopping = True
                self.workers.interrupt()
            while self.waiting and not self.interrupts.requested and self.workers.room() > 0:
                self.begin(self.waiting.popleft())
            for event in self.workers.wait(LISTEN):
                self.take(event)
            self.show()

    def begin(self, unit: Unit) -> None:
        """Hand out a unit; one whose run folder cannot be used has failed."""
        try:
            place = begin_unit(self.table.folder, unit)
        except ArmDesignError as error:
            self.end(unit.name, Outcome("failed", str(error)))
            return
        self.running[unit.name] = None
        files = None if self.workers.share_disk else contents(place)
        self.workers.begin(Job(UnitJob(place, self.perform, files)))

    def take(self, event: Event) -> None:
        """Take in what has become of a unit."""
        name = event.job.content.place.name
        if not event.is_end:
            progress = Progress(**event.content)
            self.running[name] = progress
            self.pace.step(name, progress)
            return
        del self.running[name]
        outcome = outcome_of(event)
        if outcome.files is not None:
            bring_in(self.table.folder / name, outcome)
        if event.kind == "given up" and self.interrupts.requested:
            outcome = Outcome("interrupted")
        if outcome.state == "interrupted" and not self.interrupts.requested:
            self.stops[name] += 1
            if self.stops[name] < STOPS_OF_A_UNIT:
                self.waiting.appendleft(self.table.units[name])
                return
            outcome = Outcome("failed", f"it was stopped from elsewhere {STOPS_OF_A_UNIT} times")
        self.end(name, outcome)

    def end(self, name: str, outcome: Outcome) -> None:
        """Enter how a unit has ended, and say so."""
        self.pace.end(name)
        self.table.enter(name, outcome.state, outcome.reason)
        self.table.write()
        self.show(name, outcome)

    def show(self, ended: str | None = None, outcome: Outcome | None = None) -> None:
        """Say how far the sweep is."""
        if self.on_change is None:
            return
        rows, count = self.table.rows, self.table.count
        status = SweepStatus(
            total=len(rows),
            finished=count("finished"),
            failed=count("failed"),
            running=dict(self.running),
            left=self.pace.left(len(self.waiting), self.running),
            ended=ended,
            outcome=outcome,
            fitness=(rows[ended]["fitness"] or None) if ended is not None else None,
        )
        self.on_change(status)


def outcome_of(event: Event) -> Outcome:
    """How a unit has ended, from the end of its job."""
    if event.kind == "answer":
        outcome: Outcome = event.content
        return outcome
    if event.kind == "given up":
        end = f", the last time {event.content}" if event.content else ""
        return Outcome("failed", f"its process died {event.job.deaths} times{end}")
    error = event.content
    return Outcome("failed", str(error) if isinstance(error, ArmDesignError) else f"{type(error).__name__}: {error}")


class Pace:
    """How long the rest may take, from the share of the searches done since the clock was started."""

    def __init__(self) -> None:
        """Start the clock."""
        self.began = time.monotonic()
        self.first: dict[str, float] = {}
        self.latest: dict[str, float] = {}

    def step(self, name: str, progress: Progress) -> None:
        """A search has moved on."""
        self.first.setdefault(name, (progress.iteration - 1) / progress.iterations)
        self.latest[name] = progress.iteration / progress.iterations

    def end(self, name: str) -> None:
        """A search has ended."""
        self.first.setdefault(name, 0.0)
        self.latest[name] = 1.0

    def left(self, waiting: int, running: Collection[str]) -> float | None:
        """Estimate of the time left [s]; None before anything is done."""
        done = sum(self.latest.values()) - sum(self.first.values())
        if done <= 0.0:
            return None
        todo = waiting + sum(1.0 - self.latest.get(name, 0.0) for name in running)
        return (time.monotonic() - self.began) * todo / done
