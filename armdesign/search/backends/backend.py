"""What a search needs of whoever evaluates its candidates, and the simplest one: this process."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from types import TracebackType
from typing import Protocol, TypeVar

import numpy as np

from armdesign._types import Array
from armdesign.fitness.block import Scores
from armdesign.fitness.robot import Generation, Rejections
from armdesign.search.design_problem import DesignProblem

S = TypeVar("S")


class Backend(Protocol):
    """Evaluates candidates on the task it was made for."""

    def evaluate(
        self, Phi: Array, cutoff: Array, poses: Array | None = None, *, slopes: bool = False
    ) -> tuple[Scores, Rejections]:
        """Scores of designs Phi (N, D) in their order; those past their cutoff (N,) may be dropped.

        Where a start pose is given, poses (N, n) [rad], or (N, K n) for K demonstrations, the first frame is solved
        from it alone; a row that is not finite stands for none. With ``slopes`` the scores have the gradients of r,
        where the objective has any.
        """
        ...

    def close(self) -> None:
        """Let go of processes and connections."""
        ...


class Closing:
    """Makes a backend close when its ``with`` block ends."""

    def close(self) -> None:
        """Let go of what is held; nothing by default."""

    def __enter__(self: S) -> S:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class InProcess(Closing):
    """Evaluates in this process."""

    def __init__(self, problem: DesignProblem, block: int | None = None) -> None:
        """Allocate a block of arms.

        Args:
            problem: Task and settings.
            block: Arms side by side; any value gives the same scores.
        """
        self.fitness = problem.objective(block)

    def evaluate(
        self, Phi: Array, cutoff: Array, poses: Array | None = None, *, slopes: bool = False
    ) -> tuple[Scores, Rejections]:
        """See Backend.evaluate."""
        return self.fitness.evaluate(Phi, cutoff, poses, slopes=slopes)

    def stream(self, first: Generation, more: Callable[[], Generation | None]) -> Iterator[tuple[Scores, Rejections]]:
        """Evaluate chunks one behind the other; see RobotFitness.stream."""
        return self.fitness.stream(first, more)


def join(parts: Sequence[Scores]) -> Scores:
    """Scores of consecutive chunks as one."""
    names = vars(parts[0])
    return Scores(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in names})
