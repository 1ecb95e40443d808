"""The box, and what the swarm package may import."""

from __future__ import annotations

import ast
import dataclasses
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from armdesign.swarm import Box

ROOT = Path(__file__).resolve().parents[2]
SOURCES = sorted((ROOT / "armdesign" / "swarm").glob("*.py"))


def test_clip_gives_the_nearest_point_of_the_box():
    box = Box([0.0, -1.0, 2.0], [1.0, 1.0, 2.0], [False, True, False])
    X = np.array([[-3.0, 0.5, 7.0], [0.25, 9.0, 2.0]])
    kept = X.copy()
    assert np.array_equal(box.clip(X), [[0.0, 0.5, 2.0], [0.25, 1.0, 2.0]])
    assert np.array_equal(X, kept)
    assert np.array_equal(box.clip(box.clip(X)), box.clip(X))
    assert np.array_equal(box.clip(X[0]), box.clip(X)[0])


def test_width_and_dimension():
    box = Box([0, -1, 2], (1, 1, 2), np.array([False, True, False]))
    assert np.array_equal(box.width, [1.0, 2.0, 0.0])
    assert box.dimension == 3
    assert box.angular.dtype == bool


def test_box_keeps_its_own_columns():
    lower = np.zeros(2)
    box = Box(lower, np.ones(2), np.array([True, False]))
    lower[0] = 5.0
    assert box.lower[0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        box.lower[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        box.lower = lower


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_a_source_names_only_numpy_the_stdlib_and_the_errors(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0
            names = [str(node.module)]
        for name in names:
            own = name == "armdesign.errors" or name.startswith("armdesign.swarm")
            assert own or name.split(".")[0] in {"numpy", *sys.stdlib_module_names}, name


def test_importing_the_swarm_loads_no_robot_library():
    script = "import sys; sys.path.insert(0, sys.argv[1]); import armdesign.swarm; print(*sys.modules)"
    command = [sys.executable, "-c", script, str(ROOT)]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    roots = {name.split(".")[0] for name in loaded}
    assert "armdesign.swarm.rapso" in loaded
    assert not roots & {
        "pinocchio",
        "numba",
        "scipy",
        "meshcat",
        "yourdfpy",
        "typer",
        "matplotlib",
        "example_robot_data",
    }
    robots = ("kinematics", "fitness", "demonstration", "export", "cli")
    assert not [name for name in loaded if name.startswith(tuple(f"armdesign.{part}" for part in robots))]
