"""The contract of the backends: the same bits in this process, on one or two worker processes, and on a cluster."""

import os
import signal

import numpy as np
import pytest

from armdesign.errors import DesignError
from armdesign.fitness.robot import Generation
from armdesign.search.backends import parallel
from armdesign.search.backends.backend import InProcess
from armdesign.search.backends.parallel import (
    LONGEST,
    CandidateKillsWorkersError,
    ParallelBackend,
    WorkerPool,
    cut,
    evaluator,
)
from armdesign.search.backends.workers import Event, JobContext
from armdesign.search.search import Search


@pytest.fixture(scope="module", params=["in process", "1 worker", "2 workers", "dask"])
def backend(request, prepared):
    if request.param == "in process":
        with InProcess(prepared, block=5) as here:
            yield here
    elif request.param == "dask":
        pytest.importorskip("distributed")
        from armdesign.search.backends.dask_connection import connect  # noqa: PLC0415
        from armdesign.search.backends.dask_workers import DaskCluster  # noqa: PLC0415

        with connect(request.getfixturevalue("cluster").address) as client:
            client.wait_for_workers(2, timeout=60)
            with DaskCluster(client, prepared, block=7) as cluster:
                yield cluster
    else:
        with WorkerPool(prepared, int(request.param[0]), block=5) as pool:
            yield pool


@pytest.fixture(params=["equal parts", "any parts"])
def parts(request, monkeypatch):
    """Generations are cut as they are in a search, and in every other way."""
    if request.param == "any parts":
        rng = np.random.default_rng(7)

        def anyhow(count, workers, pace):
            inner = np.sort(rng.choice(np.arange(1, count), rng.integers(0, min(count, 9)), replace=False)).tolist()
            return [slice(a, b) for a, b in zip([0, *inner], [*inner, count], strict=True)]

        monkeypatch.setattr(parallel, "cut", anyhow)


def same(one, other):
    """Whether scores and counts of two evaluations are equal to the last bit."""
    pairs = ((values, getattr(other[0], name)) for name, values in vars(one[0]).items())
    return all(np.array_equal(a, b, equal_nan=True) for a, b in pairs) and one[1] == other[1]


def history(prepared, backend):
    """Everything a search has learnt, exactly."""
    run = Search(prepared, backend)
    while run.ended_by() is None:
        run.advance()
    columns = {name: values.tolist() for name, values in vars(run.swarm.history).items()}
    return columns, run.swarm.state()["positions"].tolist(), run.leader, run.rejections, run.nearest


@pytest.fixture(scope="module")
def undisturbed(prepared):
    return history(prepared, InProcess(prepared))


@pytest.mark.usefixtures("parts")
def test_scores_are_those_of_one_process(backend, prepared, generation):
    Phi, cutoff, expected = generation
    alone = InProcess(prepared)
    assert 0 < expected[0].pruned.sum() < len(Phi)
    assert same(backend.evaluate(Phi, cutoff), expected)
    for count in (1, 2, 5):
        assert same(backend.evaluate(Phi[:count], cutoff[:count]), alone.evaluate(Phi[:count], cutoff[:count]))


@pytest.mark.usefixtures("parts")
def test_start_poses_reach_the_candidates_they_belong_to(backend, prepared, generation):
    Phi, cutoff, expected = generation
    poses = np.where(np.arange(len(Phi))[:, None] % 3 > 0, expected[0].q0, np.nan)
    wanted = InProcess(prepared).evaluate(Phi, cutoff, poses)
    assert wanted[0].start_steps.sum() < expected[0].start_steps.sum()
    assert same(backend.evaluate(Phi, cutoff, poses), wanted)


def test_slopes_come_where_they_are_asked_for(backend, prepared, generation):
    Phi, cutoff, expected = generation
    wanted = InProcess(prepared).evaluate(Phi, cutoff, slopes=True)
    assert np.array_equal(np.isfinite(wanted[0].slopes).all(axis=1), np.isfinite(wanted[0].fitness))
    for slopes in (False, True, True, False):
        assert same(backend.evaluate(Phi, cutoff, slopes=slopes), wanted if slopes else expected)


def test_coarse_answers_come_where_they_are_asked_for(backend, prepared, generation):
    Phi, cutoff, expected = generation
    wanted = InProcess(prepared).evaluate(Phi, cutoff, coarse=9)
    assert wanted[0].frames.sum() < expected[0].frames.sum()
    for coarse in (0, 9, 9, 0):
        assert same(backend.evaluate(Phi, cutoff, coarse=coarse), wanted if coarse else expected)


@pytest.mark.usefixtures("parts")
def test_a_search_is_the_same_to_the_last_bit(backend, prepared, undisturbed):
    assert history(prepared, backend) == undisturbed


def test_an_error_for_bad_input_reaches_the_caller_and_the_backend_goes_on(backend, generation):
    Phi, cutoff, expected = generation
    with pytest.raises(DesignError, match="start poses have shape"):
        backend.evaluate(Phi, cutoff, np.zeros((len(Phi), 99)))
    assert same(backend.evaluate(Phi, cutoff), expected)


def test_a_generation_that_was_broken_off_does_not_leak_into_the_next(backend, generation, monkeypatch):
    Phi, cutoff, expected = generation
    if isinstance(backend, ParallelBackend):

        def turn_away(timeout):
            raise KeyboardInterrupt

        with monkeypatch.context() as patch:
            patch.setattr(backend.workers, "wait", turn_away)
            with pytest.raises(KeyboardInterrupt):
                backend.evaluate(Phi[::-1], cutoff[::-1])
    assert same(backend.evaluate(Phi, cutoff), expected)


@pytest.mark.parametrize("backend", ["1 worker", "2 workers"], indirect=True)
def test_a_killed_worker_changes_nothing(backend, generation):
    Phi, cutoff, expected = generation
    os.kill(backend.pids[0], signal.SIGKILL)
    assert same(backend.evaluate(Phi, cutoff), expected)


class Threatened:
    """Workers in this process; a job with the deadly candidate kills them."""

    share_disk = True

    def __init__(self, prepared, deadly):
        self.handler, self.deadly, self.events, self.sizes = evaluator(prepared), deadly, [], []

    def room(self):
        return 3 - len(self.events)

    def started(self):
        return True

    def begin(self, job):
        self.sizes.append(len(job.content.Phi))
        if self.deadly in job.content.Phi[:, 0]:
            job.deaths = job.limit
            self.events.append(Event(job, "given up", "by SIGKILL"))
        else:
            self.events.append(Event(job, "answer", self.handler(job.content, JobContext())))

    def wait(self, timeout):
        return [self.events.pop()]

    def drop(self):
        self.events = []

    def close(self):
        pass


@pytest.mark.parametrize("place", [0, 31])
def test_a_candidate_that_kills_its_workers_is_found_and_named(prepared, generation, place):
    Phi, cutoff, _ = generation
    workers = Threatened(prepared, Phi[place, 0])
    with pytest.raises(CandidateKillsWorkersError, match=r"killed 3 worker processes: Phi = \[") as caught:
        ParallelBackend(workers).evaluate(Phi, cutoff)
    assert np.array_equal(caught.value.value, Phi[place])
    assert "failed_candidate.json" in str(caught.value)
    assert workers.sizes[:3] == [20, 20, 20]
    assert set(workers.sizes[3:]) == {1}


def test_a_part_that_kills_by_chance_is_done_candidate_by_candidate(prepared, generation):
    Phi, cutoff, expected = generation
    workers = Threatened(prepared, Phi[31, 0])
    begin = workers.begin

    def only_with_others(job):
        workers.deadly = Phi[31, 0] if len(job.content.Phi) > 1 else np.nan
        begin(job)

    workers.begin = only_with_others
    assert same(ParallelBackend(workers).evaluate(Phi, cutoff), expected)


@pytest.mark.parametrize("count", [1, 7, 400, 5001])
@pytest.mark.parametrize("workers", [0, 1, 2, 50])
@pytest.mark.parametrize("pace", [1e-5, 1e-3, 0.02, 3.0])
def test_parts_cover_a_generation_evenly(count, workers, pace):
    slices = cut(count, workers, pace)
    assert [k for part in slices for k in range(part.start, part.stop)] == list(range(count))
    sizes = [part.stop - part.start for part in slices]
    assert max(sizes) - min(sizes) <= 1
    assert len(sizes) in (count, *range(max(workers, 1), count + 1, max(workers, 1)))
    assert max(sizes) == 1 or (max(sizes) - 1) * pace <= LONGEST


def test_a_part_of_a_generation_holds_what_belongs_to_it():
    Phi, cutoff = np.arange(12.0).reshape(6, 2), np.arange(6.0)
    part = Generation(Phi, cutoff, Phi + 1.0, slopes=True).part(slice(2, 4))
    assert np.array_equal(part.Phi, Phi[2:4])
    assert np.array_equal(part.poses, Phi[2:4] + 1.0)
    assert (part.cutoff.tolist(), part.mounts, part.slopes) == ([2.0, 3.0], None, True)
