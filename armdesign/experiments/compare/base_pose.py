"""Where to mount a ready-made arm: the base pose with the least fitness r, by a seeded search.

Low-discrepancy base poses all over the box are looked at roughly, with few start poses; from the best of them and the
plain pose, the base at the shoulder without a turn, a particle swarm (eq. 7) goes on with the fitness proper. What is
returned is its best, so it is never worse than the plain pose. Where the settings give places for the base, the same
search goes through each of them in the place of the box around the shoulder, and the best of all counts.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration import Task
from armdesign.errors import SettingsError
from armdesign.experiments.compare.polyline_arm import PolylineEvaluator, arm_problem
from armdesign.experiments.compare.serial_arm import SerialArm
from armdesign.fitness.block import PathResult, Scores
from armdesign.fitness.problem import StartEffort, start_poses
from armdesign.settings.place import Site
from armdesign.settings.sections import Fitness, Solver
from armdesign.swarm import PSO, Box, SearchSpace

PARTICLES = 24
FACTORS = {"inertia": 0.6, "c1": 0.8, "c2": 0.8}
"""Factors of eq. 7; with so few moves the swarm has to draw together sooner than the published ones make it."""
ROUGH = StartEffort(starts=128, descents=32, finalists=3)
"""Effort for the start pose in the first look."""
EVALUATIONS, HALF_WIDTH = 1000, 0.5
PLAIN = np.zeros(4)
"""The base at the shoulder, without a turn."""


@dataclass(frozen=True)
class BaseSearch:
    """How the base pose is searched.

    Attributes:
        evaluations: Base poses that are tried, about.
        half_width: Half the width of the box around the shoulder that the base is sought in [m].
        seed: Seed of the random numbers.
    """

    evaluations: int = EVALUATIONS
    half_width: float = HALF_WIDTH
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            SettingsError: One is out of range.
        """
        if not 1 <= self.evaluations <= 10**6:
            raise SettingsError(
                f"{self.evaluations} base poses are to be tried", value=self.evaluations, allowed="1 to 1000000"
            )
        if not 0.0 <= self.half_width <= 10.0:
            raise SettingsError(
                f"the box for the base is {self.half_width:g} m wide to each side", value=self.half_width,
                allowed="0 to 10 m",
            )  # fmt: skip
        if self.seed < 0:
            raise SettingsError(f"the seed is {self.seed}", value=self.seed, allowed="0 or more")


@dataclass(frozen=True)
class BaseProgress:
    """How far the search for a base pose is."""

    evaluations: int  # base poses tried
    total: int  # base poses to try
    fitness: float  # the best r so far, infinite while no pose reaches the start [m]


@dataclass(frozen=True, eq=False)
class Mounting:
    """A ready-made arm where it does best."""

    base: Array  # base pose (x, y, z, yaw) in the task's frame, shape (4,) [m, rad]
    scores: Scores  # fitness there, one entry each
    path: PathResult  # path there; empty if no pose reaches the start
    evaluations: int  # base poses tried
    mounted: str = "floor"  # what the base is mounted on: floor, wall or ceiling


class Region(NamedTuple):
    """Base poses (x, y, z, yaw) among which the best is sought."""

    lower: Array  # lower bounds, shape (4,) [m, rad]
    upper: Array  # upper bounds, shape (4,) [m, rad]
    first: Array  # the pose that is tried first, shape (4,)


def mount_arm(
    arm: SerialArm,
    task: Task,
    fitness: Fitness,
    solver: Solver,
    base_search: BaseSearch | None = None,
    on_progress: Callable[[BaseProgress], None] | None = None,
    sites: Sequence[Site] = (),
) -> Mounting:
    """Search the base pose of a ready-made arm for a task.

    Args:
        arm: The arm.
        task: The task.
        fitness: Settings of the fitness with resolved weights.
        solver: Settings of the solver.
        base_search: Effort, box and seed.
        on_progress: Called after every round.
        sites: Where the base may stand; by default in the search's box around the shoulder.
    """
    search = base_search or BaseSearch()
    rng = np.random.default_rng(search.seed)
    frames = (task.P, task.R, task.dt, fitness)
    full = PolylineEvaluator(arm_problem(arm, *frames, solver), arm)
    rough = full.on(arm_problem(arm, *frames, replace(solver, **ROUGH._asdict())))
    if not sites:
        half = np.r_[np.full(3, search.half_width), np.pi]
        return RegionSearch(Region(-half, half, PLAIN), search, rng, rough, full, on_progress).best()
    share = replace(search, evaluations=max(1, search.evaluations // len(sites)))
    found = []
    for site in sites:
        lower, upper = np.array([site.x, site.y, site.z, site.yaw]).T
        region = Region(lower, upper, (lower + upper) / 2.0)
        part = RegionSearch(region, share, rng, rough.at(site), full.at(site), on_progress)
        found.append(replace(part.best(), mounted=site.mounted))
    tried = sum(each.evaluations for each in found)
    best = min(found, key=lambda each: (float(each.scores.fitness[0]), float(each.scores.start_error[0])))
    return replace(best, evaluations=tried)


def spread_poses(region: Region, search: BaseSearch, rng: np.random.Generator) -> Array:
    """Base poses all over a region, its first one first; half of all that are to be tried, shape (N, 4)."""
    count = max(1, search.evaluations // 2)
    unit = (start_poses(count, np.tile([0.0, 1.0], (4, 1))) + rng.random(4)) % 1.0
    middle, half = (region.upper + region.lower) / 2.0, (region.upper - region.lower) / 2.0
    poses = middle + (2.0 * unit - 1.0) * half
    poses[0] = region.first
    return np.asarray(poses)


@dataclass(frozen=True)
class RegionSearch:
    """The search for the best base pose in one region."""

    region: Region
    search: BaseSearch
    rng: np.random.Generator
    rough: PolylineEvaluator  # with the effort of the first look
    full: PolylineEvaluator  # with the fitness proper
    on_progress: Callable[[BaseProgress], None] | None  # called after every round

    def best(self) -> Mounting:
        """The best base pose."""
        poses = spread_poses(self.region, self.search, self.rng)
        looks = self.look(poses)
        best = np.lexsort((looks.start_error, looks.fitness))
        particles = poses[best[:PARTICLES]]
        if 0 not in best[:PARTICLES]:
            particles[-1] = self.region.first
        base, tried = self.swarm(particles)
        if base is None:  # no pose reaches the start
            base = poses[best[0]]
        base = np.r_[base[:3], np.pi - np.mod(np.pi - base[3], 2.0 * np.pi)]
        scores, path = self.full.follow_from(base)
        return Mounting(base, scores, path, len(poses) + tried)

    def look(self, poses: Array) -> Scores:
        """Scores of base poses, shape (N, 4) [m, rad], with few start poses each."""
        parts = []
        for first in range(0, len(poses), 2 * PARTICLES):
            parts.append(self.rough.scores(poses[first : first + 2 * PARTICLES]))
            done = min(first + 2 * PARTICLES, len(poses))
            if self.on_progress is not None:
                best = min(float(part.fitness.min()) for part in parts)
                self.on_progress(BaseProgress(done, self.search.evaluations, best))
        return Scores(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])})

    def swarm(self, particles: Array) -> tuple[Array | None, int]:
        """Best base pose of a swarm from such poses, shape (N, 4), or None where none reaches the start; tried poses.

        A turn may go beyond half a turn either way, so that the swarm meets no wall there.
        """
        lower, upper, total = self.region.lower.copy(), self.region.upper.copy(), self.search.evaluations
        if upper[3] - lower[3] >= 2.0 * np.pi - 1e-9:
            lower[3], upper[3] = -2.0 * np.pi, 2.0 * np.pi
        box = Box(lower, upper, np.array([False, False, False, True]))
        before = max(1, total // 2)
        rounds = max(1, (total - before) // len(particles))
        parameters = PSO.Parameters(particles=len(particles), iterations=rounds, **FACTORS)
        swarm = PSO(SearchSpace(box, sample=lambda _rng, _count: particles), self.rng, parameters)
        for k in range(rounds):
            scores = self.full.scores(swarm.ask(), swarm.cutoff)
            swarm.tell(scores.fitness, scores.valid)
            if self.on_progress is not None:
                done = total if k == rounds - 1 else min(before + (k + 1) * len(particles), total)
                self.on_progress(BaseProgress(done, total, swarm.best_fitness))
        best = swarm.best_position if np.isfinite(swarm.best_fitness) else None
        return best, rounds * len(particles)
