"""A sweep in one call: recordings, settings and lists of values in, a folder of runs and its table out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from armdesign.experiments.sweep.run_sweep import SweepStatus, run_sweep
from armdesign.experiments.sweep.run_table import RunTable
from armdesign.experiments.sweep.sweep_plan import Sweep, check_stems, common_settings
from armdesign.experiments.sweep.units import unit_worker
from armdesign.fitness.block import compile_kernels
from armdesign.search.backends.processes import WorkerProcesses
from armdesign.search.design_arm import problem_of
from armdesign.settings.sections import ALGORITHM_SETTINGS, Settings
from armdesign.swarm import ALGORITHMS


def sweep(
    recordings: str | Path | Sequence[str | Path],
    folder: str | Path,
    settings: Settings | None = None,
    *,
    dof: Sequence[int] = (),
    seeds: Sequence[int] = (),
    algorithms: Sequence[str] = (),
    workers: int = 1,
    on_change: Callable[[SweepStatus], None] | None = None,
) -> RunTable:
    """Run a search for every combination of recordings, algorithms, numbers of joints and seeds.

    The folder gets a run folder for each and a table of all, ``sweep.csv``. Finished runs are not computed again: the
    same call goes on where it was stopped, and with more seeds, joints or recordings adds the runs that are missing.
    The searches run in worker processes: call this below ``if __name__ == "__main__":``.

    Args:
        recordings: Paths of the demonstrations.
        folder: The sweep's folder; made, taken up or extended.
        settings: Settings of all runs; by default the published ones.
        dof: Numbers of joints; by default that of the settings, as with the other lists.
        seeds: Seeds.
        algorithms: Names of search algorithms.
        workers: Searches at a time, each in its own process.
        on_change: Called when a run has ended or a search has moved on.

    Returns:
        The table at the end; a run that fails does not stop the others.

    Raises:
        ArmDesignError: A recording or setting cannot be used, or the folder holds something else.
    """
    chosen = settings or Settings()
    paths = [
        str(Path(path).resolve()) for path in ([recordings] if isinstance(recordings, (str, Path)) else recordings)
    ]
    check_stems(paths)
    joints, names = tuple(dof) or (chosen.design.dof,), tuple(algorithms) or (chosen.search.algorithm,)
    intervals = any("angle_interval" in ALGORITHM_SETTINGS.get(name, ()) for name in names)
    asked = Sweep(
        common_settings(chosen), tuple(paths), names, joints, tuple(seeds) or (chosen.search.seed,),
        (chosen.search.angle_interval,) if intervals else (),
    )  # fmt: skip
    tasks = {(path, n): problem_of([path], (), chosen.with_entries(dof=n)) for path in paths for n in joints}

    def start(units: int) -> WorkerProcesses:
        slopes = any(ALGORITHMS[name].takes_slopes for name in names)
        compile_kernels(next(iter(tasks.values())).path_problem, slopes=slopes)
        return WorkerProcesses(min(workers, units), unit_worker)

    return run_sweep(Path(folder), asked, tasks, start, on_change=on_change)
