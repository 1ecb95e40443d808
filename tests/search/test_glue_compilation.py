"""Compiled kernels on disk are those of the present source, wherever in the package it was changed."""

import re
import shutil
from pathlib import Path

import numba
import pytest

import armdesign
from armdesign.fitness.kernels.path import advance, exchange
from armdesign.kinematics import compilation

PACKAGE = Path(armdesign.__file__).resolve().parent


@pytest.fixture
def copy(tmp_path, monkeypatch):
    """A copy of the package's source that the stamp is taken of."""
    folder = tmp_path / "armdesign"
    shutil.copytree(PACKAGE, folder, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(compilation, "__file__", str(folder / "compilation.py"))
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


def test_copy_has_the_stamp_of_the_original(copy):
    assert stamp() == compilation.source_stamp()


@pytest.mark.parametrize("name", [*map(str, kernel_files()), "compilation.py"])
def test_any_change_to_a_kernel_s_source_changes_the_stamp(copy, name):
    path = copy / name
    before = stamp_of_entries(path)
    path.write_text(path.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert stamp_of_entries(path) != before


def test_moving_source_from_file_to_file_changes_the_stamp(copy):
    before = stamp()
    (copy / "kinematics" / "dh.py").rename(copy / "kinematics" / "dh_moved.py")
    assert stamp() != before


def test_stamp_of_another_numba_is_another(copy, monkeypatch):
    before = stamp()
    monkeypatch.setattr(numba, "__version__", "0.0.1")
    assert stamp() != before


def test_what_python_calls_is_cached_under_the_stamp():
    for kernel in (advance, exchange):
        assert kernel._cache._cache_file._source_stamp == compilation.source_stamp()


def test_options_hold_for_every_kind():
    for kind in (compilation.leaf, compilation.branch):
        divide = kind(lambda x, y: x / y)
        assert divide(1.0, 0.0) == float("inf")  # NumPy's division, which can be vectorised
    assert compilation.entry.__doc__


KERNELS = """
import sys, time
import numpy as np
from armdesign.fitness.evaluator import compile_kernels
from armdesign.fitness.path import advance
from armdesign.fitness.problem import make_problem
from armdesign.settings import Fitness, Solver
P = np.array([[[0.1, 0.0, 0.0], [0.3, 0.0, 0.0]]] * 3)
problem = make_problem(P, None, 0.1, [[-3.0, 3.0]] * 3, Fitness(weights=(0.5, 0.5)), Solver())
compile_kernels(problem)
stats = advance.stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
"""


@pytest.mark.slow
def test_change_in_a_leaf_compiles_its_callers_anew(copy, process):
    code = f"import sys; sys.path.insert(0, {str(copy.parent)!r})\n{KERNELS}"

    def hits_and_misses():
        outcome = process(code)
        assert outcome.returncode == 0, outcome.stderr
        return outcome.stdout.split()

    assert hits_and_misses() == ["0", "1"]
    assert hits_and_misses() == ["1", "0"]
    leaf = copy / "kinematics" / "skeleton.py"
    leaf.write_text(leaf.read_text(encoding="utf-8") + "\n# changed\n", encoding="utf-8")
    assert hits_and_misses() == ["0", "1"]
