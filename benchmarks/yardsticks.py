"""Two yardsticks in the same run: the path evaluation written plainly, and the paper's solver of a single frame."""

from __future__ import annotations

import contextlib
import io
import logging
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from plain import PlainArm
from plan import PACKAGING, Job, Plan, designs
from tables import Row, Table
from walks import PathWalker, pace, seek_starts

from armdesign.fitness.block import compile_kernels
from armdesign.fitness.pose import PoseSolver
from armdesign.fitness.problem import Problem
from armdesign.kinematics.dh import DHTable
from armdesign.search.design_problem import DesignProblem

Array = NDArray[np.float64]
AGENTS, ITERATIONS, STARTS = 100, 200, 64
DRAWN = {3: 400, 4: 120, 5: 40, 6: 24}


def plain_tables(plan: Plan) -> Iterator[Table]:
    """The package next to the plain version, on position-only tasks."""
    jobs = [job for job in plan.jobs if job.scenario == "packaging" and (job.smooth or not plan.quick)]
    rows = [plain_row(plan, job, dof) for job in jobs for dof in (3, 4, 5, 6)]
    yield Table(
        "plain",
        "Yardstick 1: the same paths from the same starts, with Pinocchio's Python calls and NumPy, one arm at a time "
        f"(plain: one run; armdesign: best of {plan.repeats}, arms side by side)",
        rows,
        [
            "plain takes Gauss-Newton steps to the same tolerance, armdesign its default steps; E is part of both.",
            "same f: arms whose f is that of armdesign's Gauss-Newton path within 0.1 %; worst: largest difference.",
        ],
    )


def plain_row(plan: Plan, job: Job, dof: int) -> Row:
    """A few valid designs, both ways."""
    problem = job.problem(dof)
    path_problem, space = problem.path_problem, problem.space
    compile_kernels(path_problem)
    Phi = designs(problem, DRAWN[dof])
    starts = seek_starts(path_problem, *space.rows(Phi))
    arms = np.flatnonzero(starts.valid)[: plan.pick(10, 4) if job.smooth else 3]
    rows, yaw = space.rows(Phi[arms])
    many = np.resize(np.arange(len(arms)), 96)  # fills the block, as a generation does
    walker, poses = PathWalker(path_problem), starts.poses[arms]
    speed = pace([walker.walk(rows[many], yaw[many], poses[many]) for _ in range(plan.repeats)])
    gauss = PathWalker(job.problem(dof, solver={"second_order": False}).path_problem)
    f = gauss.walk(rows, yaw, poses).scores.path_fitness
    began = time.perf_counter()
    plain = [PlainArm(space.table(Phi[k]), path_problem).follow(starts.poses[k]) for k in arms]
    seconds = time.perf_counter() - began
    steps, frames = sum(path.steps for path in plain), sum(path.frames for path in plain)
    apart = np.abs(np.array([path.f for path in plain]) - f) / f
    return {
        "task": job.name,
        "n": dof,
        "arms": len(arms),
        "plain us/step": 1e6 * seconds / steps,
        "plain steps/frame": steps / frames,
        "plain us/frame": 1e6 * seconds / frames,
        "us/step": speed.us_per_step,
        "steps/frame": speed.steps_per_frame,
        "us/frame": speed.us_per_frame,
        "x per step": 1e6 * seconds / steps / speed.us_per_step,
        "x per frame": 1e6 * seconds / frames / speed.us_per_frame,
        "same f": f"{int((apart < 1e-3).sum())}/{len(arms)}",
        "worst": f"{apart.max():.0e}",
    }


@dataclass(frozen=True)
class Frame:
    """One arm and one frame of the task."""

    table: DHTable
    points: Array


def swarm_tables(plan: Plan) -> Iterator[Table]:
    """PSO of opytimizer on single frames next to damped least squares."""
    title = (
        f"Yardstick 2: one frame of packaging, G by opytimizer's PSO ({AGENTS} agents, {ITERATIONS} iterations, its "
        f"defaults) and by armdesign's damped least squares from {STARTS} starts"
    )
    try:
        import opytimizer  # noqa: F401, PLC0415 (an extra, and slow to import)
    except ImportError:
        yield Table("pso", title, [], ["Left out: opytimizer is missing. Install it with: pip install '.[bench]'"])
        return
    yield Table("pso", title, [swarm_row(plan, dof) for dof in plan.pick((3, 4, 5, 6), (3, 6))], [
        "Means over random designs and the first, middle and last frame. PSO evaluates in Python with Pinocchio and",
        "NumPy; PSO alone: its time without that. sigma is eliminated for both, which is kinder to PSO than the paper.",
    ])  # fmt: skip


def swarm_row(plan: Plan, dof: int) -> Row:
    """Mean G and time of both solvers over a few frames."""
    problem = PACKAGING.problem(dof)
    frames = [
        Frame(problem.space.table(Phi), problem.task.P[t])
        for Phi, t in zip(designs(problem, plan.pick(3, 1)), [0, 50, 99], strict=False)
    ]
    by_swarm = [solve_by_swarm(problem, frame, seed) for seed, frame in enumerate(frames)]
    solver = pose_solver(problem)
    by_squares = []
    for frame in frames:
        G, seconds = plan.best(lambda f=frame: timed_solve(solver, f), lambda outcome: outcome[1])
        by_squares.append((G, seconds))
    (G_swarm, s_swarm, s_alone), (G_squares, s_squares) = np.mean(by_swarm, axis=0), np.mean(by_squares, axis=0)
    return {
        "n": dof,
        "frames": len(frames),
        "PSO G mm": 1e3 * float(G_swarm),
        "PSO ms": 1e3 * float(s_swarm),
        "PSO alone ms": 1e3 * float(s_alone),
        "DLS G mm": 1e3 * float(G_squares),
        "DLS ms": 1e3 * float(s_squares),
        "x faster": float(s_swarm / s_squares),
        "x faster than PSO alone": float(s_alone / s_squares),
    }


def pose_solver(problem: DesignProblem) -> PoseSolver:
    """Damped least squares on single frames."""
    record = problem.path_problem.record[0]
    n = problem.settings.design.dof
    limits = np.stack([record["lower"][:n], record["upper"][:n]], axis=1)
    return PoseSolver(limits, problem.settings.fitness, starts=STARTS)


def timed_solve(solver: PoseSolver, frame: Frame) -> tuple[float, float]:
    """G [m] and seconds."""
    began = time.perf_counter()
    pose = solver.solve(frame.table, frame.points)
    return pose.g, time.perf_counter() - began


def solve_by_swarm(problem: DesignProblem, frame: Frame, seed: int) -> tuple[float, float, float]:
    """G [m], seconds, and those of them that are opytimizer's own."""
    logging.disable(logging.CRITICAL)  # it logs every iteration to a file in the working folder
    from opytimizer import Opytimizer  # noqa: PLC0415
    from opytimizer.core import Function  # noqa: PLC0415
    from opytimizer.optimizers.swarm import PSO  # noqa: PLC0415
    from opytimizer.spaces import SearchSpace  # noqa: PLC0415

    path_problem: Problem = problem.path_problem
    arm, spent = PlainArm(frame.table, path_problem), [0.0]

    def g(position: Array) -> float:
        began = time.perf_counter()
        value = arm.pose(position.ravel(), frame.points).g
        spent[0] += time.perf_counter() - began
        return value

    np.random.seed(seed)  # noqa: NPY002 (the only way to seed it)
    space = SearchSpace(AGENTS, path_problem.dof, arm.lower.tolist(), arm.upper.tolist())
    began = time.perf_counter()
    with contextlib.redirect_stderr(io.StringIO()):
        Opytimizer(space, PSO(), Function(g)).start(n_iterations=ITERATIONS)
    seconds = time.perf_counter() - began
    logging.disable(logging.NOTSET)
    return float(space.best_agent.fit), seconds, seconds - spent[0]
