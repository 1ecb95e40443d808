"""Units that are no searches: a study's own work in a run folder, asked for by `work.json`, found in `record.json`."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal, TypeAlias

from armdesign._version import __version__
from armdesign.demonstration.provenance import as_json
from armdesign.errors import ArmDesignError
from armdesign.files import write_whole
from armdesign.runs.lock import locked
from armdesign.runs.reading import read_problem
from armdesign.runs.resumable import Interrupts, interruptible
from armdesign.search.backends.workers import JobContext
from armdesign.search.design_problem import DesignProblem
from armdesign.search.search import Progress

WORK, RECORD = "work.json", "record.json"
State = Literal["finished", "interrupted", "failed"]


class Reporter:
    """What a work reports its progress to, and where it learns that it has to stop."""

    def __init__(self, interrupts: Interrupts, context: JobContext) -> None:
        """Start the clock."""
        self.interrupts, self.context, self.began = interrupts, context, time.monotonic()

    def __call__(self, done: int, total: int, best: float = float("inf")) -> None:
        """Report progress.

        Args:
            done: How much is done.
            total: Of how much.
            best: The best fitness r so far [m], where there is one.

        Raises:
            KeyboardInterrupt: The work has to stop; what it has done so far is lost.
        """
        none, elapsed = float("inf"), time.monotonic() - self.began
        self.context.report(asdict(Progress(max(done, 1), max(total, 1), best, none, none, 0, 1, elapsed)))
        if self.interrupts.requested or self.context.stop_requested():
            raise KeyboardInterrupt


Perform: TypeAlias = Callable[[DesignProblem, Mapping[str, Any], Reporter], dict[str, Any]]
"""Does the work of a unit that is no search; returns JSON values. Travels to workers by its name."""


def carry_out_work(place: Path, perform: Perform, context: JobContext) -> tuple[State, str]:
    """Carry out the work of a run folder and write its record; returns how it has ended, and why it has failed.

    A work that is stopped, or whose process dies, begins anew the next time.
    """
    try:
        with locked(place), interruptible() as interrupts:
            work = json.loads((place / WORK).read_text(encoding="utf-8"))
            problem = read_problem(place)
            began = time.monotonic()
            found = perform(problem, work, Reporter(interrupts, context))
            content = {"armdesign_version": __version__, "wall_time": time.monotonic() - began, "found": as_json(found)}
            write_whole(place / RECORD, json.dumps(content, indent=2, allow_nan=False) + "\n")
    except (ArmDesignError, OSError, ValueError, KeyError) as error:
        return "failed", str(error) if isinstance(error, ArmDesignError) else f"{type(error).__name__}: {error}"
    except KeyboardInterrupt:
        return "interrupted", ""
    return "finished", ""


def work_text(work: Mapping[str, Any]) -> str:
    """Content of work.json."""
    return json.dumps(as_json(work), indent=2, allow_nan=False) + "\n"


def recorded(place: Path) -> dict[str, Any] | None:
    """Content of the record in a run folder; None where there is none that can be read."""
    try:
        content = json.loads((place / RECORD).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) and isinstance(content.get("found"), dict) else None
