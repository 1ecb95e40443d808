"""How kernels are compiled: typed one by one, turned into machine code once per entry, cached on disk.

Left to itself, Numba optimises a function and writes machine code for it, and does so again inside each of its
callers, level by level; four fifths of that is thrown away, since Python calls none but the entries. Inner kernels
therefore stay an intermediate form (see inner_compiler), which the entries link, inline and optimise in one go.

Numba's cache looks only at the file of the function it caches; a change in a leaf that lives elsewhere would go
unnoticed and give old numbers. Entries are therefore stamped with the source of the whole package's kernels.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numba
from numba.core import event
from numba.core.dispatcher import Dispatcher

KERNEL_ROOMS = ("kinematics", "fitness", "cell", "bodies", "feasibility")
LINKING_SHARE = 0.25
"""Part of the time an entry takes that goes by after its kernels are typed, while LLVM optimises them all."""

OnProgress = Callable[[int, int], None]
"""Called with how much is compiled and how much there is, in units of bytecode."""


OPTIONS: dict[str, Any] = {"error_model": "numpy", "nogil": True, "no_rewrites": True, "no_cfunc_wrapper": True}
try:
    from armdesign.kinematics.inner_compiler import INNER_OPTIONS, UNCOUNTED
except (ImportError, AttributeError):  # another Numba inside: every kernel is compiled on its own, which takes longer
    INNER_OPTIONS, UNCOUNTED = {}, {}
INNER: dict[str, Any] = {**OPTIONS, **INNER_OPTIONS}


def leaf(function: Callable[..., Any]) -> Any:  # noqa: ANN401 (a Numba dispatcher)
    """Compile a function that only other kernels call, into each of its callers."""
    return numba.njit(forceinline=True, **INNER)(function)


def branch(function: Callable[..., Any]) -> Any:  # noqa: ANN401 (a Numba dispatcher)
    """Compile a larger function that only other kernels call; LLVM decides where it is worth inlining."""
    return numba.njit(**INNER)(function)


def entry(function: Callable[..., Any]) -> Any:  # noqa: ANN401 (a Numba dispatcher)
    """Compile a kernel that Python calls, cached on disk wherever a folder for it can be written."""
    return cached_on_disk(function, OPTIONS)


def plain_entry(function: Callable[..., Any]) -> Any:  # noqa: ANN401 (a Numba dispatcher)
    """Compile a kernel that Python calls and that makes no arrays: references to its arguments need no counting."""
    return cached_on_disk(function, OPTIONS | UNCOUNTED)


def cached_on_disk(function: Callable[..., Any], options: dict[str, Any]) -> Any:  # noqa: ANN401 (a Numba dispatcher)
    """Compile an entry, cached wherever a folder for it can be written."""
    try:
        dispatcher = numba.njit(cache=True, **options)(function)
        dispatcher._cache._cache_file._source_stamp = stamp_of(Path(function.__code__.co_filename))
    except (RuntimeError, AttributeError):  # no writable place, or no stamp that could be set: compile in every process
        return numba.njit(**options)(function)
    return dispatcher


def machine_code(kernel: Dispatcher) -> Callable[..., Any]:
    """What an entry that has just been called runs, for further calls with arguments of the same types.

    Numba's look at the types of records and arrays takes 2 us a call, a twentieth of a round of a block. Where the
    entry has been called with other types, too, it has to look.
    """
    compiled: list[Any] = list(kernel.overloads.values())
    return compiled[0].entry_point if len(compiled) == 1 else kernel


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
    here = Path(__file__)
    for path in (here, here.with_name("inner_compiler.py"), *sorted(kernels)):
        digest.update(path.name.encode() + path.read_bytes())
    return digest.hexdigest()


@contextmanager
def progress_of(entries: list[Dispatcher], on_progress: OnProgress) -> Iterator[None]:
    """Report how far the compilation of these entries is, as long as the context lasts.

    Args:
        entries: The kernels that are called in the context.
        on_progress: Called after every kernel; at the end with everything done, also where the disk cache had it.
    """
    sizes = {kernel: len(kernel.py_func.__code__.co_code) for entry in entries for kernel in called_by(entry)}
    linking = LINKING_SHARE / (1.0 - LINKING_SHARE)
    for dispatcher in entries:
        sizes[dispatcher] += round(linking * sum(sizes[kernel] for kernel in called_by(dispatcher)))
    total = sum(sizes.values())

    class Listener(event.Listener):
        def on_start(self, event: event.Event) -> None:
            """Nothing is done yet."""

        def on_end(self, event: event.Event) -> None:
            if sizes.pop(event.data["dispatcher"], None) is not None:
                on_progress(total - sum(sizes.values()), total)

    with event.install_listener("numba:compile", Listener()):
        yield
    if sizes:
        on_progress(total, total)


def called_by(kernel: Dispatcher) -> set[Dispatcher]:
    """A kernel with all kernels that it calls, directly or through others."""
    found: set[Dispatcher] = set()
    waiting = [kernel]
    while waiting:
        kernel = waiting.pop()
        if kernel not in found:
            found.add(kernel)
            names = (kernel.py_func.__globals__.get(name) for name in kernel.py_func.__code__.co_names)
            waiting.extend(value for value in names if isinstance(value, Dispatcher))
    return found
