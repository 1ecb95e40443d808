"""Conducting a sweep: hand its units to a crew, keep the table, and stop so that it can be gone on with."""

from __future__ import annotations

import os
import time
from collections import Counter, deque
from collections.abc import Callable, Collection, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from armdesign.errors import ArmDesignError, RunFolderError
from armdesign.experiments.sweep.sweep_plan import Sweep, Tasks, Unit, units_of
from armdesign.experiments.sweep.sweep_store import NEW_FOLDER, settle
from armdesign.experiments.sweep.units import RESULT, Outcome, begin_unit, bring_in
from armdesign.experiments.sweep.work_table import TABLE, Ledger
from armdesign.experiments.sweep.workers import Crew, News
from armdesign.runs.folder import claim_folder
from armdesign.runs.lock import locked
from armdesign.runs.resumable import Interrupts, interruptible
from armdesign.search.search import Progress

STOPS_OF_A_UNIT = 3
"""How often a unit may be interrupted by somebody else than the sweep."""
LISTEN = 0.5
"""Longest time between two looks at what the user wants [s]."""


@dataclass(frozen=True)
class Standing:
    """Where a sweep stands.

    Attributes:
        total: Number of runs.
        finished: Those that are finished.
        failed: Those that have failed.
        running: The runs at hand, by name; None before their first iteration.
        left: Estimate of the time left [s]; None before there is anything to base it on.
        ended: Name of the run that has just ended, if that is the occasion.
        outcome: How it ended.
        fitness: The r it found [m].
    """

    total: int
    finished: int
    failed: int
    running: dict[str, Progress | None]
    left: float | None = None
    ended: str | None = None
    outcome: Outcome | None = None
    fitness: float | None = None


def run_sweep(
    folder: Path,
    sweep: Sweep,
    tasks: Tasks,
    hire: Callable[[int], Crew],
    *,
    on_change: Callable[[Standing], None] | None = None,
    on_interrupt: Callable[[], None] | None = None,
) -> Ledger:
    """Carry out the runs of a sweep that are not finished, and keep its table.

    A run that fails does not stop the others. The first Ctrl-C or SIGTERM stops the runs at hand after their iteration,
    the second stops at once; either way the same call goes on later.

    Args:
        folder: The sweep's folder; made, taken up or extended.
        sweep: What is asked.
        tasks: Its recordings, prepared for each number of joints.
        hire: Gives the crew, for as many units as there are to do; not called where there are none.
        on_change: Called when a run has ended or a search has moved on, and twice a second.
        on_interrupt: Called when Ctrl-C or SIGTERM asks for the end.

    Returns:
        The table as it stands at the end.

    Raises:
        RunFolderError: Another process is at the sweep, or its folder cannot be used.
        SettingsError: The folder holds a sweep with other settings.
        KeyboardInterrupt: Ctrl-C came twice.
    """
    units = units_of(sweep, tasks)
    return run_units(
        folder, units, hire, lambda: settle(folder, sweep, tasks), on_change=on_change, on_interrupt=on_interrupt
    )


def run_units(
    folder: Path,
    units: Sequence[Unit],
    hire: Callable[[int], Crew],
    settle_down: Callable[[], None],
    *,
    table: str = TABLE,
    on_change: Callable[[Standing], None] | None = None,
    on_interrupt: Callable[[], None] | None = None,
) -> Ledger:
    """Carry out the units that are not finished; see ``run_sweep``.

    Args:
        folder: The folder; made or taken up.
        units: All units, in the order of the plan.
        hire: Gives the crew.
        settle_down: Writes down what was asked, the tasks at least (`store.keep_tasks`), or refuses; called with the
            folder locked, before anything else is written.
        table: Name of the table's file.
        on_change: See ``run_sweep``.
        on_interrupt: See ``run_sweep``.
    """
    if os.path.isfile(folder / RESULT):  # False for names too long, too
        raise RunFolderError(f"{folder} holds a run, not a sweep", value=str(folder), fix=NEW_FOLDER)
    claim_folder(folder)
    with locked(folder), interruptible(on_interrupt) as interrupts:
        settle_down()
        ledger = Ledger(folder, units, table)
        ledger.write()
        pending = ledger.pending()
        if pending:
            with closing(hire(len(pending))) as crew:
                Conductor(ledger, crew, interrupts, on_change).conduct(pending)
        return ledger


class Conductor:
    """Hands units to a crew until all have ended or somebody asks for the end."""

    def __init__(
        self, ledger: Ledger, crew: Crew, interrupts: Interrupts, on_change: Callable[[Standing], None] | None
    ) -> None:
        """Nothing at hand yet.

        Args:
            ledger: The sweep's table.
            crew: Who carries out the units.
            interrupts: Whether somebody asks for the end.
            on_change: Called with where the sweep stands.
        """
        self.ledger, self.crew, self.interrupts = ledger, crew, interrupts
        self.on_change = on_change
        self.waiting: deque[Unit] = deque()
        self.at_hand: dict[str, Progress | None] = {}
        self.stops: Counter[str] = Counter()
        self.pace = Pace()

    def conduct(self, units: Sequence[Unit]) -> None:
        """Have the units carried out."""
        self.waiting.extend(units)
        stopping = False
        while self.at_hand or (self.waiting and not self.interrupts.requested):
            if self.interrupts.requested and not stopping:
                stopping = True
                self.crew.interrupt()
            while self.waiting and not self.interrupts.requested and self.crew.room() > 0:
                self.begin(self.waiting.popleft())
            for news in self.crew.wait(LISTEN):
                self.hear(news)
            self.tell()

    def begin(self, unit: Unit) -> None:
        """Hand over a unit; one whose run folder cannot be used has failed."""
        try:
            place = begin_unit(self.ledger.folder, unit)
        except ArmDesignError as error:
            self.end(unit.name, Outcome("failed", str(error)))
            return
        self.at_hand[unit.name] = None
        self.crew.take(place)

    def hear(self, news: News) -> None:
        """Take in what the crew says."""
        if news.outcome is None:
            self.at_hand[news.name] = news.progress
            if news.progress is not None:
                self.pace.step(news.name, news.progress)
            return
        del self.at_hand[news.name]
        unit, outcome = self.ledger.units[news.name], news.outcome
        if outcome.files is not None:
            bring_in(self.ledger.folder / news.name, outcome)
        if outcome.state == "interrupted" and not self.interrupts.requested:
            self.stops[news.name] += 1
            if self.stops[news.name] < STOPS_OF_A_UNIT:
                self.waiting.appendleft(unit)
                return
            outcome = Outcome("failed", f"it was stopped from elsewhere {STOPS_OF_A_UNIT} times")
        self.end(news.name, outcome)

    def end(self, name: str, outcome: Outcome) -> None:
        """Enter how a unit has ended, and say so."""
        self.pace.end(name)
        self.ledger.enter(name, outcome.state, outcome.reason)
        self.ledger.write()
        self.tell(name, outcome)

    def tell(self, ended: str | None = None, outcome: Outcome | None = None) -> None:
        """Tell where the sweep stands."""
        if self.on_change is None:
            return
        rows, count = self.ledger.rows, self.ledger.count
        standing = Standing(
            total=len(rows),
            finished=count("finished"),
            failed=count("failed"),
            running=dict(self.at_hand),
            left=self.pace.left(len(self.waiting), self.at_hand),
            ended=ended,
            outcome=outcome,
            fitness=(rows[ended]["fitness"] or None) if ended is not None else None,
        )
        self.on_change(standing)


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

    def left(self, waiting: int, at_hand: Collection[str]) -> float | None:
        """Estimate of the time left [s]; None before anything is done."""
        done = sum(self.latest.values()) - sum(self.first.values())
        if done <= 0.0:
            return None
        todo = waiting + sum(1.0 - self.latest.get(name, 0.0) for name in at_hand)
        return (time.monotonic() - self.began) * todo / done
