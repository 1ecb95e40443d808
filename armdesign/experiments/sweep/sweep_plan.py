"""What a sweep consists of: every combination of recording, algorithm, joints, angle interval and seed is one unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from armdesign.errors import SettingsError
from armdesign.search.design_problem import DesignProblem
from armdesign.settings.sections import ALGORITHM_SETTINGS, Settings

MOST_UNITS = 100_000
Tasks = Mapping[tuple[str, int], DesignProblem]
"""Every recording, by its path, prepared for every number of joints."""


@dataclass(frozen=True)
class Sweep:
    """What was asked."""

    # settings of all runs; the recording, joints, algorithm, seed and angle interval are set per run
    settings: Settings
    recordings: tuple[str, ...]  # paths of the recordings, as text
    algorithms: tuple[str, ...]  # names of the search algorithms
    dof: tuple[int, ...]  # numbers of joints n
    seeds: tuple[int, ...]  # seeds
    angle_intervals: tuple[int, ...]  # D of RA-PSO; a PSO has none and runs once instead of once per D


@dataclass(frozen=True)
class Unit:
    """One search of a sweep, or another piece of work: it depends on no other and can run anywhere, in any order."""

    name: str  # name of its run folder
    recording: str  # name of the recording's file
    problem: DesignProblem  # its task and all its settings
    # what to do where it is no search, as JSON values; ``work["study"]`` names the study that does it
    work: Mapping[str, Any] | None = None

    @property
    def angle_interval(self) -> int | None:
        """D, where the algorithm has one."""
        search = self.problem.settings.search
        return search.angle_interval if self.work is None and search.has("angle_interval") else None


def units_of(sweep: Sweep, tasks: Tasks) -> list[Unit]:
    """The units in the order of the plan: by recording, algorithm, joints, D and seed.

    Raises:
        SettingsError: A value is not allowed or leaves no arm, or there are too many.
    """
    runs_per_task = len(sweep.seeds) * sum(len(variants(sweep, algorithm)) for algorithm in sweep.algorithms)
    if len(tasks) * runs_per_task > MOST_UNITS:
        raise SettingsError(f"the sweep has {len(tasks) * runs_per_task} runs", allowed=f"up to {MOST_UNITS}")
    for task in tasks.values():
        task.space, task.path_problem  # noqa: B018 (made once, on first use)
    return [
        unit_for(path, tasks[path, n], algorithm, D, seed)
        for path in sweep.recordings
        for algorithm in sweep.algorithms
        for n in sweep.dof
        for D in variants(sweep, algorithm)
        for seed in sweep.seeds
    ]


def unit_for(path: str, task: DesignProblem, algorithm: str, D: int | None, seed: int) -> Unit:
    """One unit, and the name of its run folder."""
    search: dict[str, object] = {"algorithm": algorithm, "seed": seed}
    interval = ""
    if D is not None:
        search["angle_interval"] = D
        interval = f"-D{D}"
    settings = task.settings.replace({"search": search})
    name = f"{Path(path).stem}-{algorithm}-n{settings.design.dof}{interval}-seed{seed}"
    return Unit(name, Path(path).name, replace(task, settings=settings))


def common_settings(settings: Settings) -> Settings:
    """The settings of a sweep without what is set per run, so that two sweeps can be compared."""
    plain = Settings()
    return settings.replace(
        {
            "task": {"recording": None},
            "design": {"dof": plain.design.dof},
            "search": {name: getattr(plain.search, name) for name in ("algorithm", "seed", "angle_interval")},
        }
    )


def variants(sweep: Sweep, algorithm: str) -> tuple[int | None, ...]:
    """The values of D an algorithm runs with; a lone None where it has none."""
    return sweep.angle_intervals if "angle_interval" in ALGORITHM_SETTINGS.get(algorithm, ()) else (None,)


def check_stems(recordings: Sequence[str]) -> None:
    """Refuse recordings whose runs would have the same names.

    Raises:
        SettingsError: Two recordings have the same name.
    """
    seen: dict[str, str] = {}
    for path in recordings:
        other = seen.setdefault(Path(path).stem.casefold(), path)
        if other is not path:
            raise SettingsError(
                f"the recordings {other} and {path} have one name, and so would the folders of their runs",
                value=path,
                fix="Rename one, or take one after the other, each with an --out of its own",
            )
