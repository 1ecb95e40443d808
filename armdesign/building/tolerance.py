"""How sure a built arm is of its accuracy: what deviations of its dimensions do to the hand's error and to clearance.

Every entry of the DH table, theta included, deviates on its own: lengths a and d, twists alpha, zeros theta. Of a
tolerance t a Gaussian deviation has the standard deviation t / 2, so that 95 % of the parts are within it; a uniform
one, anything up to t, has t / sqrt(3).

**First order.** The tool moves by J_t delta at frame t; its root mean square over frames and arms is

    u^2 = sum_k sigma_k^2 mean_t |J_tk|^2,

a sum over dimensions: the budget. **Monte Carlo** draws arms, without calibration on the nominal arm's joint path, and
with it, where the dimensions are measured and the path is solved again for the arm as made.

**Clearance** is that of the exact bodies, modules moved along with their joints, in the frames in which the arm as
designed comes nearest to itself and to obstacles; its first order, c(delta) = c + g . delta, in the nearest of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.bodies.arm_body import arm_body
from armdesign.bodies.exact import ExactScene
from armdesign.errors import DesignError, SettingsError
from armdesign.feasibility.verdict import exact_obstacles
from armdesign.fitness.block import BlockEvaluator, as_rows, batch_of
from armdesign.kinematics.dh import DHTable
from armdesign.search.design_problem import Demonstration
from armdesign.search.evaluation import PathEvaluation
from armdesign.search.result import Result

COLUMNS = ("alpha", "a", "d", "theta")
PARTS = ("twist", "length", "length", "zero")
"""The tolerance that holds of each column."""
FRAMES = 60
"""Frames of each demonstration that arms are drawn on, evenly spread, and those are looked at that are worst."""
CALIBRATED = 200
"""Most arms whose path is solved again."""
CLEARED = 100
"""Most arms whose clearance is measured."""
NEAR = 2
"""Frames of each demonstration in which that is done, for the arm's own bodies and for obstacles."""
CLEARANCE_STEP = 1e-5
"""Step of the central differences of a clearance, which is exact to 1e-9 m [rad; m]."""
CHUNK = 500
"""Arms drawn at once."""
STEP = 1e-6
"""Step of the central differences [rad; m]."""


@dataclass(frozen=True)
class Tolerances:
    """How far dimensions may deviate, and how many arms are drawn.

    Attributes:
        length: Of a and d [m].
        twist: Of alpha [rad].
        zero: Of theta [rad].
        samples: Arms that are drawn.
        uniform: Whether deviations are uniform, not Gaussian: all or none, or those named, "length", "twist", "zero".
        seed: Of the random numbers.
        links: Tolerances of every link's length and twist, over the ones above, n + 1 pairs [m, rad]; none for those.
    """

    length: float = 0.5e-3
    twist: float = float(np.deg2rad(0.2))
    zero: float = float(np.deg2rad(0.1))
    samples: int = 10000
    uniform: bool | Sequence[str] = False
    seed: int = 0
    links: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            SettingsError: A value is not allowed.
        """
        for name, value, high in (
            ("--length", self.length, 0.1), ("--twist", self.twist, 0.5), ("--zero", self.zero, 0.5)
        ):  # fmt: skip
            if not 0.0 <= value <= high:
                raise SettingsError(f"{name} is {value:g} in metres or radians", value=value, allowed=f"0 to {high:g}")
        if self.length == self.twist == self.zero == 0.0:
            raise SettingsError("no dimension deviates: every tolerance is 0", value=0.0, allowed="one above 0")
        if not 10 <= self.samples <= 10**6:
            raise SettingsError(f"--samples is {self.samples}", value=self.samples, allowed="10 to 1000000")
        for name in () if isinstance(self.uniform, bool) else self.uniform:
            if name not in PARTS:
                raise SettingsError(f"uniform deviations of {name!r}", value=name, allowed=", ".join(set(PARTS)))

    @property
    def evenly(self) -> NDArray[np.bool_]:
        """Which columns of a table deviate uniformly, shape (4,)."""
        chosen = PARTS * self.uniform if isinstance(self.uniform, bool) else self.uniform
        return np.isin(PARTS, tuple(chosen))

    def sigmas(self, dof: int) -> Array:
        """Standard deviations of the entries of an arm's table, shape (n + 1, 4) [rad, m, m, rad]."""
        each = np.tile([self.twist, self.length, self.length, self.zero], (dof + 1, 1))
        if self.links:
            each[:, 1:3] = [[length] * 2 for length, _ in self.links]
            each[:, 0] = [twist for _, twist in self.links]
        return each / np.where(self.evenly, np.sqrt(3.0), 2.0)

    def drawn(self, rng: np.random.Generator, sigmas: Array, count: int) -> Array:
        """Deviations of arms, shape (count, n + 1, 4)."""
        shape, evenly = (count, *sigmas.shape), self.evenly
        if not evenly.all():
            units = rng.standard_normal(shape)
        if evenly.any():
            even = np.sqrt(3.0) * rng.uniform(-1.0, 1.0, shape)
            units = even if evenly.all() else np.where(evenly, even, units)
        deviations: Array = sigmas * units
        return deviations


@dataclass(frozen=True)
class Share:
    """What one dimension adds.

    Attributes:
        name: The dimension, such as ``alpha_2``.
        moved: How far it moves the tool, root mean square over frames and arms [m].
    """

    name: str
    moved: float


@dataclass(frozen=True)
class Band:
    """The largest hand error of an arm, over arms [m]: that of the arm as designed, the median, and what 95 % keep."""

    nominal: float
    median: float
    p95: float


@dataclass(frozen=True)
class ClearanceBand:
    """Between bodies at the nearest, over arms [m]: that of the arm as designed, the median, what 95 % of them keep.

    Attributes:
        nominal: Of the arm as designed, in the frames looked at.
        median: Of the arms drawn.
        p5: What 95 % of them keep.
        sigma: Its standard deviation in first order where the arm as designed is nearest.
        arms: Arms that it was measured of.
    """

    nominal: float
    median: float
    p5: float
    sigma: float
    arms: int


@dataclass(frozen=True)
class ToleranceReport:
    """What tolerances do to an arm.

    Attributes:
        band: Without calibration.
        calibrated: With it; None where no arm has found its path.
        moved: How far the tool moves from where the nominal arm's is, root mean square over frames and arms, by the
            arms drawn [m].
        first_order: The same in first order [m].
        budget: Every dimension's part in that, largest first.
        arms: Arms drawn, and those whose path was solved again.
        clearance: Of the first arms drawn, without calibration; None of an arm without bodies.
        calibrated_clearance: Of the same with it.
    """

    band: Band
    calibrated: Band | None
    moved: float
    first_order: float
    budget: tuple[Share, ...]
    arms: tuple[int, int]
    clearance: ClearanceBand | None = None
    calibrated_clearance: ClearanceBand | None = None


def tool_points(rows: Array, yaw: float, q: Array, sliding: Sequence[bool]) -> Array:
    """Where the tools of many arms are on a joint path, shape (S, T, 3) [m].

    Args:
        rows: DH rows (alpha, a, d, theta), tool last, shape (S, n + 1, 4).
        yaw: Their base yaw [rad].
        q: The path, shape (T, n), or one for each arm, shape (S, T, n) [rad; m of joints that slide].
        sliding: Which joints slide, n of them.
    """
    shape = (len(rows), q.shape[-2])
    x, y, z = (np.zeros(shape) for _ in range(3))
    for i in range(rows.shape[1] - 1, -1, -1):
        alpha, a, d, theta = (rows[:, None, i, k] for k in range(4))
        motion = np.zeros(shape[1]) if i == rows.shape[1] - 1 else q[..., i]
        turn, lift = (theta, d + motion) if i < len(sliding) and sliding[i] else (theta + motion, d)
        x, y, z = x * np.cos(turn) - y * np.sin(turn) + a, x * np.sin(turn) + y * np.cos(turn), z + lift
        y, z = y * np.cos(alpha) - z * np.sin(alpha), y * np.sin(alpha) + z * np.cos(alpha)
    return np.stack([x * np.cos(yaw) - y * np.sin(yaw), x * np.sin(yaw) + y * np.cos(yaw), z], axis=2)


def sensitivities(table: DHTable, q: Array) -> Array:
    """Derivatives of the tool's place by every entry of the table, shape (T, 3, n + 1, 4), by central differences.

    Args:
        table: The arm.
        q: Joint path, shape (T, n).
    """
    rows, _ = as_rows([table])
    size = rows[0].size
    steps = STEP * np.eye(size).reshape(size, *rows[0].shape)
    ends = (tool_points(rows + sign * steps, table.base_yaw, q, table.prismatic) for sign in (1.0, -1.0))
    above, below = ends
    slopes: Array = ((above - below) / (2.0 * STEP)).transpose(1, 2, 0).reshape(len(q), 3, *rows[0].shape)
    return slopes


def tolerance(result: Result, tolerances: Tolerances | None = None) -> ToleranceReport:
    """What tolerances do to a finished arm.

    Args:
        result: The arm with its paths.
        tolerances: How far its dimensions may deviate.
    """
    chosen, table = tolerances or Tolerances(), result.table
    pairs = list(zip(result.problem.demonstrations, result.evaluation.demonstrations, strict=True))
    taken = [looked_at(*pair) for pair in pairs]
    q = np.concatenate([scored.path.q[frames] for (_, scored), frames in zip(pairs, taken, strict=True)])
    hand = np.concatenate([shown.task.P[frames, -1] for (shown, _), frames in zip(pairs, taken, strict=True)])
    sigmas = chosen.sigmas(table.dof)
    J = sensitivities(table, q)
    parts = sigmas * np.sqrt(np.mean(np.sum(J**2, axis=1), axis=0))
    labels = [*map(str, range(table.dof)), "tool"]
    budget = [Share(f"{COLUMNS[k]}_{labels[i]}", float(parts[i, k])) for i in range(len(labels)) for k in range(4)]
    rows, rng = as_rows([table])[0], np.random.default_rng(chosen.seed)
    at = tool_points(rows, table.base_yaw, q, table.prismatic)
    errors, squares, first = [], 0.0, np.zeros((0, *sigmas.shape))
    for start in range(0, chosen.samples, CHUNK):
        deviations = chosen.drawn(rng, sigmas, min(CHUNK, chosen.samples - start))
        points = tool_points(rows + deviations, table.base_yaw, q, table.prismatic)
        errors.append(np.linalg.norm(points - hand, axis=2).max(axis=1))
        squares += float(np.sum((points - at) ** 2)) / len(q)
        first = np.concatenate([first, deviations[: max(CALIBRATED - len(first), 0)]])
    nominal = float(np.linalg.norm(at[0] - hand, axis=1).max())
    again = [resolved(table, rows + first, *pair) for pair in pairs]
    worst = np.max([each for each, _ in again], axis=0)
    met = np.isfinite(worst)
    near, own, calibrated = near_spots(result), None, None
    if near:
        sigma = clearance_sigma(result, near, sigmas)
        nearest, made = float(gaps(result, near, rows)[0]), (rows + first)[:CLEARED]
        own = clearance_band(nearest, gaps(result, near, made), sigma)
        solved = [path for _, path in again]
        kept = np.flatnonzero(met[:CLEARED])
        if len(kept):
            moved = [[spot._replace(q=solved[spot.shown][i, spot.frame]) for spot in near] for i in kept]
            found = np.concatenate([gaps(result, each, made[i : i + 1]) for i, each in zip(kept, moved, strict=True)])
            calibrated = clearance_band(nearest, found, sigma)
    worst = worst[met]
    return ToleranceReport(
        band_of(nominal, np.concatenate(errors)),
        band_of(nominal, np.asarray(worst, dtype=float)) if len(worst) else None,
        float(np.sqrt(squares / chosen.samples)),
        float(np.sqrt(np.sum(parts**2))),
        tuple(sorted(budget, key=lambda share: -share.moved)),
        (chosen.samples, len(worst)),
        own,
        calibrated,
    )


class Spot(NamedTuple):
    """A frame in which bodies come near to one another.

    Attributes:
        shown: Number of the demonstration.
        frame: Its frame.
        q: Joint angles there, shape (n,) [rad; m of joints that slide].
    """

    shown: int
    frame: int
    q: Array


def near_spots(result: Result) -> list[Spot]:
    """The frames in which an arm comes nearest to itself and to obstacles, nearest first; none without bodies."""
    spots: dict[tuple[int, int], tuple[float, Spot]] = {}
    if result.problem.settings.body.kind == "thin":
        return []
    for k, scored in enumerate(result.evaluation.demonstrations):
        scene = ExactScene(result.body, exact_obstacles(result.problem.demonstrations[k].obstacles),
                           result.base_pose.matrix)  # fmt: skip
        for clearance in (scene.self_clearance(scored.path.q), scene.obstacle_clearance(scored.path.q)):
            if clearance is None:
                continue
            for frame in np.argsort(clearance.each, kind="stable")[:NEAR].tolist():
                spot = (float(clearance.each[frame]), Spot(k, frame, scored.path.q[frame]))
                spots[k, frame] = min(spots.get((k, frame), spot), spot, key=lambda one: one[0])
    return [spot for _, spot in sorted(spots.values(), key=lambda one: one[0])]


def gaps(result: Result, spots: Sequence[Spot], rows: Array) -> Array:
    """Least clearance of arms as made over frames, shape (S,) [m].

    Args:
        result: The arm as designed, whose modules move along with their joints.
        spots: The frames.
        rows: DH rows (alpha, a, d, theta), tool last, shape (S, n + 1, 4).
    """
    table, options = result.table, result.problem.settings.body
    obstacles = [
        [each._replace(poses=each.pose_at(spot.frame))
         for each in exact_obstacles(result.problem.demonstrations[spot.shown].obstacles)]
        for spot in spots
    ]  # fmt: skip
    least = np.full(len(rows), np.inf)
    for k, made in enumerate(rows):
        slides = np.asarray(result.slides) + made[:-1, 2] - table.d[:-1]
        own = DHTable.from_rows(made, table.base_yaw, table.joints)
        arm = arm_body(own, options, slides, result.limits, placed=result.placed, side=result.plate_side)
        for spot, around in zip(spots, obstacles, strict=True):
            scene = ExactScene(arm, around, result.base_pose.matrix)
            for clearance in (scene.self_clearance(spot.q[None]), scene.obstacle_clearance(spot.q[None])):
                if clearance is not None:
                    least[k] = min(least[k], float(clearance.each[0]))
    return least


def clearance_sigma(result: Result, spots: Sequence[Spot], sigmas: Array) -> float:
    """Standard deviation of the clearance in first order, in the nearest frame, by central differences [m].

    Args:
        result: The arm.
        spots: The frames, nearest first.
        sigmas: Standard deviations of the entries of its table, shape (n + 1, 4).
    """
    rows, _ = as_rows([result.table])
    steps = CLEARANCE_STEP * np.eye(rows[0].size).reshape(-1, *rows[0].shape)
    above, below = (gaps(result, spots[:1], rows + sign * steps) for sign in (1.0, -1.0))
    slopes = (above - below) / (2.0 * CLEARANCE_STEP)
    return float(np.sqrt(np.sum((slopes * sigmas.ravel()) ** 2)))


def clearance_band(nominal: float, found: Array, sigma: float) -> ClearanceBand:
    """The band of clearances found, shape (S,), of arms, and of the nominal one, with sigma in first order [m]."""
    return ClearanceBand(nominal, float(np.median(found)), float(np.percentile(found, 5.0)), sigma, len(found))


def looked_at(shown: Demonstration, scored: PathEvaluation) -> Array:
    """Numbers of frames evenly spread over a demonstration, with the one in which the hand's error is largest."""
    count = len(scored.path.q)
    worst = int(np.argmax(scored.path.distance[:, -1]))
    even = np.linspace(0, len(shown.task.time) - 1, min(FRAMES, count)).round().astype(np.intp)
    return np.unique(np.append(even, worst))


def resolved(table: DHTable, rows: Array, shown: Demonstration, scored: PathEvaluation) -> tuple[Array, Array]:
    """The largest hand error of arms as made, their paths solved again, and the paths.

    Args:
        table: The arm as designed.
        rows: Those as made, shape (S, n + 1, 4).
        shown: The demonstration.
        scored: The path of the arm as designed, whose start and mount hold.

    Returns:
        The errors, shape (S,), infinite where there is no path [m]; the paths, shape (S, T, n).
    """
    count, path = len(rows), scored.path
    poses, mounts = np.tile(path.q[0], (count, 1)), np.tile(path.mount, (count, 1, 1))
    batch = batch_of(rows, np.full(count, table.base_yaw), None, poses, mounts)
    _, paths = BlockEvaluator(shown.path_problem).with_paths(batch)
    points = tool_points(rows, table.base_yaw, paths, table.prismatic)
    worst: Array = np.linalg.norm(points - shown.task.P[None, :, -1], axis=2).max(axis=1)
    return np.where(np.isfinite(worst), worst, np.inf), paths


def band_of(nominal: float, errors: Array) -> Band:
    """The band of largest errors, shape (S,) [m], of arms."""
    return Band(nominal, float(np.median(errors)), float(np.percentile(errors, 95.0)))


@dataclass(frozen=True)
class Importance:
    """What an entry of the design means to r.

    Attributes:
        name: The entry.
        value: What it is [rad; m].
        step: How far it was moved either way [rad; m].
        worse: By how much r grows, the larger of both ways; infinite where the arm then does not begin the task [m].
    """

    name: str
    value: float
    step: float
    worse: float


def importance(result: Result, length: float = 1e-3, angle: float = float(np.deg2rad(1.0))) -> tuple[Importance, ...]:
    """Which entries of a design matter for r, most important first: each moved both ways, the path solved again.

    Args:
        result: The arm.
        length: How far lengths are moved [m].
        angle: How far angles are moved [rad].

    Raises:
        DesignError: The arm is outside the bounds of its settings.
    """
    problem = result.problem.in_room
    space, Phi = problem.space, problem.space.phi(result.table, result.problem.first.base)
    names = space.free_names
    steps = np.where(space.angular, angle, length)
    lower, upper = space.bounds
    moved = np.concatenate([np.clip(Phi + sign * np.diag(steps), lower, upper) for sign in (1.0, -1.0)])
    scores, _ = problem.objective().evaluate(np.vstack([Phi, moved]))
    worse = (scores.fitness[1:] - scores.fitness[0]).reshape(2, -1).max(axis=0)
    if not np.isfinite(scores.fitness[0]):
        raise DesignError(
            "the arm is none of those that its settings search for: it is outside their bounds", value=result.name,
            fix="Widen [design] in its settings, or take the run of a search",
        )  # fmt: skip
    columns = zip(names, Phi.tolist(), steps.tolist(), worse.tolist(), strict=True)
    found = [Importance(*column) for column in columns]
    return tuple(sorted(found, key=lambda each: -each.worse))
