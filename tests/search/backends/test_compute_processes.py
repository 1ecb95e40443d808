import contextlib
import itertools
import multiprocessing
import os
import signal
import threading
import time
from collections import deque
from pathlib import Path

import compute_workers as workers
import numpy as np
import pytest

from armdesign.demonstration import read_recording
from armdesign.errors import DesignError, SearchError
from armdesign.fitness.robot import Generation, Rejections
from armdesign.search.backends import InProcess, WorkerPool, processes
from armdesign.search.backends.processes import CandidateKillsWorkersError, Chunk, Worker, blame, cut
from armdesign.search.prepare import prepare
from armdesign.search.search import Search
from armdesign.settings.sections import Settings

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


@pytest.fixture
def light(monkeypatch):
    """Start pools of light workers; all are closed in the end."""
    pools, others = [], set(multiprocessing.active_children())

    def start(count, body=workers.answer_chunks, prepared=None):
        monkeypatch.setattr(processes, "work", body)
        pools.append(WorkerPool(prepared, count))
        return pools[-1]

    yield start
    for pool in pools:
        pool.close()
    assert set(multiprocessing.active_children()) <= others


@pytest.fixture(scope="module")
def task():
    settings = {"search": {"particles": 12, "iterations": 5}, "task": {"stop": 0.4}}
    return prepare(read_recording(EXAMPLES / "packaging.csv"), Settings().replace(settings))


@pytest.fixture(scope="module")
def three(task):
    """Three real workers."""
    with WorkerPool(task, 3, block=5) as pool:
        yield pool
    assert not multiprocessing.active_children()


def generation(count=40, dimension=4, seed=0):
    return np.random.default_rng(seed).random((count, dimension)), np.full(count, np.inf)


def same(scores, wanted):
    return all(np.array_equal(getattr(scores, name), values, equal_nan=True) for name, values in vars(wanted).items())


def expected(Phi):
    return workers.scores(Phi), Rejections(**vars(workers.removed(Phi)))


def parts(count, seed):
    """A random cut of a generation, in a random order."""
    rng = np.random.default_rng(seed)
    inner = np.sort(rng.choice(np.arange(1, count), rng.integers(0, count), replace=False))
    ends = [0, *inner.tolist(), count]
    chunks = [Chunk(a, b) for a, b in itertools.pairwise(ends)]
    return [chunks[i] for i in rng.permutation(len(chunks))]


@pytest.mark.parametrize("workers_count", [1, 2, 3, 7, 64])
@pytest.mark.parametrize("count", [1, 2, 3, 10, 400, 1001])
def test_a_cut_takes_every_candidate_once(count, workers_count):
    chunks = cut(count, workers_count)
    assert [k for chunk in chunks for k in range(chunk.first, chunk.last)] == list(range(count))
    assert all(chunk.first < chunk.last for chunk in chunks)
    sizes = [chunk.last - chunk.first for chunk in chunks]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes[0] <= processes.LARGEST
    assert min(sizes[:-1], default=processes.SMALLEST) >= processes.SMALLEST


def test_a_chunk_on_which_a_worker_died_is_dealt_with_alone():
    fresh, suspect = Chunk(0, 5), Chunk(5, 9, deaths=1)
    idle, busy, wary = (Worker(None, None, deque(chunks)) for chunks in ([], [fresh], [suspect]))
    assert idle.may_take(fresh)
    assert idle.may_take(suspect)
    assert busy.may_take(fresh)
    assert not busy.may_take(suspect)
    assert not wary.may_take(fresh)
    assert not Worker(None, None, deque([fresh, fresh])).may_take(fresh)


def test_chunks_that_overlap_are_scored_as_apart(task):
    backend = InProcess(task, block=5)
    rng = np.random.default_rng(3)
    chunks = [Generation(task.space.sample(rng, count), np.full(count, 0.9)) for count in (7, 0, 1, 23, 2)]
    behind = deque(chunks[1:])
    asked = itertools.count()

    def more():  # now one is there, now none yet
        return behind.popleft() if behind and next(asked) % 3 else None

    answers = list(backend.stream(chunks[0], more))
    while behind:
        answers += backend.stream(behind.popleft(), more)
    assert len(answers) == len(chunks)
    for (scores, removed), chunk in zip(answers, chunks, strict=True):
        wanted, counted = InProcess(task).evaluate(chunk.Phi, chunk.cutoff)
        assert same(scores, wanted)
        assert removed == counted


def test_slopes_are_the_same_on_real_workers_and_between_generations_without(task, three):
    Phi = task.space.sample(np.random.default_rng(4), 120)
    cutoff, alone = np.full(120, np.inf), InProcess(task, block=3)
    for slopes in (False, True, True, False, True):
        assert same(three.evaluate(Phi, cutoff, slopes=slopes)[0], alone.evaluate(Phi, cutoff, slopes=slopes)[0])
    scores = alone.evaluate(Phi, cutoff, slopes=True)[0]
    assert np.array_equal(np.isfinite(scores.slopes).all(axis=1), np.isfinite(scores.fitness))
    assert np.isfinite(scores.fitness).sum() >= 5


def test_scores_do_not_depend_on_the_cut(light, monkeypatch):
    pool = light(3)
    for seed in range(20):
        monkeypatch.setattr(processes, "cut", lambda count, workers, seed=seed: parts(count, seed))
        Phi, cutoff = generation(seed=seed)
        scores, removed = pool.evaluate(Phi, cutoff)
        assert same(scores, expected(Phi)[0])
        assert removed == expected(Phi)[1]


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_search_is_the_same_to_the_last_bit_on_any_number_of_workers(task, three, monkeypatch, count):
    alone = history(task, InProcess(task, block=[1, 7, 32][count - 1]))
    monkeypatch.setattr(three, "workers", three.workers[:count])
    assert history(task, three) == alone
    monkeypatch.setattr(processes, "cut", lambda total, workers: parts(total, seed=count))
    assert history(task, three) == alone


def history(task, backend):
    """Everything a search has learnt, exactly."""
    run = Search(task, backend)
    while run.ended_by() is None:
        run.advance()
    columns = {name: values.tolist() for name, values in vars(run.swarm.history).items()}
    return columns, run.swarm.state()["positions"].tolist(), run.leader, run.rejections, run.nearest


def test_real_workers_score_as_this_process_does_also_when_one_is_killed(task, three):
    Phi = task.space.sample(np.random.default_rng(1), 30)
    cutoff = np.full(30, np.inf)
    scores, removed = InProcess(task).evaluate(Phi, cutoff)
    before = three.pids
    os.kill(before[0], signal.SIGKILL)
    told, counted = three.evaluate(Phi, cutoff)
    assert same(told, scores)
    assert counted == removed
    assert len(three.pids) == 3
    assert before[0] not in three.pids


def test_start_poses_reach_the_candidates_they_belong_to(task, three):
    """Of many chunks, hinted and not, on any number of workers."""
    Phi = task.space.sample(np.random.default_rng(4), 150)
    cutoff = np.full(len(Phi), np.inf)
    pure, _ = InProcess(task).evaluate(Phi, cutoff)
    poses = np.where(np.arange(len(Phi))[:, None] % 3 > 0, pure.q0, np.nan)
    wanted, counted = InProcess(task).evaluate(Phi, cutoff, poses)
    assert wanted.start_steps.sum() < pure.start_steps.sum()
    np.testing.assert_allclose(wanted.fitness[pure.valid], pure.fitness[pure.valid], rtol=1e-9)
    told, removed = three.evaluate(Phi, cutoff, poses)
    assert same(told, wanted)
    assert removed == counted


def test_a_worker_that_died_idle_is_replaced(light):
    pool = light(2)
    Phi, cutoff = generation()
    pool.evaluate(Phi, cutoff)
    gone = pool.pids
    for pid in gone:
        os.kill(pid, signal.SIGKILL)
    assert same(pool.evaluate(Phi, cutoff)[0], expected(Phi)[0])
    assert not set(gone) & set(pool.pids)


def test_a_worker_that_dies_on_its_chunk_is_replaced_and_the_chunk_done_again(light, tmp_path):
    fuse = tmp_path / "fuse"
    fuse.touch()
    Phi, cutoff = generation()
    Phi[17] = workers.DIES_ONCE
    pool = light(2, prepared=str(fuse))
    before = pool.pids
    scores, removed = pool.evaluate(Phi, cutoff)
    assert not fuse.exists()
    assert same(scores, expected(Phi)[0])
    assert removed == expected(Phi)[1]
    assert len(set(before) - set(pool.pids)) == 1


def test_scores_survive_kills_at_random_moments(light):
    rng = np.random.default_rng(5)
    pool = light(3)
    Phi, cutoff = generation(60)
    Phi[::5] = workers.SLOW
    for _ in range(4):
        stop = threading.Timer(rng.uniform(0.0, 0.15), kill_one, [pool.pids, rng.integers(3)])
        stop.start()
        assert same(pool.evaluate(Phi, cutoff)[0], expected(Phi)[0])
        stop.join()
    assert len(set(pool.pids)) == 3


def kill_one(pids, index):
    with contextlib.suppress(ProcessLookupError):  # it has gone already
        os.kill(pids[index], signal.SIGKILL)


@pytest.mark.parametrize("place", [0, 5])
def test_a_candidate_that_kills_its_workers_ends_the_evaluation_by_name(light, place):
    Phi, cutoff = generation(6)
    Phi[place] = workers.POISON
    with pytest.raises(CandidateKillsWorkersError, match=r"killed 3 worker processes: Phi = \[666\.0, ") as caught:
        light(2).evaluate(Phi, cutoff)
    assert np.array_equal(caught.value.value, Phi[place])
    assert "failed_candidate.json" in str(caught.value)


def test_blame_falls_on_single_candidates_in_the_end():
    Phi, _ = generation(9)
    chunk = Chunk(3, 7)
    assert blame(chunk, Phi) == [chunk]
    singles = blame(chunk, Phi)
    assert [(single.first, single.last, single.deaths) for single in singles] == [(k, k + 1, 0) for k in range(3, 7)]
    assert blame(singles[2], Phi) == [singles[2]]
    assert blame(singles[2], Phi) == [singles[2]]
    with pytest.raises(CandidateKillsWorkersError):
        blame(singles[2], Phi)


def test_workers_that_do_not_start_are_no_candidate_s_fault(light):
    with pytest.raises(SearchError, match="before they were ready") as caught:
        light(2, workers.never_starts).evaluate(*generation())
    assert not isinstance(caught.value, CandidateKillsWorkersError)


def test_an_error_for_bad_input_reaches_the_caller_and_the_pool_goes_on(light):
    pool = light(2, workers.answer_errors)
    Phi, cutoff = generation()
    bad = Phi.copy()
    bad[3] = workers.RAISES
    with pytest.raises(DesignError, match="no such arm"):
        pool.evaluate(bad, cutoff)
    assert same(pool.evaluate(Phi, cutoff)[0], expected(Phi)[0])


def test_a_generation_that_was_broken_off_does_not_leak_into_the_next(light, monkeypatch):
    pool = light(2)
    slow, _ = generation(20, seed=1)
    slow[:] = workers.SLOW
    break_off(pool, slow, monkeypatch)
    Phi, cutoff = generation(20, seed=2)
    assert same(pool.evaluate(Phi, cutoff)[0], expected(Phi)[0])


def break_off(pool, Phi, monkeypatch):
    """Hand out a generation and turn away, as Ctrl-C does."""

    def turn_away(pipes):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(processes, "wait", turn_away)
        with pytest.raises(KeyboardInterrupt):
            pool.evaluate(Phi, np.full(len(Phi), np.inf))


def test_answers_larger_than_a_pipe_holds_come_through(light):
    Phi, cutoff = generation(30_000, 3)
    assert same(light(2).evaluate(Phi, cutoff)[0], expected(Phi)[0])


def test_closing_ends_busy_workers_soon_however_many_there_are(light, monkeypatch):
    pool = light(6, workers.never_ends)
    break_off(pool, generation()[0], monkeypatch)
    mine, began = set(pool.pids), time.monotonic()
    pool.close()
    assert time.monotonic() - began < 6 * processes.GRACE
    assert pool.pids == []
    assert not mine & {process.pid for process in multiprocessing.active_children()}


def test_workers_ignore_ctrl_c_from_their_first_moment(light):
    pool = light(2)
    for pid in pool.pids:
        os.kill(pid, signal.SIGINT)
    before = pool.pids
    Phi, cutoff = generation()
    assert same(pool.evaluate(Phi, cutoff)[0], expected(Phi)[0])
    assert pool.pids == before
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])
