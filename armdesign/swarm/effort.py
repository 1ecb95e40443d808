"""How much work a search took until it had, in effect, found its result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import SearchError
from armdesign.swarm import checks

TOLERANCE = 0.01


@dataclass(frozen=True)
class Effort:
    """Work until convergence.

    Attributes:
        iterations: W, the first iteration (from 1) whose best is within 1 % of the final best; all of them if nothing
            was found.
        mean_valid: Mean number of valid particles over those iterations.
        computational_effort: CE = mean_valid times W.
        found: Whether the search found anything, that is a finite fitness.
    """

    iterations: int
    mean_valid: float
    computational_effort: float
    found: bool


def converged_at(best: ArrayLike) -> int:
    """The first iteration W, counted from 1, whose best is within 1 % of the final best.

    A run that found nothing (its best is +inf throughout) never converged: W is its number of iterations.

    Args:
        best: Fitness of the global best per iteration, shape (M,).

    Raises:
        SearchError: No iteration, or a best of NaN or -inf.
    """
    values = _bests(best)
    final = values[-1]
    if np.isinf(final):
        return len(values)
    near = values <= final + TOLERANCE * abs(final)
    return int(np.argmax(near)) + 1


def computational_effort(best: ArrayLike, valid: ArrayLike) -> float:
    """CE = mean(valid[:W]) W, with W of :func:`converged_at`.

    Args:
        best: Fitness of the global best per iteration, shape (M,).
        valid: Number of valid particles per iteration, shape (M,).

    Raises:
        SearchError: No iteration, columns of unequal length, a best of NaN or -inf, or a negative count.
    """
    return measure_effort(best, valid).computational_effort


def measure_effort(best: ArrayLike, valid: ArrayLike) -> Effort:
    """The effort of a run, with its parts.

    Args:
        best: Fitness of the global best per iteration, shape (M,).
        valid: Number of valid particles per iteration, shape (M,).

    Raises:
        SearchError: No iteration, columns of unequal length, a best of NaN or -inf, or a negative count.
    """
    values = _bests(best)
    counts = checks.numbers("the counts of valid particles", valid, values.shape)
    for i in np.flatnonzero(~(counts >= 0.0)):
        message = f"the number of valid particles in iteration {i + 1} is {counts[i]:g}"
        raise SearchError(message, value=float(counts[i]), allowed=">= 0")
    W = converged_at(values)
    total = float(counts[:W].sum())  # mean times W, without the rounding
    return Effort(W, total / W, total, bool(np.isfinite(values[-1])))


def _bests(best: ArrayLike) -> Array:
    """The column of bests, checked, shape (M,)."""
    values = checks.numbers("the history of the best fitness", best, (None,))
    if values.size == 0:
        raise SearchError("the history of the best fitness is empty", value=best, fix="Run at least one iteration")
    for i in np.flatnonzero(np.isnan(values) | np.isneginf(values)):
        raise SearchError(f"the best fitness of iteration {i + 1} is {values[i]}", allowed="numbers, or inf for none")
    return values
