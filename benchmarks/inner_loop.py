"""Per step, per frame, per candidate: what an evaluation costs on every task, n = 3..6, and what second order saves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from plan import Job, Plan, designs
from tables import Row, Table
from walks import Starts, Walked, pace, quickest, seek_starts, walk_path, walked

from armdesign.fitness.block import BlockEvaluator, compile_kernels
from armdesign.fitness.problem import Problem

Array = NDArray[np.float64]

DESIGNS = {3: (1200, 300), 4: (400, 200), 5: (150, 40), 6: (96, 32)}
"""Random designs by n, for a whole and for a quick run."""
ARMS = 96
"""Of the valid ones among them, how many walk the path at most."""


@dataclass(frozen=True)
class Case:
    """A task and n: the problem with the full second derivative and with Gauss-Newton alone, and the designs."""

    job: Job
    dof: int
    problem: Problem
    gauss: Problem
    rows: Array
    yaw: Array


@dataclass(frozen=True)
class Sample:
    """One measurement of a case: whole evaluation, start phase, path phase; the latter two by Gauss-Newton as well."""

    whole: Walked
    starts: Starts
    path: Walked
    gauss_starts: Starts
    gauss_path: Walked


def tables(plan: Plan) -> Iterator[Table]:
    """The three tables."""
    cases = [make_case(plan, job, dof) for job in plan.jobs for dof in DESIGNS]
    measured = list(zip(cases, plan.in_rounds(cases, measure), strict=True))
    frames = [frame_row(case, samples) for case, samples in measured]
    compare_with_smooth(frames)
    best = f"best of {plan.repeats} rounds; random designs of Omega_l, one process"
    steps = [step_row(case, samples) for case, samples in measured]
    yield Table("steps", f"Microseconds per step, overall and by phase ({best})", steps, [
        "A step is one evaluation of an arm and the next proposal. valid: share of the designs that reach the start.",
        "start: from the start poses to the best start; path: the frames behind it, on valid designs.",
    ])  # fmt: skip
    yield Table("frames", f"Per frame and per candidate ({best})", frames, [
        "accepted: share of the trials. us/candidate: start and path, the invalid ones counted in.",
        "x smooth: us/frame over packaging's with as many joints; the aim for the real recordings is 1.5 at most.",
    ])  # fmt: skip
    order = [order_row(case, samples) for case, samples in measured]
    yield Table("second order", f"Gauss-Newton alone (GN) next to the full second derivative ({best})", order)


def make_case(plan: Plan, job: Job, dof: int) -> Case:
    """Everything that is not timed."""
    problem = job.problem(dof)
    path_problem = problem.path_problem
    compile_kernels(path_problem)
    gauss = job.problem(dof, solver={"second_order": False}).path_problem
    return Case(job, dof, path_problem, gauss, *problem.space.rows(designs(problem, plan.pick(*DESIGNS[dof]))))


def measure(case: Case) -> Sample:
    """One measurement; Gauss-Newton walks from the same start poses."""
    rows, yaw = case.rows, case.yaw
    starts = seek_starts(case.problem, rows, yaw)
    return Sample(
        whole=walked(BlockEvaluator(case.problem), rows, yaw),
        starts=starts,
        path=walk_path(case.problem, rows, yaw, starts, ARMS),
        gauss_starts=seek_starts(case.gauss, rows, yaw),
        gauss_path=walk_path(case.gauss, rows, yaw, starts, ARMS),
    )


def fastest(samples: list[Sample]) -> Walked:
    """The fastest of the whole evaluations."""
    return min((sample.whole for sample in samples), key=lambda walk: walk.clock.total)


def step_row(case: Case, samples: list[Sample]) -> Row:
    """Microseconds per step."""
    whole, starts = fastest(samples), quickest([sample.starts for sample in samples])
    micro = 1e6 / int(whole.scores.steps.sum())
    return {
        "task": case.job.name,
        "n": case.dof,
        "valid %": 100.0 * float(starts.valid.mean()),
        "us/step": micro * whole.clock.total,
        "Pinocchio us": micro * whole.clock.pinocchio,
        "kernel us": micro * whole.clock.kernel,
        "rest us": micro * whole.clock.rest,
        "start us/step": starts.us_per_step,
        "steps/start": float(starts.steps.mean()),
        "path us/step": pace([sample.path for sample in samples]).us_per_step,
    }


def frame_row(case: Case, samples: list[Sample]) -> Row:
    """Steps and microseconds per frame, start and candidate."""
    path, starts = pace([sample.path for sample in samples]), quickest([sample.starts for sample in samples])
    return {
        "task": case.job.name,
        "n": case.dof,
        "m": case.problem.points,
        "T": case.problem.frames,
        "steps/frame": path.steps_per_frame,
        "accepted %": 100.0 * path.accepted,
        "us/frame": path.us_per_frame,
        "us/start": starts.us_per_start,
        "us/candidate": 1e6 * fastest(samples).clock.total / len(case.rows),
    }


def order_row(case: Case, samples: list[Sample]) -> Row:
    """What the second derivative saves."""
    path, gauss_path = pace([sample.path for sample in samples]), pace([sample.gauss_path for sample in samples])
    starts = quickest([sample.starts for sample in samples])
    gauss_starts = quickest([sample.gauss_starts for sample in samples])
    return {
        "task": case.job.name,
        "n": case.dof,
        "GN steps/frame": gauss_path.steps_per_frame,
        "steps/frame": path.steps_per_frame,
        "GN us/frame": gauss_path.us_per_frame,
        "us/frame": path.us_per_frame,
        "GN steps/start": float(gauss_starts.steps.mean()),
        "steps/start": float(starts.steps.mean()),
        "GN us/start": gauss_starts.us_per_start,
        "us/start": starts.us_per_start,
    }


def compare_with_smooth(frames: list[Row]) -> None:
    """Put the ratio to the packaging example with as many joints into every row."""
    smooth = {row["n"]: row["us/frame"] for row in frames if row["task"] == "packaging"}
    for row in frames:
        row["x smooth"] = float(row["us/frame"]) / float(smooth[row["n"]])
