"""Lengths to what tubes are cut to, twists to what brackets give, and all else fitted again.

Twists first, that nearest to a bracket's first: each may become either bracket beside it, what is not settled yet is
fitted again by the gradients of r, and the best few arms go on (a beam search). Then every length is rounded, and moved
by one cut up or down as long as that makes r smaller; where the base stands is fitted again with them. r is that of the
search, with what bodies, obstacles and limits cost.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from armdesign._types import Array
from armdesign.building.room import room_flags
from armdesign.errors import CatalogueError
from armdesign.fitness.objective import Objective
from armdesign.search.evaluation import evaluate_candidate
from armdesign.search.result import Result

BEAM = 4
"""Arms that go on from twist to twist."""
BRACKET = np.pi / 2.0
"""Angle between two brackets [rad]."""
BETWEEN, AFTERWARDS = 25, 60
"""Iterations of the fit between two twists, and after the last."""
MOVES = 12
"""Most moves of single lengths by one cut."""
NOTHING = 1e3
"""In place of an infinite r, for the line search [m]."""


@dataclass(frozen=True, eq=False)
class Refit:
    """The entries of a design and their objective.

    Attributes:
        objective: r of designs.
        lower: Lower bounds of Phi, shape (D,).
        upper: Upper bounds, shape (D,).
        names: Names of the entries of Phi.
    """

    objective: Objective
    lower: Array
    upper: Array
    names: tuple[str, ...]

    def entries(self, *starts: str) -> NDArray[np.intp]:
        """The entries whose names start so."""
        return np.array([i for i, name in enumerate(self.names) if name.startswith(starts)], dtype=np.intp)

    def values(self, Phi: Array) -> Array:
        """Robot fitness of designs, shape (N, D) -> (N,); infinite where they are no arms that begin the task [m]."""
        scores, _ = self.objective.evaluate(Phi)
        values: Array = np.where(np.isfinite(scores.fitness), scores.fitness, np.inf)
        return values

    def fitted(self, Phi: Array, settled: NDArray[np.bool_], iterations: int) -> tuple[float, Array]:
        """Fit the entries that are not settled, by L-BFGS in their box; no worse than before.

        Args:
            Phi: The design, shape (D,).
            settled: Which entries stay, shape (D,).
            iterations: Most iterations.

        Returns:
            r [m] and the design.
        """
        before = float(self.values(Phi[None])[0])
        if settled.all():
            return before, Phi
        found = [(before, Phi)]

        def cost(free: Array) -> tuple[float, Array]:
            x = Phi.copy()
            x[~settled] = free
            scores, _ = self.objective.evaluate(x[None], slopes=True)
            r, slope = float(scores.fitness[0]), scores.slopes[0][~settled]
            if not np.isfinite(r) or not np.isfinite(slope).all():
                return NOTHING, np.zeros(len(free))
            if r < found[-1][0]:
                found.append((r, x))
            return r, slope

        bounds = list(zip(self.lower[~settled], self.upper[~settled], strict=True))
        minimize(cost, Phi[~settled], jac=True, method="L-BFGS-B", bounds=bounds,
                 options={"maxiter": iterations, "maxfun": 2 * iterations})  # fmt: skip
        return found[-1]


def snapped(result: Result, cut: float, *, printed: bool = False, pedestal: float = 0.0) -> Result:
    """A design whose parts can be cut and bought, with its path on the demonstrations.

    Args:
        result: The design; what its settings ask of bodies counts.
        cut: Lengths become multiples of it [m].
        printed: Whether brackets of any angle can be had.
        pedestal: Least length of the first joint's d, where that is free [m].

    Raises:
        CatalogueError: No such arm begins the task.
    """
    problem = result.problem.in_room
    space = problem.space
    lower, upper = (bound.copy() for bound in space.bounds)
    refit = Refit(problem.objective(), lower, upper, space.free_names)
    first = refit.entries("d_0")
    lower[first] = np.minimum(np.maximum(lower[first], pedestal), upper[first])
    Phi = np.clip(space.phi(result.table, result.problem.first.base), refit.lower, refit.upper)
    if not printed:
        Phi = with_brackets(refit, Phi)
    settled = np.isin(np.arange(len(Phi)), [] if printed else refit.entries("alpha_"))
    _, Phi = refit.fitted(Phi, settled, AFTERWARDS)
    Phi = with_cuts(refit, Phi, cut)
    settled[refit.entries("a_", "d_")] = True
    r, Phi = refit.fitted(Phi, settled, AFTERWARDS)
    if not np.isfinite(r):
        other = "--no-snap" if printed else "--printed, for brackets of any angle"
        raise CatalogueError(
            f"no arm with lengths in steps of {cut * 1e3:g} mm{'' if printed else ' and twists of 0 and 90 deg'}, and "
            "with the room that these parts take, does the task", value=cut,
            fix=f"Use {other}, or search with {room_flags(problem.settings.body)}",
        )  # fmt: skip
    seen, evaluation = evaluate_candidate(Phi, problem)
    return Result(seen, evaluation, name=result.name)


def with_brackets(refit: Refit, Phi: Array) -> Array:
    """A design with its twists at those of brackets, by a beam search.

    Args:
        refit: The entries and their objective.
        Phi: The design, shape (D,).
    """
    twists = refit.entries("alpha_")
    away = np.abs(Phi[twists] / BRACKET - np.round(Phi[twists] / BRACKET))
    beam = [(0.0, Phi)]
    settled = np.zeros(len(Phi), dtype=bool)
    for i in twists[np.argsort(away, kind="stable")]:
        settled[i] = True
        found = []
        for _, x in beam:
            below = np.floor(x[i] / BRACKET + 1e-9)
            for angle in BRACKET * np.array([below, below + 1.0]):
                if refit.lower[i] - 1e-9 <= angle <= refit.upper[i] + 1e-9:
                    tried = x.copy()
                    tried[i] = np.clip(angle, refit.lower[i], refit.upper[i])
                    found.append(refit.fitted(tried, settled, BETWEEN))
        found.sort(key=lambda one: one[0])
        beam = found[:BEAM] or beam
    return beam[0][1]


def with_cuts(refit: Refit, Phi: Array, cut: float) -> Array:
    """A design with its lengths in whole cuts: rounded, then moved by single cuts while that helps.

    Args:
        refit: The entries and their objective.
        Phi: The design, shape (D,).
        cut: [m].
    """
    lengths = refit.entries("a_", "d_")
    lowest, highest = np.ceil(refit.lower / cut - 1e-9), np.floor(refit.upper / cut + 1e-9)
    counts = np.clip(np.round(Phi[lengths] / cut), lowest[lengths], highest[lengths])

    def at(moved: Array) -> Array:
        designs = np.tile(Phi, (len(moved), 1))
        designs[:, lengths] = np.clip(moved * cut, refit.lower[lengths], refit.upper[lengths])
        return designs

    best = float(refit.values(at(counts[None]))[0])
    steps = np.concatenate([np.eye(len(lengths)), -np.eye(len(lengths))])
    for _ in range(MOVES):
        moved = counts + steps
        inside = ((moved >= lowest[lengths]) & (moved <= highest[lengths])).all(axis=1)
        values = refit.values(at(moved[inside]))
        if not len(values) or not values.min() < best:
            break
        best, counts = float(values.min()), moved[inside][int(np.argmin(values))]
    chosen: Array = at(counts[None])[0]
    return chosen
