"""How long the runs of a sweep may take, from a few measured candidates per recording and number of joints."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armdesign.experiments.sweep.sweep_plan import Unit
from armdesign.fitness.block import compile_kernels
from armdesign.fitness.robot import RobotFitness
from armdesign.search.design_problem import DesignProblem

CANDIDATES = 100


class Shares(NamedTuple):
    """What a search spends its candidates on: means over searches on both example recordings, n = 3 to 6."""

    on_path: float  # share of all candidates that follow the path
    at_start: float  # share of them that fail at the start
    # share of those on the path whose start pose is sought; the others begin from a pose that is known
    sought: float = 1.0
    # what pruning leaves of the time on the path behind the start; above 1 where gradients take their time
    pruned: float = 0.8


SHARES = {"pso": Shares(0.95, 0.05), "rapso": Shares(0.45, 0.15), "multibasin": Shares(0.9, 0.1, 0.45, 2.0)}
"""PSO gathers where arms are valid, RA-PSO keeps jumping, often out of the bounds at no cost; multibasin takes
gradients and prunes nothing."""
UNKNOWN = Shares(1.0, 0.0)
"""Of an algorithm that was not measured: every candidate follows the path."""


@dataclass(frozen=True)
class Cost:
    """Time per candidate."""

    valid: float  # mean of those that follow the path [s]
    invalid: float  # mean of those that do not reach the start [s]
    # whether any of the measured ones did reach it; if not, ``valid`` is not known and equals ``invalid``
    reached: bool


@dataclass(frozen=True)
class Estimate:
    """Time the runs may take."""

    each: tuple[float, ...]  # time of each unit on one process [s]
    # numbers of joints for which no measured arm reached the start, so that the time is a lower bound
    unknown: tuple[int, ...]

    def total(self, workers: int) -> float:
        """Time of all on a number of processes [s]."""
        return max([sum(self.each) / max(1, workers), *self.each])


def estimate(units: Sequence[Unit]) -> Estimate:
    """Measure candidates on every recording and number of joints, and add up.

    Stop rules other than the time limit may end a run sooner.
    """
    costs: dict[tuple[str, int], Cost] = {}
    each = []
    for unit in units:
        settings = unit.problem.settings
        key = unit.recording, settings.design.dof
        if key not in costs:
            costs[key] = measure(unit.problem)
        each.append(duration(unit, costs[key]))
    return Estimate(tuple(each), tuple(sorted({n for (_, n), cost in costs.items() if not cost.reached})))


def duration(unit: Unit, cost: Cost) -> float:
    """Time of a whole search [s]."""
    search = unit.problem.settings.search
    shares = SHARES.get(search.algorithm, UNKNOWN)
    start = min(cost.invalid, cost.valid)
    left = shares.pruned if search.prune or shares.pruned > 1.0 else 1.0
    on_path = shares.sought * start + left * (cost.valid - start)
    per_candidate = shares.on_path * on_path + shares.at_start * cost.invalid
    return min(search.candidates * per_candidate, search.time_limit or np.inf)


def measure(problem: DesignProblem, count: int = CANDIDATES) -> Cost:
    """Time candidates drawn uniformly from Omega_l, those that reach the start apart from the others."""
    compile_kernels(problem.path_problem)
    fitness = RobotFitness(problem.path_problem, problem.space)
    designs = problem.space.sample(np.random.default_rng(0), count)
    scores, _ = fitness.evaluate(designs)  # also warms up
    valid = scores.valid
    unreached = mean_time(fitness, designs[~valid])
    if not valid.any():
        return Cost(unreached, unreached, reached=False)
    return Cost(mean_time(fitness, designs[valid]), unreached, reached=True)


def mean_time(fitness: RobotFitness, designs: NDArray[np.float64]) -> float:
    """Mean time of an evaluation [s]; 0 where there is nothing to evaluate."""
    if len(designs) == 0:
        return 0.0
    began = time.perf_counter()
    fitness.evaluate(designs)
    return (time.perf_counter() - began) / len(designs)
