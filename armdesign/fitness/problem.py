"""The problem every candidate is judged on: a task, the fitness settings and the solver settings as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import SettingsError, TaskError
from armdesign.fitness.kernels.association import MAX_POINTS
from armdesign.fitness.kernels.orientation import METRICS
from armdesign.fitness.kernels.solver_state import MOUNT_IDENTITY, MOUNT_START, PROBLEM, ProblemArrays
from armdesign.settings.sections import Fitness, Solver

DESCENT_HAND = 10.0  # weight of the hand in the phases SAMPLE and DESCEND, high enough to lead it to its point
POLISH_HAND = 1000.0  # weight of the hand in the phase POLISH, so that it ends within 1 mm of its point
SCENARIOS = {"packaging": (0.0, (1 / 6, 1 / 3, 1 / 2)), "welding": (0.2, (0.0, 0.1, 0.7))}
"""Published weights (w_0, (w_1, w_2, w_3)), method section 8."""


@dataclass(frozen=True)
class Problem:
    """What a candidate's fitness depends on besides the candidate.

    Attributes:
        P: Points, shape (T, m, 3) [m].
        R: Hand rotations, shape (T, 3, 3), or (1, 3, 3) where orientation does not count.
        record: The numbers, one PROBLEM record, shape (1,).
        starts: Start poses for the first frame, shape (K, n) [rad].
    """

    P: Array
    R: Array
    record: NDArray[np.void]
    starts: Array

    @cached_property
    def arrays(self) -> ProblemArrays:
        """The problem as the kernels read it."""
        return ProblemArrays(self.P, self.R, self.starts, self.record)

    @property
    def frames(self) -> int:
        """Number of frames T."""
        return len(self.P)

    @property
    def points(self) -> int:
        """Number of points m."""
        return int(self.P.shape[1])

    @property
    def prismatic(self) -> tuple[bool, ...]:
        """Which joints slide, n of them."""
        return tuple(bool(slides) for slides in self.record[0]["slides"][: self.dof])

    def with_joints(self, prismatic: Sequence[bool]) -> Problem:
        """The same problem for an arm some of whose joints slide; their limits are in metres.

        Args:
            prismatic: Which do, n of them.
        """
        record = self.record.copy()
        record[0]["slides"][: self.dof] = prismatic
        return replace(self, record=record)

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return int(self.starts.shape[1])


def make_problem(
    P: ArrayLike,
    R: ArrayLike | None,
    dt: float,
    limits: ArrayLike,
    fitness: Fitness,
    solver: Solver,
) -> Problem:
    """Put a problem together.

    Args:
        P: Points relative to the base, shape (T, m, 3) [m].
        R: Hand rotations, shape (T, 3, 3), or None.
        dt: Time between frames [s].
        limits: Joint limits, shape (n, 2) [rad].
        fitness: Settings of the fitness; weights and orientation_weight must be resolved (see resolve_weights).
        solver: Settings of the solver.

    Raises:
        TaskError: Too many points, or an orientation weight without orientation.
        SettingsError: The weights do not fit the points.
    """
    points = np.array(P, dtype=float, order="C")  # a writable copy: Numba compiles read-only arrays anew
    bounds = np.asarray(limits, dtype=float)
    m = points.shape[1]
    if m > MAX_POINTS:
        raise TaskError(f"the task has {m} points", value=m, allowed=f"1 to {MAX_POINTS}")
    w_0 = fitness.orientation_weight or 0.0
    if len(fitness.weights) != m:
        raise SettingsError(f"there are {len(fitness.weights)} weights for {m} points", allowed=f"{m} weights")
    if w_0 > 0.0 and R is None:
        raise TaskError(f"orientation_weight is {w_0:g}, but the task has no orientation", value=w_0)
    record = np.zeros(1, dtype=PROBLEM)
    fill_fitness(record[0], fitness, m, dt)
    effort = start_effort(solver, len(bounds))
    fill_solver(record[0], solver, bounds, effort)
    rotations = np.eye(3)[None] if R is None or w_0 == 0.0 else R
    return Problem(points, np.array(rotations, dtype=float, order="C"), record, start_poses(effort.starts, bounds))


def fill_fitness(record: np.void, fitness: Fitness, m: int, dt: float) -> None:
    """Write the fitness settings into a PROBLEM record, in metres and radians."""
    for name, hand in (
        ("weights", fitness.weights[-1]),
        ("descent_weights", DESCENT_HAND),
        ("polish_weights", POLISH_HAND),
    ):
        record[name][:m] = fitness.weights
        record[name][m - 1] = hand
    record["w_0"] = fitness.orientation_weight or 0.0
    record["free"], record["start_free"] = m - 1 if fitness.tie_hand else m, m - 1
    record["metric"] = METRICS.index(fitness.orientation_metric)
    record["mount"] = MOUNT_START if fitness.mount == "start" else MOUNT_IDENTITY
    record["lambda_f"], record["lambda_E"] = fitness.lambda_f, fitness.lambda_E
    record["delta"], record["reach"] = fitness.delta, fitness.reach_tolerance
    record["every"] = fitness.reach_frames == "all"
    degrees = fitness.continuity if fitness.continuity_speed is None else fitness.continuity_speed * dt
    record["radius"] = np.deg2rad(degrees)  # eps of eq. 4, a speed times dt where one is given


def fill_solver(record: np.void, solver: Solver, limits: Array, effort: StartEffort) -> None:
    """Write the solver settings and the joint limits into a PROBLEM record."""
    n = len(limits)
    record["lower"][:n], record["upper"][:n] = limits[:, 0], limits[:, 1]
    record["tolerance"], record["floor"] = solver.tolerance, solver.floor
    record["max_steps"], record["descents"] = solver.max_steps, effort.descents
    record["finalists"] = effort.finalists
    record["start_paths"] = solver.start_paths
    record["second_order"] = solver.second_order


def resolve_weights(fitness: Fitness, m: int) -> tuple[float, tuple[float, ...]]:
    """The weights (w_0, (w_1..w_m)): those given, else the scenario's.

    The packaging weights grow in proportion along the arm, so they extend to any number of points.

    Raises:
        SettingsError: The weights do not fit the points or do not sum to 1.
    """
    w_0, preset = SCENARIOS[fitness.scenario]
    if fitness.scenario == "packaging":
        # w_i proportional to i, as 1/6, 1/3, 1/2 are
        preset = tuple(np.arange(1.0, m + 1) / (m * (m + 1) / 2)) if m != len(preset) else preset
    weights = fitness.weights or preset
    if fitness.orientation_weight is not None:
        w_0 = fitness.orientation_weight
    elif fitness.weights:
        w_0 = 0.0 if abs(sum(weights) - 1.0) < 1e-3 else w_0
    shown = ", ".join(f"{w:g}" for w in weights)
    if len(weights) != m:
        raise SettingsError(
            f"there are {len(weights)} weights ({shown}) for {m} points",
            value=weights,
            allowed=f"{m} weights w_1..w_{m}, or {m + 1} with the orientation's w_0 first",
        )
    if abs(w_0 + sum(weights) - 1.0) > 1e-3:
        raise SettingsError(
            f"the weights w_0 = {w_0:g} and {shown} sum to {w_0 + sum(weights):g}", value=weights, allowed="a sum of 1"
        )
    if weights[-1] + w_0 <= 0.0:
        raise SettingsError("the hand, the last point, has no weight", value=weights, allowed="w_m > 0")
    return w_0, tuple(float(w) for w in weights)


class StartEffort(NamedTuple):
    """How the start pose is sought (method section 4).

    Attributes:
        starts: Start poses that are looked at.
        descents: How many of them, the best, are roughly solved from.
        finalists: How many of the outcomes, the best that differ, are solved to the end.
    """

    starts: int
    descents: int
    finalists: int


def start_effort(solver: Solver, dof: int) -> StartEffort:
    """The effort as set, else by the number of joints: the more joints, the more basins the first frame has.

    The figures are about the least with which the best known start is found for 99 % of random designs; see
    benchmarks for the share. Beyond five joints it is less.
    """
    descents = solver.descents or (24 if dof <= 3 else {4: 64, 5: 192}.get(dof, 256))
    return StartEffort(
        starts=solver.starts or max(128, 2 * descents),
        descents=descents,
        finalists=solver.finalists or max(6 if dof <= 5 else 12, solver.start_paths),
    )


def start_poses(count: int, limits: Array) -> Array:
    """Low-discrepancy start poses, the same for every candidate (method section 4).

    The additive recurrence frac(1/2 + k g^-j), with g the root of g^(n+1) = g + 1 (the R_n sequence), scaled to the
    joint limits.

    Args:
        count: Number of poses K.
        limits: Joint limits, shape (n, 2) [rad].

    Returns:
        Shape (K, n) [rad].
    """
    n = len(limits)
    root = 1.0  # fixed point g = (1 + g)^(1 / (n + 1)); 64 rounds reach the last bit
    for _ in range(64):
        root = (1.0 + root) ** (1.0 / (n + 1))
    steps = root ** -np.arange(1.0, n + 1)
    unit = (0.5 + np.arange(count)[:, None] * steps) % 1.0
    return np.ascontiguousarray(limits[:, 0] + unit * (limits[:, 1] - limits[:, 0]))
