"""Compiled kernels on disk are those of the present source, wherever in the package it was changed."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

import armdesign
from armdesign.fitness.block import compilation_progress, compile_kernels
from armdesign.fitness.kernels.path import advance, exchange
from armdesign.fitness.kernels.path_slopes import slopes_along_paths
from armdesign.fitness.problem import make_problem
from armdesign.kinematics import compilation
from armdesign.kinematics.kernels.dls import multiply, squared_norm
from armdesign.settings import Fitness, Solver

PACKAGE = Path(armdesign.__file__).resolve().parent


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """A copy of the package's source that the stamp is taken of."""
    folder = tmp_path / "armdesign"
    shutil.copytree(PACKAGE, folder, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(compilation, "__file__", str(folder / "kinematics" / "compilation.py"))
    yield folder
    compilation.source_stamp.cache_clear()


def stamp():
    return compilation.source_stamp.__wrapped__()


def stamp_of_entries(path):
    compilation.source_stamp.cache_clear()
    return compilation.stamp_of(path)


def kernel_files():
    """Files in which something is compiled."""
    mark = re.compile(r"^@(leaf|branch|entry)\b", re.MULTILINE)
    return [
        path.relative_to(PACKAGE) for path in PACKAGE.rglob("*.py") if mark.search(path.read_text(encoding="utf-8"))
    ]


def small_problem():
    points = np.array([[[0.1, 0.0, 0.0], [0.3, 0.0, 0.0]]] * 3)
    return make_problem(points, None, 0.1, [[-3.0, 3.0]] * 3, Fitness(weights=(0.5, 0.5)), Solver())


def test_copy_has_the_stamp_of_the_original(copy):
    assert stamp() == compilation.source_stamp()


@pytest.mark.parametrize(
    "name", [*map(str, kernel_files()), "kinematics/compilation.py", "kinematics/inner_compiler.py"]
)
def test_any_change_to_a_kernel_s_source_changes_the_stamp(copy, name):
    path = copy / name
    before = stamp_of_entries(path)
    path.write_text(path.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert stamp_of_entries(path) != before


def test_moving_source_from_kernel_file_to_kernel_file_changes_the_stamp(copy):
    before = stamp()
    source, target = (copy / "fitness" / "kernels" / name for name in ("area.py", "area_slope.py"))
    text = source.read_text(encoding="utf-8")
    source.write_text("", encoding="utf-8")
    target.write_text(text + target.read_text(encoding="utf-8"), encoding="utf-8")
    assert stamp() != before


def test_stamp_of_another_numba_is_another(copy, monkeypatch):
    before = stamp()
    monkeypatch.setattr(numba, "__version__", "0.0.1")
    assert stamp() != before


def test_what_python_calls_is_cached_under_the_stamp():
    for kernel in (advance, exchange, slopes_along_paths):
        assert kernel._cache._cache_file._source_stamp == compilation.source_stamp()


@pytest.mark.parametrize("kind", [compilation.leaf, compilation.branch])
def test_every_kind_divides_as_numpy_does(kind):
    divide = kind(lambda x, y: x / y)
    assert numba.njit(**compilation.OPTIONS)(lambda x: divide(x, 0.0))(1.0) == np.inf


def test_inner_kernel_called_from_python_says_that_it_cannot_be():
    with pytest.raises(KeyError, match="squared_norm can be called by other kernels only"):
        squared_norm(np.ones(3), 3)


def test_progress_ends_with_everything_done_and_counts_all_kernels():
    seen = []
    with compilation_progress(lambda done, total: seen.append((done, total)), slopes=True):
        compile_kernels(small_problem(), slopes=True)
    done, totals = zip(*seen, strict=True)
    assert list(done) == sorted(done)
    assert set(totals) == {done[-1]}
    assert multiply in compilation.called_by(advance)
    assert multiply not in compilation.called_by(exchange)


LOAD_AN_ARM = """
import numpy as np
from armdesign.fitness.batch import Batch, CandidateQueue
from armdesign.fitness.kernels.path import exchange
from armdesign.fitness.problem import make_problem
from armdesign.fitness.slots import Slots
from armdesign.settings import Fitness, Solver
points = np.array([[[0.1, 0.0, 0.0], [0.3, 0.0, 0.0]]] * 3)
problem = make_problem(points, None, 0.1, [[-3.0, 3.0]] * 3, Fitness(weights=(0.5, 0.5)), Solver())
queue = CandidateQueue(Batch(np.full((1, 4, 4), 0.1), np.zeros(1), np.zeros(1)).whole())
Slots(1, 3).exchange(problem, queue.batch, queue.outcome, 0)
print(sum(exchange.stats.cache_hits.values()), sum(exchange.stats.cache_misses.values()))
"""


CALL_A_SMALL_ENTRY = """
from armdesign.fitness.kernels.small_entry import doubled
doubled(1.0)
print(sum(doubled.stats.cache_hits.values()), sum(doubled.stats.cache_misses.values()))
"""


def test_change_in_a_kernel_compiles_its_callers_anew(copy, monkeypatch):
    """Of an entry that takes next to nothing to compile, in one room, with a leaf in another."""
    monkeypatch.setenv("PYTHONPATH", str(copy.parent))
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    head = "from armdesign.kinematics.compilation import entry, leaf\n"
    inner = copy / "kinematics" / "kernels" / "small_leaf.py"
    inner.write_text(head + "@leaf\ndef twice(x):\n    return 2.0 * x\n", encoding="utf-8")
    text = (
        head
        + "from armdesign.kinematics.kernels.small_leaf import twice\n@entry\ndef doubled(x):\n    return twice(x)\n"
    )
    (copy / "fitness" / "kernels" / "small_entry.py").write_text(text, encoding="utf-8")

    def hits_and_misses():
        command = [sys.executable, "-c", CALL_A_SMALL_ENTRY]
        return subprocess.run(command, capture_output=True, text=True, check=True, cwd=copy.parent).stdout.split()

    assert hits_and_misses() == ["0", "1"]
    assert hits_and_misses() == ["1", "0"]
    inner.write_text(inner.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    assert hits_and_misses() == ["0", "1"]


@pytest.mark.slow  # for Numbas to come
def test_another_numba_inside_compiles_every_kernel_on_its_own(tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    without = "import sys; sys.modules['armdesign.kinematics.inner_compiler'] = None\n" + LOAD_AN_ARM
    run = subprocess.run([sys.executable, "-c", without], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["0", "1"]
