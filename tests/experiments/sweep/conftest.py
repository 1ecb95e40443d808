"""Sweeps of tiny searches, carried out in this process unless a test is about the workers."""

import csv
import json

import pytest
from sweep_stand_ins import PACKAGING, Here

from armdesign import Settings, prepare, read_recording
from armdesign.experiments.sweep.run_sweep import run_sweep
from armdesign.experiments.sweep.sweep_plan import Sweep, common_settings


@pytest.fixture(scope="session")
def ask():
    """What a sweep is asked for, and its tasks: by default two algorithms, 4 joints and two seeds."""

    def make(recordings=(PACKAGING,), changes=None, **lists):
        settings = Settings().replace({"search": {"particles": 8, "iterations": 3}}).replace(changes or {})
        given = {"algorithms": ("pso", "rapso"), "dof": (4,), "seeds": (0, 1), "angle_intervals": (2,)} | lists
        tasks = {}
        for path in map(str, recordings):
            own = settings.replace({"task": {"recording": path}})
            for n in given["dof"]:
                tasks[path, n] = prepare(read_recording(path), own.replace({"design": {"dof": n}}))
        return Sweep(common_settings(settings), tuple(map(str, recordings)), **given), tasks

    return make


@pytest.fixture
def sweep_here():
    """Carry out a sweep in this process; gives the workers, or None where none had to be started."""

    def carry_out(folder, asked, capacity=1, **options):
        started = []

        def start_workers(units):
            started.append(Here(capacity))
            return started[0]

        run_sweep(folder, *asked, start_workers, **options)
        return started[0] if started else None

    return carry_out


@pytest.fixture(scope="session")
def rows_of():
    """The rows of a sweep.csv, without the times."""

    def read(folder):
        with (folder / "sweep.csv").open(encoding="utf-8", newline="") as stream:
            return [{k: v for k, v in row.items() if k != "wall_time"} for row in csv.DictReader(stream)]

    return read


@pytest.fixture(scope="session")
def files_of():
    """All files below a folder by name, without times, locks, and saved states, which hold times."""

    def read(folder):
        found = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
        for name, content in found.items():
            if name.endswith("result.json"):
                found[name] = {k: v for k, v in json.loads(content).items() if k != "wall_time"}
            if name.endswith("sweep.csv"):
                rows = list(csv.DictReader(content.decode().splitlines()))
                found[name] = [{k: v for k, v in row.items() if k != "wall_time"} for row in rows]
        return {name: content for name, content in found.items() if not name.endswith((".lock", ".npz"))}

    return read
