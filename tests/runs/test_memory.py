import sys
from pathlib import Path

import numpy as np
import pytest

from armdesign.demonstration import Recording
from armdesign.runs import checkpoint
from armdesign.search.backends.backend import InProcess
from armdesign.search.backends.parallel import WorkerPool
from armdesign.search.prepare import prepare
from armdesign.search.search import Search
from armdesign.settings.sections import Settings

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
MEGABYTE = 2**20


def resident(pid="self", entry="VmRSS"):
    """Memory of a process [B]: VmRSS now, VmHWM at its peak."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return 1024 * int(next(line for line in lines if line.startswith(f"{entry}:")).split()[1])


def test_memory_stays_flat_over_the_iterations(task, tmp_path):
    task = task.with_settings({"search": {"iterations": 1000}})
    run = Search(task, InProcess(task))
    writer = checkpoint.StateWriter(tmp_path, "key")

    def iterate(count):
        for _ in range(count):
            run.advance()
            writer.submit(run.state())

    iterate(30)
    before = resident()
    iterate(100)
    writer.close()
    assert resident() - before < 4 * MEGABYTE


@pytest.mark.slow
def test_memory_of_workers_stays_flat(task):
    task = task.with_settings({"search": {"iterations": 1000}})
    with WorkerPool(task, 2) as pool:
        run = Search(task, pool)
        for _ in range(30):
            run.advance()
        before = [resident(pid) for pid in pool.pids]
        for _ in range(300):
            run.advance()
        assert all(resident(pid) - start < 4 * MEGABYTE for pid, start in zip(pool.pids, before, strict=True))


@pytest.mark.slow
def test_a_worker_at_a_large_search_needs_less_than_400_megabytes():
    """N = 400, n = 7, T = 2000: a hand that circles on an arm of human size."""
    time = np.arange(2000) / 100.0
    turn = 2.0 * np.pi * time / 20.0
    hand = np.stack([0.45 + 0.1 * np.cos(turn), 0.1 * np.sin(turn), 0.2 + 0.05 * np.sin(2 * turn)], axis=1)
    points = {"shoulder": np.zeros_like(hand), "elbow": 0.5 * hand - [0, 0, 0.15], "hand": hand}
    settings = {"design": {"dof": 7}, "search": {"particles": 400, "iterations": 1}}
    task = prepare(Recording(time, points, {}, "circle"), Settings().replace(settings))
    with WorkerPool(task, 2) as pool:
        progress = Search(task, pool).advance()
        peaks = [resident(pid, "VmHWM") / 1e6 for pid in pool.pids]
    print(f"peak of each worker: {peaks} MB, {progress.valid} of 400 valid")
    assert progress.valid > 0
    assert max(peaks) < 400.0
