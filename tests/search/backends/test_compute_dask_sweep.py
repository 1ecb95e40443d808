"""A sweep on a Dask cluster leaves the folder of one carried out here."""

import csv
import json
import os
import signal
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from dask_processes import processes, until
from typer.testing import CliRunner

from armdesign import Settings, prepare, read_recording
from armdesign.cli import app
from armdesign.experiments.sweep import FuturesCrew, Sweep, run_sweep
from armdesign.experiments.sweep.dask_workers import DaskCrew
from armdesign.experiments.sweep.sweep_plan import common_settings
from armdesign.search.backends.dask_connection import connect

PACKAGING = Path(__file__).resolve().parents[3] / "examples" / "packaging.csv"


def asked(**search):
    settings = Settings().replace({"search": {"particles": 8, "iterations": 3} | search})
    path = str(PACKAGING)
    own = settings.replace({"task": {"recording": path}})
    tasks = {(path, n): prepare(read_recording(PACKAGING), own.replace({"design": {"dof": n}})) for n in (3, 4)}
    lists = {"algorithms": ("rapso",), "dof": (3, 4), "seeds": (0, 1), "angle_intervals": (2,)}
    return Sweep(common_settings(settings), (path,), **lists), tasks


def files_of(folder):
    """Everything in a sweep's folder, without times, locks, and saved states, which hold times."""
    found = {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    for name, content in found.items():
        if name.endswith("result.json"):
            found[name] = {k: v for k, v in json.loads(content).items() if k != "wall_time"}
        if name.endswith("sweep.csv"):
            found[name] = [row | {"wall_time": ""} for row in csv.DictReader(content.decode().splitlines())]
    return {name: content for name, content in found.items() if not name.endswith((".lock", ".npz"))}


@pytest.fixture(scope="module")
def carried_out_here(tmp_path_factory):
    """The files of the sweep, carried out in this process."""
    folder = tmp_path_factory.mktemp("here") / "sweep"
    with ThreadPoolExecutor(1) as executor:
        run_sweep(folder, *asked(), lambda units: FuturesCrew(executor, lambda: 1))
    return files_of(folder)


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    with processes(tmp_path_factory.mktemp("cluster")) as started:
        started.add_worker()
        started.add_worker()
        yield started


@pytest.fixture
def client(cluster):
    with connect(cluster.address) as connected:
        connected.wait_for_workers(2, timeout=60)
        yield connected


def test_a_sweep_on_a_cluster_leaves_the_folder_of_one_here(client, carried_out_here, tmp_path):
    run_sweep(tmp_path / "there", *asked(), lambda units: DaskCrew(client))
    assert files_of(tmp_path / "there") == carried_out_here


def test_the_command_carries_a_sweep_out_on_a_cluster(client, cluster, carried_out_here, tmp_path):
    folder = tmp_path / "there"
    sizes = ["--particles", "8", "--iterations", "3", "--dof", "3-4", "--seeds", "2"]
    command = ["sweep", str(PACKAGING), *sizes, "--out", str(folder)]
    done = CliRunner().invoke(app, [*command, "--cluster", cluster.address])
    assert done.exit_code == 1, "the arms of three joints have too few particles here to reach the start"
    assert files_of(folder).keys() == carried_out_here.keys()
    histories = [name for name in carried_out_here if name.endswith("history.csv")]
    assert len(histories) >= 2
    assert all(files_of(folder)[name] == carried_out_here[name] for name in histories)


def test_a_sweep_on_a_cluster_that_is_not_there_writes_nothing(tmp_path):
    done = CliRunner().invoke(
        app, ["sweep", str(PACKAGING), "--out", str(tmp_path / "sweep"), "--cluster", "tcp://127.0.0.1:9"]
    )
    assert done.exit_code == 2
    assert "no Dask scheduler answers" in done.stderr
    assert not (tmp_path / "sweep").exists()


def test_a_stopped_sweep_on_a_cluster_brings_its_states_home(client, tmp_path):
    longer, heard = asked(iterations=100_000), threading.Event()

    def stop_once_heard(standing):
        if not heard.is_set() and any(progress is not None for progress in standing.running.values()):
            heard.set()
            os.kill(os.getpid(), signal.SIGINT)

    folder = tmp_path / "sweep"
    ledger = run_sweep(folder, *longer, lambda units: DaskCrew(client), on_change=stop_once_heard)
    assert heard.is_set()
    assert {row["state"] for row in ledger.rows.values()} <= {"waiting", "interrupted"}
    assert len(list(folder.glob("*/state.npz"))) == 2


@pytest.mark.slow
def test_a_unit_goes_on_when_its_worker_is_killed(carried_out_here, tmp_path):
    with processes(tmp_path) as own:
        lost = own.add_worker()
        own.add_worker()
        with connect(own.address) as client:
            client.wait_for_workers(2, timeout=60)

            class Losing(DaskCrew):
                def take(self, place):
                    super().take(place)
                    if len(self.out) == 2:
                        until(self.client.call_stack)
                        lost.kill()

            run_sweep(tmp_path / "there", *asked(), lambda units: Losing(client))
    assert files_of(tmp_path / "there") == carried_out_here
