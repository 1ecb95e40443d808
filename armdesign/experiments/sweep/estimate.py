"""How long the runs of a sweep may take, from a few measured candidates per recording and number of joints."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from armdesign.experiments.sweep.sweep_plan import Unit
from armdesign.fitness.block import compile_kernels
from armdesign.fitness.robot import RobotFitness
from armdesign.search.prepare import Prepared

CANDIDATES = 100
SHARES = {"pso": (0.95, 0.05), "rapso": (0.45, 0.15), "multibasin": (0.9, 0.1)}
"""Share of all candidates that follow the path, and that fail at the start; PSO gathers where arms are valid, RA-PSO
keeps jumping, often out of the bounds at no cost. Means over searches on both example recordings, n = 3 to 6."""
STARTED = {"multibasin": 0.45}
"""Share of those on the path whose start pose is sought; the others begin from a pose that is known."""
PRUNED, SLOPED = 0.8, 2.0
"""What pruning leaves of the time on the path behind the start, in the same searches; what gradients make of it."""


@dataclass(frozen=True)
class Cost:
    """Time per candidate.

    Attributes:
        valid: Mean of those that follow the path [s].
        invalid: Mean of those that do not reach the start [s].
        reached: Whether any of the measured ones did reach it; if not, ``valid`` is not known and equals ``invalid``.
    """

    valid: float
    invalid: float
    reached: bool


@dataclass(frozen=True)
class Estimate:
    """Time the runs may take.

    Attributes:
        each: Time of each unit on one process [s].
        unknown: Numbers of joints for which no measured arm reached the start, so that the time is a lower bound.
    """

    each: tuple[float, ...]
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
        settings = unit.prepared.settings
        key = unit.recording, settings.design.dof
        if key not in costs:
            costs[key] = measure(unit.prepared)
        each.append(duration(unit, costs[key]))
    return Estimate(tuple(each), tuple(sorted({n for (_, n), cost in costs.items() if not cost.reached})))


def duration(unit: Unit, cost: Cost) -> float:
    """Time of a whole search [s]."""
    search = unit.prepared.settings.search
    on_path, at_start = SHARES[search.algorithm]
    start = min(cost.invalid, cost.valid)
    pruned = PRUNED if search.prune else 1.0
    path = (cost.valid - start) * (SLOPED if search.algorithm == "multibasin" else pruned)
    sought = STARTED.get(search.algorithm, 1.0) * start
    per_candidate = on_path * (sought + path) + at_start * cost.invalid
    return min(search.candidates * per_candidate, search.time_limit or np.inf)


def measure(prepared: Prepared, count: int = CANDIDATES) -> Cost:
    """Time candidates drawn uniformly from Omega_l, those that reach the start apart from the others."""
    compile_kernels(prepared.problem())
    fitness = RobotFitness(prepared.problem(), prepared.space())
    designs = prepared.space().sample(np.random.default_rng(0), count)
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
