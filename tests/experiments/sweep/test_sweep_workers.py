"""Who carries out the units changes nothing; the units survive the death of their processes."""

import os
import signal
import sys
import threading
from pathlib import Path

import pytest
from sweep_stand_ins import PACKAGING, Here
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.errors import SearchError
from armdesign.experiments.sweep.run_sweep import outcome_of, run_sweep
from armdesign.experiments.sweep.sweep_plan import units_of
from armdesign.experiments.sweep.sweep_store import settle
from armdesign.experiments.sweep.units import UnitJob, begin_unit, carry_out_unit, unit_worker
from armdesign.runs.resumable import finished
from armdesign.search.backends.processes import WorkerProcesses
from armdesign.search.backends.workers import Event, Job

sys.path.append(str(Path(__file__).resolve().parents[2] / "search" / "backends"))
from dask_processes import processes, until

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")
LONG = {"search": {"iterations": 100_000, "particles": 8}}


@pytest.fixture(scope="module")
def asked(ask):
    return ask(dof=(2, 4), seeds=(0,))


@pytest.fixture(scope="module")
def whole(asked, tmp_path_factory):
    """An undisturbed sweep, one unit after the other in this process."""
    folder = tmp_path_factory.mktemp("whole")
    run_sweep(folder, *asked, lambda units: Here())
    return folder


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """A client of a cluster of two workers with one thread each."""
    pytest.importorskip("distributed")
    from armdesign.search.backends.dask_connection import connect  # noqa: PLC0415

    with processes(tmp_path_factory.mktemp("cluster")) as started:
        started.add_worker()
        started.add_worker()
        with connect(started.address) as connected:
            connected.wait_for_workers(2, timeout=60)
            yield connected


@pytest.fixture(params=["elsewhere", "2 processes", "dask"])
def start_workers(request):
    if request.param == "elsewhere":
        return lambda units: Here(2, share_disk=False)
    if request.param == "dask":
        client = request.getfixturevalue("client")
        from armdesign.search.backends.dask_workers import DaskWorkers  # noqa: PLC0415

        return lambda units: DaskWorkers(client, unit_worker)
    return lambda units: WorkerProcesses(2, unit_worker)


@pytest.fixture(scope="module")
def one_process():
    """A worker process, replaced where a test kills it."""
    with WorkerProcesses(1, unit_worker) as workers:
        yield workers


def begun(folder, asked):
    """The jobs of a sweep's units, ready to be carried out."""
    folder.mkdir()
    settle(folder, *asked)
    return [Job(UnitJob(begin_unit(folder, unit))) for unit in units_of(*asked)]


def end(workers, job, on_report=None):
    """The outcome of a unit; calls back whenever there is progress."""
    workers.begin(job)
    while True:
        for event in workers.wait(10.0):
            if event.is_end:
                return outcome_of(event)
            if on_report is not None:
                on_report(event)


def test_who_carries_out_the_units_does_not_show_in_the_folder(asked, whole, files_of, tmp_path, start_workers):
    told = []
    run_sweep(tmp_path, *asked, start_workers, on_change=told.append)
    assert 1 <= max(len(status.running) for status in told) <= 2
    assert [status.finished + status.failed for status in told if status.ended] == [1, 2, 3, 4]
    assert files_of(tmp_path) == files_of(whole)


@pytest.mark.parametrize("start_workers", ["2 processes", "dask"], indirect=True)
def test_first_ctrl_c_keeps_the_states_of_the_runs_under_way(ask, tmp_path, start_workers):
    asked, heard = ask(seeds=(0, 1), algorithms=("pso",), changes=LONG), threading.Event()

    def stop_once_heard(status):
        if not heard.is_set() and any(progress is not None for progress in status.running.values()):
            heard.set()
            os.kill(os.getpid(), signal.SIGINT)

    table = run_sweep(tmp_path, *asked, start_workers, on_change=stop_once_heard)
    assert {row["state"] for row in table.rows.values()} <= {"waiting", "interrupted"}
    assert not any(finished(tmp_path / name) for name in table.rows)
    assert list(tmp_path.glob("*/state.npz"))


@pytest.mark.parametrize(
    ("event", "state", "reason"),
    [
        (("given up", "by SIGKILL"), "failed", "its process died 3 times, the last time by SIGKILL"),
        (("given up", ""), "failed", "its process died 3 times"),
        (("error", TypeError("no good")), "failed", "TypeError: no good"),
        (("error", SearchError("nothing found")), "failed", "nothing found"),
    ],
)
def test_ends_of_jobs_become_outcomes_in_words(event, state, reason):
    outcome = outcome_of(Event(Job(None, deaths=3), *event))
    assert (outcome.state, outcome.reason) == (state, reason)


def test_unit_of_a_killed_process_goes_on_in_a_fresh_one(ask, files_of, tmp_path, one_process):
    workers = one_process
    asked = ask(seeds=(0,), algorithms=("rapso",), changes={"search": {"iterations": 30}})
    (job,) = begun(tmp_path / "killed", asked)
    killed = []

    def kill(event):
        if not killed:
            killed.extend(workers.pids)
            os.kill(killed[0], signal.SIGKILL)

    assert end(workers, job, kill).state == "finished"
    assert workers.pids != killed
    (undisturbed,) = begun(tmp_path / "undisturbed", asked)
    assert carry_out_unit(undisturbed.content).state == "finished"
    assert files_of(job.content.place) == files_of(undisturbed.content.place)


def test_unit_whose_process_dies_too_often_has_failed_and_the_worker_goes_on(ask, tmp_path, one_process):
    workers = one_process
    (deadly,) = begun(tmp_path / "deadly", ask(seeds=(0,), algorithms=("pso",), changes=LONG))
    (harmless,) = begun(tmp_path / "harmless", ask(seeds=(0,), algorithms=("pso",)))
    deadly.limit, deaths = 2, []

    def kill(event):
        if workers.pids[0] not in deaths:
            deaths.append(workers.pids[0])
            os.kill(deaths[-1], signal.SIGKILL)

    outcome = end(workers, deadly, kill)
    assert (outcome.state, len(deaths)) == ("failed", 2)
    assert outcome.reason.startswith("its process died 2 times, the last time by SIGKILL")
    assert end(workers, harmless).state == "finished"
    assert not finished(deadly.content.place)


def test_interrupted_unit_leaves_a_result_and_a_state(ask, tmp_path):
    (job,) = begun(tmp_path / "sweep", ask(seeds=(0,), algorithms=("pso",), changes=LONG))
    with WorkerProcesses(1, unit_worker) as workers:
        assert end(workers, job, lambda event: workers.interrupt()).state == "interrupted"
    place = job.content.place
    assert (place / "result.json").exists()
    assert (place / "state.npz").exists()
    assert not finished(place)


def test_the_command_carries_a_sweep_out_on_a_cluster(client, tmp_path):
    sizes = ["--particles", "8", "--iterations", "3", "--dof", "2,4", "--algorithm", "rapso"]
    command = ["sweep", str(PACKAGING), *sizes, "--out", str(tmp_path / "there")]
    done = CliRunner().invoke(app, [*command, "--cluster", client.scheduler.address])
    assert done.exit_code == 1, "the arms of two joints do not reach the start"
    assert len(list(tmp_path.glob("there/*/history.csv"))) == 1


def test_a_sweep_on_a_cluster_that_is_not_there_writes_nothing(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    from armdesign.search.backends.dask_connection import check_address  # noqa: PLC0415

    monkeypatch.setattr(check_address, "__defaults__", (1.0,))
    done = CliRunner().invoke(
        app, ["sweep", str(PACKAGING), "--out", str(tmp_path / "sweep"), "--cluster", "tcp://127.0.0.1:9"]
    )
    assert done.exit_code == 2
    assert "no Dask scheduler answers" in done.stderr
    assert not (tmp_path / "sweep").exists()


@pytest.mark.slow
def test_a_unit_goes_on_when_its_worker_of_a_cluster_is_killed(asked, whole, files_of, tmp_path):
    pytest.importorskip("distributed")
    from armdesign.search.backends.dask_connection import connect  # noqa: PLC0415
    from armdesign.search.backends.dask_workers import DaskWorkers  # noqa: PLC0415

    with processes(tmp_path) as own:
        lost = own.add_worker()
        own.add_worker()
        with connect(own.address) as client:
            client.wait_for_workers(2, timeout=60)

            class Losing(DaskWorkers):
                def begin(self, job):
                    super().begin(job)
                    if len(self.at_hand) == 2:
                        until(self.client.call_stack)
                        lost.kill()

            run_sweep(tmp_path / "there", *asked, lambda units: Losing(client, unit_worker))
    assert files_of(tmp_path / "there") == files_of(whole)
