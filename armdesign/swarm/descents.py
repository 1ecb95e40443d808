"""Many local descents side by side: gradients, quasi-Newton steps in a box and a slab.

Every descent is at its own place; all of them ask at once, phase by phase:

    SLOPE    where they begin, their gradients are asked for; without an answer they probe from then on
    PROBE    forward differences around each that has moved (RETRY: in the other direction where there was no value)
    STEP     one step of each, taken where it is better; with gradients the next phase is STEP again, else PROBE

A step that is not taken teaches something, too: the change of the gradient along it, which across a kink is steep, so
that the next one goes along the kink (Lewis and Overton 2013, Nonsmooth optimization via quasi-Newton methods). What a
descent costs beyond its gain is cut: after a few rounds the worse ones are given up, later those that hardly move.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.swarm.checks import Mask, SavedState
from armdesign.swarm.space import Region, project

SLOPE, PROBE, RETRY, STEP = "slope", "probe", "retry", "step"
REACH = 3e-4
"""Length of the probes in unit coordinates: far above the solver's tolerance, far below a basin's width."""
STEEPEST = 50.0
"""Largest slope taken seriously: beyond it the probe has met a jump."""
LONGEST, SHORTEST = 0.3, 1e-6
"""Largest step, and the length below which a descent has ended, in unit coordinates."""
GROW, SHRINK = 2.0, 0.5
GOOD, POOR = 0.5, 0.2
"""Shares of the gain which the model promises, from which the next step may be longer, or below which shorter."""
ACTIVE_SETS, SETS_AT_ONCE = 25, 6
"""Active sets tried for a step, and how many of them may differ from the one before in more than one entry."""
SOFT, ROUNDING = 1e-12, 1e-12
"""What keeps a slab that nothing can move along from being singular; how far beyond a bound is none."""
ROUNDS = 80
"""Rounds of accelerated projected gradients spent on a step that no active set was found for."""
DAMPED = 0.2
"""Share of the known curvature below which a change of the gradient is damped (Powell 1978)."""


@dataclass(frozen=True)
class Patience:
    """How descents begin, and when one is given up.

    Attributes:
        reach: Length of the first step in unit coordinates.
        bar: A fitness that is good enough to be among the best: not given up at ``halve_at``.
        halve_at: Round after which only the better ones go on.
        keep: Share of them.
        window: Rounds over which it has to gain ...
        gain: ... this much, relative ...
        leading_gain: ... or this much where it is among the best.
        rounds: Most rounds.
    """

    reach: float = 0.1
    bar: float = -np.inf
    halve_at: int = 8
    keep: float = 0.5
    window: int = 8
    gain: float = 0.008
    leading_gain: float = 0.002
    rounds: int = 40


class Descents:
    """M descents in lockstep, which ask and are told like a search; L of them are live.

    Attributes:
        phase: What they ask for next.
        sloped: Whether gradients come with the values; found out in the phase SLOPE.
        U: Where they are, unit coordinates, shape (M, K).
        value: Fitness there, shape (M,).
        hint: The hint of that value, handed on with every probe, shape (M, H).
        live: Which still go on, shape (M,).
        round: Rounds done.
    """

    def __init__(
        self, region: Region, U: Array, value: Array, hint: Array, patience: Patience, *, sloped: bool = False
    ) -> None:
        """Begin.

        Args:
            region: Box and slab.
            U: Where to begin, shape (M, K).
            value: Fitness there, shape (M,).
            hint: Hints, shape (M, H).
            patience: How to begin and when to give up.
            sloped: Whether gradients may come with the values.
        """
        count, size = U.shape
        self.region, self.patience, self.sloped = region, patience, sloped
        self.U, self.value, self.hint = U.copy(), value.copy(), hint.copy()
        self.B = np.tile(np.eye(size), (count, 1, 1))  # (M, K, K), curvatures
        self.gradient = np.zeros((count, size))
        self.last = np.zeros((count, size))  # the last step, 0 where it was not taken
        self.reach = np.full(count, patience.reach)
        self.live: Mask = np.ones(count, dtype=bool)
        self.curved: Mask = np.zeros(count, dtype=bool)  # whether B has seen a change of gradient
        self.trace = value[None].copy()  # values of the last rounds, newest last
        self.round = 0
        self.phase = SLOPE
        self.signs = self.slopes = np.zeros((0, size))  # (L, K): directions of the probes; gradients known so far
        if not sloped:
            self._begin_probes()

    # ------------------------------------------------------------------ ask and tell

    def ask(self) -> tuple[Array, Array]:
        """What the present phase wants to know.

        Returns:
            Unit coordinates, shape (N, K), and hints, shape (N, H).
        """
        live, (rows, entries) = self.live, np.nonzero(self.signs)
        if self.phase == SLOPE:
            return self.U[live], self.hint[live]
        if self.phase == STEP:
            # so far inside the slab that no probe leaves it
            margin = REACH * float(self.region.weights.max(initial=0.0)) + 1e-9
            moves = best_steps(self.region, self.U[live], self.gradient[live], self.B[live], self.reach[live], margin)
            return np.clip(self.U[live] + moves, 0.0, 1.0), self.hint[live]
        owners = np.flatnonzero(live)[rows]
        U = self.U[owners]
        U[np.arange(len(rows)), entries] += self.signs[rows, entries] * REACH
        return np.clip(U, 0.0, 1.0), self.hint[owners]

    def tell(self, U: Array, values: Array, hints: Array, slopes: Array | None = None) -> None:
        """Learn from the answers to what was asked, and go to the next phase.

        Args:
            U: What was asked, shape (N, K).
            values: Fitness, +inf for none, shape (N,).
            hints: Hints, shape (N, H).
            slopes: Gradients, shape (N, K), an unknown entry is NaN; they count in the phases SLOPE and STEP.
        """
        # one slope as steep as a jump would ruin the curvature for all steps to come
        known = None if slopes is None or not self.sloped else np.clip(slopes, -STEEPEST, STEEPEST)
        if self.phase == STEP:
            self._move(U, values, hints, known)
            if self.sloped or not self._moved().any():
                return  # at the same places the gradients are known: other steps from there
            self._begin_probes()
        elif self.phase != SLOPE:
            self._take_probes(values)
        elif known is None:
            self.sloped = False
            self._begin_probes()
        else:
            self._learn(known)

    @property
    def next_size(self) -> int:
        """Number of candidates until the end of the next step, or a few more."""
        live, size = int(self.live.sum()), int(self.U.shape[1])
        if self.sloped:
            return 2 * live + 1
        return live * (size + 3) if self.phase == PROBE else live * size

    # ------------------------------------------------------------------ gradients

    def _moved(self) -> Mask:
        """Which of the live ones are at a new place, shape (L,)."""
        return np.asarray((self.last[self.live] != 0.0).any(axis=1) | (self.round == 0))

    def _begin_probes(self) -> None:
        """Probe forward, but backward at an upper bound; not where a descent has not moved: its gradient is known."""
        self.signs = np.where(self.U[self.live] + REACH > 1.0, -1.0, 1.0) * self._moved()[:, None]
        self.phase = PROBE

    def _take_probes(self, values: Array) -> None:
        """Forward differences out of the probes' values; the other direction is tried where a probe has none."""
        rows, entries = np.nonzero(self.signs)
        change = (values - self.value[np.flatnonzero(self.live)[rows]]) / (self.signs[rows, entries] * REACH)
        slopes = np.full(self.signs.shape, np.nan) if self.phase == PROBE else self.slopes.copy()
        slopes[rows, entries] = np.where(np.isfinite(change), np.clip(change, -STEEPEST, STEEPEST), np.nan)
        self.slopes = slopes
        unknown = np.isnan(slopes) & (self.signs != 0.0)
        if self.phase == PROBE and unknown.any():
            self.signs, self.phase = np.where(unknown, -self.signs, 0.0), RETRY
            return
        self._learn(slopes)

    def _learn(self, slopes: Array) -> None:
        """Take the gradients of the live ones that have moved, shape (L, K); an unknown entry counts as flat."""
        gradients = np.where(np.isnan(slopes), 0.0, slopes)
        for gradient, i, moved in zip(gradients, np.flatnonzero(self.live), self._moved(), strict=True):
            if moved:
                self._bend(int(i), self.last[i], gradient)
                self.gradient[i] = gradient
        self.phase = STEP

    def _bend(self, i: int, step: Array, gradient: Array) -> None:
        """Take the curvature that a gradient at the end of a step shows, beside the one known where it began."""
        if np.any(step):
            change = gradient - self.gradient[i]
            first = not self.curved[i]
            self.B[i] = updated(self.B[i], step, change, first=first)
            self.curved[i] |= first and float(step @ change) > 0.0

    # ------------------------------------------------------------------ steps

    def _move(self, tried: Array, values: Array, hints: Array, slopes: Array | None) -> None:
        """Take the steps that are better, learn from the others, and give up descents without prospects."""
        for k, i in enumerate(np.flatnonzero(self.live)):
            step = tried[k] - self.U[i]
            if values[k] < self.value[i]:  # any gain counts: there is no line search, the reach adapts instead
                self.reach[i] = self._next_reach(int(i), step, float(self.value[i] - values[k]))
                if slopes is not None:
                    gradient = np.where(np.isnan(slopes[k]), 0.0, slopes[k])
                    self._bend(int(i), step, gradient)
                    self.gradient[i] = gradient
                self.U[i], self.value[i], self.hint[i], self.last[i] = tried[k], values[k], hints[k], step
            else:
                if slopes is not None and np.isfinite(values[k]) and np.isfinite(slopes[k]).all():
                    self._bend(int(i), step, slopes[k])
                self.last[i] = 0.0  # it is still where it was: no new gradient, no probes
                self.reach[i] = SHRINK * min(float(np.abs(step).max()), self.reach[i])
                self.live[i] = self.reach[i] >= SHORTEST
        self.round += 1
        self.trace = np.vstack([self.trace, self.value])[-1 - self.patience.window :]
        self._give_up()

    def _next_reach(self, i: int, step: Array, gain: float) -> float:
        """Length of the next step of descent i behind one that is taken, by how much of its promised gain it brought.

        Args:
            i: The descent.
            step: The step, shape (K,).
            gain: By how much the fitness has fallen.
        """
        # a trust region: the step that the quadratic model foresaw decides how far the model is believed
        promised = -float(self.gradient[i] @ step + 0.5 * step @ self.B[i] @ step)
        size = float(np.abs(step).max())
        if gain > GOOD * promised:
            return min(max(float(self.reach[i]), GROW * size), LONGEST)
        return max(size if gain > POOR * promised else SHRINK * size, SHORTEST)

    def _give_up(self) -> None:
        """Stop descents that cost more than they can be expected to gain."""
        patience = self.patience
        if self.round == patience.halve_at and len(self.value) > 3:
            self.live &= self.value <= max(float(np.quantile(self.value, patience.keep)), patience.bar)
        if len(self.trace) > patience.window:
            wanted = np.where(self.value <= patience.bar, patience.leading_gain, patience.gain)
            self.live &= self.value <= self.trace[0] * (1.0 - wanted)
        if self.round >= patience.rounds:
            self.live[:] = False

    # ------------------------------------------------------------------ the state

    def state(self) -> dict[str, Any]:
        """Arrays and numbers to carry on from; the region is the owner's."""
        names = ("U", "value", "hint", "B", "gradient", "last", "reach", "live", "curved", "trace", "signs", "slopes")
        return {f"descents_{name}": getattr(self, name).copy() for name in names} | {
            "descents_round": self.round,
            "descents_phase": self.phase,
            "descents_patience": {  # text: inf is no JSON
                name: repr(float(value)) for name, value in asdict(self.patience).items()
            },
        }

    @classmethod
    def from_state(cls, saved: SavedState, region: Region, *, sloped: bool) -> Descents:
        """The descents that :meth:`state` described.

        Args:
            saved: The saved state.
            region: Box and slab.
            sloped: Whether gradients come with the values.
        """
        K = region.dimension
        U = saved.array("descents_U", (None, K))
        M = len(U)
        value, hint = saved.array("descents_value", (M,)), saved.array("descents_hint", (M, None), unknown=True)
        entries = dict(saved.entry("descents_patience"))
        usual = asdict(Patience())
        patience = Patience(**{name: type(value)(float(entries[name])) for name, value in usual.items()})
        descents = cls(region, U, value, hint, patience, sloped=sloped)
        shapes = {
            "B": (M, K, K),
            "gradient": (M, K),
            "last": (M, K),
            "reach": (M,),
            "trace": (None, M),
            "signs": (None, K),
        }
        for name, shape in shapes.items():
            setattr(descents, name, saved.array(f"descents_{name}", shape))
        descents.live, descents.curved = (saved.flags(f"descents_{name}", (M,)) for name in ("live", "curved"))
        descents.slopes = saved.array("descents_slopes", (None, K), unknown=True)
        descents.round = int(saved.entry("descents_round"))
        descents.phase = str(saved.entry("descents_phase"))
        return descents


def updated(B: Array, step: Array, change: Array, *, first: bool) -> Array:
    """Curvature after a step, by the damped BFGS formula (Powell 1978), which keeps it positive definite.

    Args:
        B: Curvature so far, shape (K, K).
        step: The step taken, shape (K,).
        change: Change of the gradient along it, shape (K,).
        first: Whether B is only a guess, to be scaled first to the curvature just seen.
    """
    if np.abs(step).max() < ROUNDING:  # at a minimum: what the gradient changes by is rounding
        return B
    along = float(step @ change)
    if first and along > 0.0:  # Nocedal and Wright, Numerical Optimization, eq. 6.20
        B = np.eye(len(step)) * (float(change @ change) / along)
    image = B @ step
    bent = float(step @ image)
    if along < DAMPED * bent:
        # the change is mixed with what B expects, until it shows at least that share of its curvature
        part = (1.0 - DAMPED) * bent / (bent - along)
        change = part * change + (1.0 - part) * image
    # BFGS: B s = y afterwards
    return np.asarray(B - np.outer(image, image) / bent + np.outer(change, change) / float(step @ change))


def best_steps(region: Region, U: Array, gradient: Array, B: Array, reach: Array, margin: float) -> Array:
    """Minimise g p + p B p / 2 over |p|_inf <= reach with U + p in the region, row by row.

    The active set is found by Newton's method on the conditions of optimality (Hintermueller, Ito and Kunisch 2002, The
    primal-dual active set strategy); where that goes in circles, by accelerated projected gradients. The rows go side
    by side.

    Args:
        region: Box and slab.
        U: Where the steps begin, shape (N, K).
        gradient: g, shape (N, K).
        B: Curvatures, positive definite, shape (N, K, K).
        reach: Largest step in any entry, shape (N,).
        margin: How far the steps stay inside the slab.

    Returns:
        The steps, shape (N, K).
    """
    total = U @ region.weights
    model = Models(
        gradient, B, np.maximum(-U, -reach[:, None]), np.minimum(1.0 - U, reach[:, None]),
        region.low + margin - total, region.high - margin - total,
    )  # fmt: skip
    steps, settled = active_set_steps(model, region.weights)
    rest = np.flatnonzero(~settled)
    if len(rest):
        steps[rest] = projected_steps(model.part(rest), region.weights)
    return steps


class Models(NamedTuple):
    """Quadratic models g p + p B p / 2 in a box and a slab, N of them.

    Attributes:
        gradient: g, shape (N, K).
        B: Shape (N, K, K).
        lower: Lower bounds of p, shape (N, K).
        upper: Upper bounds of p, shape (N, K).
        low: Lower bound of weights p, shape (N,).
        high: Upper bound of weights p, shape (N,).
    """

    gradient: Array
    B: Array
    lower: Array
    upper: Array
    low: Array
    high: Array

    def part(self, rows: NDArray[np.intp]) -> Models:
        """Some of them."""
        return Models(*(values[rows] for values in self))


def active_set_steps(models: Models, weights: Array) -> tuple[Array, Mask]:
    """Their minima by the primal-dual active set strategy, and which were found, shapes (N, K) and (N,).

    Args:
        models: The models.
        weights: Weights of the slab, shape (K,), none negative.
    """
    N, K = models.gradient.shape
    steps, settled = np.zeros((N, K)), np.zeros(N, dtype=bool)
    # a box beside the slab has no such minimum
    rows = np.flatnonzero((models.lower @ weights < models.high) & (models.upper @ weights > models.low))
    at_low, at_high = np.zeros((N, K), dtype=bool), np.zeros((N, K), dtype=bool)
    side = np.zeros(N)  # 1 and -1: at the upper and the lower bound of the slab
    for tried in range(ACTIVE_SETS):
        if not len(rows):
            break
        g, B, lower, upper, low, high = models.part(rows)
        down, up, edge = at_low[rows], at_high[rows], side[rows]
        held = down | up
        system, right = np.zeros((len(rows), K + 1, K + 1)), np.zeros((len(rows), K + 1))
        system[:, :K, :K] = np.where(held[:, :, None], np.eye(K), B)
        system[:, :K, K] = np.where(held, 0.0, weights)
        system[:, K, :K] = np.where(edge[:, None] != 0.0, weights, 0.0)
        system[:, K, K] = np.where(edge != 0.0, -SOFT, 1.0)
        right[:, :K] = np.where(down, lower, np.where(up, upper, -g))
        right[:, K] = np.where(edge > 0.0, high, np.where(edge < 0.0, low, 0.0))
        try:
            found = np.linalg.solve(system, right[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:  # one is so steep across a wall that along it nothing is left of the curvature
            rows = rows[np.linalg.cond(system) < 1.0 / np.finfo(float).eps]
            continue
        p, t = found[:, :K], found[:, K]
        push = g + (B @ p[:, :, None])[:, :, 0] + t[:, None] * weights  # minus the multipliers of the bounds
        total = p @ weights
        now_down = np.where(down, push >= 0.0, ~up & (p < lower - ROUNDING))
        now_up = np.where(up, push <= 0.0, ~down & (p > upper + ROUNDING))
        beyond = np.where(total > high + ROUNDING, 1.0, np.where(total < low - ROUNDING, -1.0, 0.0))
        now_edge = np.where(edge == 0.0, beyond, np.where(edge * t >= 0.0, edge, 0.0))
        if tried >= SETS_AT_ONCE:  # it may go in circles: only what is most wrong changes
            wrong = np.where(held, np.abs(push) / np.einsum("nii->ni", B), np.maximum(lower - p, p - upper))
            wrong = np.where((now_down != down) | (now_up != up), wrong, -np.inf)
            first = np.arange(K) == np.argmax(wrong, axis=1)[:, None]
            now_down, now_up = np.where(first, now_down, down), np.where(first, now_up, up)
            now_edge = np.where(np.isfinite(wrong).any(axis=1), edge, now_edge)
        same = (now_down == down).all(axis=1) & (now_up == up).all(axis=1) & (now_edge == edge)
        steps[rows] = np.clip(p, lower, upper)
        settled[rows[same]] = True
        at_low[rows], at_high[rows], side[rows] = now_down, now_up, now_edge
        rows = rows[~same]
    return steps, settled


def projected_steps(models: Models, weights: Array) -> Array:
    """Their minima by accelerated projected gradients, shape (N, K).

    Args:
        models: The models.
        weights: Weights of the slab, shape (K,).
    """
    g, B, lower, upper, low, high = models
    stiff = np.linalg.norm(B, axis=(1, 2))[:, None] + 1e-12  # the Frobenius norm bounds the largest eigenvalue
    P = ahead = np.zeros_like(g)
    t = 1.0
    for _ in range(ROUNDS):
        slope = g + (B @ ahead[:, :, None])[:, :, 0]
        P_next = project(ahead - slope / stiff, lower, upper, weights, low, high)
        # Nesterov's momentum: t grows by about 1/2 a round
        t_next = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * t * t))
        ahead = P_next + (t - 1.0) / t_next * (P_next - P)
        P, t = P_next, t_next
    return P
