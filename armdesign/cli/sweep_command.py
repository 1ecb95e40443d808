"""``armdesign sweep``: many searches, one for every combination of settings, in one folder with one table."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from armdesign.cli.command_errors import INTERRUPTED, one_sentence_errors, refuse_beside_resume, refuse_other_algorithms
from armdesign.cli.command_options import OUTPUT, ConfigOption, QuietOption, WeightFlags, option, settings_from_flags
from armdesign.cli.input_recordings import from_run_folder, open_recording
from armdesign.cli.screen import SweepBar, clock, compiling, say_in_handler, show_table, show_text
from armdesign.cli.setting_flags import Given, takes_settings
from armdesign.cli.worker_options import COMPUTING, ClusterOption, check_workers, cluster_client
from armdesign.errors import SettingsError, counted, resume_command
from armdesign.experiments.sweep.estimate import CANDIDATES, estimate
from armdesign.experiments.sweep.ranges import seed_numbers, whole_numbers
from armdesign.experiments.sweep.run_sweep import run_sweep
from armdesign.experiments.sweep.run_table import HAND, Row, RunTable
from armdesign.experiments.sweep.sweep_plan import Sweep, Tasks, check_stems, common_settings, units_of
from armdesign.experiments.sweep.sweep_store import check_extension, holds_sweep, read_sweep
from armdesign.experiments.sweep.units import look_at, unit_worker
from armdesign.fitness.block import compile_kernels
from armdesign.search.backends.processes import WorkerProcesses, available_cores
from armdesign.search.backends.workers import Workers
from armdesign.search.design_problem import DesignProblem
from armdesign.search.prepare import prepare
from armdesign.settings.sections import ALGORITHM_SETTINGS, Fitness, Search, Settings, Task, with_algorithm
from armdesign.swarm import ALGORITHMS

SOME_FAILED = 1
SHOWN_FAILURES = 5
RUNS = "Runs"
"""Panel of the options whose combinations are the runs."""


@one_sentence_errors
@takes_settings(Task, Fitness, Search, without=("demonstrations", "algorithm", "seed"))
def sweep(
    context: typer.Context,
    recordings: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="RECORDING",
            show_default=False,
            help="Recordings, each a task of its own; one may also be named in the settings file.",
        ),
    ] = None,
    dof: Annotated[
        str | None, option("--dof", "N", "Numbers of joints n: one (3), a range (3-6) or a list (3,5).", RUNS)
    ] = None,
    seeds: Annotated[
        str | None,
        option(
            "--seeds",
            "N",
            "How many seeds, counted from 0 (10); or which: a range (5-9, or 7-7 for 7 alone) or a list (3,4).",
            RUNS,
        ),
    ] = None,
    algorithm: Annotated[
        str | None,
        option(
            "--algorithm",
            "|".join(ALGORITHM_SETTINGS),
            "Search algorithm, or several by commas: pso,rapso (default multibasin).",
            RUNS,
            autocompletion=lambda: [*ALGORITHM_SETTINGS],
        ),
    ] = None,
    d: Annotated[
        str | None,
        option("--d", "N", "Numbers D of angle intervals of rapso: one (2), a range (2-5) or a list (2,4).", RUNS),
    ] = None,
    config: ConfigOption = None,
    *,
    given: Given,
    workers: Annotated[
        int | None,
        option("--workers", "N", "Searches at a time, each in its own process; default: all cores.", COMPUTING),
    ] = None,
    cluster: ClusterOption = None,
    resume: Annotated[
        Path | None, option("--resume", "DIR", "Go on with the sweep in this folder; needs nothing else.")
    ] = None,
    out: Annotated[
        Path | None, option("--out", "DIR", "Folder of the sweep, new or to extend (default runs/NAME-sweep).", OUTPUT)
    ] = None,
    dry_run: Annotated[
        bool,
        option("--dry-run", None, "Print the runs and an estimate of their time, and end; writes nothing.", OUTPUT),
    ] = False,
    quiet: QuietOption = False,
) -> None:
    """Run many searches, one for every combination of settings.

    Every combination of recordings, --algorithm, --dof, --d and --seeds is one. Writes a folder of run folders and
    sweep.csv, one row a run. Finished runs are never computed again: the same command goes on where it was stopped, and
    with more seeds, joints or recordings it adds the missing runs. A run that has failed is tried again the next time.
    """
    check_workers(workers, cluster)
    if resume is not None:
        refuse_beside_resume(context, "a sweep", "To extend it, repeat its command with more, and --out for --resume")
        folder, (plan, tasks) = resume, read_sweep(resume)
    else:
        weight_flags = WeightFlags.out_of(given)
        settings = settings_from_flags(config, given)
        if config is not None and not recordings:
            settings = from_run_folder(settings, config.parent)
        lists = lists_of_values(settings, dof, seeds, algorithm, d)
        refuse_other_algorithms(given["search"], lists["algorithms"])
        plan, tasks = prepare_sweep(recordings, settings, lists, weight_flags)
        folder = out or Path("runs") / f"{Path(plan.recordings[0]).stem}-sweep"
    count = workers or available_cores()
    if dry_run:
        show_plan(folder, plan, tasks, count)
        return
    carry_out(folder, plan, tasks, count, cluster, quiet=quiet)


def lists_of_values(
    settings: Settings, dof: str | None, seeds: str | None, algorithm: str | None, d: str | None
) -> dict[str, tuple[Any, ...]]:
    """The lists that make up the runs; where no flag is given, the one value of the settings.

    Raises:
        SettingsError: A list cannot be made out.
    """
    search = settings.search
    named = [part.strip() for part in (algorithm or "").split(",") if part.strip()]
    meant = with_algorithm({"angle_interval": d}, search.algorithm)
    algorithms = tuple(dict.fromkeys(named or [meant.get("algorithm", search.algorithm)]))
    with_intervals = any("angle_interval" in ALGORITHM_SETTINGS.get(name, ()) for name in algorithms)
    if d is not None and not with_intervals:
        raise SettingsError(
            "--d is given, but it is for rapso only", value=d, fix="Leave it out, or add rapso to --algorithm"
        )
    intervals = (search.angle_interval,) if d is None else whole_numbers(d, "--d")
    return {
        "algorithms": algorithms,
        "dof": (settings.design.dof,) if dof is None else whole_numbers(dof, "--dof"),
        "seeds": (search.seed,) if seeds is None else seed_numbers(seeds),
        "angle_intervals": intervals if with_intervals else (),
    }


def prepare_sweep(
    recordings: list[Path] | None, settings: Settings, lists: dict[str, tuple[Any, ...]], weight_flags: WeightFlags
) -> tuple[Sweep, Tasks]:
    """Read the recordings and prepare them for every number of joints.

    Raises:
        SettingsError: No recording, or weights that mean different things for different recordings.
    """
    paths: list[str] = []
    tasks: dict[tuple[str, int], DesignProblem] = {}
    demonstrations: list[Path | None] = [*recordings] if recordings else [None]
    for recording in demonstrations:
        source, demonstration, own = open_recording(recording, settings, weight_flags, "sweep")
        path = str(source.resolve())
        paths.append(path)
        for n in lists["dof"]:
            tasks[path, n] = prepare(demonstration, own.replace({"design": {"dof": n}}))
    paths = list(dict.fromkeys(paths))
    check_stems(paths)
    if weight_flags.weights is not None and len({len(problem.task.points) for problem in tasks.values()}) > 1:
        raise SettingsError(
            "--weights mean different things for recordings with different numbers of points",
            value=weight_flags.weights,
            fix="Choose the same number of --points in all, or make two sweeps",
        )
    return Sweep(common_settings(own), tuple(paths), **lists), tasks


def carry_out(folder: Path, plan: Sweep, tasks: Tasks, workers: int, cluster: str | None, *, quiet: bool) -> None:
    """Carry out a sweep, saying how it goes and how it went."""
    go_on = f"Go on with: {resume_command('sweep', folder, cluster)}"
    try:
        with SweepBar() as bar, unit_workers(workers, cluster, tasks, plan.algorithms, quiet=quiet) as start:
            on_change = None if quiet else bar
            table = run_sweep(folder, plan, tasks, start, on_change=on_change, on_interrupt=say_stopping)
    except KeyboardInterrupt:
        typer.echo(f"\n{go_on}", err=True)
        raise
    if not quiet:
        typer.echo(closing_text(table))
    leave(table, go_on)


def say_stopping() -> None:
    """What is said when Ctrl-C asks for the end."""
    say_in_handler("Stopping: the running searches finish their iteration; once more stops at once.")


def leave(table: RunTable, go_on: str) -> None:
    """End with the exit code that tells how the runs stand.

    Raises:
        Exit: Not all of them are finished.
    """
    if table.count("waiting", "interrupted"):
        typer.echo(f"Interrupted. {go_on}", err=True)
        raise typer.Exit(INTERRUPTED)
    if table.count("failed"):
        raise typer.Exit(SOME_FAILED)


@contextmanager
def unit_workers(
    workers: int,
    cluster: str | None,
    tasks: Tasks,
    algorithms: Collection[str],
    *,
    quiet: bool,
    warm_up: Callable[[], None] | None = None,
) -> Iterator[Callable[[int], Workers]]:
    """What starts the workers for a number of units: those of a cluster, or processes on this machine.

    The kernels are compiled before the processes start, so that these find them.

    Args:
        workers: Number of processes at most.
        cluster: Address of a Dask scheduler, or None.
        tasks: The tasks.
        algorithms: The search algorithms of the units; further names are passed over.
        quiet: Whether to keep silent.
        warm_up: Compiles what the units need beside the evaluator's kernels.
    """

    def start(units: int) -> Workers:
        slopes = any(ALGORITHMS[name].takes_slopes for name in algorithms if name in ALGORITHMS)
        with compiling(quiet=quiet, slopes=slopes):
            compile_kernels(next(iter(tasks.values())).path_problem, slopes=slopes)
            if warm_up is not None:
                warm_up()
        return WorkerProcesses(min(workers, units), unit_worker)

    if cluster is None:
        yield start
        return
    with cluster_client(cluster) as client:
        from armdesign.search.backends.dask_workers import DaskWorkers  # noqa: PLC0415 (an optional extra)

        yield lambda units: DaskWorkers(client, unit_worker)


def closing_text(table: RunTable) -> str:
    """What came of the sweep."""
    finished = [row for row in table.rows.values() if row["state"] == "finished"]
    failed = table.count("failed")
    lines = [f"{len(finished)} of {len(table.rows)} runs finished" + (f", {failed} failed." if failed else ".")]
    lines += lines_of_failures(table)
    if finished:
        best = min(finished, key=lambda row: float(row["fitness"]))
        lines.append(f"Best: {best['folder']}, {hand_of(best)}r {best['fitness']:.4f} m")
    return "\n".join([*lines, f"Table: {table.folder / 'sweep.csv'}"])


def hand_of(row: Row) -> str:
    """The hand's error of a run, and whether its arm is feasible; nothing for a run without a verdict."""
    if row["hand_mean"] == "":
        return ""
    mean, p95, largest = (f"{1e3 * row[name]:.1f} mm" for name in HAND)
    return f"hand error {mean} mean, {p95} (95 %), {largest} largest, {'' if row['feasible'] else 'not '}feasible; "


def lines_of_failures(table: RunTable) -> list[str]:
    """The first runs that have failed, each with its reason."""
    failed = [row for row in table.rows.values() if row["state"] == "failed"]
    lines = [f"  {row['folder']}: {row['stopped_by']}" for row in failed[:SHOWN_FAILURES]]
    return lines + ([f"  and {len(failed) - SHOWN_FAILURES} more"] if len(failed) > SHOWN_FAILURES else [])


def show_plan(folder: Path, plan: Sweep, tasks: Tasks, workers: int) -> None:
    """Print the runs with their states, and how long those that are not finished may take."""
    units = units_of(plan, tasks)
    if holds_sweep(folder):
        check_extension(folder, plan, tasks)
    found = {unit.name: look_at(folder, unit) for unit in units}
    todo = [unit for unit in units if found[unit.name] != "finished"]
    guess = estimate(todo)
    times = dict(zip((unit.name for unit in todo), guess.each, strict=True))
    typer.echo(f"{counted(len(units), 'run')} in {folder}, {len(units) - len(todo)} of them finished:")
    rows = [(name, state, f"about {clock(times[name])}" if name in times else "-") for name, state in found.items()]
    show_table(("run", "state", "time"), rows, left=(0, 1))
    total = clock(guess.total(min(workers, max(1, len(todo)))))
    show_text(
        f"An estimate, from {CANDIDATES} measured candidates per recording and number of joints: about "
        f"{total} with {workers} at a time on this machine. Stop rules may end runs sooner."
    )
    if guess.unknown:
        joints = ", ".join(map(str, guess.unknown)) + (" joint" if guess.unknown == (1,) else " joints")
        show_text(f"No measured arm of {joints} reached the start: their times are lower bounds.")
