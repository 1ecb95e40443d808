"""The box, and what importing the swarm package loads."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from armdesign.errors import SettingsError
from armdesign.swarm import Box

ROOT = Path(__file__).resolve().parents[2]


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


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        (([0, 2], [1, 1], [False, False]), "entry 1 has lower bound 2 above upper bound 1"),
        (([0, np.nan], [1, 1], [False, False]), "entry 1 has 'lower' bound nan"),
        (([0, 0], [1, np.inf], [False, False]), "entry 1 has 'upper' bound inf"),
        (([0, 0], [1], [False, False]), "2, 1 and 2 entries"),
        (([0], [1], [1]), "'angular' does not hold flags"),
        (([0], [1], [[True], [False, True]]), "'angular' does not hold flags"),
        (([], [], []), "shape"),
        (([[0]], [1], [False]), "shape"),
        ((["low"], [1], [False]), "'lower' does not hold numbers"),
    ],
)
def test_box_names_the_bad_entry(columns, words):
    with pytest.raises(SettingsError, match=words):
        Box(*columns)


def test_importing_the_swarm_loads_no_robot_library():
    script = "import sys; sys.path.insert(0, sys.argv[1]); import armdesign.swarm; print(*sys.modules)"
    command = [sys.executable, "-c", script, str(ROOT)]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    roots = {name.split(".")[0] for name in loaded}
    assert "armdesign.swarm.pso" in loaded
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
