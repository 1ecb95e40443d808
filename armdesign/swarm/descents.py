"""Many local descents side by side: gradients, quasi-Newton steps in a box and a slab.

Every descent is at its own place; all of them ask at once for a few steps of different length, of which the best
counts if it is better. Gradients come with the values of the steps, or from probes by forward differences. What a
descent costs beyond its gain is cut: after a few rounds the worse ones are given up, later those that hardly move.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armdesign.swarm import saved
from armdesign.swarm.quasi_newton import best_steps, updated
from armdesign.swarm.region import Region
from armdesign.swarm.space import Array, Mask

SCALES = np.array([1.4, 0.4])
"""Lengths of the steps that are tried, in terms of the last one that was taken."""
PROBE = 3e-4
"""Length of the probes in unit coordinates: far above the solver's tolerance, far below a basin's width."""
STEEPEST = 50.0
"""Largest slope taken seriously, as of a jump within the probe."""
LONGEST, SHORTEST = 0.3, 1e-5
SHRINK = 0.1


@dataclass(frozen=True)
class Patience:
    """When a descent is given up.

    Attributes:
        halve_at: Round after which only the better ones go on.
        keep: Share of them.
        window: Rounds over which it has to gain ...
        gain: ... this much, relative.
        rounds: Most rounds.
    """

    halve_at: int = 6
    keep: float = 0.5
    window: int = 6
    gain: float = 0.008
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
            bar: A fitness that is good enough not to be given up at ``halve_at``.
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

    def signs(self) -> Array:
        """Directions of the probes of the live ones, shape (L, K): forward, but backward at an upper bound."""
        return np.where(self.U[self.live] + PROBE > 1.0, -1.0, 1.0)

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
        """Take the gradients of the live ones, shape (L, K); an unknown entry counts as flat."""
        gradients = np.where(np.isnan(slopes), 0.0, slopes)
        for gradient, i in zip(gradients, self.going(), strict=True):
            self._bend(int(i), gradient)

    def _bend(self, i: int, gradient: Array) -> None:
        """Take the gradient of one descent, and the curvature that it shows along the last step."""
        step = self.last[i]
        if np.any(step):
            change = gradient - self.gradient[i]
            first = not self.curved[i]
            self.B[i] = updated(self.B[i], step, change, first=first)
            self.curved[i] |= first and float(step @ change) > 0.0
        self.gradient[i] = gradient

    def steps(self) -> tuple[Array, Array]:
        """Steps of the live ones, as many for each as there are SCALES.

        Returns:
            Unit coordinates, shape (L S, K), and hints, shape (L S, H).
        """
        owners = np.repeat(self.going(), len(SCALES))
        reach = self.reach[owners] * np.tile(SCALES, len(owners) // len(SCALES))
        moves = best_steps(self.region, self.U[owners], self.gradient[owners], self.B[owners], reach, self.margin)
        return np.clip(self.U[owners] + moves, 0.0, 1.0), self.hint[owners]

    def move(self, tried: Array, values: Array, hints: Array, slopes: Array | None = None) -> None:
        """Take the best of the steps where it is better, and give up whoever is out of patience.

        Args:
            tried: What ``steps`` gave, shape (L S, K).
            values: Their fitness, shape (L S,).
            hints: Their hints, shape (L S, H).
            slopes: Their gradients, shape (L S, K), where they are known; learned for the steps that are taken.
        """
        table = values.reshape(-1, len(SCALES))
        for row, (i, best) in enumerate(zip(self.going(), np.argmin(table, axis=1), strict=True)):
            k = row * len(SCALES) + int(best)
            if values[k] < self.value[i]:
                self.last[i] = tried[k] - self.U[i]
                self.U[i], self.value[i], self.hint[i] = tried[k], values[k], hints[k]
                if slopes is not None:
                    self._bend(int(i), slopes[k])
                self.reach[i] = np.clip(np.abs(self.last[i]).max(), SHRINK * self.reach[i], LONGEST)
            else:
                self.last[i] = 0.0
                self.reach[i] *= SHRINK
                self.live[i] = self.reach[i] >= SHORTEST
        self.round += 1
        self.trace = np.vstack([self.trace, self.value])[-1 - self.patience.window :]
        self._give_up()

    def _give_up(self) -> None:
        """Stop whoever has no prospects."""
        patience = self.patience
        if self.round == patience.halve_at and len(self.value) > 3:
            self.live &= self.value <= max(float(np.quantile(self.value, patience.keep)), self.bar)
        if len(self.trace) > patience.window:
            self.live &= self.value <= self.trace[0] * (1.0 - patience.gain)
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
