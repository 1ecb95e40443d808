"""The contract of the workers: every job has its end, whatever becomes of the processes."""

import multiprocessing
import os
import signal
import sys
import time

import numpy as np
import pytest
from dask_processes import processes
from light_workers import light, never_starts

from armdesign.errors import DesignError, SearchError
from armdesign.search.backends.processes import GRACE, WorkerProcesses, end_of
from armdesign.search.backends.workers import Job

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """A client of a cluster of two worker processes, which a nanny replaces when they die."""
    pytest.importorskip("distributed")
    from armdesign.search.backends.dask_connection import connect  # noqa: PLC0415

    settings = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1"}
    with processes(tmp_path_factory.mktemp("cluster"), **settings) as started:
        started.start_worker("--nworkers", 2, "--nthreads", 1)
        with connect(started.address) as connected:
            connected.wait_for_workers(2, timeout=60)
            yield connected


@pytest.fixture(scope="module", params=["processes", "dask"])
def workers(request):
    """Two workers, shared by the tests: each leaves them with nothing at hand."""
    if request.param == "processes":
        with WorkerProcesses(2, light) as pool:
            yield pool
    else:
        client = request.getfixturevalue("client")
        from armdesign.search.backends.dask_workers import DaskWorkers  # noqa: PLC0415

        with DaskWorkers(client, light) as pool:
            yield pool


@pytest.fixture
def two():
    """Two fresh worker processes."""
    with WorkerProcesses(2, light) as pool:
        yield pool


def test_workers_have_started_when_each_has_answered_and_a_fresh_one_has_not(two):
    assert not two.started()
    done(two, *[("value", k) for k in range(8)])
    assert two.started()
    two.begin(Job(("sleep", 60.0)))
    two.drop()
    assert not two.started()


def done(workers, *contents):
    """How jobs with such contents have ended, in their order, and all reports."""
    jobs, events, begun = [Job(content) for content in contents], [], 0
    deadline = time.monotonic() + 60.0
    while sum(event.is_end for event in events) < len(jobs):
        assert time.monotonic() < deadline
        while begun < len(jobs) and workers.room() > 0:
            workers.begin(jobs[begun])
            begun += 1
        events += workers.wait(1.0)
    ends = {event.job: event for event in events if event.is_end}
    assert len(ends) == len(jobs) == sum(event.is_end for event in events)
    return [ends[job] for job in jobs], [event for event in events if not event.is_end]


def test_every_job_has_its_answer(workers):
    ends, _ = done(workers, *[("square", k) for k in range(9)])
    assert [(end.kind, end.content) for end in ends] == [("answer", k**2) for k in range(9)]
    assert workers.room() == 2


def test_contents_and_answers_may_be_larger_than_a_pipe_holds(workers):
    large = np.arange(500_000.0)
    (end,), _ = done(workers, ("square", large))
    assert np.array_equal(end.content, large**2)


def test_an_error_for_bad_input_is_handed_on_and_the_worker_goes_on(workers):
    ends, _ = done(workers, ("raise", 8), ("square", 3), ("square", 4))
    assert ends[0].kind == "error"
    assert isinstance(ends[0].content, DesignError)
    assert ends[0].content.value == 8
    assert [end.content for end in ends[1:]] == [9, 16]


def test_a_job_whose_worker_dies_is_done_again(workers, tmp_path):
    fuse = tmp_path / "fuse"
    fuse.touch()
    ends, _ = done(workers, ("die once", str(fuse)), ("square", 2))
    assert not fuse.exists()
    assert [end.kind for end in ends] == ["answer", "answer"]


def test_a_job_that_kills_its_workers_is_given_up_and_the_others_go_on(workers):
    ends, _ = done(workers, ("die",), *[("square", k) for k in range(4)])
    assert ends[0].kind == "given up"
    assert ends[0].job.deaths >= 2
    assert [end.content for end in ends[1:]] == [0, 1, 4, 9]


def test_dropped_jobs_are_heard_of_no_more(workers):
    for _ in range(workers.room()):
        workers.begin(Job(("sleep", 0.3)))
    workers.drop()
    (end,), reports = done(workers, ("square", 5))
    assert (end.content, reports) == (25, [])


def test_jobs_asked_to_stop_report_and_have_their_end(request):
    client = request.getfixturevalue("client")
    from armdesign.search.backends.dask_workers import DaskWorkers  # noqa: PLC0415

    for pool in (WorkerProcesses(2, light), DaskWorkers(client, light)):
        with pool:
            jobs, events = [Job(("until stopped",)) for _ in range(2)], []
            for job in jobs:
                pool.begin(job)
            while not any(event.kind == "report" for event in events):
                events += pool.wait(1.0)
            pool.interrupt()
            while sum(event.is_end for event in events) < 2:
                events += pool.wait(1.0)
            assert {event.content for event in events if event.is_end} == {"stopped"}


# Processes on this machine


def test_a_worker_that_died_idle_is_replaced_and_no_job_is_blamed(two):
    gone = two.pids
    done(two, ("square", 1), ("square", 2))
    for pid in gone:
        os.kill(pid, signal.SIGKILL)
    for process in multiprocessing.active_children():
        if process.pid in gone:
            process.join()
    (end,), _ = done(two, ("square", 3))
    assert (end.content, end.job.deaths) == (9, 0)
    assert len(set(gone) & set(two.pids)) == 1


def test_kills_at_random_moments_lose_no_job(two):
    rng, events = np.random.default_rng(5), []
    jobs = [Job(("sleep", 0.05), limit=100) for _ in range(12)]
    waiting, killed = list(jobs), 0
    while sum(event.is_end for event in events) < len(jobs):
        while waiting and two.room():
            two.begin(waiting.pop())
        if killed < 4 and rng.random() < 0.3:
            os.kill(two.pids[rng.integers(2)], signal.SIGKILL)
            killed += 1
        events += two.wait(0.02)
    assert {event.job for event in events} == set(jobs)
    assert len(set(two.pids)) == 2


def test_workers_ignore_ctrl_c_from_their_first_moment(two):
    before = two.pids
    for pid in before:
        os.kill(pid, signal.SIGINT)
    done(two, ("square", 1), ("square", 2))
    assert two.pids == before
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_workers_that_do_not_start_end_the_work_with_a_sentence():
    ended = pytest.raises(SearchError, match=r"5 worker processes in a row .* with exit code 3.*__main__")
    with WorkerProcesses(1, never_starts) as pool, ended:
        done(pool, ("square", 1))


def test_closing_ends_busy_workers_soon_however_many_there_are():
    pool = WorkerProcesses(4, light)
    done(pool, *[("square", k) for k in range(4)])
    for _ in range(3):
        pool.begin(Job(("sleep", 600.0)))
    mine, began = set(pool.pids), time.monotonic()
    pool.close()
    assert time.monotonic() - began < 4 * GRACE
    assert not mine & {process.pid for process in multiprocessing.active_children()}


@pytest.mark.parametrize(
    ("code", "words"),
    [(3, "with exit code 3"), (-9, "by SIGKILL (perhaps for want of memory)"), (-15, "by SIGTERM"), (-99, "signal 99")],
)
def test_the_end_of_a_process_in_words(code, words):
    assert words in end_of(code)
