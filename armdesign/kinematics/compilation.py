"""How kernels are compiled: leaves into their callers, branches once, entries cached on disk.

Numba's cache looks only at the file of the function it caches; a change in a leaf that lives elsewhere would go
unnoticed and give old numbers. Entries are therefore stamped with the source of the whole package's kernels.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba

KERNEL_ROOMS = ("kinematics", "fitness")
OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True}


def leaf(function: Callable[..., Any]) -> Any:  # noqa: ANN401 (a Numba dispatcher)
    """Compile a function that only other kernels call, into each of its callers."""
    return numba.njit(forceinline=True, **OPTIONS)(function)


def branch(function: Callable[..., Any]) -> Any:  # noqa: ANN401 (a Numba dispatcher)
    """Compile a larger function that kernels call from several places, once."""
    return numba.njit(**OPTIONS)(function)


def entry(function: Callable[..., Any]) -> Any:  # noqa: ANN401 (a Numba dispatcher)
    """Compile a kernel that Python calls, cached on disk wherever a folder for it can be written."""
    try:
        dispatcher = numba.njit(cache=True, **OPTIONS)(function)
    except RuntimeError:  # no writable place for the cache: compile in every process
        return numba.njit(**OPTIONS)(function)
    dispatcher._cache._cache_file._source_stamp = stamp_of(Path(function.__code__.co_filename))
    return dispatcher


def stamp_of(module: Path) -> str:
    """Stamp of an entry in a module: the kernels' source, with that of the module where it lies in another room."""
    if module.parent.name == "kernels" and module.parent.parent.name in KERNEL_ROOMS:
        return source_stamp()
    return hashlib.sha256(source_stamp().encode() + module.read_bytes()).hexdigest()


@cache
def source_stamp() -> str:
    """Hash of the source of every module that may hold kernels."""
    package = Path(__file__).parent.parent
    digest = hashlib.sha256(numba.__version__.encode())
    kernels = (path for room in KERNEL_ROOMS for path in (package / room / "kernels").glob("*.py"))
    for path in (Path(__file__), *sorted(kernels)):
        digest.update(path.read_bytes())
    return digest.hexdigest()
