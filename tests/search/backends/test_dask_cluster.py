"""What becomes of a search on a Dask cluster when workers, the scheduler or the user end; see also test_backends."""

import os
import signal
import socket
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dask_processes import processes, until
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.demonstration import read_recording
from armdesign.errors import SearchError
from armdesign.runs.reading import read_problem
from armdesign.runs.resumable import carry_out, start_run
from armdesign.search.backends.backend import InProcess
from armdesign.search.backends.dask_connection import check_address, connect
from armdesign.search.backends.dask_workers import DaskCluster
from armdesign.search.backends.parallel import CandidateKillsWorkersError
from armdesign.search.prepare import prepare
from armdesign.settings.sections import Settings

PACKAGING = Path(__file__).resolve().parents[3] / "examples" / "packaging.csv"
SMALL = ("--particles", "24", "--iterations", "6")


@pytest.fixture(scope="module")
def prepared():
    return prepare(read_recording(PACKAGING), Settings().replace({"search": {"particles": 24, "iterations": 6}}))


@pytest.fixture(scope="module")
def generation(prepared):
    """Designs and their scores in one process."""
    Phi = prepared.space.sample(np.random.default_rng(5), 60)
    return Phi, np.full(60, np.inf), InProcess(prepared).evaluate(Phi, np.full(60, np.inf))


@pytest.fixture
def client(cluster):
    with connect(cluster.address) as connected:
        connected.wait_for_workers(2, timeout=60)
        yield connected


def same(one, other):
    scores, removed = one
    others, others_removed = other
    equal = [np.array_equal(values, getattr(others, name), equal_nan=True) for name, values in vars(scores).items()]
    return all(equal) and removed == others_removed


def search(*args):
    return CliRunner().invoke(app, ["search", *map(str, args)])


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """The history of the small search in one process."""
    folder = tmp_path_factory.mktemp("alone") / "run"
    outcome = search(PACKAGING, *SMALL, "--workers", 1, "--out", folder)
    assert outcome.exit_code == 0, outcome.output
    return (folder / "history.csv").read_bytes()


def test_the_task_leaves_the_workers_with_the_backend(client, prepared):
    def held(dask_worker):
        return [name for name in dask_worker.plugins if name.startswith("armdesign")]

    with DaskCluster(client, prepared) as backend:
        assert list(client.run(held).values()) == [[backend.workers.name]] * 2
    assert list(client.run(held).values()) == [[], []]


def test_the_command_gives_the_history_of_one_process(cluster, alone, tmp_path):
    outcome = search(PACKAGING, *SMALL, "--cluster", cluster.address, "--out", tmp_path / "run")
    assert outcome.exit_code == 0, outcome.output
    assert (tmp_path / "run" / "history.csv").read_bytes() == alone


class Meddling(DaskCluster):
    """Does something to the cluster when the third generation is under way."""

    def __init__(self, *args, meddle, **kwargs):
        super().__init__(*args, **kwargs)
        self.meddle, self.generations = meddle, 0

    def evaluate(self, *args, **kwargs):
        self.generations += 1
        self.workers.wait = self.meddled if self.generations == 3 else type(self.workers).wait.__get__(self.workers)
        return super().evaluate(*args, **kwargs)

    def meddled(self, timeout):
        self.workers.wait = type(self.workers).wait.__get__(self.workers)
        self.meddle()
        return self.workers.wait(timeout)


SLOW = """
import time
from armdesign.search.backends import backend

class Slow(backend.InProcess):
    def evaluate(self, Phi, cutoff, poses=None, **others):
        time.sleep(0.2)
        return super().evaluate(Phi, cutoff, poses, **others)

def dask_setup(worker):
    from armdesign.search.backends import parallel
    parallel.InProcess = Slow
"""


def test_a_worker_killed_midway_changes_nothing_and_a_late_one_joins(
    prepared, alone, generation, tmp_path, monkeypatch
):
    monkeypatch.setattr("armdesign.search.backends.parallel.LOOK_EVERY", 0.3)
    heard = []
    (tmp_path / "slow.py").write_text(SLOW)
    folder = tmp_path / "run"
    folder.mkdir()
    start_run(folder, prepared)
    with processes(tmp_path) as own:
        lost = own.add_worker(1, "--preload", tmp_path / "slow.py")
        own.add_worker()
        with connect(own.address) as client:
            client.wait_for_workers(2, timeout=60)
            (address,) = (at for at, pid in client.run(os.getpid).items() if pid == lost.pid)

            def kill_at_work():
                until(lambda: address in client.call_stack())
                lost.kill()

            with Meddling(client, prepared, meddle=kill_at_work, say=heard.append) as backend:
                carry_out(folder, prepared, backend)
                assert len(client.nthreads()) == 1
                own.workers[1].kill()
                until(lambda: not client.nthreads())
                own.add_worker()
                Phi, cutoff, expected = generation
                assert same(backend.evaluate(Phi, cutoff), expected)
    assert (folder / "history.csv").read_bytes() == alone
    assert heard == ["The cluster has no workers left; waiting for new ones."]


@pytest.mark.slow
def test_workers_killed_again_and_again_change_nothing(prepared, tmp_path):
    longer = replace(prepared, settings=prepared.settings.replace({"search": {"particles": 100, "iterations": 150}}))
    folders = tmp_path / "alone", tmp_path / "killed"
    for folder in folders:
        folder.mkdir()
        start_run(folder, longer)
    carry_out(folders[0], longer, InProcess(longer))
    rng, kills, done = np.random.default_rng(0), [], threading.Event()
    with processes(tmp_path) as own:
        own.start_worker("--nworkers", 3, "--nthreads", 1)
        with connect(own.address) as client, connect(own.address) as observer:
            client.wait_for_workers(3, timeout=60)

            def kill_now_and_then():
                while len(kills) < 8 and not done.wait(rng.uniform(1.0, 4.0)):
                    for pid in list(observer.run(os.getpid, on_error="ignore").values())[:1]:
                        os.kill(pid, signal.SIGKILL)
                        kills.append(pid)

            killer = threading.Thread(target=kill_now_and_then)
            killer.start()
            with DaskCluster(client, longer) as backend:
                carry_out(folders[1], longer, backend)
            done.set()
            killer.join()
    assert len(kills) > 3
    histories = [(folder / "history.csv").read_bytes() for folder in folders]
    assert histories[0] == histories[1]


def test_ctrl_c_finishes_the_iteration_and_the_run_goes_on_elsewhere(client, prepared, alone, tmp_path):
    start_run(tmp_path, prepared)
    with Meddling(client, prepared, meddle=lambda: os.kill(os.getpid(), signal.SIGINT)) as backend:
        result, _ = carry_out(tmp_path, prepared, backend)
    assert result.facts.stopped_by == "interrupted"
    assert len(result.history.best) == 3
    again = read_problem(tmp_path)
    with InProcess(again) as backend:
        carry_out(tmp_path, again, backend)
    assert (tmp_path / "history.csv").read_bytes() == alone


# What goes wrong


KILLER = """
import os
from armdesign.search.backends import backend

class Killed(backend.InProcess):
    def evaluate(self, Phi, cutoff, poses=None, **others):
        return os._exit(1) if ENTRY in Phi[:, 0] else super().evaluate(Phi, cutoff, poses, **others)

def dask_setup(worker):
    from armdesign.search.backends import parallel
    parallel.InProcess = Killed
"""


@pytest.mark.slow  # test_backends shows it with workers that play dead, test_workers that a cluster tells of deaths
def test_a_candidate_that_kills_workers_is_named(prepared, tmp_path):
    Phi = prepared.space.sample(np.random.default_rng(1), 12)
    (tmp_path / "killer.py").write_text(KILLER.replace("ENTRY", repr(float(Phi[7, 0]))))
    with processes(tmp_path, DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0") as own:
        for _ in range(3):
            own.add_worker(1, "--preload", tmp_path / "killer.py")
        with connect(own.address) as client:
            client.wait_for_workers(3, timeout=60)
            killed = pytest.raises(CandidateKillsWorkersError, match="has killed 1 worker processes")
            with DaskCluster(client, prepared) as backend, killed as caught:
                backend.evaluate(Phi, np.full(12, np.inf))
    assert np.array_equal(caught.value.value, Phi[7])


def test_a_scheduler_without_workers_is_waited_for_and_a_lost_one_is_said(prepared, generation, tmp_path):
    Phi, cutoff, _ = generation
    heard = []
    with processes(tmp_path) as own:

        def say(sentence):
            heard.append(sentence)
            own.add_worker()

        with connect(own.address, timeout=2.0, say=say) as client, DaskCluster(client, prepared) as backend:
            assert len(client.nthreads()) == 1
            own.scheduler.kill()
            with pytest.raises(SearchError, match=f"lost the Dask scheduler at {own.address}.*--resume"):
                backend.evaluate(Phi, cutoff)
    assert heard == [f"The scheduler {own.address} has no workers yet; waiting for the first."]


@pytest.mark.parametrize("address", ["nonsense", "tcp://127.0.0.1", "smoke://127.0.0.1:8786"])
def test_an_address_that_is_none_is_refused(address, tmp_path):
    outcome = search(PACKAGING, *SMALL, "--cluster", address, "--out", tmp_path / "run")
    assert outcome.exit_code == 2
    assert outcome.output.splitlines()[-1].startswith(f"armdesign: '{address}' is no address of a Dask scheduler")


def test_a_wrong_address_ends_the_command_with_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr(check_address, "__defaults__", (1.0,))
    with socket.socket() as silent:  # bound, but not listening
        silent.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{silent.getsockname()[1]}"
        outcome = search(PACKAGING, *SMALL, "--cluster", address, "--out", tmp_path / "run")
    assert outcome.exit_code == 2
    sentence = f"armdesign: no Dask scheduler answers at {address} within 1 s. Check the address"
    assert outcome.output.splitlines()[-1].startswith(sentence)
    assert not (tmp_path / "run").exists()


def test_a_listener_that_never_speaks_is_no_scheduler():
    with socket.socket() as mute:
        mute.bind(("127.0.0.1", 0))
        mute.listen()
        with pytest.raises(SearchError, match="no Dask scheduler answers"):
            connect(f"tcp://127.0.0.1:{mute.getsockname()[1]}", timeout=0.5)


def test_a_worker_is_no_scheduler(client):
    with pytest.raises(SearchError, match="a Dask worker answers at"):
        connect(next(iter(client.nthreads())))


def test_workers_of_another_version_are_refused(cluster, client, prepared, generation, monkeypatch):
    monkeypatch.setattr("armdesign.search.backends.dask_connection.__version__", "9.9")
    with pytest.raises(SearchError, match=r"this is armdesign 9\.9"):
        connect(cluster.address)
    with DaskCluster(client, prepared) as backend, pytest.raises(SearchError, match=r"this is armdesign 9\.9"):
        backend.evaluate(*generation[:2])


def test_workers_and_a_cluster_are_not_both_taken(tmp_path):
    outcome = search(PACKAGING, *SMALL, "--cluster", "tcp://127.0.0.1:8786", "--workers", 2, "--out", tmp_path / "run")
    assert outcome.exit_code == 2
    assert "--workers and --cluster" in outcome.output
