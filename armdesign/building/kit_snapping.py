"""A design made of a kit's links and brackets (``kit.py``), and all else fitted again.

Between two joints every piece is tried, either way round: that settles the twist, and with the piece before it d of the
joint between them; extensions stay free. Of the arms that this makes, the best by r without another fit are fitted
again, and the best of these go on to the next pair of joints: the beam search of ``snapping.py``, over pieces.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from armdesign._types import Array
from armdesign.building.kit import EXACT, Kit, Piece
from armdesign.building.snapping import AFTERWARDS, BEAM, BETWEEN, BRACKET, Refit
from armdesign.errors import CatalogueError
from armdesign.search.evaluation import evaluate_candidate
from armdesign.search.result import Result

TRIED = 8
"""Of the arms that an arm of the beam becomes with the kit's pieces, those that are fitted again."""


@dataclass(frozen=True, eq=False)
class KitState:
    """An arm whose first pairs of joints are tied by pieces of a kit.

    Attributes:
        r: Of the arm [m].
        Phi: Its entries, shape (D,).
        settled: Which entries stay, shape (D,).
        lower: Lower bounds of the others, shape (D,).
        upper: Upper bounds, shape (D,).
        behind: The last piece; None before the first.
    """

    r: float
    Phi: Array
    settled: NDArray[np.bool_]
    lower: Array
    upper: Array
    behind: Piece | None

    def fitted(self, refit: Refit, iterations: int) -> KitState:
        """The same with what is not settled fitted again.

        Args:
            refit: The entries and their objective.
            iterations: Most iterations.
        """
        within = replace(refit, lower=self.lower, upper=self.upper)
        r, Phi = within.fitted(self.Phi, self.settled, iterations)
        return replace(self, r=r, Phi=Phi)


class Sizes(NamedTuple):
    """What pieces of a kit have to fit.

    Attributes:
        heights: Of the actuators, n of them [m].
        shortest: Least extension of a link [m].
        fixed: Values of the design's entries that are not in Phi.
    """

    heights: tuple[float, ...]
    shortest: float
    fixed: dict[str, float]


def snapped_to_kit(result: Result, heights: Sequence[float], kit: Kit) -> Result:
    """A design of a kit's links and brackets, with its path on the demonstrations.

    Args:
        result: The design; what its settings ask of bodies counts.
        heights: Of the actuators, from the face they are mounted with to the flange, n of them [m].
        kit: The kit.

    Raises:
        CatalogueError: No arm of the kit within the settings begins the task.
    """
    problem = result.problem.in_room
    space = problem.space
    refit = Refit(problem.objective(), *space.bounds, space.free_names)
    Phi = np.clip(space.phi(result.table, result.problem.first.base), refit.lower, refit.upper)
    settled = np.zeros(len(Phi), dtype=bool)
    sizes = Sizes(tuple(heights), kit.shortest, dict(zip(space.names, space.lower.tolist(), strict=True)))
    states = [KitState(float(refit.values(Phi[None])[0]), Phi, settled, refit.lower, refit.upper, None)]
    n = result.table.dof
    for k in range(1, n):
        begun_with: list[KitState] = []
        for state in states:
            made = [each for piece in kit.pieces for each in with_piece(refit, state, (k, n), piece, sizes)]
            if not made:
                continue
            values = refit.values(np.stack([each.Phi for each in made]))
            best = np.argsort(values, kind="stable")[:TRIED]
            begun_with += [made[i].fitted(refit, BETWEEN) for i in best]
        begun_with.sort(key=lambda each: each.r)
        states = begun_with[:BEAM]
    found = [state.fitted(refit, AFTERWARDS) for state in states]
    best_state = min(found, key=lambda each: each.r, default=None)
    if best_state is None or not np.isfinite(best_state.r):
        raise CatalogueError(
            f"no arm of the kit's links, which are {kit.shortest * 1e3:g} mm long at least, and brackets does the task "
            "within the bounds of the search", value=None,
            fix="Use --no-snap, widen the bounds of alpha, a and d and search again, or take more joints",
        )  # fmt: skip
    seen, evaluation = evaluate_candidate(best_state.Phi, problem)
    return Result(seen, evaluation, name=result.name)


def with_piece(
    refit: Refit, state: KitState, joints: tuple[int, int], piece: Piece, sizes: Sizes
) -> Iterator[KitState]:
    """The arms that an arm becomes with a piece between joints k and k + 1, both ways round.

    Args:
        refit: The entries of Phi.
        state: The arm, tied up to joint k.
        joints: k and n.
        piece: The piece.
        sizes: What it has to fit.
    """
    k, n = joints
    height, shortest = sizes.heights[k - 1], sizes.shortest
    wanted: dict[str, tuple[float, float]] = {}
    ends: dict[str, tuple[float, float]] = {}
    u = (shortest, np.inf) if piece.extends == "u" else (piece.u, piece.u)
    w = (shortest, np.inf) if piece.extends == "w" else (piece.w, piece.w)
    if state.behind is None:
        ends["d_0"] = (height + u[0], np.inf)
    else:
        behind = (shortest, np.inf) if state.behind.extends == "w" else (state.behind.w, state.behind.w)
        wanted[f"d_{k - 1}"] = (behind[0] + height + u[0], behind[1] + height + u[1])
    if k == n - 1:
        ends[f"d_{k}"] = (w[0] + sizes.heights[k], np.inf)
    wanted[f"a_{k}"] = (0.0, 0.0) if piece.square else (shortest, np.inf)
    for twist in (BRACKET, -BRACKET) if piece.square else (None,):
        turned = {} if twist is None else {f"alpha_{k}": (twist, twist)}
        tied = bounded(refit, state, wanted | turned, sizes.fixed)
        if tied is not None:
            # the parts to be made at base and tool may also reach back: as far on as the bounds let them
            yield replace(bounded(refit, tied, ends, sizes.fixed) or tied, behind=piece)


def bounded(
    refit: Refit, state: KitState, limits: dict[str, tuple[float, float]], fixed: dict[str, float]
) -> KitState | None:
    """An arm with entries within limits; None where the bounds of the search do not let them.

    Args:
        refit: The entries of Phi.
        state: The arm.
        limits: {entry: least and most}.
        fixed: Values of entries that are not in Phi.
    """
    Phi, lower, upper = state.Phi.copy(), state.lower.copy(), state.upper.copy()
    for name, (least, most) in limits.items():
        if name not in refit.names:
            if not least - EXACT <= fixed[name] <= most + EXACT:
                return None
            continue
        i = refit.names.index(name)
        if least > upper[i] + EXACT or most < lower[i] - EXACT:
            return None
        # bounds in degrees may be a rounding off a right angle, which is exact
        lower[i], upper[i] = (least, most) if least == most else (max(lower[i], least), min(upper[i], most))
        Phi[i] = np.clip(Phi[i], lower[i], upper[i])
    return replace(state, Phi=Phi, lower=lower, upper=upper, settled=state.settled | (upper - lower <= EXACT))
