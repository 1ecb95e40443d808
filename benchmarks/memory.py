"""Memory of a worker: its peak on a large search, and whether it grows over the iterations."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

from plan import PACKAGING, Plan, tiled
from tables import Row, Table

from armdesign.search.backends.parallel import WorkerPool
from armdesign.search.backends.processes import available_cores
from armdesign.search.design_problem import DesignProblem
from armdesign.search.search import Search

MEGABYTE = 1e6


def tables(plan: Plan) -> Iterator[Table]:
    """A large search and many iterations of the default one."""
    large = tiled(PACKAGING.problem(7), 2000)
    small = PACKAGING.problem(3)
    title = "Memory of each worker process [MB], N = 400"
    if not sys.platform.startswith("linux"):
        yield Table("memory", f"{title}: not measured, it is read from /proc", [])
        return
    rows = [grown("n = 7, T = 2000", large, plan.pick(4, 2)), grown("n = 3, T = 100", small, plan.pick(120, 20))]
    yield Table("memory", title, rows, ["Resident after the first iteration, growth to the last one, peak; the aim is "
                                        "400 MB per worker at most, and flat."])  # fmt: skip


def grown(label: str, problem: DesignProblem, iterations: int) -> Row:
    """Search for some iterations on worker processes."""
    with WorkerPool(problem, available_cores()) as pool:
        run = Search(problem, pool)
        run.advance()
        before = [resident(pid) for pid in pool.pids]
        own = resident("self")
        for _ in range(iterations - 1):
            run.advance()
        growth = max(resident(pid) - start for pid, start in zip(pool.pids, before, strict=True))
        return {
            "search": label,
            "iterations": iterations,
            "workers": len(pool.pids),
            "worker": max(before),
            "growth": growth,
            "peak": max(resident(pid, "VmHWM") for pid in pool.pids),
            "growth of the searching process": resident("self") - own,
        }


def resident(pid: int | str, entry: str = "VmRSS") -> float:
    """Memory of a process [MB]: VmRSS now, VmHWM at its peak."""
    lines = Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines()
    return 1024.0 * int(next(line for line in lines if line.startswith(f"{entry}:")).split()[1]) / MEGABYTE
