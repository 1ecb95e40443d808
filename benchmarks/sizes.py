"""Scaling in T, N, n and m: what a step and a frame cost on ever larger tasks."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from plan import PACKAGING, Plan, designs, tiled, with_points
from tables import Row, Table
from walks import Starts, Walked, pace, quickest, seek_starts, walk_path

from armdesign.fitness.block import compile_kernels
from armdesign.fitness.problem import Problem
from armdesign.search.backends.backend import InProcess
from armdesign.search.design_problem import DesignProblem

Array = NDArray[np.float64]
DOF, DESIGNS, ARMS = 4, 120, 48


def tables(plan: Plan) -> Iterator[Table]:
    """One table per size."""
    basis = PACKAGING.problem(DOF)
    title = f"packaging, one process, best of {plan.repeats} rounds"
    path = "path phase on valid designs"
    tall = {T: tiled(basis, T) for T in plan.pick((50, 100, 200, 500, 1000, 2000), (50, 500))}
    yield Table(
        "T", f"Scaling in T, n = {DOF}: {path}, the recording played forth and back ({title})", rows_of(plan, "T", tall)
    )
    many = {m: with_points(basis, m) for m in plan.pick((1, 2, 3, 4, 5, 6), (1, 3, 6))}
    yield Table(
        "m", f"Scaling in m, n = {DOF}: {path}, points at equal shares of the demonstrator's arm ({title})",
        rows_of(plan, "m", many),
    )  # fmt: skip
    anywhere = {"reach_tolerance": 1.0}
    joints = {n: PACKAGING.problem(n, fitness=anywhere) for n in plan.pick((2, 3, 4, 5, 6, 7, 8), (2, 5))}
    note = "Any start counts as reached here (reach_tolerance 1 m): two joints reach no point of space exactly."
    yield Table("n", f"Scaling in n: both phases ({title})", rows_of(plan, "n", joints), [note])
    yield Table(
        "N", f"Scaling in N, n = 3: whole generations of random designs, cheap tests included ({title})",
        generation_rows(plan, plan.pick((50, 100, 200, 400, 800, 1600), (100, 800))),
    )  # fmt: skip


def rows_of(plan: Plan, size: str, tasks: dict[int, DesignProblem]) -> list[Row]:
    """A row for every size, start and path apart."""
    cases = [(task.path_problem, *task.space.rows(designs(task, DESIGNS))) for task in tasks.values()]
    for problem, _, _ in cases:
        compile_kernels(problem)
    return [
        {
            size: value,
            "arms": len(samples[0][1].scores.frames),
            "steps/start": float(samples[0][0].steps.mean()),
            "start us/step": quickest([starts for starts, _ in samples]).us_per_step,
            "steps/frame": (path := pace([walk for _, walk in samples])).steps_per_frame,
            "path us/step": path.us_per_step,
            "us/frame": path.us_per_frame,
            "ms/path": 1e3 * path.seconds / len(samples[0][1].scores.frames),
        }
        for value, samples in zip(tasks, plan.in_rounds(cases, lambda case: phases(*case)), strict=True)
    ]


def phases(problem: Problem, rows: Array, yaw: Array) -> tuple[Starts, Walked]:
    """Start and path, one measurement."""
    starts = seek_starts(problem, rows, yaw)
    return starts, walk_path(problem, rows, yaw, starts, ARMS)


def generation_rows(plan: Plan, counts: Sequence[int]) -> list[Row]:
    """The first designs of one large sample, as many as in a generation of the search."""
    problem = PACKAGING.problem(3)
    Phi, never = designs(problem, max(counts)), np.full(max(counts), np.inf)
    with InProcess(problem) as backend:
        compile_kernels(problem.path_problem)

        def measure(count: int) -> tuple[float, int]:
            began = time.perf_counter()
            scores, _ = backend.evaluate(Phi[:count], never[:count])
            return time.perf_counter() - began, int(scores.steps.sum())

        best = [min(samples) for samples in plan.in_rounds(counts, measure)]
    return [
        {"N": count, "ms": 1e3 * s, "us/candidate": 1e6 * s / count, "us/step": 1e6 * s / steps}
        for count, (s, steps) in zip(counts, best, strict=True)
    ]
