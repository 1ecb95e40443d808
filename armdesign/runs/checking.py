"""The verdict on a finished arm, made anew: with other obstacles, bodies or needs than it was searched with."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from armdesign.building import RECORD
from armdesign.building.build import Build
from armdesign.building.record import recorded_build
from armdesign.errors import SettingsError
from armdesign.feasibility.verdict import Verdict
from armdesign.runs.folder import RESULT
from armdesign.runs.reading import read_result
from armdesign.search.prepare import with_obstacles
from armdesign.search.result import Result
from armdesign.settings.sections import Body, Cell, Needs

JUDGED_BY = (Cell, Body, Needs)
"""Sections of the settings that say what a finished arm is judged by."""

CELL = ("obstacles", "obstacle_units", "stand")
"""Settings that say what stands in the room."""


def check(arm: Result | Build | str | Path, **entries: Any) -> Verdict:  # noqa: ANN401 (any setting)
    """Judge a finished arm: can it exist, and does it do its task? Of a build its parts are judged, too.

    ``check("runs/take", obstacles=["cell.toml"], hand_tolerance=0.005).passed`` is what ``armdesign check`` ends by.

    Args:
        arm: The arm: a result, a build, a run folder, or the result.json in it.
        entries: Entries of ``Cell``, ``Body`` and ``Needs`` by their names, over those of its settings; or whole
            sections.

    Raises:
        ArmDesignError: The run cannot be read, a setting is not allowed, or there is nothing to check it on.
    """
    result = finished_arm(arm) if isinstance(arm, str | Path) else arm.result if isinstance(arm, Build) else arm
    known = [name for kind in JUDGED_BY for name in (kind.title(), *kind.names())]
    for name in entries:
        if name not in known:
            raise SettingsError(f"'{name}' is not what a finished arm is judged by", value=name, allowed=known)
    settings = result.problem.settings.with_entries(**entries)
    judged = judged_by(result, {kind.title(): vars(getattr(settings, kind.title())) for kind in JUDGED_BY})
    made = parts_of(arm if isinstance(arm, Build) else result, judged)
    return judged.verdict if made is None else made.verdict


def judged_by(result: Result, changes: dict[str, dict[str, Any]]) -> Result:
    """A result whose verdict is made anew under other settings.

    Args:
        result: The arm.
        changes: {section: {entry: value}}.
    """
    before, problem = result.problem.settings.cell, result.problem.with_settings(changes)
    if any(getattr(problem.settings.cell, name) != getattr(before, name) for name in CELL):
        problem = with_obstacles(problem)
    thin = result.problem.settings.body.kind == "thin"  # then its modules have not been put anywhere yet
    return replace(result, problem=problem, known_verdict=None, known_slides=None if thin else result.known_slides)


def parts_of(arm: Result | Build, judged: Result) -> Build | None:
    """The parts of a build under the settings that it is judged by now; None where the arm is no build.

    Args:
        arm: As it was made.
        judged: The same arm, judged anew.
    """
    if isinstance(arm, Result):
        if arm.folder is None or not (arm.folder / RECORD).is_file():
            return None
        arm = recorded_build(arm)
    return replace(arm, result=judged, measured=None)


def finished_arm(place: str | Path) -> Result:
    """The result in a run folder, named by the folder or by its result.json.

    Raises:
        RunFolderError: There is none.
    """
    path = Path(place)
    return read_result(path.parent if path.name == RESULT else path)
