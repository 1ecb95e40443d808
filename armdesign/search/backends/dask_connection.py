"""The connection to a Dask cluster: made in a known time, to workers that compute the same, explained when it fails.

Everything here needs the extra ``cluster``; the modules on Dask import from here first, which says so where it lacks.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

from armdesign._version import __version__
from armdesign.errors import MissingExtraError, SearchError, SettingsError
from armdesign.kinematics.compilation import source_stamp

try:
    from distributed import CancelledError, Client, rpc
    from distributed import TimeoutError as StillWaitingError
    from distributed.security import Security
except ImportError as error:
    raise MissingExtraError(
        "a cluster needs Dask distributed, which is not installed", fix="Run: pip install 'armdesign[cluster]'"
    ) from error

Say = Callable[[str], None]
Kernels = tuple[str, str]
"""Version of armdesign and digest of its kernels."""
TIMEOUT = 10.0
"""How long a scheduler may take to answer [s]."""


def connect(address: str, *, timeout: float = TIMEOUT, say: Say | None = None) -> Client:
    """Connect to a scheduler and wait for its first worker.

    Args:
        address: Where it listens, such as tcp://host:8786.
        timeout: Longest wait for the scheduler [s].
        say: Called with a sentence when the wait for a worker begins.

    Returns:
        The client, to be closed by the caller (``with connect(...) as client``).

    Raises:
        SettingsError: The address is none.
        SearchError: No scheduler answers there, or a worker runs another version.
    """
    check_address(address, timeout)
    try:
        client = Client(address, timeout=timeout, set_as_default=False)
    except OSError as error:
        raise unreachable(address, timeout) from error
    try:
        with explained(address):
            if not client.nthreads():
                tell(say, f"The scheduler {address} has no workers yet; waiting for the first.")
                client.wait_for_workers(1)
            check_workers(client)
    except BaseException:
        client.close()
        raise
    return client


def check_address(address: str, timeout: float = TIMEOUT) -> None:
    """See that a scheduler answers: a Dask client waits without end for a listener that never speaks.

    Raises:
        SettingsError: The address is none.
        SearchError: No scheduler answers there.
    """

    async def identity() -> dict[str, Any]:
        arguments = Security().get_connection_args("client")
        async with rpc(address, timeout=timeout, connection_args=arguments) as listener:
            answer: dict[str, Any] = await asyncio.wait_for(listener.identity(), timeout)
            return answer

    try:
        with ThreadPoolExecutor(1) as thread:  # not here: a notebook has an event loop of its own
            kind = str(thread.submit(asyncio.run, identity()).result().get("type"))
    except (ValueError, TypeError) as error:
        raise SettingsError(
            f"{address!r} is no address of a Dask scheduler: {error}", value=address, allowed="tcp://HOST:PORT"
        ) from error
    except (TimeoutError, OSError, StillWaitingError) as error:
        raise unreachable(address, timeout) from error
    if not kind.endswith("Scheduler"):
        raise SearchError(f"a Dask {kind.lower()} answers at {address}, not a scheduler", value=address)


def check_workers(client: Client) -> None:
    """See that the workers compute what this process would.

    Raises:
        SearchError: armdesign is missing on a worker, or it is another version.
    """
    here = kernels_here()
    for worker, there in client.run(kernels_here, on_error="return").items():
        if isinstance(there, BaseException):
            raise SearchError(
                f"the worker {worker} cannot load armdesign: {there}",
                value=worker,
                fix=f"Install 'armdesign[cluster]' {__version__} on every worker",
            ) from there
        if tuple(there) != here:
            raise other_version(worker, here, tuple(there))


def kernels_here() -> Kernels:
    """Version of armdesign and digest of its kernels in this process."""
    return __version__, source_stamp()


@contextmanager
def explained(address: str) -> Iterator[None]:
    """Turn what goes wrong with a cluster into sentences.

    Raises:
        SearchError: The connection is lost, or a worker lacks a module.
    """
    again = "A search in a run folder goes on with: armdesign search --resume FOLDER --cluster ADDRESS"
    try:
        yield
    except (CancelledError, OSError) as error:
        raise SearchError(f"lost the Dask scheduler at {address}", value=address, fix=again) from error
    except ImportError as error:
        raise cannot_load(address, error) from error


def cannot_load(address: str, error: BaseException) -> SearchError:
    """The error of workers that lack armdesign or one of its modules."""
    return SearchError(
        f"a worker of the cluster at {address} cannot load armdesign: {error}",
        fix=f"Install 'armdesign[cluster]' {__version__} on every worker",
    )


def unreachable(address: str, timeout: float) -> SearchError:
    """The error of a scheduler that does not answer."""
    return SearchError(
        f"no Dask scheduler answers at {address} within {timeout:g} s",
        value=address,
        fix="Check the address and that 'dask scheduler' runs there",
    )


def other_version(worker: str, here: Kernels, there: Kernels) -> SearchError:
    """The error of a worker that would compute something else."""
    what = f"armdesign {there[0]}" if here[0] != there[0] else "other kernels of the same version, or another Numba"
    return SearchError(
        f"the worker {worker} runs {what}, this is armdesign {here[0]}: the scores would not be the same",
        value=there,
        fix="Install the same armdesign and Numba on every worker, and start it again",
    )


def tell(say: Say | None, sentence: str) -> None:
    """Pass a sentence on to whoever listens."""
    if say is not None:
        say(sentence)
