"""Where the candidates of a command are evaluated: in this process, in worker processes, or on a cluster."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, NamedTuple

from armdesign.cli.command_options import option
from armdesign.cli.screen import say
from armdesign.errors import SettingsError
from armdesign.search.backends.backend import Backend, InProcess
from armdesign.search.backends.parallel import WorkerPool
from armdesign.search.backends.processes import available_cores
from armdesign.search.design_problem import DesignProblem

if TYPE_CHECKING:
    from distributed import Client

COMPUTING = "Computing"
"""Panel of the options below."""
PAYS_PER_WORKER = 2000
"""Candidates a search must have per worker before a further process pays for its start."""
WorkersOption = Annotated[
    int | None,
    option(
        "--workers",
        "N",
        "Worker processes on this machine; default: one per core, fewer for a small search.",
        COMPUTING,
    ),
]
ClusterOption = Annotated[
    str | None,
    option(
        "--cluster",
        "ADDRESS",
        "Address of a Dask scheduler whose workers compute instead of this machine, e.g. tcp://host:8786.",
        COMPUTING,
    ),
]


class RunOptions(NamedTuple):
    """How a search is carried out and shown."""

    workers: int | None  # worker processes; None for as many as pay
    cluster: str | None  # Dask scheduler whose workers evaluate
    report: bool  # whether the arm gets its preview and report
    quiet: bool  # neither progress nor tables


def check_workers(workers: int | None, cluster: str | None) -> None:
    """Refuse workers that cannot be, and a cluster that does not answer, before anything is written.

    Raises:
        SettingsError: A number of workers below 1, workers and a cluster at once, or an address that is none.
        MissingExtraError: Dask distributed is not installed.
        SearchError: No scheduler answers at the address.
    """
    if workers is not None and workers < 1:
        raise SettingsError(f"--workers is {workers}", value=workers, allowed="a whole number of at least 1")
    if workers is not None and cluster is not None:
        raise SettingsError("--workers and --cluster are given", fix="A cluster brings its own workers; leave one out")
    if cluster is not None:
        from armdesign.search.backends.dask_connection import check_address  # noqa: PLC0415 (an optional extra)

        check_address(cluster)


@contextmanager
def open_backend(problem: DesignProblem, workers: int | None, cluster: str | None = None) -> Iterator[Backend]:
    """The backend of a search: a cluster, this process, or worker processes, by default as many as make it faster.

    Args:
        problem: Task and settings.
        workers: Number of processes; None for as many as pay.
        cluster: Address of a Dask scheduler.
    """
    check_workers(workers, None if workers is None else cluster)
    if cluster is not None:
        from armdesign.search.backends.dask_workers import DaskCluster  # noqa: PLC0415 (an optional extra)

        with cluster_client(cluster) as client, DaskCluster(client, problem, say=say) as backend:
            yield backend
        return
    paying = problem.settings.search.candidates // PAYS_PER_WORKER
    count = workers if workers is not None else max(1, min(available_cores(), paying))
    with InProcess(problem) if count == 1 else WorkerPool(problem, count) as backend:
        yield backend


@contextmanager
def cluster_client(address: str) -> Iterator[Client]:
    """A connection to a Dask scheduler; waits for its first worker and says so.

    Raises:
        MissingExtraError: Dask distributed is not installed.
        SettingsError: The address is none.
        SearchError: No scheduler answers there, or its workers run another version.
    """
    from armdesign.search.backends.dask_connection import connect  # noqa: PLC0415 (an optional extra)

    for name in ("distributed", "distributed.client"):  # what goes wrong comes as a sentence
        logging.getLogger(name).setLevel(logging.CRITICAL)
    with connect(address, say=say) as client:
        yield client
