"""What holds for all tests."""

import os
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before NumPy: a worker has a core, its matrices are small

import pytest
from numba.core.caching import FunctionCache
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher

from armdesign.search.backends import processes

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None

NOT_AT_HAND = "the shared recordings are not at hand"
"""Why a test on a third-party recording is skipped in a plain clone: such recordings are not ours to ship."""

WITHOUT_KERNELS = {"demonstration", "settings", "swarm"}

# Byte code is kept, as kernels are: dozens of processes load the package, and that of the tests takes 10 s a worker
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)


def pytest_xdist_auto_num_workers(config):
    """One more than there are cores: a third of the time the tests wait for what other processes do."""
    return processes.available_cores() + 1


def pytest_collection_modifyitems(items):
    """What needs no compiled kernel comes first: workers do that while one compiles."""
    items.sort(key=lambda item: WITHOUT_KERNELS.isdisjoint(item.path.parts))


def pytest_addoption(parser):
    parser.addoption(
        "--fail-on-skip", action="store_true", help="a skipped test is a failure, but for one on a shared recording"
    )


def pytest_sessionfinish(session):
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if reporter is None or not session.config.getoption("--fail-on-skip"):
        return
    skipped = [report for report in reporter.stats.get("skipped", ()) if NOT_AT_HAND not in str(report.longrepr)]
    for report in skipped:
        reporter.write_line(f"SKIPPED, which is a failure here: {report.nodeid}: {report.longrepr}", red=True)
    if skipped and session.exitstatus == 0:
        session.exitstatus = 1


@pytest.fixture(autouse=True)
def quick_searches(request, monkeypatch):
    """Searches in this process write no preview and report, which take longer than a small search; unless marked."""
    if "views" not in request.keywords:
        monkeypatch.setattr("armdesign.views.writing.write_views", lambda *_: ())


@pytest.fixture(autouse=True, scope="session")
def kernels_compiled_once(tmp_path_factory):
    """Of the workers that need a kernel at the same time one compiles it; the others wait and load it from the disk."""
    locks = tmp_path_factory.getbasetemp()
    locks = locks if "PYTEST_XDIST_WORKER" not in os.environ else locks.parent
    compile_or_load = Dispatcher.compile

    def in_turn(kernel, signature):
        if fcntl is None or not isinstance(kernel._cache, FunctionCache):
            return compile_or_load(kernel, signature)
        with global_compiler_lock, (locks / f"{kernel.py_func.__name__}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            return compile_or_load(kernel, signature)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Dispatcher, "compile", in_turn)
        patch.setattr(
            processes, "PRELOADED", [*processes.PRELOADED, "armdesign.experiments.sweep", "scipy.interpolate"]
        )
        yield
