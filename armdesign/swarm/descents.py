"""Many local descents side by side: gradients, quasi-Newton steps in a box and a slab.

Every descent is at its own place; all of them ask at once for one step each, which is taken where it is better.
Gradients come with the values of the steps, or from probes by forward differences. A step that is not taken teaches
something, too: the change of the gradient along it, which across a kink is steep, so that the next one goes along the
kink (Lewis and Overton 2013, Nonsmooth optimization via quasi-Newton methods). What a descent costs beyond its gain
is cut: after a few rounds the worse ones are given up, later those that hardly move.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.swarm import saved
from armdesign.swarm.checks import Mask
from armdesign.swarm.quasi_newton import best_steps, updated
from armdesign.swarm.region import Region

PROBE = 3e-4
"""Length of the probes in unit coordinates: far above the solver's tolerance, far below a basin's width."""
STEEPEST = 50.0
"""Largest slope taken seriously, as of a jump within the probe."""
LONGEST, SHORTEST = 0.3, 1e-6
GROW, SHRINK = 2.0, 0.5
GOOD, POOR = 0.5, 0.2
"""Shares of the gain which the model promises, from which the next step may be longer, or below which shorter."""


@dataclass(frozen=True)
class Patience:
    """When a descent is given up.

    Attributes:
        halve_at: Round after which only the better ones go on.
        keep: Share of them.
        window: Rounds over which it has to gain ...
        gain: ... this much, relative ...
        leading_gain: ... or this much where it is among the best.
        rounds: Most rounds.
    """

    halve_at: int = 8
    keep: float = 0.5
    window: int = 8
    gain: float = 0.008
    leading_gain: float = 0.002
    rounds: int = 40


class Descents:
    """M descents in lockstep: ask for ``probes`` or ``steps``, then tell the values of what was asked.

    Attributes:
        U: Where they are, unit coordinates, shape (M, K).
        value: Fitness there, shape (M,).
        hint: The hint of that value, handed on with every probe, shape (M, H).
        live: Which still go on, shape (M,).
        round: Rounds done.
    """

    def __init__(
        self, region: Region, U: Array, value: Array, hint: Array, reach: float, patience: Patience, bar: float
    ) -> None:
        """Begin.

        Args:
            region: Box and slab.
            U: Where to begin, shape (M, K).
            value: Fitness there, shape (M,).
            hint: Hints, shape (M, H).
            reach: Length of the first step in unit coordinates.
            patience: When to give up.
            bar: A fitness that is good enough to be among the best: not given up at ``halve_at``.
        """
        count, size = U.shape
        self.region, self.patience, self.bar = region, patience, bar
        self.U, self.value, self.hint = U.copy(), value.copy(), hint.copy()
        self.B = np.tile(np.eye(size), (count, 1, 1))
        self.gradient, self.last = np.zeros((count, size)), np.zeros((count, size))
        self.reach = np.full(count, reach)
        self.live: Mask = np.ones(count, dtype=bool)
        self.curved: Mask = np.zeros(count, dtype=bool)  # whether B has seen a change of gradient
        self.trace = value[None].copy()  # values of the last rounds, newest last
        self.round = 0

    @property
    def margin(self) -> float:
        """How far inside the slab the descents stay, so that no probe leaves it."""
        return PROBE * float(self.region.weights.max(initial=0.0)) + 1e-9

    def going(self) -> NDArray[np.intp]:
        """Indices of the live ones."""
        return np.flatnonzero(self.live)

    def moved(self) -> Mask:
        """Which of the live ones are at a new place, shape (L,)."""
        return np.asarray((self.last[self.live] != 0.0).any(axis=1) | (self.round == 0))

    def signs(self) -> Array:
        """Directions of the probes of the live ones, shape (L, K): forward, but backward at an upper bound.

        Where a descent has not moved, its gradient is known: 0, for no probe.
        """
        return np.where(self.U[self.live] + PROBE > 1.0, -1.0, 1.0) * self.moved()[:, None]

    def places(self) -> tuple[Array, Array]:
        """Where the live ones are, shape (L, K), and their hints, shape (L, H)."""
        return self.U[self.live], self.hint[self.live]

    def probes(self, signs: Array) -> tuple[Array, Array]:
        """Probes of the live ones in these directions; a direction of 0 is left out.

        Returns:
            Unit coordinates, shape (P, K), and hints, shape (P, H).
        """
        rows, entries = np.nonzero(signs)
        owners = self.going()[rows]
        U = self.U[owners]
        U[np.arange(len(rows)), entries] += signs[rows, entries] * PROBE
        return np.clip(U, 0.0, 1.0), self.hint[owners]

    def slopes(self, signs: Array, values: Array) -> Array:
        """Forward differences out of the probes' values, shape (L, K); NaN where a probe has none."""
        rows, entries = np.nonzero(signs)
        slopes = np.full(signs.shape, np.nan)
        change = (values - self.value[self.going()[rows]]) / (signs[rows, entries] * PROBE)
        slopes[rows, entries] = np.where(np.isfinite(change), np.clip(change, -STEEPEST, STEEPEST), np.nan)
        return slopes

    def learn(self, slopes: Array) -> None:
        """Take the gradients of the live ones that have moved, shape (L, K); an unknown entry counts as flat."""
        gradients = np.where(np.isnan(slopes), 0.0, slopes)
        for gradient, i, moved in zip(gradients, self.going(), self.moved(), strict=True):
            if moved:
                self._bend(int(i), self.last[i], gradient)
                self.gradient[i] = gradient

    def _bend(self, i: int, step: Array, gradient: Array) -> None:
        """Take the curvature that a gradient at the end of a step shows, beside the one known where it began."""
        if np.any(step):
            change = gradient - self.gradient[i]
            first = not self.curved[i]
            self.B[i] = updated(self.B[i], step, change, first=first)
            self.curved[i] |= first and float(step @ change) > 0.0

    def steps(self) -> tuple[Array, Array]:
        """One step of each of the live ones.

        Returns:
            Unit coordinates, shape (L, K), and hints, shape (L, H).
        """
        live = self.live
        U, reach = self.U[live], self.reach[live]
        moves = best_steps(self.region, U, self.gradient[live], self.B[live], reach, self.margin)
        return np.clip(U + moves, 0.0, 1.0), self.hint[live]

    def move(self, tried: Array, values: Array, hints: Array, slopes: Array | None = None) -> None:
        """Take the steps that are better, learn from the others, and give up whoever is out of patience.

        Args:
            tried: What ``steps`` gave, shape (L, K).
            values: Their fitness, shape (L,).
            hints: Their hints, shape (L, H).
            slopes: Their gradients, shape (L, K), where they come with the values; an unknown entry is NaN.
        """
        for k, i in enumerate(self.going()):
            step = tried[k] - self.U[i]
            if values[k] < self.value[i]:
                self.reach[i] = self._next_reach(int(i), step, float(self.value[i] - values[k]))
                if slopes is not None:
                    gradient = np.where(np.isnan(slopes[k]), 0.0, slopes[k])
                    self._bend(int(i), step, gradient)
                    self.gradient[i] = gradient
                self.U[i], self.value[i], self.hint[i], self.last[i] = tried[k], values[k], hints[k], step
            else:
                if slopes is not None and np.isfinite(values[k]) and np.isfinite(slopes[k]).all():
                    self._bend(int(i), step, slopes[k])
                self.last[i] = 0.0
                self.reach[i] = SHRINK * min(float(np.abs(step).max()), self.reach[i])
                self.live[i] = self.reach[i] >= SHORTEST
        self.round += 1
        self.trace = np.vstack([self.trace, self.value])[-1 - self.patience.window :]
        self._give_up()

    def _next_reach(self, i: int, step: Array, gain: float) -> float:
        """Length of the next step behind one that is taken, by how much of the promised gain it has brought."""
        promised = -float(self.gradient[i] @ step + 0.5 * step @ self.B[i] @ step)
        size = float(np.abs(step).max())
        if gain > GOOD * promised:
            return min(max(float(self.reach[i]), GROW * size), LONGEST)
        return max(size if gain > POOR * promised else SHRINK * size, SHORTEST)

    def _give_up(self) -> None:
        """Stop whoever has no prospects."""
        patience = self.patience
        if self.round == patience.halve_at and len(self.value) > 3:
            self.live &= self.value <= max(float(np.quantile(self.value, patience.keep)), self.bar)
        if len(self.trace) > patience.window:
            wanted = np.where(self.value <= self.bar, patience.leading_gain, patience.gain)
            self.live &= self.value <= self.trace[0] * (1.0 - wanted)
        if self.round >= patience.rounds:
            self.live[:] = False

    def state(self) -> dict[str, Any]:
        """Arrays and numbers to carry on from; the region and the patience are the owner's."""
        names = ("U", "value", "hint", "B", "gradient", "last", "reach", "live", "curved", "trace")
        return {f"descents_{name}": getattr(self, name).copy() for name in names} | {
            "descents_round": self.round,
            "descents_bar": repr(float(self.bar)),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any], region: Region, patience: Patience) -> Descents:
        """The descents that :meth:`state` described."""
        K = region.dimension
        U = saved.array(state, "descents_U", (None, K))
        M = len(U)
        value, hint = saved.array(state, "descents_value", (M,)), saved.hints(state, "descents_hint", M)
        descents = cls(region, U, value, hint, 1.0, patience, float(saved.entry(state, "descents_bar")))
        descents.B = saved.array(state, "descents_B", (M, K, K))
        for name, shape in (("gradient", (M, K)), ("last", (M, K)), ("reach", (M,)), ("trace", (None, M))):
            setattr(descents, name, saved.array(state, f"descents_{name}", shape))
        for name in ("live", "curved"):
            setattr(descents, name, saved.flags(state, f"descents_{name}", (M,)))
        descents.round = int(saved.entry(state, "descents_round"))
        return descents
