"""Arms on tasks: those of the examples that follow it, and any arm at any angles."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from armdesign.demonstration import read_recording
from armdesign.demonstration.task import Task
from armdesign.fitness.block import BlockEvaluator
from armdesign.kinematics.dh import DHTable
from armdesign.search.design_problem import Demonstration, DesignProblem
from armdesign.search.evaluation import Evaluation, PathEvaluation, evaluate_design
from armdesign.search.prepare import prepare
from armdesign.search.result import Result
from armdesign.settings.sections import Settings

ROOT = Path(__file__).resolve().parents[3]
TABLES = {
    "packaging": [(-1.57, 0.0, 0.0), (0.86, 0.074, 0.0), (0.364, 0.382, 0.071), (-0.94, 0.0, 0.1)],
    "welding": [
        (-0.1, 0.0, 0.0),
        (1.57, 0.0, 0.0),
        (-1.57, 0.168, 0.0),
        (-1.57, 0.109, 0.292),
        (0.7, 0.0, 0.01),
        (1.57, 0.0, 0.1),
    ],
}
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--headless",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--no-first-run",
    "--hide-scrollbars",
    "--enable-logging=stderr",
    "--window-size=640,480",
    "--virtual-time-budget=1000",
    "--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1",
)


@pytest.fixture(scope="session")
def example_runs():
    """Both examples with an arm each that follows them."""
    runs = {}
    for name, rows in TABLES.items():
        table = DHTable.from_rows(rows)
        changes = {"design": {"dof": table.dof}, "fitness": {"scenario": name}}
        problem = prepare(read_recording(ROOT / "examples" / f"{name}.csv"), Settings().replace(changes))
        runs[name] = Result(problem, evaluate_design(table, problem), name=name)
    return runs


@pytest.fixture(scope="session")
def any_run():
    """A run of a random arm at random angles that change smoothly, good or not."""

    def make(seed, dof, points=3, frames=40, duration=2.0, name="any", oriented=False):
        rng = np.random.default_rng(seed)
        rows = np.c_[rng.uniform(-1.5, 1.5, dof + 1), rng.uniform(0.0, 0.3, (dof + 1, 2)), rng.uniform(-1, 1, dof + 1)]
        rows[rng.integers(dof + 1), 1:3] = 0.0
        table = DHTable.from_rows(rows, base_yaw=rng.uniform(-1, 1))
        time = 3.0 + np.linspace(0.0, duration, frames)
        waves = np.sin(np.outer(time, rng.uniform(0.5, 3.0, dof)) + rng.uniform(0.0, 6.0, dof))
        P = rng.normal(0.0, 0.2, (points, 3)) + 0.1 * np.sin(time)[:, None, None]
        half = 0.3 * np.sin(time)
        turns = np.stack([np.sin(half), 0 * half, 0 * half, np.cos(half)], axis=1) if oriented else None
        task = Task(time, P, None, turns, tuple(f"p{i}" for i in range(points)), "base")
        weights = tuple(np.ones(points) / points)
        settings = Settings().replace(
            {"design": {"dof": dof}, "fitness": {"weights": weights, "orientation_weight": 0.0}}
        )
        problem = DesignProblem(settings, (Demonstration(settings, task),))
        q = 2.5 * waves
        path = BlockEvaluator(problem.path_problem, block=1).replay(table, q, np.eye(3))
        evaluation = Evaluation(table, 1.0, 0.1, 0.1, (PathEvaluation(1.0, 0.1, 0.1, path),))
        return Result(problem, evaluation, name=name)

    return make


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    """Call a headless Chromium on an address: (standard output, what it logged)."""
    command = next(filter(None, map(shutil.which, BROWSERS)), None)
    if command is None:
        pytest.skip("no Chromium here")

    profile = tmp_path_factory.mktemp("profile")

    def call(address, *flags):
        done = subprocess.run(
            [command, *FLAGS, f"--user-data-dir={profile}", *flags, address],
            capture_output=True, text=True, check=False, timeout=120,
        )  # fmt: skip
        return done.stdout, done.stderr

    return call
