"""How a many-basin search spends its budget."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Recipe:
    """How the budget is spent.

    Attributes:
        sample: Share of the budget for the first sample.
        candidates_per_start: One first descent for so many candidates of the budget.
        spread: Smallest distance of two first descents in unit coordinates.
        first_reach: Length of the first step from the sample.
        reach: Length of the first step from a child.
        descents: Descents begun at a time later on.
        screened: Children evaluated for each of them.
        parents: How many of the best basins have children.
        bar: Rank of the basin that a descent has to compare with in order not to be given up early.
        stall: Share of the budget without a gain after which the search begins anew, its basins kept aside.
        finish: Share of the budget for the evolution.
        sigma: Step size of the evolution of the best basins.
        last_sigma: The same around the winner.
    """

    sample: float = 0.06
    candidates_per_start: int = 400
    spread: float = 0.3
    first_reach: float = 0.15
    reach: float = 0.08
    descents: int = 24
    screened: int = 6
    parents: int = 8
    bar: int = 3
    stall: float = 0.2
    finish: float = 0.06
    sigma: float = 0.03
    last_sigma: float = 0.005
