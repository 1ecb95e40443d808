"""What the commands share: errors as one sentence, settings from flags, progress and tables."""

from __future__ import annotations

import functools
import logging
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ParamSpec, TypeVar

import typer

from armdesign.errors import ArmDesignError, RunFolderError, SettingsError

if TYPE_CHECKING:
    from distributed import Client

    from armdesign.search.backends import Backend
    from armdesign.search.prepare import Prepared
    from armdesign.search.search import Progress
    from armdesign.settings.sections import Settings

Arguments = ParamSpec("Arguments")
Outcome = TypeVar("Outcome")
INTERRUPTED = 130

ConfigOption = Annotated[
    Path | None, typer.Option("--config", help="TOML file with any of the settings; flags go over it.")
]
ScenarioOption = Annotated[
    str | None, typer.Option("--scenario", help="Published weights: packaging (default) or welding (with orientation).")
]
WeightsOption = Annotated[
    str | None,
    typer.Option("--weights", help="w_1,...,w_m, or w_0,w_1,...,w_m with the orientation's first; fractions allowed."),
]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="No progress and no table.")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace the run in the output folder.")]


WorkersOption = Annotated[
    int | None, typer.Option("--workers", help="Worker processes on this machine; default: all cores where it pays.")
]
ClusterOption = Annotated[
    str | None,
    typer.Option(
        "--cluster", help="Dask scheduler whose workers evaluate instead of this machine's cores, e.g. tcp://host:8786."
    ),
]
PAYS_PER_WORKER = 2000
"""Candidates a search must have per worker before a further process pays for its start."""


def one_sentence_errors(command: Callable[Arguments, Outcome]) -> Callable[Arguments, Outcome]:
    """Turn errors for bad input into one sentence on stderr and exit code 2, Ctrl-C into 130."""

    @functools.wraps(command)
    def wrapped(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Outcome:
        try:
            return command(*args, **kwargs)
        except ArmDesignError as error:
            typer.echo(f"armdesign: {error}", err=True)
            raise typer.Exit(error.exit_code) from error
        except KeyboardInterrupt as error:
            typer.echo("armdesign: stopped", err=True)
            raise typer.Exit(INTERRUPTED) from error

    return wrapped


def settings_from_flags(config: Path | None, changes: dict[str, dict[str, Any]]) -> Settings:
    """Settings of the file, with the flags that were given over them."""
    from armdesign.settings.sections import Settings, read_settings  # noqa: PLC0415

    settings = Settings() if config is None else read_settings(config)
    given = {
        section: {k: v for k, v in entries.items() if v is not None} if isinstance(entries, dict) else entries
        for section, entries in changes.items()
    }
    return settings.replace(given)


def with_weights(
    settings: Settings, scenario: str | None, weights: str | None, point_count: Callable[[], int]
) -> Settings:
    """Settings with the weights of the flags: --weights as given, --scenario instead of the file's.

    Args:
        settings: The settings.
        scenario: What --scenario says.
        weights: What --weights says.
        point_count: Gives the number of points; asked only where it decides which weight is the orientation's.
    """
    if scenario is not None:
        settings = settings.replace({"fitness": {"scenario": scenario, "weights": (), "orientation_weight": None}})
    if weights is None:
        return settings
    values = [weight(part) for part in weights.split(",") if part.strip()]
    w_0 = values.pop(0) if len(values) == point_count() + 1 else 0.0
    return settings.replace({"fitness": {"weights": values, "orientation_weight": w_0}})


def weight(text: str) -> float:
    """A weight, as a number or a fraction."""
    try:
        return float(Fraction(text.strip()))
    except (ValueError, ZeroDivisionError, OverflowError) as error:
        raise SettingsError(
            f"--weights has an entry {text.strip()!r}", value=text, allowed="numbers or fractions such as 0.5 or 1/6"
        ) from error


@contextmanager
def announce_compiling(quiet: bool) -> Iterator[None]:
    """Say so when the kernels have to be compiled, which happens once per machine and version."""
    message = "Compiling the kernels, once on this machine; this takes about half a minute ..."
    timer = threading.Timer(1.5, lambda: typer.echo(message, err=True))
    timer.daemon = True
    if not quiet:
        timer.start()
    try:
        yield
    finally:
        timer.cancel()


Line = TypeVar("Line", bound="StatusLine")


class StatusLine:
    """A line on stderr that is rewritten in a terminal.

    Attributes:
        terminal: Whether stderr is one.
        open: Whether the line has been begun and not ended.
    """

    def __init__(self) -> None:
        """Nothing shown yet."""
        self.terminal = sys.stderr.isatty()
        self.open = False

    def __enter__(self: Line) -> Line:
        """Nothing to do."""
        return self

    def __exit__(self, *error: object) -> None:
        """End a line that was begun, so that what comes next, such as an error, has its own."""
        if self.open:
            self.open = False
            sys.stderr.write("\n")
            sys.stderr.flush()

    def rewrite(self, text: str, *, last: bool = False) -> None:
        """Put a text in place of what the line says; the last one ends it."""
        self.open = not last
        sys.stderr.write("\r\x1b[2K" + text + ("\n" if last else ""))
        sys.stderr.flush()


class ProgressLine(StatusLine):
    """Progress of a search on stderr: one line that is rewritten in a terminal, a line per tenth elsewhere."""

    def __init__(self) -> None:
        """Start the clock."""
        super().__init__()
        self.shown = 0.0
        self.tenth = -1

    def __call__(self, progress: Progress) -> None:
        """Show an iteration if it is time to."""
        last = progress.iteration == progress.iterations
        if self.terminal:
            now = time.monotonic()
            if last or now - self.shown > 0.1:
                self.shown = now
                self.rewrite(progress_text(progress), last=last)
            return
        tenth = 10 * progress.iteration // progress.iterations
        if tenth > self.tenth or last:
            self.tenth = tenth
            typer.echo(progress_text(progress), err=True)


def progress_text(progress: Progress) -> str:
    """Iteration, best fitness in the paper's terms, valid particles, time left."""
    left = progress.elapsed / progress.iteration * (progress.iterations - progress.iteration)
    if progress.fitness == float("inf"):
        best = "no valid arm yet"
    else:
        best = f"r {progress.fitness:.4f}  f {progress.path_fitness * 1e3:.2f} mm  E {progress.area * 1e3:.2f} mm"
    digits = len(str(progress.iterations))
    return (
        f"{progress.unit} {progress.iteration:{digits}d}/{progress.iterations}  {best}  "
        f"valid {progress.valid}/{progress.particles}  {clock(left)} left"
    )


def clock(seconds: float) -> str:
    """A duration as m:ss or h:mm:ss."""
    total = round(seconds)
    hours, minutes = divmod(total // 60, 60)
    return f"{hours}:{minutes:02d}:{total % 60:02d}" if hours else f"{minutes}:{total % 60:02d}"


def seconds(text: str | None) -> float | None:
    """A duration such as 90, 90s, 30m, 2h or 1.5d in seconds.

    Raises:
        SettingsError: It is not one.
    """
    if text is None:
        return None
    units = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
    number, unit = (text[:-1], text[-1]) if text[-1:] in units else (text, "s")
    try:
        return float(number) * units[unit]
    except ValueError as error:
        raise SettingsError(
            f"--time-limit is {text!r}", value=text, allowed="a duration such as 90s, 30m, 2h or 1d"
        ) from error


GO_ON_FLAGS = ("resume", "workers", "cluster", "quiet", "dry_run", "report")
"""What may be given with --resume."""


def refuse_beside_resume(context: typer.Context, what: str, fix: str) -> None:
    """See that nothing is asked of a run or sweep that is gone on with but how to carry it out.

    Args:
        context: The command's context.
        what: What is gone on with, "a search" or "a sweep".
        fix: What to do instead.

    Raises:
        SettingsError: A flag or an argument was given that would change what is computed.
    """
    given = [
        max(parameter.opts, key=len) if str(parameter.opts[0]).startswith("-") else f"the {noun(parameter.name)}"
        for parameter in context.command.params
        if parameter.name not in GO_ON_FLAGS and was_given(context, str(parameter.name))
    ]
    if given:
        message = f"--resume goes on with {what} as it was asked for, but {', '.join(given)} is given as well"
        raise SettingsError(message, value=given, fix=fix)


def noun(name: str | None) -> str:
    """What an argument is called, in the singular."""
    return str(name).removesuffix("s")


def was_given(context: typer.Context, name: str) -> bool:
    """Whether a parameter was written on the command line."""
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


def tell_at_once(sentence: str) -> None:
    """A sentence on stderr from within a signal handler, where the stream's own buffer may be in use."""
    try:
        os.write(sys.__stderr__.fileno() if sys.__stderr__ else 2, f"\n{sentence}\n".encode())
    except OSError:
        return  # nobody is listening; the search stops all the same


def check_workers(workers: int | None, cluster: str | None) -> None:
    """Refuse workers that cannot be.

    Raises:
        SettingsError: A number of workers below 1, or workers and a cluster at once.
    """
    if workers is not None and workers < 1:
        raise SettingsError(f"--workers is {workers}", value=workers, allowed="a whole number of at least 1")
    if workers is not None and cluster is not None:
        raise SettingsError("--workers and --cluster are given", fix="A cluster brings its own workers; leave one out")


def check_cluster(cluster: str | None) -> None:
    """Refuse a cluster that does not answer, before anything is written.

    Raises:
        SettingsError: The address is none.
        MissingExtraError: Dask distributed is not installed.
        SearchError: No scheduler answers at the address.
    """
    if cluster is not None:
        from armdesign.search.backends.dask_connection import check_address  # noqa: PLC0415

        check_address(cluster)


def refuse_existing(*targets: Path, overwrite: bool) -> None:
    """Turn away outputs that are there already, before any work is done.

    Raises:
        RunFolderError: One of them exists and may not be replaced.
    """
    for target in targets:
        if target.exists() and not overwrite:
            fix = "Use --overwrite to replace it, or give another name"
            raise RunFolderError(f"{target} is there already", value=str(target), fix=fix)


def open_backend(
    prepared: Prepared, workers: int | None, cluster: str | None = None
) -> AbstractContextManager[Backend]:
    """Who evaluates: a cluster, or as many worker processes as asked for, by default as many as pay.

    Raises:
        SettingsError: A number of workers below 1, or workers and a cluster at once.
    """
    from armdesign.search.backends import InProcess, WorkerPool  # noqa: PLC0415
    from armdesign.search.backends.processes import available_cores  # noqa: PLC0415

    check_workers(workers, cluster)
    if cluster is not None:
        return open_cluster(prepared, cluster)
    settings = prepared.settings.search
    paying = settings.candidates // PAYS_PER_WORKER
    count = workers if workers is not None else max(1, min(available_cores(), paying))
    return InProcess(prepared) if count == 1 else WorkerPool(prepared, count)


@contextmanager
def open_cluster(prepared: Prepared, address: str) -> Iterator[Backend]:
    """The workers of a Dask scheduler as a backend; see ``cluster_client``."""
    with cluster_client(address) as client:
        from armdesign.search.backends.dask_cluster import DaskCluster  # noqa: PLC0415

        with DaskCluster(client, prepared, say=say) as backend:
            yield backend


@contextmanager
def cluster_client(address: str) -> Iterator[Client]:
    """A connection to a Dask scheduler; waits for its first worker and says so.

    Raises:
        MissingExtraError: Dask distributed is not installed.
        SettingsError: The address is none.
        SearchError: No scheduler answers there, or its workers run another version.
    """
    from armdesign.search.backends.dask_connection import connect  # noqa: PLC0415

    for name in ("distributed", "distributed.client"):  # what goes wrong comes as a sentence
        logging.getLogger(name).setLevel(logging.CRITICAL)
    with connect(address, say=say) as client:
        yield client


def say(sentence: str) -> None:
    """A sentence on stderr."""
    typer.echo(sentence, err=True)
