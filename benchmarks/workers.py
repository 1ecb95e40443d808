"""Scaling in workers on this machine, next to what the machine gives to processes that share nothing."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Barrier

import numpy as np
from plan import PACKAGING, Plan, designs
from tables import Row, Table

from armdesign.search.backends.backend import Backend, InProcess
from armdesign.search.backends.parallel import WorkerPool
from armdesign.search.backends.processes import available_cores
from armdesign.search.design_problem import DesignProblem
from armdesign.search.search import Search

DOF = 3


def tables(plan: Plan) -> Iterator[Table]:
    """Searches on more and more workers, and the number of candidates from which on two pay."""
    iterations, rounds = plan.pick((200, 2), (15, 1))
    yield Table(
        "workers",
        f"A search by RA-PSO, packaging, n = {DOF}, N = 400, M = {iterations}, on W workers (best of {rounds})",
        scaling(PACKAGING.problem(DOF, search={"iterations": iterations}), rounds),
        [
            "ceiling: W such searches at once, one process each, over one alone; a shared machine gives less than W.",
            "The aim is 1.85 times one worker with two. Start-up is not counted, see break-even.",
        ],
    )
    budget = plan.pick(50_000, 2000)
    yield Table(
        "workers-multibasin",
        f"A default search, packaging, n = 4, at most {budget} candidates, on W workers (best of {rounds})",
        scaling(PACKAGING.problem(4, search={"budget": budget}), rounds),
        ["Workers carry out whole parts of it. The aim is 1.85 times one worker with two."],
    )
    yield Table(
        "break-even",
        f"From how many candidates on two workers beat one, their start-up counted (best of {plan.repeats})",
        [break_even(plan, dof, count) for dof, count in plan.pick(((3, 1600), (4, 800), (6, 200)), ((3, 800),))],
        ["start-up: until both have answered for the first time. Candidates are random designs, nothing pruned."],
    )


def scaling(problem: DesignProblem, rounds: int) -> list[Row]:
    """A row for every number of workers; all measurements in turns, so that noise meets all of them."""
    counts = sorted({2, available_cores()})
    alone, together, shared = [], {w: [] for w in counts}, {w: [] for w in counts}
    for _ in range(rounds):
        alone.append(at_once(problem, 1))
        for w in counts:
            together[w].append(at_once(problem, w))
            with WorkerPool(problem, w) as pool:
                shared[w].append(timed_search(problem, pool))
    one = min(alone)
    rows: list[Row] = [{"W": 1, "seconds": one, "x one": 1.0, "ceiling": 1.0, "% of ceiling": 100.0}]
    for w in counts:
        gain, ceiling = one / min(shared[w]), w * one / min(together[w])
        row = {"W": w, "seconds": min(shared[w]), "x one": gain, "ceiling": ceiling}
        rows.append(row | {"% of ceiling": 100.0 * gain / ceiling})
    return rows


def timed_search(problem: DesignProblem, backend: Backend, clock: Callable[[], float] = time.perf_counter) -> float:
    """Seconds of a search by a clock; everything has run once before."""
    warm_up(problem, backend)
    run = Search(problem, backend)
    began = clock()
    while run.ended_by() is None:
        run.advance()
    return clock() - began


def warm_up(problem: DesignProblem, backend: Backend, count: int = 128) -> None:
    """Evaluate a few candidates."""
    Phi = designs(problem, count)
    backend.evaluate(Phi, np.full(count, np.inf))


def at_once(problem: DesignProblem, count: int) -> float:
    """Seconds until so many searches that start at once in processes of their own have all ended."""
    context = multiprocessing.get_context("spawn")
    barrier, pipes, processes = context.Barrier(count), [], []
    for _ in range(count):
        ours, theirs = context.Pipe()
        process = context.Process(target=search_alone, args=(problem, barrier, theirs), daemon=True)
        process.start()
        theirs.close()
        pipes.append(ours)
        processes.append(process)
    seconds = max(pipe.recv() for pipe in pipes)
    for process in processes:
        process.join()
    return float(seconds)


def search_alone(problem: DesignProblem, barrier: Barrier, answer: Connection) -> None:
    """Body of a process that searches by itself; tells the seconds from the common start on."""
    with InProcess(problem) as backend:
        warm_up(problem, backend)
        barrier.wait()
        answer.send(timed_search(problem, backend))


def break_even(plan: Plan, dof: int, count: int) -> Row:
    """Start-up of two workers against what they save per candidate."""
    problem = PACKAGING.problem(dof)
    Phi, never = designs(problem, count), np.full(count, np.inf)

    def seconds(backend: Backend) -> float:
        began = time.perf_counter()
        backend.evaluate(Phi, never)
        return time.perf_counter() - began

    with InProcess(problem) as alone:
        warm_up(problem, alone)
        one = min(seconds(alone) for _ in range(plan.repeats))
    start_ups, twos = [], []
    for _ in range(plan.repeats):
        began = time.perf_counter()
        with WorkerPool(problem, 2) as pool:
            pool.evaluate(Phi[:32], never[:32])
            start_ups.append(time.perf_counter() - began)
            twos.append(seconds(pool))
    start_up, two = min(start_ups), min(twos)
    saved = (one - two) / count
    return {
        "n": dof,
        "candidates": count,
        "start-up s": start_up,
        "one us/candidate": 1e6 * one / count,
        "two us/candidate": 1e6 * two / count,
        "x faster": one / two,
        "break-even": round(start_up / saved) if saved > 0.0 else None,
        "default generations": start_up / saved / 400.0 if saved > 0.0 else None,
    }
