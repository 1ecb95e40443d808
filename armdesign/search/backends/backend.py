"""What a search needs of whoever evaluates its candidates, and the simplest one: this process."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from armdesign._types import Array
from armdesign.fitness.block import Scores
from armdesign.fitness.robot import Rejections
from armdesign.search.backends.workers import Closing
from armdesign.search.design_problem import DesignProblem


class Backend(Protocol):
    """Evaluates candidates on the task it was made for."""

    def evaluate(
        self, Phi: Array, cutoff: Array, poses: Array | None = None, *, slopes: bool = False, coarse: int = 0
    ) -> tuple[Scores, Rejections]:
        """Scores of designs Phi (N, D) in their order; those past their cutoff (N,) may be dropped.

        Where a start pose is given, poses (N, n) [rad], or (N, K n) for K demonstrations, the first frame is solved
        from it alone; a row that is not finite stands for none. With ``slopes`` the scores have the gradients of r,
        where the objective has any. With ``coarse`` frames the demonstrations are followed on so many of their frames
        alone, see ``DesignProblem.coarse``: what comes of it is to look at, and no fitness.
        """
        ...

    def close(self) -> None:
        """Let go of processes and connections."""
        ...


class InProcess(Closing):
    """Evaluates in this process."""

    def __init__(self, problem: DesignProblem, block: int | None = None) -> None:
        """Allocate a block of arms.

        Args:
            problem: Task and settings.
            block: Arms side by side; any value gives the same scores.
        """
        self.problem, self.block = problem, block
        self.fitness = {0: problem.objective(block)}  # by the number of coarse frames, 0 for all; made when asked for

    def evaluate(
        self, Phi: Array, cutoff: Array, poses: Array | None = None, *, slopes: bool = False, coarse: int = 0
    ) -> tuple[Scores, Rejections]:
        """See Backend.evaluate."""
        if coarse not in self.fitness:
            self.fitness[coarse] = self.problem.coarse(coarse).objective(self.block)
        return self.fitness[coarse].evaluate(Phi, cutoff, poses, slopes=slopes)


def join(parts: Sequence[Scores]) -> Scores:
    """Scores of consecutive chunks as one."""
    names = vars(parts[0])
    return Scores(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})
