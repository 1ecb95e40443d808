"""Solvers of the temporal fitness: metaheuristics, SLSQP in two ways, and damped least squares from many starts."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from armdesign._types import Array
from armdesign.experiments.studies import opytimizer_swarms
from armdesign.experiments.studies.frame_fitness import FrameFitness
from armdesign.fitness.pose import PoseSolver
from armdesign.kinematics.dh import DHTable
from armdesign.search.design_problem import DesignProblem

AGENTS = 100
TEMPERATURE = 0.05
"""What SA starts at: G differs by some centimetres between good poses [m]."""
REFERENCE = "dls-1024"
"""The long run of least squares that the best known value comes from, together with all other solvers."""
SOLVERS = (*opytimizer_swarms.ALGORITHMS, "slsqp-paper", "slsqp", "dls-1", "dls-16", "dls-64", REFERENCE)
TITLES = {
    "sa-default": "SA, its defaults",
    "slsqp-paper": "SLSQP, free sigma",
    "slsqp": "SLSQP, gradients",
    "dls-1": "DLS, 1 start",
    "dls-16": "DLS, 16 starts",
    "dls-64": "DLS, 64 starts",
    REFERENCE: "DLS, 1024 starts",
}


@dataclass(frozen=True)
class FrameSolution:
    """What a solver has found for one arm and one frame."""

    g: float  # temporal fitness G [m]
    q: Array  # the pose, shape (n,) [rad]
    evaluations: int  # how often it asked for the fitness (of DLS: steps)
    seconds: float  # processor time it took [s]


class FrameSolvers:
    """All solvers on the frames of one task."""

    def __init__(self, problem: DesignProblem) -> None:
        """Nothing solved yet."""
        self.design_problem, self.problem = problem, problem.path_problem
        self.warm = False

    def solve(self, name: str, table: DHTable, frame: int, budget: int, seed: int) -> FrameSolution:
        """Solve one frame for one arm.

        Args:
            name: One of ``SOLVERS``.
            table: The arm.
            frame: Index of the frame.
            budget: Evaluations of a metaheuristic.
            seed: Seed of its random numbers, and of SLSQP's start, below 2^32.
        """
        if name.startswith("dls"):
            return self.by_least_squares(table, frame, int(name.partition("-")[2]))
        fitness = FrameFitness(table, self.problem, frame)
        fitness(np.zeros(fitness.dof))  # loads the kernels
        if name.startswith("slsqp"):
            start = np.random.default_rng(seed).uniform(*fitness.limits.T)
            return by_slsqp_loosely(fitness, start, seed) if name == "slsqp-paper" else by_slsqp(fitness, start)
        began = time.thread_time()
        lower, upper = fitness.limits.T
        found = opytimizer_swarms.minimise(
            name, fitness, lower, upper, budget=budget, agents=AGENTS, seed=seed, temperature=TEMPERATURE
        )
        return FrameSolution(found.value, found.x, found.evaluations, time.thread_time() - began)

    def by_least_squares(self, table: DHTable, frame: int, starts: int) -> FrameSolution:
        """Damped least squares with exact sigma, from so many start poses."""
        record, settings = self.problem.record[0], self.design_problem.settings
        limits = np.stack([record["lower"][: table.dof], record["upper"][: table.dof]], axis=1)
        solver = PoseSolver(limits, settings.fitness, settings.solver, starts=starts)
        rotation = self.problem.R[frame if len(self.problem.R) > 1 else 0]
        if not self.warm:
            self.warm = True
            solver.solve(table, self.problem.P[frame], rotation)  # loads the kernels
        began = time.thread_time()
        pose = solver.solve(table, self.problem.P[frame], rotation)
        return FrameSolution(pose.g, pose.q, pose.steps, time.thread_time() - began)


def by_slsqp(fitness: FrameFitness, start: Array) -> FrameSolution:
    """SLSQP with exact sigma and exact gradients, from one start pose.

    Its linear algebra is that of SciPy's BLAS, whose last bits depend on the number of its threads.
    """
    from scipy.optimize import minimize  # noqa: PLC0415 (slow to load)

    fitness.with_gradient(start)  # loads the kernel
    began = time.thread_time()
    found = minimize(fitness.with_gradient, start, jac=True, method="SLSQP", bounds=fitness.limits)
    q = np.clip(found.x, *fitness.limits.T)
    return FrameSolution(fitness(q), q, int(found.nfev), time.thread_time() - began)


def by_slsqp_loosely(fitness: FrameFitness, start: Array, seed: int) -> FrameSolution:
    """SLSQP as the paper probably ran it: sigma free beside q, finite differences, one random start."""
    from scipy.optimize import minimize  # noqa: PLC0415 (slow to load)

    sigma = np.sort(np.random.default_rng([seed, 1]).random(fitness.free))
    x, limits = np.r_[start, sigma], np.vstack([fitness.limits, np.tile([0.0, 1.0], (len(sigma), 1))])
    fitness.with_sigma(x)
    order = {"type": "ineq", "fun": lambda x: np.diff(x[fitness.dof :])} if len(sigma) > 1 else ()
    began = time.thread_time()
    found = minimize(fitness.with_sigma, x, method="SLSQP", bounds=limits, constraints=order)
    x = np.clip(found.x, *limits.T)
    return FrameSolution(fitness.with_sigma(x), x[: fitness.dof], int(found.nfev), time.thread_time() - began)
