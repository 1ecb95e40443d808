"""Units that are no searches: a study's own work in a run folder, asked for by `work.json`, found in `record.json`."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Literal

from armdesign._version import __version__
from armdesign.demonstration.provenance import as_json
from armdesign.errors import ArmDesignError
from armdesign.files import write_whole
from armdesign.runs.lock import locked
from armdesign.runs.reading import read_problem
from armdesign.runs.resumable import Interrupts, interruptible
from armdesign.search.search import Progress

WORK, RECORD = "work.json", "record.json"
State = Literal["finished", "interrupted", "failed"]


class Steer:
    """What a work reports its progress to, and where it learns that it has to stop."""

    def __init__(
        self,
        interrupts: Interrupts,
        on_progress: Callable[[Progress], None] | None = None,
        stop: Callable[[], bool] | None = None,
    ) -> None:
        """Start the clock.

        Args:
            interrupts: Whether Ctrl-C or SIGTERM asks for the end.
            on_progress: Called with how far the work is.
            stop: Asked whether to end.
        """
        self.interrupts, self.on_progress, self.stop = interrupts, on_progress, stop
        self.began = time.monotonic()

    def __call__(self, done: int, total: int, best: float = float("inf")) -> None:
        """Report so much done of so much, and the best fitness r so far [m] where there is one.

        Raises:
            KeyboardInterrupt: The work has to stop; what it has done so far is lost.
        """
        if self.on_progress is not None:
            none = float("inf")
            elapsed = time.monotonic() - self.began
            self.on_progress(Progress(max(done, 1), max(total, 1), best, none, none, 0, 1, elapsed))
        if self.interrupts.requested or (self.stop is not None and self.stop()):
            raise KeyboardInterrupt


def carry_out_work(
    place: Path, on_progress: Callable[[Progress], None] | None, stop: Callable[[], bool] | None
) -> tuple[State, str]:
    """Carry out the work of a run folder and write its record; returns how it has ended, and why it has failed.

    A work that is stopped, or whose process dies, begins anew the next time.
    """
    from armdesign.experiments.studies.study_registry import study_module  # noqa: PLC0415 (the studies stand above the sweeps)

    try:
        with locked(place), interruptible() as interrupts:
            work = json.loads((place / WORK).read_text(encoding="utf-8"))
            problem = read_problem(place)
            began = time.monotonic()
            found = study_module(work["study"]).perform(problem, work, Steer(interrupts, on_progress, stop))
            write_whole(place / RECORD, record_text(found, time.monotonic() - began))
    except (ArmDesignError, OSError, ValueError, KeyError) as error:
        return "failed", str(error) if isinstance(error, ArmDesignError) else f"{type(error).__name__}: {error}"
    except KeyboardInterrupt:
        return "interrupted", ""
    return "finished", ""


def work_text(work: Mapping[str, Any]) -> str:
    """Content of work.json."""
    return json.dumps(as_json(work), indent=2, allow_nan=False) + "\n"


def record_text(found: Mapping[str, Any], wall_time: float) -> str:
    """Content of record.json: what was found, and how long it took [s]."""
    content = {"armdesign_version": __version__, "wall_time": wall_time, "found": as_json(found)}
    return json.dumps(content, indent=2, allow_nan=False) + "\n"


def recorded(place: Path) -> dict[str, Any] | None:
    """Content of the record in a run folder; None where there is none that can be read."""
    try:
        content = json.loads((place / RECORD).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return content if isinstance(content, dict) and isinstance(content.get("found"), dict) else None
